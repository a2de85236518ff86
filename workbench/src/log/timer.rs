//! Times of a counter that overflows: `micros()` begins at 0 again after 71 minutes, a timer of 16 bits after 65 ms or s.

/// Bits of counters.
const BITS: [u32; 3] = [16, 24, 32];

/// Follows the times of a column.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timer {
    /// The last time as written, ns.
    last: Option<i128>,
    /// The last step forward, ns.
    step: i128,
    /// What the overflows so far come to, ns.
    added: i128,
}

impl Timer {
    /// A time in units of 10^`exponent` of its numbers without its overflows, and whether this is the first after one. Seconds may have
    /// been counted in a finer unit.
    pub fn follow(&mut self, ns: i128, exponent: i32, are_seconds: bool) -> (i128, bool) {
        let before = self.last.replace(ns);
        let step = before.map_or(0, |before| ns - before);
        if step > 0 {
            self.step = step;
        }
        let range =
            if step < 0 { before.and_then(|before| self.overflow(before, ns, exponent, are_seconds)) } else { None };
        self.added += range.unwrap_or(0);
        (ns + self.added, range.is_some())
    }

    /// The range of the counter that overflowed between two times, from 0 on or about 0.
    fn overflow(&self, before: i128, now: i128, exponent: i32, are_seconds: bool) -> Option<i128> {
        // What is beyond all times is the range of no counter.
        let range = |bits: u32, exponent: i32| 10_i128.checked_pow(exponent.unsigned_abs())?.checked_mul(1 << bits);
        // Microseconds or milliseconds.
        let ranges: &[Option<i128>] = if are_seconds {
            &[range(16, 6), range(32, 3), range(32, 6)]
        } else {
            &BITS.map(|bits| range(bits, exponent))
        };
        // It goes on from one end to the other, and the next step may be somewhat longer than the last.
        let near = 3 * self.step / 2;
        ranges.iter().flatten().copied().filter(|range| 4 * near <= *range).find(|range| {
            [(0, *range), (-range / 2, range / 2)]
                .into_iter()
                .any(|(low, high)| (high - near..=high).contains(&before) && (low..=low + near).contains(&now))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn followed(times: &[i128], exponent: i32) -> (Vec<i128>, usize) {
        let mut timer = Timer::default();
        let all: Vec<_> = times.iter().map(|time| timer.follow(*time, exponent, exponent == 9)).collect();
        (all.iter().map(|of| of.0).collect(), all.iter().filter(|of| of.1).count())
    }

    #[test]
    fn a_counter_goes_on_past_its_end() {
        let end = (1_i128 << 32) * 1000;
        let step = 5_000_000;
        assert_eq!(
            followed(&[end - 2 * step, end - step + 700, 1000, step], 3),
            (vec![end - 2 * step, end - step + 700, end + 1000, end + step], 1)
        );
        // A count of 0.1 ms, read finer than in nanoseconds, is no time in seconds.
        let mut scaled = Timer::default();
        let wide = (1_i128 << 32) * 1_000_000_000;
        scaled.follow(wide - 192_000_000_000, 9, false);
        scaled.follow(wide - 96_000_000_000, 9, false);
        assert_eq!(scaled.follow(0, 9, false), (wide, true));
        // Signed, and in seconds.
        assert_eq!(followed(&[end / 2 - 2 * step, end / 2 - step, -end / 2], 3).0[2], end / 2);
        assert_eq!(followed(&[end - 2 * step, end - step, 0], 9).0[2], end);
        let short: Vec<i128> = (0..40).map(|k| (k * 10_000_000) % 65_536_000).collect();
        let (times, overflows) = followed(&short, 3);
        assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 10_000_000) && overflows == 5, "{times:?}");
    }

    #[test]
    fn a_unit_beyond_all_times_overflows_nothing() {
        assert_eq!(followed(&[20, 10, 30], 300), (vec![20, 10, 30], 0));
    }

    #[test]
    fn a_clock_that_begins_again_elsewhere_is_none() {
        for times in
            [&[0, 5_000_000, 0_i128][..], &[600_000_000_000, 600_005_000_000, 0], &[10_000_000, 20_000_000, 15_000_000]]
        {
            assert_eq!(followed(times, 3), (times.to_vec(), 0));
        }
    }
}
