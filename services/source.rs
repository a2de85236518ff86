//! Where rows come from: a log or a simulated vehicle, behind one face.

use crate::{
    hopeless::Hopeless,
    log::{Options, Reader},
    model_file::ModelFile,
    run_folder::{Run, RunFolder, SourceFacts},
    settings::{Settings, SimulatedReference, Source},
};
use anyhow::anyhow;
use gyro_model::{
    Axis, Row,
    simulate::{Hidden, Injection, Reference, Scenario, SensorSpec, Simulator},
};
use std::path::PathBuf;

/// The source of one run.
pub struct Feed {
    rows: Rows,
    /// The next row: read, so that what the source says of itself is known before it is asked for.
    ahead: Option<Row>,
    given: u64,
    settings: Settings,
    taken_up: bool,
    rejected: u64,
    /// Effects switched on while it runs: after which row, as it was said.
    switched: Vec<(u64, String)>,
}

enum Rows {
    Log { path: PathBuf, options: Options, reader: Box<Reader>, injection: Injection },
    Simulated { scenario: Box<Scenario>, simulator: Box<Simulator>, rows: Option<u64> },
}

/// The simulated vehicle of these settings.
///
/// # Errors
/// A motion or an effect that is not known.
pub fn scenario(settings: &Settings) -> anyhow::Result<Scenario> {
    let simulation = &settings.simulation;
    let mut sensor = SensorSpec::random(simulation.seed);
    if simulation.reference == SimulatedReference::Orientation {
        sensor.reference = Reference::Quaternion;
    }
    let hidden: Result<Vec<Hidden>, _> = settings.hide.iter().map(|text| Hidden::parse(text, sensor.axis)).collect();
    Ok(Scenario {
        motion: simulation.motion.parse().map_err(|e: String| anyhow!(e))?,
        seconds: simulation.seconds.unwrap_or(f64::INFINITY),
        rate_hz: simulation.rate_hz,
        seed: simulation.seed,
        hidden: hidden?,
        sensor,
    })
}

/// What is hidden in a log from the start, on its first axis with a gyro and a reference (or with a gyro).
fn injection(reader: &Reader, settings: &Settings) -> anyhow::Result<Injection> {
    let gyros = reader.layout().gyros();
    let axis = reader.layout().referenced().first().or(gyros.first()).copied().unwrap_or(Axis::Z);
    let mut injection = Injection::new(axis);
    for text in &settings.hide {
        injection.hide(text)?;
    }
    Ok(injection)
}

impl Feed {
    /// Opens the source at its first row, and leaves what it says of itself in the run's folder.
    ///
    /// # Errors
    /// Where it cannot be read; another attempt would be of no use.
    pub fn open(run: &Run, folder: &RunFolder) -> anyhow::Result<Self> {
        let settings = &run.settings;
        let log = |path: PathBuf| -> anyhow::Result<Rows> {
            let options = Options { columns: settings.columns.clone(), ..Options::default() };
            let reader = Box::new(Reader::open(&path, &options).map_err(Hopeless::from_error)?);
            let injection = injection(&reader, settings).map_err(Hopeless::from_error)?;
            Ok(Rows::Log { path, options, reader, injection })
        };
        let rows = match &settings.source {
            Source::Log(path) => log(path.clone())?,
            Source::Input => log(PathBuf::from("-"))?,
            Source::Simulated => {
                let scenario = Box::new(scenario(settings).map_err(Hopeless::from_error)?);
                let rows = scenario.seconds.is_finite().then(|| (scenario.seconds * scenario.rate_hz).round() as u64);
                Rows::Simulated { simulator: Box::new(Simulator::new(&scenario)), scenario, rows }
            }
        };
        let mut feed = Self {
            rows,
            ahead: None,
            settings: settings.clone(),
            given: 0,
            taken_up: false,
            rejected: 0,
            switched: Vec::new(),
        };
        feed.fill()?;
        let before = folder.source().ok();
        feed.switched = before.as_ref().map(|facts| facts.switched.clone()).unwrap_or_default();
        folder.set_source(&feed.facts(before.and_then(|facts| facts.anchor)))?;
        feed.write_truth(folder)?;
        Ok(feed)
    }

    fn facts(&self, anchor: Option<(u64, i64)>) -> SourceFacts {
        match &self.rows {
            Rows::Log { path, reader, .. } => SourceFacts {
                name: std::path::Path::new(reader.log())
                    .file_name()
                    .map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned()),
                sha256: None,
                free_names: reader.layout().free_names.clone(),
                axes: Axis::ALL
                    .iter()
                    .filter(|a| reader.layout().gyros().contains(a))
                    .map(ToString::to_string)
                    .collect(),
                start_ns: reader.start_ns().unwrap_or(0),
                anchor,
                switched: self.switched.clone(),
            },
            Rows::Simulated { scenario, .. } => SourceFacts {
                name: format!("simulated vehicle {}", scenario.seed),
                axes: Axis::ALL.iter().map(ToString::to_string).collect(),
                anchor,
                switched: self.switched.clone(),
                ..SourceFacts::default()
            },
        }
    }

    /// What is behind a simulated source, for those who compare at the end.
    fn write_truth(&self, folder: &RunFolder) -> anyhow::Result<()> {
        match &self.rows {
            Rows::Simulated { simulator, .. } => {
                folder.set_truth(&ModelFile { model: simulator.truth(), ..ModelFile::default() })
            }
            Rows::Log { .. } => Ok(()),
        }
    }

    fn fill(&mut self) -> anyhow::Result<()> {
        match &mut self.rows {
            Rows::Log { reader, injection, .. } => {
                for (_, text) in self.switched.iter().filter(|(after, _)| self.taken_up && *after + 1 == self.given) {
                    injection.hide(text)?;
                }
                self.ahead = reader.next_row().map_err(Hopeless::from_error)?.map(|row| injection.spoil(row));
                self.rejected = reader.rows_faulty();
            }
            Rows::Simulated { simulator, rows, .. } => {
                // One row is always read ahead.
                for (_, text) in self.switched.iter().filter(|(after, _)| self.taken_up && *after + 1 == self.given) {
                    simulator.hide(Hidden::parse(text, simulator.sensor().axis)?);
                }
                self.ahead = rows.is_none_or(|rows| self.given < rows).then(|| simulator.step().row);
            }
        }
        Ok(())
    }

    /// The next row, or `None` at the end.
    ///
    /// # Errors
    /// A log that is damaged from here on.
    pub fn next_row(&mut self) -> anyhow::Result<Option<Row>> {
        let Some(row) = self.ahead.take() else { return Ok(None) };
        self.given += 1;
        self.fill()?;
        Ok(Some(row))
    }

    /// Rows given since the beginning.
    #[must_use]
    pub fn given(&self) -> u64 {
        self.given
    }

    /// Rows left out so far, or of which a value was.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Whether it did not begin with the first row: an earlier life of this process gave that.
    #[must_use]
    pub fn is_taken_up(&self) -> bool {
        self.taken_up
    }

    /// Whether something is injected into the rows given now.
    #[must_use]
    pub fn injects(&self) -> bool {
        match &self.rows {
            Rows::Simulated { scenario, .. } => !scenario.hidden.is_empty() || !self.switched.is_empty(),
            Rows::Log { injection, .. } => injection.is_on(),
        }
    }

    /// Switches an effect on from the next row on, and writes it down, so that it is on again after a crash.
    ///
    /// # Errors
    /// An unknown effect or parameter, or a source that nothing can be hidden in.
    pub fn hide(&mut self, text: &str, folder: &RunFolder) -> anyhow::Result<()> {
        match &mut self.rows {
            Rows::Simulated { simulator, .. } => simulator.hide(Hidden::parse(text, simulator.sensor().axis)?),
            Rows::Log { injection, .. } => injection.hide(text)?,
        }
        self.switched.push((self.given, text.to_owned()));
        let anchor = folder.source()?.anchor;
        folder.set_source(&self.facts(anchor))?;
        self.write_truth(folder)
    }

    /// Begins again, and passes over the first `rows` rows (all, where there are fewer). Standard input cannot.
    ///
    /// # Errors
    /// A log that cannot be read again.
    pub fn begin_again(&mut self, rows: u64) -> anyhow::Result<()> {
        match &mut self.rows {
            Rows::Log { path, options, reader, injection: hidden } => {
                **reader = Reader::open(path, options).map_err(Hopeless::from_error)?;
                *hidden = injection(reader, &self.settings)?;
            }
            Rows::Simulated { scenario, simulator, .. } => **simulator = Simulator::new(scenario),
        }
        self.given = 0;
        self.taken_up = true;
        self.fill()?;
        while self.given < rows && self.next_row()?.is_some() {}
        Ok(())
    }

    /// Where a vehicle's time is counted from: what an earlier life wrote down, or `now`, which is written down.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn remember_start(&mut self, folder: &RunFolder, now: (u64, i64)) -> anyhow::Result<(u64, i64)> {
        let mut facts = folder.source()?;
        let anchor = *facts.anchor.get_or_insert(now);
        folder.set_source(&facts)?;
        Ok(anchor)
    }
}
