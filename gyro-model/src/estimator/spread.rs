//! White noise of a sampled signal, found from its own differences.

use crate::history::seconds;

/// Over how many samples noise and interval are averaged.
const AVERAGE: f64 = 256.0;

/// Readings from which on the smallest variance of them is kept, and how fast it is forgotten, s.
const LEAST_OF: f64 = 100.0;
const FORGOTTEN: f64 = 100.0;

/// White noise of a sampled signal from its third differences (which a smooth motion leaves alone), and its interval.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spread {
    pub(super) last: [f64; 6],
    pub(super) variance: f64,
    /// The same from sixth differences, which leave of a motion still less, and the smallest of that in the last minutes.
    sharp: f64,
    pub(super) least: f64,
    pub(super) interval: f64,
    pub(super) t_ns: i64,
    pub(super) count: f64,
}

impl Spread {
    pub(super) fn take(&mut self, t_ns: i64, value: f64) {
        let dt = seconds(t_ns, self.t_ns);
        if self.count > 0.0 && dt <= 0.0 {
            return;
        }
        let weight = 1.0 / self.count.clamp(1.0, AVERAGE);
        if self.count == 1.0 {
            self.interval = dt;
        } else if self.count > 1.0 {
            self.interval += weight * (dt.clamp(0.3 * self.interval, 3.0 * self.interval) - self.interval);
        }
        let [a, b, c, d, e, f] = self.last;
        if self.count >= 3.0 {
            // Σ of squared weights 1, 3, 3, 1 is 20.
            let square = (value - 3.0 * a + 3.0 * b - c).powi(2) / 20.0;
            self.variance += (square - self.variance) / (self.count - 2.0).min(AVERAGE);
        }
        if self.count >= 6.0 {
            // Σ of squared weights 1, 6, 15, 20, 15, 6, 1 is 924.
            let square = (value - 6.0 * a + 15.0 * b - 20.0 * c + 15.0 * d - 6.0 * e + f).powi(2) / 924.0;
            self.sharp += (square - self.sharp) / (self.count - 5.0).min(AVERAGE);
        }
        if self.count > LEAST_OF {
            let risen =
                if self.least > 0.0 { self.least * (1.0 + dt.clamp(0.0, 1.0) / FORGOTTEN) } else { f64::INFINITY };
            self.least = self.sharp.min(risen);
        }
        self.last = [value, a, b, c, d, e];
        self.t_ns = t_ns;
        self.count += 1.0;
    }
}
