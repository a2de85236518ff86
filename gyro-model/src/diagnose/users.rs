//! What became of the effects that the user wrote.

use super::challenger::{Challenger, Incumbent};
use crate::{
    Term,
    effects::{Effect, Signals, user},
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
) -> String {
    let sentences = own_effects.iter().flat_map(|effect| says(incumbent, suspects, *effect, series));
    sentences.fold(String::new(), |all, sentence| all + " " + &sentence)
}

fn says(incumbent: &Incumbent, suspects: &[&Challenger], effect: &'static dyn Effect, series: usize) -> Vec<String> {
    let study = &incumbent.study;
    let own = &study.bench.problem.series[series];
    let id = effect.card().id;
    let is_in_model = study.model.axes[own.axis.index()].as_ref().is_some_and(|model| model.term(id).is_some());
    let term = Term::neutral(effect, own.axis);
    let undefined = user::undefined(effect, signals(incumbent, series));
    if undefined >= 1.0 {
        return vec![format!("Your `{id}` has no finite value anywhere in this log.")];
    }
    let mut all = Vec::new();
    if undefined > limit::MENTIONED.value {
        let share = 100.0 * undefined;
        all.push(format!("Your `{id}` has no finite value in {share:.0} % of this log, and is taken for 0 there."));
    }
    let refit = suspects.iter().find(|r| r.candidate.term.effect.card().id == id);
    all.extend(match refit {
        _ if is_in_model => None,
        Some(refit) if refit.passes(incumbent) || refit.significant() => None,
        Some(_) => Some(format!("Your `{id}` removes no more than noise does.")),
        None if !can_show(effect, own) => {
            Some(format!("Your `{id}` goes by what does not change in this log, or not enough."))
        }
        None if incumbent.spans(&term, series) => Some(format!(
            "Your `{id}` goes with what the model has already, and cannot be told from it: a constant is a bias, the rate a scale factor."
        )),
        None => Some(format!("Your `{id}` removes next to nothing of the error.")),
    });
    all
}

/// What an expression sees, row by row.
fn signals<'a>(incumbent: &'a Incumbent, series: usize) -> impl Iterator<Item = Signals> + 'a {
    let study = &incumbent.study;
    let (own, warm) = (&study.bench.problem.series[series], &study.warm[series]);
    (0..own.t.len()).map(move |k| {
        let mut signals = own.signals[k];
        signals.rates[own.axis.index()] = warm.rate[k];
        Signals { rate_dot: warm.rate_dot[k], angle: warm.angle[k], ..signals }
    })
}
