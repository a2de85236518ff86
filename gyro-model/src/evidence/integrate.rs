//! Integration and interpolation of sampled rates, of third order: the trapezoid's error at 100 Hz would look like a delay.

/// ∫ y dt at every sample from the first: cubic through four samples where they are about even, else the trapezoid.
#[must_use]
pub(crate) fn integral(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = y.len();
    let mut out = vec![0.0; n];
    for k in 1..n {
        let h = t[k] - t[k - 1];
        let mut area = 0.5 * h * (y[k] + y[k - 1]);
        if k >= 2 && k + 1 < n {
            let (before, after) = (t[k - 1] - t[k - 2], t[k + 1] - t[k]);
            if (before - h).abs() < 0.3 * h && (after - h).abs() < 0.3 * h {
                // The trapezoid less h³/12 y'': the second derivative at the middle from the two outer slopes.
                let (left, right) = ((y[k - 1] - y[k - 2]) / before, (y[k + 1] - y[k]) / after);
                area -= h.powi(3) / 12.0 * (right - left) / (h + 0.5 * (before + after));
            }
        }
        out[k] = out[k - 1] + area;
    }
    out
}

/// Value at `x` of the cubic Hermite curve with values `y` and slopes `slope` at `t`; linear beyond the ends. `hint` is
/// where the last look-up ended.
pub(crate) fn hermite(t: &[f64], y: &[f64], slope: &[f64], x: f64, hint: &mut usize) -> f64 {
    let n = t.len();
    let mut k = (*hint).min(n - 2);
    while k + 2 < n && t[k + 1] <= x {
        k += 1;
    }
    while k > 0 && t[k] > x {
        k -= 1;
    }
    *hint = k;
    let (a, b) = (t[k], t[k + 1]);
    if x <= a {
        return y[k] + slope[k] * (x - a);
    }
    if x >= b {
        return y[k + 1] + slope[k + 1] * (x - b);
    }
    let h = b - a;
    cubic([y[k], y[k + 1]], [h * slope[k], h * slope[k + 1]], (x - a) / h)
}

/// The cubic with these values and slopes at 0 and 1.
#[must_use]
pub(crate) fn cubic([y0, y1]: [f64; 2], [slope0, slope1]: [f64; 2], s: f64) -> f64 {
    let (s2, s3) = (s * s, s * s * s);
    y0 * (2.0 * s3 - 3.0 * s2 + 1.0) + slope0 * (s3 - 2.0 * s2 + s) + y1 * (3.0 * s2 - 2.0 * s3) + slope1 * (s3 - s2)
}

/// Moving average of `y` over ±`half` seconds, by times; near the ends the window shrinks evenly on both sides, so that
/// a straight line stays itself.
#[must_use]
pub(crate) fn smooth(t: &[f64], y: &[f64], half: f64) -> Vec<f64> {
    let n = y.len();
    let mut sum = vec![0.0; n + 1];
    for k in 0..n {
        sum[k + 1] = sum[k] + y[k];
    }
    let (mut a, mut b) = (0, 0);
    (0..n)
        .map(|k| {
            let reach = half.min(t[k] - t[0]).min(t[n - 1] - t[k]);
            while t[a] < t[k] - reach - 1e-12 {
                a += 1;
            }
            while a > 0 && t[a - 1] >= t[k] - reach - 1e-12 {
                a -= 1;
            }
            while b + 1 < n && t[b + 1] <= t[k] + reach + 1e-12 {
                b += 1;
            }
            while b > k && t[b] > t[k] + reach + 1e-12 {
                b -= 1;
            }
            (sum[b + 1] - sum[a]) / (b + 1 - a) as f64
        })
        .collect()
}

/// Slope at each point of the parabola through it and its neighbours; of the straight line at the ends.
pub(super) fn three_point_slopes(t: &[f64], y: &[f64]) -> Vec<f64> {
    let line = |k: usize| (y[k + 1] - y[k]) / (t[k + 1] - t[k]);
    let last = t.len() - 1;
    let inner = |k: usize| {
        let (before, after) = (t[k] - t[k - 1], t[k + 1] - t[k]);
        (line(k - 1) * after + line(k) * before) / (before + after)
    };
    (0..=last)
        .map(|k| {
            if k == 0 {
                line(0)
            } else if k == last {
                line(last - 1)
            } else {
                inner(k)
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_of_a_sine_at_twenty_samples_a_period_is_right_to_a_few_parts_in_ten_thousand() {
        let t: Vec<f64> = (0..400).map(|k| f64::from(k) * std::f64::consts::TAU / 20.0).collect();
        let y: Vec<f64> = t.iter().map(|t| t.cos()).collect();
        let s = integral(&t, &y);
        for k in 20..380 {
            assert!((s[k] - s[20] - t[k].sin() + t[20].sin()).abs() < 1e-3);
        }
    }

    #[test]
    fn hermite_follows_a_cubic_exactly() {
        let t: Vec<f64> = (0..20).map(|k| f64::from(k) * 0.5 + 0.01 * f64::from(k % 3)).collect();
        let y: Vec<f64> = t.iter().map(|t| t.powi(3)).collect();
        let d: Vec<f64> = t.iter().map(|t| 3.0 * t * t).collect();
        let mut hint = 0;
        for x in [0.1, 3.33, 7.9, 2.0] {
            assert!((hermite(&t, &y, &d, x, &mut hint) - x.powi(3)).abs() < 1e-9);
        }
    }

    #[test]
    fn smoothing_keeps_a_line() {
        let t: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.1).collect();
        let y: Vec<f64> = t.iter().map(|t| 2.0 + 3.0 * t).collect();
        assert!(smooth(&t, &y, 2.0).iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
