//! `warm-up`: the turn-on transient, φ = exp(−t/τ).

use super::{Acts, Alias, Card, Effect, Felt, Memory, ParameterCard, Role, Signals, Span, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static WARM_UP: WarmUp = WarmUp;

/// See the file's head.
pub struct WarmUp;

static CARD: Card = Card {
    id: "warm-up",
    title: "turn-on transient: the zero settles after switching on",
    physics: "After power-on the sensor heats itself and its loops settle: the bias starts with an error and settles \
             to its final value.",
    equation: "ω_f = ω + a exp(−t/τ), t from the log's first row",
    typical: "τ 5–600 s, 0.1–2 °/s",
    source: "IEEE Std 1431, warm-up time; MEMS data sheets",
    needs: &[],
    excited_by: "power-on in the log",
    mended_by: "exactly, in a log that starts at power-on",
    at_source: "switch the sensor on some minutes before it is needed",
    traits: &[Trait::Slow],
    simpler: &["bias-drift"],
    aliases: &[
        Alias {
            id: "temperature-bias",
            when: "one heating from power-on",
            split_by: "restart the sensor hot: a warm-up starts again, a temperature effect does not",
        },
        Alias {
            id: "bias-drift",
            when: "the log is short against the time constant",
            split_by: "a log of several time constants: a warm-up ends, a drift continues",
        },
        Alias {
            id: "supply-voltage",
            when: "one battery discharge from power-on",
            split_by: "restart on a full battery, or on a bench supply: a warm-up starts again",
        },
    ],
};

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "a",
        unit: "rad/s",
        says: "error at the first row",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.01,
        bounds: (-1.0, 1.0),
    },
    ParameterCard {
        name: "tau",
        unit: "s",
        says: "time constant",
        role: Role::Shape,
        neutral: 30.0,
        typical: 30.0,
        bounds: (0.5, 3600.0),
    },
];

impl Effect for WarmUp {
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
        format!(
            "your gyro's zero starts {} too {} and settles with a time constant of {}",
            p[0].size("rad/s"),
            if p[0].value > 0.0 { "high" } else { "low" },
            p[1].signed("s")
        )
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return a * exp(-in->t / tau);".into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let end = span.duration.clamp(2.0, 600.0);
        std::iter::successors(Some(2.0), |tau| Some(tau * 1.3))
            .take_while(|&tau| tau <= end)
            .map(|tau| vec![tau])
            .collect()
    }
}

impl Felt for WarmUp {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * (-s.t / p[1]).exp()
    }
}
