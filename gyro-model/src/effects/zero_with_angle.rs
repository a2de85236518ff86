//! A zero that depends on the shaft's angle, b(θ) = a sin θ + c cos θ, as gravity shifts it on a shaft that is not upright: each angle shows
//! it another side of the sensor.
//!
//! It is not in the catalogue, because without an accelerometer it cannot be corrected on another vehicle. A diagnosis asks for it where
//! nothing of the catalogue explains an error that a bias would have to wander for.

use super::{Acts, Card, Effect, Felt, Memory, ParameterCard, Role, Signals};
use crate::Axis;

/// The explanation.
pub(crate) static ZERO_WITH_ANGLE: ZeroWithAngle = ZeroWithAngle;

/// See the file's head.
pub(crate) struct ZeroWithAngle;

static CARD: Card = Card {
    id: "zero-with-angle",
    title: "the zero depends on the shaft's angle",
    physics: "Gravity bends the sensor's structure, from another side at each angle of a shaft that is not upright.",
    equation: "a sin θ + c cos θ",
    typical: "0.01–0.2 °/s",
    source: "Linear acceleration sensitivity, IEEE Std 1431, on a shaft that turns in the field of gravity",
    needs: &[],
    excited_by: "turns of a shaft that is not upright",
    mended_by: "nothing: log the accelerometer, and g-sensitivity has it",
    at_source: "turn the sensor so that the shaft is upright",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

const fn component(name: &'static str, says: &'static str) -> ParameterCard {
    let (unit, role, neutral, typical, bounds) = ("rad/s", Role::Linear, 0.0, 1e-3, (-1.0, 1.0));
    ParameterCard { name, unit, says, role, neutral, typical, bounds }
}

static PARAMETERS: [ParameterCard; 2] =
    [component("a", "zero at a quarter turn less its mean"), component("c", "zero at the angle 0 less its mean")];

impl Effect for ZeroWithAngle {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }
}

impl Felt for ZeroWithAngle {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        let (sin, cos) = s.angle.sin_cos();
        p[0] * sin + p[1] * cos
    }
}
