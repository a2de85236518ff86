//! Exchange: an effect of the model held against those that it may be taken for.

use super::{
    super::{
        Options,
        bounds::is_at_bound,
        challenger::{Challenger, Incumbent},
        comparison::{aliases, take_smoothed_counts},
    },
    Doubt, added, without,
};
use crate::{
    Axis, Model,
    effects::{CATALOGUE, Effect, are_aliases, find},
    evidence::study::Study,
    fit::{self, judged},
    scan::Candidate,
    thresholds as limit,
};
use itertools::Itertools;

/// What a model at the top of its ladder can and cannot be told from, one of its effects being another one.
pub(in super::super) struct Alike {
    pub series: usize,
    pub effect: &'static str,
    pub others: Vec<String>,
    pub told_apart: Vec<&'static str>,
}

impl Alike {
    /// Of `rivals`, all in the place of one effect, beside this one, on an axis.
    fn of(rivals: &[Challenger], own: usize, series: usize) -> Self {
        let id = |refit: &Challenger| refit.candidate.term.effect.card().id;
        let effect = id(&rivals[own]);
        let mut others = aliases(rivals, own, None);
        others.retain(|other| are_aliases(effect, other));
        others.dedup();
        let stays = |other: &&str| *other != effect && !rivals.iter().any(|r| id(r) == *other && rivals[own].alike(r));
        let told_apart = rivals.iter().map(id).filter(stays).unique().collect();
        Self { series, effect, others, told_apart }
    }
}

/// One effect in the place of another.
pub(super) struct Swapped {
    pub series: usize,
    pub old: &'static str,
    pub new: &'static str,
}

/// An effect of the model that gives way to one it may be taken for, on every axis that shares it, where that leaves less on an axis
/// than is `asked` of it, each with the most that may be left, of an error that noise does not make.
pub(super) fn exchange<'a>(
    incumbent: &Incumbent<'a>,
    start: &Model,
    asked: &[(usize, f64)],
    options: &Options,
) -> Option<(Vec<Swapped>, Study<'a>)> {
    let asked: Vec<(usize, f64)> =
        asked.iter().copied().filter(|(k, _)| incumbent.excess(*k) >= limit::ROUGH.value).collect();
    let axes: Vec<usize> = asked.iter().map(|(k, _)| *k).collect();
    effects(incumbent, start, &axes).into_iter().find_map(|(old, own)| {
        let asked: Vec<(usize, f64)> = asked.iter().copied().filter(|(k, _)| own.contains(k)).collect();
        // With both in the model the error is no larger than with the one in the other's place.
        let promises = |c: &Candidate| {
            let left = limit::GRID.value * (1.0 - c.removes) * incumbent.excess(c.series);
            are_aliases(old, c.term.effect.card().id) && asked.iter().any(|(k, most)| c.series == *k && left < *most)
        };
        // What a whole sensor has is scanned on one axis, and fitted on all.
        let is_one = incumbent.study.bench.problem.series.len() == 1;
        if is_one && !incumbent.scanned(options).iter().any(promises) {
            return None;
        }
        let tried = in_the_place_of(old, incumbent, &own, options, are_aliases).into_iter().filter_map(|rival| {
            let new = rival.candidate.term.effect.card().id;
            if new == old || rival.at_bound() {
                return None;
            }
            let over = |&(k, most): &(usize, f64)| {
                let (held, weights) = rival.study.held_out_about(k);
                held.excess(&weights) / most
            };
            let over = asked.iter().map(over).fold(f64::INFINITY, f64::min);
            let swapped = own.iter().map(|&series| Swapped { series, old, new }).collect();
            Some((over, swapped, rival.study))
        });
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 < 1.0).then_some((best.1, best.2))
    })
}

/// What was added to the model of these axes, each effect with the axes that have it: what joins on all axes of an orientation at once
/// is one cause, and stands once.
pub(super) fn effects(incumbent: &Incumbent, start: &Model, axes: &[usize]) -> Vec<(&'static str, Vec<usize>)> {
    let series = &incumbent.study.bench.problem.series;
    let of = |k: usize| added(incumbent, start, series[k].axis);
    let mut all: Vec<(&'static str, Vec<usize>)> = Vec::new();
    for &k in axes {
        for id in of(k) {
            let shared = find(id).is_some_and(<dyn Effect>::joins_throughout);
            let own = (0..series.len()).filter(|&other| other == k || shared && of(other).contains(&id)).collect();
            if !all.iter().any(|(known, own)| *known == id && own.contains(&k)) {
                all.push((id, own));
            }
        }
    }
    all
}

/// An effect that these axes of the model have and those that are its `like`, each refitted in its place, and judged about the axis that
/// misses the effect most.
fn in_the_place_of<'a>(
    id: &'static str,
    incumbent: &Incumbent<'a>,
    own: &[usize],
    options: &Options,
    like: impl Fn(&str, &str) -> bool,
) -> Vec<Challenger<'a>> {
    if !CATALOGUE.iter().any(|other| like(id, other.card().id)) {
        return Vec::new();
    }
    let axes: Vec<Axis> = own.iter().map(|&k| incumbent.study.bench.problem.series[k].axis).collect();
    let Some((without, _)) = without(incumbent, &axes, id) else { return Vec::new() };
    let misses = |k: &usize| without.excess(*k) / incumbent.excess(*k);
    let Some(&series) = own.iter().max_by(|a, b| misses(a).total_cmp(&misses(b))) else { return Vec::new() };
    (options.progress)(id);
    let wanted = |rival: &str| rival == id || like(id, rival);
    let mut rivals = without.rivals(series, &incumbent.study.model, options, wanted);
    take_smoothed_counts(&mut rivals);
    rivals
}

/// Whether one of these may stand where the other does: what the catalogue says may be taken for one another, and all that makes
/// a whole sensor late or slow, which one frequency does not tell apart.
fn may_stand_for(a: &str, b: &str) -> bool {
    let is_of_whole = |id: &str| find(id).is_some_and(<dyn Effect>::is_of_whole_sensor);
    are_aliases(a, b) || a != b && is_of_whole(a) && is_of_whole(b)
}

/// What was added while something else was missing may be the wrong one of a pair: each is held once more against what may stand
/// for it and what it could not be told from then; those that do as well are told.
pub(super) fn settle_doubts<'a>(
    incumbent: Incumbent<'a>,
    start: &Model,
    doubts: &[Doubt],
    options: &Options,
) -> (Incumbent<'a>, Vec<Swapped>, Vec<Alike>) {
    let (mut incumbent, mut swapped, mut alike) = (incumbent, Vec::new(), Vec::new());
    let series = &incumbent.study.bench.problem.series;
    let several = |k: &usize| added(&incumbent, start, series[*k].axis).len() > 1;
    let axes: Vec<usize> = (0..series.len()).filter(several).collect();
    for (id, own) in effects(&incumbent, start, &axes) {
        // One that was put in the place of another may have been this one's, too.
        let has = |k: &usize| added(&incumbent, start, series[*k].axis).contains(&id);
        if !own.iter().all(has) {
            continue;
        }
        let doubted = |id: &str, other: &str| {
            let is = |doubt: &Doubt| {
                own.contains(&doubt.series) && doubt.id == id && doubt.aliases.iter().any(|alias| alias == other)
            };
            doubts.iter().any(is)
        };
        let like = |own: &str, other: &str| may_stand_for(own, other) || doubted(own, other);
        let rivals = in_the_place_of(id, &incumbent, &own, options, like);
        let is_own = |refit: &Challenger| refit.candidate.term.effect.card().id == id;
        let best = |keep: &dyn Fn(&Challenger) -> bool| {
            let kept = (0..rivals.len()).filter(|&r| keep(&rivals[r]));
            kept.max_by(|&a, &b| rivals[a].worth().total_cmp(&rivals[b].worth()))
        };
        // What does as well beside the others may come to nothing once they move too.
        let kept = best(&is_own);
        let freedom = kept.map_or(1, |kept| rivals[kept].candidate.freedom);
        let is_plainer = |refit: &Challenger| kept.is_some_and(|kept| rivals[kept].is_said_plainer_by(refit));
        let may_replace = |refit: &Challenger| refit.replaces(&incumbent, freedom) || is_plainer(refit);
        let better = best(&|refit| !is_own(refit) && may_replace(refit)).and_then(|better| {
            let Challenger { candidate, study, .. } = &rivals[better];
            let new = candidate.term.effect.card().id;
            let study = Study::fit(study.bench, &study.model, Some(&incumbent.study.warm));
            let about = &series[candidate.series];
            let settled = judged::axis_model(&fit::settle(study.clone()).model, about.axis);
            let stays = !is_at_bound(settled.term(new)?, about);
            stays.then_some((better, new, study))
        });
        let told = better.as_ref().map(|(better, ..)| *better).or(kept);
        alike.extend(
            told.into_iter().flat_map(|told| own.iter().map(|&k| Alike::of(&rivals, told, k)).collect::<Vec<_>>()),
        );
        if let Some((_, new, study)) = better {
            swapped.extend(own.iter().map(|&series| Swapped { series, old: id, new }));
            incumbent = Incumbent::near(study, &incumbent.gls.noise);
        }
    }
    (incumbent, swapped, alike)
}
