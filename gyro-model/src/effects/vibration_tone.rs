//! `vibration-tone`: a line in the spectrum that the shaft does not make, φ = sin, cos 2πft.

use super::{Acts, Card, Effect, Felt, Memory, ParameterCard, Role, Signals, Span, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static VIBRATION_TONE: VibrationTone = VibrationTone;

/// See the file's head.
pub struct VibrationTone;

static CARD: Card = Card {
    id: "vibration-tone",
    title: "a vibration at one frequency reads as rate",
    physics: "A fan, a propeller or the supply's ripple shakes the sensor or its electronics at one frequency; the \
              shaft does not turn with it.",
    equation: "ω_f = ω + a_sin sin 2πft + a_cos cos 2πft, f ≥ 1 Hz, t from the log's first row",
    typical: "0.05–5 °/s, 5–400 Hz",
    source: "vibration environment of motors and fans",
    needs: &[],
    excited_by: "any log; a second log shows whether it stays",
    mended_by: "only within one log: the phase differs in the next one",
    at_source: "find what turns at that frequency (fan, propeller, pump), balance it, or mount the sensor on soft material",
    traits: &[Trait::Line],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 3] = [
    ParameterCard {
        name: "a_sin",
        unit: "rad/s",
        says: "sine part",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.01,
        bounds: (-5.0, 5.0),
    },
    ParameterCard {
        name: "a_cos",
        unit: "rad/s",
        says: "cosine part",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.0,
        bounds: (-5.0, 5.0),
    },
    ParameterCard {
        name: "f",
        unit: "Hz",
        says: "frequency",
        role: Role::Shape,
        neutral: f64::INFINITY,
        typical: 11.0,
        bounds: (1.0, f64::INFINITY),
    },
];

/// What compensation does, in C.
const IN_C: &str = "\
const double phase = 6.283185307179586 * f * in->t;
return a_sin * sin(phase) + a_cos * cos(phase);";

impl Effect for VibrationTone {
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
        let amplitude = p[0].value.hypot(p[1].value);
        let along = (p[0].value * p[0].std_error).hypot(p[1].value * p[1].std_error) / amplitude;
        let amplitude = Measured { value: amplitude, std_error: along };
        format!("your gyro reads a vibration of {} as {} of rotation", p[2].signed("Hz"), amplitude.size("rad/s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some(IN_C.into())
    }

    /// Empty: a line is as narrow as the log is long, so it is sought in the spectrum of the residual.
    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        Vec::new()
    }
}

impl Felt for VibrationTone {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        if !p[2].is_finite() {
            return 0.0;
        }
        let (sin, cos) = (std::f64::consts::TAU * p[2] * s.t).sin_cos();
        p[0] * sin + p[1] * cos
    }
}
