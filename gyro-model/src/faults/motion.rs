//! How the reference turns, whatever it is: one angle over time, and mean rates of it and of the gyro over pieces.

use super::channel::{unwrap, wraps_in_degrees};
use crate::{
    Axis, Record,
    effects::white_noise,
    record::{ReferenceKind, turn},
};
use std::f64::consts::TAU;

/// Increments are compared over pieces of this length, s: long against any delay, short against a log.
const PIECE: f64 = 0.5;

/// The reference's angle about one axis, continuous; for a quaternion the integral of the body rate.
pub(super) struct Motion {
    t: Vec<f64>,
    angle: Vec<f64>,
    /// RMS of the rate over [`PIECE`], rad/s.
    pub(super) rate_rms: f64,
}

impl Motion {
    /// `None` where the axis has no reference.
    pub(super) fn of(record: &Record, axis: Axis) -> Option<Self> {
        let i = axis.index();
        let (mut t, mut angle) = (Vec::new(), Vec::new());
        match record.reference(axis)? {
            ReferenceKind::Angle => {
                for row in record.rows.iter().filter(|r| r.ref_angle[i].is_finite()) {
                    t.push(row.t_ns as f64 * 1e-9);
                    angle.push(row.ref_angle[i]);
                }
                let whole = if wraps_in_degrees(&angle) { 360.0 } else { TAU };
                unwrap(&mut angle, whole);
            }
            ReferenceKind::Rate => {
                let mut sum = 0.0;
                for row in record.rows.iter().filter(|r| r.ref_rate[i].is_finite()) {
                    let now = row.t_ns as f64 * 1e-9;
                    sum += t.last().map_or(0.0, |before| now - before) * row.ref_rate[i];
                    t.push(now);
                    angle.push(sum);
                }
            }
            ReferenceKind::Quaternion => (t, angle) = turned(record, i, |q| q),
        }
        Self::along(t, angle)
    }

    /// That of an orientation whose four numbers `reading` puts in order.
    pub(super) fn of_orientation(record: &Record, axis: Axis, reading: fn([f64; 4]) -> [f64; 4]) -> Option<Self> {
        let (t, angle) = turned(record, axis.index(), reading);
        Self::along(t, angle)
    }

    fn along(t: Vec<f64>, angle: Vec<f64>) -> Option<Self> {
        let mut motion = Self { t, angle, rate_rms: 0.0 };
        let (&from, &to) = (motion.t.first()?, motion.t.last()?);
        let rates = motion.rates(from, to, motion.piece());
        motion.rate_rms = (rates.iter().map(|x| x * x).sum::<f64>() / rates.len().max(1) as f64).sqrt();
        Some(motion)
    }

    /// Its mean rates over pieces of the whole log.
    pub(super) fn whole(&self) -> Vec<f64> {
        let (from, to) = (self.t[0], self.t[self.t.len() - 1]);
        self.rates(from, to, self.piece())
    }

    /// The length of the pieces over which increments are compared: [`PIECE`], and at least twenty samples.
    fn piece(&self) -> f64 {
        PIECE.max(20.0 * self.apart())
    }

    /// How far apart in time its samples are in the mean, s.
    pub(super) fn apart(&self) -> f64 {
        let span = self.t.last().zip(self.t.first()).map_or(0.0, |(to, from)| to - from);
        span / self.t.len().max(1) as f64
    }

    /// Standard deviation of what is white in its angle, rad.
    pub(super) fn noise(&self) -> f64 {
        white_noise(&self.angle)
    }

    /// Angle at `t`, linear between samples, held at the ends.
    pub(super) fn at(&self, t: f64) -> f64 {
        let k = self.t.partition_point(|&x| x <= t);
        if k == 0 {
            return self.angle[0];
        }
        if k == self.t.len() {
            return self.angle[k - 1];
        }
        let share = (t - self.t[k - 1]) / (self.t[k] - self.t[k - 1]);
        self.angle[k - 1] + share * (self.angle[k] - self.angle[k - 1])
    }

    /// Mean rates over pieces of this length from `from` to `to`.
    pub(super) fn rates(&self, from: f64, to: f64, piece: f64) -> Vec<f64> {
        // A clock that jumps years ahead must not make years of pieces.
        let pieces = (((to - from) / piece) as usize).clamp(1, 4 * self.t.len().max(1));
        let edge = |k: usize| from + (to - from) * k as f64 / pieces as f64;
        let length = (to - from).max(1e-9) / pieces as f64;
        (0..pieces).map(|k| (self.at(edge(k + 1)) - self.at(edge(k))) / length).collect()
    }
}

/// Times, and the integral of an orientation's body rate about one axis.
fn turned(record: &Record, i: usize, reading: fn([f64; 4]) -> [f64; 4]) -> (Vec<f64>, Vec<f64>) {
    let (mut sum, mut before): (f64, Option<[f64; 4]>) = (0.0, None);
    let known = record.rows.iter().filter(|r| r.ref_quaternion[0].is_finite());
    known
        .map(|row| {
            let q = reading(row.ref_quaternion);
            sum += before.replace(q).map_or(0.0, |p| turn(p, q)[i]);
            (row.t_ns as f64 * 1e-9, sum)
        })
        .unzip()
}

/// Mean gyro readings over the pieces of the reference.
pub(super) fn gyro_rates(record: &Record, axis: Axis, motion: &Motion) -> Option<Vec<f64>> {
    let (mut t, mut angle, mut sum) = (Vec::new(), Vec::new(), 0.0);
    for row in record.rows.iter().filter(|r| r.gyro[axis.index()].is_finite()) {
        let now = row.t_ns as f64 * 1e-9;
        sum += t.last().map_or(0.0, |before| now - before) * row.gyro[axis.index()];
        t.push(now);
        angle.push(sum);
    }
    t.first()?;
    let gyro = Motion { t, angle, rate_rms: 0.0 };
    Some(gyro.rates(*motion.t.first()?, *motion.t.last()?, motion.piece()))
}
