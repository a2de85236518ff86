//! A reading against its neighbours: the externally studentised deleted residual of a cubic.
//!
//! The cubic is fitted by least squares to the four readings on either side, without the one that is judged (D. A. Belsley,
//! E. Kuh, R. E. Welsch, Regression Diagnostics, 1980, §2.1):
//!
//! ```text
//! t = (x_k − x̂_(k)) / (s √(1 + h)),   h = a₀ᵀ (AᵀA)⁻¹ a₀
//! ```
//!
//! s is the largest of three scales: what the neighbours miss their cubic by, and the noise of the fourth differences over
//! the whole channel and nearby, each by its median absolute deviation (a Hampel identifier). So a spike is judged at the
//! noise of the log, and fast motion, jerks and vibrations, which the neighbours show as well, are none.

use super::{
    channel::Readings,
    thresholds::{AT_AN_END, HOLE, RECURRING, UNEVEN},
};
use crate::order::quantile;
use nalgebra::{Matrix4, Vector4};

/// Readings on either side.
const REACH: usize = 4;
/// Standard deviation over the median absolute deviation, of normal noise.
const NORMAL: f64 = 1.4826;
/// Standard deviation of the distance from the four nearest readings' cubic, over that of a reading: √(1 + 34/36).
const FOURTH: f64 = 1.394;
/// Fourth differences on either side that tell the noise nearby.
const NEARBY: usize = 12;
/// Times that a channel is gone over.
const PASSES: usize = 12;

/// A reading that lies apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Apart {
    /// Its index among the channel's readings.
    pub(super) index: usize,
    /// By how much it is too large, SI.
    pub(super) size: f64,
    /// In standard deviations, at least 0.
    pub(super) times: f64,
}

/// One channel, and which of its readings count.
pub(super) struct Neighbours<'a> {
    readings: &'a Readings,
    /// Where stretches without hole begin: index of the stretch of each reading.
    stretch: Vec<usize>,
    is_out: Vec<bool>,
    /// Least standard deviation of a reading: its noise over the whole channel, one step at least.
    pub(super) noise: f64,
    /// Distance of each from the cubic through the nearest four, NaN where they are not all there.
    fourth: Vec<f64>,
    /// Below it a dead zone may lie.
    zone: f64,
    /// Between the least and the largest of nearly all readings.
    range: f64,
}

impl<'a> Neighbours<'a> {
    /// `None` for a channel of so few readings that nothing is usual.
    pub(super) fn new(readings: &'a Readings) -> Option<Self> {
        let n = readings.values.len();
        if n < 5 * REACH {
            return None;
        }
        let apart: Vec<f64> = readings.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mean = apart.iter().sum::<f64>() / apart.len() as f64;
        let longest = HOLE * quantile(apart.clone(), 0.5)?.max(mean);
        let mut stretch = vec![0; n];
        for k in 1..n {
            stretch[k] = stretch[k - 1] + usize::from(apart[k - 1] > longest);
        }
        let nonzero = readings.values.iter().map(|x| x.abs()).filter(|&x| x > 0.0).collect();
        let zone = 2.0 * quantile(nonzero, 0.01)?;
        let ends = [0.005, 0.995].map(|q| quantile(readings.values.clone(), q));
        let range = ends[1]? - ends[0]?;
        let mut new =
            Self { readings, stretch, is_out: vec![false; n], noise: 0.0, fourth: vec![f64::NAN; n], zone, range };
        new.refresh();
        let all: Vec<f64> = new.fourth.iter().map(|x| x.abs()).filter(|x| x.is_finite()).collect();
        let step = super::quantum(&readings.values);
        let noise = NORMAL / FOURTH * quantile(all, 0.5)?;
        new.noise = if step.is_finite() { noise.max(step) } else { noise };
        (new.noise > 0.0).then_some(new)
    }

    /// All readings that lie apart by so many standard deviations at least. Near one another the one that lies furthest
    /// goes first, and the others are judged anew.
    pub(super) fn apart(&mut self, times: f64) -> Vec<Apart> {
        let mut found: Vec<Apart> = Vec::new();
        for _ in 0..PASSES {
            let judged = (0..self.is_out.len()).filter_map(|k| self.judge(k));
            let flagged: Vec<Apart> = judged.filter(|apart| apart.times > times).collect();
            let leads = |(i, own): &(usize, &Apart)| {
                let near = &flagged[i.saturating_sub(REACH)..(i + REACH + 1).min(flagged.len())];
                near.iter().all(|other| other.index.abs_diff(own.index) > REACH || other.size.abs() <= own.size.abs())
            };
            let leading: Vec<Apart> = flagged.iter().enumerate().filter(leads).map(|(_, own)| *own).collect();
            if leading.is_empty() {
                break;
            }
            for apart in &leading {
                self.is_out[apart.index] = true;
            }
            self.refresh();
            found.extend(leading);
        }
        found.sort_by_key(|apart| apart.index);
        found
    }

    /// The distance of each reading from the cubic through the nearest four.
    fn refresh(&mut self) {
        let x = &self.readings.values;
        for k in 2..x.len().saturating_sub(2) {
            let whole = !self.is_out[k - 2..=k + 2].contains(&true) && self.stretch[k - 2] == self.stretch[k + 2];
            self.fourth[k] =
                if whole { x[k] - (4.0 * (x[k - 1] + x[k + 1]) - x[k - 2] - x[k + 2]) / 6.0 } else { f64::NAN };
        }
    }

    /// One reading; `None` where it is sure to lie where its neighbours say, or too few are there.
    fn judge(&self, k: usize) -> Option<Apart> {
        // Nine tenths of what a spike is by itself show here.
        if self.is_out[k] || self.fourth[k].abs() < 0.9 * RECURRING * self.noise {
            return None;
        }
        let near = self.near(k);
        let value = |i: &usize| self.readings.values[*i];
        let mut best = self.fitted(k, &near)?;
        // About a dead zone's edge zero and its edge take turns.
        let is_at_zone = near.iter().chain([&k]).any(|i| value(i) == 0.0) && value(&k).abs() <= self.zone;
        if is_at_zone && best.size.abs() <= self.zone {
            return None;
        }
        if best.scatter > 2.0 * self.noise {
            for skipped in 0..near.len() {
                let fewer: Vec<usize> = near.iter().copied().filter(|i| *i != near[skipped]).collect();
                if let Some(fit) = self.fitted(k, &fewer).filter(|fit| fit.scatter < best.scatter) {
                    best = fit;
                }
            }
        }
        // From one side alone a corner is no corner.
        let fewest = near.iter().filter(|i| **i < k).count().min(near.iter().filter(|i| **i > k).count());
        if best.uneven > UNEVEN * best.size.abs() || fewest < 2 && best.size.abs() < AT_AN_END * self.range {
            return None;
        }
        let scale = best.scatter.max(self.noise).max(self.nearby(k));
        Some(Apart { index: k, size: best.size, times: best.size.abs() / (scale * best.widens) })
    }

    /// Noise near a reading.
    fn nearby(&self, k: usize) -> f64 {
        let span = k.saturating_sub(NEARBY)..(k + NEARBY + 1).min(self.fourth.len());
        let sizes = span.filter(|i| i.abs_diff(k) > 2).map(|i| self.fourth[i].abs()).filter(|x| x.is_finite());
        NORMAL / FOURTH * quantile(sizes.collect(), 0.5).unwrap_or(0.0)
    }

    /// The neighbours that count, four on either side where there are as many; at an end more of the other side.
    fn near(&self, k: usize) -> Vec<usize> {
        let counts = |i: &usize| !self.is_out[*i] && self.stretch[*i] == self.stretch[k];
        let (first, last) = (k.saturating_sub(3 * REACH), (k + 3 * REACH + 1).min(self.is_out.len()));
        let before: Vec<usize> = (first..k).rev().filter(counts).take(2 * REACH).collect();
        let after: Vec<usize> = (k + 1..last).filter(counts).take(2 * REACH).collect();
        let (of_before, of_after) =
            (REACH.max((2 * REACH).saturating_sub(after.len())), REACH.max((2 * REACH).saturating_sub(before.len())));
        before.into_iter().take(of_before).chain(after.into_iter().take(of_after)).collect()
    }

    fn fitted(&self, k: usize, near: &[usize]) -> Option<Fit> {
        if near.len() < 2 * REACH - 1 {
            return None;
        }
        let row = |i: usize| {
            let x = (i as f64 - k as f64) / REACH as f64;
            Vector4::new(1.0, x, x * x, x * x * x)
        };
        let (mut square, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for &i in near {
            square += row(i) * row(i).transpose();
            right += row(i) * (self.readings.values[i] - self.readings.values[near[0]]);
        }
        let inverse = square.try_inverse()?;
        let cubic = inverse * right;
        let misses = |i: usize| self.readings.values[i] - self.readings.values[near[0]] - row(i).dot(&cubic);
        let squares: f64 = near.iter().map(|&i| misses(i).powi(2)).sum();
        Some(Fit {
            size: misses(k),
            scatter: (squares / (near.len() - 4) as f64).sqrt(),
            uneven: near.iter().map(|&i| misses(i).abs()).fold(0.0, f64::max),
            widens: (1.0 + inverse[(0, 0)]).sqrt(),
        })
    }
}

/// The cubic of some neighbours.
struct Fit {
    /// The reading less the cubic.
    size: f64,
    /// Standard deviation of the neighbours about it.
    scatter: f64,
    /// The largest that they miss it by.
    uneven: f64,
    /// √(1 + h).
    widens: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::thresholds::SPIKE;

    fn readings(values: Vec<f64>) -> Readings {
        let n = values.len();
        Readings { rows: (0..n).collect(), t: (0..n).map(|k| k as f64 * 0.01).collect(), values }
    }

    /// A sine of 3, sixty readings a period, with noise of about 1e-3.
    fn sine(n: u32) -> Vec<f64> {
        (0..n).map(|k| (f64::from(k) * 0.1).sin() * 3.0 + 1e-3 * (f64::from(k * 7919 % 13) - 6.0) / 3.7).collect()
    }

    fn found(values: Vec<f64>, times: f64) -> Vec<usize> {
        let readings = readings(values);
        let mut neighbours = Neighbours::new(&readings).unwrap();
        neighbours.apart(times).iter().map(|apart| apart.index).collect()
    }

    #[test]
    fn a_spike_of_a_tenth_of_the_motion_is_found_and_the_motion_left_alone() {
        let mut values = sine(2000);
        assert!(found(values.clone(), RECURRING).is_empty());
        values[700] += 0.5;
        values[1200] -= 0.5;
        assert_eq!(found(values, SPIKE), [700, 1200]);
    }

    #[test]
    fn spikes_near_one_another_and_at_the_ends_are_each_found() {
        let mut values = sine(2000);
        for (k, size) in [(0, 9.0), (500, 3.0), (501, 3.0), (505, -3.0), (507, 3.0), (1998, -8.0)] {
            values[k] += size;
        }
        assert_eq!(found(values, SPIKE), [0, 500, 501, 505, 507, 1998]);
    }

    #[test]
    fn a_step_a_corner_and_a_jerk_are_motion() {
        for shape in [|k: f64| k.signum(), |k: f64| k.abs() * 0.3, |k: f64| (-k * k / 3.0).exp()] {
            let values = sine(2000).into_iter().enumerate();
            let spoilt = values.map(|(k, x)| 0.1 * x + 20.0 * shape(k as f64 - 1000.3)).collect();
            assert_eq!(found(spoilt, RECURRING), [0_usize; 0]);
        }
    }

    #[test]
    fn noise_that_comes_in_gusts_holds_no_spikes() {
        let gusts = |k: u32| if (k / 200).is_multiple_of(5) { 100.0 } else { 1.0 };
        let values = (0..20_000_u32).map(|k| gusts(k) * (f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 8.4e6 - 1.0));
        assert_eq!(found(values.collect(), SPIKE), [0_usize; 0]);
    }
}
