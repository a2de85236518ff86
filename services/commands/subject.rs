//! What the offline commands have in common: a log, its axes, a model to start from, and where the result goes.

use crate::{
    arguments::{LogArgs, ReportArgs, picked},
    commands::print,
    progress::Progress,
};
use anyhow::{Context, Result, anyhow, bail};
use gyro_model::{
    Axis, Model, Record, diagnose,
    diagnosis::{AxisDiagnosis, DataFault, Diagnosis},
    effects::Effect,
    finding::{Finding, Why},
    fit, units,
};
use jiff::Timestamp;
use log_readers::meaning::Pick;
use std::path::Path;
use workbench::{
    log::{self, Options, dependent},
    model_file::{self, ModelFile, Provenance},
    output::{self, Output},
    report::{self, Format},
};

/// A log that has been read, and the axes that are meant.
pub struct Subject {
    /// The rows.
    pub record: Record,
    /// What is faulty in them.
    pub faults: Vec<DataFault>,
    /// Which log it is.
    pub provenance: log::Provenance,
    /// The axes to work on.
    pub axes: Vec<Axis>,
    /// The log as it was named.
    pub name: String,
    /// The axes whose reference depends on the gyro or is no measurement: nothing can be told of them.
    pub overruled: Vec<Axis>,
}

/// A model to start from.
pub struct Start {
    /// The model.
    pub file: ModelFile,
    /// Whether it was fitted on this very log.
    pub own_log: bool,
}

impl Subject {
    /// Reads a log for fitting: one that has a reference, on the axis that is asked for.
    ///
    /// # Errors
    /// A refused log, or an axis without gyro or reference.
    pub fn read(args: &LogArgs, axis: Option<Axis>) -> Result<Self> {
        let options = Options { needs_reference: !args.at_rest, ..args.names.options() };
        let (mut record, faults, provenance) = {
            let _spinner = Progress::spinner("reading the log");
            log::read(&args.log, &options)?
        };
        say_chosen(args, &provenance);
        if args.at_rest {
            record.rest();
        }
        let fitted = record.fitted_axes();
        let name = args.log.display().to_string();
        if let Some(axis) = axis.filter(|a| !fitted.contains(a)) {
            let has: Vec<&str> = fitted.iter().map(|a| a.letter()).collect();
            bail!("{name}: axis {axis} has no gyro or no reference: choose from {}", has.join(", "));
        }
        let axes = picked(axis, &fitted);
        let is_dependent = |axis: &&Axis| faults.iter().any(|fault| dependent::concerns(fault, **axis));
        let overruled = axes.iter().filter(is_dependent).filter(|_| !args.reference_is_dependent).copied().collect();
        Ok(Self { record, faults, provenance, axes, name, overruled })
    }

    /// The model of this file, or the base model fitted to this log, which has what the model goes by.
    ///
    /// # Errors
    /// As [`Subject::load`], and a channel that the log lacks.
    pub fn start(&self, model: Option<&Path>) -> Result<Start> {
        let start = self.load(model)?;
        start.file.check_channels(&self.record, &self.axes).with_context(|| self.name.clone())?;
        Ok(start)
    }

    /// The model of this file, whatever it goes by, or the base model fitted to this log.
    ///
    /// # Errors
    /// A model that cannot be read, or a log that cannot be fitted.
    pub fn load(&self, model: Option<&Path>) -> Result<Start> {
        if let Some(path) = model {
            let file = model_file::load(path, &self.record.free_names)?;
            let own_log = file.provenance.as_ref().is_some_and(|p| p.names(&self.provenance));
            return Ok(Start { file, own_log });
        }
        Ok(Start { file: self.fitted(self.fit(&self.base())?, Vec::new()), own_log: true })
    }

    /// What is said where this log was recorded at other temperatures than those that a model was fitted at.
    #[must_use]
    pub fn hotter(&self, file: &ModelFile) -> Option<String> {
        let (fitted, here) = file.provenance.as_ref().and_then(|p| p.temperature).zip(self.provenance.temperature)?;
        let beyond = (here.1 - fitted.1).max(fitted.0 - here.0);
        let word = if here.1 - fitted.1 >= fitted.0 - here.0 { "hotter" } else { "colder" };
        (beyond > OTHER_TEMPERATURE).then(|| {
            format!(
                "This log is up to {beyond:.0} K {word} than the model's: it was recorded at {:.1} to {:.1} °C, and the model was fitted at \
                 {:.1} to {:.1} °C.",
                here.0, here.1, fitted.0, fitted.1
            )
        })
    }

    /// The base model of the axes that are meant, not fitted yet.
    #[must_use]
    pub fn base(&self) -> Model {
        let mut base = Model::base_for(&self.record);
        for axis in Axis::ALL.into_iter().filter(|axis| !self.axes.contains(axis)) {
            base.axes[axis.index()] = None;
        }
        base
    }

    /// Leaves out the axes that a model says nothing of.
    ///
    /// # Errors
    /// It says nothing of any.
    pub fn keep_axes_of(&mut self, model: &Model, name: &str) -> Result<()> {
        let says_of = |axis: &Axis| model.axes[axis.index()].is_some();
        if !self.axes.iter().any(says_of) {
            let letters = |axes: &[Axis]| axes.iter().map(|axis| axis.letter()).collect::<Vec<_>>().join(", ");
            let has: Vec<Axis> = Axis::ALL.into_iter().filter(says_of).collect();
            bail!(
                "{name}: says nothing of axis {}, only of {}: give a model that was fitted on it",
                letters(&self.axes),
                letters(&has)
            );
        }
        self.axes.retain(says_of);
        Ok(())
    }

    /// Refits a model on the axes that are meant.
    ///
    /// # Errors
    /// A log that cannot be fitted.
    pub fn fit(&self, model: &Model) -> Result<Model> {
        let _spinner = Progress::spinner("fitting");
        fit::fit(&self.record, model, &self.axes).map_err(|error| {
            // A fault of the whole log is why, where there is one.
            let grave = self.faults.iter().find(|fault| fault.axis.is_none() && fault.is_fatal(self.record.len()));
            let why = grave.map_or_else(|| anyhow::Error::from(error), |fault| anyhow!("{}", fault.says));
            why.context(self.name.clone())
        })
    }

    /// Holds a model against the log; `own_log` where it was fitted on this very one.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn compare(&self, model: &Model, own_log: bool) -> Result<Diagnosis> {
        self.compare_on(model, &self.axes, own_log)
    }

    /// The same on some of the axes.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn compare_on(&self, model: &Model, axes: &[Axis], own_log: bool) -> Result<Diagnosis> {
        let spinner = Progress::spinner("comparing");
        let progress = |what: &str| spinner.says(what);
        let options = diagnose::Options { own_log, ..self.options(&progress) };
        let axes = diagnose::compare(&self.record, model, axes, &options).with_context(|| self.name.clone())?;
        Ok(self.diagnosis(axes))
    }

    /// The axes that are judged, and those whose reference is none.
    #[must_use]
    pub fn judged_and_overruled(&self) -> (Vec<Axis>, Vec<Axis>) {
        self.axes.iter().partition(|axis| !self.overruled.contains(axis))
    }

    /// How a diagnosis of this log is run.
    #[must_use]
    pub fn options<'a>(&'a self, progress: &'a (dyn Fn(&str) + Sync)) -> diagnose::Options<'a> {
        diagnose::Options {
            progress,
            faults: &self.faults,
            failed: &|error| eprintln!("truerate: {error}"),
            ..diagnose::Options::default()
        }
    }

    /// The result for this log.
    #[must_use]
    pub fn diagnosis(&self, mut axes: Vec<AxisDiagnosis>) -> Diagnosis {
        for axis in &mut axes {
            if self.overruled.contains(&axis.axis) {
                axis.find(Finding::CannotTell(Why::Dependent));
                axis.suspects.clear();
            }
        }
        Diagnosis { schema: "truerate.diagnosis/1".to_owned(), log: self.name.clone(), axes }
    }

    /// What a report has to know of how the command was called.
    #[must_use]
    pub fn context(
        &self,
        command: report::Command,
        args: &LogArgs,
        axis: Option<Axis>,
        model: Option<&Path>,
        output: Option<&Path>,
    ) -> report::Context {
        let shown = |path: Option<&Path>| path.map(|p| p.display().to_string());
        let mut flags = Vec::new();
        flags.extend(args.names.flags());
        if args.reference_is_dependent {
            flags.push("--reference-is-dependent".to_owned());
        }
        if let Some(axis) = axis {
            flags.extend(["--axis".to_owned(), axis.to_string()]);
        }
        report::Context {
            model: shown(model),
            output: shown(output),
            flags,
            about: self.about(model),
            ..report::Context::new(command, self.name.clone())
        }
    }

    /// What the log is, in a few words each.
    fn about(&self, model: Option<&Path>) -> Vec<String> {
        let mut about = Vec::new();
        // The rate is that of a gyro: rows of a reference may stand between its own.
        let has_gyro = |row: &&gyro_model::Row| self.axes.iter().any(|axis| row.gyro[axis.index()].is_finite());
        let times: Vec<i64> = self.record.rows.iter().filter(has_gyro).map(|row| row.t_ns).collect();
        let mut steps: Vec<i64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if !steps.is_empty() {
            let middle = steps.len() / 2;
            let step = 1e-9 * *steps.select_nth_unstable(middle).1 as f64;
            about.push(format!("{} at {} Hz", length(self.record.duration()), units::round(1.0 / step)));
        }
        about.push(format!("{} rows", units::thousands(self.provenance.samples)));
        if let Some((low, high)) = self.provenance.temperature {
            about.push(format!("{low:.1} to {high:.1} °C"));
        }
        // Clocks that count from when they were switched on say no date.
        let start = Timestamp::from_nanosecond(self.provenance.start_ns).ok();
        if let Some(start) = start.filter(|start| start.as_second() > FIRST_DATE) {
            about.push(format!("recorded {} UTC", start.strftime("%Y-%m-%d %H:%M")));
        }
        about.push(match model.and_then(Path::file_name) {
            Some(name) => format!("model: {}", name.to_string_lossy()),
            None => "model at the start: scale factor and bias".to_owned(),
        });
        about
    }

    /// The model that a command made, to be taken along with its page.
    #[must_use]
    pub fn product(file: &ModelFile, output: Option<&Path>) -> Option<report::Product> {
        let name = output.and_then(Path::file_name).filter(|name| *name != "-");
        model_file::refuse_unseen(&file.model).ok()?;
        Some(report::Product {
            name: name.map_or_else(|| "model.toml".to_owned(), |name| name.to_string_lossy().into_owned()),
            text: model_file::render(file),
        })
    }

    /// A model with this log as its provenance, and the user's own effects that its file defines.
    #[must_use]
    pub fn fitted(&self, model: Model, own_effects: Vec<&'static dyn Effect>) -> ModelFile {
        ModelFile { model, provenance: Some(Provenance::now(&self.provenance)), own_effects }
    }
}

/// A date before this one is a clock that was never set: the beginning of 2000, s since 1970.
const FIRST_DATE: i64 = 946_684_800;

/// `42.0 s`, `3 min 20 s`, `2 h 5 min`.
fn length(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..120 => format!("{seconds:.1} s"),
        120..7200 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Temperatures that differ by more make a difference to most gyros (0.01–0.08 °/s per K in data sheets), K.
const OTHER_TEMPERATURE: f64 = 5.0;

/// Says on standard error which channels were taken without being named.
pub fn say_chosen(args: &LogArgs, provenance: &log::Provenance) {
    if !provenance.chosen.is_empty() {
        let flags: Vec<String> = provenance.chosen.iter().map(Pick::flag).collect();
        eprintln!("{}: read as {}", args.log.display(), flags.join(" "));
    }
}

impl ReportArgs {
    /// Checks that the report can be written, before any long work.
    ///
    /// # Errors
    /// An ending that says no form, a place that cannot be written to, or one of the files to `keep`.
    pub fn check(&self, keep: &[&Path]) -> Result<()> {
        if let Some(path) = &self.report {
            form(path)?;
            writable(path, keep)?;
        }
        Ok(())
    }

    /// The same, and that what the command makes can be written, which takes the place of neither log nor report.
    ///
    /// # Errors
    /// As [`Self::check`], of either file.
    pub fn check_with(&self, log: &Path, product: Option<&Path>) -> Result<()> {
        let keep: Vec<&Path> = std::iter::once(log).chain(product).collect();
        self.check(&keep)?;
        product.map_or(Ok(()), |path| writable(path, &keep[..1]))
    }

    /// Prints a result, and writes the report file. `render` makes it, told whether it is for a file. Nothing is printed
    /// where `product`, what the command makes, went to standard output.
    ///
    /// # Errors
    /// Standard output or the report cannot be written.
    pub fn emit(&self, product: Option<&Path>, render: impl Fn(Format, bool) -> String) -> Result<()> {
        if let Some(path) = &self.report {
            output::write(path, render(form(path)?, true).as_bytes())?;
        }
        if product == Some(Path::new("-")) {
            return Ok(());
        }
        print(&render(self.format, false))
    }
}

/// The form that a report file's ending asks for.
fn form(path: &Path) -> Result<Format> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("txt" | "text" | "md") => Ok(Format::Text),
        Some("json") => Ok(Format::Json),
        Some("html" | "htm") => Ok(Format::Html),
        _ => bail!("{}: a report's ending says its form: use .txt, .json or .html", path.display()),
    }
}

/// Checks that a file can be written here, without touching what stands there, and that it is none of those to keep.
///
/// # Errors
/// The folder is missing or read-only, the name is a folder's, or one of those.
pub fn writable(path: &Path, kept: &[&Path]) -> Result<()> {
    let same = |other: &&&Path| match (path.canonicalize(), other.canonicalize()) {
        (Ok(own), Ok(other)) => own == other && own.is_file(),
        _ => path == **other && path != Path::new("-"),
    };
    if let Some(other) = kept.iter().find(same) {
        bail!("{}: would be written over {}, which is needed: choose another name", path.display(), other.display());
    }
    Output::create(path).map(drop)
}
