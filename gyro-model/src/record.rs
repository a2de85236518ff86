//! A log in memory: columns over time, in SI units.

use crate::Axis;
use nalgebra::{Quaternion, UnitQuaternion};
use std::{
    ops::Range,
    sync::atomic::{AtomicU32, AtomicUsize, Ordering::Relaxed},
};

/// Free channels carried beside the named ones, for a user's own effects.
pub const FREE_CHANNELS: usize = 8;

/// One instant, as every stage sees it. `NaN` stands for "no value at this row".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time since the log's first row, ns.
    pub t_ns: i64,
    /// Gyro reading, rad/s.
    pub gyro: [f64; 3],
    /// Reference angle of each axis as read (wrapped or not), rad.
    pub ref_angle: [f64; 3],
    /// Reference rate, rad/s.
    pub ref_rate: [f64; 3],
    /// Reference orientation, body to world: w, x, y, z.
    pub ref_quaternion: [f64; 4],
    /// Specific force, m/s².
    pub accel: [f64; 3],
    /// Temperature, °C.
    pub temperature: f64,
    /// Supply voltage, V.
    pub supply: f64,
    /// Free channels, in the order of [`Record::free_names`].
    pub free: [f64; FREE_CHANNELS],
}

impl Row {
    /// A row with no value but its time.
    pub const EMPTY: Self = Self {
        t_ns: 0,
        gyro: [f64::NAN; 3],
        ref_angle: [f64::NAN; 3],
        ref_rate: [f64::NAN; 3],
        ref_quaternion: [f64::NAN; 4],
        accel: [f64::NAN; 3],
        temperature: f64::NAN,
        supply: f64::NAN,
        free: [f64::NAN; FREE_CHANNELS],
    };

    /// The reference orientation, where there is one.
    pub(crate) fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        let [w, x, y, z] = self.ref_quaternion;
        UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6)
    }
}

/// The reference that an axis is fitted against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceKind {
    /// A shaft encoder: angle about this axis alone.
    Angle,
    /// A rate of this axis alone.
    Rate,
    /// An orientation, which serves all three axes together.
    Quaternion,
}

/// A log: one row an instant, times strictly increasing.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// The rows, in time.
    pub rows: Vec<Row>,
    /// Names of the free channels that are in use, at most [`FREE_CHANNELS`].
    pub free_names: Vec<String>,
    /// What each row is the mean of.
    pub means: Means,
    /// Of rows that are means: how far all had turned by then, in the mean as the row's reference is. Rates that are means
    /// would not add up to it, for a block may hold half a turn's beginning. Empty where rows are as they were measured.
    pub turned: Vec<Turned>,
    /// Channels that were found to have no value.
    pub absent: Absent,
}

/// A channel of a log that may have no value in any row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Column {
    /// The gyro of an axis.
    Gyro(Axis),
    /// The reference angle of an axis.
    Angle(Axis),
    /// The reference rate of an axis.
    Rate(Axis),
    /// The reference orientation.
    Quaternion,
    /// The temperature.
    Temperature,
}

impl Column {
    fn of(self, row: &Row) -> f64 {
        match self {
            Self::Gyro(axis) => row.gyro[axis.index()],
            Self::Angle(axis) => row.ref_angle[axis.index()],
            Self::Rate(axis) => row.ref_rate[axis.index()],
            Self::Quaternion => row.ref_quaternion[0],
            Self::Temperature => row.temperature,
        }
    }

    const fn bit(self) -> u32 {
        1 << match self {
            Self::Gyro(axis) => axis.index(),
            Self::Angle(axis) => 3 + axis.index(),
            Self::Rate(axis) => 6 + axis.index(),
            Self::Quaternion => 9,
            Self::Temperature => 10,
        }
    }
}

/// Channels that were found to be absent, for rows of this number: only a whole pass over a log shows that. It is held against some rows
/// each time, for rows may be written to.
#[derive(Debug, Default)]
pub struct Absent {
    rows: AtomicUsize,
    columns: AtomicU32,
}

impl Clone for Absent {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Rows that an absent channel is looked for in again.
const LOOKED_AT: usize = 64;

/// Integrals over time from the log's first row, rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turned {
    /// Of the gyros' readings.
    pub gyro: [f64; 3],
    /// Of the reference rates.
    pub reference: [f64; 3],
}

impl Turned {
    /// One stretch after the other.
    #[must_use]
    pub fn and(&self, next: &Self) -> Self {
        let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
        Self { gyro: sum(self.gyro, next.gyro), reference: sum(self.reference, next.reference) }
    }
}

/// What the rows of a log are means of, made with [`crate::thin`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Means {
    /// Readings of the reference in one row: 1 where rows are as they were measured.
    pub readings: usize,
    /// The encoders' steps where they were found before the means were taken, rad; 0 where there is none.
    pub steps: Option<[f64; 3]>,
    /// White noise as it was found before the means were taken. At the means' own rate a vehicle's turns are as fast as it.
    pub walk: [Walk; 3],
}

/// Angle random walk, N, of one axis' readings, rad/√s; `NaN` where nothing was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// Of the gyro.
    pub gyro: f64,
    /// Whether that was taken from a data sheet, the motion hiding it.
    pub assumed: bool,
    /// Of the reference, where it is a rate.
    pub reference: f64,
}

impl Walk {
    /// Nothing found.
    pub const UNKNOWN: Self = Self { gyro: f64::NAN, assumed: false, reference: f64::NAN };
}

impl Default for Means {
    fn default() -> Self {
        Self { readings: 1, steps: None, walk: [Walk::UNKNOWN; 3] }
    }
}

impl Record {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// These rows alone.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        let turned = self.turned.get(rows.clone()).map_or_else(Vec::new, <[Turned]>::to_vec);
        Self {
            rows: self.rows[rows].to_vec(),
            free_names: self.free_names.clone(),
            means: self.means,
            turned,
            absent: Absent::default(),
        }
    }

    /// Whether a channel has a value in any row.
    pub(crate) fn has(&self, column: Column) -> bool {
        let is_there = |row: &Row| column.of(row).is_finite();
        let known = if self.absent.rows.load(Relaxed) == self.len() { self.absent.columns.load(Relaxed) } else { 0 };
        let every = (self.len() / LOOKED_AT).max(1);
        if known & column.bit() != 0 && !self.rows.iter().step_by(every).any(is_there) {
            return false;
        }
        let has = self.rows.iter().any(is_there);
        let columns = if has { known & !column.bit() } else { known | column.bit() };
        self.absent.columns.store(columns, Relaxed);
        self.absent.rows.store(self.len(), Relaxed);
        has
    }

    /// From the first row to the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.rows.first(), self.rows.last()) {
            (Some(a), Some(b)) => (b.t_ns - a.t_ns) as f64 * 1e-9,
            _ => 0.0,
        }
    }

    /// Takes the rate for zero where an axis has a gyro and no reference: the sensor was at rest.
    pub fn rest(&mut self) {
        let bare: Vec<usize> = Axis::ALL
            .into_iter()
            .filter(|&axis| self.has_gyro(axis) && self.reference(axis).is_none())
            .map(Axis::index)
            .collect();
        for row in &mut self.rows {
            for &axis in &bare {
                row.ref_rate[axis] = 0.0;
            }
        }
    }

    /// Whether any row has a reading of this axis' gyro.
    #[must_use]
    pub fn has_gyro(&self, axis: Axis) -> bool {
        self.has(Column::Gyro(axis))
    }

    /// The reference of this axis, the most direct one where there are several.
    #[must_use]
    pub fn reference(&self, axis: Axis) -> Option<ReferenceKind> {
        if self.has(Column::Angle(axis)) {
            Some(ReferenceKind::Angle)
        } else if self.has(Column::Quaternion) {
            Some(ReferenceKind::Quaternion)
        } else if self.has(Column::Rate(axis)) {
            Some(ReferenceKind::Rate)
        } else {
            None
        }
    }

    /// The axes that can be fitted: those with both a gyro and a reference.
    #[must_use]
    pub fn fitted_axes(&self) -> Vec<Axis> {
        Axis::ALL.into_iter().filter(|&a| self.has_gyro(a) && self.reference(a).is_some()).collect()
    }
}

/// Rotation from attitude `p` to `q` (both body to world: w, x, y, z), in body axes, rad.
#[must_use]
pub fn turn(p: [f64; 4], q: [f64; 4]) -> [f64; 3] {
    let [p, q] = [p, q].map(|[w, x, y, z]| UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)));
    (p.inverse() * q).scaled_axis().into()
}
