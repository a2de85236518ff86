//! A model with effects added to it, or removed from it, refitted.

use crate::{model_file::ModelFile, subject::Subject, words};
use anyhow::{Result, bail};
use gyro_model::{Axis, AxisModel, Model, Term, effects::Stage, words::labels};

/// In which direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Effects are added.
    Add,
    /// Effects are removed.
    Remove,
}

impl Subject {
    /// `before` with these effects of `file` or of the catalogue added or removed on the axes that are meant, fitted to the log.
    ///
    /// # Errors
    /// An effect that is not known, that the log has no channel for, or that is there (or not) already; a log that cannot be fitted,
    /// or that shows nothing of it.
    pub fn changed(&self, file: &ModelFile, before: &Model, effects: &[String], direction: Direction) -> Result<Model> {
        self.changed_on(&self.axes, file, before, effects, direction)
    }

    /// The same on some of these axes; all are fitted.
    ///
    /// # Errors
    /// As [`Self::changed`].
    pub fn changed_on(
        &self,
        axes: &[Axis],
        file: &ModelFile,
        before: &Model,
        effects: &[String],
        direction: Direction,
    ) -> Result<Model> {
        let mut changed = before.clone();
        for id in effects {
            let effect = file.effect(id)?;
            let id = effect.card().id;
            if direction == Direction::Remove && effect.stage() == Stage::Calibration {
                bail!("'{id}' belongs to the base model: it stays");
            }
            let mut touched = false;
            for &axis in axes {
                if direction == Direction::Add
                    && let Some(need) = effect.card().needs.iter().find(|need| !need.is_in(&self.record, axis))
                {
                    bail!("{}: '{id}' needs {need}, which the log does not have", self.name);
                }
                let model = changed.axes[axis.index()].get_or_insert_with(|| AxisModel::base(axis));
                let has = model.term(id).is_some();
                match direction {
                    Direction::Add if !has => model.terms.push(Term::neutral(effect, axis)),
                    Direction::Remove if has => model.terms.retain(|term| term.effect.card().id != id),
                    Direction::Add | Direction::Remove => continue,
                }
                touched = true;
            }
            if !touched {
                bail!("{}", untouched(id, direction, &changed, axes));
            }
        }
        let after = self.fit(&changed)?;
        if let Some((axis, id)) = after.unseen() {
            bail!("{}: {}", self.name, labels::no_shape(id, axis, words::voice()));
        }
        Ok(after)
    }
}

fn untouched(id: &str, direction: Direction, model: &Model, axes: &[Axis]) -> String {
    let letters: Vec<&str> = axes.iter().map(|a| a.letter()).collect();
    let has: Vec<&str> =
        axes.iter().filter_map(|a| model.axes[a.index()].as_ref()).flat_map(AxisModel::effect_ids).collect();
    let (letters, has) = (letters.join(", "), has.join(", "));
    match direction {
        Direction::Add => format!("the model of axis {letters} has '{id}' already: nothing to add"),
        Direction::Remove => format!("the model of axis {letters} has no '{id}', it has {has}: nothing to remove"),
    }
}
