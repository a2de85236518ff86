//! What a diagnosis, a comparison or a ladder finds of one axis, as data: cases with their numbers. [`crate::words`] makes sentences of it.

use crate::{Axis, fault::FaultKind};
use serde::{Deserialize, Serialize};

/// What is found of one axis. [`Finding::verdict`] is it in one word.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Finding {
    /// Physical effects are missing and named.
    Missing {
        /// The effects; none of them has aliases.
        effects: Vec<NamedEffect>,
        /// Largest error over floor with all of them; `None` where one alone was named and nothing more was looked for.
        over_floor: Option<f64>,
    },
    /// Effects are missing, and the log cannot tell one of them from others.
    Ambiguous {
        /// The effects.
        effects: Vec<NamedEffect>,
        /// As in [`Finding::Missing`].
        over_floor: Option<f64>,
        /// Whether the model has them by now: a ladder added them.
        added: bool,
    },
    /// The error is what noise alone makes, or what the set-up makes beside it.
    Adequate(Adequate),
    /// The log does not decide it.
    CannotTell(Why),
    /// The error is more than noise.
    Unexplained(Excess),
    /// A fault of the data makes every other verdict worthless.
    BadData {
        /// Its kind.
        fault: FaultKind,
        /// The axis that it is in; `None` where it is the whole log's.
        axis: Option<Axis>,
        /// How often.
        count: u64,
    },
    /// The search was stopped before its end.
    Stopped {
        /// Largest error over floor by then.
        #[serde(with = "number")]
        over_floor: f64,
    },
    /// A verdict that came without its reasons, by the short message of a live pipeline.
    Bare {
        /// The verdict.
        verdict: Verdict,
    },
}

/// What a diagnosis comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The error is what noise alone makes.
    Adequate,
    /// One physical effect is missing and named.
    MissingEffect,
    /// One is missing, and this log cannot tell which of a group.
    Ambiguous,
    /// An excess is there and no suspect removes it.
    Unexplained,
    /// The log does not decide it: it lacks a motion, or noise explains what is left as well.
    CannotTell,
    /// The data are faulty.
    BadData,
}

/// An effect that is named.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// Its id.
    pub effect: String,
    /// Effects that it cannot be told from on this log, best first.
    pub aliases: Vec<String>,
}

/// Why nothing is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "because", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Adequate {
    /// The error lies within the floor's band at every averaging time.
    WithinFloor {
        /// Share of the log in which the rate is not known.
        #[serde(with = "number")]
        silent: f64,
    },
    /// What is left is noise with a bias that wanders.
    Wanders(Wander),
    /// What is left is white noise of a size that sensors have.
    WhiteNoise {
        /// Of the gyro, rad/√s.
        #[serde(with = "number")]
        gyro: f64,
        /// Of the reference, rad.
        #[serde(with = "number")]
        reference: f64,
    },
    /// What is left has a known cause that is no effect of the gyro.
    Limited,
}

/// A bias that wanders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wander {
    /// By so much, rad/s.
    #[serde(with = "number")]
    pub size: f64,
    /// Within so many seconds; `None` over the whole log.
    pub within_s: Option<f64>,
}

/// Why a log cannot tell what is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "why", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Why {
    /// The reference does not turn, and the gyro does.
    ReferenceAtRest,
    /// The fit presses the scale factor against its bound.
    Disagrees,
    /// The axis hardly turns.
    NotExcited {
        /// From one end to the other, rad.
        #[serde(with = "number")]
        travel: f64,
        /// Standard error of the scale factor over its value, ten at most.
        #[serde(with = "number")]
        uncertainty: f64,
    },
    /// The axis turns, and the scale factor is not known all the same.
    OneRate {
        /// As in [`Why::NotExcited`].
        #[serde(with = "number")]
        uncertainty: f64,
    },
    /// The axis does not turn at all, and its error is noise.
    AtRest {
        /// What its error is.
        noise: Adequate,
    },
    /// The log is too short to show slow effects.
    TooShort {
        /// Its length, s.
        #[serde(with = "number")]
        seconds: f64,
    },
    /// In most of the log the rate is not known.
    Silent {
        /// The share of it.
        #[serde(with = "number")]
        share: f64,
    },
    /// A slow effect and a bias that wanders explain the rest equally well.
    SlowOrWander {
        /// The effect.
        effect: String,
        /// The bias.
        wander: Wander,
    },
    /// The rest may be noise, or an effect that removes little of it.
    NoiseOrEffect {
        /// The effect.
        effect: String,
    },
    /// The rest is too large for a bias that wanders, and no effect stands out.
    NoneStandsOut {
        /// Largest error over the floor of white noise.
        #[serde(with = "number")]
        over_white: f64,
        /// Share of the error² that has no known cause.
        #[serde(with = "number")]
        unattributed: f64,
    },
    /// Nobody looked for an effect, and a bias that wanders may be what is left, or an effect: a small one, or a slow one.
    NotSearched {
        /// Largest error over floor.
        #[serde(with = "number")]
        over_floor: f64,
        /// Whether it is small.
        small: bool,
    },
    /// The cause of the error is known, and it hides smaller effects.
    Hidden {
        /// Share of the error² that has a known cause.
        #[serde(with = "number")]
        known: f64,
    },
    /// The reference was computed from this very gyro, or is no measurement.
    Dependent,
}

/// An error that is more than noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "because", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Excess {
    /// No effect of the catalogue removes it.
    NoEffect {
        /// Largest error over floor.
        #[serde(with = "number")]
        over_floor: f64,
        /// Share of the error² that has no known cause.
        #[serde(with = "number")]
        unattributed: f64,
    },
    /// Nobody looked for an effect, and no noise that sensors have explains it.
    NotSearched,
    /// The zero is another one at times, and no accelerometer tells why.
    OtherZero {
        /// The other zero minus that at rest, or before and after, or in the mean over all angles, rad/s.
        #[serde(with = "number")]
        size: f64,
        /// Its standard error, rad/s.
        #[serde(with = "number")]
        std_error: f64,
        /// When it is another one.
        #[serde(flatten)]
        when: ZeroMoves,
    },
    /// Nobody looked for an effect, and the error is too large for a bias that wanders.
    NoWander {
        /// Largest error over floor.
        #[serde(with = "number")]
        over_floor: f64,
    },
}

/// When a zero is another one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "when", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ZeroMoves {
    /// While the axis moves.
    Moving,
    /// From one instant to another.
    ForAWhile {
        /// When it left and came back, s.
        between: [f64; 2],
    },
    /// At some angles of the shaft.
    WithAngle,
}

impl Finding {
    /// Whether data, reference or motion are of no use for a verdict: what to do about them is then all that there is to say.
    #[must_use]
    pub const fn is_of_recording(&self) -> bool {
        use Why::{Dependent, Disagrees, NotExcited, OneRate, ReferenceAtRest, Silent, TooShort};
        matches!(
            self,
            Self::BadData { .. }
                | Self::CannotTell(
                    ReferenceAtRest
                        | Disagrees
                        | NotExcited { .. }
                        | OneRate { .. }
                        | TooShort { .. }
                        | Silent { .. }
                        | Dependent
                )
        )
    }

    /// It in one word.
    #[must_use]
    pub const fn verdict(&self) -> Verdict {
        match self {
            Self::Missing { .. } => Verdict::MissingEffect,
            Self::Ambiguous { .. } => Verdict::Ambiguous,
            Self::Adequate(_) => Verdict::Adequate,
            Self::CannotTell(_) | Self::Stopped { .. } => Verdict::CannotTell,
            Self::Unexplained(_) => Verdict::Unexplained,
            Self::BadData { .. } => Verdict::BadData,
            Self::Bare { verdict } => *verdict,
        }
    }

    /// Whether effects are named that the model has not.
    #[must_use]
    pub const fn names(&self) -> bool {
        matches!(self, Self::Missing { .. } | Self::Ambiguous { added: false, .. })
    }

    /// Whether this effect is among those that it names, not as an alias of another one.
    #[must_use]
    pub fn has(&self, effect: &str) -> bool {
        let (Self::Missing { effects, .. } | Self::Ambiguous { effects, .. }) = self else { return false };
        effects.iter().any(|named| named.effect == effect)
    }
}

/// What is to be said beside a finding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "remark", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Remark {
    /// Besides, the log does not show the base model itself.
    Unexcited(Why),
    /// What became of an effect that the user wrote.
    OwnEffect {
        /// Its id.
        effect: String,
        /// What became of it.
        became: Became,
    },
    /// The axis does not turn.
    AtRest,
    /// α is one that no gyro has: the fault `wrong-ratio` has the words.
    WrongRatio,
    /// Another axis of the same orientation lacks an effect, whose error may be what is left here.
    OtherAxis {
        /// The other axis.
        axis: Axis,
        /// What it lacks.
        effect: String,
    },
    /// Effects of the model that this log does not tell from nothing.
    NotSeen {
        /// Their ids.
        effects: Vec<String>,
    },
    /// Axes whose data are faulty, without which the others were judged.
    JudgedWithout {
        /// Those axes; where this is one of them, the others were judged without it.
        axes: Vec<Axis>,
    },
    /// Axes without a reference whose gyros read a share of the turn about this one.
    ReadTheTurn {
        /// Those axes, with that share.
        shares: Vec<(Axis, f64)>,
    },
    /// Effects of the zero that may be the gyro's or the reference's, which is a sensor of rates too.
    EitherSensor {
        /// Their ids.
        effects: Vec<String>,
    },
    /// The temperature is logged in steps, and what the zero does within one is left in the error.
    CoarseTemperature {
        /// The step, K.
        #[serde(with = "number")]
        step: f64,
        /// What that leaves of the zero (RMS), rad/s.
        #[serde(with = "number")]
        error: f64,
    },
    /// The clocks of log and reference were set to each other by the motion in both, and a delay went with it.
    OtherClock,
    /// The model was fitted on this very log.
    OwnLog,
    /// A parameter is not what the model's file says.
    Moved {
        /// `effect.name`.
        parameter: String,
        /// By so many standard errors.
        #[serde(with = "number")]
        errors: f64,
    },
}

/// Standard errors from zero below which an effect that was asked for is [`Remark::NotSeen`].
pub const NOT_SEEN: f64 = 2.0;

/// What became of an effect that the user wrote.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "became", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Became {
    /// It has no finite value anywhere.
    Undefined,
    /// It has none in a share of the log.
    PartlyUndefined {
        /// The share.
        #[serde(with = "number")]
        share: f64,
    },
    /// It removes no more than noise does.
    Noise,
    /// What it depends on does not change.
    NothingChanges,
    /// The model has it already, in other words.
    Spanned,
    /// It removes next to nothing.
    RemovesNothing,
}

/// A number in JSON; `null` where it is not finite.
mod number {
    use serde::{Deserialize, Deserializer, Serializer};

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
    pub(super) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if value.is_finite() { serializer.serialize_f64(*value) } else { serializer.serialize_none() }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_has_its_kind_its_reason_and_its_numbers_in_json() {
        let short = Finding::CannotTell(Why::TooShort { seconds: 6.0 });
        let json = serde_json::to_string(&short).unwrap();
        assert_eq!(json, r#"{"kind":"cannot-tell","why":"too-short","seconds":6.0}"#);
        assert_eq!(serde_json::from_str::<Finding>(&json).unwrap(), short);
        let late = NamedEffect { effect: "delay".into(), aliases: vec!["lag".into()] };
        let late = Finding::Ambiguous { effects: vec![late], over_floor: None, added: false };
        let back: Finding = serde_json::from_str(&serde_json::to_string(&late).unwrap()).unwrap();
        assert_eq!((back.verdict(), &back), (Verdict::Ambiguous, &late));
    }

    #[test]
    fn what_is_not_finite_is_null_and_comes_back() {
        let json = serde_json::to_string(&Finding::Stopped { over_floor: f64::INFINITY }).unwrap();
        assert_eq!(json, r#"{"kind":"stopped","over_floor":null}"#);
        let back: Finding = serde_json::from_str(&json).unwrap();
        assert!(matches!(back, Finding::Stopped { over_floor } if over_floor.is_nan()));
    }

    #[test]
    fn an_axis_at_rest_says_what_its_error_is() {
        let noise = Adequate::Wanders(Wander { size: 1e-3, within_s: Some(20.0) });
        let rest = Finding::CannotTell(Why::AtRest { noise });
        let json = serde_json::to_value(&rest).unwrap();
        assert_eq!(
            (&json["kind"], &json["why"], &json["noise"]["because"]),
            (&"cannot-tell".into(), &"at-rest".into(), &"wanders".into())
        );
        assert_eq!(serde_json::from_value::<Finding>(json).unwrap(), rest);
    }
}
