//! Whether a process that is silent hangs or only gets no time: what the kernel says of its main thread.

use std::fs;

/// A process that is silent for that long is looked at, ns: four beats.
pub const SILENCE_NS: u64 = 400_000_000;
/// A process that computes all that time without a beat is ended after that, ns.
const BUSY_NS: u64 = 3_000_000_000;
/// Whatever the kernel says of it, a process that is silent for that long is ended, ns.
pub const LONGEST_NS: u64 = 12_000_000_000;

/// A main thread at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vitals {
    /// As in `ps`: R, S, D, T, ….
    state: u8,
    /// Time on a core, ns.
    ran_ns: u64,
    /// Time that it was ready to run and had no core, ns.
    waited_ns: u64,
}

impl Vitals {
    /// Of this process; `None` where it is gone.
    #[must_use]
    pub fn of(pid: u32) -> Option<Self> {
        let stat = fs::read(format!("/proc/{pid}/task/{pid}/stat")).ok()?;
        // The name before it may hold anything but ends at the last bracket.
        let state = *stat.get(stat.iter().rposition(|&b| b == b')')? + 2)?;
        let times = fs::read_to_string(format!("/proc/{pid}/task/{pid}/schedstat")).unwrap_or_default();
        let mut times = times.split_whitespace().map_while(|word| word.parse().ok());
        Some(Self { state, ran_ns: times.next()?, waited_ns: times.next()? })
    }

    /// Whether somebody stopped it, or it is dead.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        matches!(self.state, b'T' | b'Z' | b'X')
    }

    /// What it does, as a message says it.
    #[must_use]
    pub fn doing(&self) -> &'static str {
        match self.state {
            _ if self.is_stopped() => "stopped",
            b'S' => "asleep",
            b'R' => "computing",
            _ => "waiting",
        }
    }

    /// How long a process that was like `before` at its last beat may be silent.
    #[must_use]
    pub fn patience_ns(&self, before: &Self, silent_ns: u64) -> u64 {
        let ran = self.ran_ns.saturating_sub(before.ran_ns);
        let waited = self.waited_ns.saturating_sub(before.waited_ns);
        match self.state {
            _ if self.is_stopped() => SILENCE_NS,
            // It sleeps though it should have woken, and was not kept from it.
            b'S' if ran + waited < silent_ns / 10 => SILENCE_NS,
            b'R' if ran > silent_ns / 10 * 7 => BUSY_NS,
            // The disk, a debugger, or a machine that has no time for it.
            _ => LONGEST_NS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BUSY_NS, LONGEST_NS, SILENCE_NS, Vitals};

    const MS: u64 = 1_000_000;
    const BEFORE: Vitals = Vitals { state: b'S', ran_ns: 500 * MS, waited_ns: 70 * MS };

    fn patience(state: u8, ran_ms: u64, waited_ms: u64) -> u64 {
        let now = Vitals { state, ran_ns: BEFORE.ran_ns + ran_ms * MS, waited_ns: BEFORE.waited_ns + waited_ms * MS };
        now.patience_ns(&BEFORE, 400 * MS)
    }

    #[test]
    fn a_stopped_or_sleeping_process_hangs_and_one_without_a_core_does_not() {
        assert_eq!(patience(b'T', 0, 0), SILENCE_NS);
        assert_eq!(patience(b'S', 1, 1), SILENCE_NS);
        assert_eq!(patience(b'S', 10, 200), LONGEST_NS, "the machine is slow");
        assert_eq!(patience(b'R', 5, 0), LONGEST_NS, "it waits for a core");
        assert_eq!(patience(b'R', 390, 0), BUSY_NS, "it computes");
        assert_eq!(patience(b'D', 0, 0), LONGEST_NS, "it waits for the disk");
        assert_eq!(patience(b't', 0, 0), LONGEST_NS, "it is being debugged");
    }

    #[test]
    fn this_process_has_vitals() {
        let vitals = Vitals::of(std::process::id()).unwrap();
        assert!(vitals.ran_ns > 0 && Vitals::of(u32::MAX).is_none(), "{vitals:?}");
    }
}
