//! A thread that works beside the one that receives, at a bounded share of the time.

use crate::realtime::{Policy, set_policy};
use rustix::{
    process::nice,
    time::{ClockId, clock_gettime},
};
use std::{
    sync::mpsc::{Receiver, Sender, TryRecvError, channel},
    thread,
    time::{Duration, Instant},
};

/// The worker's end in the receiving thread: jobs in, results out. Dropping it ends the thread after its present job.
#[derive(Debug)]
pub struct Worker<J, R> {
    jobs: Sender<J>,
    results: Receiver<(R, Instant)>,
    busy: bool,
    rests_until: Instant,
}

/// How much nicer the thread is than the one that receives.
const BEHIND: i32 = 5;

/// Who comes before the thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    /// Whoever passes samples on, a little.
    Behind,
    /// Everybody.
    Idle,
}

impl Rank {
    /// Where that is refused, all are equal.
    fn take(self) {
        let _ = nice(BEHIND);
        if self == Self::Idle
            && let Err(error) = set_policy(Policy::Idle)
        {
            tracing::warn!("a thread that learns is not of the idle kind ({error})");
        }
    }
}

/// What a job counts for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// The processor time of its thread: on a busy machine it waits, and that is no work.
    Thread,
    /// The time from its start to its end, for a job that starts threads of its own.
    Wall,
}

impl Cost {
    fn now(self) -> Duration {
        let clock = match self {
            Self::Thread => ClockId::ThreadCPUTime,
            Self::Wall => ClockId::Monotonic,
        };
        Duration::try_from(clock_gettime(clock)).unwrap_or_default()
    }
}

impl<J: Send + 'static, R: Send + 'static> Worker<J, R> {
    /// Starts the thread; `duty` is the share of one core that it may take.
    #[must_use]
    pub fn start(duty: f64, cost: Cost, rank: Rank, mut work: impl FnMut(J) -> R + Send + 'static) -> Self {
        let (jobs, inbox) = channel::<J>();
        let (outbox, results) = channel();
        thread::spawn(move || {
            rank.take();
            for job in inbox {
                let (start, spent) = (Instant::now(), cost.now());
                let result = work(job);
                let rests_until = start + cost.now().saturating_sub(spent).div_f64(duty);
                if outbox.send((result, rests_until)).is_err() {
                    return;
                }
            }
        });
        Self { jobs, results, busy: false, rests_until: Instant::now() }
    }

    /// Whether it works.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Whether it has nothing to do and has rested enough.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        !self.busy && Instant::now() >= self.rests_until
    }

    /// How long it rests from now on.
    #[must_use]
    pub fn rests_for(&self) -> Duration {
        if self.busy { Duration::ZERO } else { self.rests_until.saturating_duration_since(Instant::now()) }
    }

    /// Gives it a job.
    pub fn ask(&mut self, job: J) {
        self.busy = self.jobs.send(job).is_ok();
    }

    /// Its result, if it is done.
    ///
    /// # Errors
    /// Where the thread died.
    pub fn result(&mut self) -> anyhow::Result<Option<R>> {
        match self.results.try_recv() {
            Ok((result, rests_until)) => {
                (self.busy, self.rests_until) = (false, rests_until);
                Ok(Some(result))
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => anyhow::bail!("the thread that solves died"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Cost, Rank, Worker};

    #[test]
    fn a_worker_answers_and_a_dead_one_is_an_error() {
        let mut worker = Worker::start(1.0, Cost::Thread, Rank::Behind, |n: u32| 10 / n);
        worker.ask(5);
        let answer = loop {
            if let Some(answer) = worker.result().unwrap() {
                break answer;
            }
        };
        assert_eq!(answer, 2);
        worker.ask(0);
        while worker.result().is_ok_and(|r| r.is_none()) {}
        assert!(worker.result().is_err());
    }
}
