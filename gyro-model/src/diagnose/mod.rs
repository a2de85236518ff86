//! Which physical effect is missing: compare, diagnose, climb.
//!
//! One search answers all three. The model as it stands (`challenger::Incumbent`) is fitted. Every effect that it has not is screened
//! by a score test (`scan`). The best are refitted exactly (`challenger::Challenger`) and measured twice: by the held-out
//! error curve, which holds under models that are still wrong, and by the likelihood of the identified noise, which is the sharper of
//! the two once the model is nearly right. What these numbers decide stands in lists of tests (`admission`, `contrast`), and every number
//! that they are held against in [`crate::thresholds`]. `docs/method.md` has the equations.

mod admission;
mod apart;
mod averages;
mod bounds;
mod case;
mod challenger;
mod chance;
mod compare;
mod comparison;
mod contrast;
mod decision;
#[cfg(test)]
mod document;
mod explain;
mod judging;
mod known;
mod ladder;
mod long;
mod missing;
mod observed;
mod search;
mod suspects;
mod users;
mod verdicts;
mod zeros;

use crate::{
    Axis, AxisModel, Model, Record, Row,
    budget::Budget,
    diagnosis::{AxisResult, DataFault, ErrorPoint, Explained, LadderStep, Suspect, Verdict},
    effects::{CATALOGUE, Effect, Stage, Trait, find, lost_counts::LOST_COUNTS, temperature_bias::TEMPERATURE_BIAS},
    evidence::{
        study::{Bench, Study},
        track::HeldRate,
    },
    fault::FaultKind,
    faults::{ratio, regress},
    finding::{Finding, Remark},
    fit::{
        FitError, calibrated, groups,
        judged::{self, Judged, finite},
        parts::Parts,
    },
    parallel,
    record::ReferenceKind,
    words::{self, Voice, headline::clause},
};
use challenger::Incumbent;
pub use compare::compare;
use itertools::Itertools;
pub use missing::{diagnose, moved};
use std::{
    borrow::Cow,
    panic::{AssertUnwindSafe, catch_unwind},
};

/// How a diagnosis is run.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Told what is being looked at, some times a second.
    pub progress: &'a (dyn Fn(&str) + Sync),
    /// Faults found on reading the log, carried into the result.
    pub faults: &'a [DataFault],
    /// Whether the model was fitted on this very log: its errors are then shown from blocked challengers.
    pub own_log: bool,
    /// The user's own effects, suspects like those of the catalogue.
    pub own_effects: &'a [&'static dyn Effect],
    /// Told of each step of a ladder when it is taken.
    pub took: &'a (dyn Fn(Axis, &LadderStep) + Sync),
    /// Told of each round's suspects with their tests, where they are to be explained.
    pub looked: &'a (dyn Fn(Axis, &[Explained]) + Sync),
    /// Told why an axis could not be judged, where others could.
    pub failed: &'a (dyn Fn(&FitError) + Sync),
    /// Whether to stop and give the best so far: asked again and again.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Whether to give the tests of each suspect with their numbers.
    pub explain: bool,
    /// Effects that are added to an axis at most: a log that wants more is wrong in another way.
    pub steps: usize,
    /// This very log as a fit laid it out ([`crate::fit::fit_and_keep`]), where there was one.
    pub laid: Option<&'a Bench>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            progress: &|_| (),
            took: &|_, _| (),
            looked: &|_, _| (),
            failed: &|_| (),
            stop: &|| false,
            explain: false,
            faults: &[],
            own_log: false,
            own_effects: &[],
            steps: 8,
            laid: None,
        }
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
                has_play: all.has_play || effects.iter().filter_map(|id| find(id)).any(<dyn Effect>::is_play),
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
        let laid = options.laid.filter(|laid| laid.serves(group, &beside)).map(Cow::Borrowed);
        let lay = || Bench::new(record, group, &beside).map(Cow::Owned);
        let mut bench = laid.or_else(lay).ok_or(FitError::TooShort(group[0]))?;
        let anywhere = work(&bench, &model, options);
        let first = standing(&anywhere.1);
        if first.says == Says::All || (options.stop)() {
            return Ok(anywhere);
        }
        bench.to_mut().problem.held_rate = HeldRate::AtTheEnd;
        if !first.has_play && !may_lack_play(record, &bench, &anywhere.0) {
            return Ok(anywhere);
        }
        let steps = options.steps.min(added(&model, &anywhere.0) + MORE);
        let at_the_end = work(&bench, &model, &Options { steps, ..*options });
        let second = standing(&at_the_end.1);
        let lowers = !first.has_play && second.says < Says::Unexplained && second.over_floor < first.over_floor;
        Ok(if second.says == Says::All && second.within || lowers { at_the_end } else { anywhere })
    };
    // What goes wrong on one axis does not end the work on the others.
    let groups = groups(record, axes);
    let caught =
        |group: &Vec<Axis>| catch_unwind(AssertUnwindSafe(|| one(group))).unwrap_or(Err(FitError::Failed(group[0])));
    let (done, failed): (Vec<_>, Vec<_>) = parallel::map(&groups, caught).into_iter().partition_result();
    if done.is_empty() {
        return Err(failed.into_iter().next().unwrap_or(FitError::NoReference));
    }
    for error in &failed {
        (options.failed)(error);
    }
    Ok(done)
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
        let incumbent = Incumbent::new(Study::fit(bench, model, None));
        CATALOGUE.iter().filter(|effect| effect.is_play()).any(|effect| incumbent.may_lack(*effect))
    };
    Parts::new(record, bench, model).map_or_else(|| shows(bench), |parts| parts.each().into_iter().any(shows))
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
) -> Result<(Model, Vec<AxisResult>), FitError> {
    if let Some(parts) = apart::parts(record, axes, options.faults) {
        return parts.ladders(model, |record, axes| ladder(record, model, axes, &Options { laid: None, ..*options }));
    }
    let work = |bench: &Bench, model: &Model, options: &Options| {
        // Of data that are none no effect is made.
        let steps = if fatal(record, options.faults, bench).is_some() { 0 } else { options.steps };
        let options = &Options { steps, ..*options };
        let (fitted, mut ladders) = match Parts::new(record, bench, model) {
            Some(parts) => parts.climb(record, bench, model, options),
            None => ladder::climb(record, bench, model, options),
        };
        for l in &mut ladders {
            add_faults(record, &[judged::axis_model(&fitted, l.axis)], l);
        }
        (fitted, ladders)
    };
    let standing = |ladders: &Vec<AxisResult>| {
        Standing::of(ladders.iter().map(|l| (l.verdict, &l.effects[..], &l.error_curve[..])))
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

/// Faults of the data that only a model shows: α of `models` is one that no gyro has, whatever the finding, for the error may be what
/// noise makes; or the encoder loses counts, by the model or by what the finding names.
fn add_faults(record: &Record, models: &[AxisModel], found: &mut AxisResult) {
    if matches!(found.finding, Finding::BadData { .. }) {
        return;
    }
    if let Some(fault) = ratio::fault(record, found.axis, models) {
        found.remarks.push(Remark::WrongRatio);
        found.data_faults.push(fault);
    }
    found.data_faults.extend(lost_counts(record, found));
}

/// Counts that an encoder loses, by the model or by the effects that the finding names.
fn lost_counts(record: &Record, found: &AxisResult) -> Option<DataFault> {
    let (card, axis) = (LOST_COUNTS.card(), found.axis);
    let named = || found.suspects.iter().find(|suspect| suspect.effect == card.id && found.finding.has(card.id));
    let is_in_model = found.effects.iter().any(|id| id == card.id);
    let parameters = if is_in_model { &found.parameters } else { &named()?.parameters };
    let above = parameters.iter().find(|p| p.effect == card.id && p.name == "above")?.value?;
    let is_fast = |row: &&Row| row.gyro[axis.index()].abs() > above;
    let fast = record.rows.iter().filter(is_fast);
    let first_t = fast.clone().next().map(|row| (row.t_ns - record.rows[0].t_ns) as f64 * 1e-9);
    let says = format!("ref_angle_{axis}: {}. Remedy: {}", clause(axis, card.id, parameters), card.at_source);
    let count = fast.count() as u64;
    Some(DataFault { kind: FaultKind::LostCounts, axis: Some(axis), count, first_t, says })
}

/// The first of the faults that make every other verdict on axes that are judged together worthless: theirs, and those of the whole
/// log. A channel that was stuck for little of it is not among them: what it read meanwhile is taken out.
fn fatal<'a>(record: &Record, faults: &'a [DataFault], bench: &Bench) -> Option<&'a DataFault> {
    let concerns =
        |fault: &&DataFault| fault.axis.is_none_or(|axis| bench.problem.series.iter().any(|s| s.axis == axis));
    faults.iter().filter(concerns).find(|fault| fault.is_fatal(record.len()))
}

/// A remark where the zero of the gyro or that of its reference moves, for the reference is a sensor of rates as well: only their
/// difference is measured. Effects of the model that is judged, and those that `finding` names.
fn either_sensor(record: &Record, axis: Axis, own: &AxisModel, finding: &Finding) -> Option<Remark> {
    let is_rate = record.reference(axis) == Some(ReferenceKind::Rate);
    let turns = record.rows.iter().map(|row| row.ref_rate[axis.index()]).any(|rate| rate.is_finite() && rate != 0.0);
    let named = match finding {
        Finding::Missing { effects, .. } | Finding::Ambiguous { effects, .. } => &effects[..],
        _ => &[],
    };
    let ids = own.effect_ids().into_iter().chain(named.iter().map(|named| named.effect.as_str()));
    let is_of_zero = |effect: &&dyn Effect| {
        effect.stage() == Stage::Felt
            && effect.card().needs.is_empty()
            && (effect.is(Trait::Slow) || effect.is(Trait::Onset))
    };
    let effects: Vec<String> =
        ids.filter_map(find).filter(is_of_zero).map(|effect| effect.card().id.to_owned()).collect();
    (is_rate && turns && !effects.is_empty()).then_some(Remark::EitherSensor { effects })
}

/// A remark where the steps of the temperature leave more of the zero than some error that is shown.
fn coarse_temperature(record: &Record, own: &AxisModel, suspects: &[Suspect], judged: &Judged) -> Option<Remark> {
    let id = TEMPERATURE_BIAS.card().id;
    let suspected = || suspects.first().filter(|s| s.effect == id)?.parameters.first()?.value;
    let slope = own.term(id).map(|term| term.values[0]).or_else(suspected)?;
    let temperatures = record.rows.iter().map(|row| row.temperature).filter(|t| t.is_finite());
    let changes = temperatures.tuple_windows().map(|(a, b)| (b - a).abs()).filter(|change| *change > 1e-9);
    let step = changes.min_by(f64::total_cmp)?;
    let error = slope.abs() * step / 12.0_f64.sqrt();
    let least = judged.points().iter().filter_map(|point| point.error).min_by(f64::total_cmp)?;
    (error > least).then_some(Remark::CoarseTemperature { step, error })
}

/// A remark where the gyros of axes without a reference read a share of the turn about this axis, and little else.
fn read_the_turn(record: &Record, axis: Axis) -> Option<Remark> {
    let of = |axis: Axis| move |row: &Row| row.gyro[axis.index()];
    let lacks = |other: &Axis| record.has_gyro(*other) && record.reference(*other).is_none();
    let follows = |other: Axis| {
        let pairs = record.rows.iter().map(|row| (of(axis)(row), of(other)(row)));
        let (x, y): (Vec<f64>, Vec<f64>) = pairs.filter(|(x, y)| x.is_finite() && y.is_finite()).unzip();
        let (share, r2) = regress(&x, &y);
        (r2 > FOLLOWS).then_some((other, share))
    };
    let shares: Vec<(Axis, f64)> = Axis::ALL.into_iter().filter(lacks).filter_map(follows).collect();
    (!shares.is_empty()).then_some(Remark::ReadTheTurn { shares })
}

/// Squared correlation from which on one gyro reads little else than a share of what another one does.
const FOLLOWS: f64 = 0.5;

/// What is told of one axis: `budget` divides its error, and `suspects` is what a search found, where there was one, with whether it
/// left nothing but noise.
fn axis_result(
    record: &Record,
    study: &Study,
    series: usize,
    (judged, mut budget): (&Judged, Budget),
    (finding, mut remarks): (Finding, Vec<Remark>),
    (suspects, is_noise): (Option<Vec<Suspect>>, bool),
    options: &Options,
) -> AxisResult {
    let searched = suspects.is_some();
    let mut suspects = suspects.unwrap_or_default();
    let mut judged = judged.clone();
    budget.settle(&mut judged, is_noise);
    for suspect in &mut suspects {
        budget.raise_points(&mut suspect.error_curve);
    }
    let axis = study.bench.problem.series[series].axis;
    let own = judged::axis_model(&study.model, axis);
    let (detail, mut fails_where) = judged::pictures(record, study, series);
    remarks.extend(either_sensor(record, axis, &own, &finding));
    remarks.extend(read_the_turn(record, axis));
    remarks.extend(coarse_temperature(record, &own, &suspects, &judged));
    // Where a model fails on data that are none says nothing of the model.
    if matches!(finding, Finding::BadData { .. }) {
        fails_where.clear();
    } else if options.faults.iter().any(|fault| fault.kind == FaultKind::OtherClock) {
        remarks.push(Remark::OtherClock);
    }
    AxisResult {
        remarks,
        effects: own.effect_ids().into_iter().map(str::to_owned).collect(),
        parameters: judged::parameters(&own.terms, axis),
        noise: judged::noise(&own),
        error_curve: judged.points(),
        error_over_floor: finite(judged.over_floor()),
        within_floor: Some(judged.within()),
        floor_source: words::floor_source(&study.bench.prior[series].source, Voice::Log),
        fails_where,
        searched,
        suspects,
        data_faults: options.faults.iter().cloned().chain(budget.fault(axis)).collect(),
        floor_from: budget.floor_from,
        budget: budget.points,
        error_by_frequency: budget.by_frequency,
        limited_by: Some(budget.limited_by),
        limited_says: budget.limit.says(),
        limit: Some(budget.limit),
        random: budget.random,
        detail: Some(detail),
        ..AxisResult::new(axis, finding)
    }
}
