//! What the solving thread does: the parameters of the model in use, and trials of another one on the same samples.

use super::{budget::Budget, store::View};
use gyro_model::{
    Axis, Model, Record,
    diagnosis::AxisResult,
    fit::FitError,
    learning::{self, Trial, contradicts, judged, refitted},
    pooled::{Key, prior::settled},
    thin::thinned,
};
use std::{
    collections::BTreeSet,
    time::{Duration, Instant},
};
use workbench::prior::Prior;

/// Rows of one solution at least and at most while the stream runs; longer stretches are thinned.
pub const ROWS: (usize, usize) = (1_500, 30_000);
/// Rows of a trial.
const TRIAL_ROWS: usize = 12_000;
/// Every so many solutions the recent window is held against the whole run.
const CHECK_EVERY: u32 = 4;
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
    /// Whether the data that there are do not fill the window yet.
    pub is_young: bool,
    /// How a trial went.
    pub trial: Option<Trial>,
    /// The errors of the run's first model and of this one, axis by axis.
    pub errors: Vec<(Axis, f64, f64, f64)>,
    /// How long it took.
    pub took: Duration,
    /// The job's number.
    pub number: u64,
}

impl Solution {
    fn plain(model: Result<Model, FitError>, rows: usize) -> Self {
        Self { model, rows, is_young: false, trial: None, errors: Vec::new(), took: Duration::ZERO, number: 0 }
    }
}

/// The solving thread's own state.
#[derive(Debug)]
pub struct Learner {
    view: View,
    budget: Budget,
    turn: u32,
    /// Whether the window contradicted the whole run when the two were last compared.
    changed: bool,
    /// The type that the sensor is a part of, and what was said not to be of it.
    prior: Option<Prior>,
    noticed: BTreeSet<Key>,
}

impl Learner {
    /// Learns from what `view` shows, beside what is known of the sensor's type; a solution shall take `target`.
    #[must_use]
    pub fn new(view: View, target: Duration, prior: Option<Prior>) -> Self {
        let budget = Budget::new(ROWS.0, ROWS.1, target);
        Self { view, budget, turn: 0, changed: false, prior, noticed: BTreeSet::new() }
    }

    /// Does a job.
    #[must_use]
    pub fn solve(&mut self, job: &Job) -> Solution {
        let start = Instant::now();
        let mut solution = match &job.task {
            Task::Learn(window) => self.learn(&job.start, *window),
            Task::Last(first) => self.last(&job.start, first),
            Task::Try(other) => attempt(&self.view, &job.start, other),
        };
        (solution.number, solution.took) = (job.number, start.elapsed());
        solution
    }

    /// The whole run, unless the recent window contradicts it: then the sensor has changed, and the window is right. Both
    /// are solved now and then, and else only the one that counts.
    fn learn(&mut self, start: &Model, seconds: f64) -> Solution {
        let covers_all = self.view.seconds() <= seconds;
        if covers_all {
            (self.changed, self.turn) = (false, 0);
        } else {
            self.turn += 1;
        }
        let check = !covers_all && self.turn % CHECK_EVERY == 1;
        let view = self.view.clone();
        let whole = (!self.changed || check).then(|| self.fitted(|rows| view.thinned(rows), start));
        let window = (self.changed || check).then(|| self.fitted(|rows| thinned(&view.last(seconds), rows), start));
        if let (Some(Ok(recent)), Some(Ok(all))) = (window.as_ref().map(|w| &w.model), whole.as_ref().map(|w| &w.model))
        {
            self.changed = contradicts(recent, all);
        }
        let (first, second) = if self.changed { (window, whole) } else { (whole, window) };
        let solution = match (first, second) {
            (Some(first), Some(second)) if first.model.is_err() => second,
            (Some(only), _) | (None, Some(only)) => only,
            (None, None) => Solution::plain(Err(FitError::NoReference), 0),
        };
        Solution { is_young: covers_all, ..solution }
    }

    /// The model fitted to as many rows as the time allows.
    fn fitted(&mut self, thinned_to: impl FnOnce(usize) -> Record, start: &Model) -> Solution {
        let begun = Instant::now();
        let record = thinned_to(self.budget.rows());
        let model = self.beside_type(&record, start);
        self.budget.took(record.len(), begun.elapsed());
        Solution::plain(model, record.len())
    }

    /// The fit, beside what the sensor's type says. What is not of the type is said once.
    fn beside_type(&mut self, record: &Record, start: &Model) -> Result<Model, FitError> {
        let model = refitted(record, start)?;
        let Some(prior) = &self.prior else { return Ok(model) };
        let (model, noticed) = settled(record, &record.fitted_axes(), model, &prior.known)?;
        for own in noticed {
            if self.noticed.insert(own.key.clone()) {
                tracing::warn!("{}", prior.says(&own));
            }
        }
        Ok(model)
    }

    fn last(&mut self, start: &Model, first: &Model) -> Solution {
        let view = self.view.clone();
        let whole = view.whole();
        let mut solution = Solution::plain(self.beside_type(&whole, start), whole.len());
        if let Ok(model) = &solution.model {
            let record = thinned(&whole, ROWS.1);
            let before = judged(&record, first, false);
            // Blocked refits would forget the type.
            let after = judged(&record, model, self.prior.is_none());
            solution.errors = before.iter().zip(&after).filter_map(|(b, a)| at_long_tau(b, a)).collect();
        }
        solution
    }
}

/// Another model beside the one in use, on the same samples.
fn attempt(view: &View, present: &Model, other: &Model) -> Solution {
    let record = view.thinned(TRIAL_ROWS);
    match learning::attempt(&record, present, other) {
        Ok((model, trial)) => Solution { trial, ..Solution::plain(Ok(model), record.len()) },
        Err(error) => Solution::plain(Err(error), record.len()),
    }
}

/// (axis, τ, before, after) at the averaging time nearest to 10 s.
fn at_long_tau(before: &AxisResult, after: &AxisResult) -> Option<(Axis, f64, f64, f64)> {
    let nearest = |d: &AxisResult| {
        let distance = |tau: f64| (tau / 10.0).ln().abs();
        d.error_curve.iter().min_by(|a, b| distance(a.tau_s).total_cmp(&distance(b.tau_s))).copied()
    };
    let (b, a) = (nearest(before)?, nearest(after)?);
    Some((after.axis, a.tau_s, b.error?, a.error?))
}
