//! `cubic-nonlinearity`: the scale factor grows with the square of the rate, φ = ω³.

use super::{Acts, Alias, Card, Effect, Felt, Memory, ParameterCard, Role, Signals};
use crate::Axis;
use crate::measured::{HUNDRED, Measured};
use std::borrow::Cow;

/// The effect.
pub static CUBIC_NONLINEARITY: CubicNonlinearity = CubicNonlinearity;

/// See the file's head.
pub struct CubicNonlinearity;

static CARD: Card = Card {
    id: "cubic-nonlinearity",
    title: "an error that grows with the cube of the rate",
    physics: "Springs stiffen, and amplifiers become nonlinear before they clip: the scale factor at fast turns \
             differs from that at slow turns, equally in both directions.",
    equation: "ω_f = ω + k3 ω³",
    typical: "0.1–0.2 % of full scale in data sheets (at 250 °/s full scale, 0.1 % is k3 = 5.3e-5 s²/rad²), several \
              times as much on uncalibrated parts",
    source: "IEEE Std 1431, scale factor nonlinearity; MEMS data sheets",
    needs: &[],
    excited_by: "at least two amplitudes",
    mended_by: "exactly, by iteration in the compensated rate",
    at_source: "set a wider range, if the sensor has one: in the middle of its range a sensor is more linear",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "saturation",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: a limit is always at the same rate, a curve is not",
        },
        Alias {
            id: "dead-zone",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: a dead zone is always at the same rate, a curve is not",
        },
        Alias {
            id: "lost-counts",
            when: "the shaft turns at few rates: with both the gyro reads more than the encoder where it is fast",
            split_by: "a slow ramp through all rates: counts are lost from one rate on, a curve has no such rate; or a counter in hardware",
        },
        Alias {
            id: "reference-smoothing",
            when: "the motion is fast only where it is large",
            split_by: "a slower and a faster motion of the same amplitude; or the filter settings of the reference",
        },
        Alias {
            id: "mount-resonance",
            when: "the motion is fast only where it is large",
            split_by: "a slower and a faster motion of the same amplitude",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "k3",
    unit: "s²/rad²",
    says: "growth of the scale factor with rate squared",
    role: Role::Linear,
    neutral: 0.0,
    typical: 5e-4,
    bounds: (-0.05, 0.05),
}];

impl Effect for CubicNonlinearity {
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
        let at = p[0].times(HUNDRED * HUNDRED);
        format!(
            "your gyro reads {} too {} at 100 °/s, and four times that share at twice the rate",
            at.size("1"),
            if at.value > 0.0 { "much" } else { "little" }
        )
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return k3 * in->rate * in->rate * in->rate;".into())
    }
}

impl Felt for CubicNonlinearity {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.rate() * s.rate() * s.rate()
    }
}
