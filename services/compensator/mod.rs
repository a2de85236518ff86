//! compensator: keeps the raw rows, solves for the model's parameters beside the stream, gives them to kalman.
//!
//! One thread receives and answers ([`orders`]), one solves ([`learner`]), one holds the model against the newest data,
//! one searches for what is missing ([`judge`]) and one writes files ([`keeper`]); a late or slow one of them slows
//! nobody. How many rows each of them looks at follows from the time that it may take ([`budget`]). [`phase`] names the
//! states in which the receiving thread can be.

pub mod budget;
pub mod change;
pub mod current;
pub mod judge;
pub mod judgement;
pub mod keeper;
pub mod learner;
mod learning;
mod lookout;
pub mod message;
pub mod orders;
pub mod phase;
pub mod store;
mod trial;
pub mod worker;
pub mod writing;

use crate::clock::now_ns;
use crate::{
    hopeless::Hopeless,
    pulse::Pulse,
    run_folder::{Run, RunFolder, SourceFacts},
    settings::{Settings, Source},
    stop::Stop,
    wire,
};
use current::Current;
use ipc_types::{
    Command, Diagnosis, MARK_DATA, Parameters, Reply, Sample, ServiceId, State, Text,
    diagnosis::Trial,
    port::{Answerer, BytesWriter, Hub, Reader, Writer},
    topic,
};
use keeper::Keeper;
use learner::{Job, Learner, Solution};
use lookout::Lookout;
use orders::Answers;
use phase::{Asked, Phase};
use std::{collections::VecDeque, time::Duration};
use store::Store;
use trial::Challenger;
use workbench::prior::Prior;
use worker::{Cost, Rank, Worker};

const NAP: Duration = Duration::from_millis(20);
const AGAIN_NS: u64 = 100_000_000;
/// Fewer rows are not worth a solution.
const FEWEST_ROWS: u64 = 100;
/// Rows kept of a stream without end: 5 minutes at 1 kHz, 65 MB.
const LIVE_ROWS: usize = 300_000;
/// A stream without end that is faster is kept as means of this rate, Hz.
const LIVE_RATE_HZ: f64 = 1000.0;
/// Share of the time that there is at which rows are aimed: a busy machine takes longer now and then.
const AIM: f64 = 0.6;

/// The process' state; [`phase`] says how it goes on.
struct Compensator<'a> {
    run: &'a Run,
    settings: &'a Settings,
    folder: &'a RunFolder,
    facts: SourceFacts,
    samples: Reader<Sample>,
    parameters: Writer<Parameters>,
    diagnoses: Writer<Diagnosis>,
    reports: BytesWriter,
    commands: Answerer<Command, Reply>,
    pulse: Pulse,
    store: Store,
    learner: Worker<Job, Solution>,
    lookout: Lookout,
    keeper: Keeper,
    current: Current,
    /// Commands that have not been begun.
    orders: VecDeque<Command>,
    answers: Answers,
    challenger: Option<Challenger>,
    /// Number of the last sample; 0 before the first.
    sequence: u64,
    took_ns: u64,
    solved_ns: u64,
    trial: Trial,
    phase: Phase,
    /// What the learner was last asked for, and the number of that job.
    asked: Asked,
    job: u64,
    given_ns: u64,
    paused: bool,
    /// Why no solution is worth taking yet.
    waits_for: Option<String>,
    /// This process has had a solution: taken, or left for the next one to confirm.
    has_solved: bool,
    /// It was said that the disk is full.
    keeps_nothing: bool,
}

/// The process.
///
/// # Errors
/// A model that cannot be read, or broken plumbing.
pub fn run(hub: &Hub, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let settings = &run.settings;
    let stages = ["acquisition-to-compensator", "compensator", ""];
    let mut pulse = Pulse::begin(hub, run.number, ServiceId::Compensator, stages)?;
    let Some(facts) = folder.wait_for_source(stop, || Ok(pulse.beat(u64::MAX)?))? else { return Ok(()) };
    let live = settings.source == Source::Simulated;
    let rows = if live { settings.learning.rows.min(LIVE_ROWS) } else { settings.learning.rows };
    let mut store = Store::new(rows, live, facts.free_names.clone());
    if live {
        store = store.keeping_means((settings.simulation.rate_hz / LIVE_RATE_HZ) as usize);
    }
    let rank = if settings.realtime.idle_learning { Rank::Idle } else { Rank::Behind };
    let (duty, period) = (settings.learning.duty, settings.learning.period);
    let prior = settings.prior.as_deref().map(Prior::load).transpose().map_err(Hopeless::from_error)?;
    let mut learner = Learner::new(store.view(), Duration::from_secs_f64(AIM * duty * period), prior);
    let mut compensator = Compensator {
        run,
        settings,
        folder,
        current: Current::begin(settings, folder)?,
        samples: hub.reader(&topic::SAMPLE, None, settings.wait.compensator)?,
        parameters: hub.writer(&topic::PARAMETERS)?,
        diagnoses: hub.writer(&topic::DIAGNOSIS)?,
        reports: hub.bytes_writer(&topic::REPORT, topic::REPORT_BYTES)?,
        commands: hub.answerer(&topic::CONTROL)?,
        pulse,
        learner: Worker::start(duty, Cost::Thread, rank, move |job: Job| learner.solve(&job)),
        lookout: Lookout::start(&store, &settings.learning, rank, facts.name.clone()),
        store,
        keeper: keeper::start(),
        orders: VecDeque::new(),
        answers: Answers::default(),
        challenger: None,
        facts,
        sequence: 0,
        took_ns: 0,
        solved_ns: now_ns(),
        trial: Trial::default(),
        phase: Phase::Streaming,
        asked: Asked::Nothing,
        job: 0,
        given_ns: 0,
        paused: settings.freeze,
        waits_for: None,
        has_solved: false,
        keeps_nothing: false,
    };
    compensator.give()?;
    compensator.receive()?;
    compensator.pulse.become_state(State::Running)?;
    while !stop.asked() {
        compensator.turn()?;
        compensator.samples.wait(NAP)?;
    }
    compensator.receive()?;
    Ok(compensator.pulse.beat_now()?)
}

/// Whether what was done at `last` is due again.
fn is_due(last_ns: u64, period: f64) -> bool {
    now_ns() > last_ns + (period * 1e9) as u64
}

/// When it counts as done that is done now: a period after the last time, so that small delays don't add up.
fn next(last_ns: u64, period: f64) -> u64 {
    let period_ns = (period * 1e9) as u64;
    (last_ns + period_ns).max(now_ns().saturating_sub(period_ns / 2))
}

impl Compensator<'_> {
    fn turn(&mut self) -> anyhow::Result<()> {
        self.receive()?;
        let settled = self.store.settle();
        if let Some((keeping, result)) = self.keeper.result()? {
            self.kept(keeping, result)?;
        }
        self.obey()?;
        // While a model is being written none follows it.
        if !self.keeper.is_busy()
            && let Some(solution) = self.learner.result()?
        {
            self.take(solution)?;
        }
        self.look()?;
        match self.phase {
            Phase::Streaming => {
                self.learn();
                self.look_closer();
            }
            Phase::Ended if settled && !self.learner.is_busy() && !self.keeper.is_busy() => self.solve_once_more()?,
            Phase::Ended | Phase::Done => {}
        }
        if now_ns() > self.given_ns + AGAIN_NS {
            self.give()?;
        }
        if self.phase == Phase::Done {
            self.pulse.become_state(State::Finished)?;
        }
        if self.pulse.is_due() {
            self.pulse.health.learning = Text::new(&self.learning_says());
        }
        self.pulse.beat(if self.settings.lossless() { 128 } else { u64::MAX })?;
        Ok(())
    }

    fn receive(&mut self) -> anyhow::Result<()> {
        let lossless = self.settings.lossless();
        while let Some(sample) = self.samples.take()? {
            let took_ns = now_ns();
            if sample.run != self.run.number || sample.sequence <= self.sequence {
                continue;
            }
            let missed = sample.sequence - self.sequence - 1;
            if missed > 0 && lossless {
                // The source gives the missing ones again.
                continue;
            }
            if self.sequence > 0 {
                self.pulse.health.lost += missed;
            }
            self.sequence = sample.sequence;
            self.took_ns = took_ns;
            if sample.mark == MARK_DATA {
                self.pulse.health.received += 1;
                self.store.push(wire::row_of(&sample));
                self.pulse.health.stages[0].record(took_ns.saturating_sub(sample.acquisition_gave_ns));
                self.pulse.health.stages[1].record(now_ns().saturating_sub(took_ns));
            } else if self.phase == Phase::Streaming {
                self.phase = Phase::Ended;
            }
            self.pulse.health.acknowledged = self.sequence;
            if lossless {
                self.pulse.beat(128)?;
            }
        }
        Ok(())
    }

    fn give(&mut self) -> anyhow::Result<()> {
        let mut message = *self.current.message();
        message.run = self.run.number;
        message.samples = self.current.samples;
        message.paused = u32::from(self.paused || self.waits_for.is_some());
        message.last = u32::from(self.phase == Phase::Done);
        message.compensator_took_ns = self.took_ns;
        self.given_ns = now_ns();
        message.compensator_gave_ns = self.given_ns;
        // Diagnoses are rare. Who reads these parameters has got the last one before them.
        self.diagnoses.connect()?;
        self.reports.connect()?;
        self.parameters.give(message)?;
        self.pulse.health.sent += 1;
        self.pulse.health.epoch = message.epoch;
        Ok(())
    }
}
