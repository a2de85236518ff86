//! The set-up around a simulated sensor: what cameras, controllers, radio links and slow clocks make of a perfect reference.
//!
//! Applied in the order in which it happens: motion faster than half the sampling rate is in gyro and reference alike, then
//! the reference is smoothed, stamped, spoilt by noise, and last of all known seldom, straight lines between.

use super::{Sample, motion::normal, noise::stream, random::RandomCauses};
use super::{Scenario, Simulator};
use crate::{Axis, Row, effects::low_pass};
use crate::{Model, Record};
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// What is between a motion and its log, beside the sensor. The default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SetUp {
    /// Noise of the reference.
    pub noise: Option<Coloured>,
    /// Standard deviation of the reference's stamps, s.
    pub jitter: f64,
    /// Values of its own that the reference has a second, straight lines between; 0: every row.
    pub reference_rate: f64,
    /// Standard deviation of the bell that the reference is smoothed with, s.
    pub smoothing: f64,
    /// Ripple that goes with the shaft's angle, and is so fast at the motion's fastest, Hz; 0 without.
    pub fold: f64,
    /// Random causes.
    pub random: RandomCauses,
}

/// Noise between two frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coloured {
    /// Root mean square, rad (rad/s for a reference that is a rate).
    pub size: f64,
    /// Hz; 0 from the slowest on.
    pub low: f64,
    /// Hz; infinite: white.
    pub high: f64,
}

impl Coloured {
    /// As it is typed: `0.0004` (white) or `0.0004:10-70`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wanted =
            || format!("`{text}` is not a noise: expected SIZE in rad, or SIZE:LOW-HIGH in Hz, 0.0004:10-70 say");
        let number = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0).ok_or_else(wanted);
        let (size, band) = text.split_once(':').map_or((text, None), |(size, band)| (size, Some(band)));
        let (low, high) = match band {
            None => (0.0, f64::INFINITY),
            Some(band) => {
                let (low, high) = band.split_once('-').ok_or_else(wanted)?;
                (number(low)?, number(high)?)
            }
        };
        if high <= low {
            return Err(wanted());
        }
        Ok(Self { size: number(size)?, low, high })
    }

    /// So many values, so many a second.
    fn values(self, count: usize, rate_hz: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
        let white: Vec<f64> = (0..count).map(|_| normal(random, 1.0)).collect();
        let slower = |values: &[f64], frequency: f64| -> Vec<f64> {
            let mut state = 0.0;
            let each = values.iter().map(|value| {
                state = low_pass(state, *value, *value, 1.0 / rate_hz, 1.0 / (TAU * frequency));
                state
            });
            each.collect()
        };
        let mut own = white.clone();
        if self.high.is_finite() {
            // Twice: beyond its upper end it falls quickly.
            own = slower(&slower(&own, self.high), self.high);
        }
        if self.low > 0.0 {
            let slow = slower(&own, self.low);
            own.iter_mut().zip(slow).for_each(|(value, slow)| *value -= slow);
        }
        let rms = (own.iter().map(|v| v * v).sum::<f64>() / count.max(1) as f64).sqrt().max(1e-300);
        own.iter().map(|value| self.size * value / rms).collect()
    }
}

/// Amplitude of the ripple, rad, and the frequency beyond which the gyro shows less of it, as a share of the sampling rate.
const RIPPLE: f64 = 2e-3;
const SHOWN: f64 = 0.35;

impl SetUp {
    /// Whether there is anything to it.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// The first `rows` rows of a scenario behind this set-up, and the true model. `told` is called with the number of rows that are done.
    #[must_use]
    pub fn simulate(&self, scenario: &Scenario, rows: usize, mut told: impl FnMut(usize)) -> (Record, Model) {
        let mut simulator = Simulator::new(scenario);
        let mut record = Record { rows: Vec::with_capacity(rows), ..Record::default() };
        let mut samples = Vec::new();
        for k in 0..rows {
            let sample = simulator.step();
            if self.is_plain() {
                record.rows.push(sample.row);
            } else {
                samples.push(sample);
            }
            told(k);
        }
        if !samples.is_empty() {
            record.rows = self.applied(&samples, scenario.sensor.axis, scenario.rate_hz, scenario.seed);
        }
        (record, simulator.truth())
    }

    /// What becomes of perfect samples, `rate_hz` a second, whose tested axis is `axis`.
    #[must_use]
    pub fn applied(&self, samples: &[Sample], axis: Axis, rate_hz: f64, seed: u64) -> Vec<Row> {
        let mut rows: Vec<Row> = samples.iter().map(|sample| sample.row).collect();
        let random = |number: u64| stream(seed, 2000 + number);
        if self.fold > 0.0 {
            self.ripple(&mut rows, samples, axis.index(), rate_hz);
        }
        if self.smoothing > 0.0 {
            smooth(&mut rows, self.smoothing * rate_hz);
        }
        if self.jitter > 0.0 {
            let mut random = random(0);
            for (k, (row, sample)) in rows.iter_mut().zip(samples).enumerate() {
                let late = normal(&mut random, self.jitter);
                turn(row, Vector3::from(sample.true_rate) * late);
                let next = samples.get(k + 1).unwrap_or(sample);
                for (axis, rate) in row.ref_rate.iter_mut().enumerate() {
                    *rate += (next.true_rate[axis] - sample.true_rate[axis]) * rate_hz * late;
                }
            }
        }
        if let Some(noise) = self.noise {
            let each: Vec<Vec<f64>> = (1..4).map(|k| noise.values(rows.len(), rate_hz, &mut random(k))).collect();
            for (k, row) in rows.iter_mut().enumerate() {
                turn(row, Vector3::new(each[0][k], each[1][k], each[2][k]));
                row.ref_rate.iter_mut().zip(&each).for_each(|(rate, noise)| *rate += noise[k]);
            }
        }
        if self.random != RandomCauses::default() {
            let error = self.random.error(samples, axis.index(), rate_hz, seed);
            let step = step_of(&rows, axis.index());
            add_to_turns(&mut rows, axis.index(), &error);
            for (k, row) in rows.iter_mut().enumerate() {
                let mut off = -error[k];
                if let Some(step) = step {
                    // An encoder counts what it sees, error and all.
                    let within = samples[k].true_angle[axis.index()] - row.ref_angle[axis.index()];
                    let seen = row.ref_angle[axis.index()] + within.clamp(-0.5 * step, 0.5 * step) - error[k];
                    off = (seen / step).round() * step - row.ref_angle[axis.index()];
                }
                row.ref_angle[axis.index()] += off;
                row.ref_rate[axis.index()] -= (error[k] - error[k.saturating_sub(1)]) * rate_hz;
            }
        }
        if self.reference_rate > 0.0 {
            seldom(&mut rows, self.reference_rate);
        }
        let mut lost = self.random.lost(rows.len(), rate_hz, seed).into_iter();
        rows.retain(|_| lost.next() != Some(true));
        rows
    }

    fn ripple(&self, rows: &mut [Row], samples: &[Sample], axis: usize, rate_hz: f64) {
        let fastest = samples.iter().map(|s| s.true_rate[axis].abs()).fold(0.0, f64::max).max(1e-9);
        let cycles = TAU * self.fold / fastest;
        for (row, sample) in rows.iter_mut().zip(samples) {
            let (rate, phase) = (sample.true_rate[axis], cycles * sample.true_angle[axis]);
            let mut off = Vector3::zeros();
            off[axis] = RIPPLE * phase.sin();
            turn(row, off);
            let turns = cycles * rate;
            let shown = (turns / (TAU * SHOWN * rate_hz)).powi(2);
            row.ref_rate[axis] += RIPPLE * turns * phase.cos();
            row.gyro[axis] += RIPPLE * turns * phase.cos() / (1.0 + shown).sqrt();
        }
    }
}

/// The step of an angle that comes in whole counts, rad.
fn step_of(rows: &[Row], axis: usize) -> Option<f64> {
    let angles = || rows.iter().map(|row| row.ref_angle[axis]).filter(|angle| angle.is_finite());
    let steps = angles().zip(angles().skip(1)).map(|(a, b)| (b - a).abs()).filter(|step| *step > 1e-9);
    let step = steps.reduce(f64::min)?;
    angles().all(|angle| (angle / step - (angle / step).round()).abs() < 1e-3).then_some(step)
}

/// Takes an angle error off what an orientation turns about an axis, step by step: the body's axes stay where the gyro has them, as they do not
/// where an orientation is turned by the whole error.
fn add_to_turns(rows: &mut [Row], axis: usize, error: &[f64]) {
    let Some(mut shown) = rows.first().and_then(Row::attitude) else { return };
    let mut before = shown;
    for (row, pair) in rows.iter_mut().skip(1).zip(error.windows(2)) {
        let Some(now) = row.attitude() else { continue };
        let mut off = Vector3::zeros();
        off[axis] = pair[0] - pair[1];
        shown *= before.inverse() * now * UnitQuaternion::from_scaled_axis(off);
        before = now;
        write(row, shown);
    }
}

/// Turns what a row's reference shows, angle or orientation, by small angles about the body's axes.
fn turn(row: &mut Row, by: Vector3<f64>) {
    row.ref_angle.iter_mut().zip(by.iter()).for_each(|(angle, by)| *angle += by);
    if let Some(attitude) = row.attitude() {
        write(row, attitude * UnitQuaternion::from_scaled_axis(by));
    }
}

fn write(row: &mut Row, attitude: UnitQuaternion<f64>) {
    row.ref_quaternion = [attitude.w, attitude.i, attitude.j, attitude.k];
}

/// A bell of this standard deviation, rows, over every reference.
fn smooth(rows: &mut [Row], width: f64) {
    let reach = (4.0 * width).ceil() as usize;
    let before = rows.to_vec();
    for k in 0..rows.len() {
        let near = k.saturating_sub(reach)..(k + reach + 1).min(before.len());
        let weight = |j: usize| (-0.5 * ((j as f64 - k as f64) / width).powi(2)).exp();
        let sum: f64 = near.clone().map(weight).sum();
        for axis in 0..3 {
            let mean = |of: &dyn Fn(&Row) -> f64| near.clone().map(|j| weight(j) * of(&before[j])).sum::<f64>() / sum;
            rows[k].ref_angle[axis] = mean(&|row| row.ref_angle[axis]);
            rows[k].ref_rate[axis] = mean(&|row| row.ref_rate[axis]);
        }
        if let Some(own) = before[k].attitude() {
            let off =
                |j: usize| before[j].attitude().map_or_else(Vector3::zeros, |a| (own.inverse() * a).scaled_axis());
            let mean = near.clone().map(|j| off(j) * weight(j)).sum::<Vector3<f64>>() / sum;
            write(&mut rows[k], own * UnitQuaternion::from_scaled_axis(mean));
        }
    }
}

/// References that have a value of their own only so often, straight lines between.
fn seldom(rows: &mut [Row], rate: f64) {
    let seconds = |row: &Row| row.t_ns as f64 * 1e-9;
    let (mut knots, mut next) = (Vec::new(), f64::NEG_INFINITY);
    for (k, row) in rows.iter().enumerate() {
        if seconds(row) >= next - 1e-9 {
            knots.push(k);
            next = next.max(seconds(row)) + 1.0 / rate;
        }
    }
    for pair in knots.windows(2) {
        let (from, to) = (rows[pair[0]], rows[pair[1]]);
        for row in &mut rows[pair[0] + 1..pair[1]] {
            let share = (seconds(row) - seconds(&from)) / (seconds(&to) - seconds(&from));
            for axis in 0..3 {
                row.ref_angle[axis] = from.ref_angle[axis] + share * (to.ref_angle[axis] - from.ref_angle[axis]);
                row.ref_rate[axis] = from.ref_rate[axis] + share * (to.ref_rate[axis] - from.ref_rate[axis]);
            }
            if let (Some(a), Some(b)) = (from.attitude(), to.attitude()) {
                write(row, a.slerp(&b, share));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Reference, Scenario, SensorSpec, Simulator};

    fn samples() -> Vec<Sample> {
        let sensor = SensorSpec { reference: Reference::Encoder(0), ..SensorSpec::default() };
        Simulator::new(&Scenario { sensor, ..Scenario::default() }).take(4000).collect()
    }

    /// What a set-up adds to the reference's angle.
    fn added(set_up: SetUp) -> Vec<f64> {
        let samples = samples();
        let rows = set_up.applied(&samples, Axis::X, 100.0, 3);
        rows.iter().zip(&samples).map(|(row, sample)| row.ref_angle[0] - sample.row.ref_angle[0]).collect()
    }

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn an_encoder_counts_in_whole_steps_beside_a_random_cause() {
        let sensor = SensorSpec { reference: Reference::Encoder(4096), ..SensorSpec::default() };
        let samples: Vec<_> = Simulator::new(&Scenario { sensor, ..Scenario::default() }).take(4000).collect();
        let random = RandomCauses { random_scale: (0.01, 2.0), ..RandomCauses::default() };
        let rows = SetUp { random, ..SetUp::default() }.applied(&samples, Axis::X, 100.0, 3);
        assert!((step_of(&rows, 0).expect("steps") / (TAU / 4096.0) - 1.0).abs() < 1e-6);
        let off = rows.iter().zip(&samples).map(|(row, sample)| (row.ref_angle[0] - sample.true_angle[0]).abs());
        assert!(off.fold(0.0, f64::max) > 2.0 * TAU / 4096.0);
    }

    #[test]
    fn noise_has_its_size_and_its_colour() {
        let noise = Coloured::parse("0.0004:1-5").expect("a noise");
        let own = added(SetUp { noise: Some(noise), ..SetUp::default() });
        assert!((rms(&own) / 4e-4 - 1.0).abs() < 1e-6);
        let steps: Vec<f64> = own.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(rms(&steps) < 0.4 * rms(&own), "{} of {}", rms(&steps), rms(&own));
        for wrong in ["x", "1:5", "1:5-2", "-1", "1:a-b"] {
            assert!(Coloured::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn stamps_that_scatter_err_by_the_rate() {
        let samples = samples();
        let own = added(SetUp { jitter: 2e-3, ..SetUp::default() });
        let late: Vec<f64> = own.iter().zip(&samples).map(|(off, s)| off / s.true_rate[0]).collect();
        assert!((rms(&late) / 2e-3 - 1.0).abs() < 0.05, "{}", rms(&late));
    }

    #[test]
    fn what_comes_seldom_turns_evenly_between() {
        let samples = samples();
        let rows = SetUp { reference_rate: 10.0, ..SetUp::default() }.applied(&samples, Axis::X, 100.0, 3);
        let angle: Vec<f64> = rows[..3990].iter().map(|row| row.ref_angle[0]).collect();
        let bend = |k: usize| (angle[k + 1] - 2.0 * angle[k] + angle[k - 1]).abs() > 1e-9;
        let wrong: Vec<usize> = (1..angle.len() - 1).filter(|k| bend(*k) && k % 10 != 0).collect();
        assert!(wrong.is_empty(), "{wrong:?}");
        assert!(bend(500));
        assert_eq!(angle[500], samples[500].row.ref_angle[0]);
    }

    #[test]
    fn ripple_is_in_both_and_smoothing_takes_what_is_fast() {
        let samples = samples();
        let rows = SetUp { fold: 90.0, ..SetUp::default() }.applied(&samples, Axis::X, 100.0, 3);
        let gyro: Vec<f64> = rows.iter().zip(&samples).map(|(row, s)| row.gyro[0] - s.row.gyro[0]).collect();
        assert!(rms(&gyro) > 0.05, "{}", rms(&gyro));
        let own = added(SetUp { smoothing: 0.02, ..SetUp::default() });
        let bend = |s: &Sample| 0.5 * 0.02_f64.powi(2) * s.true_rate[0];
        assert!(
            rms(&own[100..3900]) > 0.0
                && rms(&own[100..3900]) < samples.iter().map(|s| bend(s).abs()).fold(0.0, f64::max) * 50.0
        );
    }
}
