//! A zero that is another one while the shaft moves than while it rests, as where motors shake the sensor and nobody measures that.
//!
//! It is not in the catalogue, because it cannot be corrected on another vehicle. A diagnosis compares it with the effects that it would
//! name, on the same rows, and names none of them if this one explains the error better.

use super::{Acts, Card, Effect, Felt, Memory, ParameterCard, Role, Signals};
use crate::Axis;
use bytemuck::{Pod, Zeroable};

/// The explanation.
pub(crate) static ZERO_WHILE_MOVING: ZeroWhileMoving = ZeroWhileMoving;

/// See the file's head.
pub(crate) struct ZeroWhileMoving;

/// Rate from which on a shaft moves, rad/s.
pub(crate) const MOVES: f64 = 0.03;
/// How long a shaft counts as moving after that, s: at a reversal it is slow for a moment.
pub(crate) const LASTS: f64 = 1.0;

static CARD: Card = Card {
    id: "zero-while-moving",
    title: "the zero is another one while the shaft moves",
    physics: "Motors shake the sensor while they run, and vibration shifts the zero.",
    equation: "b where |ω| was above 0.03 rad/s within the last second",
    typical: "0.01–2 °/s",
    source: "vibration rectification, IEEE Std 1431",
    needs: &[],
    excited_by: "rests and motion in turn",
    mended_by: "nothing: log the accelerometer, and g-squared-sensitivity has it",
    at_source: "mount the sensor softly, away from the motors",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "b",
    unit: "rad/s",
    says: "zero while it moves less zero at rest",
    role: Role::Linear,
    neutral: 0.0,
    typical: 5e-3,
    bounds: (-1.0, 1.0),
}];

impl Effect for ZeroWhileMoving {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }
}

impl Felt for ZeroWhileMoving {
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let last = memory.of::<Moved>();
        if s.rate().abs() > MOVES {
            *last = Moved { at: s.t, ever: 1.0 };
        }
        if last.ever == 1.0 && s.t - last.at < LASTS { p[0] } else { 0.0 }
    }
}

/// When it moved last.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Moved {
    /// s.
    at: f64,
    /// 1 once it has.
    ever: f64,
}
