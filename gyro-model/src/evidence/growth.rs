//! Noise that grows with the rate: whether a residual has it, and how much.

use super::{
    likelihood::{self, AFTER, Limits, WORTH},
    study::Study,
    whiten::{NoiseModel, Rows, Whitener},
};

/// ∫ω²dt at the reference rows, of the axes in the mean, rad²/s.
pub(super) fn turned(study: &Study) -> Vec<f64> {
    let series = &study.bench.problem.series;
    let mut sums = vec![0.0; study.bench.problem.times().len()];
    for (s, warm) in series.iter().zip(&study.warm) {
        let (mut sum, mut next) = (0.0, 0);
        for (out, &row) in sums.iter_mut().zip(&s.reference_rows) {
            for k in next..=row {
                sum += warm.rate[k] * warm.rate[k] * s.dt(k) / series.len() as f64;
            }
            next = row + 1;
            *out += sum;
        }
    }
    sums
}

/// The mean square of the rate, rad²/s².
pub(crate) fn rate_square(study: &Study) -> f64 {
    let t = study.bench.problem.times();
    turned(study).last().map_or(0.0, |turned| turned / (t[t.len() - 1] - t[0]))
}

/// The noise that also grows with the rate, where it is so much likelier. What is more than the wander of any sensor is not
/// noise: then something is missing that the rate may have more of, and the question comes too early.
pub(super) fn growing(noise: &NoiseModel, rows: &Rows, residual: &[Vec<f64>], limits: &Limits) -> Option<NoiseModel> {
    if noise.rate_random_walk > 0.0 || noise.beyond_wander() || !grows(rows, residual, noise) {
        return None;
    }
    let before = likelihood::seek(noise, rows, residual, limits, 0).1;
    let (turned, span) = (rows.turned.iter().sum::<f64>(), rows.t.last()? - rows.t.first()?);
    let rate_random_walk = 0.7 * noise.angle_random_walk * (span / turned).sqrt();
    let start = NoiseModel { angle_random_walk: 0.7 * noise.angle_random_walk, rate_random_walk, ..*noise };
    let (found, cost) = likelihood::seek(&start, rows, residual, limits, AFTER);
    (cost < before - 0.5 * WORTH).then_some(found)
}

/// Whether the whitened residual's squares are larger where the log turns faster, by two standard errors of noise that
/// does not grow.
fn grows(rows: &Rows, residual: &[Vec<f64>], noise: &NoiseModel) -> bool {
    let whitener = Whitener::new(noise, rows);
    let [mut n, mut x, mut xx, mut y, mut xy] = [0.0; 5];
    for white in whitener.apply_each(residual) {
        for i in 1..rows.t.len() {
            let e = white[rows.index[i]];
            if e != 0.0 {
                let (rate, square) = (rows.turned[i] / (rows.t[i] - rows.t[i - 1]), e * e);
                (n, x, xx, y, xy) = (n + 1.0, x + rate, xx + rate * rate, y + square, xy + rate * square);
            }
        }
    }
    let (along, spread) = (xy - x * y / n, xx - x * x / n);
    // The square of a normal number has variance 2.
    along > 2.0 * (2.0 * spread).sqrt()
}
