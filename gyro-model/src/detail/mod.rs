//! What a reader wants to see beyond the verdict: overlay, error by regime, spectrum, whiteness, heat map.
//!
//! Everything is made from one series: the open-loop angle error e(t) = θ̂(t) − θ_ref(t) at the rows that have a
//! reference. Its increments over a window are the rate error in that window, so encoder noise telescopes instead of
//! drowning the picture.
//!
//! ```text
//! Input ─▶ trace (overlay) · regimes (mean error by bin) · heat_map (regime × frequency)
//!       └▶ spectrum · whiteness · hidden_by_bias ─▶ fails_where (the worst few, in words)
//! ```

mod channels;
mod regimes;
mod says;
mod spectrum;
mod trace;
mod whiteness;

pub use channels::{Channel, channels};
pub use says::fails_where;

use crate::Noise;
use serde::{Deserialize, Serialize};

/// One regime in which the model errs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FailsWhere {
    /// `time`, `rate`, `direction`, `rate-change`, `angle`, `temperature`, `supply`, `rate-y`, `acceleration-x` and their like,
    /// `frequency`, or the name of a free column.
    pub regressor: String,
    /// Lower edge, SI.
    pub from: Option<f64>,
    /// Upper edge, SI.
    pub to: Option<f64>,
    /// Samples in the bin.
    pub samples: usize,
    /// Mean rate error in the bin (gyro less reference), rad/s.
    pub mean_error: Option<f64>,
    /// Its standard error, rad/s.
    pub std_error: Option<f64>,
    /// In words.
    pub says: String,
}

/// What the pictures are made from: plain columns of one axis, of equal length.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Times, s, increasing.
    pub t: &'a [f64],
    /// Compensated rate ω̂, rad/s; `NaN` where there is none.
    pub rate: &'a [f64],
    /// θ̂ − θ_ref, unwrapped, rad; `NaN` where the row has no reference.
    pub error_angle: &'a [f64],
    /// What the error may depend on.
    pub channels: &'a [Channel],
    /// The noise that the floor is made of.
    pub noise: Noise,
}

/// The pictures of one axis. What has no value is `None`, never a number that is not finite.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AxisDetail {
    /// Model and measurement over time.
    pub trace: Trace,
    /// Mean error by regime, the regressor that explains most first.
    pub regimes: Vec<Regime>,
    /// Amplitude spectral densities.
    pub spectrum: Spectrum,
    /// Autocorrelation of the residual and its correlation with the motion.
    pub whiteness: Whiteness,
    /// RMS error by regime and frequency, one map a regressor.
    pub heat_maps: Vec<HeatMap>,
    /// Share of the error's power that a bias state adapting within 10 s would be hiding.
    pub hidden_by_bias: Option<f64>,
}

/// Averages over equal spans of time, so that a long log fits a screen.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Trace {
    /// Middle of the span, s.
    pub t: Vec<f64>,
    /// Rate that the reference measured, rad/s.
    pub measured: Vec<Option<f64>>,
    /// Rate that the model makes of the gyro's readings, rad/s.
    pub model: Vec<Option<f64>>,
    /// Model less measured, rad/s.
    pub residual: Vec<Option<f64>>,
    /// Open-loop angle error, rad.
    pub angle_error: Vec<Option<f64>>,
}

/// Mean error by bins of one regressor.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Regime {
    /// `time`, `rate`, `rate-change`, `direction`, `angle`, `temperature`, `acceleration-x`, …
    pub regressor: String,
    /// Its SI unit.
    pub unit: String,
    /// RMS over the samples of what the bins' means explain, less what noise would, rad/s.
    pub explains: f64,
    /// In the regressor's order.
    pub bins: Vec<RegimeBin>,
}

/// One bin of a [`Regime`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegimeBin {
    /// Lower edge.
    pub from: f64,
    /// Upper edge.
    pub to: f64,
    /// Samples in the bin.
    pub samples: usize,
    /// Mean rate error, rad/s: positive where the compensated rate is too high.
    pub mean: f64,
    /// Its standard error over stretches of time, so that slow errors don't count as many.
    pub std_error: f64,
}

/// One-sided amplitude spectral densities, (rad/s)/√Hz.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Spectrum {
    /// Frequency, Hz.
    pub frequency: Vec<f64>,
    /// Of the rate error.
    pub error: Vec<Option<f64>>,
    /// Of the compensated rate: where the motion has content.
    pub motion: Vec<Option<f64>>,
    /// Expected from gyro and encoder noise alone.
    pub floor: Vec<Option<f64>>,
}

/// Tests of the whitened one-step residual: within the band, a lag says nothing.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Whiteness {
    /// Lag, s, from the first on.
    pub lag_s: Vec<f64>,
    /// Autocorrelation.
    pub autocorrelation: Vec<f64>,
    /// Lag, s, negative where the motion comes after.
    pub cross_lag_s: Vec<f64>,
    /// Correlation with the motion, filtered alike.
    pub motion_correlation: Vec<f64>,
    /// Half width in which 99 % of the lags of a white residual lie.
    pub band_99: f64,
    /// The same for the correlation with a motion that the residual does not follow, white or not.
    pub motion_band_99: f64,
}

/// RMS error by regime (rows) and frequency (columns).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HeatMap {
    /// The regressor of the rows.
    pub regressor: String,
    /// Its SI unit.
    pub unit: String,
    /// Edges of the rows, one more than rows.
    pub edges: Vec<f64>,
    /// Middle frequency of the columns, Hz.
    pub frequency: Vec<f64>,
    /// RMS, rad/s, row by row.
    pub rms: Vec<Vec<Option<f64>>>,
    /// What noise alone makes of each column, rad/s.
    pub floor: Vec<Option<f64>>,
}

/// Computes every picture of one axis. Linear in the length of the log.
///
/// # Panics
/// Where the columns differ in length.
#[must_use]
pub fn detail(input: &Input) -> AxisDetail {
    assert!(
        input.rate.len() == input.t.len() && input.error_angle.len() == input.t.len(),
        "columns of one axis have one length"
    );
    let referenced = Referenced::of(input);
    if referenced.t.len() < 16 {
        return AxisDetail::default();
    }
    AxisDetail {
        trace: trace::trace(input, &referenced),
        regimes: regimes::regimes(input, &referenced),
        spectrum: spectrum::spectrum(input, &referenced),
        whiteness: whiteness::whiteness(input, &referenced),
        heat_maps: regimes::heat_maps(input, &referenced),
        hidden_by_bias: whiteness::hidden_by_bias(&referenced),
    }
}

/// The rows that have a reference.
struct Referenced {
    /// Their places in the input.
    row: Vec<usize>,
    /// Times, s.
    t: Vec<f64>,
    /// Angle error, rad.
    error: Vec<f64>,
    /// Median interval, s.
    dt: f64,
}

impl Referenced {
    fn of(input: &Input) -> Self {
        let row: Vec<usize> =
            (0..input.t.len()).filter(|&k| input.error_angle[k].is_finite() && input.t[k].is_finite()).collect();
        let t: Vec<f64> = row.iter().map(|&k| input.t[k]).collect();
        let error = row.iter().map(|&k| input.error_angle[k]).collect();
        let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let dt = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        Self { row, t, error, dt }
    }

    fn duration(&self) -> f64 {
        self.t[self.t.len() - 1] - self.t[0]
    }

    /// Adjoining windows of at least `tau` seconds, as pairs of indices; none spans a gap of more than `tau`.
    fn windows(&self, tau: f64) -> Vec<(usize, usize)> {
        let mut windows = Vec::new();
        let mut from = 0;
        for k in 1..self.t.len() {
            if self.t[k] - self.t[k - 1] > tau.max(4.0 * self.dt) {
                from = k;
            } else if self.t[k] - self.t[from] >= tau * (1.0 - 1e-9) {
                windows.push((from, k));
                from = k;
            }
        }
        windows
    }

    /// Mean rate error between two of the rows, rad/s.
    fn rate_error(&self, (from, to): (usize, usize)) -> f64 {
        (self.error[to] - self.error[from]) / (self.t[to] - self.t[from])
    }
}

/// Mean of the finite values; `NaN` where there is none.
fn mean(values: &[f64]) -> f64 {
    let (sum, n) = values.iter().filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / n
}

/// Five significant digits: what a picture needs.
fn short(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let scale = 10f64.powi(4 - x.abs().log10().floor() as i32);
    let y = (x * scale).round() / scale;
    if y.is_finite() { y } else { x }
}

/// The value, five digits, where there is one.
fn some(x: f64) -> Option<f64> {
    x.is_finite().then(|| short(x))
}

#[cfg(test)]
mod tests;
