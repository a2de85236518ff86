//! Backward elimination: what was added and is no longer needed goes.

use super::{super::refit::Present, Change, Search, added};
use crate::{Axis, Term, effects::Stage, evidence::study::Study};

/// The model without one effect, fitted on the same samples, and the term; `None` where the readings themselves show it.
pub(in super::super) fn without<'a>(present: &Present<'a>, axis: Axis, id: &str) -> Option<(Present<'a>, Term)> {
    let mut model = present.study.model.clone();
    let own = model.axes[axis.index()].as_mut()?;
    let place = own.terms.iter().position(|t| t.effect.card().id == id)?;
    let term = own.terms.remove(place);
    if term.effect.stage() == Stage::Reading {
        return None;
    }
    Some((Present::new(Study::fit(present.study.bench, &model, Some(&present.study.frozen()))), term))
}

impl Search<'_, '_> {
    /// Each effect that was added, but the last one, which has just passed, goes where the model no longer needs it.
    pub(super) fn eliminate(&mut self) {
        for (k, axis) in self.axes.clone().into_iter().enumerate() {
            let added = added(&self.present, self.start, axis);
            for id in added.iter().rev().skip(1).rev() {
                (self.options.progress)(id);
                let Some((without, term)) = without(&self.present, axis, id) else { continue };
                if !without.needs(&self.present, k, &term) {
                    self.present = counting_again(without, &self.present);
                    (self.took)(&self.present.study, Change::of(k, None, Some(id)));
                }
            }
        }
    }
}

/// A model without an effect of `present`, on the samples too that the effect made unsure.
pub(super) fn counting_again<'a>(without: Present<'a>, present: &Present<'a>) -> Present<'a> {
    if present.study.leaves_out() {
        Present::new(Study::fit(present.study.bench, &without.study.model, Some(&present.study.warm)))
    } else {
        without
    }
}
