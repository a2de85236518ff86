//! Those who follow the stream: how far each is, seen from acquisition. What they have not acknowledged is the credit
//! that an unpaced source has left.

use crate::clock::now_ns;
use ipc_types::{
    Health, ServiceId, State,
    port::{PortError, Reader},
    topic::QUEUE,
};

/// Samples under way at most, to an unpaced stream's slowest follower.
pub const WINDOW: u64 = QUEUE as u64 / 2;

/// No progress for that long, with samples under way, means that some were lost on the way, ns.
const STALLED_NS: u64 = 1_000_000_000;

/// What followers do when a source could give a row again, and how far they are.
#[derive(Debug)]
pub struct Consumers {
    run: u64,
    health: Reader<Health>,
    list: Vec<Consumer>,
    progress: u64,
    progress_ns: u64,
}

#[derive(Debug)]
struct Consumer {
    service: ServiceId,
    born_ns: u64,
    beat_ns: u64,
    /// Acknowledged by itself, or given up for it.
    done: u64,
    at_work: bool,
    finished: bool,
    reborn: bool,
}

impl Consumers {
    /// Waits for nobody yet.
    #[must_use]
    pub fn new(run: u64, health: Reader<Health>, services: &[ServiceId]) -> Self {
        let list = services
            .iter()
            .map(|&service| Consumer {
                service,
                born_ns: 0,
                beat_ns: 0,
                done: 0,
                at_work: false,
                finished: false,
                reborn: false,
            })
            .collect();
        Self { run, health, list, progress: 0, progress_ns: now_ns() }
    }

    /// Takes the news. `sent` is the last number given: where the source cannot go back (`rewinds` false) a follower
    /// that begins a new life is taken to have everything up to there.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn listen(&mut self, sent: u64, rewinds: bool) -> Result<(), PortError> {
        while let Some(health) = self.health.take()? {
            let Some(consumer) = self.list.iter_mut().find(|c| health.id() == Some(c.service)) else { continue };
            if health.run != self.run || health.born_ns < consumer.born_ns {
                continue;
            }
            if health.born_ns > consumer.born_ns {
                consumer.reborn = consumer.born_ns != 0;
                consumer.born_ns = health.born_ns;
                consumer.done = if rewinds || !consumer.reborn { 0 } else { sent };
            }
            consumer.beat_ns = health.beat_ns;
            consumer.at_work = health.state == State::Running as u32 || health.state == State::Finished as u32;
            consumer.finished = health.state == State::Finished as u32;
            consumer.done = if rewinds { health.acknowledged } else { consumer.done.max(health.acknowledged) };
        }
        let slowest = self.slowest();
        if slowest != self.progress {
            (self.progress, self.progress_ns) = (slowest, now_ns());
        }
        Ok(())
    }

    /// Whether all are at work.
    #[must_use]
    pub fn ready(&self) -> bool {
        self.list.iter().all(|c| c.at_work)
    }

    /// Whether all have done everything.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.list.iter().all(|c| c.finished)
    }

    /// The number up to which all have everything.
    #[must_use]
    pub fn slowest(&self) -> u64 {
        self.list.iter().map(|c| c.done).min().unwrap_or(0)
    }

    /// How far one of them is.
    #[must_use]
    pub fn done(&self, service: ServiceId) -> u64 {
        self.list.iter().find(|c| c.service == service).map_or(0, |c| c.done)
    }

    /// How many may be given after `sent`.
    #[must_use]
    pub fn credit(&self, sent: u64) -> u64 {
        if self.ready() { (self.slowest() + WINDOW).saturating_sub(sent) } else { 0 }
    }

    /// The same of a source that cannot go back: it waits for kalman, and for the others only while they are at work, so
    /// that what learns or records never keeps the rate from whoever steers by it.
    #[must_use]
    pub fn credit_of_pipe(&self, sent: u64) -> u64 {
        let follows = |c: &&Consumer| c.service == ServiceId::Kalman || now_ns() < c.beat_ns + STALLED_NS;
        let following = || self.list.iter().filter(|c| c.at_work).filter(follows);
        if !following().any(|c| c.service == ServiceId::Kalman) {
            return 0;
        }
        (following().map(|c| c.done).min().unwrap_or(0) + WINDOW).saturating_sub(sent)
    }

    /// The number to go on from, where somebody needs rows again: a new life, or no progress.
    pub fn wants_again(&mut self, sent: u64) -> Option<u64> {
        let stalled = sent > self.slowest() && now_ns() > self.progress_ns + STALLED_NS;
        if !self.ready() || !(stalled || self.list.iter().any(|c| c.reborn)) {
            return None;
        }
        self.list.iter_mut().for_each(|c| c.reborn = false);
        self.progress_ns = now_ns();
        (self.slowest() < sent).then(|| self.slowest() + 1)
    }
}
