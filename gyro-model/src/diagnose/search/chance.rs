//! Effects that a random cause makes needless: steps of random size at each reversal look a little like a hysteresis.
//!
//! The errors of one axis of an attitude turn into the others' while the body turns: what a random cause makes of one may look like an effect
//! of another. So an effect is held against what its own axes add to the error; one that joins on all axes at once, against all of them together.

use super::{
    Change, Search, added,
    backward::{counting_again, without},
    exchange::effects,
};
use crate::{
    budget::random::{ErrorOf, Random, is_by_chance},
    effects::{Effect, find},
    evidence::study::Study,
};

impl Search<'_, '_> {
    /// Takes out each effect without which a random cause explains the error as well.
    pub(super) fn face_chance(&mut self) {
        let all: Vec<usize> = (0..self.axes.len()).collect();
        let random = |study: &Study, axes: &[usize]| -> Vec<Random> {
            axes.iter().map(|&k| Random::of(study, k, ErrorOf::Model, &[])).collect()
        };
        let is_attitude = self.incumbent.study.bench.problem.attitude().is_some();
        let mut now = Vec::new();
        for (id, own) in effects(&self.incumbent, self.start, &all) {
            if now.is_empty() {
                now = random(&self.incumbent.study, &all);
            }
            let is_caused = |k: usize| now[k].has_found();
            let turned_in = is_attitude && all.iter().any(|&k| is_caused(k));
            // A play leaves out the rows that it makes unsure: a model without another effect is judged on others than this one.
            let has_play = own.iter().flat_map(|&k| added(&self.incumbent, self.start, self.axes[k]));
            let has_play = has_play.filter_map(find).any(<dyn Effect>::is_play);
            if has_play && !own.iter().any(|&k| is_caused(k)) {
                continue;
            }
            let is_joined = all.len() > 1 && find(id).is_some_and(<dyn Effect>::joins_throughout);
            if is_joined && !turned_in {
                continue;
            }
            (self.options.progress)(id);
            let axes: Vec<_> = own.iter().map(|&k| self.axes[k]).collect();
            let Some((without, term)) = without(&self.incumbent, &axes, id) else { continue };
            let rest = random(&without.study, &own);
            if !turned_in && !rest.iter().any(Random::has_found) {
                continue;
            }
            let gain: Option<f64> = own.iter().zip(&rest).map(|(&k, rest)| rest.gain(&now[k])).sum();
            if gain.is_some_and(|gain| is_by_chance(gain, own.len() * term.values.len())) {
                self.incumbent = counting_again(without, &self.incumbent);
                for (k, rest) in own.into_iter().zip(rest) {
                    (self.took)(&self.incumbent.study, Change::of(k, None, Some(id)));
                    now[k] = rest;
                }
            }
        }
    }
}
