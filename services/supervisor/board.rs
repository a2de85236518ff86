//! What the services say of themselves, gathered over all their lives.

use crate::clock::now_ns;
use crate::settings::Waits;
use ipc_types::{
    Health, Histogram, ServiceId, State, Status, Text,
    status::{ServiceStatus, StageStatus},
};
use std::collections::BTreeMap;

/// The news of every service.
#[derive(Debug, Default)]
pub struct Board {
    last: BTreeMap<ServiceId, Health>,
    /// Latencies of lives that are over.
    past: BTreeMap<ServiceId, Vec<Histogram>>,
}

impl Board {
    /// Takes a heart-beat.
    pub fn take(&mut self, health: Health) {
        let Some(id) = health.id() else { return };
        match self.last.get(&id) {
            Some(old) if old.born_ns > health.born_ns => return,
            Some(old) if old.born_ns < health.born_ns => {
                let past = self.past.entry(id).or_default();
                for stage in old.stages.iter().filter(|s| s.count > 0) {
                    match past.iter_mut().find(|p| p.stage == stage.stage) {
                        Some(sum) => sum.merge(stage),
                        None => past.push(*stage),
                    }
                }
            }
            _ => {}
        }
        self.last.insert(id, health);
    }

    /// The last news of a service.
    #[must_use]
    pub fn of(&self, service: ServiceId) -> Option<&Health> {
        self.last.get(&service)
    }

    /// Whether a service has said, in this life, that it is in this state.
    #[must_use]
    pub fn is(&self, service: ServiceId, pid: Option<u32>, state: State) -> bool {
        self.of(service).is_some_and(|h| h.state == state as u32 && pid.is_none_or(|p| p == h.pid))
    }

    /// Messages that were missed somewhere.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.last.iter().filter(|(id, _)| **id != ServiceId::Dashboard).map(|(_, h)| h.lost).sum()
    }

    /// Every stage's latencies, in the order of the flow.
    #[must_use]
    pub fn stages(&self) -> Vec<Histogram> {
        let mut all: Vec<Histogram> = Vec::new();
        for id in ServiceId::ALL {
            let now = self.last.get(&id).into_iter().flat_map(|h| h.stages.iter());
            for stage in now.chain(self.past.get(&id).into_iter().flatten()).filter(|s| s.count > 0) {
                match all.iter_mut().find(|a| a.stage == stage.stage) {
                    Some(sum) => sum.merge(stage),
                    None => all.push(*stage),
                }
            }
        }
        all
    }

    /// The whole as a message; `state` tells what the supervisor knows of a process.
    #[must_use]
    pub fn status<'a>(
        &self,
        run: u64,
        finished: bool,
        waits: &Waits,
        processes: impl Iterator<Item = (ServiceId, Option<u32>, u32, &'a str)>,
    ) -> Status {
        let mut status = Status {
            run,
            pid: std::process::id(),
            finished: u32::from(finished),
            beat_ns: now_ns(),
            source: self.of(ServiceId::Acquisition).map(|h| h.source).unwrap_or_default(),
            learning: self.of(ServiceId::Compensator).map(|h| h.learning).unwrap_or_default(),
            ..Status::default()
        };
        for (slot, (id, pid, restarts, state)) in status.services.iter_mut().zip(processes) {
            let health = self.of(id).copied().unwrap_or_default();
            *slot = ServiceStatus {
                name: Text::new(id.name()),
                state: Text::new(state),
                pid: pid.unwrap_or(0),
                restarts,
                received: health.received,
                sent: health.sent,
                lost: health.lost,
                rejected: health.rejected,
                epoch: health.epoch,
                scheduling: health.scheduling,
                wait: waits.of(id).map(|wait| Text::new(&wait.to_string())).unwrap_or_default(),
            };
        }
        for (slot, stage) in status.stages.iter_mut().zip(self.stages()) {
            *slot = StageStatus {
                stage: stage.stage,
                count: stage.count,
                p50_ns: stage.quantile(0.5),
                p99_ns: stage.quantile(0.99),
                p999_ns: stage.quantile(0.999),
                max_ns: stage.max_ns,
            };
        }
        status
    }
}

#[cfg(test)]
mod tests {
    use super::{Board, Health, Histogram, ServiceId};

    #[test]
    fn latencies_of_an_earlier_life_count() {
        let mut board = Board::default();
        for born_ns in [1, 2] {
            let mut health = Health { service: ServiceId::Kalman as u32, born_ns, ..Health::default() };
            health.stages[0] = Histogram::new("kalman");
            health.stages[0].record(100 * born_ns);
            board.take(health);
        }
        let stages = board.stages();
        assert_eq!((stages.len(), stages[0].count, stages[0].max_ns), (1, 2, 200));
    }

    #[test]
    fn news_of_an_earlier_life_come_too_late() {
        let mut board = Board::default();
        for (born_ns, received) in [(2, 7), (1, 9)] {
            board.take(Health { service: ServiceId::Kalman as u32, born_ns, received, ..Health::default() });
        }
        assert_eq!(board.of(ServiceId::Kalman).unwrap().received, 7);
    }
}
