//! The channels of a log that faults are looked for in, one at a time.

use crate::{Axis, Record, Row, record::Column};
use itertools::Itertools;
use std::f64::consts::TAU;

/// One channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// A gyro's rate.
    Gyro(Axis),
    /// A shaft's angle.
    Angle(Axis),
    /// A reference rate.
    Rate(Axis),
    /// The temperature.
    Temperature,
}

impl Channel {
    /// Gyros, references and temperature.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let of_axis = |axis| [Self::Gyro(axis), Self::Angle(axis), Self::Rate(axis)];
        Axis::ALL.into_iter().flat_map(of_axis).chain([Self::Temperature])
    }

    /// The column's name.
    pub(super) fn name(self) -> String {
        match self {
            Self::Gyro(axis) => format!("gyro_{axis}"),
            Self::Angle(axis) => format!("ref_angle_{axis}"),
            Self::Rate(axis) => format!("ref_rate_{axis}"),
            Self::Temperature => "temp".to_owned(),
        }
    }

    /// The axis that it is of.
    pub(super) fn axis(self) -> Option<Axis> {
        match self {
            Self::Gyro(axis) | Self::Angle(axis) | Self::Rate(axis) => Some(axis),
            Self::Temperature => None,
        }
    }

    /// Its value in a row.
    pub(super) fn of(self, row: &Row) -> f64 {
        match self {
            Self::Gyro(axis) => row.gyro[axis.index()],
            Self::Angle(axis) => row.ref_angle[axis.index()],
            Self::Rate(axis) => row.ref_rate[axis.index()],
            Self::Temperature => row.temperature,
        }
    }

    fn column(self) -> Column {
        match self {
            Self::Gyro(axis) => Column::Gyro(axis),
            Self::Angle(axis) => Column::Angle(axis),
            Self::Rate(axis) => Column::Rate(axis),
            Self::Temperature => Column::Temperature,
        }
    }

    /// Where its value stands in a row.
    pub(super) fn place(self, row: &mut Row) -> &mut f64 {
        match self {
            Self::Gyro(axis) => &mut row.gyro[axis.index()],
            Self::Angle(axis) => &mut row.ref_angle[axis.index()],
            Self::Rate(axis) => &mut row.ref_rate[axis.index()],
            Self::Temperature => &mut row.temperature,
        }
    }

    /// A size of it in the unit that people read, with as many digits as say something.
    pub(super) fn says(self, size: f64) -> String {
        let (value, unit) = match self {
            Self::Gyro(_) | Self::Rate(_) => (size.to_degrees(), "°/s"),
            Self::Angle(_) => (size.to_degrees(), "°"),
            Self::Temperature => (size, "°C"),
        };
        let decimals = if value == 0.0 { 0.0 } else { (2.0 - value.abs().log10().floor()).clamp(0.0, 6.0) };
        format!("{value:.*} {unit}", decimals as usize)
    }
}

/// The readings of one channel, without the rows that have none.
#[derive(Clone, Debug)]
pub(super) struct Readings {
    /// The row of each.
    pub(super) rows: Vec<usize>,
    /// Times, s.
    pub(super) t: Vec<f64>,
    /// Values, SI; angles made continuous.
    pub(super) values: Vec<f64>,
}

impl Readings {
    /// All that there are.
    pub(super) fn of(record: &Record, channel: Channel) -> Self {
        if !record.has(channel.column()) {
            return Self { rows: Vec::new(), t: Vec::new(), values: Vec::new() };
        }
        let each = record.rows.iter().enumerate().map(|(k, row)| (k, row.t_ns as f64 * 1e-9, channel.of(row)));
        let (rows, t, mut values): (Vec<usize>, Vec<f64>, Vec<f64>) =
            each.filter(|(_, _, value)| value.is_finite()).multiunzip();
        if let Channel::Angle(_) = channel {
            let whole = if wraps_in_degrees(&values) { 360.0 } else { TAU };
            unwrap(&mut values, whole);
        }
        Self { rows, t, values }
    }

    /// Made ones.
    #[cfg(test)]
    pub(super) fn at_100_hz(values: Vec<f64>) -> Self {
        let n = values.len();
        Self { rows: (0..n).collect(), t: (0..n).map(|k| k as f64 * 0.01).collect(), values }
    }
}

/// Makes an angle continuous that wraps after a `whole` turn.
pub(super) fn unwrap(angles: &mut [f64], whole: f64) {
    let mut turns = 0.0;
    for k in 1..angles.len() {
        let step = angles[k] + turns - angles[k - 1];
        turns -= whole * (step / whole).round();
        angles[k] += turns;
    }
}

/// Whether an angle jumps by a full turn of 360.
pub(super) fn wraps_in_degrees(angle: &[f64]) -> bool {
    let span = angle.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    span.1 - span.0 <= 361.0 && angle.windows(2).any(|pair| (300.0..=361.0).contains(&(pair[1] - pair[0]).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_that_wraps_becomes_continuous() {
        let mut angles: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.05) % TAU).collect();
        unwrap(&mut angles, TAU);
        assert!(angles.windows(2).all(|pair| (pair[1] - pair[0] - 0.05).abs() < 1e-9));
    }

    #[test]
    fn sizes_are_said_with_three_digits() {
        assert_eq!(Channel::Gyro(Axis::Z).says(3.9_f64.to_radians()), "3.90 °/s");
        assert_eq!(Channel::Gyro(Axis::Z).says(-2000.0_f64.to_radians()), "-2000 °/s");
    }
}
