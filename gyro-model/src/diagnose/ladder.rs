//! Diagnose and add until nothing is missing; then one pass back.

use super::{
    Options,
    ahead::ahead,
    candidates::{Candidate, can_show, of_whole_sensor, with_term},
    gate::{SHARE, UNEVEN, is_at_bound},
    judged::{self, Judged},
    own,
    rank::ROUGH,
    refit::{GRID, Present, Refit},
    verdict,
};
use crate::{
    Axis, AxisModel, Model, Record, Term,
    budget::Budget,
    diagnosis::{AxisLadder, LadderStep, Verdict},
    effects::{CATALOGUE, Stage, are_aliases, find},
    evidence::study::{Bench, Study},
    fit,
};
use itertools::Itertools;

/// The ladder of axes that share a reference.
#[must_use]
pub fn climb(record: &Record, bench: &Bench, start: &Model, options: &Options) -> (Model, Vec<AxisLadder>) {
    let mut steps = vec![Vec::new(); bench.problem.series.len()];
    let top = search(bench, start, options, &mut |study, change| {
        steps[change.series].push(change.step(&Judged::new(study, change.series, false)));
    });
    note(&mut steps, &top.alike);
    conclude(record, &top.present, &top.last, &steps, options)
}

/// What a model at the top of its ladder can and cannot be told from, one of its effects being another one.
pub(super) struct Alike {
    series: usize,
    effect: &'static str,
    others: Vec<String>,
    told_apart: Vec<&'static str>,
}

impl Alike {
    /// Of `rivals`, all in the place of one effect, beside this one.
    fn of(rivals: &[Refit], own: usize) -> Self {
        let id = |refit: &Refit| refit.candidate.term.effect.card().id;
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
struct Swapped {
    series: usize,
    old: &'static str,
    new: &'static str,
}

/// Adds to the steps what is alike at the top, and takes from them what is told apart there: while another effect was missing
/// it may have looked otherwise.
pub(super) fn note(steps: &mut [Vec<LadderStep>], alike: &[Alike]) {
    for found in alike {
        let added = |step: &&mut LadderStep| step.added.as_deref() == Some(found.effect);
        if let Some(step) = steps[found.series].iter_mut().rev().find(added) {
            step.aliases.retain(|id| !found.told_apart.contains(&id.as_str()));
            let new: Vec<String> = found.others.iter().filter(|id| !step.aliases.contains(id)).cloned().collect();
            step.aliases.extend(new);
            step.aliases.truncate(ALIASES);
        }
    }
}

/// A change of the model on the way up; neither added nor removed: where it began.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// Index into the problem's series.
    pub series: usize,
    /// What came in.
    pub added: Option<&'static str>,
    /// What went.
    pub removed: Option<&'static str>,
    /// What the log could not tell it from.
    pub aliases: Vec<String>,
}

impl Change {
    fn of(series: usize, added: Option<&'static str>, removed: Option<&'static str>) -> Self {
        Self { series, added, removed, aliases: Vec::new() }
    }

    /// As reported.
    pub(super) fn step(&self, judged: &Judged) -> LadderStep {
        LadderStep {
            added: self.added.map(str::to_owned),
            removed: self.removed.map(str::to_owned),
            aliases: self.aliases.clone(),
            error_curve: judged.points(),
            error_over_floor: judged::finite(judged.over_floor()),
        }
    }
}

impl LadderStep {
    /// The same over the floor of the set-up as it is.
    fn on(&mut self, budget: &Budget) {
        budget.raise_points(&mut self.error_curve);
        let ratios = self.error_curve.iter().filter_map(|point| Some(point.error? / point.floor?));
        self.error_over_floor = judged::finite(ratios.fold(0.0, f64::max));
    }
}

/// What an effect could not be told from when it came in.
struct Doubt {
    series: usize,
    id: &'static str,
    aliases: Vec<String>,
}

/// Where a search ended.
pub(super) struct Top<'a> {
    /// The model there.
    pub present: Present<'a>,
    /// What it was not worth while to add.
    pub last: Vec<Refit<'a>>,
    /// What its effects may as well be.
    pub alike: Vec<Alike>,
}

/// Steps forward, the pass back, and the aliases once more; `took` is told of each change, the model with it fitted.
pub(super) fn search<'a>(
    bench: &'a Bench,
    start: &Model,
    options: &Options,
    took: &mut dyn FnMut(&Study, Change),
) -> Top<'a> {
    let axes: Vec<Axis> = bench.problem.series.iter().map(|s| s.axis).collect();
    let mut present = Present::new(Study::fit(bench, start, None));
    (0..axes.len()).for_each(|k| took(&present.study, Change::of(k, None, None)));
    let mut last: Vec<Refit> = Vec::new();
    let mut doubts: Vec<Doubt> = Vec::new();
    for _ in 0..options.steps * axes.len() {
        let suspects = present.suspects(options.own_effects, options.progress);
        let chosen = next(&present, &suspects);
        // What came first was told from its aliases while much else was missing.
        let exchanged = match chosen.map(|k| &suspects[k]) {
            Some(Refit { candidate, .. }) if candidate.term.effect.stage() == Stage::Reading => None,
            Some(Refit { candidate, excess, .. }) => exchange(&present, start, candidate.series, *excess, options),
            None => {
                (0..axes.len()).find_map(|k| exchange(&present, start, k, (1.0 - SHARE) * present.excess(k), options))
            }
        };
        if let Some((swapped, study)) = exchanged {
            present = Present::new(Study::fit(bench, &study.model, Some(&present.study.warm)));
            for Swapped { series, old, new } in swapped {
                took(&present.study, Change::of(series, Some(new), Some(old)));
            }
            continue;
        }
        let Some(chosen) = chosen else {
            let Some(way) = ahead(&present, &suspects, options.own_effects, options.progress) else {
                last = suspects;
                break;
            };
            for step in way {
                doubts.push(Doubt { series: 0, id: step.id, aliases: step.aliases.clone() });
                let change = Change { aliases: step.aliases, ..Change::of(0, Some(step.id), None) };
                took(&step.present.study, change);
                present = step.present;
            }
            continue;
        };
        let Candidate { series, ref term, .. } = suspects[chosen].candidate;
        let id = term.effect.card().id;
        let aliases = aliases(&suspects, chosen, Some(&present));
        doubts.push(Doubt { series, id, aliases: aliases.clone() });
        let with = with_term(&present.study, series, term.clone());
        present = Present::new(Study::fit(bench, &with, Some(&present.study.warm)));
        let mut changes = vec![Change { aliases, ..Change::of(series, Some(id), None) }];
        for other in (0..axes.len()).filter(|&other| other != series) {
            if let Some(with) = companion(&present, term, other) {
                present = Present::new(Study::fit(bench, &with, Some(&present.study.warm)));
                changes.push(Change::of(other, Some(id), None));
            }
        }
        // Axes of one orientation carry their errors into one another's: what all have is judged once all have it.
        for change in changes {
            took(&present.study, change);
        }
    }
    let present = back(present, start, took, options.progress);
    let (present, swapped, alike) = swap(present, start, &doubts, options);
    for Swapped { series, old, new } in swapped {
        took(&present.study, Change::of(series, Some(new), Some(old)));
    }
    let present = told(present, start, took);
    Top { present, last, alike }
}

/// The suspect that is added next: of those that pass, first of their axis, the one that removes most.
fn next(present: &Present, suspects: &[Refit]) -> Option<usize> {
    let first = |series: usize| {
        let passes = |r: &Refit| r.candidate.series == series && r.passes(present);
        // Readings that are cut off lie about everything else.
        let read_off = |r: &Refit| r.candidate.term.effect.stage() == Stage::Reading;
        let cut_off = suspects.iter().position(|r| passes(r) && read_off(r));
        cut_off.or_else(|| suspects.iter().position(passes))
    };
    let removes = |k: usize| suspects[k].before(present) - suspects[k].excess;
    let firsts = (0..present.study.bench.problem.series.len()).filter_map(first);
    firsts.max_by(|&a, &b| removes(a).total_cmp(&removes(b)))
}

/// An effect of the model that gives way to one it may be taken for, on every axis that has it of the whole sensor, where
/// that leaves less than `most` of an error that noise does not make.
fn exchange<'a>(
    present: &Present<'a>,
    start: &Model,
    series: usize,
    most: f64,
    options: &Options,
) -> Option<(Vec<Swapped>, Study<'a>)> {
    if present.excess(series) < ROUGH {
        return None;
    }
    let bench = present.study.bench;
    let axes: Vec<Axis> = bench.problem.series.iter().map(|s| s.axis).collect();
    added(present, start, axes[series]).into_iter().find_map(|old| {
        let whole = find(old).is_some_and(of_whole_sensor);
        let has = |k: &usize| *k == series || whole && added(present, start, axes[*k]).contains(&old);
        let own: Vec<usize> = (0..axes.len()).filter(has).collect();
        // With both in the model the error is no larger than with the one in the other's place.
        let promises = |c: &Candidate| {
            c.series == series
                && are_aliases(old, c.term.effect.card().id)
                && GRID * (1.0 - c.removes) * present.excess(series) < most
        };
        // What a whole sensor has is scanned on one axis, and fitted on all.
        if axes.len() == 1 && !present.scanned(options.own_effects).iter().any(promises) {
            return None;
        }
        let tried = in_the_place_of(old, present, series, options, are_aliases).into_iter().filter_map(|rival| {
            let term = &rival.candidate.term;
            let new = term.effect.card().id;
            if new == old || rival.at_bound() {
                return None;
            }
            let mut model = present.study.model.clone();
            for &k in &own {
                let terms = &mut model.axes[axes[k].index()].as_mut()?.terms;
                terms.retain(|t| t.effect.card().id != old && t.effect.card().id != new);
                terms.push(term.clone());
            }
            let study =
                if own.len() > 1 { Study::fit(bench, &model, Some(&present.study.frozen())) } else { rival.study };
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
    present: &Present<'a>,
    series: usize,
    options: &Options,
    like: impl Fn(&str, &str) -> bool,
) -> Vec<Refit<'a>> {
    let axis = present.study.bench.problem.series[series].axis;
    if !CATALOGUE.iter().any(|other| like(id, other.card().id)) {
        return Vec::new();
    }
    let Some((without, _)) = without(present, axis, id) else { return Vec::new() };
    (options.progress)(id);
    let wanted = |rival: &str| rival == id || like(id, rival);
    without.rivals(series, &present.study.model, options.own_effects, wanted)
}

/// Whether one of these may stand where the other does: what the catalogue says may be taken for one another, and all that makes
/// a whole sensor late or slow, which one frequency does not tell apart.
fn may_stand_for(a: &str, b: &str) -> bool {
    let is_of_whole = |id: &str| find(id).is_some_and(of_whole_sensor);
    are_aliases(a, b) || a != b && is_of_whole(a) && is_of_whole(b)
}

/// The model with the effect that one axis has just got on another one too, where it passes there, or where it is one that
/// a whole sensor or reference has: alike on both, and with it the error is lower.
fn companion(present: &Present, term: &Term, series: usize) -> Option<Model> {
    let problem = &present.study.bench.problem;
    let id = term.effect.card().id;
    let own = judged::axis_model(&present.study.model, problem.series[series].axis);
    if own.effect_ids().contains(&id) || !can_show(term.effect, &problem.series[series]) {
        return None;
    }
    let starts = present.starts(term.effect, series);
    let found = starts.into_iter().map(|start| present.refit(start)).min_by(|a, b| a.excess.total_cmp(&b.excess))?;
    let is_like = |(a, b): (&f64, &f64)| (a - b).abs() < LIKE * b.abs();
    let alike = of_whole_sensor(term.effect) && found.candidate.term.values.iter().zip(&term.values).all(is_like);
    let lower = found.fall.0 > found.fall.1 && found.excess < found.before(present) && !found.at_bound();
    (found.passes(present) || alike && lower).then(|| with_term(&present.study, series, found.candidate.term.clone()))
}

/// Share by which what a whole sensor has may differ from axis to axis.
const LIKE: f64 = 0.3;

/// The last word on each axis, and the model with everything that is known of its parameters.
pub(super) fn conclude(
    record: &Record,
    present: &Present,
    last: &[Refit],
    steps: &[Vec<LadderStep>],
    options: &Options,
) -> (Model, Vec<AxisLadder>) {
    let study = fit::settle(present.study.clone());
    let model = study.model.clone();
    let ladders = study
        .bench
        .problem
        .series
        .iter()
        .enumerate()
        .map(|(k, series)| {
            let axis = series.axis;
            let mut judged = Judged::new(&study, k, false);
            let budget = Budget::of(&study, k, &judged, &present.gls.noise, &[]);
            let own = judged::axis_model(&model, axis);
            let mut steps = ended(&steps[k], &judged, study.bench.problem.series.len() > 1, &own);
            let list: Vec<&Refit> = last.iter().filter(|r| r.candidate.series == k).collect();
            let (mut verdict, mut says) = match verdict::unexcited(&present.study, &present.gls, k) {
                Some(says) => (Verdict::CannotTell, says),
                None => verdict::last_word(present, &list, &judged, k),
            };
            let split = unsplit(&steps, &own.effect_ids());
            if !split.is_empty() && matches!(verdict, Verdict::Adequate) {
                (verdict, says) = (Verdict::Ambiguous, split.join("; "));
            }
            says = super::with(says, &own::became(present, &list, options.own_effects, k));
            budget.raise(&mut judged);
            for step in &mut steps {
                step.on(&budget);
            }
            (verdict, says) = budget.settle(verdict, says, &judged);
            (verdict, says) = verdict::at_rest(&study, k, verdict, says);
            let (detail, _) = judged::pictures(record, &study, k);
            AxisLadder {
                axis,
                verdict,
                says,
                headline: String::new(),
                at_source: String::new(),
                effects: own.effect_ids().into_iter().map(str::to_owned).collect(),
                parameters: judged::parameters(&own.terms, axis),
                noise: judged::noise(&own),
                steps,
                data_faults: options.faults.to_vec(),
                floor_from: budget.floor_from,
                budget: budget.points,
                error_by_frequency: budget.by_frequency,
                limited_by: Some(budget.limited_by),
                limited_says: budget.limited_says,
                detail: Some(detail),
            }
        })
        .collect();
    (model, ladders)
}

/// The steps of one axis, the last one's error that of the model in the end: what was added to other axes since moves it
/// too, and where nothing was added to this one, that is a step of its own. What stands in the model besides is no alias.
fn ended(steps: &[LadderStep], judged: &Judged, beside_others: bool, own: &AxisModel) -> Vec<LadderStep> {
    let mut steps = steps.to_vec();
    for step in &mut steps {
        step.aliases.retain(|id| !own.effect_ids().contains(&id.as_str()));
    }
    let end = Change::of(0, None, None).step(judged);
    let moved =
        |start: &LadderStep| start.error_over_floor.is_some_and(|was| judged.over_floor() < (1.0 - MOVED) * was);
    match steps.as_mut_slice() {
        [.., last] if last.added.is_some() || last.removed.is_some() => {
            (last.error_curve, last.error_over_floor) = (end.error_curve, end.error_over_floor);
        }
        [.., start] if beside_others && moved(start) => steps.push(end),
        _ => {}
    }
    steps
}

/// Share by which an axis' error has to fall for what was added to others to be a step of its own.
const MOVED: f64 = 0.05;

/// What the log could not tell apart when it was added, and how to split it: of the effects that stayed.
fn unsplit(steps: &[LadderStep], stayed: &[&str]) -> Vec<String> {
    let says = |step: &LadderStep| {
        let id = step.added.as_deref().filter(|id| stayed.contains(id) && !step.aliases.is_empty())?;
        let split = verdict::split_by(id, &step.aliases);
        Some(format!("this log cannot tell {id} from {}. To tell them apart: {split}", step.aliases.join(" or from ")))
    };
    steps.iter().filter_map(says).collect()
}

/// Suspects that this log cannot tell from `suspects[k]`, and that noise alone does not explain, `present` would let in, or the
/// catalogue has for aliases and which leave no more error: at most three, best first.
#[must_use]
pub fn aliases(suspects: &[Refit], k: usize, present: Option<&Present>) -> Vec<String> {
    let own = &suspects[k];
    if own.candidate.term.effect.stage() == Stage::Reading {
        return Vec::new();
    }
    let id = |refit: &Refit| refit.candidate.term.effect.card().id;
    let is_as_good = |r: &Refit| are_aliases(id(own), id(r)) && r.excess <= own.excess && !r.at_bound();
    let is_real = |r: &Refit| r.significant() || is_as_good(r) || present.is_some_and(|present| r.passes(present));
    suspects
        .iter()
        .enumerate()
        .filter(|(i, r)| *i != k && r.candidate.series == own.candidate.series && is_real(r))
        .filter(|(_, r)| own.alike(r) && present.is_none_or(|present| own.may_be(r, present)))
        .map(|(_, r)| id(r).to_owned())
        .take(ALIASES)
        .collect()
}

/// Aliases that are told of one effect.
const ALIASES: usize = 3;

/// What was added while something else was missing may be the wrong one of a pair: each is held once more against what may stand
/// for it and what it could not be told from then; those that do as well are told.
fn swap<'a>(
    present: Present<'a>,
    start: &Model,
    doubts: &[Doubt],
    options: &Options,
) -> (Present<'a>, Vec<Swapped>, Vec<Alike>) {
    let mut present = present;
    let (mut swapped, mut alike) = (Vec::new(), Vec::new());
    let axes: Vec<Axis> = present.study.bench.problem.series.iter().map(|s| s.axis).collect();
    for (k, axis) in axes.iter().enumerate() {
        let added = added(&present, start, *axis);
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
            let rivals = in_the_place_of(id, &present, k, options, like);
            let is_own = |refit: &Refit| refit.candidate.term.effect.card().id == id;
            let best = |keep: &dyn Fn(&Refit) -> bool| {
                let kept = (0..rivals.len()).filter(|&r| keep(&rivals[r]));
                kept.max_by(|&a, &b| rivals[a].worth().total_cmp(&rivals[b].worth()))
            };
            // What does as well beside the others may come to nothing once they move too.
            let own = best(&is_own);
            let freedom = own.map_or(1, |own| rivals[own].candidate.freedom);
            let is_plainer = |refit: &Refit| own.is_some_and(|own| rivals[own].is_said_plainer_by(refit));
            let may_replace = |refit: &Refit| refit.replaces(&present, freedom) || is_plainer(refit);
            let better = best(&|refit| !is_own(refit) && may_replace(refit)).and_then(|better| {
                let Refit { candidate, study, .. } = &rivals[better];
                let new = candidate.term.effect.card().id;
                let study = Study::fit(study.bench, &study.model, Some(&present.study.warm));
                let own = judged::axis_model(&fit::settle(study.clone()).model, *axis);
                let stays = !is_at_bound(own.term(new)?, &study.bench.problem.series[k]);
                stays.then_some((better, new, study))
            });
            if let Some((better, new, study)) = better {
                alike.push(Alike::of(&rivals, better));
                swapped.push(Swapped { series: k, old: id, new });
                present = Present::new(study);
            } else if let Some(own) = own {
                alike.push(Alike::of(&rivals, own));
            }
        }
    }
    (present, swapped, alike)
}

/// What was added to the model that the ladder began with, in the order of adding.
fn added(present: &Present, start: &Model, axis: Axis) -> Vec<&'static str> {
    let kept = judged::axis_model(start, axis).effect_ids();
    let now = judged::axis_model(&present.study.model, axis).effect_ids();
    now.into_iter().filter(|id| !kept.contains(id)).collect()
}

/// The model without one effect, fitted on the same samples, and the term; `None` where the readings themselves show it.
pub(super) fn without<'a>(present: &Present<'a>, axis: Axis, id: &str) -> Option<(Present<'a>, Term)> {
    let mut model = present.study.model.clone();
    let own = model.axes[axis.index()].as_mut()?;
    let place = own.terms.iter().position(|t| t.effect.card().id == id)?;
    let term = own.terms.remove(place);
    if term.effect.stage() == Stage::Reading {
        return None;
    }
    Some((Present::new(Study::fit(present.study.bench, &model, Some(&present.study.frozen()))), term))
}

/// One pass back: what was added and is no longer needed goes.
fn back<'a>(
    present: Present<'a>,
    start: &Model,
    took: &mut dyn FnMut(&Study, Change),
    progress: &(dyn Fn(&str) + Sync),
) -> Present<'a> {
    let mut present = present;
    let axes: Vec<Axis> = present.study.bench.problem.series.iter().map(|s| s.axis).collect();
    for (k, axis) in axes.iter().enumerate() {
        let added = added(&present, start, *axis);
        if added.len() < 2 {
            continue;
        }
        for id in &added[..added.len() - 1] {
            progress(id);
            let Some((without, term)) = without(&present, *axis, id) else { continue };
            if !without.needs(&present, k, &term) {
                present = counting_again(without, &present);
                took(&present.study, Change::of(k, None, Some(id)));
            }
        }
    }
    present
}

/// A model without an effect of `present`, on the samples too that the effect made unsure.
fn counting_again<'a>(without: Present<'a>, present: &Present<'a>) -> Present<'a> {
    if present.study.leaves_out() {
        Present::new(Study::fit(present.study.bench, &without.study.model, Some(&present.study.warm)))
    } else {
        without
    }
}

/// Whatever was added goes that the model at the top, with all that it knows of its parameters, does not tell from nothing; the
/// least first.
fn told<'a>(present: Present<'a>, start: &Model, took: &mut dyn FnMut(&Study, Change)) -> Present<'a> {
    let mut present = present;
    let mut kept = Vec::new();
    loop {
        let settled = fit::settle(present.study.clone());
        let gls = settled.identify(&[present.gls.noise]);
        let axes = settled.bench.problem.series.iter().map(|s| s.axis).enumerate();
        let sizes = axes.flat_map(|(k, axis)| {
            let size = |id| Some((k, axis, id, settled.size_in_errors(&gls, k, id)?));
            added(&present, start, axis).into_iter().filter_map(size).collect::<Vec<_>>()
        });
        let open = sizes.filter(|(k, _, id, size)| *size < TOLD && !kept.contains(&(*k, *id)));
        let Some((k, axis, id, size)) = open.min_by(|a, b| a.3.total_cmp(&b.3)) else { break };
        let Some((without, _)) = without(&present, axis, id) else { break };
        // How large a warming is hangs on how long it takes: that it is there does not.
        if size > SHOWS && without.excess(k) > UNEVEN {
            kept.push((k, id));
            continue;
        }
        present = counting_again(without, &present);
        took(&present.study, Change::of(k, None, Some(id)));
    }
    present
}

/// Standard errors that an effect has to differ from nothing by in the end: of so many that were looked for, noise brings one beyond
/// two in every other log.
const TOLD: f64 = 3.0;
/// The same where an error is left without it that noise does not make.
const SHOWS: f64 = 2.0;
