//! What the log does not show of an effect goes: the simpler effect that it contains takes its place, or nothing.

use super::{
    super::{challenger::Incumbent, known::doubt},
    Change, Search, added,
    backward::{counting_again, without},
};
use crate::{
    Axis, Model,
    effects::{Effect, Stage, find},
    evidence::{noise::Gls, study::Study},
    fit,
    scan::can_show,
    thresholds as limit,
};

/// The effect of an axis whose parameters are known least, where they are not known.
fn least_known(
    incumbent: &Incumbent,
    (settled, gls): &(Study, Gls),
    start: &Model,
    axes: &[Axis],
) -> Option<(usize, &'static str)> {
    let is_fitted = |id: &&str| find(id).is_some_and(|effect| effect.stage() != Stage::Reading);
    let all = axes.iter().enumerate().flat_map(|(k, &axis)| {
        let of = |id| (k, id, doubt(settled, gls, k, id));
        added(incumbent, start, axis).into_iter().filter(is_fitted).map(of).collect::<Vec<_>>()
    });
    let unknown = all.filter(|(_, _, doubt)| *doubt >= limit::KNOWN.value);
    unknown.max_by(|a, b| a.2.total_cmp(&b.2)).map(|(k, id, _)| (k, id))
}

/// Takes out, one at a time, what `incumbent` has beyond `start` and this log does not show; `took` is told of each change. Where
/// everything is known of its parameters already, that is `settled`.
pub(in super::super) fn simplified<'a>(
    mut incumbent: Incumbent<'a>,
    start: &Model,
    mut settled: Option<(Study<'a>, Gls)>,
    took: &mut dyn FnMut(&Study, Change),
) -> Incumbent<'a> {
    let axes: Vec<Axis> = incumbent.study.bench.problem.series.iter().map(|s| s.axis).collect();
    loop {
        if axes.iter().all(|axis| added(&incumbent, start, *axis).is_empty()) {
            return incumbent;
        }
        let known = settled.take().unwrap_or_else(|| {
            let settled = fit::settle(incumbent.study.clone());
            let gls = settled.identify_near(&incumbent.gls.noise);
            (settled, gls)
        });
        let Some((k, id)) = least_known(&incumbent, &known, start, &axes) else { return incumbent };
        let shared = find(id).is_some_and(<dyn Effect>::joins_throughout);
        let has = |axis: &&Axis| added(&incumbent, start, **axis).contains(&id);
        let own: Vec<Axis> = if shared { axes.iter().filter(has).copied().collect() } else { vec![axes[k]] };
        let Some((without, _)) = without(&incumbent, &own, id) else { return incumbent };
        let plainer = simpler(&without, k, id, &incumbent.study.model);
        let removed: Vec<usize> = (0..axes.len()).filter(|&k| own.contains(&axes[k])).collect();
        let new = plainer.as_ref().map(|(id, _)| *id);
        incumbent = match plainer {
            Some((_, with)) => with,
            None => counting_again(without, &incumbent),
        };
        for series in removed {
            let came_in = added(&incumbent, start, axes[series]);
            took(&incumbent.study, Change::of(series, new.filter(|new| came_in.contains(new)), Some(id)));
        }
    }
}

/// The model with the best of the simpler effects that `id` contains in its place, of those that are let in.
fn simpler<'a>(
    without: &Incumbent<'a>,
    series: usize,
    id: &str,
    joint: &Model,
) -> Option<(&'static str, Incumbent<'a>)> {
    let of = &without.study.bench.problem.series[series];
    let own = without.study.model.axes[of.axis.index()].as_ref();
    let is_new = |id: &str| own.is_none_or(|own| !own.effect_ids().contains(&id));
    let known = find(id)?.card().simpler.iter().filter_map(|id| find(id));
    let starts = known.filter(|e| is_new(e.card().id) && can_show(*e, of)).flat_map(|e| without.starts(e, series));
    let refits = starts.map(|start| without.refit_beside(start, joint)).filter(|refit| refit.passes(without));
    let best = refits.max_by(|a, b| a.worth().total_cmp(&b.worth()))?;
    let study = Study::fit(best.study.bench, &best.study.model, Some(&without.study.warm));
    Some((best.candidate.term.effect.card().id, Incumbent::near(study, &best.gls.noise)))
}

impl<'a> Search<'a, '_> {
    /// What the model does not know after all; `settled` is it with everything that is known of its parameters.
    pub(super) fn simplify(&mut self, settled: Option<(Study<'a>, Gls)>) {
        let incumbent = self.incumbent.clone();
        let (unknown, took) = (&mut self.unknown, &mut *self.took);
        self.incumbent = simplified(incumbent, self.start, settled, &mut |study, change| {
            unknown.extend(change.removed.map(|id| (change.series, id)));
            took(study, change);
        });
    }
}
