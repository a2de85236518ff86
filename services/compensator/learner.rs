//! The thread that solves, beside the one that receives.

use super::store::View;
use gyro_model::{
    Axis, Model, Record,
    effects::Role,
    fit::{FitError, fit},
};
use std::{
    sync::mpsc::{Receiver, Sender, TryRecvError, channel},
    thread,
    time::{Duration, Instant},
};

/// Two solutions that differ by more than this many standard errors of their difference disagree.
const DISAGREE: f64 = 4.0;

/// What to solve.
#[derive(Clone, Debug)]
pub struct Job {
    /// The model to start from.
    pub start: Model,
    /// The sliding window, s; `None` for the whole run alone, from the base model's own start where `start` is empty.
    pub window: Option<f64>,
    /// Tells this job's answer from those of jobs that were asked before.
    pub number: u64,
}

/// What came of it.
#[derive(Debug)]
pub struct Solution {
    /// The model, or why there is none.
    pub model: Result<Model, FitError>,
    /// Rows that it rests on.
    pub rows: usize,
    /// How long it took.
    pub took: Duration,
    /// The job's number.
    pub number: u64,
}

/// The learner's end in the receiving thread. Dropping it ends the thread after its present job.
#[derive(Debug)]
pub struct Learner {
    jobs: Option<Sender<Job>>,
    solutions: Receiver<Solution>,
    busy: bool,
    rests_until: Instant,
    duty: f64,
}

impl Learner {
    /// Starts the thread. While a stream runs it works that share of the time.
    #[must_use]
    pub fn start(view: View, duty: f64) -> Self {
        let (jobs, inbox) = channel::<Job>();
        let (outbox, solutions) = channel();
        thread::spawn(move || {
            for job in inbox {
                let start = Instant::now();
                let (model, rows) = solve(&view, &job);
                let solution = Solution { model, rows, took: start.elapsed(), number: job.number };
                if outbox.send(solution).is_err() {
                    return;
                }
            }
        });
        Self { jobs: Some(jobs), solutions, busy: false, rests_until: Instant::now(), duty }
    }

    /// Whether it works.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Whether it has nothing to do and has rested enough.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        !self.busy && Instant::now() >= self.rests_until
    }

    /// Gives it a job.
    pub fn ask(&mut self, job: Job) {
        if let Some(jobs) = &self.jobs {
            self.busy = jobs.send(job).is_ok();
        }
    }

    /// What it has solved, if it is done.
    ///
    /// # Errors
    /// Where the thread died.
    pub fn solution(&mut self) -> anyhow::Result<Option<Solution>> {
        match self.solutions.try_recv() {
            Ok(solution) => {
                self.busy = false;
                self.rests_until = Instant::now() + solution.took.mul_f64((1.0 - self.duty) / self.duty);
                Ok(Some(solution))
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => anyhow::bail!("the learner's thread died"),
        }
    }
}

/// The whole run, unless the recent window contradicts it: then the sensor has changed, and the window is right.
fn solve(view: &View, job: &Job) -> (Result<Model, FitError>, usize) {
    let Some(seconds) = job.window else {
        let whole = view.whole();
        return (fit_from(&whole, &job.start), whole.len());
    };
    let (window, everything) = view.last(seconds);
    let recent = fit_from(&window, &job.start);
    if everything {
        return (recent, window.len());
    }
    let (whole, rows) = {
        let record = view.whole();
        (fit_from(&record, &job.start), record.len())
    };
    match (whole, recent) {
        (Ok(whole), Ok(recent)) if contradicts(&recent, &whole) => (Ok(recent), window.len()),
        (Ok(whole), _) => (Ok(whole), rows),
        (Err(_), recent) => (recent, window.len()),
    }
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
    model.axes.iter().flatten().flat_map(|axis| {
        axis.terms.iter().flat_map(|term| term.values.iter().copied().zip(term.std_errors.iter().copied()))
    })
}

/// Why a solution is not worth taking yet: a coefficient is not known better than to the effect's typical size.
#[must_use]
pub fn not_excited(model: &Model) -> Option<String> {
    for axis in Axis::ALL {
        let Some(of_axis) = &model.axes[axis.index()] else { continue };
        for term in &of_axis.terms {
            for (card, value, std_error) in term.parameters(axis).filter(|(card, ..)| card.role == Role::Linear) {
                let typical = (card.typical - card.neutral).abs();
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
