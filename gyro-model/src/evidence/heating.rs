//! How fast a measured temperature rises, dT/dt, with the whole log at hand.
//!
//! The slope is that of a cubic through the readings within ±h, near the ends through those that there are. A short h follows
//! the readings' noise, which then is an angle that the reference does not see; a long one misses the heating. The h is taken
//! that says best what was left out (cross-validation): of means over stretches so long that each has a reading of its own.

use super::integrate::{hermite, three_point_slopes};
use nalgebra::{SMatrix, SVector};

/// Half widths h that are tried, s.
const HALVES: [f64; 4] = [2.0, 4.0, 8.0, 16.0];
/// Shortest stretch that one mean is of, s.
const STRETCH: f64 = 0.25;
/// Stretches on either side that a cubic takes at least.
const ASIDE: f64 = 4.0;
/// Coefficients of a cubic.
const CUBIC: usize = 4;

/// dT/dt at each time, K/s; zero where there is nothing to tell it from.
#[must_use]
pub(super) fn heating(t: &[f64], temperature: &[f64]) -> Vec<f64> {
    let (at, means) = means(t, temperature);
    if at.len() < 2 {
        return vec![0.0; t.len()];
    }
    let apart = (at[at.len() - 1] - at[0]) / (at.len() - 1) as f64;
    let least = ASIDE * apart;
    let halves = HALVES.into_iter().filter(|half| *half > least).chain([least]);
    let tried = halves.map(|half| slopes(&at, &means, half));
    let Some((slopes, _)) = tried.min_by(|a, b| a.1.total_cmp(&b.1)) else { return vec![0.0; t.len()] };
    let bends = three_point_slopes(&at, &slopes);
    let mut hint = 0;
    t.iter().map(|&t| hermite(&at, &slopes, &bends, t, &mut hint)).collect()
}

/// Means over stretches in which a temperature that is reported seldom, or in coarse steps, mostly changes; and the mean times.
fn means(t: &[f64], temperature: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (Some(first), Some(last)) = (t.first(), t.last()) else { return (Vec::new(), Vec::new()) };
    let changes = temperature.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let stretch = STRETCH.max((last - first) / changes.max(1) as f64);
    let stretches = t.chunk_by(|a, b| ((a - first) / stretch).floor() == ((b - first) / stretch).floor());
    let mut from = 0;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    stretches
        .map(|of| {
            let own = from..from + of.len();
            from = own.end;
            (mean(of), mean(&temperature[own]))
        })
        .unzip()
}

/// Slope at each time of the cubic through what lies within ±`half`, and the sum of squares by which cubics without a value miss
/// it.
fn slopes(t: &[f64], y: &[f64], half: f64) -> (Vec<f64>, f64) {
    let (mut from, mut to, mut missed) = (0, 0, 0.0);
    let slopes = (0..t.len())
        .map(|k| {
            while t[from] < t[k] - half - 1e-9 {
                from += 1;
            }
            while to < t.len() && t[to] <= t[k] + half + 1e-9 {
                to += 1;
            }
            // Beside a gap there may be too few.
            let around = from.min(k.saturating_sub(1))..to.max((k + 2).min(t.len()));
            let order = CUBIC.min(around.len() - 1).max(2);
            // The normal equations of the cubic: sums of powers of the time, and of those times the readings.
            let (mut squares, mut right) = (SMatrix::<f64, CUBIC, CUBIC>::identity(), SVector::<f64, CUBIC>::zeros());
            squares.view_mut((0, 0), (order, order)).fill(0.0);
            for row in around {
                let x = (t[row] - t[k]) / half;
                let powers = [1.0, x, x * x, x * x * x];
                for i in 0..order {
                    right[i] += powers[i] * (y[row] - y[k]);
                    (0..order).for_each(|j| squares[(i, j)] += powers[i] * powers[j]);
                }
            }
            let Some(inverse) = squares.try_inverse() else { return 0.0 };
            let fitted = inverse * right;
            // Without its own value a fit misses it by (y − ŷ)/(1 − leverage).
            missed += (fitted[0] / (1.0 - inverse[(0, 0)]).max(1e-9)).powi(2);
            fitted[1] / half
        })
        .collect();
    (slopes, missed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// Largest error of ∫dT/dt dt, K, beyond its mean: what an angle gets of it.
    fn off(truth: impl Fn(f64) -> f64, measured: impl Fn(f64, f64) -> f64) -> f64 {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let noise = Normal::new(0.0, 0.02).unwrap();
        let t: Vec<f64> = (0..12_000).map(|k| f64::from(k) * 0.01).collect();
        let readings: Vec<f64> = t.iter().map(|&t| measured(t, noise.sample(&mut random))).collect();
        let integral = super::super::integrate::integral(&t, &heating(&t, &readings));
        let errors: Vec<f64> = t.iter().zip(&integral).map(|(&t, sum)| sum - truth(t)).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        errors.iter().fold(0.0, |most, e| most.max((e - mean).abs()))
    }

    fn slow(t: f64) -> f64 {
        23.0 + 9.0 * (1.0 - (-t / 70.0).exp()) + 1.3 * (0.12 * t).sin()
    }

    fn quick(t: f64) -> f64 {
        23.0 + 2.0 * (1.0 - (-t / 8.0).exp()) + 0.5 * (0.25 * t).sin()
    }

    #[test]
    fn its_integral_is_the_temperature_though_that_is_noisy() {
        let step = |v: f64| (v * 100.0).round() / 100.0;
        assert!(off(slow, |t, noise| step(slow(t) + noise)) < 0.01);
        assert!(off(quick, |t, noise| step(quick(t) + noise)) < 0.01);
        assert!(off(quick, |t, _| quick(t)) < 5e-4);
    }

    #[test]
    fn a_temperature_that_comes_once_a_second_or_in_coarse_steps_is_followed_too() {
        let seldom = off(slow, |t, _| slow(t.floor()));
        assert!(seldom < 0.2, "{seldom}");
        let coarse = off(slow, |t, _| (slow(t) * 2.0).round() / 2.0);
        assert!(coarse < 0.3, "{coarse}");
    }

    #[test]
    fn what_says_nothing_rises_by_nothing() {
        assert_eq!(heating(&[], &[]), [0.0; 0]);
        assert_eq!(heating(&[1.0], &[20.0]), [0.0]);
        assert_eq!(heating(&[0.0, 0.01, 0.02, 50.0, 50.01], &[20.0; 5]), [0.0; 5]);
    }
}
