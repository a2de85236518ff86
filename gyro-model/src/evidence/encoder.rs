//! A shaft encoder's counts: their step, and what they make a reading of the angle err by.

use crate::{Axis, Record};

/// The encoder of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// From one count to the next, rad; 0 where it is not quantised.
    pub step: f64,
    /// Readings that one row of the log is the mean of.
    pub readings: usize,
    /// Standard deviation of the angle that it counts about the shaft's, rad.
    pub noise: f64,
}

/// Readings that the step is sought in at most.
const ENOUGH: usize = 60_000;

impl Encoder {
    /// A reference without steps.
    pub const NONE: Self = Self { step: 0.0, readings: 1, noise: 0.0 };

    /// The encoder behind these unwrapped angles of a log.
    #[must_use]
    pub fn of(record: &Record, axis: Axis, angle: &[f64]) -> Self {
        let readings = record.means.readings;
        let found = || {
            // The mean of n counts is a multiple of the n-th part of a step.
            quantum(angle.iter().copied()) * readings as f64
        };
        Self { step: record.means.steps.map_or_else(found, |steps| steps[axis.index()]), readings, noise: 0.0 }
    }

    /// The steps of all axes of a log, rad.
    #[must_use]
    pub fn steps(record: &Record) -> [f64; 3] {
        Axis::ALL.map(|axis| {
            let angles = record.rows.iter().map(|row| row.ref_angle[axis.index()]);
            let mut angle: Vec<f64> = angles.filter(|angle| angle.is_finite()).collect();
            unwrap(&mut angle);
            Self::of(record, axis, &angle).step
        })
    }

    /// Whether every row shows a count, and the same one as long as the shaft rests.
    #[must_use]
    pub fn shows_counts(&self) -> bool {
        self.step > 0.0 && self.readings == 1 && self.noise < DITHERS * self.step
    }

    /// How many counts these angles are, and how many times more a motion would have come to that does not repeat itself. One that
    /// does so exactly comes back to the same few of those that it passes, and what they make it err by has no law: it depends
    /// on where the encoder counts from.
    #[must_use]
    pub fn distinct(&self, angle: &[f64]) -> (usize, f64) {
        let mut counts: Vec<i64> = angle.iter().map(|angle| (angle / self.step).round() as i64).collect();
        counts.sort_unstable();
        let passed = counts.last().zip(counts.first()).map_or(0, |(last, first)| (last - first) as usize);
        let rows = counts.len();
        counts.dedup();
        (counts.len(), passed.min(rows) as f64 / counts.len() as f64)
    }

    /// Variance of a row over that of one taken while the shaft turns fast, where its steps make only a share `spread` of
    /// the error that they make there.
    #[must_use]
    pub fn spread(&self, spread: f64) -> f64 {
        let (steps, noise) = (self.step.powi(2) / 12.0, self.noise.powi(2));
        (spread * steps + noise) / (steps + noise)
    }

    /// What it shows at an angle, rad.
    #[must_use]
    pub fn count(&self, angle: f64) -> f64 {
        self.step * nearest(angle / self.step)
    }

    /// What row `i` of `rows` reads too much where the shaft goes along these angles, rad: ⌊x/q + ½⌋·q − x, in the mean
    /// over the readings of the row, between which the shaft turns evenly.
    pub fn error(&self, along: &impl Fn(usize) -> f64, rows: usize, i: usize) -> f64 {
        let off = |x: f64| nearest(x) - x;
        let here = along(i) / self.step;
        if self.readings == 1 {
            return self.step * off(here);
        }
        let [back, on] = [i.saturating_sub(1), (i + 1).min(rows - 1)].map(|other| along(other) / self.step - here);
        let count = self.readings.min(APART);
        let reading = |k: usize| {
            let part = (k as f64 + 0.5) / count as f64 - 0.5;
            off(here + part * if part < 0.0 { -back } else { on })
        };
        self.step * (0..count).map(reading).sum::<f64>() / count as f64
    }

    /// The same where the angle that it counts is off by `noise`, rad: steps of a single reading are taken with it, and are evened
    /// out by it where the shaft is slow.
    pub fn noisy_error(&self, along: &impl Fn(usize) -> f64, rows: usize, i: usize, noise: f64) -> f64 {
        if self.readings == 1 {
            return self.error(&|i| along(i) + noise, rows, i) + noise;
        }
        self.error(along, rows, i) + noise
    }
}

/// The whole number nearest to x, |x| < 2⁵¹, by what the sum 1.5·2⁵² + x has room for: without SSE 4.1 `round` is a call.
fn nearest(x: f64) -> f64 {
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    (x + WHOLE) - WHOLE
}

/// Noise, in steps, from which on a shaft at rest is read anew at every row.
const DITHERS: f64 = 0.3;
/// Readings of one mean that are looked at singly at most.
const APART: usize = 32;

/// The step of a quantised signal: the value of which nearly all gaps between its sorted values are multiples; 0 where
/// there is none.
pub(super) fn quantum(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let every = values.len().div_ceil(ENOUGH).max(1);
    let mut sorted: Vec<f64> = values.step_by(every).collect();
    sorted.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|&d| d > 0.0).collect();
    if gaps.len() < 20 {
        return 0.0;
    }
    gaps.sort_by(f64::total_cmp);
    // Values are printed with finite digits: copies of one count may differ by a rounding.
    let smallest = 1e-2 * gaps[gaps.len() - 1 - gaps.len() / 20];
    gaps.retain(|&d| d > smallest);
    // Where there are few, every one counts.
    let guess = if gaps.len() < FEW { gaps.first() } else { gaps.get(gaps.len() / 20) };
    let Some(&guess) = guess else { return 0.0 };
    // A regular motion returns to the same few counts: even the smallest gaps may be several steps.
    (1..=MOST_STEPS).map(|steps| refined(guess / f64::from(steps), &gaps)).find(|&q| fits(q, &gaps)).unwrap_or(0.0)
}

/// Gaps of which none is left out.
const FEW: usize = 200;
/// Steps that the smallest gaps may be.
const MOST_STEPS: u32 = 24;
/// Steps of the largest gaps that a step is seen in, where there are many.
const NEAR: f64 = 40.0;

/// The gaps by which a step of `q` is judged: the smallest ones; where there are few, all, since the smallest alone of a
/// smooth sine are multiples of one another too (1, 3, 5 … about its turning points).
fn near(q: f64, gaps: &[f64]) -> &[f64] {
    if gaps.len() < FEW { gaps } else { &gaps[..gaps.partition_point(|&d| d < NEAR * q)] }
}

/// The step nearest to `q` that the smallest gaps are multiples of.
fn refined(q: f64, gaps: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut q = q;
    for d in near(q, gaps) {
        // The more steps so far, the better is known what a step is, and the larger a gap may be counted.
        let steps = (d / q).round();
        if steps >= 1.0 {
            (sum, count) = (sum + d, count + steps);
            q = sum / count;
        }
    }
    q
}

/// Whether nine in ten of the gaps are multiples of `q`.
fn fits(q: f64, gaps: &[f64]) -> bool {
    let near = near(q, gaps);
    let on = near.iter().filter(|&d| (d / q).round() >= 1.0 && (d / q - (d / q).round()).abs() < 0.12).count();
    near.len() > 10 && on * 10 >= near.len() * 9
}

/// Removes jumps of more than half a turn, for encoders that wrap at 2π.
pub(super) fn unwrap(angle: &mut [f64]) {
    use std::f64::consts::TAU;
    let mut offset = 0.0;
    for k in 1..angle.len() {
        let step = angle[k] + offset - angle[k - 1];
        if step.abs() > TAU / 2.0 {
            offset -= (step / TAU).round() * TAU;
        }
        angle[k] += offset;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_step_is_found_and_a_smooth_angle_has_none() {
        let angle: Vec<f64> = (0..4000).map(|k| 2.0 * (f64::from(k) * 0.01).sin()).collect();
        assert_eq!(quantum(angle.iter().copied()), 0.0);
        let q = 0.00153;
        let counts: Vec<f64> = angle.iter().map(|a| ((a / q).round() * q * 1e6).round() / 1e6).collect();
        assert!((quantum(counts.iter().copied()) - q).abs() < 1e-3 * q, "{}", quantum(counts.iter().copied()));
    }

    #[test]
    fn the_step_is_found_where_a_regular_motion_returns_to_the_same_few_counts() {
        let q = std::f64::consts::TAU / 4096.0;
        let angle = |k: i32| 150_f64.to_radians() * (std::f64::consts::TAU * 0.25 * 0.01 * f64::from(k)).sin();
        let counts: Vec<f64> = (0..6000).map(|k| ((angle(k) / q).round() * q * 1e9).round() / 1e9).collect();
        assert!((quantum(counts.iter().copied()) - q).abs() < 1e-3 * q, "{}", quantum(counts.iter().copied()));
    }

    #[test]
    fn the_step_is_found_where_a_regular_motion_is_read_so_seldom_that_no_two_counts_are_neighbours() {
        for (counts_a_turn, every) in
            [(8192.0, 0.04), (10_000.0, 0.04), (16_384.0, 0.04), (20_000.0, 0.04), (10_000.0, 0.01)]
        {
            let q = std::f64::consts::TAU / counts_a_turn;
            let angle = |k: i32| 150_f64.to_radians() * (std::f64::consts::TAU * 0.25 * every * f64::from(k)).sin();
            let counts: Vec<f64> = (0..1500).map(|k| ((angle(k) / q).round() * q * 1e9).round() / 1e9).collect();
            assert!(
                (quantum(counts.iter().copied()) - q).abs() < 1e-3 * q,
                "{counts_a_turn}: {}",
                quantum(counts.iter().copied())
            );
            // Some copies of a count differ by more than a rounding: a step is never larger than nearly all gaps.
            let drifting: Vec<f64> = counts.iter().enumerate().map(|(k, c)| c + 1e-3 * q * (k % 3) as f64).collect();
            assert!(
                quantum(drifting.iter().copied()) < 2.0 * q,
                "{counts_a_turn}: {}",
                quantum(drifting.iter().copied())
            );
            let smooth: Vec<f64> = (0..1500).map(|k| (angle(k) * 1e9).round() / 1e9).collect();
            assert_eq!(quantum(smooth.iter().copied()), 0.0);
        }
    }

    #[test]
    fn the_step_is_found_where_hardly_a_count_comes_twice() {
        let mut drive = crate::simulate::Shaft::new(crate::simulate::Motion::Drive { rate: 2.0, hold: 3.0 }, 7);
        for (counts_a_turn, digits) in [(1024.0, 1e6), (8192.0, 1e6), (65_536.0, 1e7), (8192.0, 1e12)] {
            let q = std::f64::consts::TAU / counts_a_turn;
            let angle: Vec<f64> = (0..6000).map(|k| drive.at(f64::from(k) * 0.01).angle).collect();
            let counts: Vec<f64> = angle.iter().map(|a| ((a / q).round() * q * digits).round() / digits).collect();
            assert!(
                (quantum(counts.iter().copied()) - q).abs() < 1e-3 * q,
                "{counts_a_turn}: {}",
                quantum(counts.iter().copied())
            );
            assert_eq!(quantum(angle.iter().copied()), 0.0);
            let smooth: Vec<f64> = angle.iter().map(|a| (a * 1e9).round() / 1e9).collect();
            assert_eq!(quantum(smooth.iter().copied()), 0.0);
        }
    }

    #[test]
    fn means_of_counts_err_as_counts_that_are_averaged_do() {
        use rand::{RngExt, SeedableRng};
        use rand_chacha::ChaCha8Rng;
        let (rows, readings, step) = (400, 16, 0.001);
        for speed in [0.02, 0.3, 1.0, 7.0] {
            let angle = |x: f64| step * (speed * readings as f64 * x + 3.0 * (0.05 * x).sin());
            let encoder = Encoder { step, readings, noise: 0.0 };
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let (mut counted, mut said) = (0.0, 0.0);
            for _ in 0..60 {
                let zero: f64 = rng.random::<f64>() * step;
                for i in 1..rows - 1 {
                    let at = |k: usize| i as f64 + (k as f64 + 0.5) / readings as f64 - 0.5;
                    let errors = (0..readings).map(|k| angle(at(k)) + zero).map(|x| (x / step).round() * step - x);
                    counted += (errors.sum::<f64>() / readings as f64).powi(2);
                    said += encoder.error(&|i| angle(i as f64) + zero, rows, i).powi(2);
                }
            }
            assert!((said / counted - 1.0).abs() < 0.15, "{speed} counts a reading: {said} for {counted}");
        }
    }
}
