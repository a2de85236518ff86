//! Pruning: what the model at the top of its ladder does not tell from nothing goes (Wald test).

use super::{
    Change, Search, added,
    backward::{counting_again, without},
};
use crate::{
    evidence::{noise::Gls, study::Study},
    fit, thresholds as limit,
};

impl<'a> Search<'a, '_> {
    /// Removes what differs from nothing by less than four standard errors, the least first; what differs by two stays where an
    /// error is left without it that noise does not make. The model that is left, with everything that is known of its parameters.
    pub(super) fn prune(&mut self) -> Option<(Study<'a>, Gls)> {
        let mut kept = Vec::new();
        loop {
            let settled = fit::settle(self.incumbent.study.clone());
            let gls = settled.identify_near(&self.incumbent.gls.noise);
            let sizes = self.axes.iter().enumerate().flat_map(|(k, &axis)| {
                let size = |id| Some((k, axis, id, settled.size_in_errors(&gls, k, id)?));
                added(&self.incumbent, self.start, axis).into_iter().filter_map(size).collect::<Vec<_>>()
            });
            let open = sizes.filter(|(k, _, id, size)| *size < limit::WALD.value && !kept.contains(&(*k, *id)));
            let Some((k, axis, id, size)) = open.min_by(|a, b| a.3.total_cmp(&b.3)) else {
                return Some((settled, gls));
            };
            let (without, _) = without(&self.incumbent, &[axis], id)?;
            // How large a warming is hangs on how long it takes: that it is there does not.
            if size > limit::WALD_NEEDED.value && without.excess(k) > limit::NOISE.value {
                kept.push((k, id));
                continue;
            }
            self.incumbent = counting_again(without, &self.incumbent);
            self.unknown.push((k, id));
            (self.took)(&self.incumbent.study, Change::of(k, None, Some(id)));
        }
    }
}
