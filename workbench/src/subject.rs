//! A log that is worked on: read, fitted, compared, diagnosed. What the program, the Python package and the page share.

use crate::{
    log::{self, Options, dependent},
    model_file::{self, ModelFile, Provenance},
    report, words,
};
use anyhow::{Context, Result, anyhow, bail};
use gyro_model::{
    Axis, Model, Record, Row, diagnose,
    diagnosis::{AxisResult, DIAGNOSIS, DataFault, Diagnosis, LADDER, Verdict},
    effects::Effect,
    evidence::study::Bench,
    fault::FaultKind,
    finding::{Finding, Remark, Why},
    fit, units,
    words::labels,
};
use jiff::Timestamp;
use std::path::Path;

/// How a log is taken.
#[derive(Clone, Debug, Default)]
pub struct Taken {
    /// How it is read.
    pub options: Options,
    /// The axis that is asked for; all where none is.
    pub axis: Option<Axis>,
    /// An axis without a reference did not turn: it is judged against zero rate.
    pub at_rest: bool,
    /// The reference is used although it was computed from this very gyro.
    pub reference_is_dependent: bool,
}

/// A log that has been read, and the axes that are meant.
#[derive(Clone, Debug)]
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
#[derive(Clone, Debug)]
pub struct Start {
    /// The model.
    pub file: ModelFile,
    /// Whether it was fitted on this very log.
    pub own_log: bool,
    /// Whether the caller gave it; the base model otherwise.
    pub given: bool,
    /// The log as the fit laid it out, where it was fitted to it.
    pub laid: Option<Bench>,
}

impl Subject {
    /// Reads a log for fitting: one that has a reference, on the axis that is asked for.
    ///
    /// # Errors
    /// A refused log, or an axis without gyro or reference.
    pub fn read(path: &Path, taken: &Taken) -> Result<Self> {
        let options = Options { needs_reference: !taken.at_rest, ..taken.options.clone() };
        let (mut record, faults, provenance) = log::read(path, &options)?;
        if taken.at_rest {
            record.rest();
        }
        let fitted = record.fitted_axes();
        let name = path.display().to_string();
        if let Some(axis) = taken.axis.filter(|a| !fitted.contains(a)) {
            let has: Vec<&str> = fitted.iter().map(|a| a.letter()).collect();
            bail!("{name}: axis {axis} has no gyro or no reference: choose from {}", has.join(", "));
        }
        let axes = taken.axis.map_or(fitted, |axis| vec![axis]);
        let is_dependent = |axis: &&Axis| faults.iter().any(|fault| dependent::concerns(fault, **axis));
        let overruled = axes.iter().filter(is_dependent).filter(|_| !taken.reference_is_dependent).copied().collect();
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
            return Ok(self.given(file));
        }
        let (model, laid) = self.fit_and_keep(&self.base())?;
        Ok(Start { file: self.fitted(model, Vec::new()), own_log: true, given: false, laid })
    }

    /// A model that the caller gave.
    #[must_use]
    pub fn given(&self, file: ModelFile) -> Start {
        let own_log = file.provenance.as_ref().is_some_and(|p| p.names(&self.provenance));
        Start { file, own_log, given: true, laid: None }
    }

    /// What is said where this log was recorded at other temperatures than those that a model was fitted at.
    #[must_use]
    pub fn hotter(&self, file: &ModelFile) -> Option<String> {
        let (fitted, here) = file.provenance.as_ref().and_then(|p| p.temperature).zip(self.provenance.temperature)?;
        let beyond = (here.1 - fitted.1).max(fitted.0 - here.0);
        let word = if here.1 - fitted.1 >= fitted.0 - here.0 { "hotter" } else { "colder" };
        (beyond > OTHER_TEMPERATURE).then(|| labels::at_other_temperature(beyond, word, here, fitted, words::voice()))
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
        self.fit_and_keep(model).map(|(model, _)| model)
    }

    /// The same, and the log as it was laid out for it.
    ///
    /// # Errors
    /// As [`Subject::fit`].
    pub fn fit_and_keep(&self, model: &Model) -> Result<(Model, Option<Bench>)> {
        fit::fit_and_keep(&self.record, model, &self.axes).map_err(|error| {
            // A fault of the whole log is why, where there is one.
            let grave = self.faults.iter().find(|fault| fault.axis.is_none() && fault.is_fatal(self.record.len()));
            let why = grave.map_or_else(|| anyhow::Error::from(error), |fault| anyhow!("{}", fault.says));
            why.context(self.name.clone())
        })
    }

    /// Holds a model against the log, on these axes.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn compare(&self, model: &Model, axes: &[Axis], options: &diagnose::Options) -> Result<Diagnosis> {
        let axes = diagnose::compare(&self.record, model, axes, options).with_context(|| self.name.clone())?;
        Ok(self.diagnosis(axes))
    }

    /// Holds the model to start from against the log, and remarks that its own log says little of it.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn judge(&self, start: &Start, options: &diagnose::Options) -> Result<Diagnosis> {
        let options = diagnose::Options { own_log: start.own_log, laid: start.laid.as_ref(), ..*options };
        let mut diagnosis = self.compare(&start.file.model, &self.axes, &options)?;
        for axis in diagnosis.axes.iter_mut().filter(|_| start.given && start.own_log) {
            axis.remarks.push(Remark::OwnLog);
        }
        Ok(diagnosis)
    }

    /// Says which effect a model is missing. An axis whose reference is none is only compared.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn diagnose(&self, start: &Start, options: &diagnose::Options) -> Result<Diagnosis> {
        let (judged, overruled) = self.judged_and_overruled();
        let mut axes = Vec::new();
        if !judged.is_empty() {
            let options =
                diagnose::Options { own_effects: &start.file.own_effects, laid: start.laid.as_ref(), ..*options };
            axes = diagnose::diagnose(&self.record, &start.file.model, &judged, &options)
                .with_context(|| self.name.clone())?;
        }
        if !overruled.is_empty() {
            let options = diagnose::Options { own_log: start.own_log, ..*options };
            axes.extend(self.compare(&start.file.model, &overruled, &options)?.axes);
            axes.sort_by_key(|own| own.axis);
        }
        let mut diagnosis = self.diagnosis(axes);
        for axis in diagnosis.axes.iter_mut().filter(|axis| start.given && axis.verdict == Verdict::Adequate) {
            if let Some((parameter, off)) = diagnose::moved(&start.file.model, axis).first() {
                axis.remarks.push(Remark::Moved { parameter: parameter.clone(), errors: *off });
            }
        }
        Ok(diagnosis)
    }

    /// Adds what is missing until nothing is. An axis whose reference is none stays as it is.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn ladder(&self, start: &Start, options: &diagnose::Options) -> Result<(ModelFile, Diagnosis)> {
        let options = diagnose::Options { own_effects: &start.file.own_effects, laid: start.laid.as_ref(), ..*options };
        let none = diagnose::Options { steps: 0, ..options };
        let (judged, overruled) = self.judged_and_overruled();
        let (mut model, mut all) = (start.file.model.clone(), Vec::new());
        for (axes, options) in [(judged, options), (overruled, none)].into_iter().filter(|(axes, _)| !axes.is_empty()) {
            let (fitted, found) =
                diagnose::ladder(&self.record, &model, &axes, &options).with_context(|| self.name.clone())?;
            model = Model { epoch: start.file.model.epoch + 1, ..fitted };
            all.extend(found);
        }
        all.sort_by_key(|own| own.axis);
        self.overrule(&mut all);
        let ladder = Diagnosis::new(LADDER, &self.name, all);
        Ok((self.fitted(model, start.file.own_effects.clone()), ladder))
    }

    /// The axes that are judged, and those whose reference is none.
    fn judged_and_overruled(&self) -> (Vec<Axis>, Vec<Axis>) {
        self.axes.iter().partition(|axis| !self.overruled.contains(axis))
    }

    /// Takes from the axes whose reference is none what was found by it: effects, and a gear between the two.
    fn overrule(&self, axes: &mut [AxisResult]) {
        for axis in axes.iter_mut().filter(|axis| self.overruled.contains(&axis.axis)) {
            axis.find(Finding::CannotTell(Why::Dependent));
            axis.suspects.clear();
            axis.data_faults.retain(|fault| fault.kind != FaultKind::WrongRatio);
        }
    }

    /// The result for this log.
    #[must_use]
    pub fn diagnosis(&self, mut axes: Vec<AxisResult>) -> Diagnosis {
        self.overrule(&mut axes);
        Diagnosis::new(DIAGNOSIS, &self.name, axes)
    }

    /// What the log is, in a few words each.
    #[must_use]
    pub fn about(&self, model: Option<&Path>) -> Vec<String> {
        let mut about = Vec::new();
        // The rate is that of a gyro: rows of a reference may stand between its own.
        let has_gyro = |row: &&Row| self.axes.iter().any(|axis| row.gyro[axis.index()].is_finite());
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
