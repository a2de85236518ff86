//! `scale-factor`: the reading is the rate divided by α (the paper's equation (1)).

use super::{Acts, Alias, Card, Effect, ParameterCard, Role, Trait};
use crate::Axis;
use crate::measured::Measured;

/// The effect.
pub static SCALE_FACTOR: ScaleFactor = ScaleFactor;

/// See the file's head.
pub struct ScaleFactor;

static CARD: Card = Card {
    id: "scale-factor",
    title: "reads every rate too large or too small by one factor",
    physics: "The sensor's gain differs from its data sheet's, from part to part and with mounting. A turn of 360° \
              is read as 360°/α.",
    equation: "ω̂ = α ω_g + δ",
    typical: "α within 3 % of 1 on MEMS parts",
    source: "IEEE Std 1431, scale factor; equation (1) of the paper behind this project",
    needs: &[],
    excited_by: "any rotation",
    mended_by: "exactly",
    at_source: "nothing: each part differs by a few per cent. Keep the correction, or set the factor in the driver",
    traits: &[Trait::Gain],
    simpler: &[],
    aliases: &[
        Alias {
            id: "cross-axis",
            when: "one axis turns alone, or the other axes turn in proportion",
            split_by: "re-mount the sensor by 90°, or turn another axis",
        },
        Alias {
            id: "encoder-eccentricity",
            when: "the travel is much less than a turn: the fitted scale factor absorbs the error and the residual \
             looks clean",
            split_by: "full turns",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "alpha",
    unit: "1",
    says: "true rate per unit of reading",
    role: Role::Linear,
    neutral: 1.0,
    typical: 0.98,
    bounds: (0.01, 100.0),
}];

impl Effect for ScaleFactor {
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
        let share = Measured { value: 1.0 / p[0].value - 1.0, std_error: p[0].std_error / (p[0].value * p[0].value) };
        format!("your gyro reads {} too {}", share.size("1"), if share.value > 0.0 { "high" } else { "low" })
    }
}
