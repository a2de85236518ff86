//! compensator: keeps the raw rows, solves for the model's parameters beside the stream, gives them to kalman.
//!
//! One thread receives and answers ([`orders`]), one solves ([`learner`]), one holds the model against the newest data,
//! one searches for what is missing ([`judge`]) and one writes files ([`keeper`]); a late or slow one of them slows
//! nobody. How many rows each of them looks at follows from the time that it may take ([`budget`]).

pub mod budget;
pub mod change;
pub mod current;
pub mod judge;
pub mod keeper;
pub mod learner;
pub mod message;
pub mod orders;
pub mod store;
pub mod worker;

use crate::{
    agreement::Agreement,
    clock::now_ns,
    pulse::Pulse,
    run_folder::{Learned, LearnedAxis, Run, RunFolder, SourceFacts},
    settings::{Settings, Source},
    stop::Stop,
    wire,
};
use budget::Budget;
use change::Windows;
use current::{Current, Proposal};
use gyro_model::{Model, fit::FitError, units};
use ipc_types::{
    Command, Diagnosis, MARK_DATA, Parameters, Reply, Sample, ServiceId, State,
    diagnosis::{Trial, TrialState},
    port::{Answerer, BytesWriter, Hub, Reader, Writer},
    topic,
};
use judge::{Held, Judgement};
use keeper::{Keeper, Keeping, Then, Writing};
use learner::{Job, Learner, Solution, Task, not_excited};
use orders::Answers;
use std::{collections::VecDeque, sync::Arc, time::Duration};
use store::Store;
use worker::{Cost, Rank, Worker};

const NAP: Duration = Duration::from_millis(20);
const AGAIN_NS: u64 = 100_000_000;
/// Fewer rows are not worth a solution.
const FEWEST_ROWS: u64 = 100;
/// Rows kept of a stream without end: 5 minutes at 1 kHz, 65 MB.
const LIVE_ROWS: usize = 300_000;
/// A stream without end that is faster is kept as means of this rate, Hz.
const LIVE_RATE_HZ: f64 = 1000.0;
/// A search may take so many of its periods.
const SEARCH_PERIODS: f64 = 4.0;
/// Share of the time that there is at which rows are aimed: a busy machine takes longer now and then.
const AIM: f64 = 0.6;
/// Standard errors from which on an effect on trial is certain to be there.
const CERTAIN: f64 = 5.0;
/// Who asks for a trial is told after this at the latest that it goes on, ns.
const TRIAL_TOLD_NS: u64 = 2_500_000_000;
/// A trial that is not won by then is given up, ns.
const TRIAL_NS: u64 = 120_000_000_000;

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

/// Another model, beside the one in use.
#[derive(Debug)]
struct Challenger {
    command: Command,
    model: Model,
    since_ns: u64,
    /// Whether its next turn is after a solution for the model in use.
    waits: bool,
    /// Whether it is tried on everything that came, after the stream's end.
    last: bool,
}

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
    judge: Worker<judge::Job, Result<Held, FitError>>,
    searcher: Worker<judge::Job, Result<Judgement, FitError>>,
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
    judged_ns: u64,
    judged: u64,
    /// Grows by one whenever what was seen so far is forgotten.
    data: u64,
    /// When the sensor became another one, last; ns of the source, 0 where it never did.
    changed_ns: i64,
    /// What the last search found, and the number of searches.
    found: Option<Arc<Judgement>>,
    searches: u64,
    agreement: Agreement,
    trial: Trial,
    job: u64,
    given_ns: u64,
    ending: Ending,
    paused: bool,
    rests_for: Option<String>,
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
    let (to_judge, to_search) = (store.view(), store.view());
    let rank = if settings.realtime.idle_learning { Rank::Idle } else { Rank::Behind };
    let (duty, period) = (settings.learning.duty, settings.learning.diagnosis);
    let mut learner = Learner::new(store.view(), Duration::from_secs_f64(AIM * duty * settings.learning.period));
    let patience = Duration::from_secs_f64(AIM * duty * period * SEARCH_PERIODS);
    let mut budget = Budget::new(judge::ROWS.0, judge::ROWS.1, patience);
    let patience = Duration::from_secs_f64(AIM * duty * period);
    let mut holds = Budget::new(judge::FEWEST_HELD, judge::ROWS.1, patience);
    let rows = judge::Rows::default();
    let (judged_rows, name) = (rows.clone(), facts.name.clone());
    let mut windows = Windows::default();
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
        store,
        learner: Worker::start(duty, Cost::Thread, rank, move |job: Job| learner.solve(&job)),
        judge: Worker::start(duty, Cost::Thread, rank, move |job| {
            judge::hold(&to_judge, &judged_rows, &mut holds, &mut windows, &name, job)
        }),
        searcher: Worker::start(duty, Cost::Wall, rank, move |job| judge::search(&to_search, &rows, &mut budget, job)),
        keeper: keeper::start(),
        orders: VecDeque::new(),
        answers: Answers::default(),
        challenger: None,
        facts,
        sequence: 0,
        took_ns: 0,
        solved_ns: now_ns(),
        judged_ns: now_ns(),
        judged: 0,
        data: 0,
        changed_ns: 0,
        found: None,
        searches: 0,
        agreement: Agreement::default(),
        trial: Trial::default(),
        job: 0,
        given_ns: 0,
        ending: Ending::Not,
        paused: settings.freeze,
        rests_for: None,
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
        if let Some(Ok(found)) = self.searcher.result()? {
            self.found = Some(Arc::new(found));
        }
        if let Some(Ok(held)) = self.judge.result()? {
            self.report(&held)?;
        }
        match self.ending {
            Ending::Not => {
                self.learn();
                self.look_closer();
            }
            Ending::Ended if settled && !self.learner.is_busy() && !self.keeper.is_busy() => self.solve_once_more()?,
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

    fn ask(&mut self, task: Task) {
        self.job += 1;
        self.learner.ask(Job { start: self.current.start().clone(), task, number: self.job });
    }

    /// Asks for a solution, where one is due: of the challenger first.
    fn learn(&mut self) {
        let learning = &self.settings.learning;
        if !is_due(self.solved_ns, learning.period)
            || !self.learner.is_ready()
            || self.keeper.is_busy()
            || self.pulse.health.received < FEWEST_ROWS
        {
            return;
        }
        let task = match &mut self.challenger {
            Some(challenger) if !challenger.waits || self.paused => {
                challenger.waits = true;
                Task::Try(Box::new(challenger.model.clone()))
            }
            _ if self.paused => return,
            challenger => {
                // The model in use is learned on during a long trial.
                if let Some(challenger) = challenger {
                    challenger.waits = false;
                }
                Task::Learn(learning.window)
            }
        };
        self.solved_ns = next(self.solved_ns, learning.period);
        self.ask(task);
    }

    /// Asks for a judgement and a search, where they are due.
    fn look_closer(&mut self) {
        let period = self.settings.learning.diagnosis;
        let live = period > 0.0 && !self.settings.lossless();
        if !live || self.pulse.health.received < FEWEST_ROWS {
            return;
        }
        if self.searcher.is_ready() {
            self.searches += 1;
            self.searcher.ask(self.judge_job(self.searches, None));
        }
        if self.judge.is_ready() && is_due(self.judged_ns, period) {
            self.judged_ns = next(self.judged_ns, period);
            self.judge.ask(self.judge_job(0, self.found.clone()));
        }
    }

    fn judge_job(&self, search: u64, found: Option<Arc<Judgement>>) -> judge::Job {
        judge::Job { model: self.current.start().clone(), took_ns: now_ns(), data: self.data, search, found }
    }

    fn report(&mut self, held: &Held) -> anyhow::Result<()> {
        if held.job.data != self.data {
            return Ok(());
        }
        self.judged += 1;
        let mut message = held.message;
        (message.run, message.sequence) = (self.run.number, self.judged);
        message.trial = self.trial;
        self.agreement.take(&mut message);
        if let Some(from_ns) = held.changed_ns.filter(|_| !matches!(self.settings.source, Source::Log(_))) {
            self.begin_anew(from_ns);
        }
        message.changed_ns = self.changed_ns;
        message.compensator_gave_ns = now_ns();
        self.diagnoses.give(message)?;
        if held.report.len() <= topic::REPORT_BYTES {
            self.reports.give(&held.report)?;
        } else {
            tracing::warn!("the report is too long: {} bytes", held.report.len());
        }
        Ok(())
    }

    /// The sensor has changed: what it was before says nothing any more. A log is read to its end, and learned whole.
    fn begin_anew(&mut self, from_ns: i64) {
        tracing::warn!(
            "the error jumps at {:.0} s: something has changed, and what came before is left out from here on",
            from_ns as f64 * 1e-9
        );
        (self.job, self.data, self.changed_ns) = (self.job + 1, self.data + 1, from_ns);
        if let Some(challenger) = &mut self.challenger {
            challenger.waits = false;
        }
        self.store.forget_before(from_ns);
    }

    fn solve_once_more(&mut self) -> anyhow::Result<()> {
        if let Some(challenger) = &mut self.challenger {
            // Everything has come: the trial is decided now.
            (challenger.waits, challenger.last) = (true, true);
            let other = Box::new(challenger.model.clone());
            self.ask(Task::Try(other));
            return Ok(());
        }
        if self.paused {
            return self.finish(None, 0, Vec::new());
        }
        self.ending = Ending::Solving;
        self.job += 1;
        let (start, first) = (self.current.start_of_last().clone(), Box::new(self.current.first().clone()));
        self.learner.ask(Job { start, task: Task::Last(first), number: self.job });
        Ok(())
    }

    fn take(&mut self, solution: Solution) -> anyhow::Result<()> {
        tracing::debug!(rows = solution.rows, took = ?solution.took, "solved");
        if solution.number != self.job {
            return Ok(());
        }
        if let Some(challenger) = self.challenger.take_if(|c| c.waits) {
            return self.decide(challenger, solution);
        }
        let last = self.ending == Ending::Solving;
        let (model, without) = match solution.model {
            Err(error) => (None, Some(error.to_string())),
            Ok(model) => match not_excited(&model) {
                Some(reason) if !last => (None, Some(reason)),
                _ => (Some(model), None),
            },
        };
        if self.rests_for != without {
            tracing::info!(
                "{}",
                without.as_ref().map_or("learning".to_owned(), |why| format!("learning rests: {why}"))
            );
            self.rests_for.clone_from(&without);
        }
        match model {
            Some(model) => {
                let proposed = self.current.solved(model, solution.rows as u64, self.folder)?;
                self.keep(proposed, if last { Then::Finish(solution.rows, solution.errors) } else { Then::Give });
                Ok(())
            }
            None if last => self.finish(without, solution.rows, solution.errors),
            None => self.give(),
        }
    }

    fn keep(&mut self, (writing, proposal): (Writing, Proposal), then: Then) {
        self.keeper.ask(Keeping { writing, proposal: Some(proposal), then });
    }

    /// The files are written: the model counts, and what had to wait for it follows.
    fn kept(&mut self, keeping: Keeping, mut result: anyhow::Result<()>) -> anyhow::Result<()> {
        if let (Then::Give | Then::Finish(..), Err(error)) = (&keeping.then, &result) {
            // A full disk is no reason to stop learning.
            if !std::mem::replace(&mut self.keeps_nothing, true) {
                tracing::error!("{error:#}: learning goes on, but what is learned now does not survive this process");
            }
            result = Ok(());
        }
        if result.is_ok()
            && let Some(proposal) = keeping.proposal
        {
            self.current.adopt(proposal);
        }
        match keeping.then {
            Then::Answer(id, says) => self.answers.settle(id, self.current.epoch(), result.map(|()| says)),
            Then::TakeOver(id, says, trial) => {
                self.trial = *trial;
                if result.is_ok() {
                    (self.trial.state, self.trial.epoch) = (TrialState::TookOver as u32, self.current.epoch());
                }
                self.answers.settle(id, self.current.epoch(), result.map(|()| says));
            }
            Then::Give => result?,
            Then::Finish(rows, errors) => {
                result?;
                return self.finish(None, rows, errors);
            }
        }
        self.give()
    }

    /// The challenger takes over where it won on data that it did not learn from, or was told to.
    fn decide(&mut self, challenger: Challenger, solution: Solution) -> anyhow::Result<()> {
        let (id, axis, effect) = (challenger.command.id, challenger.command.axis, challenger.command.effect);
        let won = solution.is_won();
        let trial = solution.trial;
        let figures = trial.as_ref().map(learner::Trial::excess).map_or_else(String::new, |(before, after)| {
            let (before, after) = (units::ratio(before.sqrt()), units::ratio(after.sqrt()));
            let sure = if solution.told.is_some_and(|told| told > CERTAIN) { ", certain" } else { "" };
            format!(" (error ÷ noise {before} → {after}{sure})")
        });
        let mut state = TrialState::GivenUp;
        let mut proposed = None;
        match solution.model {
            Ok(model) if won || challenger.command.at_once == 1 => {
                match self.current.changed(model, solution.rows as u64, self.folder) {
                    Ok(changed) => proposed = Some(changed),
                    Err(error) => self.answers.settle(id, self.current.epoch(), Err(error)),
                }
            }
            // Too few data yet are no verdict either: after a crash there are none at first.
            Ok(_) | Err(_) if !challenger.last && now_ns() < challenger.since_ns + TRIAL_NS => {
                if now_ns() > challenger.since_ns + TRIAL_TOLD_NS && self.answers.of(id).is_none() {
                    let says = format!(
                        "{effect} is not better so far{figures}: not in use. It is watched on; forget it with `undo`"
                    );
                    self.answers.settle(id, self.current.epoch(), Ok(says));
                }
                self.challenger = Some(challenger);
                state = TrialState::OnTrial;
            }
            Ok(_) => {
                let lost = anyhow::anyhow!("{effect} was not better{figures}: given up, not in use");
                self.answers.settle(id, self.current.epoch(), Err(lost));
            }
            Err(error) => self.answers.settle(id, self.current.epoch(), Err(error.into())),
        }
        let told = message::of_trial(effect.as_str(), axis, trial.as_ref(), self.current.epoch(), state);
        match proposed {
            // Told when the model is in its file.
            Some(proposed) => {
                let says = format!("{effect} added{figures}: in use");
                self.keep(proposed, Then::TakeOver(id, says, Box::new(told)));
            }
            None => self.trial = told,
        }
        self.give()
    }

    fn finish(
        &mut self,
        without: Option<String>,
        rows: usize,
        errors: Vec<(gyro_model::Axis, f64, f64, f64)>,
    ) -> anyhow::Result<()> {
        self.ending = Ending::Done;
        let axes = errors
            .into_iter()
            .map(|(axis, tau, before, after)| LearnedAxis {
                axis: axis.to_string(),
                tau,
                before: Some(before),
                after: Some(after),
            })
            .collect();
        self.folder.set_learned(&Learned { without, rows, axes })?;
        self.give()
    }

    fn give(&mut self) -> anyhow::Result<()> {
        let mut message = *self.current.message();
        message.run = self.run.number;
        message.samples = self.current.samples;
        message.paused = u32::from(self.paused || self.rests_for.is_some());
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
