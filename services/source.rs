//! Where rows come from: a log or a simulated vehicle, behind one face.

use crate::{
    hopeless::Hopeless,
    live::{Address, Content, Joined, Stream, timeline::Given},
    run_folder::{Run, RunFolder, SourceFacts},
    settings::{Settings, SimulatedReference, Source},
    stop::Stop,
    vault::Vault,
};
use anyhow::{anyhow, bail};
use gyro_model::{
    Axis, Row,
    faults::held::{Held, LOOKED_AT},
    simulate::{Hidden, Injection, Reference, Scenario, SensorSpec, Simulator},
};
use ipc_types::health::SourceHealth;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};
use workbench::{
    log::{Options, Reader},
    model_file::ModelFile,
};

/// The source of one run.
pub struct Feed {
    rows: Rows,
    /// Read ahead, so that what the source says of itself is known before it is asked for.
    next: Next,
    given: u64,
    /// A live source's own time of the stream's beginning, ns.
    start_ns: i128,
    settings: Settings,
    taken_up: bool,
    rejected: u64,
    /// Effects switched on while it runs: after which row, as it was said.
    switched: Vec<(u64, String)>,
}

/// The last row that was given of a source that goes on while this process dies.
#[derive(Clone, Copy, Debug)]
struct Kept {
    sequence: u64,
    given: Given,
}

/// What comes next.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one of it, and a box would be an allocation a row")]
pub enum Next {
    /// This row, and when it was read, ns; 0 where it was there all along.
    Row(Row, u64),
    /// It is still to come.
    Later,
    /// Nothing.
    End,
}

impl Next {
    /// Of a source whose rows are there.
    fn of(row: Option<Row>) -> Self {
        row.map_or(Self::End, |row| Self::Row(row, 0))
    }
}

enum Rows {
    Log { path: PathBuf, options: Options, reader: Box<Reader>, held: Held, injection: Injection },
    Stream { stream: Stream, injection: Injection, kept: Option<Vault<Kept>>, reference: Option<Box<Joined>> },
    Simulated { scenario: Box<Scenario>, simulator: Box<Simulator>, rows: Option<u64> },
}

/// The simulated vehicle of these settings.
///
/// # Errors
/// A motion or an effect that is not known.
pub fn scenario(settings: &Settings) -> anyhow::Result<Scenario> {
    let simulation = &settings.simulation;
    let mut sensor = SensorSpec::random(simulation.seed);
    let temperature = &mut sensor.temperature;
    temperature.swing = simulation.swing.unwrap_or(temperature.swing);
    temperature.period = simulation.swing_period.unwrap_or(temperature.period);
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
fn injection(content: &Content, settings: &Settings) -> anyhow::Result<Injection> {
    let axis = content.referenced.first().or(content.gyros.first()).copied().unwrap_or(Axis::Z);
    let mut injection = Injection::new(axis);
    for text in &settings.hide {
        injection.hide(text).map_err(Hopeless::from_error)?;
    }
    Ok(injection)
}

/// What the beginning of a log shows of readings that stand in several rows.
fn held(path: &Path, options: &Options) -> anyhow::Result<Held> {
    let reader = Reader::open(path, options).map_err(Hopeless::from_error)?;
    // A log that is damaged further on is refused where it is.
    let rows: Vec<Row> = reader.map_while(Result::ok).take(LOOKED_AT).collect();
    Ok(Held::of(&rows))
}

impl Feed {
    /// Opens the source at its first row, and leaves what it says of itself in the run's folder. While the row is still to
    /// come `meanwhile` is called again and again; `None` when asked to stop before.
    ///
    /// # Errors
    /// Where it cannot be read (another attempt would be of no use), and those of `meanwhile`.
    pub fn open(
        run: &Run,
        folder: &RunFolder,
        stop: &Stop,
        meanwhile: impl FnMut(&SourceHealth) -> anyhow::Result<()>,
    ) -> anyhow::Result<Option<Self>> {
        let mut before: Option<Kept> = None;
        let settings = &run.settings;
        let options = Options {
            columns: settings.columns.clone(),
            map: settings.map.clone(),
            reference: settings.reference_file(),
            dbc: settings.dbc.clone(),
            ..Options::default()
        };
        let rows = match &settings.source {
            Source::Log(path) => {
                let reader = Box::new(Reader::open(path, &options).map_err(Hopeless::from_error)?);
                let injection = injection(&Content::of(reader.layout()), settings)?;
                let held = held(path, &options)?;
                if let Some(says) = held.says() {
                    tracing::warn!("{says}");
                }
                Rows::Log { path: path.clone(), options, reader, held, injection }
            }
            Source::Stream(path) => {
                let address = Address::of_pipe(path.clone(), settings.dbc.clone());
                let opened = Stream::open(&address, &options, None, stop, meanwhile)?;
                let Some(stream) = opened else { return Ok(None) };
                let injection = injection(&stream.origin().content, settings)?;
                Rows::Stream { stream, injection, kept: None, reference: None }
            }
            Source::Live(address) => {
                let kept: Vault<Kept> = Vault::open(&folder.acquisition(), run.number)?;
                before = kept.load();
                let reference = settings.reference_address()?;
                let options = Options { reference: reference.as_ref().map(|of| of.to_string().into()), ..options };
                let reference = reference.as_ref().map(|address| Joined::open(address, &options, stop));
                let reference = reference.transpose()?.map(Box::new);
                let opened = Stream::open(address, &options, before.map(|kept| kept.given), stop, meanwhile)?;
                let Some(stream) = opened else { return Ok(None) };
                let injection = injection(&stream.origin().content, settings)?;
                Rows::Stream { stream, injection, kept: Some(kept), reference }
            }
            Source::Simulated => {
                let scenario = Box::new(scenario(settings).map_err(Hopeless::from_error)?);
                let rows = scenario.seconds.is_finite().then(|| (scenario.seconds * scenario.rate_hz).round() as u64);
                Rows::Simulated { simulator: Box::new(Simulator::new(&scenario)), scenario, rows }
            }
        };
        let mut feed = Self {
            rows,
            next: Next::Later,
            settings: settings.clone(),
            given: before.map_or(0, |kept| kept.sequence),
            start_ns: 0,
            taken_up: false,
            rejected: 0,
            switched: Vec::new(),
        };
        feed.fill(Duration::ZERO)?;
        let before = folder.source().ok();
        feed.switched = before.as_ref().map(|facts| facts.switched.clone()).unwrap_or_default();
        folder.set_source(&feed.facts(before.and_then(|facts| facts.anchor)))?;
        feed.write_truth(folder)?;
        Ok(Some(feed))
    }

    fn facts(&self, anchor: Option<(u64, i64)>) -> SourceFacts {
        let of_log = |name: String, content: &Content, start_ns| SourceFacts {
            name,
            sha256: None,
            free_names: content.free_names.clone(),
            axes: content.gyros.iter().map(ToString::to_string).collect(),
            start_ns,
            anchor,
            switched: self.switched.clone(),
        };
        match &self.rows {
            Rows::Log { reader, .. } => {
                let log = reader.log();
                let name = Path::new(log).file_name().unwrap_or(log.as_ref()).to_string_lossy().into_owned();
                of_log(name, &Content::of(reader.layout()), reader.start_ns().unwrap_or(0))
            }
            Rows::Stream { stream, .. } => {
                let origin = stream.origin();
                of_log(stream.name().to_owned(), &origin.content, origin.start_ns)
            }
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
            Rows::Log { .. } | Rows::Stream { .. } => Ok(()),
        }
    }

    /// Looks for the next row, for `patience` where it is still to come.
    fn fill(&mut self, patience: Duration) -> anyhow::Result<()> {
        match &mut self.rows {
            Rows::Log { reader, held, injection, .. } => {
                for (_, text) in self.switched.iter().filter(|(after, _)| self.taken_up && *after + 1 == self.given) {
                    injection.hide(text)?;
                }
                let mut row = reader.next_row().map_err(Hopeless::from_error)?;
                if let Some(row) = &mut row {
                    held.take(row);
                }
                self.next = Next::of(row.map(|row| injection.spoil(row)));
                self.rejected = reader.rows_faulty();
            }
            Rows::Stream { stream, injection, reference, .. } => {
                self.next = match stream.next(patience)? {
                    None => Next::Later,
                    Some(None) => Next::End,
                    Some(Some(mut arrival)) => {
                        if let Some(reference) = reference {
                            reference.join(&mut arrival.row)?;
                        }
                        self.start_ns = arrival.start_ns;
                        Next::Row(injection.spoil(arrival.row), arrival.read_ns)
                    }
                };
            }
            Rows::Simulated { simulator, rows, .. } => {
                // One row is always read ahead.
                for (_, text) in self.switched.iter().filter(|(after, _)| self.taken_up && *after + 1 == self.given) {
                    simulator.hide(Hidden::parse(text, simulator.sensor().axis)?);
                }
                self.next = Next::of(rows.is_none_or(|rows| self.given < rows).then(|| simulator.step().row));
            }
        }
        Ok(())
    }

    /// What comes next; it is waited for at most `patience`.
    ///
    /// # Errors
    /// A log that is damaged from here on.
    pub fn next(&mut self, patience: Duration) -> anyhow::Result<Next> {
        if matches!(self.next, Next::Later) {
            self.fill(patience)?;
        }
        Ok(self.next)
    }

    /// The next row is given, and known to be by whoever takes this up.
    pub fn count(&mut self) {
        self.given += 1;
        if let (Rows::Stream { kept: Some(kept), .. }, Next::Row(row, arrived_ns)) = (&mut self.rows, self.next) {
            let given = Given { time_ns: row.t_ns, arrived_ns, start_ns: self.start_ns };
            kept.save(&Kept { sequence: self.given, given });
        }
    }

    /// On to the row after it.
    ///
    /// # Errors
    /// As [`Self::next`].
    pub fn advance(&mut self) -> anyhow::Result<()> {
        self.fill(Duration::ZERO)
    }

    /// Rows given since the beginning.
    #[must_use]
    pub fn given(&self) -> u64 {
        self.given
    }

    /// Rows left out so far, or of which a value was.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        if let Rows::Stream { stream, .. } = &self.rows { stream.health().faulty() } else { self.rejected }
    }

    /// How a live source is; of others there is nothing to say.
    #[must_use]
    pub fn health(&self) -> SourceHealth {
        if let Rows::Stream { stream, .. } = &self.rows { stream.health() } else { SourceHealth::default() }
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
            Rows::Log { injection, .. } | Rows::Stream { injection, .. } => injection.is_on(),
        }
    }

    /// Switches an effect on from the next row on, and writes it down, so that it is on again after a crash.
    ///
    /// # Errors
    /// An unknown effect or parameter, or a source that nothing can be hidden in.
    pub fn hide(&mut self, text: &str, folder: &RunFolder) -> anyhow::Result<()> {
        match &mut self.rows {
            Rows::Simulated { simulator, .. } => simulator.hide(Hidden::parse(text, simulator.sensor().axis)?),
            Rows::Log { injection, .. } | Rows::Stream { injection, .. } => injection.hide(text)?,
        }
        self.switched.push((self.given, text.to_owned()));
        let anchor = folder.source()?.anchor;
        folder.set_source(&self.facts(anchor))?;
        self.write_truth(folder)
    }

    /// Begins again, and passes over the first `rows` rows (all, where there are fewer). That takes the longer, the longer
    /// the run: `meanwhile` is called again and again, and when asked to stop it is left.
    ///
    /// # Errors
    /// A log that cannot be read again, and those of `meanwhile`.
    pub fn begin_again(
        &mut self,
        rows: u64,
        stop: &Stop,
        mut meanwhile: impl FnMut() -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        match &mut self.rows {
            Rows::Log { path, options, reader, held, injection: hidden } => {
                **reader = Reader::open(path, options).map_err(Hopeless::from_error)?;
                *held = self::held(path, options)?;
                *hidden = injection(&Content::of(reader.layout()), &self.settings)?;
            }
            Rows::Stream { stream, .. } => bail!("{} cannot be read again", stream.name()),
            Rows::Simulated { scenario, simulator, .. } => **simulator = Simulator::new(scenario),
        }
        self.given = 0;
        self.taken_up = true;
        self.fill(Duration::ZERO)?;
        while self.given < rows && matches!(self.next, Next::Row(..)) && !stop.asked() {
            self.count();
            self.advance()?;
            meanwhile()?;
        }
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

#[cfg(test)]
mod tests {
    use super::{Feed, Run, RunFolder, Stop};
    use crate::settings::Settings;
    use ipc_types::domain::Domain;

    #[test]
    fn a_source_that_begins_again_says_so_all_the_way_and_can_be_stopped() {
        let place = tempfile::tempdir().unwrap();
        let domain = Domain::new(place.path(), "again").unwrap();
        std::fs::create_dir(domain.folder()).unwrap();
        let run = Run { number: 1, began_ns: 0, program: [0; 5], settings: Settings::default() };
        let stop = Stop::default();
        let mut feed = Feed::open(&run, &RunFolder::of(&domain), &stop, |_| Ok(())).unwrap().unwrap();
        let mut beats = 0;
        let mut beat = || {
            beats += 1;
            if beats == 1500 {
                stop.ask();
            }
            Ok(())
        };
        feed.begin_again(1000, &stop, &mut beat).unwrap();
        assert_eq!(feed.given(), 1000);
        feed.begin_again(1000, &stop, &mut beat).unwrap();
        assert_eq!((feed.given(), beats), (500, 1500));
    }
}
