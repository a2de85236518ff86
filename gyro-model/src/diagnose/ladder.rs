//! Diagnose and add until nothing is missing; then one pass back.

use super::{
    Options, axis_result,
    challenger::{Challenger, Incumbent},
    comparison::ALIASES,
    explain::explained,
    observed::Observed,
    search::{Alike, Change, search},
    users,
    verdicts::{at_rest, leaves_noise},
};
use crate::{
    AxisModel, Model, Record,
    budget::Budget,
    diagnosis::{AxisResult, LadderStep},
    effects,
    evidence::study::Bench,
    finding::{Finding, NamedEffect},
    fit::{
        self,
        judged::{self, Judged},
    },
};

/// The ladder of axes that share a reference.
#[must_use]
pub(super) fn climb(record: &Record, bench: &Bench, start: &Model, options: &Options) -> (Model, Vec<AxisResult>) {
    let mut steps = vec![Vec::new(); bench.problem.series.len()];
    let top = search(bench, start, options, &mut |study, change| {
        let step = change.step(&Judged::new(study, change.series, false));
        (options.took)(bench.problem.series[change.series].axis, &step);
        steps[change.series].push(step);
    });
    note(&mut steps, &top.alike);
    share(&mut steps);
    conclude(record, &top.incumbent, (&top.incumbent, &top.last), &steps, options)
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

/// What the whole sensor has joins on the other axes with the one that it was found on: what it could not be told from there, it cannot
/// on any of them.
pub(super) fn share(steps: &mut [Vec<LadderStep>]) {
    let of_all = |step: &LadderStep| {
        let id = step.added.as_deref().filter(|_| !step.aliases.is_empty())?;
        effects::find(id)?.is_of_whole_sensor().then(|| (id.to_owned(), step.aliases.clone()))
    };
    let found: Vec<(String, Vec<String>)> = steps.iter().flatten().filter_map(of_all).collect();
    for (id, aliases) in found {
        for step in steps.iter_mut().flatten().filter(|step| step.added.as_deref() == Some(&id)) {
            let more: Vec<String> = aliases.iter().filter(|alias| !step.aliases.contains(alias)).cloned().collect();
            step.aliases.extend(more);
            step.aliases.truncate(ALIASES);
        }
    }
}

/// The last word on each axis, and the model with everything that is known of its parameters. The suspects that were left are those of
/// the model `seen`: the same, or one fitted to a part of the log.
pub(super) fn conclude(
    record: &Record,
    incumbent: &Incumbent,
    (seen, last): (&Incumbent, &[Challenger]),
    steps: &[Vec<LadderStep>],
    options: &Options,
) -> (Model, Vec<AxisResult>) {
    let study = fit::settle(incumbent.study.clone());
    let model = study.model.clone();
    let ladders = study
        .bench
        .problem
        .series
        .iter()
        .enumerate()
        .map(|(k, series)| {
            let axis = series.axis;
            let judged = Judged::new(&study, k, false);
            let budget = Budget::of(&study, k, &judged, &incumbent.gls.noise, Some(&[]));
            let own = judged::axis_model(&model, axis);
            let mut steps = ended(&steps[k], &judged, study.bench.problem.series.len() > 1, &own);
            let list: Vec<&Challenger> = last.iter().filter(|r| r.candidate.series == k).collect();
            let observed = Observed {
                alike: unsplit(&steps, &own.effect_ids()),
                unfinished: (options.stop)(),
                fault: super::fatal(record, options.faults, study.bench).cloned(),
                other_zero: incumbent.other_zero(k),
                ..Observed::of(incumbent, &list, &judged, k)
            };
            let is_noise = leaves_noise(&observed);
            let observed = observed.divided(&budget, &judged);
            let (finding, with_zero) = incumbent.decided(&observed, &judged, k);
            let budget = with_zero.unwrap_or(budget);
            let mut settled = budget.clone();
            settled.settle(&mut judged.clone(), is_noise);
            for step in &mut steps {
                step.on(&settled);
            }
            let mut remarks = Vec::new();
            if !matches!(finding, Finding::BadData { .. } | Finding::Stopped { .. }) {
                remarks.extend(users::became(incumbent, &list, options.own_effects, k));
            }
            remarks.extend(at_rest(&observed, &finding));
            let explained = if options.explain { explained(seen, last, k, options) } else { Vec::new() };
            let (judged, told) = ((&judged, budget), (finding, remarks));
            let end = axis_result(record, &study, k, judged, told, (Some(Vec::new()), is_noise), options);
            AxisResult { steps, explained, unfinished: observed.unfinished, ..end }
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

/// What the log could not tell apart when it was added: of the effects that stayed.
fn unsplit(steps: &[LadderStep], stayed: &[&str]) -> Vec<NamedEffect> {
    let alike = |step: &LadderStep| {
        let effect = step.added.clone().filter(|id| stayed.contains(&id.as_str()) && !step.aliases.is_empty())?;
        Some(NamedEffect { effect, aliases: step.aliases.clone() })
    };
    steps.iter().filter_map(alike).collect()
}
