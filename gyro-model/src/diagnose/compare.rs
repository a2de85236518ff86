//! A model held against a log: its errors, and whether they are noise.

use super::{
    Options, Says, Standing, apart, axis_diagnosis, bad_data, challenger::Incumbent, each_group, say_ratio, sorted,
    verdict, with,
};
use crate::{
    Axis, Model, Record,
    budget::Budget,
    diagnosis::{AxisDiagnosis, Verdict},
    effects::Stage,
    evidence::study::{Bench, Study},
    fit::{
        FitError,
        judged::{self, Judged},
    },
    thresholds, units,
};

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
    if let Some(parts) = apart::parts(record, axes, options.faults) {
        return parts.each(|record, axes| compare(record, model, axes, options));
    }
    let work = |bench: &Bench, model: &Model, options: &Options| {
        let study = Study::held(bench, model);
        let gls = study.identify();
        let incumbent = Incumbent::with(study, gls);
        let found = (0..bench.problem.series.len())
            .map(|k| {
                let judged = Judged::new(&incumbent.study, k, !options.own_log);
                let budget = Budget::of(&incumbent.study, k, &judged, &incumbent.gls.noise, &[]);
                let (mut verdict, mut says) = match verdict::unexcited(&incumbent.study, &incumbent.gls, k) {
                    Some(says) => (Verdict::CannotTell, says),
                    None => verdict::rest(&incumbent, &[], &judged, k),
                };
                if verdict == Verdict::Unexplained {
                    "more than noise is left: `truerate diagnose` looks for the effect that is missing."
                        .clone_into(&mut says);
                }
                bad_data(record, options.faults, bench, &mut verdict, &mut says);
                let more =
                    if options.own_log && verdict != Verdict::BadData { untold(&incumbent, k) } else { String::new() };
                let told = (verdict, says);
                let is_wander = budget.is_wander(&judged);
                let mut found = axis_diagnosis(record, &incumbent.study, k, (&judged, budget), told, None, options);
                // What is left of the error, an effect may take from α.
                let fits = matches!(verdict, Verdict::Adequate | Verdict::CannotTell);
                let models =
                    if fits { vec![judged::axis_model(&incumbent.study.model, found.axis)] } else { Vec::new() };
                say_ratio(record, found.axis, &models, found.verdict, &mut found.says, &mut found.data_faults);
                (found, is_wander, more)
            })
            .collect::<Vec<_>>();
        (model.clone(), found)
    };
    let standing = |found: &Vec<(AxisDiagnosis, bool, String)>| {
        let standing = Standing::of(found.iter().map(|(d, ..)| (d.verdict, &d.effects[..], &d.error_curve[..])));
        Standing { says: if standing.has_play { standing.says } else { Says::All }, ..standing }
    };
    let all = each_group(record, model, axes, options, work, standing)?;
    let told = all.into_iter().flat_map(|(_, found)| found).map(|(found, is_wander, more)| {
        let found = unsearched(found, is_wander);
        AxisDiagnosis { says: with(found.says, &more), ..found }
    });
    Ok(sorted(told.collect(), |d| d.axis))
}

/// What noise could explain, an effect that nobody has looked for may explain as well: a small one, or, where a bias that wanders
/// would explain all of it, a slow one.
fn unsearched(axis: AxisDiagnosis, is_wander: bool) -> AxisDiagnosis {
    let over = axis.error_over_floor.filter(|_| axis.within_floor == Some(false));
    let Some(over) = over.filter(|_| axis.verdict == Verdict::Adequate) else { return axis };
    let is_small = over <= thresholds::WANDER.value;
    let (verdict, cause) = match (is_small, is_wander) {
        (true, _) => (Verdict::CannotTell, "what is left may be a wandering bias or a small effect"),
        (false, true) => (Verdict::CannotTell, "what is left may be a wandering bias or a slow effect"),
        (false, false) => (Verdict::Unexplained, "this is not noise"),
    };
    let over = units::ratio(over);
    let says =
        format!("{cause}: the error is up to {over} times the floor. Next: `truerate diagnose` looks for the effect.");
    AxisDiagnosis { verdict, says, ..axis }
}

/// Standard errors that one effect which was asked for has to differ from nothing by.
const TOLD: f64 = 2.0;

/// What a model that was fitted to this log has and the log does not tell from nothing; empty where there is no such effect.
fn untold(incumbent: &Incumbent, series: usize) -> String {
    let axis = incumbent.study.bench.problem.series[series].axis;
    let own = judged::axis_model(&incumbent.study.model, axis);
    let size = |id: &&str| incumbent.study.size_in_errors(&incumbent.gls, series, id);
    let added = own.terms.iter().filter(|term| term.effect.stage() != Stage::Calibration);
    let untold: Vec<&str> =
        added.map(|term| term.effect.card().id).filter(|id| size(id).is_some_and(|size| size < TOLD)).collect();
    if untold.is_empty() {
        return String::new();
    }
    let (is, them) = if untold.len() == 1 { ("is", "it") } else { ("are", "them") };
    format!(
        " On this log {} {is} less than {TOLD} standard errors from zero: `truerate remove` takes {them} out again.",
        untold.join(" and ")
    )
}
