//! Fits a model to a log.
//!
//! Every parameter of the model's effects minimises Σ_τ E(τ)²/F(τ)², the error curve over its floor: least squares on
//! increments over all averaging times, which a small missing delay hardly biases, whereas one-step increments are
//! biased by it. Where the model leaves nothing but noise, a last step by generalised least squares (the noise
//! identified by maximum likelihood) makes the estimates efficient. Standard errors are those of the identified noise.

mod initial;
pub(crate) mod judged;
pub(crate) mod parts;

use crate::{
    Axis, AxisModel, Model, Record, Term,
    effects::Need,
    evidence::{
        study::{Bench, Study},
        track::HeldRate,
    },
    order::median,
    record::ReferenceKind,
    thresholds::SILENT,
};
use judged::Judged;
pub use judged::{noise as noise_of, parameters as parameters_of};
pub use parts::LONG;
use thiserror::Error;

/// Why a log cannot be fitted.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum FitError {
    /// No axis has both a gyro and a reference.
    #[error("no axis has both a gyro column and a reference; add ref_angle_x, ref_rate_x or ref_qw…ref_qz")]
    NoReference,
    /// One axis that was asked for has none.
    #[error("axis {0} has no gyro column or no reference")]
    NoReferenceOn(Axis),
    /// Too few rows with a reference.
    #[error(
        "axis {0} has too few rows with a reference, at least 100 are needed: record for longer, or take a reference that comes more often"
    )]
    TooShort(Axis),
    /// The computation broke off: a defect of this program.
    #[error(
        "axis {0} could not be judged: an internal error of truerate, printed above. Please report it with the log"
    )]
    Failed(Axis),
}

impl Model {
    /// The base model of every axis of `record` that can be fitted, at α = 1, δ = 0.
    #[must_use]
    pub fn base_for(record: &Record) -> Self {
        let mut model = Self::default();
        for axis in record.fitted_axes() {
            model.axes[axis.index()] = Some(AxisModel::base(axis));
        }
        model.origin.supply = median(record.rows.iter().map(|r| r.supply).filter(|v| v.is_finite()).collect());
        model
    }
}

/// The axes in groups that share a reference: each shaft axis alone, those of a quaternion together.
#[must_use]
pub fn groups(record: &Record, axes: &[Axis]) -> Vec<Vec<Axis>> {
    let (together, alone): (Vec<Axis>, Vec<Axis>) =
        axes.iter().partition(|&&a| record.reference(a) == Some(ReferenceKind::Quaternion));
    let mut groups: Vec<Vec<Axis>> = alone.into_iter().map(|a| vec![a]).collect();
    if !together.is_empty() {
        groups.push(together);
    }
    groups
}

/// Refits every parameter of `start` on `axes` of `record`; standard errors and noise are filled in. An effect whose
/// parameters are neutral still, and which has a shape, begins at the shape that the log shows most clearly.
///
/// # Errors
/// Where an axis has no gyro, no reference, or too few rows of it.
pub fn fit(record: &Record, start: &Model, axes: &[Axis]) -> Result<Model, FitError> {
    fit_and_keep(record, start, axes).map(|(model, _)| model)
}

/// The same, and the log as it was laid out for it, for what is done with it next: of several groups each sees what the fit made
/// of the others, and nothing is kept.
///
/// # Errors
/// As [`fit`].
pub fn fit_and_keep(record: &Record, start: &Model, axes: &[Axis]) -> Result<(Model, Option<Bench>), FitError> {
    let (mut model, mut kept) = (start.clone(), None);
    if axes.is_empty() {
        return Err(FitError::NoReference);
    }
    for axis in axes {
        if !record.has_gyro(*axis) || record.reference(*axis).is_none() {
            return Err(FitError::NoReferenceOn(*axis));
        }
        model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(*axis));
    }
    if model.origin.supply.is_none() {
        model.origin.supply = Model::base_for(record).origin.supply;
    }
    let groups = groups(record, axes);
    // Of several groups the means are laid out beside what is known by then.
    let lay = if groups.len() == 1 { parts::laid } else { Bench::new };
    let mut beside = calibrated(record, &model);
    for _ in 0..ROUNDS {
        for group in &groups {
            let mut bench = lay(record, group, &beside).ok_or(FitError::TooShort(group[0]))?;
            let anywhere = fitted(record, &bench, &model);
            let (silent, anywhere) = (anywhere.evaluation.silent(), anywhere.model);
            bench.problem.held_rate = HeldRate::AtTheEnd;
            let is_within = |study: &Study| (0..group.len()).all(|k| Judged::new(study, k, false).within());
            let at_the_end = (silent > SILENT.value).then(|| fitted(record, &bench, &model)).filter(is_within);
            model = at_the_end.map_or(anywhere, |study| study.model);
            bench.problem.held_rate = HeldRate::default();
            kept = (groups.len() == 1).then_some(bench);
        }
        // Where an axis sees the others they have to be as this fit leaves them.
        let sees = |term: &Term| term.effect.card().needs.iter().any(|n| matches!(n, Need::OtherGyros | Need::Gyro(_)));
        if !model.axes.iter().flatten().flat_map(|axis| &axis.terms).any(sees) {
            break;
        }
        beside.clone_from(&model);
    }
    Ok((model, kept))
}

/// The axes of a bench fitted, effects that are new from where the log shows them.
fn fitted<'a>(record: &Record, bench: &'a Bench, model: &Model) -> Study<'a> {
    let start = initial::begun(record, bench, model);
    settle(Study::fit(bench, &parts::begun(record, bench, &start), None).in_best_form())
}

/// Fits of all axes where one sees the rates of others.
const ROUNDS: usize = 2;

/// The model, its axes that nothing is known of yet roughly fitted: what one axis sees of the others is compensated.
#[must_use]
pub(crate) fn calibrated(record: &Record, model: &Model) -> Model {
    let mut calibrated = model.clone();
    let groups = groups(record, &record.fitted_axes());
    if groups.len() < 2 {
        return calibrated;
    }
    for group in groups {
        let base = |axis: &Axis| AxisModel::base(*axis);
        let is_known = |axis: &Axis| {
            let own = model.axes[axis.index()].as_ref();
            own.is_some_and(|own| (own.alpha(), own.delta()) != (base(axis).alpha(), base(axis).delta()))
        };
        if group.iter().all(is_known) {
            continue;
        }
        let mut start = Model { origin: model.origin, ..Model::default() };
        for axis in &group {
            start.axes[axis.index()] = Some(base(axis));
        }
        if let Some(bench) = parts::brief(record, &group, &start) {
            let found = Study::fit(&bench, &start, None).model;
            for axis in &group {
                calibrated.axes[axis.index()].clone_from(&found.axes[axis.index()]);
            }
        }
    }
    calibrated
}

/// The largest error over the floor at which the noise alone may be left: beyond it the least squares over all
/// averaging times stands, because whitening trusts a model that is wrong.
const NOISE_ALONE: f64 = 2.0;

/// Times the error of least squares that generalised least squares may leave, floor and all: whitening weighs what is
/// fast, where a reference that is not what it says (filtered, or made of this very gyro) leads it astray.
const ASTRAY: f64 = 1.25;

/// Generalised least squares where the model is good and stays so, standard errors and noise everywhere.
#[must_use]
pub(crate) fn settle(study: Study<'_>) -> Study<'_> {
    let over_floor = study.over_floor();
    let refined = (over_floor < NOISE_ALONE).then(|| study.clone().refine());
    let (mut study, gls) =
        refined.filter(|(refined, _)| refined.over_floor_as_is() < ASTRAY * over_floor.max(1.0)).unwrap_or_else(|| {
            let gls = study.identify();
            (study, gls)
        });
    study.stamp(&gls);
    study
}
