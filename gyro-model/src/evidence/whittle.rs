//! The noise of a residual from its periodogram: Whittle's approximation of the likelihood.
//!
//! A likelihood through the Kalman filter costs a pass over the log; this one costs a pass over some ninety frequency
//! bands, so it can be searched from many starts. For steps d of the residual angle between rows Δt apart the model of
//! [`super::whiten`] has, at ω radians a row, the power
//!
//! ```text
//! S(ω) = N²Δt + B²Δt³/(2 − 2cos ω) + s²Δt²(1 − φ²)/(1 + φ² − 2φ cos ω) + R(2 − 2cos ω),   φ = e^(−Δt/T)
//! −ln L ≈ ½ Σ_bands m (ln S + I/S)
//! ```
//!
//! with I the mean of the m periodogram values in a band (Whittle 1953; Hann taper). Rows are taken as evenly spaced:
//! it chooses where the exact likelihood starts from, no more.

use super::{
    spectrum::{fast_length, hann, power},
    whiten::NoiseModel,
};

/// Mean power in bands of frequency.
pub(crate) struct Periodogram {
    dt: f64,
    span: f64,
    bands: Vec<Band>,
}

#[derive(Clone, Copy)]
struct Band {
    /// cos ω in its middle.
    cos: f64,
    /// Values in it.
    count: f64,
    /// Their mean, rad².
    power: f64,
}

/// Ratio of a band's upper to its lower edge.
const WIDTH: f64 = 1.08;
/// Evaluations of each search.
const EVALUATIONS: usize = 300;
/// Correlation times that a search starts from, as shares of the log.
const TIMES: [f64; 4] = [1e-4, 1e-3, 1e-2, 0.05];

impl Periodogram {
    /// Of a residual's steps, its channels summed; `None` where the rows are too few.
    #[must_use]
    pub(crate) fn new(residual: &[Vec<f64>], t: &[f64]) -> Option<Self> {
        let n = fast_length(t.len().checked_sub(1).filter(|&n| n >= 64)?);
        let dt = (t[n] - t[0]) / n as f64;
        let taper = hann(n);
        let norm = taper.iter().map(|w| w * w).sum::<f64>();
        let mut total = vec![0.0; n / 2 + 1];
        for channel in residual {
            let mean = (channel[n] - channel[0]) / n as f64;
            let steps = channel.windows(2).zip(&taper).map(|(pair, w)| w * (pair[1] - pair[0] - mean));
            let own = power(&mut steps.collect::<Vec<f64>>());
            total.iter_mut().zip(own).for_each(|(sum, own)| *sum += own / norm);
        }
        let channels = residual.len() as f64;
        let (mut bands, mut from) = (Vec::new(), 1);
        while from < total.len() {
            let to = ((from as f64 * WIDTH) as usize).max(from + 1).min(total.len());
            let sum: f64 = total[from..to].iter().sum();
            let count = (to - from) as f64;
            let middle = std::f64::consts::TAU * 0.5 * (from + to - 1) as f64 / n as f64;
            bands.push(Band { cos: middle.cos(), count: count * channels, power: sum / (count * channels) });
            from = to;
        }
        Some(Self { dt, span: t[n] - t[0], bands })
    }

    /// −ln L of a noise, constants left out; noise that grows with the rate is not counted.
    #[must_use]
    pub(crate) fn cost(&self, noise: &NoiseModel) -> f64 {
        if noise.forgets_later_than(self.span) {
            return 1e300;
        }
        let dt = self.dt;
        let white = noise.angle_random_walk.powi(2) * dt;
        let walk = noise.bias_random_walk.powi(2) * dt.powi(3);
        let encoder = noise.encoder.powi(2);
        let phi = (-dt / noise.correlation_time).exp();
        let correlated = (noise.correlated * dt).powi(2) * (1.0 - phi * phi);
        let cost: f64 = self
            .bands
            .iter()
            .map(|band| {
                let high = 2.0 - 2.0 * band.cos;
                let lorentz = correlated / (1.0 + phi * phi - 2.0 * phi * band.cos);
                let s = white + walk / high + lorentz + encoder * high + 1e-40;
                band.count * (s.ln() + band.power / s)
            })
            .sum();
        if cost.is_finite() { 0.5 * cost } else { 1e300 }
    }

    /// The likeliest noise without and with a correlated rate, sought from `start`.
    #[must_use]
    pub(crate) fn search(&self, start: &NoiseModel) -> (NoiseModel, NoiseModel) {
        let seek = |p: &[f64]| simplex(p, 0.7, EVALUATIONS, |p| self.cost(&NoiseModel::from_logs(p)));
        let plain = NoiseModel { correlated: 0.0, rate_random_walk: 0.0, ..*start };
        let mut few = seek(&plain.logs());
        for walk in [1e-3, 0.1, 1.0] {
            let n = few.0[0].exp();
            let other = seek(&NoiseModel { angle_random_walk: n, bias_random_walk: walk * n, ..plain }.logs());
            if other.1 < few.1 {
                few = other;
            }
        }
        let n = few.0[0].exp();
        let many = TIMES
            .iter()
            .map(|share| {
                let time = share * self.span;
                let correlated = n / time.sqrt();
                seek(&NoiseModel { correlated, correlation_time: time, ..NoiseModel::from_logs(&few.0) }.logs())
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let few = NoiseModel::from_logs(&few.0);
        (few, many.map_or(few, |m| NoiseModel::from_logs(&m.0)))
    }
}

/// Minimum of `f` by the simplex of Nelder and Mead from `start` with first steps `scale`.
fn simplex(start: &[f64], scale: f64, evaluations: usize, mut f: impl FnMut(&[f64]) -> f64) -> (Vec<f64>, f64) {
    let n = start.len();
    let mut points: Vec<(Vec<f64>, f64)> = Vec::with_capacity(n + 1);
    for k in 0..=n {
        let mut p = start.to_vec();
        if k > 0 {
            p[k - 1] += scale;
        }
        let value = f(&p);
        points.push((p, value));
    }
    let mut used = n + 1;
    while used < evaluations {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        if points[n].1 - points[0].1 < 1e-3 {
            break;
        }
        let centre: Vec<f64> = (0..n).map(|i| points[..n].iter().map(|p| p.0[i]).sum::<f64>() / n as f64).collect();
        let towards = |factor: f64, worst: &[f64]| -> Vec<f64> {
            centre.iter().zip(worst).map(|(c, w)| c + factor * (w - c)).collect()
        };
        let reflected = towards(-1.0, &points[n].0);
        let value = f(&reflected);
        used += 1;
        if value < points[0].1 {
            let expanded = towards(-2.0, &points[n].0);
            let further = f(&expanded);
            used += 1;
            points[n] = if further < value { (expanded, further) } else { (reflected, value) };
        } else if value < points[n - 1].1 {
            points[n] = (reflected, value);
        } else {
            let contracted = towards(0.5, &points[n].0);
            let inside = f(&contracted);
            used += 1;
            if inside < points[n].1 {
                points[n] = (contracted, inside);
            } else {
                let best = points[0].0.clone();
                for point in points.iter_mut().skip(1) {
                    for (x, b) in point.0.iter_mut().zip(&best) {
                        *x = 0.5 * (*x + b);
                    }
                    point.1 = f(&point.0);
                    used += 1;
                }
            }
        }
    }
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points.swap_remove(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_parts_of_a_noise_are_found_to_a_tenth() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (dt, walk, encoder) = (0.01_f64, 3e-4, 2e-4);
        let (mut angle, mut correlated) = (0.0, 0.0);
        let phi = (-dt / 0.5_f64).exp();
        let residual: Vec<f64> = (0..20_000)
            .map(|_| {
                correlated = phi * correlated + 2e-3 * (1.0 - phi * phi).sqrt() * normal();
                angle += walk * dt.sqrt() * normal() + correlated * dt;
                angle + encoder * normal()
            })
            .collect();
        let t: Vec<f64> = (0..20_000).map(|k| f64::from(k) * dt).collect();
        let start = NoiseModel {
            angle_random_walk: 1e-4,
            bias_random_walk: 1e-6,
            encoder: 1e-4,
            correlated: 0.0,
            correlation_time: 1.0,
            rate_random_walk: 0.0,
        };
        let (_, found) = Periodogram::new(&[residual], &t).expect("long enough").search(&start);
        assert!((found.angle_random_walk / walk - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.encoder / encoder - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.correlated / 2e-3 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.correlation_time / 0.5).ln().abs() < 0.3, "{found:?}");
    }
}
