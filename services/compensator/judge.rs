//! What the judging threads do: one holds the model in use against the newest data, every second; the other searches for
//! what is missing, which takes longer, as often as its share of the time allows.

use super::{budget::Budget, store::View};
use gyro_model::{
    AxisModel, Model, Record, Row,
    diagnose::{self, compare, diagnose},
    diagnosis::{AxisDiagnosis, Verdict},
    fit::FitError,
    thin::thinned,
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

/// What to judge.
#[derive(Clone, Debug)]
pub struct Job {
    /// The model in use.
    pub model: Model,
    /// When the job was given, ns.
    pub took_ns: u64,
    /// Tells this job's answer from those of jobs that were asked before the data changed.
    pub number: u64,
}

/// What came of it.
#[derive(Debug)]
pub struct Judgement {
    /// The job.
    pub job: Job,
    /// Axis by axis.
    pub axes: Vec<AxisDiagnosis>,
    /// The data judged, from and to, ns of the source.
    pub span: (i64, i64),
}

/// Rows that both threads look at, so that their curves have one floor; what the search can afford in its time.
#[derive(Clone, Debug)]
pub struct Rows(Arc<AtomicUsize>);

impl Default for Rows {
    fn default() -> Self {
        Self(Arc::new(AtomicUsize::new(ROWS.0)))
    }
}

/// Holds the model against the newest data.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn hold(view: &View, rows: &Rows, job: Job) -> Result<Judgement, FitError> {
    let record = thinned(&view.whole(), rows.0.load(Ordering::Relaxed));
    let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
    let axes = compare(&record, &job.model, &record.fitted_axes(), &options)?;
    Ok(Judgement::new(job, axes, &record))
}

/// Searches for what is missing.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn search(view: &View, rows: &Rows, budget: &mut Budget, job: Job) -> Result<Judgement, FitError> {
    let record = thinned(&view.whole(), budget.rows());
    let start = Instant::now();
    let axes = diagnose(&record, &job.model, &record.fitted_axes(), &diagnose::Options::default())?;
    budget.took(record.len(), start.elapsed());
    rows.0.store(budget.rows(), Ordering::Relaxed);
    Ok(Judgement::new(job, axes, &record))
}

impl Judgement {
    fn new(job: Job, axes: Vec<AxisDiagnosis>, record: &Record) -> Self {
        let at = |row: Option<&Row>| row.map_or(0, |row| row.t_ns);
        Self { span: (at(record.rows.first()), at(record.rows.last())), job, axes }
    }

    /// Whether a model has the very effects of the one that was judged.
    #[must_use]
    pub fn is_of(&self, model: &Model) -> bool {
        let effects = |model: &Model| model.axes.each_ref().map(|a| a.as_ref().map(AxisModel::effect_ids));
        effects(&self.job.model) == effects(model)
    }

    /// Takes over what a search of the same model found to be missing. Where it found nothing and the newest data say
    /// otherwise, they are right.
    pub fn take_suspects(&mut self, search: &Self) {
        for axis in &mut self.axes {
            let Some(found) = search.axes.iter().find(|found| found.axis == axis.axis) else { continue };
            let nothing_found = matches!(found.verdict, Verdict::Adequate | Verdict::CannotTell);
            if nothing_found && found.verdict != axis.verdict {
                continue;
            }
            (axis.verdict, axis.searched) = (found.verdict, true);
            axis.says.clone_from(&found.says);
            axis.suspects.clone_from(&found.suspects);
        }
    }
}
