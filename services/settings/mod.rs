//! What a pipeline is told: the file of `run --config` (strict), overridden by flags, handed to every process of the run
//! in one file of its folder.

mod filter;
mod learning;
mod simulation;
mod source;
mod speed;
mod waits;

pub use filter::{Filter, Gain};
pub use learning::Learning;
pub use simulation::{SimulatedReference, Simulation};
pub use source::Source;
pub use speed::Speed;
pub use waits::Waits;

use crate::{
    listening,
    live::Address,
    rate_out::{Target, Way, ring},
    realtime::Realtime,
};
use anyhow::{Context, bail};
use ipc_types::{ServiceId, wait::Wait};
use serde::{Deserialize, Serialize};
use source::STANDARD_INPUT;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Name of the settings' file in the instance's folder.
pub const FILE: &str = "run.json";

/// Settings of one pipeline; every default is usable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Where samples come from.
    pub source: Source,
    /// A TOML file that renames foreign columns of a log.
    pub columns: Option<PathBuf>,
    /// Channels of a log under the names of the format, `NAME=CHANNEL` each.
    pub map: Vec<String>,
    /// Where the reference comes from, where not with the gyro: of a log a second file, of a sensor another address.
    pub reference: Option<String>,
    /// A DBC file: what the frames of a CAN log mean, or those of `candump` on standard input.
    pub dbc: Option<PathBuf>,
    /// How fast.
    pub speed: Speed,
    /// The model to start from; without one α = 1, δ = 0, learned on the way.
    pub model: Option<PathBuf>,
    /// The type that the sensor is a new part of, in place of a model: a type file, or FILE:TYPE.
    pub prior: Option<PathBuf>,
    /// No learning.
    pub freeze: bool,
    /// Effects hidden in the source, `ID[:NAME=VALUE,…]`.
    pub hide: Vec<String>,
    /// Where the estimates are recorded.
    pub record: Option<PathBuf>,
    /// Where the time of every sample at every stage is written.
    pub profile: Option<PathBuf>,
    /// Where the rate is given to.
    pub out: Vec<Target>,
    /// Where the dashboard listens; `off` for none.
    pub dashboard: String,
    /// The simulated vehicle.
    pub simulation: Simulation,
    /// How kalman filters.
    pub filter: Filter,
    /// How the compensator learns.
    pub learning: Learning,
    /// How each process waits for its next message.
    pub wait: Waits,
    /// What the kernel is asked for.
    pub realtime: Realtime,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            source: Source::Simulated,
            columns: None,
            map: Vec::new(),
            reference: None,
            dbc: None,
            speed: Speed::Times(1.0),
            model: None,
            prior: None,
            freeze: false,
            hide: Vec::new(),
            record: None,
            profile: None,
            out: Vec::new(),
            dashboard: "127.0.0.1:7777".to_owned(),
            simulation: Simulation::default(),
            filter: Filter::default(),
            learning: Learning::default(),
            wait: Waits::default(),
            realtime: Realtime::default(),
        }
    }
}

/// Times, s, rates and swings that make sense.
const LEAST: f64 = 1e-6;
const MOST: f64 = 1e9;
/// The least share of a core that may be learned with.
const LEAST_DUTY: f64 = 1e-3;

impl Settings {
    /// Reads a configuration file; relative paths in it are relative to its folder.
    ///
    /// # Errors
    /// An unknown key or a wrong value, with line and caret.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let mut settings: Self = toml::from_str(&text).with_context(|| path.display().to_string())?;
        settings.make_absolute(path.parent().unwrap_or(Path::new(".")))?;
        settings.check().with_context(|| path.display().to_string())?;
        Ok(settings)
    }

    /// Makes every path absolute, taken from `folder` where it is relative.
    ///
    /// # Errors
    /// Where there is no current folder.
    pub fn make_absolute(&mut self, folder: &Path) -> anyhow::Result<()> {
        let whole = |path: &Path| std::path::absolute(folder.join(path)).context("the current folder");
        if let Source::Log(path) | Source::Stream(path) = &self.source
            && path != Path::new(STANDARD_INPUT)
        {
            self.source = Source::at(whole(path)?);
        }
        if let Source::Live(address) = &self.source {
            self.source = Source::Live(address.clone().from_folder(&whole(Path::new(""))?));
        }
        let Self { columns, dbc, model, prior, record, profile, .. } = self;
        for path in [columns, dbc, model, prior, record, profile].into_iter().flatten() {
            *path = whole(path)?;
        }
        if let (Source::Log(_), Some(reference)) = (&self.source, &mut self.reference) {
            *reference = whole(Path::new(reference))?.display().to_string();
        }
        Ok(())
    }

    /// The second file that a log's reference is taken from.
    #[must_use]
    pub fn reference_file(&self) -> Option<PathBuf> {
        self.reference.as_ref().filter(|_| matches!(self.source, Source::Log(_))).map(PathBuf::from)
    }

    /// The address that a sensor's reference comes from.
    ///
    /// # Errors
    /// It is none.
    pub fn reference_address(&self) -> anyhow::Result<Option<Address>> {
        let text = self.reference.as_ref().filter(|_| self.source.is_live());
        let of_frames = |text: &String| match &self.dbc {
            Some(dbc) => Address::of_frames(text, dbc),
            None => text.parse(),
        };
        text.map(of_frames).transpose().context("reference")
    }

    /// Whether every number makes sense.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self) -> anyhow::Result<()> {
        listening::Address::parse(&self.dashboard)?;
        let (s, l) = (&self.simulation, &self.learning);
        let positive = [
            ("simulation.seconds", s.seconds.unwrap_or(1.0)),
            ("simulation.rate_hz", s.rate_hz),
            ("simulation.swing", s.swing.unwrap_or(1.0)),
            ("simulation.swing_period", s.swing_period.unwrap_or(1.0)),
            ("learning.window", l.window),
            ("learning.period", l.period),
        ];
        for (name, value) in positive {
            if !(LEAST..=MOST).contains(&value) {
                bail!("{name} = {value}: must be a number from {LEAST:e} to {MOST:e}");
            }
        }
        if l.diagnosis != 0.0 && !(LEAST..=MOST).contains(&l.diagnosis) {
            bail!("learning.diagnosis = {}: must be 0 (none) or a number from {LEAST:e} to {MOST:e}", l.diagnosis);
        }
        if !(LEAST_DUTY..=1.0).contains(&l.duty) {
            bail!("learning.duty = {}: is a share of one core, from {LEAST_DUTY} to 1", l.duty);
        }
        if self.reference.is_some() && !matches!(self.source, Source::Log(_) | Source::Live(_)) {
            bail!("reference: joins a log (a second file) or a sensor's address (another address); source is neither");
        }
        self.reference_address()?;
        let is_simulated = self.source == Source::Simulated;
        let of_a_source =
            [("columns", self.columns.is_some()), ("dbc", self.dbc.is_some()), ("map", !self.map.is_empty())];
        if let Some((name, _)) = of_a_source.into_iter().find(|(_, is_given)| is_simulated && *is_given) {
            bail!(
                "{name}: a simulated vehicle has no columns to name; give a log or a sensor's address as the source, or leave it out"
            );
        }
        let spins = ServiceId::ALL.into_iter().filter(|&id| self.wait.of(id) == Some(Wait::Spin));
        self.realtime.check(&spins.collect::<Vec<_>>())?;
        if self.prior.is_some() && (self.model.is_some() || self.freeze) {
            bail!(
                "prior: the model is begun from a type and learned on the way: leave out model and freeze, or the prior"
            );
        }
        if l.rows < 1000 {
            bail!("learning.rows = {}: must be 1000 at least", l.rows);
        }
        Ok(())
    }

    /// Whether there is a place for the rate that the sender serves.
    #[must_use]
    pub fn has_sender(&self) -> bool {
        self.out.iter().any(|target| !matches!(target.way, Way::Shared(_)))
    }

    /// Whether rows go to standard output, which is theirs alone then.
    #[must_use]
    pub fn uses_standard_output(&self) -> bool {
        self.out.iter().any(|target| target.way == Way::StandardOutput)
    }

    /// The shared memory that kalman gives the rate into.
    #[must_use]
    pub fn ring(&self, instance: &str) -> Option<PathBuf> {
        self.out.iter().find_map(|target| match &target.way {
            Way::Shared(path) => Some(path.clone().unwrap_or_else(|| ring::path(instance))),
            _ => None,
        })
    }

    /// Whether the source is a vehicle that drives without end, and waits for nobody.
    #[must_use]
    pub fn is_vehicle(&self) -> bool {
        let is_simulated = self.source == Source::Simulated && self.simulation.seconds.is_none();
        self.source.is_live() || is_simulated && self.speed != Speed::Max
    }

    /// Whether a row that a process missed is given again.
    #[must_use]
    pub fn lossless(&self) -> bool {
        self.speed == Speed::Max && matches!(self.source, Source::Log(_) | Source::Simulated)
    }

    /// Whether rows are given as fast as they are followed: unpaced, and from what would wait for us.
    #[must_use]
    pub fn unpaced(&self) -> bool {
        self.speed == Speed::Max && !self.source.is_live()
    }
}

#[cfg(test)]
mod tests {
    use super::{Settings, Source, Speed};
    use std::path::Path;

    #[test]
    fn the_deployed_file_takes_a_sensor_gives_the_rate_and_says_the_defaults() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy/truerate.toml");
        let Settings { source, out, .. } = Settings::read(&path).unwrap();
        assert!(source.is_live() && !out.is_empty(), "{source:?} {out:?}");
        assert_eq!(Settings { source, out, ..Settings::default() }, Settings::read(&path).unwrap());
    }

    #[test]
    fn what_the_deployed_file_records_lies_where_its_unit_may_write() {
        let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy");
        let text = std::fs::read_to_string(deploy.join("truerate.toml")).unwrap();
        let etc = tempfile::tempdir().unwrap();
        let config = etc.path().join("truerate.toml");
        std::fs::write(&config, text.replace("# record = ", "record = ")).unwrap();
        let record = Settings::read(&config).unwrap().record.unwrap();
        assert!(record.starts_with("/var/lib/truerate"), "{}", record.display());
        let unit = std::fs::read_to_string(deploy.join("truerate.service")).unwrap();
        assert!(unit.lines().any(|line| line == "StateDirectory=truerate"));
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line() {
        let error = toml::from_str::<Settings>("speed = 1\n[learning]\nwindows = 3\n").unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains("windows") && error.contains('^'), "{error}");
    }

    #[test]
    fn settings_pass_from_process_to_process_unchanged() {
        let settings = Settings {
            source: Source::Log("/tmp/a.csv".into()),
            speed: Speed::Max,
            hide: vec!["delay:d=0.01".into()],
            ..Settings::default()
        };
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(serde_json::from_str::<Settings>(&text).unwrap(), settings);
    }

    #[test]
    fn what_comes_once_is_told_from_what_can_be_read_again() {
        for (text, once) in [("-", true), ("/dev/null", true), ("deploy/truerate.toml", false), ("missing.csv", false)]
        {
            let source: Source = text.parse().unwrap();
            assert_eq!(source.comes_once(), once, "{text}");
        }
        let mut settings = Settings { source: Source::at("-".into()), ..Settings::default() };
        settings.make_absolute(Path::new(".")).unwrap();
        assert_eq!(settings.source, Source::Stream("-".into()));
    }

    #[test]
    fn a_simulated_vehicle_has_no_columns_to_name() {
        let named = Settings { map: vec!["w=gyro_z".into()], ..Settings::default() };
        let error = named.check().unwrap_err().to_string();
        assert!(error.starts_with("map: a simulated vehicle has no columns"), "{error}");
        let log = Settings { source: Source::Log("a.csv".into()), ..named };
        assert!(log.check().is_ok());
    }

    #[test]
    fn numbers_that_no_process_could_work_with_are_refused() {
        for text in ["duty = 1e-20", "duty = 1.1", "period = 1e20", "diagnosis = 1e20", "window = 0", "window = nan"] {
            let settings: Settings = toml::from_str(&format!("[learning]\n{text}\n")).unwrap();
            let error = settings.check().unwrap_err().to_string();
            assert!(error.starts_with(&format!("learning.{}", text.split(' ').next().unwrap())), "{error}");
        }
    }

    #[test]
    fn a_speed_that_is_none_is_refused() {
        for text in ["0", "-1", "nan", "fast", "inf", "1e-300", "1e300"] {
            assert!(text.parse::<Speed>().is_err(), "{text}");
        }
    }
}
