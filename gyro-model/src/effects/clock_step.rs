//! `clock-step`: a clock was set, ω_f(t) = ω(t − j) for t > t₀.

use super::{Acts, Card, Effect, ParameterCard, Role, Span, Timing, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static CLOCK_STEP: ClockStep = ClockStep;

/// See the file's head.
pub struct ClockStep;

static CARD: Card = Card {
    id: "clock-step",
    title: "a clock was set during the log: the delay changes once",
    physics: "NTP, a restarted driver or an overflowing buffer shifts one clock against the other. From that instant \
             on every reading is later, or earlier, than before.",
    equation: "ω_f(t) = ω(t − j) for t > t0",
    typical: "1–1000 ms",
    source: "NTP steps a clock that is off by more than 128 ms (RFC 5905)",
    needs: &[],
    excited_by: "changing rates before and after the instant",
    mended_by: "re-stamping",
    at_source: "stamp with a clock that is never set: CLOCK_MONOTONIC, or the sensor's own. Let NTP correct the clock gradually",
    traits: &[Trait::Onset],
    simpler: &["delay"],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "j",
        unit: "s",
        says: "how much later the gyro is from then on",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.02,
        bounds: (-1.0, 1.0),
    },
    ParameterCard {
        name: "t0",
        unit: "s",
        says: "when the clock is set",
        role: Role::Shape,
        neutral: 30.0,
        typical: 30.0,
        bounds: (0.0, 1e7),
    },
];

impl Effect for ClockStep {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Timing(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        let goes = if p[0].value < 0.0 { "earlier" } else { "later" };
        format!("your gyro is {} {goes} from {} on", p[0].size("s"), p[1].signed("s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return t > t0 ? t - j : t;".into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        const INSTANTS: u32 = 60;
        (1..INSTANTS).map(|k| vec![span.start + span.duration * f64::from(k) / f64::from(INSTANTS)]).collect()
    }
}

impl Timing for ClockStep {
    fn valid_time(&self, p: &[f64], t: f64) -> f64 {
        if t > p[1] { t - p[0] } else { t }
    }
}
