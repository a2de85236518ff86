//! The reference as a witness: does it show what a gyro's readings say, or what their neighbours say?
//!
//! A reading that is δ too large for a time adds an angle, which stays. Over all doubtful readings together, the share s of
//! those angles that the reference shows is the least-squares slope of what it turned beyond the neighbours' rate (M) on
//! what the readings add to that (D): s = Σ D M / Σ D². Its standard error comes from M where nothing is doubtful.

use super::{
    channel::Readings,
    motion::{Motion, gyro_rates},
    reference::regress,
    seconds,
    thresholds::{SHOWN, SURE, WITNESS},
};
use crate::{
    Axis, Record, Row,
    order::{median, quantile},
};
use std::ops::Range;

/// Share of the pieces that a calibration keeps, those that it fits best, and how often it chooses them.
const KEPT: (f64, usize) = (0.7, 5);
/// Square of the correlation that the pieces that are kept have at least.
const GOES_WITH: f64 = 0.9;
/// Places that tell how far gyro and reference differ where nothing is doubtful.
const PLACES: usize = 200;

/// One axis' reference, and what its gyro's readings are worth in it.
pub(super) struct Witness {
    motion: Motion,
    /// Rate of the reference over that of the reading, 1.
    pub(super) slope: f64,
    /// Rate of the reference where the reading is zero, rad/s.
    pub(super) offset: f64,
}

impl Witness {
    /// `None` where there is no reference, or one that does not go with the gyro.
    pub(super) fn of(record: &Record, axis: Axis) -> Option<Self> {
        let motion = Motion::of(record, axis)?;
        let (x, y) = (gyro_rates(record, axis, &motion)?, motion.whole());
        let (slope, offset) = trimmed(&x, &y)?;
        Some(Self { motion, slope, offset })
    }

    /// What the gyro's readings should add up to between two times, rad.
    fn turned(&self, from: f64, to: f64) -> f64 {
        (self.motion.at(to) - self.motion.at(from) - self.offset * (to - from)) / self.slope
    }

    /// Whether the reference shows the readings in these stretches rather than what should stand there instead; `None`
    /// where it does not tell.
    pub(super) fn shows(&self, readings: &Readings, instead: &[f64], doubtful: &[Range<usize>]) -> Option<bool> {
        let (as_read, as_said) = (integral(&readings.t, &readings.values), integral(&readings.t, instead));
        let n = readings.t.len();
        let window = |stretch: &Range<usize>| {
            let (from, to) = (readings.t[stretch.start] - WITNESS, readings.t[stretch.end - 1] + WITNESS);
            let i = readings.t.partition_point(|&t| t < from);
            let j = readings.t.partition_point(|&t| t <= to).min(n) - 1;
            (i.min(stretch.start.saturating_sub(1)), j.max((stretch.end).min(n - 1)))
        };
        let beyond = |(i, j): (usize, usize)| self.turned(readings.t[i], readings.t[j]) - (as_said[j] - as_said[i]);
        let (mut along, mut own, mut longest) = (0.0, 0.0, 1);
        for stretch in doubtful {
            let (i, j) = window(stretch);
            let adds = (as_read[j] - as_read[i]) - (as_said[j] - as_said[i]);
            along += adds * beyond((i, j));
            own += adds * adds;
            longest = longest.max(stretch.len());
        }
        let step = (n / PLACES).max(1);
        let elsewhere = (0..n.saturating_sub(longest)).step_by(step).map(|k| beyond(window(&(k..k + longest))).abs());
        let error = 1.4826 * median(elsewhere.collect())? / own.sqrt();
        let share = along / own;
        if (share - SHOWN).abs() < SURE * error || !share.is_finite() {
            return None;
        }
        Some(share > SHOWN)
    }
}

/// Slope and intercept of `y` on `x` over the pieces that go best with it: least trimmed squares (P. J. Rousseeuw, 1984), by
/// concentration steps from the median of the ratios of differences.
fn trimmed(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let n = x.len().min(y.len());
    if n < 10 {
        return None;
    }
    let half = n / 2;
    let pairs = (0..n - half).map(|k| (x[k + half] - x[k], y[k + half] - y[k]));
    let wide = quantile(pairs.clone().map(|(dx, _)| dx.abs()).collect(), 0.5)?;
    let mut slope = median(pairs.filter(|(dx, _)| dx.abs() >= wide && *dx != 0.0).map(|(dx, dy)| dy / dx).collect())?;
    let mut offset = median((0..n).map(|k| y[k] - slope * x[k]).collect())?;
    let mut fit = 0.0;
    for _ in 0..KEPT.1 {
        let off = |k: usize| (y[k] - slope * x[k] - offset).abs();
        let most = quantile((0..n).map(off).collect(), KEPT.0)?;
        let kept: Vec<usize> = (0..n).filter(|&k| off(k) <= most).collect();
        let (of_x, of_y): (Vec<f64>, Vec<f64>) = kept.iter().map(|&k| (x[k], y[k])).unzip();
        (slope, fit) = regress(&of_x, &of_y);
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        offset = mean(&of_y) - slope * mean(&of_x);
    }
    (fit > GOES_WITH && slope != 0.0).then_some((slope, offset))
}

/// The angle that a gyro's readings add up to at each row, rad; where one is missing, the one before holds.
pub(super) fn angle_read(record: &Record, axis: Axis) -> Vec<f64> {
    let t: Vec<f64> = (0..record.len()).map(|k| seconds(record, k)).collect();
    let mut held = 0.0;
    let rate = |row: &Row| {
        let now = row.gyro[axis.index()];
        held = if now.is_finite() { now } else { held };
        held
    };
    integral(&t, &record.rows.iter().map(rate).collect::<Vec<f64>>())
}

/// The trapezoid's integral.
pub(super) fn integral(t: &[f64], y: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    (0..y.len())
        .map(|k| {
            sum += if k == 0 { 0.0 } else { 0.5 * (y[k] + y[k - 1]) * (t[k] - t[k - 1]) };
            sum
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log of 60 s: what the gyro reads at each row, and the shaft's angle.
    fn log(gyro: impl Fn(usize, f64) -> f64, angle: impl Fn(f64) -> f64) -> Record {
        let rows = (0..6000_u16).map(|k| {
            let t = f64::from(k) * 0.01;
            let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
            row.gyro[2] = gyro(usize::from(k), t);
            row.ref_angle[2] = (angle(t) / 0.0015).round() * 0.0015;
            row
        });
        Record { rows: rows.collect(), ..Record::default() }
    }

    #[test]
    fn a_reference_tells_a_spike_from_a_knock() {
        let rate = |t: f64| 2.6 * (1.3 * t).cos();
        let read = |k: usize, t: f64| rate(t) + if k % 1000 == 500 { 8.0 } else { 0.0 };
        let spiked = log(read, |t| 2.0 * (1.3 * t).sin());
        // Each knock turns the shaft by 0.08 rad.
        let knocked = log(read, |t| 2.0 * (1.3 * t).sin() + 0.08 * ((t - 5.0) / 10.0).floor());
        let doubtful: Vec<Range<usize>> = (0..6).map(|i| 1000 * i + 500..1000 * i + 501).collect();
        for (record, expected) in [(spiked, false), (knocked, true)] {
            let readings = Readings::of(&record, super::super::channel::Channel::Gyro(Axis::Z));
            let instead: Vec<f64> = readings.t.iter().map(|&t| rate(t)).collect();
            let witness = Witness::of(&record, Axis::Z).unwrap();
            assert!((witness.slope - 1.0).abs() < 0.01);
            assert_eq!(witness.shows(&readings, &instead, &doubtful), Some(expected));
        }
    }

    #[test]
    fn a_calibration_withstands_a_quarter_of_pieces_that_are_wrong() {
        let x: Vec<f64> = (0..200).map(|k| (f64::from(k) * 0.37).sin()).collect();
        let y: Vec<f64> =
            x.iter().enumerate().map(|(k, x)| 0.98 * x + 0.1 + if k % 4 == 1 { 5.0 } else { 0.0 }).collect();
        let (slope, offset) = trimmed(&x, &y).unwrap();
        assert!((slope - 0.98).abs() < 1e-6 && (offset - 0.1).abs() < 1e-6, "{slope}, {offset}");
    }
}
