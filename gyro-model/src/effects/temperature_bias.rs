//! `temperature-bias`: zero-rate output against temperature, φ = ΔT, ΔT².

use super::{Acts, Alias, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static TEMPERATURE_BIAS: TemperatureBias = TemperatureBias;

/// See the file's head.
pub struct TemperatureBias;

static CARD: Card = Card {
    id: "temperature-bias",
    title: "the zero-rate output changes with the temperature",
    physics: "The silicon and its package expand, the quadrature error leaks differently, and the reading at rest \
              moves with the sensor's temperature.",
    equation: "ω_f = ω + c1 ΔT + c2 ΔT²,  ΔT = T − 25 °C",
    typical: "0.005–0.08 °/s per K (9e-5–1.4e-3 rad/s/K)",
    source: "IEEE Std 1431, bias temperature sensitivity; MEMS data sheets",
    needs: &[Need::Temperature],
    excited_by: "a temperature that changes by several kelvin, up and down",
    mended_by: "exactly, where temperature is measured at the sensor",
    at_source: "keep the sensor at one temperature: away from motors and regulators, or heated",
    traits: &[Trait::Slow],
    simpler: &[],
    aliases: &[
        Alias {
            id: "warm-up",
            when: "one heating from power-on",
            split_by: "restart the sensor hot: a warm-up starts again, a temperature effect does not",
        },
        Alias {
            id: "bias-drift",
            when: "the temperature rises steadily",
            split_by: "heat and cool: a drift continues, a temperature effect reverses",
        },
        Alias {
            id: "supply-voltage",
            when: "the battery discharges while the sensor heats",
            split_by: "change one at a time: heat at constant supply, or change the supply at constant temperature",
        },
        Alias {
            id: "temperature-scale",
            when: "the rate is constant",
            split_by: "turn in both directions at two temperatures",
        },
    ],
};

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "c1",
        unit: "rad/s/K",
        says: "slope of the bias",
        role: Role::Linear,
        neutral: 0.0,
        typical: 5e-4,
        bounds: (-0.1, 0.1),
    },
    ParameterCard {
        name: "c2",
        unit: "rad/s/K²",
        says: "curvature of the bias",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.0,
        bounds: (-0.01, 0.01),
    },
];

impl Effect for TemperatureBias {
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
        let bends = if p[1].is_seen() { " at 25 °C, and by a different amount at other temperatures" } else { "" };
        format!("your gyro's zero {} by {}{bends}", p[0].goes(), p[0].size("rad/s/K").replace("/K", " per K"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return (c1 + c2 * in->delta_temperature) * in->delta_temperature;".into())
    }
}

impl Felt for TemperatureBias {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        (p[0] + p[1] * s.delta_temperature) * s.delta_temperature
    }
}
