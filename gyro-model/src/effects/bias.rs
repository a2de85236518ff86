//! `bias`: the reading at rest is −δ/α (the paper's equation (1)).

use super::{Acts, Card, Effect, ParameterCard, Role};
use crate::Axis;
use crate::measured::Measured;

/// The effect.
pub static BIAS: Bias = Bias;

/// See the file's head.
pub struct Bias;

static CARD: Card = Card {
    id: "bias",
    title: "zero-rate output: what it reads at rest",
    physics: "At rest the sensor does not read zero. Integrated, the bias is an angle that grows with time.",
    equation: "ω̂ = α ω_g + δ; the reading at rest is −δ/α",
    typical: "0.1–20 °/s on MEMS parts",
    source: "IEEE Std 1431, bias; equation (1) of the paper behind this project",
    needs: &[],
    excited_by: "any log",
    mended_by: "exactly, as long as it does not wander",
    at_source: "average a few seconds at rest after every start, if the vehicle can stand still",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "delta",
    unit: "rad/s",
    says: "added to the scaled reading",
    role: Role::Linear,
    neutral: 0.0,
    typical: 0.02,
    bounds: (-50.0, 50.0),
}];

impl Effect for Bias {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Calibration
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("your gyro's zero is off by {}", p[0].times(-1.0).signed("rad/s"))
    }
}
