//! What became of the effects that the user wrote.

use super::challenger::{Challenger, Incumbent};
use crate::{
    Term,
    effects::{Effect, Signals, user},
    finding::{Became, Remark},
    scan::can_show,
    thresholds as limit,
};

/// What is to be said of the user's effects on one axis: where they have no value, and why they are neither in the model nor
/// missing. Empty where there is nothing.
pub(super) fn became(
    incumbent: &Incumbent,
    suspects: &[&Challenger],
    own_effects: &[&'static dyn Effect],
    series: usize,
) -> Vec<Remark> {
    let each = own_effects.iter().flat_map(|effect| {
        let effect_id = || effect.card().id.to_owned();
        let all = of(incumbent, suspects, *effect, series);
        all.into_iter().map(move |became| Remark::OwnEffect { effect: effect_id(), became })
    });
    each.collect()
}

fn of(incumbent: &Incumbent, suspects: &[&Challenger], effect: &'static dyn Effect, series: usize) -> Vec<Became> {
    let study = &incumbent.study;
    let own = &study.bench.problem.series[series];
    let id = effect.card().id;
    let is_in_model = study.model.axes[own.axis.index()].as_ref().is_some_and(|model| model.term(id).is_some());
    let term = Term::neutral(effect, own.axis);
    let share = user::undefined(effect, signals(incumbent, series));
    if share >= 1.0 {
        return vec![Became::Undefined];
    }
    let partly = (share > limit::MENTIONED.value).then_some(Became::PartlyUndefined { share });
    let refit = suspects.iter().find(|r| r.candidate.term.effect.card().id == id);
    let why = match refit {
        _ if is_in_model => None,
        Some(refit) if refit.passes(incumbent) || refit.significant() => None,
        Some(_) => Some(Became::Noise),
        None if !can_show(effect, own) => Some(Became::NothingChanges),
        None if incumbent.spans(&term, series) => Some(Became::Spanned),
        None => Some(Became::RemovesNothing),
    };
    partly.into_iter().chain(why).collect()
}

/// What an expression sees, row by row.
fn signals<'a>(incumbent: &'a Incumbent, series: usize) -> impl Iterator<Item = Signals> + 'a {
    let study = &incumbent.study;
    let (own, warm) = (&study.bench.problem.series[series], &study.warm[series]);
    (0..own.t.len()).map(move |k| {
        let mut signals = own.signals(k);
        signals.rates[own.axis.index()] = warm.rate[k];
        Signals { rate_dot: warm.rate_dot[k], angle: warm.angle[k], ..signals }
    })
}
