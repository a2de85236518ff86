//! What the solving thread does: the parameters of the model in use, and trials of another one on the same samples.

use super::{store::View, thin::thinned};
use gyro_model::{
    Axis, AxisModel, Model, Record,
    diagnose::{self, compare},
    diagnosis::AxisDiagnosis,
    effects::Role,
    fit::{FitError, fit},
};
use std::time::Duration;

/// Two solutions that differ by more than this many standard errors of their difference disagree.
const DISAGREE: f64 = 4.0;
/// Rows of one solution while the stream runs; longer stretches are thinned.
pub const ROWS: usize = 30_000;
/// A trial is won where the mean of (E/F)² over the averaging times falls by this share at least.
const WON: f64 = 0.01;

/// What to solve.
#[derive(Clone, Debug)]
pub struct Job {
    /// The model to start from: the one in use.
    pub start: Model,
    /// What for.
    pub task: Task,
    /// Tells this job's answer from those of jobs that were asked before something changed.
    pub number: u64,
}

/// What a job is for.
#[derive(Clone, Debug)]
pub enum Task {
    /// The parameters now: the whole run so far, or the window of so many seconds where the two disagree.
    Learn(f64),
    /// The parameters at the end, over every row; the errors before (with this model) and after.
    Last(Box<Model>),
    /// Another model beside the one in use, on the same samples.
    Try(Box<Model>),
}

/// What came of it.
#[derive(Debug)]
pub struct Solution {
    /// The model, or why there is none.
    pub model: Result<Model, FitError>,
    /// Rows that it rests on.
    pub rows: usize,
    /// How a trial went: held-out excess (mean of (E/F)²) of the model in use and of the other one.
    pub trial: Option<(f64, f64)>,
    /// The errors of the run's first model and of this one, axis by axis.
    pub errors: Vec<(Axis, f64, f64, f64)>,
    /// How long it took.
    pub took: Duration,
    /// The job's number.
    pub number: u64,
}

impl Solution {
    /// Whether the other model of a trial is better on data that neither learned from.
    #[must_use]
    pub fn is_won(&self) -> bool {
        self.trial.is_some_and(|(before, after)| after < before - WON * (before - 1.0).max(0.0) && after < before)
    }
}

/// Does a job.
#[must_use]
pub fn solve(view: &View, job: &Job) -> Solution {
    let start = std::time::Instant::now();
    let mut solution = match &job.task {
        Task::Learn(window) => learn(view, &job.start, *window),
        Task::Last(first) => last(view, &job.start, first),
        Task::Try(other) => attempt(view, &job.start, other),
    };
    (solution.number, solution.took) = (job.number, start.elapsed());
    solution
}

fn plain(model: Result<Model, FitError>, rows: usize) -> Solution {
    Solution { model, rows, trial: None, errors: Vec::new(), took: Duration::ZERO, number: 0 }
}

/// The whole run, unless the recent window contradicts it: then the sensor has changed, and the window is right.
fn learn(view: &View, start: &Model, seconds: f64) -> Solution {
    let (window, everything) = view.last(seconds);
    let window = thinned(&window, ROWS);
    let recent = fit_from(&window, start);
    if everything {
        return plain(recent, window.len());
    }
    let whole_record = thinned(&view.whole(), ROWS);
    let whole = fit_from(&whole_record, start);
    match (whole, recent) {
        (Ok(whole), Ok(recent)) if contradicts(&recent, &whole) => plain(Ok(recent), window.len()),
        (Ok(whole), _) => plain(Ok(whole), whole_record.len()),
        (Err(_), recent) => plain(recent, window.len()),
    }
}

fn last(view: &View, start: &Model, first: &Model) -> Solution {
    let whole = view.whole();
    let mut solution = plain(fit_from(&whole, start), whole.len());
    if let Ok(model) = &solution.model {
        let record = thinned(&whole, ROWS);
        let before = judged(&record, first, false);
        let after = judged(&record, model, true);
        solution.errors = before.iter().zip(&after).filter_map(|(b, a)| at_long_tau(b, a)).collect();
    }
    solution
}

/// Both models refitted to the same samples, each judged where it did not learn.
fn attempt(view: &View, present: &Model, other: &Model) -> Solution {
    let record = thinned(&view.whole(), ROWS);
    let (before, after) = (fit_from(&record, present), fit_from(&record, other));
    let mut solution = plain(after, record.len());
    if let (Ok(before), Ok(after)) = (&before, &solution.model) {
        let excess_of = |model: &Model| excess(&judged(&record, model, true));
        solution.trial = Some((excess_of(before), excess_of(after)));
    }
    solution
}

fn judged(record: &Record, model: &Model, own_log: bool) -> Vec<AxisDiagnosis> {
    let options = diagnose::Options { own_log, ..diagnose::Options::default() };
    compare(record, model, &record.fitted_axes(), &options).unwrap_or_default()
}

/// The mean of (E/F)² over averaging times and axes.
fn excess(axes: &[AxisDiagnosis]) -> f64 {
    let points = axes.iter().flat_map(|a| &a.error_curve);
    let ratios: Vec<f64> =
        points.filter_map(|p| Some((p.error? / p.floor?).powi(2))).filter(|r| r.is_finite()).collect();
    if ratios.is_empty() { f64::INFINITY } else { ratios.iter().sum::<f64>() / ratios.len() as f64 }
}

/// (axis, τ, before, after) at the averaging time nearest to 10 s.
fn at_long_tau(before: &AxisDiagnosis, after: &AxisDiagnosis) -> Option<(Axis, f64, f64, f64)> {
    let nearest = |d: &AxisDiagnosis| {
        let distance = |tau: f64| (tau / 10.0).ln().abs();
        d.error_curve.iter().min_by(|a, b| distance(a.tau_s).total_cmp(&distance(b.tau_s))).copied()
    };
    let (b, a) = (nearest(before)?, nearest(after)?);
    Some((after.axis, a.tau_s, b.error?, a.error?))
}

/// The fit of every axis that can be fitted; where the model has no axis yet, of the base model.
fn fit_from(record: &Record, start: &Model) -> Result<Model, FitError> {
    let axes: Vec<Axis> = record.fitted_axes();
    if start.axes.iter().all(Option::is_none) {
        let base = Model { epoch: start.epoch, ..Model::base_for(record) };
        return fit(record, &base, &axes);
    }
    fit(record, start, &axes)
}

fn contradicts(a: &Model, b: &Model) -> bool {
    parameters(a).zip(parameters(b)).any(|((x, sx), (y, sy))| (x - y).abs() > DISAGREE * sx.hypot(sy))
}

fn parameters(model: &Model) -> impl Iterator<Item = (f64, f64)> + '_ {
    let terms = |axis: &AxisModel| -> Vec<(f64, f64)> {
        axis.terms.iter().flat_map(|t| t.values.iter().copied().zip(t.std_errors.iter().copied())).collect()
    };
    model.axes.iter().flatten().flat_map(terms)
}

/// Why a solution is not worth taking yet: a coefficient is not known better than to the effect's typical size, or was
/// driven to its physical bound (a vehicle that stands still tells nothing about a scale).
#[must_use]
pub fn not_excited(model: &Model) -> Option<String> {
    for axis in Axis::ALL {
        let Some(of_axis) = &model.axes[axis.index()] else { continue };
        for term in &of_axis.terms {
            for (card, value, std_error) in term.parameters(axis).filter(|(card, ..)| card.role == Role::Linear) {
                let typical = (card.typical - card.neutral).abs();
                let at_bound = value <= card.bounds.0 || value >= card.bounds.1;
                if at_bound && value != card.neutral {
                    let id = term.effect.card().id;
                    return Some(format!("{id}.{} of axis {axis} is at its physical bound", card.name));
                }
                if !value.is_finite() || !std_error.is_finite() || std_error > typical {
                    let id = term.effect.card().id;
                    return Some(format!(
                        "{id}.{} of axis {axis} is not known better than its typical size",
                        card.name
                    ));
                }
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{Axis, Model, not_excited};
    use gyro_model::AxisModel;

    #[test]
    fn a_scale_that_was_driven_to_its_bound_is_not_taken() {
        let mut axis = AxisModel::base(Axis::Z);
        for term in &mut axis.terms {
            term.std_errors = vec![1e-9];
        }
        let mut model = Model { axes: [None, None, Some(axis)], ..Model::default() };
        assert_eq!(not_excited(&model), None);
        if let Some(axis) = &mut model.axes[2] {
            let (low, _) = axis.terms[0].effect.parameters(Axis::Z)[0].bounds;
            axis.terms[0].values[0] = low;
        }
        let why = not_excited(&model).unwrap_or_default();
        assert!(why.contains("alpha") && why.contains("bound"), "{why}");
    }
}
