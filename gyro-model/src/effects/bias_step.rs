//! `bias-step`: the bias jumps once, φ = 1 for t > t₀.

use super::{Acts, Card, Effect, Felt, Memory, ParameterCard, Role, Signals, Span, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static BIAS_STEP: BiasStep = BiasStep;

/// See the file's head.
pub struct BiasStep;

static CARD: Card = Card {
    id: "bias-step",
    title: "the zero jumps once and stays there",
    physics: "A shock, a clipped temperature, a brown-out or a crack shifts the bias from one instant to the next, \
              and it stays there.",
    equation: "ω_f = ω + j for t > t0",
    typical: "0.05–4 °/s",
    source: "recordings; IEEE Std 952, bias repeatability",
    needs: &[],
    excited_by: "a log that contains the jump",
    mended_by: "exactly, after the jump; the next jump cannot be predicted",
    at_source: "find what happens at that time: a knock, a brown-out, a motor that starts",
    traits: &[Trait::Slow, Trait::Onset],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "j",
        unit: "rad/s",
        says: "height of the jump",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.01,
        bounds: (-5.0, 5.0),
    },
    ParameterCard {
        name: "t0",
        unit: "s",
        says: "when it jumps",
        role: Role::Shape,
        neutral: 30.0,
        typical: 30.0,
        bounds: (0.0, 1e7),
    },
];

impl Effect for BiasStep {
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
        let goes = if p[0].value < 0.0 { "down" } else { "up" };
        format!("your gyro's zero jumps {goes} by {} at {}, and stays there", p[0].size("rad/s"), p[1].signed("s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return in->t > t0 ? j : 0.0;".into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        const INSTANTS: u32 = 60;
        (1..INSTANTS).map(|k| vec![span.start + span.duration * f64::from(k) / f64::from(INSTANTS)]).collect()
    }
}

impl Felt for BiasStep {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        if s.t > p[1] { p[0] } else { 0.0 }
    }
}
