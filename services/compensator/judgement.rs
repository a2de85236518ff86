//! What is judged, and what came of it.

use gyro_model::{
    AxisModel, Model, Record, Row,
    diagnosis::{AxisDiagnosis, Verdict},
};
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
    pub axes: Vec<AxisDiagnosis>,
    /// The data judged, from and to, ns of the source.
    pub span: (i64, i64),
}

impl Judgement {
    /// Of these axes over this record.
    #[must_use]
    pub fn new(job: Job, axes: Vec<AxisDiagnosis>, record: &Record) -> Self {
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
    pub fn take_suspects(&mut self, search: &Self) {
        for axis in &mut self.axes {
            let Some(found) = search.axes.iter().find(|found| found.axis == axis.axis) else { continue };
            let nothing_found = matches!(found.verdict, Verdict::Adequate | Verdict::CannotTell);
            if nothing_found && found.verdict != axis.verdict {
                continue;
            }
            axis.find(found.finding.clone());
            axis.remarks.clone_from(&found.remarks);
            axis.searched = true;
            axis.suspects.clone_from(&found.suspects);
            // A search knows which part of the error an effect would remove.
            axis.budget.clone_from(&found.budget);
            axis.limited_by = found.limited_by;
            axis.limited_says.clone_from(&found.limited_says);
        }
    }
}
