//! Whether the zero is another one while the shaft moves, at some of its angles, or for a while: explanations beside the effects of the
//! catalogue, on the same rows. The first competes with the effects that a search would name; the others are asked for where it names
//! none: the second also of what would be a bias that wanders, the third, which has two instants to choose, of what nothing explains.

use super::{
    challenger::{Challenger, Incumbent},
    observed::{Observed, OtherZero},
    verdicts::decide,
};
use crate::{
    Axis,
    budget::Budget,
    effects::{
        Effect, Role, Stage,
        zero_for_a_while::ZERO_FOR_A_WHILE,
        zero_while_moving::{LASTS, MOVES, ZERO_WHILE_MOVING},
        zero_with_angle::ZERO_WITH_ANGLE,
    },
    evidence::series::{Rest, Series},
    finding::{Adequate, Excess, Finding, Why, ZeroMoves},
    fit::judged::Judged,
    order::median,
    statistics::Estimate,
    thresholds as limit,
};
use itertools::Itertools;

/// Share of a log in which the axis has to rest, and in which it has to move, 1.
const EITHER: f64 = 0.1;
/// Times that it has to begin to move.
const STARTS: usize = 4;
/// J with another zero, over J with the suspect, from which on the suspect is not named.
const LEAVES: f64 = 0.8;
/// Share of J − 1 that another zero for a while may leave, 1: its two instants are free, so it removes a part of nearly every slow error.
const REMAINS: f64 = 0.1;

impl Incumbent<'_> {
    /// Another zero while an axis moves. `None` if the log has no rests or no motion, has an accelerometer (g-squared-sensitivity then
    /// explains it), or if this explanation fails a test of admission or does not dominate the error.
    pub(super) fn other_zero(&self, series: usize) -> Option<OtherZero> {
        let (zero, _) = self.zero_while_moving(series)?;
        Some(zero)
    }

    fn zero_while_moving(&self, series: usize) -> Option<(OtherZero, Challenger<'_>)> {
        let own = &self.study.bench.problem.series[series];
        if own.rest != Rest::None || has_accelerometer(own) || !rests_and_moves(own) {
            return None;
        }
        let found = self.zero_by(&ZERO_WHILE_MOVING, series)?;
        let size = coefficients(&found, series).next()?;
        Some((OtherZero { size, when: ZeroMoves::Moving, excess: found.excess }, found))
    }

    /// What is found of an axis and, where no effect explains the error but another zero does, what its error is made of then: that zero
    /// is missing. `judged` is the error.
    pub(super) fn decided(&self, observed: &Observed, judged: &Judged, series: usize) -> (Finding, Option<Budget>) {
        let finding = decide(observed);
        let zero = match finding {
            Finding::Unexplained(Excess::OtherZero { .. }) => self.zero_while_moving(series),
            Finding::Unexplained(Excess::NoEffect { .. }) => {
                self.zero_with_angle(series).or_else(|| self.zero_for_a_while(series))
            }
            Finding::Adequate(Adequate::Wanders(_))
            | Finding::CannotTell(Why::SlowOrWander { .. } | Why::NoiseOrEffect { .. } | Why::NoneStandsOut { .. }) => {
                self.zero_with_angle(series)
            }
            _ => None,
        };
        let Some((zero, found)) = zero else { return (finding, None) };
        let removed = judged.removed(&Judged::new(&found.study, series, false).points());
        let budget = Budget::of(&found.study, series, judged, &found.gls.noise, Some(&removed));
        (decide(&Observed { other_zero: Some(zero), ..observed.clone() }), Some(budget))
    }

    /// Another zero at some angles of the shaft; `None` as above.
    fn zero_with_angle(&self, series: usize) -> Option<(OtherZero, Challenger<'_>)> {
        let own = &self.study.bench.problem.series[series];
        let is_shaft = self.study.bench.problem.channels() == 1 && own.rest == Rest::None;
        if !is_shaft || has_accelerometer(own) {
            return None;
        }
        let found = self.zero_by(&ZERO_WITH_ANGLE, series)?;
        let (sin, cos) = coefficients(&found, series).collect_tuple()?;
        let value = sin.value.hypot(cos.value);
        let std_error = (sin.value * sin.std_error).hypot(cos.value * cos.std_error) / value;
        let size = Estimate { value, std_error };
        Some((OtherZero { size, when: ZeroMoves::WithAngle, excess: found.excess }, found))
    }

    /// Another zero for a while, as the explanation of an error; `None` as above.
    fn zero_for_a_while(&self, series: usize) -> Option<(OtherZero, Challenger<'_>)> {
        let found = self.zero_by(&ZERO_FOR_A_WHILE, series)?;
        let remains = (found.excess - 1.0) / (self.excess(series) - 1.0);
        let between = <[f64; 2]>::try_from(found.candidate.term.values.get(1..)?).ok()?;
        let size = coefficients(&found, series).next()?;
        let when = ZeroMoves::ForAWhile { between };
        (remains < REMAINS).then_some((OtherZero { size, when, excess: found.excess }, found))
    }

    fn zero_by(&self, explanation: &'static dyn Effect, series: usize) -> Option<Challenger<'_>> {
        let before = self.excess(series);
        if before < limit::NOISE.value {
            return None;
        }
        let found = self.refit(self.starts(explanation, series).into_iter().next()?);
        let dominates = before - found.excess > limit::DOMINATES.value * (before - 1.0);
        (found.passes(self) && dominates).then_some(found)
    }

    /// The same, if it leaves less error than this suspect, which needs no other channel than the gyro.
    pub(super) fn other_zero_than(&self, suspect: &Challenger) -> Option<OtherZero> {
        let term = &suspect.candidate.term;
        let may_be = term.effect.stage() == Stage::Felt && term.effect.card().needs.is_empty();
        let other = may_be.then(|| self.other_zero(suspect.candidate.series)).flatten()?;
        (other.excess < LEAVES * suspect.excess).then_some(other)
    }
}

/// The linear coefficients of an explanation, the last term of its model, rad/s.
fn coefficients<'f>(found: &'f Challenger, series: usize) -> impl Iterator<Item = Estimate> + 'f {
    let last = found.study.slots.iter().filter(|slot| slot.series == series).map(|slot| slot.term).max();
    let own = found.study.slots.iter().enumerate().filter(move |(_, s)| s.series == series && Some(s.term) == last);
    own.filter_map(|(k, slot)| {
        let value = *found.candidate.term.values.get(slot.parameter)?;
        let card = found.candidate.term.effect.parameters(Axis::X).get(slot.parameter)?;
        (card.role == Role::Linear).then(|| Estimate { value, std_error: found.gls.std_error(k) })
    })
}

/// Whether a log has an accelerometer.
fn has_accelerometer(series: &Series) -> bool {
    let first = series.signals(0).accel;
    (0..3).any(|axis| (0..series.t.len()).any(|k| series.signals(k).accel[axis] != first[axis]))
}

/// Whether a log has rests and motion in turn.
fn rests_and_moves(series: &Series) -> bool {
    let Some(middle) = median(series.gyro.clone()) else { return false };
    let (mut last, mut moving, mut starts) = (f64::NEG_INFINITY, 0, 0);
    let mut before = false;
    for (t, rate) in series.t.iter().zip(&series.gyro) {
        last = if (rate - middle).abs() > MOVES { *t } else { last };
        let moves = t - last < LASTS;
        starts += usize::from(moves && !before);
        moving += usize::from(moves);
        before = moves;
    }
    let share = moving as f64 / series.t.len() as f64;
    (EITHER..1.0 - EITHER).contains(&share) && starts >= STARTS
}
