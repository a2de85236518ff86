//! Logs on the desk: read, fitted, diagnosed, changed, as the program's commands do it.

use crate::told::{Told, tell};
use anyhow::{Context, Result, anyhow, bail};
use gyro_model::{
    Axis,
    diagnose::Options,
    diagnosis::{Diagnosis, LadderStep},
    effects::{CATALOGUE, Stage},
    headline, simulate,
    simulate::{Scenario, SensorSpec, SetUp},
    words::Voice,
};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use workbench::{
    change::Direction,
    export,
    log::{self, channels},
    model_file::{self, ModelFile},
    report::{self, Command, Format, units, view::Page},
    several::Several,
    subject::{Start, Subject, Taken},
};

/// How a log is to be read: the flags of the program under the same names.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    log: String,
    /// Further logs of the same sensor.
    #[serde(default)]
    more: Vec<String>,
    #[serde(default)]
    map: Vec<String>,
    reference: Option<String>,
    dbc: Option<String>,
    axis: Option<String>,
    #[serde(default)]
    at_rest: bool,
    #[serde(default)]
    reference_is_dependent: bool,
}

/// An effect to add to an axis, or to remove from it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edit {
    axis: String,
    effect: String,
    add: bool,
}

/// What was found last, and by which command.
type Found = (Command, Diagnosis);

/// Logs of one sensor, the base model, and what was found last.
#[derive(Default)]
pub struct Desk {
    logs: Option<Several>,
    base: Option<Start>,
    found: Option<(Found, ModelFile)>,
}

/// The name of a model in messages and files.
const MODEL: &str = "model.toml";

fn options(logs: &Several) -> Options<'_> {
    Options {
        progress: &|what| tell(Told::Progress, what),
        took: &|axis, step| tell(Told::Step, &taken(axis, step)),
        failed: &|error| tell(Told::Failed, &error.to_string()),
        faults: &logs.subjects[0].faults,
        ..Options::default()
    }
}

/// The log, where there is one alone.
fn only(logs: &Several) -> Option<&Subject> {
    let [one] = logs.subjects.as_slice() else { return None };
    Some(one)
}

fn about(logs: &Several) -> Vec<String> {
    only(logs).map_or_else(|| logs.about(None), |one| one.about(None))
}

/// A step of a ladder, in a line.
fn taken(axis: Axis, step: &LadderStep) -> String {
    let what = match (&step.added, &step.removed) {
        (Some(added), Some(removed)) => format!("{added} in the place of {removed}"),
        (Some(added), None) => format!("+ {added}"),
        (None, Some(removed)) => format!("− {removed}"),
        (None, None) => "start".to_owned(),
    };
    let error = headline::said(&step.error_curve).map_or_else(
        || "error not known".to_owned(),
        |point| format!("error over {} {} °/s", units::time(point.tau_s), units::rate(point.error)),
    );
    format!("axis {axis}: {what}: {error}")
}

fn axis(name: &str) -> Result<Axis> {
    name.parse().map_err(|_| anyhow!("axis {name:?}: expected 'x', 'y' or 'z'"))
}

impl Desk {
    /// What a file holds, and a map to the names of a log.
    pub fn look(log: &str, dbc: Option<&str>) -> Result<Value> {
        let look = log::look(Path::new(log), dbc.map(Path::new))?;
        let mut told = channels::json(log, &look);
        told["own"] = json!(look.own);
        Ok(told)
    }

    /// Reads a log, or several of one sensor.
    pub fn read(&mut self, reading: Reading) -> Result<Value> {
        *self = Self::default();
        tell(Told::Progress, "reading the log");
        let path = |name: Option<String>| name.map(PathBuf::from);
        let taken = Taken {
            options: log::Options {
                map: reading.map,
                reference: path(reading.reference),
                dbc: path(reading.dbc),
                ..log::Options::default()
            },
            axis: reading.axis.as_deref().map(axis).transpose()?,
            at_rest: reading.at_rest,
            reference_is_dependent: reading.reference_is_dependent,
        };
        let paths: Vec<PathBuf> = std::iter::once(reading.log).chain(reading.more).map(PathBuf::from).collect();
        let logs = match paths.as_slice() {
            [one] => Several::of(vec![Subject::read(one, &taken)?])?,
            all => Several::read(all, &taken, |path| tell(Told::Progress, &path.display().to_string()))?,
        };
        let chosen = logs.subjects.iter().flat_map(|own| &own.provenance.chosen).map(ToString::to_string);
        let unfit = logs.unfit.iter().map(|one| one.says(&one.log));
        let faults = logs.subjects.iter().flat_map(|own| &own.faults).map(|fault| fault.says.clone()).chain(unfit);
        let told = json!({
            "about": about(&logs),
            "axes": logs.axes,
            "chosen": chosen.collect::<Vec<_>>(),
            "faults": faults.collect::<Vec<_>>(),
        });
        self.logs = Some(logs);
        Ok(told)
    }

    fn logs(&self) -> Result<&Several> {
        self.logs.as_ref().context("no log has been read")
    }

    /// The model of this text, or the base model.
    fn start(&mut self, model: Option<&str>) -> Result<Start> {
        let logs = self.logs.as_ref().context("no log has been read")?;
        let first = &logs.subjects[0];
        if let Some(text) = model {
            let file = model_file::parse(Path::new(MODEL), text, &first.record.free_names)?;
            if let Some(one) = only(logs) {
                file.check_channels(&one.record, &one.axes)?;
                return Ok(one.given(file));
            }
            return logs.start_with(Some(file));
        }
        if self.base.is_none() {
            tell(Told::Progress, "fitting");
            self.base = Some(match only(logs) {
                Some(one) => one.start(None)?,
                None => logs.start_with(None)?,
            });
        }
        self.base.clone().context("no base model")
    }

    /// How large the error of a model is.
    pub fn compare(&mut self, model: Option<&str>) -> Result<Value> {
        let start = self.start(model)?;
        tell(Told::Progress, "comparing");
        let logs = self.logs()?;
        let found = match only(logs) {
            Some(one) => one.judge(&start, &options(logs))?,
            None => logs.compare(&start, &options(logs))?,
        };
        self.give((Command::Compare, found), start.file)
    }

    /// Which effect a model is missing.
    pub fn diagnose(&mut self, model: Option<&str>) -> Result<Value> {
        let start = self.start(model)?;
        let logs = self.logs()?;
        let found = match only(logs) {
            Some(one) => one.diagnose(&start, &options(logs))?,
            None => logs.diagnose(&start, &options(logs))?,
        };
        self.give((Command::Diagnose, found), start.file)
    }

    /// Adds what is missing until nothing is.
    pub fn ladder(&mut self, model: Option<&str>) -> Result<Value> {
        let start = self.start(model)?;
        let logs = self.logs()?;
        let (file, ladder) = match only(logs) {
            Some(one) => one.ladder(&start, &options(logs))?,
            None => logs.ladder(&start, &options(logs))?,
        };
        self.give((Command::Ladder, ladder), file)
    }

    /// Adds and removes effects, and says how large the error is then.
    pub fn change(&mut self, model: Option<&str>, edits: &[Edit]) -> Result<Value> {
        let start = self.start(model)?;
        let logs = self.logs()?;
        tell(Told::Progress, "fitting");
        let mut after = start.file.model.clone();
        for edit in edits {
            let direction = if edit.add { Direction::Add } else { Direction::Remove };
            let (effects, axis) = (std::slice::from_ref(&edit.effect), axis(&edit.axis)?);
            let own = logs.subjects.iter().find(|own| own.axes.contains(&axis)).unwrap_or(&logs.subjects[0]);
            after = own.changed_on(&[axis], &start.file, &after, effects, direction)?;
        }
        after.epoch = start.file.model.epoch + 1;
        tell(Told::Progress, "comparing");
        let options = Options { own_log: true, ..options(logs) };
        let (found, file) = if let Some(one) = only(logs) {
            (one.compare(&after, &one.axes, &options)?, one.fitted(after, start.file.own_effects))
        } else {
            let (joint, found) = logs.fit_and_compare(&after, &options)?;
            (found, logs.fitted(joint.model, &start.file))
        };
        self.give((Command::Compare, found), file)
    }

    /// Keeps a result, and gives what is shown of it.
    fn give(&mut self, found: Found, file: ModelFile) -> Result<Value> {
        let text = model_file::refuse_unseen(&file.model).is_ok().then(|| model_file::render(&file));
        let effects =
            |a: &Axis| file.model.axes[a.index()].as_ref().map(|own| (a.to_string(), json!(own.effect_ids())));
        let model: serde_json::Map<String, Value> = Axis::ALL.iter().filter_map(effects).collect();
        self.found = Some((found, file));
        let (found, context) = self.last()?;
        let view = Page::of(found, &context);
        let view = Page { about: context.about, ..view };
        Ok(json!({ "view": view, "model": text, "effects": model }))
    }

    /// What was found last, and how it is told.
    fn last(&self) -> Result<(&Diagnosis, report::Context)> {
        let (logs, ((command, found), file)) = (self.logs()?, self.found.as_ref().context("nothing was found yet")?);
        let context = report::Context {
            voice: Voice::Page,
            about: about(logs),
            product: Subject::product(file, Some(Path::new(MODEL))),
            more: logs.names().split_off(1),
            ..report::Context::new(*command, logs.subjects[0].name.clone())
        };
        Ok((found, context))
    }

    /// The last result in a form of its own.
    pub fn report(&self, form: &str) -> Result<Value> {
        let format = match form {
            "json" => Format::Json,
            "text" => Format::Text,
            "html" => Format::Html,
            other => bail!("a report has no form {other:?}"),
        };
        let (found, context) = self.last()?;
        Ok(json!(report::render(found, format, &context)))
    }

    /// A model in the form of a target, and what that cannot hold.
    pub fn export(&self, model: &str, name: &str, to: &str) -> Result<Value> {
        let channels = self.logs()?.subjects[0].record.free_names.clone();
        let file = model_file::parse(Path::new(MODEL), model, &channels)?;
        let options = export::Options { rate: None, topic: String::new(), sensor: 1, channels, chip: None };
        let exported = export::export(&file, name, to.parse()?, &options)?;
        Ok(json!({ "text": exported.text, "warnings": exported.warnings }))
    }

    /// The effects that can be added, with what each is.
    pub fn effects() -> Value {
        let cards = CATALOGUE.iter().filter(|effect| effect.stage() != Stage::Calibration).map(|effect| effect.card());
        json!(cards.map(|card| json!({ "id": card.id, "title": card.title })).collect::<Vec<_>>())
    }

    /// Makes a log with hidden effects under this name.
    pub fn simulate(log: &str, hide: &[String], seconds: f64, rate_hz: f64, seed: u64) -> Result<Value> {
        tell(Told::Progress, "simulating");
        let refuse = |wrong: String| anyhow!(wrong);
        let (hidden, random) = simulate::hidden(hide, Axis::X).map_err(refuse)?;
        let motion = "multisine".parse().map_err(refuse)?;
        let scenario = Scenario { motion, seconds, rate_hz, seed, hidden, sensor: SensorSpec::on(Axis::X) };
        let rows = scenario.rows().map_err(refuse)?;
        let (record, _) = SetUp { random, ..SetUp::default() }.simulate(&scenario, rows, |_| ());
        log::write_record(Path::new(log), &record, 0)?;
        Ok(json!({ "rows": rows }))
    }
}
