//! The recent past of one sampled signal: its value between the samples, and its integral.
//!
//! Steps may be uneven. Between two samples the signal is the cubic through the two samples on either side (at the
//! newest interval: through the last four), integrated exactly by two Gauss points; on even steps that is the
//! Adams–Moulton rule of fourth order. Across a gap, or with fewer samples, it is the straight line.

/// Samples that are kept: the largest delay (0.5 s) at 8 kHz.
const CAPACITY: usize = 4096;

/// A step longer than this many neighbouring steps is a gap: no cubic is drawn across it.
const GAP: f64 = 3.5;

/// A ring of (stamp in ns, value), stamps increasing.
#[derive(Clone, Debug)]
pub struct History {
    samples: Box<[(i64, f64)]>,
    end: usize,
    len: usize,
}

impl Default for History {
    fn default() -> Self {
        Self { samples: vec![(0, 0.0); CAPACITY].into_boxed_slice(), end: 0, len: 0 }
    }
}

impl History {
    /// Adds the newest sample; one that is not newer than the last replaces its value.
    pub fn push(&mut self, stamp_ns: i64, value: f64) {
        if self.newest().is_some_and(|(last, _)| stamp_ns <= last) {
            self.replace_newest(value);
            return;
        }
        self.samples[self.end % CAPACITY] = (stamp_ns, value);
        self.end += 1;
        self.len = (self.len + 1).min(CAPACITY);
    }

    /// Changes the newest sample's value.
    pub fn replace_newest(&mut self, value: f64) {
        if self.len > 0 {
            self.samples[(self.end - 1) % CAPACITY].1 = value;
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The newest sample.
    #[must_use]
    pub fn newest(&self) -> Option<(i64, f64)> {
        (self.len > 0).then(|| self.at(self.len - 1))
    }

    /// Rewrites every stamp and value; the order of stamps must be kept.
    pub fn rewrite(&mut self, change: impl Fn(i64, f64) -> (i64, f64)) {
        for k in 0..self.len {
            let at = (self.end - self.len + k) % CAPACITY;
            let (stamp, value) = self.samples[at];
            self.samples[at] = change(stamp, value);
        }
    }

    /// The value at this time; beyond either end the nearest sample's. `None` where there is no sample.
    #[must_use]
    pub fn value(&self, stamp_ns: i64) -> Option<f64> {
        let (newest, last) = self.newest()?;
        if stamp_ns >= newest {
            return Some(last);
        }
        let (oldest, first) = self.at(0);
        if stamp_ns <= oldest {
            return Some(first);
        }
        let interval = self.interval(stamp_ns);
        Some(self.between(interval, stamp_ns as f64))
    }

    /// ∫ value dt from one time to another, s; beyond the samples the nearest one is held. Negative when `to < from`.
    #[must_use]
    pub fn integral(&self, from_ns: i64, to_ns: i64) -> f64 {
        if to_ns < from_ns {
            return -self.integral(to_ns, from_ns);
        }
        let (Some((newest, last)), true) = (self.newest(), to_ns > from_ns) else { return 0.0 };
        let (oldest, first) = self.at(0);
        let mut sum = 0.0;
        if from_ns < oldest {
            sum += first * seconds(oldest.min(to_ns), from_ns);
        }
        if to_ns > newest {
            sum += last * seconds(to_ns, newest.max(from_ns));
        }
        let (from, to) = (from_ns.max(oldest), to_ns.min(newest));
        if from >= to {
            return sum;
        }
        let mut left = from;
        let mut interval = self.interval(from);
        while left < to && interval + 1 < self.len {
            let right = self.at(interval + 1).0.min(to);
            let (middle, half) = (left as f64 + 0.5 * (right - left) as f64, 0.5 * (right - left) as f64);
            let node = half / 3.0_f64.sqrt();
            sum += half * 1e-9 * (self.between(interval, middle - node) + self.between(interval, middle + node));
            left = right;
            interval += 1;
        }
        sum
    }

    /// The k-th sample, 0 the oldest.
    fn at(&self, k: usize) -> (i64, f64) {
        self.samples[(self.end - self.len + k) % CAPACITY]
    }

    /// The interval [k, k + 1] that holds this time, which lies between oldest and newest.
    fn interval(&self, stamp_ns: i64) -> usize {
        // Nearly always among the last few.
        let near = self.len.saturating_sub(4);
        let (mut low, mut high) = if self.at(near).0 <= stamp_ns { (near, self.len - 1) } else { (0, near) };
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            if self.at(middle).0 <= stamp_ns {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// The value at a time (ns) within the interval [k, k + 1].
    fn between(&self, k: usize, time_ns: f64) -> f64 {
        let ((t0, y0), (t1, y1)) = (self.at(k), self.at((k + 1).min(self.len - 1)));
        if t1 <= t0 {
            return y0;
        }
        let line = y0 + (y1 - y0) * (time_ns - t0 as f64) / (t1 - t0) as f64;
        // Four samples around the interval, as centred as the ends allow.
        if self.len < 4 {
            return line;
        }
        let start = k.saturating_sub(1).min(self.len - 4);
        let mut t = [0.0; 4];
        let mut y = [0.0; 4];
        for (i, (t, y)) in t.iter_mut().zip(&mut y).enumerate() {
            let (stamp, value) = self.at(start + i);
            *t = stamp as f64 - time_ns;
            *y = value;
        }
        let steps = [t[1] - t[0], t[2] - t[1], t[3] - t[2]];
        let (shortest, longest) = steps.iter().fold((f64::MAX, 0.0_f64), |(a, b), &h| (a.min(h), b.max(h)));
        if longest > GAP * shortest {
            return line;
        }
        // Lagrange at 0.
        let mut sum = 0.0;
        for i in 0..4 {
            let mut weight = 1.0;
            for j in 0..4 {
                if i != j {
                    weight *= t[j] / (t[j] - t[i]);
                }
            }
            sum += weight * y[i];
        }
        sum
    }
}

/// Difference of two stamps, s.
#[must_use]
pub(crate) fn seconds(later_ns: i64, earlier_ns: i64) -> f64 {
    later_ns.saturating_sub(earlier_ns) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps of a jittery 100 Hz clock.
    fn uneven(k: i64) -> i64 {
        k * 10_000_000 + (k * 7919 % 13) * 100_000
    }

    #[test]
    fn a_cubic_is_reproduced_and_integrated_exactly_on_uneven_steps() {
        let f = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t - 4.0 * t * t * t;
        let primitive = |t: f64| t - t * t + t.powi(3) - t.powi(4);
        let mut history = History::default();
        for k in 0..50 {
            let stamp = uneven(k);
            history.push(stamp, f(stamp as f64 * 1e-9));
        }
        let (a, b) = (uneven(3) + 1_234_567, uneven(46) + 3_456_789);
        let exact = primitive(b as f64 * 1e-9) - primitive(a as f64 * 1e-9);
        assert!((history.integral(a, b) - exact).abs() < 1e-12);
        assert!((history.integral(b, a) + exact).abs() < 1e-12);
        assert!((history.value(a).unwrap() - f(a as f64 * 1e-9)).abs() < 1e-11);
    }

    #[test]
    fn the_running_integral_of_a_sine_converges_with_the_fourth_power_of_the_step() {
        let error = |rate_hz: i64| {
            let step = 1_000_000_000 / rate_hz;
            let omega = 20.0_f64;
            let mut history = History::default();
            let (mut sum, mut worst) = (0.0, 0.0_f64);
            history.push(0, 1.0);
            for k in 1..rate_hz {
                let t = (k * step) as f64 * 1e-9;
                history.push(k * step, (omega * t).cos());
                sum += history.integral((k - 1) * step, k * step);
                worst = worst.max((sum - (omega * t).sin() / omega).abs());
            }
            worst
        };
        let order = (error(100) / error(200)).log2();
        assert!(order > 2.9, "order {order}");
        assert!(error(100) < 1e-4, "{}", error(100));
    }

    #[test]
    fn nothing_is_drawn_through_a_gap_but_a_line() {
        let mut history = History::default();
        for k in 0..5 {
            history.push(k * 1_000_000, f64::from(i32::try_from(k).unwrap()).powi(2));
        }
        history.push(1_000_000_000, 0.0);
        let middle = history.value(502_000_000).unwrap();
        assert!((middle - 8.0).abs() < 1e-9, "{middle}");
    }

    #[test]
    fn the_ends_are_held() {
        let mut history = History::default();
        assert_eq!(history.value(0), None);
        assert_eq!(history.integral(0, 10), 0.0);
        history.push(1_000_000_000, 2.0);
        assert_eq!(history.value(5_000_000_000), Some(2.0));
        assert!((history.integral(0, 3_000_000_000) - 6.0).abs() < 1e-12);
    }
}
