//! Is the residual white, does it follow the motion, and how much of it would an adaptive bias state hide?

use super::{Input, Referenced, Whiteness, short};

/// Lags that are shown.
const LAGS: usize = 40;

/// Autocorrelation of the whitened one-step residual and its correlation with the motion through the same filter.
///
/// The angle error carries gyro noise (a random walk) and encoder noise (white). The scalar Kalman filter of that pair,
/// ê ← ê + K (e − ê), whitens it: v = e − ê. K is the one of the smallest Σv², the maximum-likelihood choice. What is left of
/// physics or of a bias that wanders stays in v, which is then not white: the band of its correlation with the motion is
/// that of two signals with the autocorrelations that they have (Bartlett 1955).
pub(super) fn whiteness(input: &Input, referenced: &Referenced) -> Whiteness {
    let drift = referenced.rate_error((0, referenced.t.len() - 1));
    let error: Vec<f64> =
        referenced.error.iter().zip(&referenced.t).map(|(e, t)| e - drift * (t - referenced.t[0])).collect();
    let gain = (1..=40)
        .map(|i| f64::from(i) / 40.0)
        .min_by(|&a, &b| power(&error, a).total_cmp(&power(&error, b)))
        .unwrap_or(1.0);
    let residual = normalised(innovations(&error, gain));
    // The motion's own increments through the same filter.
    let mut angle = 0.0;
    let turned: Vec<f64> = referenced
        .row
        .iter()
        .zip(&referenced.t)
        .scan(referenced.t[0], |last, (&row, &t)| {
            let rate = input.rate[row];
            if rate.is_finite() {
                angle += rate * (t - *last);
            }
            *last = t;
            Some(angle)
        })
        .collect();
    let motion = normalised(innovations(&turned, gain));
    let n = residual.len() as f64;
    let lags: Vec<isize> = (-LAGS.cast_signed()..=LAGS.cast_signed()).collect();
    let of_itself = |v: &[f64]| -> Vec<f64> { (1..=LAGS).map(|k| correlation(v, v, k.cast_signed())).collect() };
    let (own, of_motion) = (of_itself(&residual), of_itself(&motion));
    // Two independent signals that both remember correlate by more than white ones: the variance is Σ ρ(k) ρ'(k) / n.
    let remembered = 1.0 + 2.0 * own.iter().zip(&of_motion).map(|(a, b)| a * b).sum::<f64>();
    let band = 2.576 / n.sqrt();
    Whiteness {
        lag_s: (1..=LAGS).map(|k| short(k as f64 * referenced.dt)).collect(),
        autocorrelation: own.into_iter().map(short).collect(),
        cross_lag_s: lags.iter().map(|&k| short(k as f64 * referenced.dt)).collect(),
        motion_correlation: lags.iter().map(|&k| short(correlation(&residual, &motion, k))).collect(),
        band_99: short(band),
        motion_band_99: short(band * remembered.max(1.0).sqrt()),
    }
}

/// Share of the power of the rate error (averages over 1 s, or 20 samples where that is longer) that a bias state
/// following it with a time constant of 10 s would take away from the innovations: 1 − Σ(r_i − b_{i−1})² / Σr_i².
pub(super) fn hidden_by_bias(referenced: &Referenced) -> Option<f64> {
    let tau = (20.0 * referenced.dt).max(1.0);
    let errors: Vec<f64> = referenced.windows(tau).into_iter().map(|w| referenced.rate_error(w)).collect();
    let share = tau / 10f64.max(4.0 * tau);
    let mut bias = 0.0;
    let (mut left, mut all) = (0.0, 0.0);
    for r in &errors {
        left += (r - bias) * (r - bias);
        all += r * r;
        bias += share * (r - bias);
    }
    (errors.len() >= 20 && all > 0.0).then(|| short((1.0 - left / all).max(0.0)))
}

fn innovations(e: &[f64], gain: f64) -> Vec<f64> {
    let mut estimate = e[0];
    e[1..]
        .iter()
        .map(|&e| {
            let v = e - estimate;
            estimate += gain * v;
            v
        })
        .collect()
}

fn power(e: &[f64], gain: f64) -> f64 {
    innovations(e, gain).iter().map(|v| v * v).sum()
}

/// Zero mean, unit power.
fn normalised(mut v: Vec<f64>) -> Vec<f64> {
    let mean = super::mean(&v);
    for x in &mut v {
        *x -= mean;
    }
    let rms = (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
    if rms > 0.0 {
        for x in &mut v {
            *x /= rms;
        }
    }
    v
}

/// Mean of a(t)·b(t − lag).
fn correlation(a: &[f64], b: &[f64], lag: isize) -> f64 {
    let n = a.len();
    let shift = lag.unsigned_abs();
    if shift >= n {
        return 0.0;
    }
    let (a, b) = if lag >= 0 { (&a[shift..], &b[..n - shift]) } else { (&a[..n - shift], &b[shift..]) };
    a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / n as f64
}
