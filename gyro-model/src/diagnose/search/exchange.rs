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
    /// Of `rivals`, all in the place of one effect, beside this one.
    fn of(rivals: &[Challenger], own: usize) -> Self {
        let id = |refit: &Challenger| refit.candidate.term.effect.card().id;
        let effect = id(&rivals[own]);
        let mut others = aliases(rivals, own, None);
        others.retain(|other| are_aliases(effect, other));
        others.dedup();
        let stays = |other: &&str| *other != effect && !rivals.iter().any(|r| id(r) == *other && rivals[own].alike(r));
        let told_apart = rivals.iter().map(id).filter(stays).unique().collect();
        Self { series: rivals[own].candidate.series, effect, others, told_apart }
    }
}

/// One effect in the place of another.
pub(super) struct Swapped {
    pub series: usize,
    pub old: &'static str,
    pub new: &'static str,
}

/// An effect of the model that gives way to one it may be taken for, on every axis that has it of the whole sensor, where
/// that leaves less than `most` of an error that noise does not make.
pub(super) fn exchange<'a>(
    incumbent: &Incumbent<'a>,
    start: &Model,
    series: usize,
    most: f64,
    options: &Options,
) -> Option<(Vec<Swapped>, Study<'a>)> {
    if incumbent.excess(series) < limit::ROUGH.value {
        return None;
    }
    let bench = incumbent.study.bench;
    let axes: Vec<Axis> = bench.problem.series.iter().map(|s| s.axis).collect();
    added(incumbent, start, axes[series]).into_iter().find_map(|old| {
        let whole = find(old).is_some_and(<dyn Effect>::is_of_whole_sensor);
        let has = |k: &usize| *k == series || whole && added(incumbent, start, axes[*k]).contains(&old);
        let own: Vec<usize> = (0..axes.len()).filter(has).collect();
        // With both in the model the error is no larger than with the one in the other's place.
        let promises = |c: &Candidate| {
            c.series == series
                && are_aliases(old, c.term.effect.card().id)
                && limit::GRID.value * (1.0 - c.removes) * incumbent.excess(series) < most
        };
        // What a whole sensor has is scanned on one axis, and fitted on all.
        if axes.len() == 1 && !incumbent.scanned(options).iter().any(promises) {
            return None;
        }
        let tried = in_the_place_of(old, incumbent, series, options, are_aliases).into_iter().filter_map(|rival| {
            let term = &rival.candidate.term;
            let new = term.effect.card().id;
            if new == old || rival.at_bound() {
                return None;
            }
            let mut model = incumbent.study.model.clone();
            for &k in &own {
                let terms = &mut model.axes[axes[k].index()].as_mut()?.terms;
                terms.retain(|t| t.effect.card().id != old && t.effect.card().id != new);
                terms.push(term.clone());
            }
            let study =
                if own.len() > 1 { Study::fit(bench, &model, Some(&incumbent.study.frozen())) } else { rival.study };
            let (held, weights) = study.held_out_about(series);
            let swapped = own.iter().map(|&series| Swapped { series, old, new }).collect();
            Some((held.excess(&weights), swapped, study))
        });
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 < most).then_some((best.1, best.2))
    })
}

/// An effect of the model and those that are its `like`, each refitted in its place.
fn in_the_place_of<'a>(
    id: &'static str,
    incumbent: &Incumbent<'a>,
    series: usize,
    options: &Options,
    like: impl Fn(&str, &str) -> bool,
) -> Vec<Challenger<'a>> {
    let axis = incumbent.study.bench.problem.series[series].axis;
    if !CATALOGUE.iter().any(|other| like(id, other.card().id)) {
        return Vec::new();
    }
    let Some((without, _)) = without(incumbent, axis, id) else { return Vec::new() };
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
    let mut incumbent = incumbent;
    let (mut swapped, mut alike) = (Vec::new(), Vec::new());
    let axes: Vec<Axis> = incumbent.study.bench.problem.series.iter().map(|s| s.axis).collect();
    for (k, axis) in axes.iter().enumerate() {
        let added = added(&incumbent, start, *axis);
        if added.len() < 2 {
            continue;
        }
        for id in added {
            let doubted = |own: &str, other: &str| {
                let is =
                    |doubt: &Doubt| doubt.series == k && doubt.id == own && doubt.aliases.iter().any(|id| id == other);
                doubts.iter().any(is)
            };
            let like = |own: &str, other: &str| may_stand_for(own, other) || doubted(own, other);
            let rivals = in_the_place_of(id, &incumbent, k, options, like);
            let is_own = |refit: &Challenger| refit.candidate.term.effect.card().id == id;
            let best = |keep: &dyn Fn(&Challenger) -> bool| {
                let kept = (0..rivals.len()).filter(|&r| keep(&rivals[r]));
                kept.max_by(|&a, &b| rivals[a].worth().total_cmp(&rivals[b].worth()))
            };
            // What does as well beside the others may come to nothing once they move too.
            let own = best(&is_own);
            let freedom = own.map_or(1, |own| rivals[own].candidate.freedom);
            let is_plainer = |refit: &Challenger| own.is_some_and(|own| rivals[own].is_said_plainer_by(refit));
            let may_replace = |refit: &Challenger| refit.replaces(&incumbent, freedom) || is_plainer(refit);
            let better = best(&|refit| !is_own(refit) && may_replace(refit)).and_then(|better| {
                let Challenger { candidate, study, .. } = &rivals[better];
                let new = candidate.term.effect.card().id;
                let study = Study::fit(study.bench, &study.model, Some(&incumbent.study.warm));
                let own = judged::axis_model(&fit::settle(study.clone()).model, *axis);
                let stays = !is_at_bound(own.term(new)?, &study.bench.problem.series[k]);
                stays.then_some((better, new, study))
            });
            if let Some((better, new, study)) = better {
                alike.push(Alike::of(&rivals, better));
                swapped.push(Swapped { series: k, old: id, new });
                incumbent = Incumbent::near(study, &incumbent.gls.noise);
            } else if let Some(own) = own {
                alike.push(Alike::of(&rivals, own));
            }
        }
    }
    (incumbent, swapped, alike)
}
