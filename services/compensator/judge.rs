//! What the judging threads do: one holds the model in use against the newest data, every second; the other searches for
//! what is missing, which takes longer, as often as its share of the time allows.

use super::{
    budget::Budget,
    change::Windows,
    judgement::{Job, Judgement},
    message,
    store::View,
};
use gyro_model::{
    diagnose::{self, compare, diagnose},
    fit::FitError,
};
use std::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

/// Rows of one judgement at least and at most; longer stretches are thinned.
pub const ROWS: (usize, usize) = (3_000, 12_000);
/// Fewest rows for the error curve alone, which comes oftener than a search.
pub const FEWEST_HELD: usize = 1_500;

/// What came of holding the model against the newest data: everything that watchers get, made beside the stream.
#[derive(Debug)]
pub struct Held {
    /// The job.
    pub job: Job,
    /// Without run, numbers, trial and last stamp.
    pub message: ipc_types::Diagnosis,
    /// The whole as JSON.
    pub report: Vec<u8>,
    /// The error has jumped: where the data of the changed sensor begin, ns.
    pub changed_ns: Option<i64>,
}

/// Rows that both threads look at where both can afford them, so that their curves have one floor.
#[derive(Clone, Debug)]
pub struct Rows(Arc<AtomicUsize>);

impl Default for Rows {
    fn default() -> Self {
        Self(Arc::new(AtomicUsize::new(ROWS.0)))
    }
}

/// Holds the model against the newest data; what is missing is what the last search of the same model and data found.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn hold(
    view: &View,
    rows: &Rows,
    budget: &mut Budget,
    windows: &mut Windows,
    name: &str,
    mut job: Job,
) -> Result<Held, FitError> {
    let changed_ns = windows.look(view, &job.model, job.data);
    let start = Instant::now();
    let record = view.thinned(rows.0.load(Ordering::Relaxed).min(budget.rows()));
    let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
    let axes = compare(&record, &job.model, &record.fitted_axes(), &options)?;
    let found = job.found.take().filter(|f| f.is_of(&job.model) && f.job.data == job.data);
    let mut judgement = Judgement::new(job, axes, &record);
    judgement.job.search = found.as_ref().map_or(0, |found| found.job.search);
    if let Some(found) = &found {
        judgement.take_suspects(found);
    }
    let (message, report) = (message::of(&judgement), message::report(&mut judgement, name));
    budget.took(record.len(), start.elapsed());
    Ok(Held { job: judgement.job, message, report, changed_ns })
}

/// Searches for what is missing.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn search(view: &View, rows: &Rows, budget: &mut Budget, job: Job) -> Result<Judgement, FitError> {
    let start = Instant::now();
    let record = view.thinned(budget.rows());
    let axes = diagnose(&record, &job.model, &record.fitted_axes(), &diagnose::Options::default())?;
    budget.took(record.len(), start.elapsed());
    rows.0.store(budget.rows(), Ordering::Relaxed);
    Ok(Judgement::new(job, axes, &record))
}
