//! `g-squared-sensitivity`: vibration rectification, φ = a_x², a_y², a_z².

use super::{Acts, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals};
use crate::Axis;
use crate::measured::{Measured, parts};
use std::borrow::Cow;

/// The effect.
pub static G_SQUARED_SENSITIVITY: GSquaredSensitivity = GSquaredSensitivity;

/// See the file's head.
pub struct GSquaredSensitivity;

static CARD: Card = Card {
    id: "g-squared-sensitivity",
    title: "vibration rectification: vibration shifts the zero",
    physics: "A nonlinear suspension turns acceleration either way into an error of one sign: vibration whose mean \
              is zero moves the bias.",
    equation: "ω_f = ω + g_x a_x² + g_y a_y² + g_z a_z², a the specific force",
    typical: "rarely in data sheets; 1e-4–1e-2 °/s per g² (2e-8–2e-6 rad/s per (m/s²)²), ten times that on cheap parts",
    source: "IEEE Std 1431, g²-sensitivity (vibration rectification)",
    needs: &[Need::Accelerometer],
    excited_by: "a horizontal axis, or vibration of changing strength",
    mended_by: "exactly, where acceleration is measured without aliasing",
    at_source: "keep vibration away from the sensor: balance rotating parts, mount the sensor on soft material",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 3] = [
    ParameterCard {
        name: "g_x",
        unit: "rad/s per (m/s²)²",
        says: "error per squared acceleration along x",
        role: Role::Linear,
        neutral: 0.0,
        typical: 2e-5,
        bounds: (-0.01, 0.01),
    },
    ParameterCard {
        name: "g_y",
        unit: "rad/s per (m/s²)²",
        says: "error per squared acceleration along y",
        role: Role::Linear,
        neutral: 0.0,
        typical: 2e-5,
        bounds: (-0.01, 0.01),
    },
    ParameterCard {
        name: "g_z",
        unit: "rad/s per (m/s²)²",
        says: "error per squared acceleration along z",
        role: Role::Linear,
        neutral: 0.0,
        typical: 2e-5,
        bounds: (-0.01, 0.01),
    },
];

/// What compensation does, in C.
const IN_C: &str = "\
const double x = in->accel[0], y = in->accel[1], z = in->accel[2];
return g_x * x * x + g_y * y * y + g_z * z * z;";

impl Effect for GSquaredSensitivity {
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
        let names = Axis::ALL.map(|along| format!("along {along}"));
        format!("your gyro takes shaking for rotation: {}", parts(p, &names, |m| m.signed("rad/s per (m/s²)²")))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some(IN_C.into())
    }
}

impl Felt for GSquaredSensitivity {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        let [x, y, z] = s.accel;
        p[0] * x * x + p[1] * y * y + p[2] * z * z
    }
}
