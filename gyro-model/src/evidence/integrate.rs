//! Integration and interpolation of sampled rates, of third order: the trapezoid's error at 100 Hz would look like a delay.

/// ∫ y dt at every sample from the first: cubic through four samples where they are about even, else the trapezoid.
#[must_use]
pub fn integral(t: &[f64], y: &[f64]) -> Vec<f64> {
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
pub fn hermite(t: &[f64], y: &[f64], slope: &[f64], x: f64, hint: &mut usize) -> f64 {
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
    let (h, s) = (b - a, (x - a) / (b - a));
    let (s2, s3) = (s * s, s * s * s);
    y[k] * (2.0 * s3 - 3.0 * s2 + 1.0)
        + h * slope[k] * (s3 - 2.0 * s2 + s)
        + y[k + 1] * (3.0 * s2 - 2.0 * s3)
        + h * slope[k + 1] * (s3 - s2)
}

/// Moving average of `y` over ±`half` seconds, by times; near the ends the window shrinks evenly on both sides, so that
/// a straight line stays itself.
#[must_use]
pub fn smooth(t: &[f64], y: &[f64], half: f64) -> Vec<f64> {
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

/// Slope of what lies within ±`half` seconds, by times; near the ends of what there is of it. Lines through all of it and through
/// its inner half give the slope of a cubic (Richardson's extrapolation): of a sine, x = ω·half/2, 1 − x⁴/70 is left.
#[must_use]
pub fn slope(t: &[f64], y: &[f64], half: f64) -> Vec<f64> {
    let (near, far) = (slope_of_line(t, y, 0.5 * half), slope_of_line(t, y, half));
    near.iter().zip(far).map(|(near, far)| (4.0 * near - far) / 3.0).collect()
}

/// Slope of the line through what lies within ±`half` seconds.
fn slope_of_line(t: &[f64], y: &[f64], half: f64) -> Vec<f64> {
    // Sums of 1, t, y, tt and ty up to each sample, about the middle of the log for the sake of rounding.
    let middle = t.get(t.len() / 2).copied().unwrap_or(0.0);
    let level = y.get(y.len() / 2).copied().unwrap_or(0.0);
    let mut sums = vec![[0.0; 5]; t.len() + 1];
    for k in 0..t.len() {
        let (t, y) = (t[k] - middle, y[k] - level);
        for (i, value) in [1.0, t, y, t * t, t * y].into_iter().enumerate() {
            sums[k + 1][i] = sums[k][i] + value;
        }
    }
    let (mut from, mut to) = (0, 0);
    (0..t.len())
        .map(|k| {
            while t[from] < t[k] - half - 1e-12 {
                from += 1;
            }
            while to < t.len() && t[to] <= t[k] + half + 1e-12 {
                to += 1;
            }
            let [n, t, y, tt, ty]: [f64; 5] = std::array::from_fn(|i| sums[to][i] - sums[from][i]);
            let spread = tt - t * t / n;
            if spread > 0.0 { (ty - t * y / n) / spread } else { 0.0 }
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

    #[test]
    fn the_slope_of_a_noisy_line_is_the_lines_and_that_of_a_sine_of_ten_seconds_its_own() {
        let t: Vec<f64> = (0..3000).map(|k| f64::from(k) * 0.01).collect();
        let line: Vec<f64> = (0..3000).map(|k| 5.0 - 0.3 * t[k as usize] + 0.02 * f64::from(k % 7 - 3)).collect();
        // Within a second of an end half of the inner line is missing, and noise shows.
        assert!(slope(&t, &line, 2.0)[100..2900].iter().all(|s| (s + 0.3).abs() < 5e-3));
        for omega in [0.12_f64, 0.6] {
            let sine: Vec<f64> = t.iter().map(|t| (omega * t).sin()).collect();
            let slopes = slope(&t, &sine, 2.0);
            let off = |k: usize| (slopes[k] / omega - (omega * t[k]).cos()).abs();
            assert!((300..2700).all(|k| off(k) < 3e-3), "{omega} rad/s");
        }
    }
}
