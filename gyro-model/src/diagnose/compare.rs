//! A model held against a log: its errors, and whether they are noise.

use super::{
    Options, Says, Standing, add_faults, apart, axis_result,
    challenger::Incumbent,
    each_group,
    observed::Observed,
    sorted,
    verdicts::{at_rest, decide},
};
use crate::{
    Axis, Model, Record,
    budget::Budget,
    diagnosis::{AxisResult, Verdict},
    effects::Stage,
    evidence::study::{Bench, Study},
    finding::{Excess, Finding, NOT_SEEN, Remark},
    fit::{
        FitError,
        judged::{self, Judged},
    },
    parallel,
};

/// Holds a model against a log.
///
/// # Errors
/// Where an axis has no gyro, no reference or too few rows.
pub fn compare(record: &Record, model: &Model, axes: &[Axis], options: &Options) -> Result<Vec<AxisResult>, FitError> {
    if let Some(parts) = apart::parts(record, axes, options.faults) {
        return parts.each(|record, axes| compare(record, model, axes, &Options { laid: None, ..*options }));
    }
    let work = |bench: &Bench, model: &Model, options: &Options| {
        let study = Study::held(bench, model);
        let gls = study.identify();
        let incumbent = Incumbent::with(study, gls);
        let found = (0..bench.problem.series.len())
            .map(|k| {
                let judged = Judged::new(&incumbent.study, k, !options.own_log);
                let (budget, observed) = parallel::both(
                    || Budget::of(&incumbent.study, k, &judged, &incumbent.gls.noise, None),
                    || Observed::of(&incumbent, &[], &judged, k),
                );
                let fault = super::fatal(record, options.faults, bench).cloned();
                let observed = Observed { searched: false, fault, ..observed };
                let observed = observed.divided(&budget, &judged);
                let finding = decide(&observed);
                let remarks = at_rest(&observed, &finding).into_iter().collect();
                // What is left of the error, an effect may take from α.
                let fits = !matches!(finding, Finding::Unexplained(Excess::NotSearched));
                let not_seen = if options.own_log { not_seen(&incumbent, k) } else { None };
                let told = (finding, remarks);
                let mut found =
                    axis_result(record, &incumbent.study, k, (&judged, budget), told, (None, false), options);
                let models =
                    if fits { vec![judged::axis_model(&incumbent.study.model, found.axis)] } else { Vec::new() };
                add_faults(record, &models, &mut found);
                found.remarks.extend(not_seen.filter(|_| found.verdict != Verdict::BadData));
                found
            })
            .collect::<Vec<_>>();
        (model.clone(), found)
    };
    let standing = |found: &Vec<AxisResult>| {
        let standing = Standing::of(found.iter().map(|d| (d.verdict, &d.effects[..], &d.error_curve[..])));
        Standing { says: if standing.has_play { standing.says } else { Says::All }, ..standing }
    };
    let all = each_group(record, model, axes, options, work, standing)?;
    Ok(sorted(all.into_iter().flat_map(|(_, found)| found).collect(), |d| d.axis))
}

/// What a model that was fitted to this log has and the log does not tell from nothing; `None` where there is no such effect.
fn not_seen(incumbent: &Incumbent, series: usize) -> Option<Remark> {
    let axis = incumbent.study.bench.problem.series[series].axis;
    let own = judged::axis_model(&incumbent.study.model, axis);
    let size = |id: &&str| incumbent.study.size_in_errors(&incumbent.gls, series, id);
    let added = own.terms.iter().filter(|term| term.effect.stage() != Stage::Calibration);
    let is_small = |id: &&str| size(id).is_some_and(|size| size < NOT_SEEN);
    let effects: Vec<String> = added.map(|term| term.effect.card().id).filter(is_small).map(str::to_owned).collect();
    (!effects.is_empty()).then_some(Remark::NotSeen { effects })
}
