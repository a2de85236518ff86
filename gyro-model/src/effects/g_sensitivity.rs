//! `g-sensitivity`: acceleration mistaken for rotation, φ = a_x, a_y, a_z.

use super::{Acts, Alias, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals};
use crate::Axis;
use crate::measured::{Measured, parts};
use std::borrow::Cow;

/// The effect.
pub static G_SENSITIVITY: GSensitivity = GSensitivity;

/// See the file's head.
pub struct GSensitivity;

static CARD: Card = Card {
    id: "g-sensitivity",
    title: "acceleration is read as rate",
    physics: "Acceleration bends the suspension of the vibrating mass, and the sense electrodes take that for \
              rotation. Gravity turning in the body frame does the same as shaking.",
    equation: "ω_f = ω + g_x a_x + g_y a_y + g_z a_z, a the specific force",
    typical: "0.01–0.1 °/s per g (1.8e-5–1.8e-4 rad/s per m/s²)",
    source: "IEEE Std 1431, g-sensitivity; MEMS data sheets",
    needs: &[Need::Accelerometer],
    excited_by: "a horizontal axis (gravity turns), or an arm and changing rates",
    mended_by: "exactly, where acceleration is measured at the sensor",
    at_source: "mount the sensor near the axis of rotation and on soft material, or use a part that is less sensitive to acceleration",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "delay",
            when: "the sensor sits on an arm, so that tangential acceleration follows dω/dt; always, to first order",
            split_by: "another radius, or shaking without turning; or the accelerometer as regressor",
        },
        Alias {
            id: "lag",
            when: "one sine of small amplitude, where gravity and dω/dt are proportional",
            split_by: "motion of more than one frequency, or of large amplitude",
        },
        Alias {
            id: "quadratic-nonlinearity",
            when: "the sensor sits on a fixed arm, so that centripetal acceleration follows ω²",
            split_by: "another radius, or the sensor on the axis of rotation",
        },
        Alias {
            id: "encoder-eccentricity",
            when: "the rate is constant, so that both errors repeat once a turn",
            split_by: "two rates (the encoder's error in rate grows with rate, that of gravity does not), or a \
             vertical axis",
        },
    ],
};

static PARAMETERS: [ParameterCard; 3] = [
    ParameterCard {
        name: "g_x",
        unit: "rad/s per m/s²",
        says: "error per acceleration along x",
        role: Role::Linear,
        neutral: 0.0,
        typical: 1.8e-4,
        bounds: (-0.1, 0.1),
    },
    ParameterCard {
        name: "g_y",
        unit: "rad/s per m/s²",
        says: "error per acceleration along y",
        role: Role::Linear,
        neutral: 0.0,
        typical: 1.8e-4,
        bounds: (-0.1, 0.1),
    },
    ParameterCard {
        name: "g_z",
        unit: "rad/s per m/s²",
        says: "error per acceleration along z",
        role: Role::Linear,
        neutral: 0.0,
        typical: 1.8e-4,
        bounds: (-0.1, 0.1),
    },
];

impl Effect for GSensitivity {
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
        format!("your gyro takes acceleration for rotation: {}", parts(p, &names, |m| m.signed("rad/s per m/s²")))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return g_x * in->accel[0] + g_y * in->accel[1] + g_z * in->accel[2];".into())
    }
}

impl Felt for GSensitivity {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.accel[0] + p[1] * s.accel[1] + p[2] * s.accel[2]
    }
}
