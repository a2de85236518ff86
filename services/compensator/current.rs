//! The model in use: its epoch, its message, its file; changed whole or not at all.

use crate::{
    domain::write_whole,
    hopeless::Hopeless,
    model_file::{self, ModelFile, Provenance, render},
    run_folder::RunFolder,
    settings::Settings,
    wire,
};
use gyro_model::{
    Model,
    effects::{self, Effect},
};
use ipc_types::Parameters;
use std::{fs, path::Path};

/// The model in use.
#[derive(Debug)]
pub struct Current {
    model: Model,
    message: Parameters,
    /// The model that the run began with, which the last solution starts from.
    first: Model,
    /// A user's own effects.
    own: Vec<&'static dyn Effect>,
    /// The models before each change by command, the last one last.
    before: Vec<Model>,
    /// Rows that it was fitted on.
    pub samples: u64,
}

impl Current {
    /// The last model of this run, or the one that it was told to start from, or none: readings pass as they are.
    ///
    /// # Errors
    /// A model file that cannot be read; another attempt would be of no use.
    pub fn begin(settings: &Settings, folder: &RunFolder) -> anyhow::Result<Self> {
        let free_names = folder.source()?.free_names;
        let told = match &settings.model {
            Some(path) => model_file::load(path, &free_names).map_err(Hopeless::from_error)?,
            None => ModelFile::default(),
        };
        let of_this_run = |path: &Path| -> anyhow::Result<Option<ModelFile>> {
            path.exists().then(|| model_file::load(path, &free_names)).transpose()
        };
        let left = of_this_run(&folder.model())?.unwrap_or_else(|| told.clone());
        let before = of_this_run(&folder.model_before())?.map(|file| file.model).into_iter().collect();
        let message = wire::parameters_of(&left.model).map_err(Hopeless::from_error)?;
        let mut current =
            Self { model: left.model, message, first: told.model, own: told.own_effects, before, samples: 0 };
        left.own_effects.into_iter().for_each(|effect| current.know(effect));
        current.save(folder)?;
        Ok(current)
    }

    /// The model that the run began with.
    #[must_use]
    pub fn first(&self) -> &Model {
        &self.first
    }

    /// The effect of this id: of the catalogue, or one of the model's own.
    #[must_use]
    pub fn effect(&self, id: &str) -> Option<&'static dyn Effect> {
        let own = self.own.iter().copied().find(|effect| effect.card().id == id);
        own.or_else(|| effects::find(id))
    }

    /// Makes another effect known, for [`Self::effect`] and for the files that are saved.
    pub fn know(&mut self, effect: &'static dyn Effect) {
        if !self.own.iter().any(|known| known.card().id == effect.card().id) {
            self.own.push(effect);
        }
    }

    /// Writes the model for good, whole or not at all.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn save_to(&self, path: &Path, provenance: Provenance) -> anyhow::Result<()> {
        model_file::save(
            path,
            &ModelFile { model: self.model.clone(), provenance: Some(provenance), own_effects: self.own.clone() },
        )
    }

    /// Takes a changed model as the next epoch; [`Self::undo`] brings the present one back.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn change(&mut self, model: Model, folder: &RunFolder) -> anyhow::Result<()> {
        let before = self.model.clone();
        // First, so that a crash between the two leaves nothing that cannot be undone.
        write_whole(&folder.model_before(), render(&self.file(before.clone())).as_bytes())?;
        self.take(model, folder)?;
        self.before.push(before);
        Ok(())
    }

    /// Brings back the model before the last change, as the next epoch; false where there is none.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn undo(&mut self, folder: &RunFolder) -> anyhow::Result<bool> {
        let Some(model) = self.before.pop() else { return Ok(false) };
        self.take(model, folder)?;
        let _ = fs::remove_file(folder.model_before());
        Ok(true)
    }

    fn file(&self, model: Model) -> ModelFile {
        ModelFile { model, provenance: None, own_effects: self.own.clone() }
    }

    /// The model's epoch.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.model.epoch
    }

    /// The model as a message, without stamps.
    #[must_use]
    pub fn message(&self) -> &Parameters {
        &self.message
    }

    /// Where the next solution starts.
    #[must_use]
    pub fn start(&self) -> &Model {
        &self.model
    }

    /// Where the solution over the whole run starts: where it does offline, as long as the effects are the same.
    #[must_use]
    pub fn start_of_last(&self) -> &Model {
        let effects = |model: &Model| model.axes.each_ref().map(|a| a.as_ref().map(gyro_model::AxisModel::effect_ids));
        let base_only = self.first.axes.iter().all(Option::is_none)
            && self.model.axes.iter().flatten().all(|a| a.effect_ids() == ["scale-factor", "bias"]);
        if base_only || effects(&self.first) == effects(&self.model) { &self.first } else { &self.model }
    }

    /// Takes a solution as the next epoch: in the file first, so that a crash cannot lose what was given.
    ///
    /// # Errors
    /// Where the file cannot be written, or the model has no room in a message: nothing has changed then.
    pub fn take(&mut self, model: Model, folder: &RunFolder) -> anyhow::Result<()> {
        let model = Model { epoch: self.model.epoch + 1, ..model };
        let message = wire::parameters_of(&model)?;
        folder.set_model(&self.file(model.clone()))?;
        (self.model, self.message) = (model, message);
        Ok(())
    }

    fn save(&self, folder: &RunFolder) -> anyhow::Result<()> {
        folder.set_model(&self.file(self.model.clone()))
    }
}
