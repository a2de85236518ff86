//! Effects that come in more than one form: a filter that software computes step by step, or one without steps.

use super::study::Study;
use crate::{Model, effects::Effect};
use itertools::Itertools;

impl Study<'_> {
    /// The same with each effect in that of its forms, [`Effect::forms`], which leaves the least J = Σ_τ E²/F².
    #[must_use]
    pub(crate) fn in_best_form(self) -> Self {
        let mut best = self;
        for (effect, values) in in_forms(&best) {
            for values in values {
                let other = best.fit_from(&with(&best.model, effect, &values), &best.frozen());
                if other.cost() < best.cost() {
                    best = other;
                }
            }
        }
        best
    }

    fn cost(&self) -> f64 {
        self.grams.normal(&self.bench.windows.tau, &self.bench.weights).cost
    }
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
