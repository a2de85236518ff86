//! The one clock of the pipeline: stamps of all processes can be compared.

use rustix::time::{ClockId, clock_gettime};

/// `CLOCK_MONOTONIC`, ns.
#[must_use]
pub fn now_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
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
