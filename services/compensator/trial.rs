//! Another model beside the one in use: tried until it wins, or is given up.

use super::{Compensator, keeper::Then, learner::Solution, message};
use crate::{clock::now_ns, story};
use anyhow::anyhow;
use gyro_model::{Model, learning::Trial, units};
use ipc_types::{Command, Text, diagnosis::TrialState};

/// Standard errors from which on an effect on trial is certain to be there.
const CERTAIN: f64 = 5.0;
/// Who asks for a trial is told after this at the latest that it goes on, ns.
const TRIAL_TOLD_NS: u64 = 2_500_000_000;
/// A trial that is not won by then is given up, ns.
pub(super) const TRIAL_NS: u64 = 120_000_000_000;

/// The other model.
#[derive(Debug)]
pub(super) struct Challenger {
    /// Who asked for it.
    pub command: Command,
    /// With one effect more.
    pub model: Model,
    /// The effect whose trial it ended.
    pub instead_of: Option<Text<62>>,
    /// When the trial began, ns.
    pub since_ns: u64,
}

impl Compensator<'_> {
    /// The challenger takes over where it won on data that it did not learn from, or was told to.
    pub(super) fn decide(&mut self, challenger: Challenger, solution: Solution, is_last: bool) -> anyhow::Result<()> {
        let (id, axis, effect) = (challenger.command.id, challenger.command.axis, challenger.command.effect);
        let won = solution.trial.as_ref().is_some_and(Trial::is_won);
        let trial = solution.trial;
        let figures = trial.as_ref().map(Trial::excess).map_or_else(String::new, |(before, after)| {
            let (before, after) = (units::ratio(before.sqrt()), units::ratio(after.sqrt()));
            let sure = if trial.as_ref().and_then(|trial| trial.told).is_some_and(|told| told > CERTAIN) {
                ", certain"
            } else {
                ""
            };
            format!(" (error ÷ noise {before} → {after}{sure})")
        });
        let given_up = gives_up(challenger.instead_of);
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
            Ok(_) | Err(_) if !is_last && now_ns() < challenger.since_ns + TRIAL_NS => {
                if now_ns() > challenger.since_ns + TRIAL_TOLD_NS && self.answers.of(id).is_none() {
                    let says = format!(
                        "{effect} is not better so far{figures}: not in use. It is tried for two minutes; `undo` ends \
                         that{given_up}"
                    );
                    self.answers.settle(id, self.current.epoch(), Ok(says));
                }
                self.challenger = Some(challenger);
                state = TrialState::OnTrial;
            }
            Ok(_) => {
                let lost = anyhow!("{effect} was not better{figures}: given up, not in use");
                self.answers.settle(id, self.current.epoch(), Err(lost));
            }
            Err(error) => self.answers.settle(id, self.current.epoch(), Err(error.into())),
        }
        let told = message::of_trial(effect.as_str(), axis, trial.as_ref(), self.current.epoch(), state);
        match proposed {
            // Told when the model is in its file.
            Some(proposed) => {
                let says = format!("{}{given_up}", story::won(&told));
                self.keep(proposed, Then::TakeOver(id, says, Box::new(told)));
            }
            None => self.trial = told,
        }
        self.give()
    }

    /// Gives up the trial, where there is one; its effect. A challenger is the model as it was, with one effect more: where it
    /// won, what is changed meanwhile would be back.
    pub(super) fn end_trial(&mut self) -> Option<Text<62>> {
        let ended = self.challenger.take()?.command;
        self.trial.state = TrialState::GivenUp as u32;
        if self.answers.of(ended.id).is_none() {
            let says = anyhow!("{} is not on trial any more", ended.effect);
            self.answers.settle(ended.id, self.current.epoch(), Err(says));
        }
        Some(ended.effect)
    }
}

/// What is said of a trial that another order ended.
pub(super) fn gives_up(ended: Option<Text<62>>) -> String {
    ended.map_or_else(String::new, |effect| format!(" ({effect}, which was not better so far, is given up)"))
}
