//! What several effects are made of: play, derivatives of samples, a first-order low-pass.

use super::Memory;

/// One step of the play operator of width `w`: the output stays until the input has left the clearance ±w/2 about it.
/// Memory: [0] output, [6] started.
pub(crate) fn play(w: f64, input: f64, memory: &mut Memory) -> f64 {
    if memory[6] == 0.0 {
        memory[6] = 1.0;
        memory[0] = input;
    }
    memory[0] = memory[0].clamp(input - 0.5 * w, input + 0.5 * w);
    memory[0]
}

/// Derivative of samples at uneven times, centred, of fourth order where five even samples stand around.
pub(crate) fn derivative(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = y.len();
    (0..n)
        .map(|k| {
            if n < 2 {
                return 0.0;
            }
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            if k < 2 || k + 2 >= n {
                return (y[b] - y[a]) / (t[b] - t[a]);
            }
            let near = (y[k + 1] - y[k - 1]) / (t[k + 1] - t[k - 1]);
            let far = (y[k + 2] - y[k - 2]) / (t[k + 2] - t[k - 2]);
            if is_even(t, k) { (4.0 * near - far) / 3.0 } else { near }
        })
        .collect()
}

/// Second derivative of samples at uneven times, centred, of fourth order where five even samples stand around.
pub(crate) fn second_derivative(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = y.len();
    (0..n)
        .map(|k| {
            if n < 3 {
                return 0.0;
            }
            let k = k.clamp(1, n - 2);
            let around = |step: usize| {
                let (ahead, behind) = (t[k + step] - t[k], t[k] - t[k - step]);
                2.0 * ((y[k + step] - y[k]) / ahead - (y[k] - y[k - step]) / behind) / (ahead + behind)
            };
            if k < 2 || k + 2 >= n {
                return around(1);
            }
            if is_even(t, k) { (4.0 * around(1) - around(2)) / 3.0 } else { around(1) }
        })
        .collect()
}

/// Whether the five times about `k` are evenly spaced, to 2 % of their span.
fn is_even(t: &[f64], k: usize) -> bool {
    let (span, mean) = (t[k + 2] - t[k - 2], 0.5 * (t[k + 2] + t[k - 2]));
    let steps = [t[k + 1] - t[k], t[k] - t[k - 1]];
    steps.iter().all(|step| (4.0 * step - span).abs() < 0.02 * span) && (t[k] - mean).abs() < 0.02 * span
}

/// The rate without its fastest noise: a parabola through the samples within ±12 ms. A play operator or a threshold
/// would follow the noise, which the sensor's physics does not see.
pub(crate) fn steadied(t: &[f64], rate: &[f64]) -> Vec<f64> {
    let n = rate.len();
    let half = (STEADY / ((t[n - 1] - t[0]) / (n - 1) as f64)) as usize;
    if half < 2 {
        return rate.to_vec();
    }
    let m = half as f64;
    // Savitzky and Golay's weights for a quadratic: (3m² + 3m − 1 − 5k²) / norm.
    let weight = |k: f64| 3.0 * m * m + 3.0 * m - 1.0 - 5.0 * k * k;
    let norm = (2.0 * m + 3.0) * (2.0 * m + 1.0) * (2.0 * m - 1.0) / 3.0;
    let weights: Vec<f64> = (0..=2 * half).map(|k| weight(k as f64 - m) / norm).collect();
    (0..n)
        .map(|k| {
            if k < half || k + half >= n {
                rate[k]
            } else {
                rate[k - half..=k + half].iter().zip(&weights).map(|(r, w)| r * w).sum()
            }
        })
        .collect()
}

/// Half width of that window, s.
pub(crate) const STEADY: f64 = 0.012;

/// One step of the first-order low-pass T y' + y = u, exact for an input that goes linearly from `u0` to `u1`.
pub(crate) fn low_pass(y: f64, u0: f64, u1: f64, dt: f64, time_constant: f64) -> f64 {
    if dt <= 0.0 {
        return y;
    }
    if time_constant <= 0.0 {
        return u1;
    }
    let a = dt / time_constant;
    let rise = -(-a).exp_m1();
    y + (u0 - y) * rise + (u1 - u0) * (1.0 - rise / a)
}
