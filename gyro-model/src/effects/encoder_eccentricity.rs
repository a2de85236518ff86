//! `encoder-eccentricity`: the reference's once-per-turn error, ψ = sin θ, cos θ.

use super::{Acts, Alias, Card, Effect, Memory, Need, ParameterCard, ReferenceAngle, Role, Signals};
use crate::Axis;
use crate::measured::{Measured, amplitude};

/// The effect.
pub static ENCODER_ECCENTRICITY: EncoderEccentricity = EncoderEccentricity;

/// See the file's head.
pub struct EncoderEccentricity;

static CARD: Card = Card {
    id: "encoder-eccentricity",
    title: "once-per-turn error of the encoder",
    physics: "The magnet or the code wheel sits off the axis of rotation, so the encoder is ahead on one half of the \
              turn and behind on the other.",
    equation: "θ_e = θ + a_sin sin θ + a_cos cos θ, θ as the reference counts it",
    typical: "0.05–2° (a magnet 2° off is a ripple of 3.5 % in rate)",
    source: "eccentricity e on radius R gives e/R; data sheets of magnetic encoders",
    needs: &[Need::AngleReference],
    excited_by: "most of a turn",
    mended_by: "taken out of the reference",
    at_source: "centre the magnet or code wheel on the axis",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "g-sensitivity",
            when: "the rate is constant, so that both errors repeat once a turn",
            split_by: "two rates (the encoder's error in rate grows with rate, that of gravity does not), or a \
             vertical axis",
        },
        Alias {
            id: "scale-factor",
            when: "the travel is much less than a turn: the fitted scale factor absorbs the error and the residual \
             looks clean",
            split_by: "full turns",
        },
    ],
};

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "a_sin",
        unit: "rad",
        says: "sine part",
        role: Role::Linear,
        neutral: 0.0,
        typical: 8e-3,
        bounds: (-0.3, 0.3),
    },
    ParameterCard {
        name: "a_cos",
        unit: "rad",
        says: "cosine part",
        role: Role::Linear,
        neutral: 0.0,
        typical: 4e-3,
        bounds: (-0.3, 0.3),
    },
];

impl Effect for EncoderEccentricity {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Reference(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("the encoder has an error of up to {} that repeats once per turn", amplitude(p).size("rad"))
    }
}

impl ReferenceAngle for EncoderEccentricity {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        let (sin, cos) = s.angle.sin_cos();
        p[0] * sin + p[1] * cos
    }
}
