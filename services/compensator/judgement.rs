//! What is judged, and what came of it.

use gyro_model::{AxisModel, Model, Record, Row, diagnosis::AxisResult, learning};
use std::sync::Arc;

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

/// What a judgement or a search came to.
#[derive(Debug)]
pub struct Judgement {
    /// The job.
    pub job: Job,
    /// Axis by axis.
    pub axes: Vec<AxisResult>,
    /// The data judged, from and to, ns of the source.
    pub span: (i64, i64),
}

impl Judgement {
    /// Of these axes over this record.
    #[must_use]
    pub fn new(job: Job, axes: Vec<AxisResult>, record: &Record) -> Self {
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
        learning::begin(model, &self.axes);
    }

    /// Takes over what a search of the same model found to be missing.
    pub fn take_suspects(&mut self, search: &Self) {
        learning::take_suspects(&mut self.axes, &search.axes);
    }
}
