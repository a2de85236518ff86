//! The model in use: its epoch, its message, its file; changed whole or not at all.

use super::writing::Writing;
use crate::{hopeless::Hopeless, run_folder::RunFolder, settings::Settings, wire};
use gyro_model::{
    Model,
    effects::{self, Effect},
};
use ipc_types::Parameters;
use std::path::Path;
use workbench::{
    model_file::{self, ModelFile, Provenance, refuse_unseen, render},
    output::For,
    prior::Prior,
};

/// The next model, before its file is written.
#[derive(Debug)]
pub struct Proposal {
    model: Model,
    message: Parameters,
    samples: u64,
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Solution,
    Change,
    Undo,
}

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
    /// Whether an earlier life of this process learned it, and this one nothing yet.
    inherited: bool,
    /// Rows that it was fitted on.
    pub samples: u64,
}

/// A part of the type that was told before anything was read of it; no model without one.
fn of_type(settings: &Settings) -> anyhow::Result<Model> {
    let Some(path) = &settings.prior else { return Ok(Model::default()) };
    let prior = Prior::load(path).map_err(Hopeless::from_error)?;
    Ok(Model { epoch: 1, ..prior.model() })
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
            None => ModelFile { model: of_type(settings)?, ..ModelFile::default() },
        };
        let of_this_run = |path: &Path| -> anyhow::Result<Option<ModelFile>> {
            path.exists().then(|| model_file::load(path, &free_names)).transpose()
        };
        let left = of_this_run(&folder.model())?;
        let inherited = left.is_some();
        let left = left.unwrap_or_else(|| told.clone());
        let before = of_this_run(&folder.model_before())?.map(|file| file.model).into_iter().collect();
        let message = wire::parameters_of(&left.model).map_err(Hopeless::from_error)?;
        let (first, own) = (told.model, told.own_effects);
        let mut current = Self { model: left.model, message, first, own, before, inherited, samples: 0 };
        left.own_effects.into_iter().for_each(|effect| current.know(effect));
        if let Err(error) = current.save(folder) {
            tracing::error!("{error:#}: going on without");
        }
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

    /// The file that holds the model for good.
    #[must_use]
    pub fn saved_to(&self, path: &Path, provenance: Provenance) -> Writing {
        let file = ModelFile { model: self.model.clone(), provenance: Some(provenance), own_effects: self.own.clone() };
        Writing { files: vec![(path.to_owned(), render(&file))], for_whom: For::User, spent: None }
    }

    /// A solution as the next epoch, on so many rows.
    ///
    /// # Errors
    /// Where the model has no room in a message.
    pub fn solved(&self, model: Model, samples: u64, folder: &RunFolder) -> anyhow::Result<(Writing, Proposal)> {
        self.proposed(model, samples, What::Solution, folder)
    }

    /// A changed model as the next epoch; [`Self::undone`] brings the present one back.
    ///
    /// # Errors
    /// As [`Self::solved`].
    pub fn changed(&self, model: Model, samples: u64, folder: &RunFolder) -> anyhow::Result<(Writing, Proposal)> {
        let (mut writing, proposal) = self.proposed(model, samples, What::Change, folder)?;
        // First, so that a crash between the two leaves nothing that cannot be undone.
        writing.files.insert(0, (folder.model_before(), render(&self.file(self.model.clone()))));
        Ok((writing, proposal))
    }

    /// The model before the last change as the next epoch; `None` where there is none.
    ///
    /// # Errors
    /// As [`Self::solved`].
    pub fn undone(&self, folder: &RunFolder) -> anyhow::Result<Option<(Writing, Proposal)>> {
        let Some(model) = self.before.last() else { return Ok(None) };
        let (mut writing, proposal) = self.proposed(model.clone(), self.samples, What::Undo, folder)?;
        writing.spent = Some(folder.model_before());
        Ok(Some((writing, proposal)))
    }

    fn proposed(
        &self,
        model: Model,
        samples: u64,
        what: What,
        folder: &RunFolder,
    ) -> anyhow::Result<(Writing, Proposal)> {
        refuse_unseen(&model)?;
        let model = Model { epoch: self.model.epoch + 1, ..model };
        let message = wire::parameters_of(&model)?;
        let files = vec![(folder.model(), render(&self.file(model.clone())))];
        Ok((Writing { files, for_whom: For::Run, spent: None }, Proposal { model, message, samples, what }))
    }

    /// Takes what was proposed: its files are there.
    pub fn adopt(&mut self, proposal: Proposal) {
        let before = std::mem::replace(&mut self.model, proposal.model);
        match proposal.what {
            What::Solution => self.inherited = false,
            What::Change => self.before.push(before),
            What::Undo => {
                self.before.pop();
            }
        }
        (self.message, self.samples) = (proposal.message, proposal.samples);
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

    /// Whether an earlier life of this process learned the model, and this one nothing yet.
    #[must_use]
    pub fn is_inherited(&self) -> bool {
        self.inherited
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

    fn save(&self, folder: &RunFolder) -> anyhow::Result<()> {
        folder.set_model(&self.file(self.model.clone()))
    }
}
