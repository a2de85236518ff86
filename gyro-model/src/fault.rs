//! A fault of the data: what kind it is, where it is, and how bad that is.

use crate::Axis;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The kinds of faults that a log may have, in the order of their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FaultKind {
    /// Motion too fast for the sampling rate, in gyro and reference.
    AliasedMotion,
    /// Rows that a driver stamped in bursts.
    BurstTimestamps,
    /// The reference was computed from this very gyro, or is a command.
    DependentReference,
    /// Rows that are not there.
    Dropouts,
    /// One reading in several rows.
    HeldSamples,
    /// Counts of an encoder that were lost at speed.
    LostCounts,
    /// A value that stands for none.
    Markers,
    /// No value where one is due, or an infinite one.
    NonFinite,
    /// The motion does not show what is needed.
    NotExcited,
    /// The second file has another clock.
    OtherClock,
    /// Single readings that are impossible.
    Outliers,
    /// The reference jumps.
    ReferenceJumps,
    /// A row twice.
    RepeatedSamples,
    /// Lines that were not understood.
    SkippedLines,
    /// A sensor that read one value for long.
    StuckChannel,
    /// The gyro of another axis fits the reference.
    SwappedAxes,
    /// Times that jump or go back.
    TimeGoingBack,
    /// A counter of times that began again.
    TimerOverflow,
    /// Times that scatter.
    TimestampJitter,
    /// Readings of which one byte is of another reading.
    TornReadings,
    /// A reference orientation whose axes are not the gyro's.
    TurnedReference,
    /// Columns that are not understood.
    UnusedColumns,
    /// Readings beyond the range, with the other sign.
    Wrapped,
    /// Gyro and reference turn in a ratio that no scale factor has.
    WrongRatio,
    /// Gyro and reference have opposite signs.
    WrongSign,
    /// A channel in another unit than its name says.
    WrongUnit,
}

impl FaultKind {
    /// Its name, as JSON has it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::AliasedMotion => "aliased-motion",
            Self::BurstTimestamps => "burst-timestamps",
            Self::DependentReference => "dependent-reference",
            Self::Dropouts => "dropouts",
            Self::HeldSamples => "held-samples",
            Self::LostCounts => "lost-counts",
            Self::Markers => "markers",
            Self::NonFinite => "non-finite",
            Self::NotExcited => "not-excited",
            Self::OtherClock => "other-clock",
            Self::Outliers => "outliers",
            Self::ReferenceJumps => "reference-jumps",
            Self::RepeatedSamples => "repeated-samples",
            Self::SkippedLines => "skipped-lines",
            Self::StuckChannel => "stuck-channel",
            Self::SwappedAxes => "swapped-axes",
            Self::TimeGoingBack => "time-going-back",
            Self::TimerOverflow => "timer-overflow",
            Self::TimestampJitter => "timestamp-jitter",
            Self::TornReadings => "torn-readings",
            Self::TurnedReference => "turned-reference",
            Self::UnusedColumns => "unused-columns",
            Self::Wrapped => "wrapped",
            Self::WrongRatio => "wrong-ratio",
            Self::WrongSign => "wrong-sign",
            Self::WrongUnit => "wrong-unit",
        }
    }

    /// Whether it makes rows unusable.
    #[must_use]
    pub const fn costs_rows(self) -> bool {
        matches!(
            self,
            Self::NonFinite
                | Self::TimeGoingBack
                | Self::Outliers
                | Self::Markers
                | Self::TornReadings
                | Self::RepeatedSamples
        )
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A fault of the data, reported beside the effects and never as physics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DataFault {
    /// What kind it is.
    #[serde(rename = "fault")]
    pub kind: FaultKind,
    /// The axis whose gyro or reference it is in; `None` where it concerns the log as a whole.
    #[serde(default)]
    pub axis: Option<Axis>,
    /// How often.
    pub count: u64,
    /// When first, s.
    pub first_t: Option<f64>,
    /// In words: which column, where, what to do.
    pub says: String,
}

/// Share of a log in which a sensor may be stuck and what it read meanwhile is taken out: more of it makes the log worthless.
pub const STUCK_UP_TO: f64 = 0.1;

impl DataFault {
    /// Whether it concerns an axis: its own, or the log as a whole.
    #[must_use]
    pub fn concerns(&self, axis: Axis) -> bool {
        self.axis.is_none_or(|own| own == axis)
    }

    /// Whether it makes every verdict on what it is in worthless, of a log of so many rows. A channel that was stuck for little of it
    /// is not among them: what it read meanwhile is taken out.
    #[must_use]
    pub fn is_fatal(&self, rows: usize) -> bool {
        match self.kind {
            FaultKind::WrongUnit | FaultKind::WrongSign | FaultKind::SwappedAxes | FaultKind::BurstTimestamps => true,
            // Of a sensor that hung at rest the rest of the log can be judged.
            FaultKind::StuckChannel => self.axis.is_some() && self.count as f64 >= STUCK_UP_TO * rows as f64,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_has_one_name_in_json_and_in_text() {
        for name in ["aliased-motion", "dependent-reference", "non-finite", "wrapped", "wrong-unit"] {
            let kind: FaultKind = serde_json::from_value(name.into()).unwrap();
            assert_eq!((kind.name(), serde_json::to_value(kind).unwrap()), (name, name.into()));
        }
    }

    #[test]
    fn a_sensor_that_is_stuck_for_little_of_a_log_does_not_spoil_it() {
        let stuck =
            |axis, count| DataFault { kind: FaultKind::StuckChannel, axis, count, first_t: None, says: String::new() };
        assert!(stuck(Some(Axis::X), 600).is_fatal(1000) && !stuck(Some(Axis::X), 50).is_fatal(1000));
        assert!(!stuck(None, 1000).is_fatal(1000));
    }
}
