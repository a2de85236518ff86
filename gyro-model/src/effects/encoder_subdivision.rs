//! `encoder-subdivision`: the reference's error n times a turn, ψ = sin nθ, cos nθ.

use super::{Acts, Card, Effect, Memory, Need, ParameterCard, ReferenceAngle, Role, Signals, Span};
use crate::Axis;
use crate::measured::{Measured, amplitude};

/// The effect.
pub static ENCODER_SUBDIVISION: EncoderSubdivision = EncoderSubdivision;

/// See the file's head.
pub struct EncoderSubdivision;

static CARD: Card = Card {
    id: "encoder-subdivision",
    title: "encoder error twice a turn and more often",
    physics: "Unequal amplitudes or a phase error of the two tracks, an oval wheel, or poles of unequal strength \
              make an error that repeats n times a turn.",
    equation: "θ_e = θ + a_sin sin nθ + a_cos cos nθ, n a whole number",
    typical: "0.02–0.5°",
    source: "interpolation error in data sheets of magnetic and optical encoders",
    needs: &[Need::AngleReference],
    excited_by: "most of a turn",
    mended_by: "taken out of the reference",
    at_source: "run the encoder's own linearisation, or trim amplitude and phase of its two tracks",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 3] = [
    ParameterCard {
        name: "a_sin",
        unit: "rad",
        says: "sine part",
        role: Role::Linear,
        neutral: 0.0,
        typical: 4e-3,
        bounds: (-0.3, 0.3),
    },
    ParameterCard {
        name: "a_cos",
        unit: "rad",
        says: "cosine part",
        role: Role::Linear,
        neutral: 0.0,
        typical: 2e-3,
        bounds: (-0.3, 0.3),
    },
    ParameterCard {
        name: "n",
        unit: "1",
        says: "times a turn: a whole number, scanned and never refined",
        role: Role::Chosen,
        neutral: 2.0,
        typical: 2.0,
        bounds: (2.0, 100_000.0),
    },
];

impl Effect for EncoderSubdivision {
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
        let times =
            if p[2].value.round() == 2.0 { "twice".to_owned() } else { format!("{} times", p[2].value.round()) };
        format!("the encoder has an error of up to {} that repeats {times} per turn", amplitude(p).size("rad"))
    }

    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        [2.0, 3.0, 4.0, 5.0, 6.0, 8.0].iter().map(|&n| vec![n]).collect()
    }
}

impl ReferenceAngle for EncoderSubdivision {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        let (sin, cos) = (p[2].round() * s.angle).sin_cos();
        p[0] * sin + p[1] * cos
    }
}
