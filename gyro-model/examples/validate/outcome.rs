//! What the ladder makes of a log, beside what was hidden in it.

use gyro_model::{
    Axis, Model, Record,
    diagnose::{Options, ladder},
    diagnosis::{AxisResult, ErrorPoint, Verdict},
    finding::{Finding, Why},
    fit::FitError,
    record::ReferenceKind,
    words::Voice,
};

/// An effect that the ladder put into the model.
pub struct Added {
    /// Its id.
    pub id: String,
    /// What this log cannot tell from it.
    pub aliases: Vec<String>,
}

/// A ladder's end.
pub struct Outcome {
    /// What stands in the final model and did not stand in the first.
    pub added: Vec<Added>,
    /// All of it.
    pub ladder: AxisResult,
}

impl Outcome {
    /// Climbs from `start`, whose effects are nothing new.
    pub fn climb(record: &Record, start: &Model, axis: Axis, detail: bool) -> Result<Self, FitError> {
        // An orientation shows all axes at once, and what is wrong with it spoils each of them.
        let all = record.reference(axis) == Some(ReferenceKind::Quaternion);
        let asked: Vec<Axis> = if all { record.fitted_axes() } else { vec![axis] };
        let (_, ladders) = ladder(record, start, &asked, &Options::default())?;
        let ladder = ladders.into_iter().find(|l| l.axis == axis).ok_or(FitError::NoReferenceOn(axis))?;
        let known = start.axes[axis.index()].as_ref().map(gyro_model::AxisModel::effect_ids).unwrap_or_default();
        let new = ladder.effects.iter().filter(|id| !known.contains(&id.as_str()));
        let added = new.map(|id| Added { id: id.clone(), aliases: aliases(&ladder, id) }).collect();
        let outcome = Self { added, ladder };
        if detail {
            outcome.tell();
        }
        Ok(outcome)
    }

    /// Climbs from the base model.
    pub fn of(record: &Record, axis: Axis, detail: bool) -> Result<Self, FitError> {
        Self::climb(record, &Model::base_for(record), axis, detail)
    }

    /// The effect that noise or a wandering bias explains as well, where that is what was found.
    pub fn doubts(&self) -> Option<&str> {
        match &self.ladder.finding {
            Finding::CannotTell(Why::SlowOrWander { effect, .. } | Why::NoiseOrEffect { effect }) => Some(effect),
            _ => None,
        }
    }

    /// The error of the final model over each averaging time.
    pub fn error_curve(&self) -> &[ErrorPoint] {
        self.ladder.steps.last().map_or(&[], |step| &step.error_curve)
    }

    /// Whether something was found where there is nothing.
    pub fn is_alarm(&self) -> bool {
        !self.added.is_empty() || !matches!(self.ladder.verdict, Verdict::Adequate | Verdict::CannotTell)
    }

    /// Whether the effect stands in the model, or beside what was added instead as something that fits as well.
    pub fn names(&self, id: &str) -> bool {
        self.added.iter().any(|added| added.id == id || added.aliases.iter().any(|alias| alias == id))
    }

    /// What was added, each with its aliases, or the verdict where nothing was.
    pub fn says(&self) -> String {
        let each = self.added.iter().map(|added| match added.aliases.as_slice() {
            [] => added.id.clone(),
            aliases => format!("{} or {}", added.id, aliases.join(" or ")),
        });
        let all: Vec<String> = each.collect();
        if all.is_empty() { format!("{:?}", self.ladder.verdict) } else { all.join(" + ") }
    }

    /// The steps and the end, to standard error.
    fn tell(&self) {
        for step in &self.ladder.steps {
            let (added, removed) = (step.added.as_deref().unwrap_or("–"), step.removed.as_deref().unwrap_or("–"));
            eprintln!(
                "  added {added}, removed {removed}, like {:?}, error/floor {:.2}",
                step.aliases,
                step.error_over_floor.unwrap_or(f64::NAN)
            );
        }
        for p in &self.ladder.parameters {
            let [value, std_error] = [p.value, p.std_error].map(|v| v.unwrap_or(f64::NAN));
            eprintln!("  {}.{} = {value:.5e} ± {std_error:.1e} {}", p.effect, p.name, p.unit);
        }
        eprintln!("  {:?}: {}", self.ladder.verdict, self.ladder.in_words(Voice::Log));
    }
}

fn aliases(ladder: &AxisResult, id: &str) -> Vec<String> {
    let steps = ladder.steps.iter().rev();
    steps.filter(|step| step.added.as_deref() == Some(id)).map(|step| step.aliases.clone()).next().unwrap_or_default()
}
