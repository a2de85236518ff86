//! Diagnose and add until nothing is missing; then one pass back.

use super::{
    Options,
    judged::{self, Judged},
    refit::{Present, Refit},
    verdict,
};
use crate::{
    Axis, Model, Record, Term,
    diagnosis::{AxisLadder, LadderStep, Verdict},
    effects::Stage,
    evidence::study::{Bench, Study},
    fit,
};

/// Steps at most: a log that wants more is wrong in another way.
const STEPS: usize = 8;

/// The ladder of axes that share a reference.
#[must_use]
pub fn climb(record: &Record, bench: &Bench, start: &Model, options: &Options) -> (Model, Vec<AxisLadder>) {
    let (progress, faults) = (options.progress, options.faults);
    let axes: Vec<Axis> = bench.problem.series.iter().map(|s| s.axis).collect();
    let mut present = Present::new(Study::fit(bench, start, None));
    let mut steps: Vec<Vec<LadderStep>> =
        (0..axes.len()).map(|k| vec![step(&Judged::new(&present.study, k, false), None, None, Vec::new())]).collect();
    let mut last: Vec<Refit> = Vec::new();
    for _ in 0..STEPS {
        let suspects = present.suspects(options.own_effects, progress);
        let chosen: Vec<Option<usize>> = (0..axes.len())
            .map(|k| suspects.iter().position(|r| r.candidate.series == k && r.passes(&present)))
            .collect();
        if chosen.iter().all(Option::is_none) {
            last = suspects;
            break;
        }
        let mut model = present.study.model.clone();
        for (k, choice) in chosen.iter().enumerate() {
            if let (Some(c), Some(m)) = (choice, &mut model.axes[axes[k].index()]) {
                m.terms.push(suspects[*c].candidate.term.clone());
            }
        }
        present = Present::new(Study::fit(bench, &model, Some(&present.study.warm)));
        for (k, choice) in chosen.iter().enumerate() {
            if let Some(c) = choice {
                let aliases = aliases(&suspects, *c, true);
                let id = suspects[*c].candidate.term.effect.card().id;
                steps[k].push(step(&Judged::new(&present.study, k, false), Some(id), None, aliases));
            }
        }
    }
    let (present, removed) = back(present, start, progress);
    for (k, id) in removed {
        steps[k].push(step(&Judged::new(&present.study, k, false), None, Some(id), Vec::new()));
    }
    let (present, swapped) = swap(present, start, options);
    for (k, old, new) in swapped {
        let judged = Judged::new(&present.study, k, false);
        steps[k].push(step(&judged, None, Some(old), Vec::new()));
        steps[k].push(step(&judged, Some(new), None, Vec::new()));
    }
    let study = fit::settle(present.study.clone());
    let model = study.model.clone();
    let ladders = axes
        .iter()
        .enumerate()
        .map(|(k, &axis)| {
            let judged = Judged::new(&study, k, false);
            let list: Vec<&Refit> = last.iter().filter(|r| r.candidate.series == k).collect();
            let (mut verdict, mut says) = match verdict::unexcited(&present.study, &present.gls, k) {
                Some(says) => (Verdict::CannotTell, says),
                None => verdict::rest(&present, &list, &judged, k),
            };
            let own = judged::axis_model(&model, axis);
            let split = unsplit(&steps[k], &own.effect_ids());
            if !split.is_empty() && matches!(verdict, Verdict::Adequate) {
                (verdict, says) = (Verdict::Ambiguous, split.join("; "));
            }
            let (detail, _) = judged::pictures(record, &study, k);
            AxisLadder {
                axis,
                verdict,
                says,
                effects: own.effect_ids().into_iter().map(str::to_owned).collect(),
                parameters: judged::parameters(&own.terms, axis),
                noise: judged::noise(&own),
                steps: steps[k].clone(),
                data_faults: faults.to_vec(),
                detail: Some(detail),
            }
        })
        .collect();
    (model, ladders)
}

/// What the log could not tell apart when it was added, and how to split it: of the effects that stayed.
fn unsplit(steps: &[LadderStep], stayed: &[&str]) -> Vec<String> {
    let says = |step: &LadderStep| {
        let id = step.added.as_deref().filter(|id| stayed.contains(id) && !step.aliases.is_empty())?;
        Some(format!("{id} or {}: {}", step.aliases.join(" or "), verdict::split_by(id, &step.aliases)))
    };
    steps.iter().filter_map(says).collect()
}

fn step(judged: &Judged, added: Option<&str>, removed: Option<&str>, aliases: Vec<String>) -> LadderStep {
    LadderStep {
        added: added.map(str::to_owned),
        removed: removed.map(str::to_owned),
        aliases,
        error_curve: judged.points(),
        error_over_floor: judged::finite(judged.over_floor()),
    }
}

/// Suspects that this log cannot tell from `suspects[k]`: at most three, best first.
#[must_use]
pub fn aliases(suspects: &[Refit], k: usize, significant: bool) -> Vec<String> {
    let own = &suspects[k];
    if own.candidate.term.effect.stage() == Stage::Reading {
        return Vec::new();
    }
    suspects
        .iter()
        .enumerate()
        .filter(|(i, r)| *i != k && r.candidate.series == own.candidate.series && (!significant || r.significant()))
        .filter(|(_, r)| own.alike(r))
        .map(|(_, r)| r.candidate.term.effect.card().id.to_owned())
        .take(3)
        .collect()
}

/// What was added while something else was missing may be the wrong one of a pair: each is held against its aliases
/// once more.
fn swap<'a>(
    present: Present<'a>,
    start: &Model,
    options: &Options,
) -> (Present<'a>, Vec<(usize, &'static str, &'static str)>) {
    let mut present = present;
    let mut swapped = Vec::new();
    let axes: Vec<Axis> = present.study.bench.problem.series.iter().map(|s| s.axis).collect();
    for (k, axis) in axes.iter().enumerate() {
        let added = added(&present, start, *axis);
        if added.len() < 2 {
            continue;
        }
        for id in added {
            let aliases = crate::effects::find(id).map_or(&[][..], |effect| effect.card().aliases);
            if aliases.is_empty() {
                continue;
            }
            let Some((without, _)) = without(&present, *axis, id) else { continue };
            (options.progress)(id);
            let better = without.rivals(k, options.own_effects, |rival| aliases.iter().any(|a| a.id == rival));
            if let Some(refit) = better.into_iter().find(|refit| refit.replaces(&present)) {
                swapped.push((k, id, refit.candidate.term.effect.card().id));
                let model = refit.study.model.clone();
                present = Present::new(Study::fit(present.study.bench, &model, Some(&present.study.warm)));
            }
        }
    }
    (present, swapped)
}

/// What was added to the model that the ladder began with, in the order of adding.
fn added(present: &Present, start: &Model, axis: Axis) -> Vec<&'static str> {
    let kept = judged::axis_model(start, axis).effect_ids();
    let now = judged::axis_model(&present.study.model, axis).effect_ids();
    now.into_iter().filter(|id| !kept.contains(id)).collect()
}

/// The model without one effect, fitted on the same samples, and the term; `None` where the readings themselves show it.
fn without<'a>(present: &Present<'a>, axis: Axis, id: &str) -> Option<(Present<'a>, Term)> {
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
fn back<'a>(present: Present<'a>, start: &Model, progress: &dyn Fn(&str)) -> (Present<'a>, Vec<(usize, &'static str)>) {
    let mut present = present;
    let mut removed = Vec::new();
    let axes: Vec<Axis> = present.study.bench.problem.series.iter().map(|s| s.axis).collect();
    for (k, axis) in axes.iter().enumerate() {
        let added = added(&present, start, *axis);
        if added.len() < 2 {
            continue;
        }
        for id in &added[..added.len() - 1] {
            progress(id);
            let Some((without, term)) = without(&present, *axis, id) else { continue };
            if !without.needs(&present, &term) {
                // What the effect made unsure counts again.
                present = if present.study.leaves_out() {
                    let model = &without.study.model;
                    Present::new(Study::fit(present.study.bench, model, Some(&present.study.warm)))
                } else {
                    without
                };
                removed.push((k, *id));
            }
        }
    }
    (present, removed)
}
