//! truerate for Python: logs and models as classes, results as the interface's JSON, which `truerate/__init__.py` turns into objects.
//!
//! Every function works on the very code that the program runs (`workbench::subject`), so that the numbers are the same to the last
//! bit. The interpreter's lock is released while it works. Every half second it is asked for signals, so that Ctrl-C ends a search.

use anyhow::Result;
use gyro_model::{
    Axis, diagnose,
    effects::{self, CATALOGUE},
    estimator::{self, Estimator},
    simulate::{Hidden, RandomCauses, Scenario, SensorSpec, SetUp, Simulator},
    words::Voice,
};
use pyo3::{
    create_exception,
    exceptions::{PyKeyboardInterrupt, PyValueError},
    prelude::*,
    types::PyBytes,
};
use std::{
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};
use workbench::{
    export,
    log::{self, Options},
    model_file::{self, ModelFile},
    report::{self, Command, Format, Terminal},
    subject::{Start, Subject, Taken},
};

create_exception!(
    _truerate,
    Error,
    PyValueError,
    "A log, a model or an argument that cannot be used: what was found, where, and what to do about it."
);

/// How often the interpreter is asked whether somebody wants an end.
const ASKED: Duration = Duration::from_millis(100);

fn refused(error: anyhow::Error) -> PyErr {
    Error::new_err(format!("{error:#}"))
}

fn axis_of(name: Option<&str>) -> PyResult<Option<Axis>> {
    name.map(|name| name.parse().map_err(|_| Error::new_err(format!("axis {name:?}: expected 'x', 'y' or 'z'"))))
        .transpose()
}

/// What is going on: told to Python, which may want an end.
struct Watched {
    progress: Option<Py<PyAny>>,
    last: Mutex<Instant>,
    stopped: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Watched {
    fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { progress, last: Mutex::new(Instant::now()), stopped: AtomicBool::new(false), raised: Mutex::new(None) }
    }

    fn fails(&self, error: PyErr) {
        self.stopped.store(true, Ordering::Relaxed);
        if let Ok(mut raised) = self.raised.lock() {
            raised.get_or_insert(error);
        }
    }

    fn says(&self, what: &str) {
        if let Some(progress) = &self.progress
            && let Err(error) = Python::attach(|py| progress.call1(py, (what,)).map(drop))
        {
            self.fails(error);
        }
    }

    fn is_over(&self) -> bool {
        // Another thread is asking already.
        if let Ok(mut last) = self.last.try_lock()
            && last.elapsed() >= ASKED
        {
            *last = Instant::now();
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                self.fails(error);
            }
        }
        self.stopped.load(Ordering::Relaxed)
    }

    /// The result, or what ended the work.
    fn done<T>(self, result: Result<T>) -> PyResult<T> {
        match self.raised.into_inner() {
            Ok(Some(error)) => Err(error),
            Ok(None) if self.stopped.load(Ordering::Relaxed) => Err(PyKeyboardInterrupt::new_err(())),
            _ => result.map_err(refused),
        }
    }
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
    model: Option<ModelFile>,
}

#[pymethods]
impl Answer {
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
    #[pyo3(signature = (format, name, rate=None, topic="/imu/data", sensor=1))]
    fn export(
        &self,
        format: &str,
        name: &str,
        rate: Option<f64>,
        topic: &str,
        sensor: u8,
    ) -> PyResult<(String, Vec<String>)> {
        let options = export::Options { rate, topic: topic.to_owned(), sensor, channels: Vec::new() };
        let exported =
            format.parse().and_then(|target| export::export(&self.file, name, target, &options)).map_err(refused)?;
        Ok((exported.text, exported.warnings))
    }

    /// The estimates of a log: axis letters, and one row after another as little-endian doubles: t, then rate, filtered rate, its
    /// standard deviation, angle and fused angle of each axis.
    fn apply<'py>(
        &self,
        py: Python<'py>,
        log: PathBuf,
        options: Reading,
    ) -> PyResult<(Vec<String>, Bound<'py, PyBytes>)> {
        let (axes, bytes) = py.detach(|| self.estimates(&log, options)).map_err(refused)?;
        Ok((axes, PyBytes::new(py, &bytes)))
    }
}

impl Model {
    fn estimates(&self, log: &Path, options: Reading) -> Result<(Vec<String>, Vec<u8>)> {
        let options = Options { as_streamed: true, ..options.options() };
        let (record, _, provenance) = log::read(log, &options)?;
        let model = &self.file.model;
        let axes: Vec<Axis> =
            Axis::ALL.into_iter().filter(|&a| record.has_gyro(a) && model.axes[a.index()].is_some()).collect();
        anyhow::ensure!(!axes.is_empty(), "{}: log and model have no axis in common", log.display());
        self.file.check_channels(&record, &axes)?;
        let mut estimator = Estimator::new(estimator::Options::default());
        estimator.set_model(model);
        let mut bytes = Vec::with_capacity(record.len() * 8 * (1 + 5 * axes.len()));
        for row in &record.rows {
            let estimate = estimator.step(row);
            let t = (provenance.start_ns + i128::from(estimate.valid_t_ns)) as f64 * 1e-9;
            bytes.extend(t.to_le_bytes());
            for axis in &axes {
                let e = &estimate.axes[axis.index()];
                for value in [e.rate, e.rate_filtered, e.rate_std, e.angle, e.angle_fused] {
                    bytes.extend(value.to_le_bytes());
                }
            }
        }
        Ok((axes.iter().map(ToString::to_string).collect(), bytes))
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
        Options { map, columns, reference, dbc, voice: Voice::Library, ..Options::default() }
    }
}

/// A log that has been read.
#[pyclass(frozen, module = "truerate._truerate")]
struct Log {
    subject: Subject,
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
        let mut subject = py.detach(|| Subject::read(&path, &taken)).map_err(refused)?;
        subject.provenance.log =
            Path::new(&name).file_name().map_or(name.clone(), |n| n.to_string_lossy().into_owned());
        subject.name = name;
        Ok(Self { subject })
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

    #[pyo3(signature = (model=None))]
    fn fit(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        py.detach(|| {
            let (start, own) = match model {
                Some(model) => {
                    model.file.check_channels(&self.subject.record, &self.subject.axes)?;
                    (model.file.model, model.file.own_effects)
                }
                None => (self.subject.base(), Vec::new()),
            };
            let mut fitted = self.subject.fit(&start)?;
            fitted.epoch = start.epoch + 1;
            let options =
                diagnose::Options { own_log: true, faults: &self.subject.faults, ..diagnose::Options::default() };
            let diagnosis = self.subject.compare(&fitted, &self.subject.axes, &options)?;
            let file = self.subject.fitted(fitted, own);
            Ok(self.answer(Command::Fit, Some(file), |format, context| report::render(&diagnosis, format, context)))
        })
        .map_err(refused)
    }

    #[pyo3(signature = (model=None))]
    fn compare(&self, py: Python<'_>, model: Option<Model>) -> PyResult<Answer> {
        py.detach(|| {
            let start = self.start(model)?;
            let mut subject = self.subject.clone();
            subject.keep_axes_of(&start.file.model, "the model")?;
            let options =
                diagnose::Options { own_log: start.own_log, faults: &subject.faults, ..diagnose::Options::default() };
            let diagnosis = subject.compare(&start.file.model, &subject.axes, &options)?;
            Ok(self.answer(Command::Compare, Some(start.file), |format, context| {
                report::render(&diagnosis, format, context)
            }))
        })
        .map_err(refused)
    }

    #[pyo3(signature = (model=None, explain=false, progress=None))]
    fn diagnose(
        &self,
        py: Python<'_>,
        model: Option<Model>,
        explain: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer> {
        self.search(py, model, explain, progress, |start, options| {
            let diagnosis = self.subject.diagnose(&start, options)?;
            Ok(self.answer(Command::Diagnose, Some(start.file), |format, context| {
                report::render(&diagnosis, format, context)
            }))
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
        self.search(py, model, explain, progress, |start, options| {
            let (file, ladder) = self.subject.ladder(&start, options)?;
            Ok(self
                .answer(Command::Ladder, Some(file), |format, context| report::render_ladder(&ladder, format, context)))
        })
    }
}

impl Log {
    fn start(&self, model: Option<Model>) -> Result<Start> {
        let Some(Model { file }) = model else { return self.subject.load(None) };
        file.check_channels(&self.subject.record, &self.subject.axes)?;
        let own_log = file.provenance.as_ref().is_some_and(|p| p.names(&self.subject.provenance));
        Ok(Start { file, own_log })
    }

    fn search(
        &self,
        py: Python<'_>,
        model: Option<Model>,
        explain: bool,
        progress: Option<Py<PyAny>>,
        work: impl FnOnce(Start, &diagnose::Options) -> Result<Answer> + Send,
    ) -> PyResult<Answer> {
        let watched = Watched::new(progress);
        let result = py.detach(|| {
            let (says, stop) = (|what: &str| watched.says(what), || watched.is_over());
            let options = diagnose::Options {
                progress: &says,
                stop: &stop,
                faults: &self.subject.faults,
                explain,
                ..diagnose::Options::default()
            };
            work(self.start(model)?, &options)
        });
        watched.done(result)
    }

    fn answer(
        &self,
        command: Command,
        model: Option<ModelFile>,
        render: impl Fn(Format, &report::Context) -> String,
    ) -> Answer {
        let context = report::Context {
            terminal: Terminal::PLAIN,
            voice: Voice::Library,
            about: self.subject.about(None),
            ..report::Context::new(command, self.subject.name.clone())
        };
        let form = |format| render(format, &context);
        Answer { json: form(Format::Json), text: form(Format::Text), html: form(Format::Html), model }
    }
}

/// Reads a model file.
#[pyfunction]
fn load(path: PathBuf) -> PyResult<Model> {
    model_file::load(&path, &[]).map(|file| Model { file }).map_err(refused)
}

/// Ids of the catalogue, each with its name, equation and whether it is of the reference.
#[pyfunction]
fn catalogue() -> Vec<(String, String, Vec<(String, String)>)> {
    let tell = |effect: &&'static dyn effects::Effect| {
        let card = effect.card();
        let parameters = effect.parameters(Axis::X).iter().map(|p| (p.name.to_owned(), p.unit.to_owned())).collect();
        (card.id.to_owned(), card.equation.to_owned(), parameters)
    };
    CATALOGUE.iter().map(tell).collect()
}

/// Writes a simulated log and gives its true model.
#[pyfunction]
#[pyo3(signature = (path, hide, motion, seconds, rate_hz, seed, axis))]
fn simulate(
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
    let motion = motion.parse().map_err(|error| Error::new_err(format!("motion {motion:?}: {error}")))?;
    py.detach(|| {
        let rows = (seconds * rate_hz).round();
        anyhow::ensure!(
            (1.0..=5e7).contains(&rows),
            "{seconds} s at {rate_hz} Hz are {rows} rows: choose 1 to 50 million"
        );
        let mut set_up = SetUp::default();
        set_up.random = RandomCauses::default();
        let mut hidden = Vec::new();
        for text in &hide {
            match set_up.random.take(text) {
                Some(taken) => taken.map_err(|wrong| anyhow::anyhow!(wrong))?,
                None => hidden.push(Hidden::parse(text, axis)?),
            }
        }
        let scenario = Scenario { motion, seconds, rate_hz, seed, hidden, sensor: SensorSpec::on(axis) };
        let mut simulator = Simulator::new(&scenario);
        let samples: Vec<_> = (0..rows as usize).map(|_| simulator.step()).collect();
        let mut record = gyro_model::Record::default();
        record.rows = if set_up.is_plain() {
            samples.into_iter().map(|sample| sample.row).collect()
        } else {
            set_up.applied(&samples, axis, rate_hz, seed)
        };
        log::write_record(&path, &record, 0)?;
        Ok(Model { file: ModelFile { model: simulator.truth(), ..ModelFile::default() } })
    })
    .map_err(refused)
}

#[pymodule]
fn _truerate(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Log>()?;
    module.add_class::<Model>()?;
    module.add_class::<Answer>()?;
    module.add_function(wrap_pyfunction!(load, module)?)?;
    module.add_function(wrap_pyfunction!(catalogue, module)?)?;
    module.add_function(wrap_pyfunction!(simulate, module)?)
}
