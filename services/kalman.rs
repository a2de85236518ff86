//! kalman: takes samples, compensates and filters them with the parameters in use, gives estimates.
//!
//! Per sample it allocates nothing but iceoryx2's one loan, takes no lock and logs nothing.

use crate::clock::now_ns;
use crate::{
    pulse::Pulse,
    rate_out::{self, ring::Ring},
    run_folder::{Run, RunFolder},
    settings::Settings,
    source_clock::SourceClock,
    stop::Stop,
    vault::Vault,
    wire,
};
use gyro_model::{
    Model,
    estimator::{Estimator, Snapshot},
};
use ipc_types::{
    Estimate, Histogram, MARK_DATA, MARK_END, Parameters, Sample, ServiceId, State,
    estimate::FLAG_STALE_PARAMETERS,
    port::{Hub, Reader, Writer},
    topic,
    wait::Wait,
};
use std::{path::Path, time::Duration};
use workbench::model_file;

/// Parameters that are silent for longer are stale: the compensator gives them ten times a second, ns.
const STALE_NS: u64 = 1_000_000_000;
/// Samples between two savings, and between two acknowledgements of an unpaced stream.
const SAVE_EVERY: u64 = 128;
const SAVE_NS: u64 = 50_000_000;
const NAP: Duration = Duration::from_millis(20);

/// What survives this process.
#[derive(Clone, Copy, Debug)]
struct Saved {
    sequence: u64,
    ended: bool,
    received: u64,
    sent: u64,
    lost: u64,
    rejected: u64,
    clock: SourceClock,
    snapshot: Snapshot,
}

/// The process' state.
pub struct Kalman {
    run: u64,
    folder: RunFolder,
    lossless: bool,
    samples: Reader<Sample>,
    parameters: Reader<Parameters>,
    estimates: Writer<Estimate>,
    /// Shared memory that the rate goes into, where it is wanted.
    ring: Option<Ring>,
    pulse: Pulse,
    vault: Vault<Saved>,
    estimator: Estimator,
    epoch: Option<u64>,
    parameters_ns: u64,
    /// Number of the last sample that was taken, and of the last that is saved.
    sequence: u64,
    saved: u64,
    saved_ns: u64,
    ended: bool,
    /// Whether the source goes on by itself: a replay's time may run slower than this machine's clock.
    is_live: bool,
    clock: SourceClock,
    newest: Option<Parameters>,
    /// What an earlier life left, until there is a model to go on with.
    left: Option<Snapshot>,
}

/// The process.
///
/// # Errors
/// Broken plumbing.
pub fn run(hub: &Hub, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let mut kalman = Kalman::open(hub, run.number, &run.settings, folder)?;
    while !stop.asked() {
        kalman.turn()?;
        kalman.wait(NAP)?;
    }
    kalman.turn()?;
    kalman.save();
    Ok(kalman.pulse.beat_now()?)
}

/// The ring that the rate goes into. Without one the estimates still flow to everybody else.
fn open_ring(path: &Path, run: u64) -> Option<Ring> {
    match Ring::create(path, run).and_then(|()| Ring::open(path, run)) {
        Ok(ring) => Some(ring),
        Err(error) => {
            tracing::error!("the rate does not go into shared memory: {error:#}");
            None
        }
    }
}

impl Kalman {
    /// Opens the ports and takes up what an earlier life saved.
    ///
    /// # Errors
    /// Broken plumbing.
    pub fn open(hub: &Hub, run: u64, settings: &Settings, folder: &RunFolder) -> anyhow::Result<Self> {
        let stages = ["acquisition-to-kalman", "kalman", "sample-to-estimate"];
        let pulse = Pulse::begin(hub, run, ServiceId::Kalman, stages)?;
        let samples = hub.reader(&topic::SAMPLE, None, settings.wait.kalman)?;
        let mut kalman = Self {
            run,
            folder: folder.clone(),
            lossless: settings.lossless(),
            parameters: hub.reader(&topic::PARAMETERS, None, Wait::Event)?,
            estimates: hub.writer(&topic::ESTIMATE)?,
            samples,
            ring: settings.ring(folder.instance()).and_then(|path| open_ring(&path, run)),
            pulse,
            vault: Vault::open(&folder.kalman(), run)?,
            estimator: Estimator::new(settings.filter.options()),
            epoch: None,
            parameters_ns: 0,
            sequence: 0,
            saved: 0,
            saved_ns: 0,
            ended: false,
            is_live: settings.source.is_live(),
            clock: SourceClock::default(),
            newest: None,
            left: None,
        };
        if let Some(saved) = kalman.vault.load() {
            kalman.left = Some(saved.snapshot);
            (kalman.sequence, kalman.saved, kalman.ended) = (saved.sequence, saved.sequence, saved.ended);
            kalman.clock = saved.clock;
            let health = &mut kalman.pulse.health;
            (health.received, health.sent) = (saved.received, saved.sent);
            (health.lost, health.rejected) = (saved.lost, saved.rejected);
            health.acknowledged = saved.sequence;
            tracing::info!("taken up after sample {}", saved.sequence);
        }
        if folder.model().exists() {
            // What the compensator gave last: nobody need wait for its next word.
            let model = model_file::load(&folder.model(), &kalman.free_names()?)?.model;
            kalman.use_model(&model);
        }
        // The first look connects us, so that nothing that is given from now on is missed.
        kalman.newest = kalman.parameters.newest()?;
        Ok(kalman)
    }

    /// Takes everything that waits.
    ///
    /// # Errors
    /// Broken plumbing.
    pub fn turn(&mut self) -> anyhow::Result<()> {
        self.take_parameters()?;
        if self.epoch.is_none() {
            self.pulse.beat(u64::MAX)?;
            return Ok(());
        }
        let mut taken = 0;
        while let Some(sample) = self.samples.take()? {
            self.take(&sample)?;
            taken += 1;
            if taken % 64 == 0 {
                self.take_parameters()?;
            }
        }
        if self.sequence > self.saved && now_ns() > self.saved_ns + SAVE_NS {
            self.save();
        }
        self.pulse.become_state(if self.ended { State::Finished } else { State::Running })?;
        self.pulse.beat(if self.lossless { 1 } else { u64::MAX })?;
        Ok(())
    }

    /// Sleeps until a sample waits, or so long.
    ///
    /// # Errors
    /// Broken plumbing.
    pub fn wait(&self, longest: Duration) -> anyhow::Result<()> {
        let longest = if self.epoch.is_none() { Duration::from_millis(2) } else { longest };
        if self.epoch.is_none() {
            std::thread::sleep(longest);
            return Ok(());
        }
        Ok(self.samples.wait(longest)?)
    }

    /// Whether the stream has ended.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    fn take(&mut self, sample: &Sample) -> anyhow::Result<()> {
        let took_ns = now_ns();
        if sample.run != self.run || sample.sequence <= self.sequence {
            return Ok(());
        }
        let missed = sample.sequence - self.sequence - 1;
        if missed > 0 && self.lossless {
            // The source gives the missing ones again.
            return Ok(());
        }
        self.pulse.health.lost += missed;
        self.sequence = sample.sequence;
        let mut message = if sample.mark == MARK_DATA {
            self.pulse.health.received += 1;
            let estimate = self.estimator.step(&wire::row_of(sample));
            self.pulse.health.rejected += u64::from(wire::is_rejected(&estimate));
            if !self.is_live {
                self.clock = SourceClock::default();
            }
            self.clock.take(sample.time_ns, sample.arrived_ns);
            let message = wire::message_of(&estimate, sample, took_ns);
            Estimate { valid_clock_ns: self.clock.at(message.valid_ns).unwrap_or(sample.arrived_ns), ..message }
        } else {
            self.ended = sample.mark == MARK_END;
            Estimate {
                run: sample.run,
                sequence: sample.sequence,
                mark: sample.mark,
                valid_clock_ns: sample.arrived_ns,
                arrived_ns: sample.arrived_ns,
                acquisition_gave_ns: sample.acquisition_gave_ns,
                kalman_took_ns: took_ns,
                ..Estimate::default()
            }
        };
        if took_ns > self.parameters_ns + STALE_NS {
            message.flags |= FLAG_STALE_PARAMETERS;
        }
        message.kalman_gave_ns = now_ns();
        let gave_ns = message.kalman_gave_ns;
        if let Some(ring) = &self.ring {
            ring.give(&rate_out::row_of(&message));
        }
        self.estimates.give(message)?;
        self.pulse.health.sent += u64::from(sample.mark == MARK_DATA);
        let stages: &mut [Histogram; 3] = &mut self.pulse.health.stages;
        stages[0].record(took_ns.saturating_sub(sample.acquisition_gave_ns));
        stages[1].record(gave_ns.saturating_sub(took_ns));
        stages[2].record(gave_ns.saturating_sub(sample.arrived_ns));
        if self.sequence >= self.saved + SAVE_EVERY || self.ended {
            self.save();
            if self.lossless {
                self.pulse.beat(SAVE_EVERY)?;
            }
        }
        Ok(())
    }

    /// Takes new parameters between two samples, whole.
    fn take_parameters(&mut self) -> anyhow::Result<()> {
        let message = match self.newest.take() {
            Some(message) => message,
            None => match self.parameters.newest()? {
                Some(message) => message,
                None => return Ok(()),
            },
        };
        if message.run != self.run {
            return Ok(());
        }
        self.parameters_ns = now_ns();
        if self.epoch == Some(message.epoch) {
            return Ok(());
        }
        match wire::model_of(&message, &self.free_names()?) {
            Ok(model) => self.use_model(&model),
            Err(error) => tracing::error!("parameters of epoch {} are refused: {error:#}", message.epoch),
        }
        Ok(())
    }

    fn use_model(&mut self, model: &Model) {
        self.estimator.set_model(model);
        if let Some(snapshot) = self.left.take() {
            self.estimator.restore(&snapshot);
        }
        self.epoch = Some(model.epoch);
        self.pulse.health.epoch = model.epoch;
    }

    /// Names of the free channels, which a user's own effects are written in.
    fn free_names(&self) -> anyhow::Result<Vec<String>> {
        Ok(self.folder.source()?.free_names)
    }

    fn save(&mut self) {
        if self.epoch.is_none() {
            return;
        }
        let health = &self.pulse.health;
        self.vault.save(&Saved {
            sequence: self.sequence,
            ended: self.ended,
            received: health.received,
            sent: health.sent,
            lost: health.lost,
            rejected: health.rejected,
            clock: self.clock,
            snapshot: self.estimator.save(),
        });
        (self.saved, self.saved_ns) = (self.sequence, now_ns());
        self.pulse.health.acknowledged = self.sequence;
    }
}
