//! What the compensator is at: how far the stream is, and what the learner was last asked for.
//!
//! ```text
//!  Streaming ── the stream's end ──▶ Ended ── the last solution is in its file ──▶ Done
//!
//!  Streaming: Learn; while a challenger is there, Try and Learn in turn; while paused, Try alone.
//!  Ended:     LastTry, where a challenger is there; then Last.
//! ```
//!
//! What is asked and cannot be answered any more, because a command or a changed sensor came between, is void
//! (`Compensator::void`): its answer is dropped, and the next turn asks anew.

use super::learner::Task;

/// How far the stream is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// It goes on, and is learned from.
    Streaming,
    /// It has ended: a trial is decided, then the whole run is solved once more.
    Ended,
    /// The last model is given.
    Done,
}

/// What the learner was last asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Nothing, or what is void by now.
    Nothing,
    /// The parameters of the model in use.
    Learn,
    /// A trial of the challenger.
    Try,
    /// The same on everything that came: it decides.
    LastTry,
    /// The parameters at the end, over the whole run.
    Last,
}

impl Asked {
    /// What a task is, in this phase.
    #[must_use]
    pub fn of(task: &Task, phase: Phase) -> Self {
        match (task, phase) {
            (Task::Learn(_), _) => Self::Learn,
            (Task::Try(_), Phase::Streaming) => Self::Try,
            (Task::Try(_), Phase::Ended | Phase::Done) => Self::LastTry,
            (Task::Last(_), _) => Self::Last,
        }
    }
}
