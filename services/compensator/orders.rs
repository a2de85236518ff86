//! The commands: what is asked of the running model, checked, and what is answered. A command that is asked again under
//! the same number is done once.

use super::{
    Compensator,
    current::Current,
    keeper::{Keeping, Then},
    phase::Phase,
    trial::{Challenger, gives_up},
};
use crate::clock::now_ns;
use crate::run_folder::SourceFacts;
use anyhow::{Context, bail, ensure};
use gyro_model::{Axis, AxisModel, Model, Term, effects};
use ipc_types::{Command, Reply, Text, command::Kind};
use jiff::Timestamp;
use std::{collections::VecDeque, fs, os::unix::fs::FileTypeExt, path::Path};
use workbench::model_file::{self, Provenance};

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
        _ if modelled.is_empty() => {
            bail!("nothing is learned yet: it takes a gyro, its reference and some seconds of motion")
        }
        Some(axis) => {
            let letters: Vec<&str> = modelled.iter().map(|a| a.letter()).collect();
            bail!(
                "axis {axis} has no model, axis {} has: a gyro is learned where it has a reference",
                letters.join(", ")
            )
        }
        None => Ok(wanted),
    }
}

/// The model with the effect added, its parameters still neutral.
///
/// # Errors
/// An unknown effect, an axis without a model, an effect that is there already.
fn with_effect(command: &Command, current: &mut Current, facts: &SourceFacts) -> anyhow::Result<Model> {
    let id = command.effect.as_str();
    let own = command.argument.as_str();
    if !own.is_empty() {
        let file = model_file::parse(Path::new("the effect's file"), own, &facts.free_names)?;
        file.own_effects.into_iter().for_each(|effect| current.know(effect));
    }
    let effect = current
        .effect(id)
        .with_context(|| format!("no effect '{id}'{}; `truerate effects` lists them all", effects::meant(id)))?;
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
fn without_effect(command: &Command, current: &Current) -> anyhow::Result<Model> {
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
fn provenance(facts: &SourceFacts, samples: u64) -> Provenance {
    Provenance {
        log: Some(facts.name.clone()),
        sha256: facts.sha256.clone(),
        fitted: Some(Timestamp::now()),
        samples: Some(samples),
        temperature: None,
    }
}

impl Compensator<'_> {
    /// Takes the commands that wait; answers those that are settled.
    pub(super) fn obey(&mut self) -> anyhow::Result<()> {
        self.commands.serve(|command| {
            if self.answers.begin(command.id) {
                self.orders.push_back(*command);
            }
            self.answers.of(command.id)
        })?;
        while !self.keeper.is_busy()
            && !self.waits_for_trial()
            && let Some(command) = self.orders.pop_front()
        {
            let result = self.begin(&command);
            if let Some(result) = result.transpose() {
                self.answers.settle(command.id, self.current.epoch(), result);
            }
            self.give()?;
        }
        Ok(())
    }

    /// Does a command; `None` where it takes longer.
    fn begin(&mut self, command: &Command) -> anyhow::Result<Option<String>> {
        let kind = Kind::from_u32(command.kind).filter(|kind| *kind != Kind::Hide);
        let Some(kind) = kind else { bail!("the compensator knows no command {}", command.kind) };
        if self.phase != Phase::Streaming && kind != Kind::Save {
            bail!("the stream has ended: nothing can be changed any more");
        }
        match kind {
            Kind::Add => self.add(command),
            Kind::Remove => self.remove(command).map(|()| None),
            Kind::Undo => self.undo(command),
            Kind::Pause => {
                self.paused = true;
                self.void();
                Ok(Some("learning is paused".to_owned()))
            }
            Kind::Resume => {
                self.paused = false;
                Ok(Some("learning goes on".to_owned()))
            }
            Kind::Forget => {
                self.void();
                self.lookout.forget();
                self.store.clear();
                Ok(Some("what was seen so far is forgotten; the model stays until there is a new one".to_owned()))
            }
            Kind::Save | Kind::Hide => self.save(command).map(|()| None),
        }
    }

    /// Puts an effect on trial, in place of the one that is.
    fn add(&mut self, command: &Command) -> anyhow::Result<Option<String>> {
        let mut model = with_effect(command, &mut self.current, &self.facts)?;
        let is_this = |c: &Challenger| (c.command.effect, c.command.axis) == (command.effect, command.axis);
        if self.challenger.as_ref().is_some_and(is_this) {
            return Ok(Some(format!("{} is on trial already: not better so far, not in use", command.effect)));
        }
        let instead_of = self.end_trial();
        if let Some(found) = self.lookout.found(self.current.start()) {
            found.begin(&mut model);
        }
        self.challenger = Some(Challenger { command: *command, model, instead_of, since_ns: now_ns() });
        // The trial need not wait.
        self.void();
        self.solved_ns = 0;
        Ok(None)
    }

    fn remove(&mut self, command: &Command) -> anyhow::Result<()> {
        let model = without_effect(command, &self.current)?;
        let ended = self.end_trial();
        self.void();
        self.solved_ns = 0;
        let proposed = self.current.changed(model, self.current.samples, self.folder)?;
        self.keep(proposed, Then::Answer(command.id, format!("{} removed{}", command.effect, gives_up(ended))));
        Ok(())
    }

    /// Ends a trial, or brings back the model before the last change.
    fn undo(&mut self, command: &Command) -> anyhow::Result<Option<String>> {
        self.void();
        if let Some(effect) = self.end_trial() {
            return Ok(Some(format!("{effect} is not on trial any more")));
        }
        let proposed = self.current.undone(self.folder)?.context("nothing was changed: there is nothing to undo")?;
        self.keep(proposed, Then::Answer(command.id, "the model before the last change is back".to_owned()));
        Ok(None)
    }

    /// Has the model written to a file of the user's.
    fn save(&mut self, command: &Command) -> anyhow::Result<()> {
        let path = Path::new(command.argument.as_str());
        ensure!(path.is_absolute(), "'{}' is not an absolute path", command.argument);
        let is_pipe = fs::metadata(path).is_ok_and(|there| there.file_type().is_fifo());
        ensure!(!is_pipe, "{} is a pipe, which may keep a model waiting for ever: save to a file", path.display());
        let is_learned = self.current.start().axes.iter().any(Option::is_some);
        ensure!(is_learned, "nothing is learned yet: there is no model");
        let writing = self.current.saved_to(path, provenance(&self.facts, self.current.samples));
        let then = Then::Answer(command.id, format!("saved to {}", path.display()));
        self.keeper.ask(Keeping { writing, proposal: None, then });
        Ok(())
    }

    /// What changes the model waits until whoever asked for a trial before was told how it goes.
    fn waits_for_trial(&self) -> bool {
        let next = self.orders.front().and_then(|command| Kind::from_u32(command.kind));
        let untold = self.challenger.as_ref().is_some_and(|c| self.answers.of(c.command.id).is_none());
        untold && matches!(next, Some(Kind::Add | Kind::Remove))
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
