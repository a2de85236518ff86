//! Whether bias or scale error are no longer what the filter knows: the sum and the size of its innovations beside a reference.
//!
//! Innovations ν of variance S of a filter that knows what it knows have a mean square of one in √S, and any sign. The variance of a
//! reading holds for means over seconds ([`super::reference_noise`]), so it is no smaller for noise that is correlated. Over a time T that fades,
//!
//! ```text
//! |Σ ν/√S| / √n          large: a bias has changed
//! |Σ ω ν/√S| / √Σ ω²     large: a scale error has changed
//! √(Σ ν²/S / n)          large: either, while the motion goes to and fro
//! ```

use crate::kalman::GATE;

/// T beside an angle, s, …
pub(super) const OF_ANGLES: f64 = 3.0;
/// … and beside a rate, which shows by its mean alone what an angle adds up.
pub(super) const OF_RATES: f64 = 10.0;

/// Standard deviations of a sum that say so: 1 in 10⁵ by chance.
const FAR: f64 = 4.5;

/// The same of the root mean square.
const LARGE: f64 = 2.0;

/// Fewest innovations that say so.
const FEWEST: f64 = 4.0;

/// See the module's head.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trend {
    /// Time of the last innovation, s.
    t: f64,
    /// Σ ν/√S and Σ ω ν/√S, and the variances that they have where innovations are white.
    sums: [f64; 2],
    variances: [f64; 2],
    /// Σ ν²/S, and the sum of the weights.
    squares: f64,
    count: f64,
}

impl Trend {
    /// Takes an innovation in its standard deviations at `t` seconds and at this rate; `over` is T. Returns by what factor bias and scale error are
    /// known worse than the filter has it, where it says so, and begins again.
    pub(super) fn take(&mut self, t: f64, whitened: f64, rate: f64, over: f64) -> Option<f64> {
        if !(whitened.is_finite() && rate.is_finite()) {
            return None;
        }
        let fade = (-(t - self.t).max(0.0) / over).exp();
        self.t = t;
        let nu = whitened.clamp(-GATE, GATE);
        for (k, h) in [1.0, rate].into_iter().enumerate() {
            self.sums[k] = fade * self.sums[k] + h * nu;
            self.variances[k] = fade * fade * self.variances[k] + h * h;
        }
        (self.squares, self.count) = (fade * self.squares + nu * nu, fade * self.count + 1.0);
        let [bias, scale] = [0, 1].map(|k| self.sums[k].abs() / self.variances[k].max(f64::MIN_POSITIVE).sqrt());
        let size = (self.squares / self.count).sqrt();
        let off = bias.max(scale).max(FAR / LARGE * size);
        if self.count < FEWEST || off < FAR {
            return None;
        }
        *self = Self { t, ..Self::default() };
        Some(off)
    }
}
