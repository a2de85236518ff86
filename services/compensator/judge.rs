//! What the judging threads do: one holds the model in use against the newest data, every second; the other searches for
//! what is missing, which takes longer, as often as its share of the time allows.

use super::{budget::Budget, store::View};
use gyro_model::{
    AxisModel, Model, Record,
    diagnose::{self, compare, diagnose},
    diagnosis::{AxisDiagnosis, Verdict},
    fit::FitError,
    thin::thinned,
};
use std::time::Instant;

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

/// Holds the model against the newest data.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn hold(view: &View, budget: &mut Budget, job: Job) -> Result<Judgement, FitError> {
    judged(view, budget, job, |record, model| {
        let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
        compare(record, model, &record.fitted_axes(), &options)
    })
}

/// Searches for what is missing.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn search(view: &View, budget: &mut Budget, job: Job) -> Result<Judgement, FitError> {
    judged(view, budget, job, |record, model| {
        diagnose(record, model, &record.fitted_axes(), &diagnose::Options::default())
    })
}

fn judged(
    view: &View,
    budget: &mut Budget,
    job: Job,
    work: impl Fn(&Record, &Model) -> Result<Vec<AxisDiagnosis>, FitError>,
) -> Result<Judgement, FitError> {
    let record = thinned(&view.whole(), budget.rows());
    let start = Instant::now();
    let axes = work(&record, &job.model)?;
    budget.took(record.len(), start.elapsed());
    let at = |row: Option<&gyro_model::Row>| row.map_or(0, |row| row.t_ns);
    Ok(Judgement { span: (at(record.rows.first()), at(record.rows.last())), job, axes })
}

impl Judgement {
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
