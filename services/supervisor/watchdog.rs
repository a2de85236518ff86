//! Who hangs: a process that has been silent for longer than a slow machine explains.

use super::vitals::{LONGEST_NS, SILENCE_NS, Vitals};
use crate::clock::now_ns;
use ipc_types::{Health, ServiceId, State};
use std::collections::BTreeMap;

/// A supervisor that looks so late had no time itself, and says nothing of others, ns.
const LATE_NS: u64 = 150_000_000;

/// What was seen of the processes.
#[derive(Debug, Default)]
pub struct Watchdog {
    /// How each was at its last beat.
    before: BTreeMap<ServiceId, (u64, Vitals)>,
    /// The process of each that hung last. It is reported once: one that has much memory takes a while to die.
    hung: BTreeMap<ServiceId, u32>,
    /// When the supervisor looked last, and when it was late last.
    looked_ns: u64,
    late_ns: u64,
}

impl Watchdog {
    /// The supervisor looks; it does so many times a second.
    pub fn look(&mut self) {
        let now = now_ns();
        if now > self.looked_ns + LATE_NS {
            self.late_ns = now;
        }
        self.looked_ns = now;
    }

    /// How long this process has been silent, ns, and what it does, where that is too long. `health` is its last word, it was
    /// begun at `started_ns`; one that is not `replaceable` is given the most time.
    pub fn hangs(
        &mut self,
        service: ServiceId,
        pid: u32,
        health: Option<&Health>,
        started_ns: u64,
        replaceable: bool,
    ) -> Option<(u64, &'static str)> {
        let health = health.filter(|health| health.pid == pid);
        let beat = health.map_or(0, |health| health.beat_ns);
        if self.before.get(&service).is_none_or(|(of, _)| *of != beat)
            && let Some(vitals) = Vitals::of(pid)
        {
            self.before.insert(service, (beat, vitals));
        }
        let now = now_ns();
        let silent = now.saturating_sub(beat.max(started_ns));
        // Where the supervisor itself stood still since it looked, what came meanwhile is not heard yet.
        if silent <= SILENCE_NS || now > self.looked_ns + LATE_NS || self.hung.get(&service) == Some(&pid) {
            return None;
        }
        let at_work = health.is_some_and(|health| health.state != State::Starting as u32);
        let fair = replaceable && now > self.late_ns + SILENCE_NS;
        let seen = Vitals::of(pid);
        let patience = match (self.before.get(&service), &seen) {
            // No start is so slow that it is stopped.
            (Some((_, before)), Some(now)) if fair && (at_work || now.is_stopped()) => now.patience_ns(before, silent),
            _ => LONGEST_NS,
        };
        (silent > patience).then(|| {
            self.hung.insert(service, pid);
            (silent, seen.map_or("gone", |seen| seen.doing()))
        })
    }
}
