//! The one clock of the pipeline: stamps of all processes can be compared.

use iceoryx2_bb_posix::clock::{ClockType, Time};

/// `CLOCK_MONOTONIC`, ns.
#[must_use]
pub fn now_ns() -> u64 {
    Time::now_with_clock(ClockType::Monotonic).map_or(0, |t| t.seconds() * 1_000_000_000 + u64::from(t.nanoseconds()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn time_goes_on() {
        let before = super::now_ns();
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert!(before > 0 && super::now_ns() >= before + 2_000_000);
    }
}
