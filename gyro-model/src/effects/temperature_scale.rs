//! `temperature-scale`: scale factor against temperature, φ = ΔT·ω.

use super::{Acts, Alias, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static TEMPERATURE_SCALE: TemperatureScale = TemperatureScale;

/// See the file's head.
pub struct TemperatureScale;

static CARD: Card = Card {
    id: "temperature-scale",
    title: "the scale factor changes with the temperature",
    physics: "The resonance and the electronics' gain move with temperature, and with them the scale factor.",
    equation: "ω_f = ω + c ΔT ω,  ΔT = T − 25 °C",
    typical: "2–4 % over the range −40…85 °C (1.6e-4–3.2e-4 1/K)",
    source: "IEEE Std 1431, scale factor temperature sensitivity; MEMS data sheets",
    needs: &[Need::Temperature],
    excited_by: "rotation at several temperatures",
    mended_by: "exactly, where temperature is measured at the sensor",
    at_source: "keep the sensor at one temperature: away from motors and regulators, or heated",
    traits: &[],
    simpler: &[],
    aliases: &[Alias {
        id: "temperature-bias",
        when: "the rate is constant",
        split_by: "turn in both directions at two temperatures",
    }],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "c",
    unit: "1/K",
    says: "change of the scale factor per kelvin",
    role: Role::Linear,
    neutral: 0.0,
    typical: 5e-4,
    bounds: (-0.02, 0.02),
}];

impl Effect for TemperatureScale {
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
        let size = p[0].size("1/K").replace("/K", " per K");
        format!("the size of your gyro's readings {} by {size} as it gets warmer", p[0].goes())
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return c * in->delta_temperature * in->rate;".into())
    }
}

impl Felt for TemperatureScale {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.delta_temperature * s.rate()
    }
}
