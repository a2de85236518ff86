//! What rounding leaves of a rate that is held where the reading's noise is less than 0.3 of a step: it does not carry the reading
//! from step to step, and the mean stays off.
//!
//! A rate of u steps beyond a whole number of them, with normal noise of σ steps, reads in the mean too much by
//!
//! ```text
//! m(u) = Σ_k (−1)ᵏ sin(2πku)/(πk) · exp(−2π²k²σ²)      steps
//! ```
//!
//! which is at most 0.05 steps for σ = 0.3, and half a step without noise. Where between two steps a rate stands is not known that
//! well, but that it stands there for as long as it is held, and again whenever it comes back.

use super::series::Series;
use crate::effects::quieted;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::{
    collections::{BTreeMap, HashMap},
    f64::consts::PI,
};

/// The rounding of one axis' readings.
#[derive(Clone, Debug, PartialEq)]
pub struct Rounding {
    /// One step, rad/s.
    pub step: f64,
    /// Standard deviation of the noise before it is rounded, steps.
    noise: f64,
    /// The step about which the rate is, sample by sample.
    level: Vec<i64>,
}

impl Rounding {
    /// That of readings with steps of `step`, rad/s; `None` where no rate is held, where the noise evens it out, and where readings
    /// are means, whose steps are smaller.
    #[must_use]
    pub fn of(series: &Series, step: f64) -> Option<Self> {
        if step <= 0.0 || !series.turned.is_empty() {
            return None;
        }
        let level = levels(series, step);
        let noise = noise_of(variance_held(series, step, &level)?);
        (noise < EVENED_OUT).then_some(Self { step, noise, level })
    }

    /// The same of other readings of this gyro.
    #[must_use]
    pub fn on(&self, series: &Series) -> Self {
        Self { level: levels(series, self.step), ..*self }
    }

    /// Variance of what rounding makes a reading err by in the mean, (rad/s)².
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.step.powi(2) * variance_off(self.noise)
    }

    /// What each sample reads too much in the mean, rad/s, where the rates stand anywhere between their steps.
    #[must_use]
    pub fn draw(&self, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // A stream of its own: what else is drawn by this seed is independent of it.
        rng.set_stream(1);
        let mut off = HashMap::new();
        let mut beyond = || self.step * self.mean_off(rng.random::<f64>());
        self.level.iter().map(|level| *off.entry(level).or_insert_with(&mut beyond)).collect()
    }

    /// m(u), steps.
    fn mean_off(&self, u: f64) -> f64 {
        HARMONICS.map(|k| size(self.noise, k) * (2.0 * PI * f64::from(k) * u).sin()).sum()
    }
}

/// The step about which the rate is, sample by sample.
fn levels(series: &Series, step: f64) -> Vec<i64> {
    let mut at = f64::INFINITY;
    let nearest = |rate: f64| {
        if (rate / step - at).abs() > LEAVES {
            at = (rate / step).round();
        }
        at as i64
    };
    quieted(&series.t, &series.gyro).0.into_iter().map(nearest).collect()
}

/// Of harmonic `k` of m(u), steps.
fn size(noise: f64, k: i32) -> f64 {
    let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
    sign / (PI * f64::from(k)) * (-2.0 * (PI * f64::from(k) * noise).powi(2)).exp()
}

/// Variance of m(u) over all u, steps².
fn variance_off(noise: f64) -> f64 {
    HARMONICS.map(|k| 0.5 * size(noise, k).powi(2)).sum()
}

/// What a reading's values scatter by about their mean while its rate is held, steps²: the mean over the steps at which one is.
fn variance_held(series: &Series, step: f64, level: &[i64]) -> Option<f64> {
    let mut variances: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    let mut first = 0;
    for run in level.chunk_by(|a, b| a == b) {
        let (readings, t) = (&series.gyro[first..first + run.len()], &series.t[first..first + run.len()]);
        first += run.len();
        let n = readings.len() as f64;
        if n >= FEWEST && t[t.len() - 1] - t[0] > HELD {
            let mean = readings.iter().sum::<f64>() / n;
            let (sum, count) = variances.entry(run[0]).or_default();
            *sum += readings.iter().map(|g| ((g - mean) / step).powi(2)).sum::<f64>();
            *count += n - 1.0;
        }
    }
    let mean = || variances.values().map(|(sum, count)| sum / count).sum::<f64>() / variances.len() as f64;
    (variances.len() >= LEVELS).then(mean)
}

/// The noise, in steps, with which rounded readings scatter by so much about their mean, steps²: v = σ² + 1/12 − Var m.
fn noise_of(variance: f64) -> f64 {
    let scatters = |noise: f64| noise * noise + 1.0 / 12.0 - variance_off(noise);
    let (mut low, mut high) = (0.0, variance.sqrt());
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if scatters(middle) < variance { low = middle } else { high = middle }
    }
    low
}

/// Harmonics of the error of rounding that are looked at.
const HARMONICS: std::ops::RangeInclusive<i32> = 1..=32;
/// Steps of noise from which on it evens the rounding out.
const EVENED_OUT: f64 = 0.3;
/// Steps from which on a rate has left the one that it was about.
const LEAVES: f64 = 0.75;
/// How long a rate stays about one step for to count as held, s, and how many readings.
const HELD: f64 = 0.25;
const FEWEST: f64 = 16.0;
/// Steps at which a rate has to be held: a dead zone and the ends of the range hold the reading at three.
const LEVELS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Axis, Model, Record,
        evidence::study::Bench,
        simulate::{Motion, Scenario, simulate},
    };
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_mean_of_rounded_readings_is_off_by_what_is_drawn() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for noise in [0.0, 0.1, 0.2, 0.35] {
            let rounding = Rounding { step: 1.0, noise, level: Vec::new() };
            let mut square = 0.0;
            for u in (0..10).map(|k| (f64::from(k) + 0.5) / 10.0) {
                let mut reading = || {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    (u + noise * normal).round() - u
                };
                let off = (0..4000).map(|_| reading()).sum::<f64>() / 4000.0;
                assert!((off - rounding.mean_off(u)).abs() < 0.05, "σ {noise}, u {u}: {off}");
                square += rounding.mean_off(u).powi(2) / 10.0;
            }
            assert!((rounding.variance() - square).abs() < 5e-3, "σ {noise}: {square}");
            let scatters = noise * noise + 1.0 / 12.0 - square;
            assert!((noise_of(scatters) - noise).abs() < 0.02, "σ {noise}: {}", noise_of(scatters));
        }
    }

    #[test]
    fn what_is_known_of_a_whole_log_is_drawn_on_a_part_of_it() {
        let mut scenario =
            Scenario { motion: Motion::RateTable { rate: 2.0, hold: 3.0 }, seconds: 60.0, ..Scenario::default() };
        scenario.sensor.noise_density = 0.1 * scenario.sensor.quantum / f64::sqrt(0.5 * scenario.rate_hz);
        let record = simulate(&scenario).record;
        let bench = |record: &Record| Bench::new(record, &[Axis::X], &Model::base_for(record)).expect("a bench");
        let whole = bench(&record);
        let mut part = record.clone();
        part.rows.truncate(record.len() / 2);
        let mut part = bench(&part);
        part.know(&whole.prior);
        let rounding = part.prior[0].rounding.as_ref().expect("coarse readings");
        assert_eq!(rounding.draw(1).len(), part.problem.series[0].t.len());
        assert_eq!(rounding.draw(1)[..1000], whole.prior[0].rounding.as_ref().expect("as there").draw(1)[..1000]);
    }

    #[test]
    fn a_rate_that_is_held_reads_the_same_and_again_when_it_comes_back() {
        let level = vec![0, 0, 0, 5, 9, 9, 9, 0, 0];
        let off = Rounding { step: 1e-3, noise: 0.1, level }.draw(1);
        assert!(off[0] == off[2] && off[0] == off[8] && off[4] == off[6] && off[0] != off[4], "{off:?}");
        assert!(off.iter().all(|o| o.abs() <= 5e-4), "{off:?}");
    }
}
