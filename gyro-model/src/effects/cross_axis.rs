//! `cross-axis`: misalignment and cross-axis sensitivity, φ = the other two rates.

use super::{Acts, Alias, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals, Trait};
use crate::Axis;
use crate::measured::{Measured, parts};
use std::borrow::Cow;

/// The effect.
pub static CROSS_AXIS: CrossAxis = CrossAxis;

/// See the file's head.
pub struct CrossAxis;

static CARD: Card = Card {
    id: "cross-axis",
    title: "misalignment: turning about another axis is read too",
    physics: "The sensitive axis is tilted against the axis of rotation, by its mounting and inside the package, so \
             the gyro reads a share of the other two rates.",
    equation: "ω_f = ω + Σ m_k ω_k, over the two other axes k",
    typical: "0.5–2 % on the chip, up to 6 % with mounting (1° of tilt is 1.7 %)",
    source: "IEEE Std 1431, input axis misalignment; cross-axis sensitivity in MEMS data sheets",
    needs: &[Need::OtherGyros],
    excited_by: "rotation about the other axes, independent of this one",
    mended_by: "exactly",
    at_source: "mount the sensor square to the axis of rotation (1.7 % is one degree of tilt)",
    traits: &[Trait::Turn],
    simpler: &[],
    aliases: &[Alias {
        id: "scale-factor",
        when: "one axis turns alone, or the other axes turn in proportion",
        split_by: "re-mount the sensor by 90°, or turn another axis",
    }],
};

static PARAMETERS: [[ParameterCard; 2]; 3] =
    [[card("m_y"), card("m_z")], [card("m_x"), card("m_z")], [card("m_x"), card("m_y")]];

const fn card(name: &'static str) -> ParameterCard {
    ParameterCard {
        name,
        unit: "1",
        says: "share of that axis' rate that is felt",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.02,
        bounds: (-0.5, 0.5),
    }
}

/// The two axes that are not the one under study, in order: those that `m_…` name.
const OTHERS: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

impl Effect for CrossAxis {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, axis: Axis) -> &'static [ParameterCard] {
        &PARAMETERS[axis.index()]
    }

    fn says(&self, axis: Axis, p: &[Measured]) -> String {
        let names = OTHERS[axis.index()].map(|other| format!("turning about {}", Axis::ALL[other]));
        format!("your gyro feels {}", parts(p, &names, |m| format!("{} of", m.signed("1"))))
    }

    fn in_c(&self, axis: Axis) -> Option<Cow<'static, str>> {
        let [a, b] = OTHERS[axis.index()];
        let [card_a, card_b] = PARAMETERS[axis.index()];
        Some(format!("return {} * in->rates[{a}] + {} * in->rates[{b}];", card_a.name, card_b.name).into())
    }

    /// Of a sensor that is turned as a whole: m_ik = −m_ki.
    fn carried_over(&self, p: &[f64], of: Axis, on: Axis) -> Vec<Option<f64>> {
        let back = OTHERS[of.index()].iter().position(|&other| other == on.index());
        OTHERS[on.index()].map(|other| back.filter(|_| other == of.index()).map(|k| -p[k])).to_vec()
    }
}

impl Felt for CrossAxis {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        let [a, b] = OTHERS[s.axis];
        p[0] * s.rates[a] + p[1] * s.rates[b]
    }
}
