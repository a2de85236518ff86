//! Effects that a random cause makes needless: steps of random size at each reversal look a little like a hysteresis.

use super::{
    Change, Search, added,
    backward::{counting_again, without},
};
use crate::{
    budget::random::{ErrorOf, Random},
    effects::{Effect, find},
};

impl Search<'_, '_> {
    /// Takes out each effect without which a random cause explains the error as well.
    pub(super) fn face_chance(&mut self) {
        // The errors of one axis of an attitude turn into the others': what a random cause makes of one may look like an effect of another.
        let is_attitude = self.incumbent.study.bench.problem.attitude().is_some();
        let has_cause = |k: usize| Random::of(&self.incumbent.study, k, ErrorOf::Model, &[]).has_found();
        let caused: Vec<bool> = (0..self.axes.len()).map(|k| is_attitude && has_cause(k)).collect();
        for (k, axis) in self.axes.clone().into_iter().enumerate() {
            let turned_in = caused.iter().enumerate().any(|(other, caused)| *caused && other != k);
            let added = added(&self.incumbent, self.start, axis);
            if added.is_empty() {
                continue;
            }
            let mut now = Random::of(&self.incumbent.study, k, ErrorOf::Model, &[]);
            // A play leaves out the rows that it makes unsure: a model without another effect is judged on others than this one.
            let has_play = added.iter().filter_map(|id| find(id)).any(<dyn Effect>::is_play);
            if has_play && now.found.is_empty() {
                continue;
            }
            for id in added {
                let is_alone =
                    find(id).is_some_and(|effect| !<dyn Effect>::joins_throughout(effect)) || self.axes.len() == 1;
                if !is_alone {
                    continue;
                }
                (self.options.progress)(id);
                let Some((without, term)) = without(&self.incumbent, &[axis], id) else { continue };
                let rest = Random::of(&without.study, k, ErrorOf::Model, &[]);
                if (turned_in || rest.has_found()) && rest.is_as_good_as(&now, term.values.len()) {
                    self.incumbent = counting_again(without, &self.incumbent);
                    (self.took)(&self.incumbent.study, Change::of(k, None, Some(id)));
                    now = rest;
                }
            }
        }
    }
}
