//! Whether the zero is another one while the shaft moves, or for a while: explanations beside the effects of the catalogue, on the same
//! rows. The first competes with the effects that a search would name; the second, which has two instants to choose, is asked for only
//! where the search names none.

use super::{
    challenger::{Challenger, Incumbent},
    observed::{Observed, OtherZero},
    verdicts::decide,
};
use crate::{
    effects::{
        Effect, Stage,
        zero_for_a_while::ZERO_FOR_A_WHILE,
        zero_while_moving::{LASTS, MOVES, ZERO_WHILE_MOVING},
    },
    evidence::series::{Rest, Series},
    finding::{Excess, Finding},
    order::median,
    statistics::Estimate,
    thresholds as limit,
};

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
        let own = &self.study.bench.problem.series[series];
        if own.rest != Rest::None || !may_show(own) {
            return None;
        }
        self.zero_by(&ZERO_WHILE_MOVING, series)
    }

    /// What is found of an axis; where no effect explains the error, another zero for a while may.
    pub(super) fn decided(&self, observed: &Observed, series: usize) -> Finding {
        let finding = decide(observed);
        if !matches!(finding, Finding::Unexplained(Excess::NoEffect { .. })) {
            return finding;
        }
        let zero = self.zero_for_a_while(series);
        if zero.is_some() { decide(&Observed { other_zero: zero, ..observed.clone() }) } else { finding }
    }

    /// Another zero for a while, as the explanation of an error; `None` as above.
    fn zero_for_a_while(&self, series: usize) -> Option<OtherZero> {
        let found = self.zero_by(&ZERO_FOR_A_WHILE, series)?;
        let remains = (found.excess - 1.0) / (self.excess(series) - 1.0);
        (remains < REMAINS).then_some(found)
    }

    fn zero_by(&self, explanation: &'static dyn Effect, series: usize) -> Option<OtherZero> {
        let before = self.excess(series);
        if before < limit::NOISE.value {
            return None;
        }
        let found = self.refit(self.starts(explanation, series).into_iter().next()?);
        let dominates = before - found.excess > limit::DOMINATES.value * (before - 1.0);
        (found.passes(self) && dominates).then(|| {
            let slot = found.study.slots.iter().rposition(|slot| slot.series == series && slot.parameter == 0);
            let std_error = slot.map_or(f64::NAN, |k| found.gls.std_error(k));
            let (value, instants) = found.candidate.term.values.split_first().unwrap_or((&f64::NAN, &[]));
            let between = <[f64; 2]>::try_from(instants).ok();
            OtherZero { size: Estimate { value: *value, std_error }, between, excess: found.excess }
        })
    }

    /// The same, if it leaves less error than this suspect, which needs no other channel than the gyro.
    pub(super) fn other_zero_than(&self, suspect: &Challenger) -> Option<OtherZero> {
        let term = &suspect.candidate.term;
        let may_be = term.effect.stage() == Stage::Felt && term.effect.card().needs.is_empty();
        let other = may_be.then(|| self.other_zero(suspect.candidate.series)).flatten()?;
        (other.excess < LEAVES * suspect.excess).then_some(other)
    }
}

/// Whether a log has rests and motion in turn, and no accelerometer.
fn may_show(series: &Series) -> bool {
    let first = series.signals(0).accel;
    let has_accelerometer = |axis: usize| (0..series.t.len()).any(|k| series.signals(k).accel[axis] != first[axis]);
    if (0..3).any(has_accelerometer) {
        return false;
    }
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
