//! A zero that is another one between two instants and then comes back, as where a driver takes slow turning for rest, sets its zero
//! by it, and sets it right at the next rest.
//!
//! It is not in the catalogue, because it does not happen again at the same time. A diagnosis compares it with what is left where no effect
//! of the catalogue explains the error.

use super::{Acts, Card, Effect, Felt, Memory, ParameterCard, Role, Signals, Span, Trait};
use crate::Axis;

/// The explanation.
pub(crate) static ZERO_FOR_A_WHILE: ZeroForAWhile = ZeroForAWhile;

/// See the file's head.
pub(crate) struct ZeroForAWhile;

static CARD: Card = Card {
    id: "zero-for-a-while",
    title: "the zero is another one for a while",
    physics: "A driver that measures its zero at rest takes slow, even turning for rest, or a supply sags and comes back.",
    equation: "b for t1 < t ≤ t2",
    typical: "0.1–5 °/s",
    source: "drivers that calibrate themselves at rest",
    needs: &[],
    excited_by: "both changes inside the log",
    mended_by: "nothing: the next time is not known",
    at_source: "switch the driver's own calibration off, or let it calibrate only where the vehicle is known to rest",
    traits: &[Trait::Slow, Trait::Onset],
    simpler: &[],
    aliases: &[],
};

const fn instant(name: &'static str, says: &'static str, typical: f64) -> ParameterCard {
    ParameterCard { name, unit: "s", says, role: Role::Shape, neutral: typical, typical, bounds: (0.0, 1e7) }
}

static PARAMETERS: [ParameterCard; 3] = [
    ParameterCard {
        name: "b",
        unit: "rad/s",
        says: "zero between the two instants less the zero elsewhere",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.01,
        bounds: (-5.0, 5.0),
    },
    instant("t1", "when it leaves", 20.0),
    instant("t2", "when it comes back", 40.0),
];

impl Effect for ZeroForAWhile {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        const INSTANTS: u32 = 24;
        let at = |k: u32| span.start + span.duration * f64::from(k) / f64::from(INSTANTS);
        (1..INSTANTS).flat_map(|from| (from + 1..INSTANTS).map(move |to| vec![at(from), at(to)])).collect()
    }
}

impl Felt for ZeroForAWhile {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        if p[1] < s.t && s.t <= p[2] { p[0] } else { 0.0 }
    }
}
