//! `bias-drift`: a ramp in rate, φ = t.

use super::{Acts, Alias, Card, Effect, Felt, Memory, ParameterCard, Role, Signals, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static BIAS_DRIFT: BiasDrift = BiasDrift;

/// See the file's head.
pub struct BiasDrift;

static CARD: Card = Card {
    id: "bias-drift",
    title: "the zero-rate output drifts steadily",
    physics: "The bias moves steadily through the log: ageing, settling stress, or a cause that is not measured.",
    equation: "ω_f = ω + r t, t from the log's first row",
    typical: "0.001–0.1 °/s per minute (3e-7–3e-5 rad/s²), more while settling",
    source: "IEEE Std 1431 and IEEE Std 952, rate ramp",
    needs: &[],
    excited_by: "a long log",
    mended_by: "within one log; the slope may differ in the next one",
    at_source: "find what changes steadily (temperature, supply, stress on the board) and record it",
    traits: &[Trait::Slow],
    simpler: &[],
    aliases: &[
        Alias {
            id: "temperature-bias",
            when: "the temperature rises steadily",
            split_by: "heat and cool: a drift continues, a temperature effect reverses",
        },
        Alias {
            id: "warm-up",
            when: "the log is short against the time constant",
            split_by: "a log of several time constants: a warm-up ends, a drift continues",
        },
        Alias {
            id: "supply-voltage",
            when: "one battery discharge",
            split_by: "change the supply: a drift does not depend on it",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "r",
    unit: "rad/s²",
    says: "slope of the bias",
    role: Role::Linear,
    neutral: 0.0,
    typical: 5e-5,
    bounds: (-0.1, 0.1),
}];

impl Effect for BiasDrift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("your gyro's zero {} by {} a minute", p[0].goes(), p[0].times(60.0).size("rad/s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return r * in->t;".into())
    }
}

impl Felt for BiasDrift {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.t
    }
}
