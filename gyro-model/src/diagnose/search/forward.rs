//! Forward selection: which suspect joins next, and on which axes.

use super::super::challenger::{Challenger, Incumbent};
use crate::{
    Model, Term,
    effects::Stage,
    fit::judged,
    scan::{can_show, with_term},
    thresholds as limit,
};

/// The suspect that is added next: of those that pass, first of their axis, the one that removes most.
pub(super) fn next(incumbent: &Incumbent, suspects: &[Challenger]) -> Option<usize> {
    let first = |series: usize| {
        let passes = |r: &Challenger| r.candidate.series == series && r.passes(incumbent);
        // Readings that are cut off lie about everything else.
        let read_off = |r: &Challenger| r.candidate.term.effect.stage() == Stage::Reading;
        let cut_off = suspects.iter().position(|r| passes(r) && read_off(r));
        cut_off.or_else(|| suspects.iter().position(passes))
    };
    let removes = |k: usize| suspects[k].before(incumbent) - suspects[k].excess;
    let firsts = (0..incumbent.study.bench.problem.series.len()).filter_map(first);
    firsts.max_by(|&a, &b| removes(a).total_cmp(&removes(b)))
}

/// The model with the effect that one axis, `of`, has just got on another one too, where it passes there, or where the cause is one,
/// as of a whole sensor that is late or turned: what the one axis foretells is found on the other, and with it the error is lower.
pub(super) fn companion(incumbent: &Incumbent, term: &Term, of: usize, series: usize) -> Option<Model> {
    let problem = &incumbent.study.bench.problem;
    let id = term.effect.card().id;
    let own = judged::axis_model(&incumbent.study.model, problem.series[series].axis);
    if own.effect_ids().contains(&id) || !can_show(term.effect, &problem.series[series]) {
        return None;
    }
    let starts = incumbent.starts(term.effect, series);
    let found = starts.into_iter().map(|start| incumbent.refit(start)).min_by(|a, b| a.excess.total_cmp(&b.excess))?;
    let foretold = term.effect.carried_over(&term.values, problem.series[of].axis, problem.series[series].axis);
    let is_like = |(a, b): (&f64, Option<f64>)| b.map(|b| (a - b).abs() < limit::ALIKE_ON_AXES.value * b.abs());
    let told: Vec<bool> = found.candidate.term.values.iter().zip(foretold).filter_map(is_like).collect();
    let alike = !told.is_empty() && told.into_iter().all(|is| is);
    let lower = found.fall.in_errors() > limit::FALLS_ALIKE.value
        && found.excess < found.before(incumbent)
        && !found.at_bound();
    (found.passes(incumbent) || alike && lower)
        .then(|| with_term(&incumbent.study, series, found.candidate.term.clone()))
}
