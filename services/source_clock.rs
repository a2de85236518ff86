//! When a source's time began, on this machine's clock. A link, a queue or a busy machine can make a row late, and nothing makes it early:
//! the smallest difference of arrival and time over the last seconds is the best estimate. This is the minimum filter of clock
//! synchronisation (Paxson, "On calibrating measurements of packet transit times", 1998).

/// Half of the window, ns. In a whole one a source's clock that is wrong by 1 in 1000 makes an error of 4 ms.
const HALF_NS: u64 = 2_000_000_000;

/// Smallest arrival − time, ns, over the present half and over the one before it.
#[derive(Clone, Copy, Debug, Default)]
pub struct SourceClock {
    since_ns: u64,
    now: Option<i64>,
    before: Option<i64>,
}

impl SourceClock {
    /// A row of the source's time `time_ns` came at `arrived_ns`.
    pub fn take(&mut self, time_ns: i64, arrived_ns: u64) {
        let began = i64::try_from(arrived_ns).unwrap_or(i64::MAX).saturating_sub(time_ns);
        // After a hole, however long, the half before it still counts: what waited in it comes at once and late.
        if arrived_ns.saturating_sub(self.since_ns) > HALF_NS {
            *self = Self { since_ns: arrived_ns, now: None, before: self.now };
        }
        self.now = Some(self.now.map_or(began, |now| now.min(began)));
    }

    /// A source's time on this machine's clock, ns; `None` before the first row.
    #[must_use]
    pub fn at(&self, time_ns: i64) -> Option<u64> {
        let began = [self.now, self.before].into_iter().flatten().min()?;
        Some(u64::try_from(began.saturating_add(time_ns)).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::SourceClock;

    const MS: u64 = 1_000_000;

    #[test]
    fn rows_that_waited_in_a_queue_held_when_they_were_measured() {
        let mut clock = SourceClock::default();
        assert_eq!(clock.at(0), None);
        let mut hold = |time_ms: u64, arrived_ms: u64| {
            clock.take((time_ms * MS).cast_signed(), arrived_ms * MS);
            clock.at((time_ms * MS).cast_signed()).unwrap() / MS
        };
        for k in 0..5_000 {
            // Every third row is up to 7 ms late.
            let late = if k % 3 == 0 { k % 8 } else { 0 };
            assert!(hold(k, 10_000 + k + late) <= 10_000 + k + if k == 0 { late } else { 0 });
        }
        // Nobody read for 3 s; then all that waited comes at once, and the stream goes on.
        for k in 5_000..8_000 {
            assert_eq!(hold(k, 18_000), 10_000 + k);
        }
        for k in 8_000..20_000 {
            assert_eq!(hold(k, 10_000 + k), 10_000 + k);
        }
    }

    #[test]
    fn a_source_whose_clock_is_slow_is_followed() {
        let mut clock = SourceClock::default();
        for k in 0..100_000_u64 {
            let time_ns = (k * MS).cast_signed() * 999 / 1000;
            clock.take(time_ns, 10_000 * MS + k * MS);
            let early = (10_000 * MS + k * MS) - clock.at(time_ns).unwrap();
            assert!(early <= 5 * MS, "{early} ns at {k} ms");
        }
    }
}
