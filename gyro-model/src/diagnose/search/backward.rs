//! Backward elimination: what was added and is no longer needed goes.

use super::{super::challenger::Incumbent, Change, Search, added};
use crate::{Axis, Term, effects::Stage, evidence::study::Study};

/// The model without one effect of these axes, fitted on the same samples, and the first axis' term; `None` where the readings
/// themselves show it.
pub(in super::super) fn without<'a>(
    incumbent: &Incumbent<'a>,
    axes: &[Axis],
    id: &str,
) -> Option<(Incumbent<'a>, Term)> {
    let mut model = incumbent.study.model.clone();
    let mut taken = Vec::new();
    for axis in axes {
        let own = model.axes[axis.index()].as_mut()?;
        let place = own.terms.iter().position(|t| t.effect.card().id == id)?;
        taken.push(own.terms.remove(place));
    }
    let term = taken.into_iter().next().filter(|term| term.effect.stage() != Stage::Reading)?;
    let study = Study::fit(incumbent.study.bench, &model, Some(&incumbent.study.frozen()));
    Some((Incumbent::near(study, &incumbent.gls.noise), term))
}

impl Search<'_, '_> {
    /// Each effect that was added, but the last one, which has just passed, goes where the model no longer needs it.
    pub(super) fn eliminate(&mut self) {
        for (k, axis) in self.axes.clone().into_iter().enumerate() {
            let added = added(&self.incumbent, self.start, axis);
            for id in added.iter().rev().skip(1).rev() {
                (self.options.progress)(id);
                let Some((without, term)) = without(&self.incumbent, &[axis], id) else { continue };
                if !without.needs(&self.incumbent, k, &term) {
                    self.incumbent = counting_again(without, &self.incumbent);
                    (self.took)(&self.incumbent.study, Change::of(k, None, Some(id)));
                }
            }
        }
    }
}

/// A model without an effect of `incumbent`, on the samples too that the effect made unsure.
pub(super) fn counting_again<'a>(without: Incumbent<'a>, incumbent: &Incumbent<'a>) -> Incumbent<'a> {
    if incumbent.study.leaves_out() {
        let study = Study::fit(incumbent.study.bench, &without.study.model, Some(&incumbent.study.warm));
        Incumbent::near(study, &without.gls.noise)
    } else {
        without
    }
}
