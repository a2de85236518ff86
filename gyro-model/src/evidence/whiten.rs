//! The noise as a state-space model, and through it generalised least squares.
//!
//! The residual angle r at the reference rows is, with no physics missing,
//!
//! ```text
//! ȧ = b + c + N w₁      angle random walk N, rad/√s
//! ḃ = B w₂              bias random walk B, rad/s/√s
//! ċ = −c/T + s√(2/T) w₃  exponentially correlated rate, s rad/s over T s
//! r = a + e             encoder noise e, variance R (rad²), shared by the readings of one encoder step
//! ```
//!
//! A Kalman filter of it turns r, and every column with the same gains, into innovations that are white; least squares
//! on those is the generalised least squares of r (Harvey, Forecasting, Structural Time Series Models, §3.4). The
//! likelihood of the same filter identifies N, B, R, s, T.

/// The parameters of the noise model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// N, rad/√s.
    pub angle_random_walk: f64,
    /// B, rad/s/√s.
    pub bias_random_walk: f64,
    /// Standard deviation of one independent reference reading, rad.
    pub encoder: f64,
    /// s, rad/s.
    pub correlated: f64,
    /// T, s.
    pub correlation_time: f64,
}

/// The gains of the filter along one log: computed once, applied to many series.
#[derive(Clone, Debug)]
pub struct Whitener {
    steps: Vec<Step>,
    /// Σ ln S over the rows that count.
    pub log_determinant: f64,
    /// Rows that count.
    pub count: usize,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    dt: f64,
    phi: f64,
    gain: [f64; 3],
    /// 1/√S; 0 where the row says nothing.
    weight: f64,
}

impl Whitener {
    /// Gains for rows at `t`, `plateau[i]` readings sharing one encoder step, and steps `lost` that say nothing.
    #[must_use]
    pub fn new(noise: &NoiseModel, t: &[f64], plateau: &[f64], lost: &[bool]) -> Self {
        let (n2, b2, r) = (noise.angle_random_walk.powi(2), noise.bias_random_walk.powi(2), noise.encoder.powi(2));
        let c2 = noise.correlated.powi(2);
        // Symmetric covariance of (a, b, c); a starts unknown: the first reading sets it.
        let mut p = [[0.0_f64; 3]; 3];
        p[0][0] = 1e6;
        p[2][2] = c2;
        let (mut steps, mut log_determinant, mut count) = (Vec::with_capacity(t.len()), 0.0, 0);
        for i in 0..t.len() {
            let dt = if i == 0 { 0.0 } else { t[i] - t[i - 1] };
            let phi = if c2 > 0.0 { (-dt / noise.correlation_time).exp() } else { 0.0 };
            let gap = lost[i] && i > 0;
            if gap {
                p[0][0] += 1e6;
            } else {
                // a += dt (b + c), c *= phi
                let f = |row: [f64; 3]| [row[0] + dt * (row[1] + row[2]), row[1], phi * row[2]];
                let left = [f(p[0]), f(p[1]), f(p[2])];
                let column = |j: usize| [left[0][j] + dt * (left[1][j] + left[2][j]), left[1][j], phi * left[2][j]];
                let (x, y, z) = (column(0), column(1), column(2));
                p = [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]];
                p[0][0] += n2 * dt + b2 * dt.powi(3) / 3.0;
                p[0][1] += b2 * dt * dt / 2.0;
                p[1][0] = p[0][1];
                p[1][1] += b2 * dt;
                p[2][2] += c2 * (1.0 - phi * phi);
            }
            let s = p[0][0] + r * plateau[i] + 1e-24;
            let gain = [p[0][0] / s, p[1][0] / s, p[2][0] / s];
            let row = p[0];
            for (pr, g) in p.iter_mut().zip(gain) {
                for (x, y) in pr.iter_mut().zip(row) {
                    *x -= g * y;
                }
            }
            let counts = i > 0 && !gap;
            if counts {
                log_determinant += s.ln();
                count += 1;
            }
            steps.push(Step { dt, phi, gain, weight: if counts { s.sqrt().recip() } else { 0.0 } });
        }
        Self { steps, log_determinant, count }
    }

    /// The whitened series: innovations over their standard deviations; 0 where a row says nothing.
    #[must_use]
    pub fn apply(&self, y: &[f64]) -> Vec<f64> {
        let [mut a, mut b, mut c] = [0.0; 3];
        self.steps
            .iter()
            .zip(y)
            .map(|(s, &y)| {
                a += s.dt * (b + c);
                c *= s.phi;
                let e = y - a;
                a += s.gain[0] * e;
                b += s.gain[1] * e;
                c += s.gain[2] * e;
                e * s.weight
            })
            .collect()
    }

    /// Sum of squares of the whitened series, without storing it.
    pub fn sum_of_squares(&self, y: impl Iterator<Item = f64>) -> f64 {
        let [mut a, mut b, mut c] = [0.0; 3];
        self.steps
            .iter()
            .zip(y)
            .map(|(s, y)| {
                a += s.dt * (b + c);
                c *= s.phi;
                let e = y - a;
                a += s.gain[0] * e;
                b += s.gain[1] * e;
                c += s.gain[2] * e;
                (e * s.weight).powi(2)
            })
            .sum()
    }

    /// Σ ln S over some of the rows.
    #[must_use]
    pub fn log_determinant_of(&self, rows: std::ops::Range<usize>) -> f64 {
        self.steps[rows].iter().filter(|s| s.weight > 0.0).map(|s| -2.0 * s.weight.ln()).sum()
    }

    /// ln L of a whitened residual whose sum of squares is `rss` (constants left out).
    #[must_use]
    pub fn log_likelihood(&self, rss: f64) -> f64 {
        -0.5 * (self.log_determinant + rss)
    }
}

/// Minimum of `f` by the simplex of Nelder and Mead from `start` with first steps `scale`.
pub(crate) fn simplex(
    start: &[f64],
    scale: f64,
    evaluations: usize,
    mut f: impl FnMut(&[f64]) -> f64,
) -> (Vec<f64>, f64) {
    let n = start.len();
    let mut points: Vec<(Vec<f64>, f64)> = Vec::with_capacity(n + 1);
    for k in 0..=n {
        let mut p = start.to_vec();
        if k > 0 {
            p[k - 1] += scale;
        }
        let value = f(&p);
        points.push((p, value));
    }
    let mut used = n + 1;
    while used < evaluations {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        if points[n].1 - points[0].1 < 1e-3 {
            break;
        }
        let centre: Vec<f64> = (0..n).map(|i| points[..n].iter().map(|p| p.0[i]).sum::<f64>() / n as f64).collect();
        let towards = |factor: f64, worst: &[f64]| -> Vec<f64> {
            centre.iter().zip(worst).map(|(c, w)| c + factor * (w - c)).collect()
        };
        let reflected = towards(-1.0, &points[n].0);
        let value = f(&reflected);
        used += 1;
        if value < points[0].1 {
            let expanded = towards(-2.0, &points[n].0);
            let further = f(&expanded);
            used += 1;
            points[n] = if further < value { (expanded, further) } else { (reflected, value) };
        } else if value < points[n - 1].1 {
            points[n] = (reflected, value);
        } else {
            let contracted = towards(0.5, &points[n].0);
            let inside = f(&contracted);
            used += 1;
            if inside < points[n].1 {
                points[n] = (contracted, inside);
            } else {
                let best = points[0].0.clone();
                for point in points.iter_mut().skip(1) {
                    for (x, b) in point.0.iter_mut().zip(&best) {
                        *x = 0.5 * (*x + b);
                    }
                    point.1 = f(&point.0);
                    used += 1;
                }
            }
        }
    }
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points.swap_remove(0)
}
