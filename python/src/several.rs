//! Several logs of one sensor.

use crate::{Answer, Log, Model, refused, watched::watched};
use gyro_model::{
    diagnose,
    diagnosis::{self, AxisResult},
};
use pyo3::prelude::*;
use std::sync::Arc;
use workbench::{
    model_file::ModelFile,
    report::{self, Command, Format},
    several::Several,
    subject::Subject,
};

/// Logs of one sensor that have been read.
#[pyclass(frozen, skip_from_py_object, module = "truerate._truerate")]
#[derive(Clone)]
pub(crate) struct Logs {
    several: Arc<Several>,
}

#[pymethods]
impl Logs {
    /// Logs under these names.
    #[new]
    fn new(logs: Vec<PyRef<'_, Log>>, names: Vec<String>) -> PyResult<Self> {
        let named = |(log, name): (&PyRef<'_, Log>, String)| {
            let mut subject = Subject::clone(&log.subject);
            if subject.name != name {
                subject.provenance.log.clone_from(&name);
                subject.name = name;
            }
            subject
        };
        let subjects = logs.iter().zip(names).map(named).collect();
        Several::of(subjects).map(|several| Self { several: Arc::new(several) }).map_err(refused)
    }

    #[pyo3(signature = (model=None))]
    fn fit(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, None, move |options| {
            let start = own.several.start_with(model.map(|model| model.file))?;
            let (joint, diagnosis) = own.several.fit_and_compare(&start.file.model, options)?;
            let file = own.several.fitted(joint.model, &start.file);
            Ok(own.answer(Command::Fit, Some(file), |format, context| report::render(&diagnosis, format, context)))
        })
    }

    #[pyo3(signature = (model=None))]
    fn compare(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, None, move |options| {
            let start = own.several.start_with(model.map(|model| model.file))?;
            let diagnosis = own.several.compare(&start, options)?;
            let file = start.given.then_some(start.file);
            Ok(own.answer(Command::Compare, file, |format, context| report::render(&diagnosis, format, context)))
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
        let own = self.clone();
        watched(py, progress, move |options| {
            let start = own.several.start_with(model.map(|model| model.file))?;
            let mut found = own.several.diagnose(&start, &diagnose::Options { explain, ..*options })?;
            own.of_one(&mut found.several, &mut found.axes);
            let file = start.given.then_some(start.file);
            let answer = own.answer(Command::Diagnose, file, |format, context| report::render(&found, format, context));
            Ok(answer.explained(&found.axes))
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
        let own = self.clone();
        watched(py, progress, move |options| {
            let start = own.several.start_with(model.map(|model| model.file))?;
            let (file, mut ladder) = own.several.ladder(&start, &diagnose::Options { explain, ..*options })?;
            own.of_one(&mut ladder.several, &mut ladder.axes);
            let answer =
                own.answer(Command::Ladder, Some(file), |format, context| report::render(&ladder, format, context));
            Ok(answer.explained(&ladder.axes))
        })
    }
}

impl Logs {
    /// One log does not tell what repeats.
    fn of_one(&self, several: &mut Option<diagnosis::Several>, axes: &mut [AxisResult]) {
        let names = self.several.names();
        let ([name], Some(several)) = (names.as_slice(), several) else { return };
        let says = format!("There is no log but {name}: whether it repeats is not known.");
        for own in &mut several.repeats {
            "unknown".clone_into(&mut own.of);
            own.p_differs = None;
            own.says.clone_from(&says);
        }
        for own in axes.iter_mut().filter(|own| !own.of_logs.is_empty()) {
            own.of_logs.clone_from(&says);
        }
    }

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
