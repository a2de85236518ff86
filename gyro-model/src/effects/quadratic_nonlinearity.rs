//! `quadratic-nonlinearity`: the scale factor grows with rate, φ = ω².

use super::{Acts, Alias, Card, Effect, Felt, Memory, ParameterCard, Role, Signals};
use crate::Axis;
use crate::measured::{HUNDRED, Measured};
use std::borrow::Cow;

/// The effect.
pub static QUADRATIC_NONLINEARITY: QuadraticNonlinearity = QuadraticNonlinearity;

/// See the file's head.
pub struct QuadraticNonlinearity;

static CARD: Card = Card {
    id: "quadratic-nonlinearity",
    title: "an error that grows with the square of the rate",
    physics: "The drive and sense electrodes are not quite linear: the scale factor rises with rate one way and \
              falls the other way.",
    equation: "ω_f = ω + k2 ω²",
    typical: "0.1–0.2 % of full scale in data sheets (at 250 °/s full scale, 0.1 % is k2 = 2.3e-4 s/rad), several times \
              as much on uncalibrated parts",
    source: "IEEE Std 1431, scale factor nonlinearity; MEMS data sheets",
    needs: &[],
    excited_by: "at least two amplitudes",
    mended_by: "exactly, by iteration in the compensated rate",
    at_source: "set a wider range, if the sensor has one: in the middle of its range a sensor is more linear",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "g-sensitivity",
            when: "the sensor sits on a fixed arm, so that centripetal acceleration follows ω²",
            split_by: "another radius, or the sensor on the axis of rotation",
        },
        Alias {
            id: "scale-asymmetry",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: scale-asymmetry has a kink at zero rate, quadratic-nonlinearity is a smooth curve",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "k2",
    unit: "s/rad",
    says: "growth of the scale factor with rate",
    role: Role::Linear,
    neutral: 0.0,
    typical: 1.5e-3,
    bounds: (-0.2, 0.2),
}];

impl Effect for QuadraticNonlinearity {
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
        let at = p[0].times(HUNDRED * HUNDRED);
        format!(
            "your gyro reads {} too {} at 100 °/s, whichever way it turns, and four times that at twice the rate",
            at.size("rad/s"),
            if at.value > 0.0 { "high" } else { "low" }
        )
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return k2 * in->rate * in->rate;".into())
    }
}

impl Felt for QuadraticNonlinearity {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.rate() * s.rate()
    }
}
