//! compensator: keeps the raw rows, solves for the model's parameters beside the stream, gives them to kalman.
//!
//! One thread receives and answers, another one solves ([`learner`]); a late or slow solution slows nobody.

pub mod current;
pub mod learner;
pub mod store;

use crate::{
    clock::now_ns,
    pulse::Pulse,
    run_folder::{Learned, Run, RunFolder},
    settings::Settings,
    stop::Stop,
    wire,
};
use current::Current;
use ipc_types::{
    MARK_DATA, Parameters, Sample, ServiceId, State,
    port::{Hub, Reader, Writer},
    topic,
};
use learner::{Job, Learner, Solution, not_excited};
use std::time::Duration;
use store::Store;

const NAP: Duration = Duration::from_millis(20);
const AGAIN_NS: u64 = 100_000_000;
/// Fewer rows are not worth a solution.
const FEWEST_ROWS: usize = 100;

/// How far the last solution, over the whole run, is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    /// The stream goes on.
    Not,
    /// It has ended.
    Ended,
    /// The last solution is being sought.
    Solving,
    /// Everything is done.
    Done,
}

struct Compensator<'a> {
    run: &'a Run,
    settings: &'a Settings,
    folder: &'a RunFolder,
    samples: Reader<Sample>,
    parameters: Writer<Parameters>,
    pulse: Pulse,
    store: Store,
    learner: Learner,
    current: Current,
    /// Number of the last sample; 0 before the first.
    sequence: u64,
    took_ns: u64,
    solved_ns: u64,
    job: u64,
    given_ns: u64,
    ending: Ending,
    paused_for: Option<String>,
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
    let current = Current::begin(settings, folder)?;
    let samples = hub.reader(&topic::SAMPLE, None, settings.wait.compensator)?;
    let store = Store::new(settings.learning.rows, facts.free_names);
    let learner = Learner::start(store.view(), settings.learning.duty);
    let mut compensator = Compensator {
        run,
        settings,
        folder,
        samples,
        parameters: hub.writer(&topic::PARAMETERS)?,
        pulse,
        store,
        learner,
        current,
        sequence: 0,
        took_ns: 0,
        solved_ns: now_ns(),
        job: 0,
        given_ns: 0,
        ending: Ending::Not,
        paused_for: None,
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

impl Compensator<'_> {
    fn turn(&mut self) -> anyhow::Result<()> {
        self.receive()?;
        let settled = self.store.settle();
        if let Some(solution) = self.learner.solution()? {
            self.take(solution)?;
        }
        match self.ending {
            Ending::Not => self.learn(),
            Ending::Ended if settled && !self.learner.is_busy() => self.solve_once_more()?,
            _ => {}
        }
        if now_ns() > self.given_ns + AGAIN_NS {
            self.give()?;
        }
        if self.ending == Ending::Done {
            self.pulse.become_state(State::Finished)?;
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
            } else if self.ending == Ending::Not {
                self.ending = Ending::Ended;
            }
            self.pulse.health.acknowledged = self.sequence;
            if lossless {
                self.pulse.beat(128)?;
            }
        }
        Ok(())
    }

    /// Asks for a solution, where one is due.
    fn learn(&mut self) {
        let learning = &self.settings.learning;
        let due = now_ns() > self.solved_ns + (learning.period * 1e9) as u64;
        if self.settings.freeze || !due || !self.learner.is_ready() || self.pulse.health.received < FEWEST_ROWS as u64 {
            return;
        }
        self.solved_ns = now_ns();
        self.job += 1;
        self.learner.ask(Job { start: self.current.start().clone(), window: Some(learning.window), number: self.job });
    }

    fn solve_once_more(&mut self) -> anyhow::Result<()> {
        if self.settings.freeze {
            return self.finish(None, 0);
        }
        self.ending = Ending::Solving;
        self.job += 1;
        let start = self.current.start_of_last().clone();
        self.learner.ask(Job { start, window: None, number: self.job });
        Ok(())
    }

    fn take(&mut self, solution: Solution) -> anyhow::Result<()> {
        if solution.number != self.job {
            return Ok(());
        }
        let last = self.ending == Ending::Solving;
        let without = match solution.model {
            Err(error) => Some(error.to_string()),
            Ok(model) => match not_excited(&model) {
                Some(reason) if !last => Some(reason),
                _ => {
                    self.current.take(model, self.folder)?;
                    None
                }
            },
        };
        if self.paused_for != without {
            match &without {
                Some(reason) => tracing::info!("learning rests: {reason}"),
                None => tracing::info!("learning"),
            }
            self.paused_for.clone_from(&without);
        }
        tracing::debug!(epoch = self.current.epoch(), rows = solution.rows, took = ?solution.took, "solved");
        self.current.samples = if without.is_none() { solution.rows as u64 } else { self.current.samples };
        if last { self.finish(without, solution.rows) } else { self.give() }
    }

    fn finish(&mut self, without: Option<String>, rows: usize) -> anyhow::Result<()> {
        self.ending = Ending::Done;
        self.folder.set_learned(&Learned { without, rows, axes: Vec::new() })?;
        self.give()
    }

    fn give(&mut self) -> anyhow::Result<()> {
        let mut message = *self.current.message();
        message.run = self.run.number;
        message.samples = self.current.samples;
        message.paused = u32::from(self.settings.freeze || self.paused_for.is_some());
        message.last = u32::from(self.ending == Ending::Done);
        message.compensator_took_ns = self.took_ns;
        self.given_ns = now_ns();
        message.compensator_gave_ns = self.given_ns;
        self.parameters.give(message)?;
        self.pulse.health.sent += 1;
        self.pulse.health.epoch = message.epoch;
        Ok(())
    }
}
