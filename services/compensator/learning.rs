//! Learning: what the solving thread is asked for, and what becomes of its answers.

use super::{
    Compensator, FEWEST_ROWS,
    current::Proposal,
    is_due,
    keeper::{Keeping, Then},
    learner::{Job, Solution, Task},
    next,
    phase::{Asked, Phase},
    trial::TRIAL_NS,
    writing::Writing,
};
use crate::clock::now_ns;
use crate::run_folder::{Learned, LearnedAxis};
use gyro_model::{
    Axis, Model,
    learning::{adds_nothing, is_surprising, not_excited},
    units,
};
use ipc_types::diagnosis::TrialState;

impl Compensator<'_> {
    /// Asks the learner.
    fn ask(&mut self, start: Model, task: Task) {
        self.job += 1;
        self.asked = Asked::of(&task, self.phase);
        self.learner.ask(Job { start, task, number: self.job });
    }

    /// What the learner was asked is of no use any more.
    pub(super) fn void(&mut self) {
        self.job += 1;
        self.asked = Asked::Nothing;
    }

    /// Asks for a solution, where one is due: of the challenger first.
    pub(super) fn learn(&mut self) {
        let learning = &self.settings.learning;
        if !is_due(self.solved_ns, learning.period)
            || !self.learner.is_ready()
            || self.keeper.is_busy()
            || self.pulse.health.received < FEWEST_ROWS
        {
            return;
        }
        let task = match &self.challenger {
            Some(challenger) if self.asked != Asked::Try || self.paused => {
                Task::Try(Box::new(challenger.model.clone()))
            }
            _ if self.paused => return,
            // The model in use is learned on during a long trial.
            _ => Task::Learn(learning.window),
        };
        self.solved_ns = next(self.solved_ns, learning.period);
        self.ask(self.current.start().clone(), task);
    }

    /// After the stream's end: a trial is decided on everything that came, then the whole run is solved.
    pub(super) fn solve_once_more(&mut self) -> anyhow::Result<()> {
        if let Some(challenger) = &self.challenger {
            let other = Box::new(challenger.model.clone());
            self.ask(self.current.start().clone(), Task::Try(other));
        } else if self.paused {
            self.finish(None, 0, Vec::new())?;
        } else {
            let (start, first) = (self.current.start_of_last().clone(), Box::new(self.current.first().clone()));
            self.ask(start, Task::Last(first));
        }
        Ok(())
    }

    /// Takes what the learner found.
    pub(super) fn take(&mut self, solution: Solution) -> anyhow::Result<()> {
        tracing::debug!(rows = solution.rows, took = ?solution.took, "solved");
        if solution.number != self.job {
            return Ok(());
        }
        if matches!(self.asked, Asked::Try | Asked::LastTry)
            && let Some(challenger) = self.challenger.take()
        {
            return self.decide(challenger, solution, self.asked == Asked::LastTry);
        }
        let last = self.asked == Asked::Last;
        let (model, without) = match solution.model {
            Err(error) => (None, Some(error.to_string())),
            Ok(model) => match not_excited(&model) {
                Some(reason) if !last => (None, Some(reason)),
                None if solution.is_young
                    && self.current.is_inherited()
                    && adds_nothing(&model, self.current.start()) =>
                {
                    (None, Some("the model is still known better from before this process began".to_owned()))
                }
                // The first solution of a process may be fitted to a tenth of a second.
                None if !last
                    && !std::mem::replace(&mut self.has_solved, true)
                    && is_surprising(&model, self.current.start()) =>
                {
                    (
                        None,
                        Some("the first readings contradict the model: the next solution has to confirm it".to_owned()),
                    )
                }
                _ => (Some(model), None),
            },
        };
        // The figures in it change with every solution.
        if self.waits_for.is_some() != without.is_some() {
            let says = without.as_ref().map_or("learning".to_owned(), |why| format!("learning waits: {why}"));
            tracing::info!("{says}");
        }
        self.waits_for.clone_from(&without);
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

    /// Has the files of a proposal written.
    pub(super) fn keep(&mut self, (writing, proposal): (Writing, Proposal), then: Then) {
        self.keeper.ask(Keeping { writing, proposal: Some(proposal), then });
    }

    /// The files are written: the model counts, and what had to wait for it follows.
    pub(super) fn kept(&mut self, keeping: Keeping, mut result: anyhow::Result<()>) -> anyhow::Result<()> {
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

    fn finish(
        &mut self,
        without: Option<String>,
        rows: usize,
        errors: Vec<(Axis, f64, f64, f64)>,
    ) -> anyhow::Result<()> {
        self.phase = Phase::Done;
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

    /// What learning is at, in one word and a figure, for those who watch.
    pub(super) fn learning_says(&self) -> String {
        let learning = &self.settings.learning;
        let received = self.pulse.health.received;
        let resting_s = self.learner.rests_for().as_secs_f64();
        match (self.phase, &self.challenger, &self.waits_for) {
            (Phase::Done, ..) => format!("done: a model of {} rows", self.current.samples),
            (Phase::Ended, ..) => "ends: the whole run is solved once more".to_owned(),
            (_, Some(challenger), _) => {
                let seconds = now_ns().saturating_sub(challenger.since_ns) / 1_000_000_000;
                format!("tries: {}, {seconds} s of {} s at most", challenger.command.effect, TRIAL_NS / 1_000_000_000)
            }
            _ if self.paused => "paused: until `truerate control resume`".to_owned(),
            _ if received < FEWEST_ROWS => format!("waits: {received} of {FEWEST_ROWS} rows are there"),
            (.., Some(why)) => format!("waits: {why}"),
            _ if resting_s > learning.period => {
                let share = units::percent(learning.duty);
                format!("rests: {resting_s:.1} s more, so that learning takes {share} of a core (learning.duty)")
            }
            _ => format!("learns: a model of {} rows, again every {} s", self.current.samples, learning.period),
        }
    }
}
