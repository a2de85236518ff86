//! The commands: what is asked of the running model, checked, and what is answered. A command that is asked again under
//! the same number is done once.

use super::current::Current;
use crate::{
    model_file::{self, Provenance},
    run_folder::SourceFacts,
};
use anyhow::{Context, bail};
use gyro_model::{Axis, AxisModel, Model, Term};
use ipc_types::{Command, Reply, Text};
use jiff::Timestamp;
use std::{collections::VecDeque, path::Path};

/// Answers that are remembered.
const REMEMBERED: usize = 64;

/// The answers given, and those that are still owed.
#[derive(Debug, Default)]
pub struct Answers(VecDeque<(u64, Option<Reply>)>);

impl Answers {
    /// Whether this command is new; it counts as begun from then on.
    pub fn begin(&mut self, id: u64) -> bool {
        if self.0.iter().any(|(known, _)| *known == id) {
            return false;
        }
        self.0.push_back((id, None));
        if self.0.len() > REMEMBERED {
            self.0.pop_front();
        }
        true
    }

    /// Settles a command.
    pub fn settle(&mut self, id: u64, epoch: u64, result: anyhow::Result<String>) {
        let (done, says) = match result {
            Ok(says) => (1, says),
            Err(error) => (0, format!("{error:#}")),
        };
        tracing::info!(done, "{says}");
        if let Some((_, answer)) = self.0.iter_mut().find(|(known, _)| *known == id) {
            *answer = Some(Reply { id, epoch, done, says: Text::new(&says) });
        }
    }

    /// The answer, if there is one.
    #[must_use]
    pub fn of(&self, id: u64) -> Option<Reply> {
        self.0.iter().find(|(known, _)| *known == id).and_then(|(_, answer)| *answer)
    }
}

/// The axes that a command means, of those that are modelled.
fn axes(command: &Command, model: &Model) -> anyhow::Result<Vec<Axis>> {
    let modelled: Vec<Axis> = Axis::ALL.into_iter().filter(|a| model.axes[a.index()].is_some()).collect();
    let wanted: Vec<Axis> = match Axis::ALL.get(command.axis as usize) {
        Some(axis) => vec![*axis],
        None => modelled.clone(),
    };
    match wanted.iter().find(|axis| !modelled.contains(axis)) {
        Some(axis) => bail!("axis {axis} has no model yet: it needs a gyro, a reference and a little motion"),
        None if wanted.is_empty() => bail!("nothing is learned yet: wait until there are some seconds of motion"),
        None => Ok(wanted),
    }
}

/// The model with the effect added, its parameters still neutral.
///
/// # Errors
/// An unknown effect, an axis without a model, an effect that is there already.
pub fn with_effect(command: &Command, current: &mut Current, facts: &SourceFacts) -> anyhow::Result<Model> {
    let id = command.effect.as_str();
    let own = command.argument.as_str();
    if !own.is_empty() {
        let file = model_file::parse(Path::new("the effect's file"), own, &facts.free_names)?;
        file.own_effects.into_iter().for_each(|effect| current.know(effect));
    }
    let effect =
        current.effect(id).with_context(|| format!("there is no effect '{id}': `truerate effects` lists them"))?;
    let mut model = current.start().clone();
    let mut added = false;
    for axis in axes(command, &model)? {
        let of_axis = model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(axis));
        if of_axis.term(id).is_none() && !effect.parameters(axis).is_empty() {
            of_axis.terms.push(Term::neutral(effect, axis));
            added = true;
        }
    }
    if !added {
        bail!("the model has '{id}' already: nothing to add");
    }
    Ok(model)
}

/// The model without the effect.
///
/// # Errors
/// An axis without a model, an effect that is not there, the base model's own.
pub fn without_effect(command: &Command, current: &Current) -> anyhow::Result<Model> {
    let id = command.effect.as_str();
    if id == "scale-factor" || id == "bias" {
        bail!("'{id}' belongs to the base model: it stays");
    }
    let mut model = current.start().clone();
    let mut removed = false;
    for axis in axes(command, &model)? {
        if let Some(of_axis) = &mut model.axes[axis.index()] {
            let before = of_axis.terms.len();
            of_axis.terms.retain(|term| term.effect.card().id != id);
            removed |= of_axis.terms.len() < before;
        }
    }
    if !removed {
        bail!("the model has no '{id}': nothing to remove");
    }
    Ok(model)
}

/// Where a saved model comes from.
#[must_use]
pub fn provenance(facts: &SourceFacts, samples: u64) -> Provenance {
    Provenance {
        log: Some(facts.name.clone()),
        sha256: facts.sha256.clone(),
        fitted: Some(Timestamp::now()),
        samples: Some(samples),
        temperature: None,
    }
}

#[cfg(test)]
mod tests {
    use super::Answers;

    #[test]
    fn a_repeated_command_is_done_once_and_answered_again() {
        let mut answers = Answers::default();
        assert!(answers.begin(7));
        assert!(!answers.begin(7) && answers.of(7).is_none());
        answers.settle(7, 3, Ok("done".into()));
        assert!(!answers.begin(7));
        let reply = answers.of(7).unwrap();
        assert_eq!((reply.epoch, reply.done, reply.says.as_str()), (3, 1, "done"));
        for id in 100..200 {
            answers.begin(id);
        }
        assert!(answers.of(7).is_none());
    }
}
