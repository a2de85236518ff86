//! Several logs of one sensor.

use crate::{Answer, Log, Model, refused, watched::watched};
use gyro_model::diagnose;
use pyo3::prelude::*;
use workbench::{
    model_file::ModelFile,
    report::{self, Command, Format},
    several::Several,
};

/// Logs of one sensor that have been read.
#[pyclass(frozen, module = "truerate._truerate")]
pub(crate) struct Logs {
    several: Several,
}

#[pymethods]
impl Logs {
    #[new]
    fn new(logs: Vec<PyRef<'_, Log>>) -> PyResult<Self> {
        let subjects = logs.iter().map(|log| log.subject.clone()).collect();
        Several::of(subjects).map(|several| Self { several }).map_err(refused)
    }

    #[pyo3(signature = (model=None))]
    fn fit(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        watched(py, None, |options| {
            let start = self.several.start_with(model.map(|own| own.file))?;
            let (joint, diagnosis) = self.several.fit_and_compare(&start.file.model, options)?;
            let file = self.several.fitted(joint.model, &start.file);
            Ok(self.answer(Command::Fit, Some(file), |format, context| report::render(&diagnosis, format, context)))
        })
    }

    #[pyo3(signature = (model=None))]
    fn compare(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        watched(py, None, |options| {
            let start = self.several.start_with(model.map(|own| own.file))?;
            let diagnosis = self.several.compare(&start, options)?;
            let file = start.given.then_some(start.file);
            Ok(self.answer(Command::Compare, file, |format, context| report::render(&diagnosis, format, context)))
        })
    }

    #[pyo3(signature = (model=None, explain=false, progress=None))]
    fn diagnose(
        &self,
        py: Python<'_>,
        model: Option<Model>,
        explain: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer> {
        watched(py, progress, |options| {
            let start = self.several.start_with(model.map(|own| own.file))?;
            let found = self.several.diagnose(&start, &diagnose::Options { explain, ..*options })?;
            let file = start.given.then_some(start.file);
            Ok(self.answer(Command::Diagnose, file, |format, context| report::render(&found, format, context)))
        })
    }

    #[pyo3(signature = (model=None, explain=false, progress=None))]
    fn ladder(
        &self,
        py: Python<'_>,
        model: Option<Model>,
        explain: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer> {
        watched(py, progress, |options| {
            let start = self.several.start_with(model.map(|own| own.file))?;
            let (file, ladder) = self.several.ladder(&start, &diagnose::Options { explain, ..*options })?;
            Ok(self
                .answer(Command::Ladder, Some(file), |format, context| report::render_ladder(&ladder, format, context)))
        })
    }
}

impl Logs {
    fn answer(
        &self,
        command: Command,
        model: Option<ModelFile>,
        render: impl Fn(Format, &report::Context) -> String,
    ) -> Answer {
        let names = self.several.names();
        let context = report::Context {
            more: names[1..].to_vec(),
            about: self.several.about(None),
            ..report::Context::new(command, names[0].clone())
        };
        Answer::of(context, model, render)
    }
}
