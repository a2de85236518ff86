//! What the judging threads do: one holds the model in use against the newest data, every second; the other searches for
//! what is missing, which takes longer, as often as its share of the time allows.

use super::{budget::Budget, change::Windows, message, store::View};
use gyro_model::{
    AxisModel, Model, Record, Row,
    diagnose::{self, compare, diagnose},
    diagnosis::{AxisDiagnosis, Verdict},
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

/// What to judge.
#[derive(Clone, Debug)]
pub struct Job {
    /// The model in use.
    pub model: Model,
    /// When the job was given, ns.
    pub took_ns: u64,
    /// Grows by one whenever what was seen so far is forgotten.
    pub data: u64,
    /// Which search this is.
    pub search: u64,
    /// What the last search found, for a job that is none itself.
    pub found: Option<Arc<Judgement>>,
}

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

    /// Gives effects that the model has not yet the parameters that this search found for them, to start from.
    pub fn begin(&self, model: &mut Model) {
        for found in &self.axes {
            let Some(axis) = &mut model.axes[found.axis.index()] else { continue };
            for suspect in &found.suspects {
                let Some(term) = axis.terms.iter_mut().find(|t| t.effect.card().id == suspect.effect) else { continue };
                for (card, value) in term.effect.parameters(found.axis).iter().zip(&mut term.values) {
                    let known = suspect.parameters.iter().find(|p| p.effect == suspect.effect && p.name == card.name);
                    *value = known.and_then(|p| p.value).unwrap_or(*value);
                }
            }
        }
    }

    /// Takes over what a search of the same model found to be missing. Where it found nothing and the newest data say
    /// otherwise, they are right.
    fn take_suspects(&mut self, search: &Self) {
        for axis in &mut self.axes {
            let Some(found) = search.axes.iter().find(|found| found.axis == axis.axis) else { continue };
            let nothing_found = matches!(found.verdict, Verdict::Adequate | Verdict::CannotTell);
            if nothing_found && found.verdict != axis.verdict {
                continue;
            }
            (axis.verdict, axis.searched) = (found.verdict, true);
            axis.says.clone_from(&found.says);
            axis.suspects.clone_from(&found.suspects);
            // A search knows which part of the error an effect would remove.
            axis.budget.clone_from(&found.budget);
            axis.limited_by = found.limited_by;
            axis.limited_says.clone_from(&found.limited_says);
        }
    }
}
