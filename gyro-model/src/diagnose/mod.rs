//! Which physical effect is missing: compare, diagnose, climb.
//!
//! One search answers all three. The present model is fitted; every absent effect is scanned by a score test in the
//! whitened domain ([`candidates`]); the leaders are refitted exactly and measured twice ([`refit`]): by the held-out
//! error curve, which is honest about models that are still wrong, and by the likelihood of the identified noise, which
//! is the sharper of the two once the model is nearly right. Significance is priced for the whole search and against
//! draws of noise alone on this very motion.

mod ahead;
pub(crate) mod begin;
pub mod candidates;
mod gate;
pub mod judged;
pub mod ladder;
pub mod limits;
pub mod long;
mod own;
mod pair;
mod rank;
pub mod refit;
pub mod tone;
pub mod verdict;

use crate::{
    Axis, AxisModel, Model, Record,
    budget::Budget,
    diagnosis::{AxisDiagnosis, AxisLadder, DataFault, ErrorPoint, Suspect, Verdict},
    effects::{CATALOGUE, Effect, Stage, find},
    evidence::{
        problem::HeldRate,
        study::{Bench, Study},
        whiten::NoiseModel,
    },
    faults::stuck::MARKED_UP_TO,
    fit::{FitError, calibrated, groups},
    parallel,
};
use ahead::ahead;
use candidates::Candidate;
use itertools::Itertools;
use judged::{Judged, finite};
use long::Parts;
use refit::{Present, Refit};

/// How a diagnosis is run.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Told what is being looked at, some times a second.
    pub progress: &'a (dyn Fn(&str) + Sync),
    /// Faults found on reading the log, carried into the result.
    pub faults: &'a [DataFault],
    /// Whether the model was fitted on this very log: its errors are then shown from blocked refits.
    pub own_log: bool,
    /// The user's own effects, suspects like those of the catalogue.
    pub own_effects: &'a [&'static dyn Effect],
    /// Effects that are added to an axis at most: a log that wants more is wrong in another way.
    pub steps: usize,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self { progress: &|_| (), faults: &[], own_log: false, own_effects: &[], steps: 8 }
    }
}

/// How much is said of what an error is made of, the most first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Says {
    All,
    CannotTell,
    Unexplained,
}

/// What became of a group of axes.
struct Standing {
    says: Says,
    /// Whether its error is no more than what noise may leave.
    within: bool,
    /// Its largest error over the floor.
    over_floor: f64,
    /// Whether it has a play, whatever may stand anywhere in which being left out.
    has_play: bool,
}

impl Standing {
    /// Of axes with these verdicts, effects and errors.
    fn of<'a>(axes: impl Iterator<Item = (Verdict, &'a [String], &'a [ErrorPoint])>) -> Self {
        let nothing = Self { says: Says::All, within: true, over_floor: 0.0, has_play: false };
        axes.fold(nothing, |all, (verdict, effects, curve)| {
            let over = |to: fn(&ErrorPoint) -> Option<f64>| {
                let ratios = curve.iter().filter_map(|point| Some(point.error? / to(point)?));
                ratios.fold(0.0, f64::max)
            };
            Self {
                says: all.says.max(match verdict {
                    Verdict::Unexplained => Says::Unexplained,
                    Verdict::CannotTell => Says::CannotTell,
                    _ => Says::All,
                }),
                within: all.within && over(|point| point.floor_99) <= 1.0,
                over_floor: all.over_floor.max(over(|point| point.floor)),
                has_play: all.has_play || effects.iter().filter_map(|id| find(id)).any(Effect::is_play),
            }
        })
    }
}

/// Lays out each group of axes and hands it to `work` with the model, completed by base models where an axis has none.
/// It gives the model that it ends with, and what it found.
///
/// Nobody knows where in a play a rate stands that is held, unless the log comes down to its noise where it is taken to stand
/// at the end that it came to: that is tried where the first gives no answer and a play may be missing, with not many more
/// effects than the first found.
fn each_group<T: Send>(
    record: &Record,
    model: &Model,
    axes: &[Axis],
    options: &Options,
    work: impl Fn(&Bench, &Model, &Options) -> (Model, T) + Sync,
    standing: impl Fn(&T) -> Standing + Sync,
) -> Result<Vec<(Model, T)>, FitError> {
    if axes.is_empty() {
        return Err(FitError::NoReference);
    }
    let mut model = model.clone();
    for axis in axes {
        if !record.has_gyro(*axis) || record.reference(*axis).is_none() {
            return Err(FitError::NoReferenceOn(*axis));
        }
        model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(*axis));
    }
    if model.origin.supply.is_none() {
        model.origin = Model::base_for(record).origin;
    }
    let beside = calibrated(record, &model);
    let one = |group: &Vec<Axis>| {
        let mut bench = Bench::new(record, group, &beside).ok_or(FitError::TooShort(group[0]))?;
        let anywhere = work(&bench, &model, options);
        let first = standing(&anywhere.1);
        if first.says == Says::All {
            return Ok(anywhere);
        }
        bench.problem.held_rate = HeldRate::AtTheEnd;
        if !first.has_play && !may_lack_play(record, &bench, &anywhere.0) {
            return Ok(anywhere);
        }
        let steps = options.steps.min(added(&model, &anywhere.0) + MORE);
        let at_the_end = work(&bench, &model, &Options { steps, ..*options });
        let second = standing(&at_the_end.1);
        let lowers = !first.has_play && second.says < Says::Unexplained && second.over_floor < first.over_floor;
        Ok(if second.says == Says::All && second.within || lowers { at_the_end } else { anywhere })
    };
    parallel::map(&groups(record, axes), one).into_iter().collect()
}

/// Effects that a log may show besides, once the rates that are held inside a play count.
const MORE: usize = 2;

/// How many effects an axis has more than before, the most of any.
fn added(before: &Model, after: &Model) -> usize {
    let count = |axis: &Option<AxisModel>| axis.as_ref().map_or(0, |own| own.terms.len());
    let more = before.axes.iter().zip(&after.axes).map(|(a, b)| count(b).saturating_sub(count(a)));
    more.max().unwrap_or(0)
}

/// Whether a play may be what is left of the error, however long the log.
fn may_lack_play(record: &Record, bench: &Bench, model: &Model) -> bool {
    let shows = |bench: &Bench| {
        let present = Present::new(Study::fit(bench, model, None));
        CATALOGUE.iter().filter(|effect| effect.is_play()).any(|effect| present.may_lack(*effect))
    };
    Parts::new(record, bench, model).map_or_else(|| shows(bench), |parts| parts.each().into_iter().any(shows))
}

/// Holds a model against a log.
///
/// # Errors
/// Where an axis has no gyro, no reference or too few rows.
pub fn compare(
    record: &Record,
    model: &Model,
    axes: &[Axis],
    options: &Options,
) -> Result<Vec<AxisDiagnosis>, FitError> {
    let work = |bench: &Bench, model: &Model, options: &Options| {
        let study = Study::held(bench, model);
        let gls = study.identify(&[]);
        let present = Present::with(study, gls);
        let found = (0..bench.problem.series.len())
            .map(|k| {
                let judged = Judged::new(&present.study, k, !options.own_log);
                let (mut verdict, mut says) = match verdict::unexcited(&present.study, &present.gls, k) {
                    Some(says) => (Verdict::CannotTell, says),
                    None => verdict::rest(&present, &[], &judged, k),
                };
                if verdict == Verdict::Unexplained {
                    says = format!(
                        "the error is up to {:.1} times what noise leaves: `truerate diagnose` looks for what is missing.",
                        judged.over_floor()
                    );
                }
                bad_data(record, options.faults, bench, &mut verdict, &mut says);
                let more = if options.own_log && verdict != Verdict::BadData { untold(&present, k) } else { String::new() };
                let of = (&present.study, (&present.study, &present.gls.noise));
                (axis_diagnosis(record, of, k, &judged, (verdict, says), None, options), more)
            })
            .collect::<Vec<_>>();
        (model.clone(), found)
    };
    let standing = |found: &Vec<(AxisDiagnosis, String)>| {
        let standing = Standing::of(found.iter().map(|(d, _)| (d.verdict, &d.effects[..], &d.error_curve[..])));
        Standing { says: if standing.has_play { standing.says } else { Says::All }, ..standing }
    };
    let all = each_group(record, model, axes, options, work, standing)?;
    let told = all.into_iter().flat_map(|(_, found)| found).map(|(found, more)| {
        let found = unsearched(found);
        AxisDiagnosis { says: with(found.says, &more), ..found }
    });
    Ok(sorted(told.collect(), |d| d.axis))
}

/// What noise could explain, an effect that nobody has looked for may explain as well.
fn unsearched(axis: AxisDiagnosis) -> AxisDiagnosis {
    let over = axis.error_over_floor.filter(|_| axis.within_floor == Some(false));
    match over {
        Some(over) if axis.verdict == Verdict::Adequate => AxisDiagnosis {
            verdict: if over > verdict::WANDER { Verdict::Unexplained } else { Verdict::CannotTell },
            says: format!(
                "the error is up to {over:.1} times what noise leaves: a bias that wanders would leave it, and so would a \
                 missing effect. `truerate diagnose` tells."
            ),
            ..axis
        },
        _ => axis,
    }
}

/// A verdict's words and more sentences behind them.
fn with(says: String, more: &str) -> String {
    if more.is_empty() { says } else { format!("{}.{more}", says.trim_end_matches('.')) }
}

/// Standard errors that one effect which was asked for has to differ from nothing by.
const TOLD: f64 = 2.0;

/// What a model that was fitted to this log has and the log does not tell from nothing; empty where there is no such effect.
fn untold(present: &Present, series: usize) -> String {
    let axis = present.study.bench.problem.series[series].axis;
    let own = judged::axis_model(&present.study.model, axis);
    let size = |id: &&str| present.study.size_in_errors(&present.gls, series, id);
    let added = own.terms.iter().filter(|term| term.effect.stage() != Stage::Calibration);
    let untold: Vec<&str> =
        added.map(|term| term.effect.card().id).filter(|id| size(id).is_some_and(|size| size < TOLD)).collect();
    if untold.is_empty() {
        return String::new();
    }
    let them = if untold.len() == 1 { "it" } else { "them" };
    format!(
        " This log does not tell {} from nothing (less than {} standard errors): `truerate remove` takes {them} out again.",
        untold.join(" and "),
        TOLD
    )
}

/// Refits a model and says which physical effect is missing.
///
/// # Errors
/// As [`compare`].
pub fn diagnose(
    record: &Record,
    model: &Model,
    axes: &[Axis],
    options: &Options,
) -> Result<Vec<AxisDiagnosis>, FitError> {
    let work = |bench: &Bench, model: &Model, options: &Options| {
        let parts = Parts::new(record, bench, model);
        let mut present = Present::new(match &parts {
            Some(parts) => parts.fit(bench, model),
            None => Study::fit(bench, model, None),
        });
        let looked = match &parts {
            Some(parts) => parts.suspects(model, options).into(),
            None => vec![(present.clone(), present.suspects(options.own_effects, options.progress))],
        };
        let gls = present.gls.clone();
        present.study.stamp(&gls);
        let found = (0..bench.problem.series.len())
            .map(|k| {
                let judged = Judged::new(&present.study, k, false);
                let shows = |(present, suspects): &&(Present, Vec<Refit>)| {
                    suspects.iter().any(|r| r.candidate.series == k && r.passes(present))
                };
                let (seen, suspects) = looked.iter().find(shows).unwrap_or(&looked[0]);
                let mut own: Vec<usize> = (0..suspects.len()).filter(|&i| suspects[i].candidate.series == k).collect();
                // What is let in leads, whatever else lowers the error.
                if let Some(first) = own.iter().position(|&i| suspects[i].passes(seen)) {
                    own[..=first].rotate_right(1);
                }
                let aliases: Vec<Vec<String>> = own.iter().map(|&i| ladder::aliases(suspects, i, Some(seen))).collect();
                let own: Vec<&Refit> = own.iter().map(|&i| &suspects[i]).collect();
                let (mut verdict, mut says) = verdict::verdict(&present, seen, &own, &aliases, &judged, k);
                // What hides one another the ladder finds by looking ahead.
                let hidden =
                    (verdict == Verdict::Unexplained && parts.is_none()).then(|| hidden(seen, suspects, options));
                let hidden = hidden.flatten().unwrap_or_default();
                if !hidden.is_empty() {
                    (verdict, says) = (Verdict::MissingEffect, verdict::together(&hidden));
                }
                says = with(says, &own::became(seen, &own, options.own_effects, k));
                bad_data(record, options.faults, bench, &mut verdict, &mut says);
                let removes = |r: &Refit| r.share(seen).is_none_or(|share| share > 0.0);
                let is_listed = |r: &Refit| r.passes(seen) || r.significant() && removes(r);
                let list = own.iter().zip(&aliases).filter(|(r, _)| is_listed(r)).take(5);
                let before = if parts.is_some() { Judged::new(&seen.study, k, false) } else { judged.clone() };
                let is_bad = verdict == Verdict::BadData;
                let list = list.map(|(r, aliases)| (*r, &aliases[..])).filter(|_| hidden.is_empty());
                let list = hidden.iter().map(|r| (r, &[][..])).chain(list);
                let listed = list.filter(|_| !is_bad).map(|(r, a)| suspect(r, a, &before, k)).collect();
                let lacks = matches!(verdict, Verdict::MissingEffect | Verdict::Ambiguous) && parts.is_none();
                let rest = match own.first().filter(|_| lacks && hidden.is_empty()) {
                    Some(refit) => (&refit.study, &refit.gls.noise),
                    None => (&present.study, &present.gls.noise),
                };
                let of = (&present.study, rest);
                axis_diagnosis(record, of, k, &judged, (verdict, says), Some(listed), options)
            })
            .collect::<Vec<_>>();
        (present.study.model.clone(), of_one_orientation(found))
    };
    // What is missing may still be added: the error as it is counts for nothing yet.
    let standing = |found: &Vec<AxisDiagnosis>| {
        let standing = Standing::of(found.iter().map(|d| (d.verdict, &d.effects[..], &d.error_curve[..])));
        Standing { within: true, ..standing }
    };
    let all = each_group(record, model, axes, options, work, standing)?;
    Ok(sorted(all.into_iter().flat_map(|(_, found)| found).collect(), |d| d.axis))
}

/// Axes that share an orientation carry their errors into one another's: while one lacks an effect, what is left on the others may
/// be its.
fn of_one_orientation(mut found: Vec<AxisDiagnosis>) -> Vec<AxisDiagnosis> {
    let lacks = |d: &AxisDiagnosis| matches!(d.verdict, Verdict::MissingEffect | Verdict::Ambiguous);
    let Some((axis, effect)) =
        found.iter().filter(|d| lacks(d)).find_map(|d| Some((d.axis, d.suspects.first()?.effect.clone())))
    else {
        return found;
    };
    let more = format!(
        " But axes of one orientation carry their errors into one another's, and axis {axis} lacks {effect}: add it there first, and \
         look again."
    );
    for other in found.iter_mut().filter(|d| d.verdict == Verdict::Unexplained) {
        other.says = with(std::mem::take(&mut other.says), &more);
    }
    found
}

/// The parameters of a model that this log has otherwise, refitted, as `effect.name` with the standard errors between the two, the
/// most first.
#[must_use]
pub fn moved(model: &Model, found: &AxisDiagnosis) -> Vec<(String, f64)> {
    let Some(before) = &model.axes[found.axis.index()] else { return Vec::new() };
    let known = before.terms.iter().flat_map(|term| {
        let id = term.effect.card().id;
        term.parameters(found.axis).map(move |(card, value, std_error)| (id, card.name, value, std_error))
    });
    let off = known.filter_map(|(id, name, value, std_error)| {
        let now = found.parameters.iter().find(|p| p.effect == id && p.name == name)?;
        let error = now.std_error?.hypot(if std_error.is_finite() { std_error } else { 0.0 });
        let off = (now.value? - value).abs() / error;
        (off > OTHERWISE).then(|| (format!("{id}.{name}"), off))
    });
    off.sorted_by(|a, b| b.1.total_cmp(&a.1)).collect()
}

/// Standard errors between a model's parameter and what a log has that are no chance.
const OTHERWISE: f64 = 5.0;

/// Effects that only together bring the error down to what noise leaves, each refitted by itself; `None` where there are none.
fn hidden<'a>(present: &Present<'a>, suspects: &[Refit<'a>], options: &Options) -> Option<Vec<Refit<'a>>> {
    let way = ahead(present, suspects, options.own_effects, options.progress)?;
    let top = &way.last()?.present.study;
    let model = top.model.axes[top.bench.problem.series[0].axis.index()].as_ref()?;
    let refit = |id: &str| {
        let term = model.term(id)?.clone();
        let freedom = term.values.len();
        Some(present.refit(Candidate { series: 0, term, score: 0.0, removes: 0.0, freedom }))
    };
    way.iter().map(|step| refit(step.id)).collect()
}

/// Diagnoses and adds until nothing is missing; the final model and the steps.
///
/// # Errors
/// As [`compare`].
pub fn ladder(
    record: &Record,
    model: &Model,
    axes: &[Axis],
    options: &Options,
) -> Result<(Model, Vec<AxisLadder>), FitError> {
    let work = |bench: &Bench, model: &Model, options: &Options| {
        let (fitted, mut ladders) = match Parts::new(record, bench, model) {
            Some(parts) => parts.climb(record, bench, model, options),
            None => ladder::climb(record, bench, model, options),
        };
        for l in &mut ladders {
            bad_data(record, options.faults, bench, &mut l.verdict, &mut l.says);
        }
        (fitted, ladders)
    };
    let standing = |ladders: &Vec<AxisLadder>| {
        let end = |l: &AxisLadder| l.steps.last().map_or_else(Vec::new, |step| step.error_curve.clone());
        let curves: Vec<Vec<ErrorPoint>> = ladders.iter().map(end).collect();
        Standing::of(ladders.iter().zip(&curves).map(|(l, curve)| (l.verdict, &l.effects[..], &curve[..])))
    };
    let all = each_group(record, model, axes, options, work, standing)?;
    let mut result = model.clone();
    for (fitted, ladders) in &all {
        for l in ladders {
            result.axes[l.axis.index()].clone_from(&fitted.axes[l.axis.index()]);
        }
        result.origin = fitted.origin;
    }
    result.epoch += 1;
    Ok((result, sorted(all.into_iter().flat_map(|(_, ladders)| ladders).collect(), |l| l.axis)))
}

fn sorted<T>(mut list: Vec<T>, axis: impl Fn(&T) -> Axis) -> Vec<T> {
    list.sort_by_key(axis);
    list
}

/// Faults that make every other verdict on axes that are judged together worthless: theirs, and those of the whole log. A
/// channel that was stuck for little of it is not among them: what it read meanwhile is taken out.
fn bad_data(record: &Record, faults: &[DataFault], bench: &Bench, verdict: &mut Verdict, says: &mut String) {
    let is_grave = |fault: &&DataFault| match fault.fault.as_str() {
        "wrong-unit" | "wrong-sign" | "swapped-axes" => true,
        "stuck-channel" => fault.count as f64 >= MARKED_UP_TO * record.len() as f64,
        _ => false,
    };
    let concerns =
        |fault: &&DataFault| fault.axis.is_none_or(|axis| bench.problem.series.iter().any(|s| s.axis == axis));
    if let Some(fault) = faults.iter().filter(concerns).find(is_grave) {
        *verdict = Verdict::BadData;
        says.clone_from(&fault.says);
    }
}

/// `rest` is the model whose error is divided, and the noise in it: that with the effect which is missing, where one is.
fn axis_diagnosis(
    record: &Record,
    (study, rest): (&Study, (&Study, &NoiseModel)),
    series: usize,
    judged: &Judged,
    (verdict, says): (Verdict, String),
    suspects: Option<Vec<Suspect>>,
    options: &Options,
) -> AxisDiagnosis {
    let searched = suspects.is_some();
    let suspects = suspects.unwrap_or_default();
    let missing = match verdict {
        Verdict::MissingEffect | Verdict::Ambiguous => {
            suspects.first().map_or_else(Vec::new, |s| judged.removed(&s.error_curve))
        }
        _ => Vec::new(),
    };
    let budget = Budget::of(rest.0, series, judged, rest.1, &missing);
    let mut judged = judged.clone();
    budget.raise(&mut judged);
    let (verdict, says) = if searched { budget.settle(verdict, says, &judged) } else { (verdict, says) };
    let (verdict, says) = verdict::at_rest(study, series, verdict, says);
    let axis = study.bench.problem.series[series].axis;
    let own = judged::axis_model(&study.model, axis);
    let (detail, mut fails_where) = judged::pictures(record, study, series);
    // Where a model fails on data that are none says nothing of the model.
    if verdict == Verdict::BadData {
        fails_where.clear();
    }
    AxisDiagnosis {
        axis,
        verdict,
        says,
        headline: String::new(),
        at_source: String::new(),
        effects: own.effect_ids().into_iter().map(str::to_owned).collect(),
        parameters: judged::parameters(&own.terms, axis),
        noise: judged::noise(&own),
        error_curve: judged.points(),
        error_over_floor: finite(judged.over_floor()),
        within_floor: Some(judged.within()),
        floor_source: study.bench.prior[series].source.clone(),
        fails_where,
        searched,
        suspects,
        data_faults: options.faults.to_vec(),
        floor_from: budget.floor_from,
        budget: budget.points,
        error_by_frequency: budget.by_frequency,
        limited_by: Some(budget.limited_by),
        limited_says: budget.limited_says,
        detail: Some(detail),
    }
}

fn suspect(refit: &Refit, aliases: &[String], before: &Judged, series: usize) -> Suspect {
    let axis = refit.study.bench.problem.series[series].axis;
    let after = Judged::new(&refit.study, series, false);
    let (j0, j1) = (before.excess(), after.excess());
    let mut study = refit.study.clone();
    study.stamp(&refit.gls);
    let own = judged::axis_model(&study.model, axis);
    let card = refit.candidate.term.effect.card();
    Suspect {
        effect: card.id.to_owned(),
        aliases: aliases.to_vec(),
        separate_by: verdict::split_by(card.id, aliases),
        p_value: finite(refit.p_value),
        error_fall: (!before.within() && j0 > 1.0).then(|| finite((j0 - j1) / (j0 - 1.0))).flatten(),
        parameters: judged::parameters(own.terms.last().map_or(&[], std::slice::from_ref), axis),
        error_curve: after.points(),
    }
}
