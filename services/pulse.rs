//! A service's heart-beat: its counts and latencies, given at about 10 Hz and whenever the stream's flow needs it.

use crate::clock::now_ns;
use crate::realtime;
use ipc_types::{
    Health, Histogram, ServiceId, State,
    port::{Hub, PortError, Writer},
    topic,
};

const PERIOD_NS: u64 = 100_000_000;

/// The heart-beat of this process.
#[derive(Debug)]
pub struct Pulse {
    /// What is given next; the service counts in it.
    pub health: Health,
    writer: Writer<Health>,
    acknowledged: u64,
}

impl Pulse {
    /// Begins to beat, as starting.
    ///
    /// # Errors
    /// Where the topic cannot be opened.
    pub fn begin(hub: &Hub, run: u64, service: ServiceId, stages: [&str; 3]) -> Result<Self, PortError> {
        let health = Health {
            run,
            service: service as u32,
            pid: std::process::id(),
            born_ns: now_ns(),
            scheduling: realtime::in_force(),
            stages: stages.map(Histogram::new),
            ..Health::default()
        };
        let mut pulse = Self { health, writer: hub.writer(&topic::HEALTH)?, acknowledged: 0 };
        pulse.beat_now()?;
        Ok(pulse)
    }

    /// Changes the state, and says so at once.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn become_state(&mut self, state: State) -> Result<(), PortError> {
        if self.health.state == state as u32 {
            return Ok(());
        }
        self.health.state = state as u32;
        self.beat_now()
    }

    /// Beats where a period has gone by, or `step` more messages are done.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn beat(&mut self, step: u64) -> Result<(), PortError> {
        if self.is_due() || self.health.acknowledged >= self.acknowledged.saturating_add(step) {
            self.beat_now()
        } else {
            Ok(())
        }
    }

    /// Whether a period has gone by since the last beat.
    #[must_use]
    pub fn is_due(&self) -> bool {
        now_ns() >= self.health.beat_ns + PERIOD_NS
    }

    /// Beats.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn beat_now(&mut self) -> Result<(), PortError> {
        self.health.beat_ns = now_ns();
        self.acknowledged = self.health.acknowledged;
        self.writer.give(self.health)?;
        Ok(())
    }
}
