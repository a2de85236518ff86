//! A suspect under judgement: plain numbers, so that a test of it needs no log.

use super::decision::{Condition, Fact, Measure};
use crate::{statistics::Estimate, thresholds as limit};

/// What the tests see of one suspect beside the model as it stands.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "facts that are independent of one another")]
pub(super) struct Case {
    /// Whether the readings themselves show it: a limit that they reach again and again.
    pub is_read_off: bool,
    /// Whether it is a sine of one frequency.
    pub is_line: bool,
    /// Whether it makes a mean over time of what the gyro turned, noise included.
    pub is_mean: bool,
    /// Whether it goes with time or with what changes slowly in it.
    pub is_slow: bool,
    /// How often its error swings from one side of its mean to the other.
    pub swings: f64,
    /// J without it.
    pub before: f64,
    /// J with it, on the same rows.
    pub after: f64,
    /// The most that the error grows by at any averaging time, E₁/max(E₀, 1.4 F).
    pub grows: f64,
    /// Of the steps that the model without it judges, the share that it marks as unknown.
    pub silences: f64,
    /// Chance of its gain in ln L from noise alone, corrected for the search.
    pub p_value: f64,
    /// Gain in ln L.
    pub gain: f64,
    /// Gain in ln L on blocks that were not fitted, their sum.
    pub held_out: Estimate,
    /// ln(J₀/J₁), mean over the blocks.
    pub fall: Estimate,
    /// Whether what the model leaves without it is more than a bias that wanders makes.
    pub is_beyond_wander: bool,
    /// Whether what it leaves is noise that sensors have.
    pub leaves_noise: bool,
    /// Its largest coefficient over its typical size.
    pub size: f64,
    /// The largest standard error of its parameters, each over the size that it has to stay below.
    pub doubt: f64,
    /// Whether the gyro's own reading has the line.
    pub is_in_reading: bool,
    /// Whether the line is fast enough for aliased motion to show in the reference.
    pub may_be_aliased: bool,
    /// Whether the reference has the line too, of a tenth of its size at least.
    pub is_in_reference: bool,
    /// Whether a parameter ran to the end of what is physical.
    pub is_at_bound: bool,
    /// The same of a shape that is nothing inside its bounds: other missing physics may press it there.
    pub is_shape_at_bound: bool,
}

impl Case {
    /// Nothing known: to be filled in.
    #[cfg(test)]
    pub(super) const UNKNOWN: Self = Self {
        is_read_off: false,
        is_line: false,
        is_mean: false,
        is_slow: false,
        swings: f64::INFINITY,
        before: 10.0,
        after: 1.0,
        grows: 0.5,
        silences: 0.0,
        p_value: 1e-9,
        gain: 100.0,
        held_out: Estimate { value: 80.0, std_error: 10.0 },
        fall: Estimate { value: 2.0, std_error: 0.1 },
        is_beyond_wander: true,
        leaves_noise: true,
        size: 1.0,
        doubt: 0.1,
        is_in_reading: false,
        may_be_aliased: false,
        is_in_reference: false,
        is_at_bound: false,
        is_shape_at_bound: false,
    };

    /// Share of J − 1 that is gone; nothing of it where J is 1.
    fn share_gone(&self) -> f64 {
        if self.before > 1.0 { (self.before - self.after) / (self.before - 1.0) } else { f64::NAN }
    }

    /// What holds of a gain on data that were not fitted, as a share of the gain.
    fn held_share(&self) -> f64 {
        let gain = self.gain.min(limit::GAIN_COUNTED.value);
        let held = self.held_out.value;
        if gain > 0.0 {
            held / gain
        } else if held > gain {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        }
    }
}

type M = Measure<Case>;
type F = Fact<Case>;

/// J without it.
pub(super) static BEFORE: M = Measure { name: "J without it", of: |c| c.before };
/// J with it.
pub(super) static AFTER: M = Measure { name: "J with it", of: |c| c.after };
/// Where the error grows most.
pub(super) static GROWS: M =
    Measure { name: "error with it over error without it at the worst averaging time", of: |c| c.grows };
/// The steps that it marks as unknown.
pub(super) static SILENCES: M =
    Measure { name: "share of the judged steps that it marks as unknown", of: |c| c.silences };
/// The ratio of both.
pub(super) static RATIO: M = Measure { name: "J with it over J without it", of: |c| c.after / c.before };
/// Share of J − 1 that it removes.
pub(super) static REMOVED: M = Measure { name: "share of J − 1 that it removes", of: Case::share_gone };
/// p.
pub(super) static P_VALUE: M = Measure { name: "p, corrected for the search", of: |c| c.p_value };
/// The fall of the error.
pub(super) static FALL: M = Measure { name: "fall of ln J over the blocks", of: |c| c.fall.in_errors() };
/// The held-out gain in ln L.
pub(super) static HELD_OUT: M = Measure { name: "held-out gain in ln L", of: |c| c.held_out.in_errors() };
/// What holds of the gain, as far as it counts.
pub(super) static HELD_SHARE: M =
    Measure { name: "held-out share of the gain in ln L (of a gain of 40 at most)", of: Case::held_share };
/// The size.
pub(super) static SIZE: M = Measure { name: "largest coefficient over its typical size", of: |c| c.size };
/// The standard errors.
pub(super) static DOUBT: M =
    Measure { name: "largest standard error of a parameter over its own size", of: |c| c.doubt };
/// The swings.
pub(super) static SWINGS: M = Measure { name: "number of swings of its error", of: |c| c.swings };

/// The facts.
pub(super) static IS_SLOW: F = Fact { says: "a slow effect", of: |c| c.is_slow };
/// A line.
pub(super) static IS_LINE: F = Fact { says: "a spectral line", of: |c| c.is_line };
/// A mean.
pub(super) static IS_MEAN: F = Fact { says: "a mean over time", of: |c| c.is_mean };
/// More than a wander.
pub(super) static IS_BEYOND_WANDER: F =
    Fact { says: "without it, more error than a wandering bias makes", of: |c| c.is_beyond_wander };
/// Leaves noise.
pub(super) static LEAVES_NOISE: F =
    Fact { says: "with it, only noise of a size that sensors have is left", of: |c| c.leaves_noise };
/// In the reading.
pub(super) static IS_IN_READING: F = Fact { says: "a line of the gyro's own spectrum", of: |c| c.is_in_reading };
/// Fast enough.
pub(super) static MAY_BE_ALIASED: F =
    Fact { says: "a line as fast as aliased motion that a reference shows", of: |c| c.may_be_aliased };
/// In the reference.
pub(super) static IS_IN_REFERENCE: F = Fact { says: "a line that the reference shows too", of: |c| c.is_in_reference };
/// Read off.
pub(super) static IS_READ_OFF: F = Fact { says: "read off the readings themselves", of: |c| c.is_read_off };
/// A parameter at its bound.
pub(super) static IS_AT_BOUND: F = Fact { says: "a coefficient at its physical bound", of: |c| c.is_at_bound };
/// A shape at its bound.
pub(super) static IS_SHAPE_AT_BOUND: F =
    Fact { says: "a shape parameter at its physical bound", of: |c| c.is_shape_at_bound };

/// Whatever is not read off the readings.
pub(super) const JUDGED: Condition<Case> = Condition::Not(&IS_READ_OFF);
