//! Model files: TOML, schema `truerate.model/1`, written whole or not at all.
//!
//! Reading is strict: a newer schema, an unknown effect, parameter or key, a missing parameter is an error that names it,
//! with line and caret. What is read and written again is the same model to the last bit.

mod read;
#[cfg(test)]
mod tests;
mod write;

use crate::{
    clock, files, log, output,
    toml_error::{TomlError, quoted},
    words::{Task, call},
};
use anyhow::{Context, Result, bail};
use gyro_model::{
    Axis, Model, Record,
    effects::{Effect, Need, meant},
};
use jiff::Timestamp;
use std::path::Path;

/// The schema that is written, and the newest that is read.
pub const SCHEMA: &str = "truerate.model/1";

/// A model with what is known of its origin.
#[derive(Clone, Debug, Default)]
pub struct ModelFile {
    /// The model.
    pub model: Model,
    /// What it was fitted on.
    pub provenance: Option<Provenance>,
    /// The user's own effects that the file defines, whether an axis has them or not.
    pub own_effects: Vec<&'static dyn Effect>,
}

impl ModelFile {
    /// The effect of this id: one of the user's own, or of the catalogue.
    ///
    /// # Errors
    /// There is none; the nearest is suggested.
    pub fn effect(&self, id: &str) -> Result<&'static dyn Effect> {
        let own = self.own_effects.iter().copied().find(|e| e.card().id == id);
        own.or_else(|| gyro_model::effects::find(id)).with_context(|| {
            format!("no effect {}{}; {} lists them all", quoted(id), meant(id), call(Task::Effects, ""))
        })
    }

    /// Checks that a log has what the effects on these axes go by: without it they would stand still, unsaid. What the reference
    /// does to an angle counts only where there is one.
    ///
    /// # Errors
    /// A channel that is not there.
    pub fn check_channels(&self, record: &Record, axes: &[Axis]) -> Result<()> {
        for &axis in axes {
            for term in self.model.axes[axis.index()].iter().flat_map(|own| &own.terms) {
                let card = term.effect.card();
                let missing = |need: &&Need| **need != Need::AngleReference && !need.is_in(record, axis);
                if let Some(need) = card.needs.iter().find(missing) {
                    bail!(
                        "the model's '{id}' of axis {axis} needs {need}, which the log does not have: record it, or take the \
                         effect out with {remove}",
                        id = card.id,
                        remove = call(Task::Remove, &format!("LOG {} --model M -o NEW", card.id)),
                    );
                }
            }
        }
        Ok(())
    }
}

/// What a model was fitted on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// The log's name.
    pub log: Option<String>,
    /// SHA-256 of the log as stored.
    pub sha256: Option<String>,
    /// When it was fitted.
    pub fitted: Option<Timestamp>,
    /// Rows that were used.
    pub samples: Option<u64>,
    /// Lowest and highest temperature in them, °C.
    pub temperature: Option<(f64, f64)>,
}

impl Provenance {
    /// Fitted now, on this log.
    #[must_use]
    pub fn now(log: &log::Provenance) -> Self {
        Self {
            log: Some(log.log.clone()),
            sha256: Some(log.sha256.clone()),
            fitted: clock::now(),
            samples: Some(log.samples),
            temperature: log.temperature,
        }
    }

    /// Whether this is the very log that the model was fitted on.
    #[must_use]
    pub fn names(&self, log: &log::Provenance) -> bool {
        self.sha256.as_deref().is_some_and(|hash| hash.eq_ignore_ascii_case(&log.sha256))
    }
}

/// Reads a model file; `free_names` are the log's free channels, which the user's own effects may use.
///
/// # Errors
/// It cannot be read, or it is not a valid model: [`TomlError`] in the chain.
pub fn load(path: &Path, free_names: &[String]) -> Result<ModelFile> {
    let text = files::read_to_string(path).with_context(|| {
        format!("model {}: cannot be read: check the path, or make one with {}", path.display(), call(Task::Fit, ""))
    })?;
    Ok(parse(path, &text, free_names)?)
}

/// Understands a model file's text; `path` is only named in errors, `free_names` as in [`load`].
///
/// # Errors
/// What is wrong, with line and caret.
pub fn parse(path: &Path, text: &str, free_names: &[String]) -> Result<ModelFile, TomlError> {
    read::parse(path, text, free_names)
}

/// The text of a model file.
#[must_use]
pub fn render(file: &ModelFile) -> String {
    write::render(file)
}

/// What cannot be read again is not written.
///
/// # Errors
/// An effect without a finite parameter.
pub fn refuse_unseen(model: &Model) -> Result<()> {
    match model.unseen() {
        Some((axis, id)) => bail!("nothing is seen of '{id}' on axis {axis}: a model with it cannot be used"),
        None => Ok(()),
    }
}

/// Writes a model file, whole or not at all.
///
/// # Errors
/// A parameter that is no number; the folder is missing or read-only, or the disk is full. What stood there before is then
/// unchanged.
pub fn save(path: &Path, file: &ModelFile) -> Result<()> {
    refuse_unseen(&file.model)?;
    output::write(path, render(file).as_bytes())
}
