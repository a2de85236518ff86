//! `supply-voltage`: zero-rate output against supply, φ = ΔV.

use super::{Acts, Alias, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static SUPPLY_VOLTAGE: SupplyVoltage = SupplyVoltage;

/// See the file's head.
pub struct SupplyVoltage;

static CARD: Card = Card {
    id: "supply-voltage",
    title: "the zero-rate output changes with the supply voltage",
    physics: "The drive amplitude and the voltage references of the converter depend on the supply, and so does the \
             bias. A starting motor lowers the supply and shifts the reading.",
    equation: "ω_f = ω + c ΔV, ΔV = V less the median of the log on which the model was fitted",
    typical: "2 °/s per V (0.035 rad/s/V)",
    source: "power supply sensitivity in MEMS data sheets",
    needs: &[Need::Supply],
    excited_by: "a supply that changes by some 0.05 V or more",
    mended_by: "exactly, where the supply is measured at the sensor",
    at_source: "give the sensor a regulator of its own",
    traits: &[Trait::Slow],
    simpler: &[],
    aliases: &[
        Alias {
            id: "temperature-bias",
            when: "the battery discharges while the sensor heats",
            split_by: "change one at a time: heat at constant supply, or change the supply at constant temperature",
        },
        Alias {
            id: "warm-up",
            when: "one battery discharge from power-on",
            split_by: "restart on a full battery, or on a bench supply: a warm-up starts again",
        },
        Alias {
            id: "bias-drift",
            when: "one battery discharge",
            split_by: "change the supply: a drift does not depend on it",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "c",
    unit: "rad/s/V",
    says: "bias per volt",
    role: Role::Linear,
    neutral: 0.0,
    typical: 0.035,
    bounds: (-5.0, 5.0),
}];

impl Effect for SupplyVoltage {
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
        format!("your gyro's zero {} by {}", p[0].goes(), p[0].size("rad/s/V").replace("/V", " per V"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return c * in->delta_supply;".into())
    }
}

impl Felt for SupplyVoltage {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.delta_supply
    }
}
