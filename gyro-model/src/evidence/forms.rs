//! Effects that come in more than one form: a filter that software computes step by step, or one without steps.

use super::study::{Study, values};
use crate::{
    Model,
    effects::{Effect, Role},
};
use itertools::Itertools;

/// Share of J that one form has to leave of the other's to be told from it.
const TOLD_APART: f64 = 0.99;

impl Study<'_> {
    /// The same with each effect in that of its forms, [`Effect::forms`], which leaves the least J = Σ_τ E²/F²; the plain one, where
    /// the two can't be told apart.
    #[must_use]
    pub(crate) fn in_best_form(self) -> Self {
        self.in_best_form_but(|_| false)
    }

    /// The same where those effects that are plain and known to be so stay plain.
    #[must_use]
    pub(crate) fn in_best_form_but(self, is_known: impl Fn(&str) -> bool) -> Self {
        let mut best = self;
        for (effect, values) in in_forms(&best) {
            for values in values {
                let is_plain = is_plain(effect, &values);
                if !is_plain && is_known(effect.card().id) {
                    continue;
                }
                let other = best.in_form(effect, &values);
                let (other_by, best_by) = if is_plain { (TOLD_APART, 1.0) } else { (1.0, TOLD_APART) };
                if other_by * other.cost() < best_by * best.cost() {
                    best = other;
                }
            }
        }
        best
    }

    /// By how much each parameter differs in another form that can't be told from this one.
    pub(super) fn apart_in_forms(&self) -> Vec<f64> {
        let mut apart = vec![0.0_f64; self.slots.len()];
        let own = values(&self.bench.problem, &mut self.model.clone(), &self.slots);
        for (effect, forms) in in_forms(self) {
            for mut other in forms.iter().map(|values| self.in_form(effect, values)) {
                if TOLD_APART * other.cost() < self.cost() && other.slots == self.slots {
                    let others = values(&other.bench.problem, &mut other.model, &other.slots);
                    apart.iter_mut().zip(own.iter().zip(others)).for_each(|(a, (x, y))| *a = a.max((x - y).abs()));
                }
            }
        }
        apart
    }

    fn in_form(&self, effect: &dyn Effect, values: &[f64]) -> Self {
        self.fit_from(&with(&self.model, effect, values), &self.frozen())
    }

    fn cost(&self) -> f64 {
        self.grams.normal(&self.bench.windows.tau, &self.bench.weights).cost
    }
}

/// Whether nothing that a fit chooses is chosen.
fn is_plain(effect: &dyn Effect, values: &[f64]) -> bool {
    let cards = effect.parameters(crate::Axis::X).iter().zip(values);
    cards.filter(|(card, _)| card.role == Role::Chosen).all(|(card, value)| *value == card.neutral)
}

/// The model's effects that have other forms, and what each is in those.
fn in_forms(study: &Study) -> Vec<(&'static dyn Effect, Vec<Vec<f64>>)> {
    let problem = &study.bench.problem;
    let terms =
        problem.series.iter().flat_map(|s| problem.axis(&study.model, s).terms.iter().map(move |term| (term, s)));
    let each = terms.map(|(term, s)| (term.effect, term.effect.forms(&term.values, &s.span())));
    each.filter(|(_, forms)| !forms.is_empty()).unique_by(|(effect, _)| effect.card().id).collect()
}

/// The model with an effect at these values, wherever it has it.
fn with(model: &Model, effect: &dyn Effect, values: &[f64]) -> Model {
    let mut model = model.clone();
    for term in model.axes.iter_mut().flatten().flat_map(|axis| &mut axis.terms) {
        if term.effect.card().id == effect.card().id {
            term.values.copy_from_slice(values);
        }
    }
    model
}
