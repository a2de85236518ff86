//! truerate for Python: logs and models as classes, results as the interface's JSON, which `truerate/__init__.py` turns into objects.
//!
//! Every function works on the very code that the program runs (`workbench::subject`), so that the numbers are the same to the last
//! bit. The interpreter's lock is released while it works, and Ctrl-C ends it.

mod evidence;
mod several;
mod watched;

use anyhow::Result;
use gyro_model::{
    Axis, diagnose,
    diagnosis::{AxisResult, DataFault},
    effects::{self, CATALOGUE},
    estimator::{self, Estimator},
    simulate::{self, Scenario, SensorSpec, SetUp},
    words::Voice,
};
use pyo3::{create_exception, exceptions::PyValueError, prelude::*, types::PyBytes};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};
use watched::watched;
use workbench::{
    change::Direction,
    estimates::{self, Unmeasured},
    export,
    log::{self, Options},
    model_file::{self, ModelFile},
    prior::{self, Prior},
    report::{self, Change, Command, Format, Terminal, view},
    sides::{self, Judged},
    subject::{Start, Subject, Taken},
    words,
};

create_exception!(
    truerate,
    Error,
    PyValueError,
    "A log, a model or an argument that cannot be used: what was found, where, and what to do about it."
);

fn refused(error: anyhow::Error) -> PyErr {
    Error::new_err(format!("{error:#}"))
}

fn axis_of(name: Option<&str>) -> PyResult<Option<Axis>> {
    name.map(|name| name.parse().map_err(|_| Error::new_err(format!("axis {name:?}: expected 'x', 'y' or 'z'"))))
        .transpose()
}

/// A result in all of its forms, and the model that belongs to it.
#[pyclass(frozen, module = "truerate._truerate")]
struct Answer {
    #[pyo3(get)]
    json: String,
    #[pyo3(get)]
    text: String,
    #[pyo3(get)]
    html: String,
    /// Why each effect was named or was not, in a sentence and test by test; empty where that was not asked for.
    #[pyo3(get)]
    explanations: (String, String),
    model: Option<ModelFile>,
}

impl Answer {
    /// A result in each of its forms, in the words of a library.
    fn of(
        context: report::Context,
        model: Option<ModelFile>,
        render: impl Fn(Format, &report::Context) -> String,
    ) -> Self {
        let context = report::Context { terminal: Terminal::PLAIN, voice: Voice::Library, ..context };
        let form = |format| render(format, &context);
        let explanations = Default::default();
        Self { json: form(Format::Json), text: form(Format::Text), html: form(Format::Html), explanations, model }
    }

    /// The same with the tests of each effect, where they were asked for.
    fn explained(self, axes: &[AxisResult]) -> Self {
        let of = |tests| report::explanation(axes, tests, Terminal::PLAIN);
        Self { explanations: (of(false), of(true)), ..self }
    }
}

#[pymethods]
impl Answer {
    #[new]
    #[pyo3(signature = (json, text, html, model, explanations=None))]
    fn new(
        json: String,
        text: String,
        html: String,
        model: Option<Model>,
        explanations: Option<(String, String)>,
    ) -> Self {
        Self { json, text, html, explanations: explanations.unwrap_or_default(), model: model.map(|own| own.file) }
    }

    #[getter]
    fn model(&self) -> Option<Model> {
        self.model.clone().map(|file| Model { file })
    }
}

/// A model: effects with parameters, axis by axis.
#[pyclass(frozen, from_py_object, module = "truerate._truerate")]
#[derive(Clone)]
struct Model {
    file: ModelFile,
}

#[pymethods]
impl Model {
    /// The text of the model file.
    fn text(&self) -> String {
        model_file::render(&self.file)
    }

    /// The model of such a text.
    #[staticmethod]
    fn of(text: &str) -> PyResult<Self> {
        let parsed = model_file::parse(Path::new("model"), text, &[]);
        parsed.map(|file| Self { file }).map_err(|error| refused(error.into()))
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        model_file::save(&path, &self.file).map_err(refused)
    }

    /// Axis letters, each with the ids of its effects and their parameters `(effect, name, value, unit)`.
    fn terms(&self) -> Vec<(String, String, String, f64, String)> {
        let axes =
            Axis::ALL.into_iter().filter_map(|axis| self.file.model.axes[axis.index()].as_ref().map(|own| (axis, own)));
        axes.flat_map(|(axis, own)| {
            own.terms.iter().flat_map(move |term| {
                let card = term.effect.card();
                term.effect.parameters(axis).iter().zip(&term.values).map(move |(parameter, value)| {
                    (axis.to_string(), card.id.to_owned(), parameter.name.to_owned(), *value, parameter.unit.to_owned())
                })
            })
        })
        .collect()
    }

    /// The text for a target, and what the target cannot hold.
    #[pyo3(signature = (format, name, rate=None, topic="/imu/data", sensor=1, chip=None))]
    fn export(
        &self,
        format: &str,
        name: &str,
        rate: Option<f64>,
        topic: &str,
        sensor: u8,
        chip: Option<&str>,
    ) -> PyResult<(String, Vec<String>)> {
        let chip = chip.map(str::parse).transpose().map_err(refused)?;
        let options = export::Options { rate, topic: topic.to_owned(), sensor, channels: Vec::new(), chip };
        let exported =
            format.parse().and_then(|target| export::export(&self.file, name, target, &options)).map_err(refused)?;
        Ok((exported.text, exported.warnings))
    }

    /// The estimates of a log: the names of the columns, the rows as little-endian doubles, one row after another, and what is said of
    /// rows that were left out or have no reading.
    fn apply<'py>(
        &self,
        py: Python<'py>,
        log: PathBuf,
        options: Reading,
    ) -> PyResult<(Vec<String>, Bound<'py, PyBytes>, Vec<String>)> {
        let own = self.clone();
        let (header, bytes, says) = watched(py, None, move |_| own.estimates(&log, options))?;
        Ok((header, PyBytes::new(py, &bytes), says))
    }
}

impl Model {
    fn estimates(&self, log: &Path, options: Reading) -> Result<(Vec<String>, Vec<u8>, Vec<String>)> {
        let options = Options { as_streamed: true, ..options.options() };
        let (record, faults, provenance) = log::read(log, &options)?;
        let model = &self.file.model;
        let axes: Vec<Axis> =
            Axis::ALL.into_iter().filter(|&a| record.has_gyro(a) && model.axes[a.index()].is_some()).collect();
        anyhow::ensure!(!axes.is_empty(), "{}: log and model have no axis in common", log.display());
        self.file.check_channels(&record, &axes)?;
        let mut estimator = Estimator::new(estimator::Options::default());
        estimator.set_model(model);
        let header = estimates::header(&axes);
        let mut bytes = Vec::with_capacity(record.len() * 8 * header.len());
        let mut unmeasured = Unmeasured::default();
        for row in &record.rows {
            let estimate = estimator.step(row);
            unmeasured.take(row.t_ns, &estimate, &axes);
            let t = (provenance.start_ns + i128::from(estimate.valid_t_ns)) as f64 * 1e-9;
            bytes.extend(std::iter::once(t).chain(estimates::values(&estimate, &axes)).flat_map(f64::to_le_bytes));
        }
        let concerned =
            |fault: &&DataFault| fault.kind.costs_rows() && fault.axis.is_none_or(|axis| axes.contains(&axis));
        let says = faults.iter().filter(concerned).map(view::fault).chain(unmeasured.says()).collect();
        Ok((header, bytes, says))
    }
}

/// How a log is read: the flags of the program under the same names.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Reading {
    map: Vec<String>,
    columns: Option<PathBuf>,
    reference: Option<PathBuf>,
    dbc: Option<PathBuf>,
}

impl Reading {
    fn options(self) -> Options {
        let Self { map, columns, reference, dbc } = self;
        Options { map, columns, reference, dbc, ..Options::default() }
    }
}

/// A log that has been read.
#[pyclass(frozen, skip_from_py_object, module = "truerate._truerate")]
#[derive(Clone)]
struct Log {
    subject: Arc<Subject>,
}

#[pymethods]
impl Log {
    #[new]
    #[pyo3(signature = (path, name, options, axis=None, at_rest=false, reference_is_dependent=false))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        name: String,
        options: Reading,
        axis: Option<&str>,
        at_rest: bool,
        reference_is_dependent: bool,
    ) -> PyResult<Self> {
        let taken = Taken { options: options.options(), axis: axis_of(axis)?, at_rest, reference_is_dependent };
        let mut subject = watched(py, None, move |_| Subject::read(&path, &taken))?;
        subject.provenance.log =
            Path::new(&name).file_name().map_or(name.clone(), |n| n.to_string_lossy().into_owned());
        subject.name = name;
        Ok(Self { subject: Arc::new(subject) })
    }

    #[getter]
    fn axes(&self) -> Vec<String> {
        self.subject.axes.iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.subject.name
    }

    /// Kind, count, first time (s) and sentence of every fault of the data.
    #[getter]
    fn faults(&self) -> Vec<(String, u64, Option<f64>, String)> {
        let tell = |f: &gyro_model::diagnosis::DataFault| (f.kind.to_string(), f.count, f.first_t, f.says.clone());
        self.subject.faults.iter().map(tell).collect()
    }

    #[getter]
    fn about(&self) -> Vec<String> {
        self.subject.about(None)
    }

    fn __len__(&self) -> usize {
        self.subject.record.len()
    }

    /// Times, s, as little-endian doubles, and each gyro axis, rad/s, with NaN where there is no reading.
    fn columns<'py>(&self, py: Python<'py>) -> Vec<(String, Bound<'py, PyBytes>)> {
        let bytes = |value: &dyn Fn(&gyro_model::Row) -> f64| -> Vec<u8> {
            self.subject.record.rows.iter().flat_map(|row| value(row).to_le_bytes()).collect()
        };
        let mut all = vec![("t".to_owned(), PyBytes::new(py, &bytes(&|row| row.t_ns as f64 * 1e-9)))];
        for axis in Axis::ALL.into_iter().filter(|&axis| self.subject.record.has_gyro(axis)) {
            all.push((format!("gyro_{axis}"), PyBytes::new(py, &bytes(&|row| row.gyro[axis.index()]))));
        }
        all
    }

    #[pyo3(signature = (model=None, prior=None))]
    fn fit(&self, py: Python<'_>, model: Option<Model>, prior: Option<OfType>) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, None, move |options| {
            let mut says = Vec::new();
            // Blocked refits would forget the type.
            let own_log = prior.is_none();
            let (fitted, of_log) = match (prior, model) {
                (Some(prior), _) => {
                    let begun = prior.read()?.begin(&own.subject)?;
                    says = begun.says;
                    (begun.start.file.model, Vec::new())
                }
                (None, Some(model)) => {
                    model.file.check_channels(&own.subject.record, &own.subject.axes)?;
                    (own.refitted(&model.file.model)?, model.file.own_effects)
                }
                (None, None) => (own.refitted(&own.subject.base())?, Vec::new()),
            };
            let options = diagnose::Options { own_log, faults: &own.subject.faults, ..*options };
            let mut diagnosis = own.subject.compare(&fitted, &own.subject.axes, &options)?;
            prior::say_beside(&mut diagnosis.axes, &says);
            let file = own.subject.fitted(fitted, of_log);
            Ok(own.answer(Command::Fit, Some(file), |format, context| report::render(&diagnosis, format, context)))
        })
    }

    /// A model with these effects more, and the one without.
    #[pyo3(signature = (effects, model=None))]
    fn add(&self, py: Python<'_>, effects: Vec<String>, model: Option<Model>) -> PyResult<Answer> {
        self.changed(py, effects, model, Direction::Add)
    }

    /// A model without these effects, and the one with them.
    #[pyo3(signature = (effects, model=None))]
    fn remove(&self, py: Python<'_>, effects: Vec<String>, model: Option<Model>) -> PyResult<Answer> {
        self.changed(py, effects, model, Direction::Remove)
    }

    #[pyo3(signature = (model=None))]
    fn compare(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, None, move |options| {
            let start = own.start(model)?;
            let mut subject = Subject::clone(&own.subject);
            subject.keep_axes_of(&start.file.model, "the model")?;
            let diagnosis = subject.judge(&start, &diagnose::Options { faults: &own.subject.faults, ..*options })?;
            let warning = Some(&start).filter(|start| start.given).and_then(|start| subject.hotter(&start.file));
            let warning = warning.unwrap_or_default();
            Ok(own.answer(Command::Compare, Some(start.file), |format, context| {
                report::render(&diagnosis, format, &report::Context { warning: warning.clone(), ..context.clone() })
            }))
        })
    }

    /// This log beside that of another sensor, each with its model; under these names.
    #[pyo3(signature = (other, names, model=None, against=None))]
    fn side_by_side(
        &self,
        py: Python<'_>,
        other: &Self,
        names: (String, String),
        model: Option<Model>,
        against: Option<Model>,
    ) -> PyResult<Answer> {
        let (one, two) = (self.clone(), other.clone());
        watched(py, None, move |options| {
            let judged = |own: &Self, model: Option<Model>| -> Result<Judged> {
                let start = own.start(model)?;
                let mut subject = Subject::clone(&own.subject);
                subject.keep_axes_of(&start.file.model, "the model")?;
                let options = diagnose::Options { faults: &own.subject.faults, ..*options };
                let diagnosis = subject.judge(&start, &options)?;
                Ok(Judged { subject, start, diagnosis })
            };
            let both = sides::beside([judged(&one, model)?, judged(&two, against)?], [names.0, names.1])?;
            let context = report::Context::new(Command::Compare, one.subject.name.clone());
            Ok(Answer::of(context, None, |format, context| report::render_sides(&both, format, context)))
        })
    }

    #[pyo3(signature = (model=None, explain=false, progress=None, prior=None))]
    fn diagnose(
        &self,
        py: Python<'_>,
        model: Option<Model>,
        explain: bool,
        progress: Option<Py<PyAny>>,
        prior: Option<OfType>,
    ) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, progress, move |options| {
            let options = diagnose::Options { explain, faults: &own.subject.faults, ..*options };
            let (start, says) = own.begin(model, prior)?;
            let mut found = own.subject.diagnose(&start, &options)?;
            prior::say_beside(&mut found.axes, &says);
            let answer = own
                .answer(Command::Diagnose, Some(start.file), |format, context| report::render(&found, format, context));
            Ok(answer.explained(&found.axes))
        })
    }

    #[pyo3(signature = (model=None, explain=false, progress=None, prior=None))]
    fn ladder(
        &self,
        py: Python<'_>,
        model: Option<Model>,
        explain: bool,
        progress: Option<Py<PyAny>>,
        prior: Option<OfType>,
    ) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, progress, move |options| {
            let options = diagnose::Options { explain, faults: &own.subject.faults, ..*options };
            let (start, says) = own.begin(model, prior)?;
            let (file, mut ladder) = own.subject.ladder(&start, &options)?;
            prior::say_beside(&mut ladder.axes, &says);
            let answer =
                own.answer(Command::Ladder, Some(file), |format, context| report::render(&ladder, format, context));
            Ok(answer.explained(&ladder.axes))
        })
    }
}

impl Log {
    /// A model with effects added or removed, beside the one without: both fitted to the log, as the program does.
    fn changed(
        &self,
        py: Python<'_>,
        effects: Vec<String>,
        model: Option<Model>,
        direction: Direction,
    ) -> PyResult<Answer> {
        let own = self.clone();
        watched(py, None, move |options| {
            let subject = &own.subject;
            let is_given = model.is_some();
            let start = own.start(model)?;
            let before = if is_given { subject.fit(&start.file.model)? } else { start.file.model.clone() };
            let mut after = subject.changed(&start.file, &before, &effects, direction)?;
            after.epoch = start.file.model.epoch + 1;
            let options = diagnose::Options { own_log: true, faults: &subject.faults, ..*options };
            let judged = |model| subject.compare(model, &subject.axes, &options);
            let (old, new) = (judged(&before)?, judged(&after)?);
            let effects = effects.as_slice();
            let (command, added, removed) = match direction {
                Direction::Add => (Command::Add, effects, &[][..]),
                Direction::Remove => (Command::Remove, &[][..], effects),
            };
            let change = Change { added, removed, before: &old, after: &new };
            let file = subject.fitted(after, start.file.own_effects);
            Ok(own.answer(command, Some(file), |format, context| report::render_change(&change, format, context)))
        })
    }

    fn start(&self, model: Option<Model>) -> Result<Start> {
        let Some(Model { file }) = model else { return self.subject.load(None) };
        file.check_channels(&self.subject.record, &self.subject.axes)?;
        Ok(self.subject.given(file))
    }

    /// The model to start from: that of a type, the one that is given, or the base model; and what was noticed.
    fn begin(&self, model: Option<Model>, prior: Option<OfType>) -> Result<(Start, Vec<(Axis, String)>)> {
        let Some(prior) = prior else { return Ok((self.start(model)?, Vec::new())) };
        let begun = prior.read()?.begin(&self.subject)?;
        Ok((begun.start, begun.says))
    }

    fn refitted(&self, start: &gyro_model::Model) -> Result<gyro_model::Model> {
        Ok(gyro_model::Model { epoch: start.epoch + 1, ..self.subject.fit(start)? })
    }

    fn answer(
        &self,
        command: Command,
        model: Option<ModelFile>,
        render: impl Fn(Format, &report::Context) -> String,
    ) -> Answer {
        let about = self.subject.about(None);
        Answer::of(report::Context { about, ..report::Context::new(command, self.subject.name.clone()) }, model, render)
    }
}

/// A type file: its name, and its text where there is no such file.
#[derive(FromPyObject)]
struct OfType(PathBuf, Option<String>);

impl OfType {
    fn read(&self) -> Result<Prior> {
        match self {
            Self(path, Some(text)) => Prior::parse(path, text, None),
            Self(path, None) => Prior::load(path),
        }
    }
}

/// Reads a model file.
#[pyfunction]
fn load(path: PathBuf) -> PyResult<Model> {
    model_file::load(&path, &[]).map(|file| Model { file }).map_err(refused)
}

/// Names and units of parameters.
type Parameters = Vec<(String, String)>;

/// The catalogue: id, equation, and names and units of the parameters.
#[pyfunction]
fn catalogue() -> Vec<(String, String, Parameters)> {
    let tell = |effect: &&'static dyn effects::Effect| {
        let card = effect.card();
        let parameters = effect.parameters(Axis::X).iter().map(|p| (p.name.to_owned(), p.unit.to_owned())).collect();
        (card.id.to_owned(), card.equation.to_owned(), parameters)
    };
    CATALOGUE.iter().map(tell).collect()
}

/// Writes a simulated log and gives its true model.
#[pyfunction]
#[pyo3(name = "simulate")]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
fn simulated(
    py: Python<'_>,
    path: PathBuf,
    hide: Vec<String>,
    motion: &str,
    seconds: f64,
    rate_hz: f64,
    seed: u64,
    axis: &str,
) -> PyResult<Model> {
    let axis = axis_of(Some(axis))?.unwrap_or(Axis::X);
    let motion = motion.parse().map_err(Error::new_err::<String>)?;
    let (hidden, random) = simulate::hidden(&hide, axis).map_err(Error::new_err::<String>)?;
    let scenario = Scenario { motion, seconds, rate_hz, seed, hidden, sensor: SensorSpec::on(axis) };
    let rows = scenario.rows().map_err(Error::new_err::<String>)?;
    watched(py, None, move |_| {
        let (record, model) = SetUp { random, ..SetUp::default() }.simulate(&scenario, rows, |_| ());
        log::write_record(&path, &record, 0)?;
        Ok(Model { file: ModelFile { model, ..ModelFile::default() } })
    })
}

#[pymodule]
fn _truerate(module: &Bound<'_, PyModule>) -> PyResult<()> {
    words::speak_as(Voice::Library);
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Log>()?;
    module.add_class::<Model>()?;
    module.add_class::<Answer>()?;
    module.add_class::<several::Logs>()?;
    module.add_class::<evidence::Evidence>()?;
    module.add_class::<evidence::Fleet>()?;
    module.add_function(wrap_pyfunction!(load, module)?)?;
    module.add_function(wrap_pyfunction!(catalogue, module)?)?;
    module.add_function(wrap_pyfunction!(simulated, module)?)
}
