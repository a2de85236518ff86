//! The model in use: its epoch, its message, its file; changed whole or not at all.

use crate::{
    hopeless::Hopeless,
    model_file::{self, ModelFile},
    run_folder::RunFolder,
    settings::Settings,
    wire,
};
use gyro_model::Model;
use ipc_types::Parameters;

/// The model in use.
#[derive(Debug)]
pub struct Current {
    model: Model,
    message: Parameters,
    /// The model that the run began with, which the last solution starts from.
    first: Model,
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
        let first = match &settings.model {
            Some(path) => model_file::load(path, &free_names).map_err(Hopeless::from_error)?.model,
            None => Model::default(),
        };
        let left = folder.model();
        let model = if left.exists() { model_file::load(&left, &free_names)?.model } else { first.clone() };
        let message = wire::parameters_of(&model).map_err(Hopeless::from_error)?;
        let current = Self { model, message, first, samples: 0 };
        current.save(folder)?;
        Ok(current)
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
        let next = Self {
            model: Model { epoch: self.model.epoch + 1, ..model },
            message: Parameters::default(),
            first: self.first.clone(),
            samples: self.samples,
        };
        let message = wire::parameters_of(&next.model)?;
        next.save(folder)?;
        *self = Self { message, ..next };
        Ok(())
    }

    fn save(&self, folder: &RunFolder) -> anyhow::Result<()> {
        folder.set_model(&ModelFile { model: self.model.clone(), ..ModelFile::default() })
    }
}
