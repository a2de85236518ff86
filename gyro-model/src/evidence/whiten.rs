//! The noise as a state-space model, and through it generalised least squares.
//!
//! The residual angle r at the reference rows is, with no physics missing,
//!
//! ```text
//! ȧ = b + c + √(N² + N_ω²ω²) w₁  angle random walk N, rad/√s, and what it grows by with the rate, N_ω, √s
//! ḃ = B w₂                bias random walk B, rad/s/√s
//! ċ = −c/T + s√(2/T) w₃   exponentially correlated rate, s rad/s over T s
//! r = a + e               encoder noise e, variance R (rad²)
//! ```
//!
//! An encoder that shows the same count for a while says something once in that while, not at every row: only such
//! readings enter ([`Rows`]). Counted at every row, a standstill would look like a reference without noise.
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
    /// N_ω, √s.
    pub rate_random_walk: f64,
}

impl NoiseModel {
    /// No limit to any parameter.
    pub const UNLIMITED: Self = Self {
        angle_random_walk: f64::INFINITY,
        bias_random_walk: f64::INFINITY,
        encoder: f64::INFINITY,
        correlated: f64::INFINITY,
        correlation_time: f64::INFINITY,
        rate_random_walk: f64::INFINITY,
    };
}

/// The readings that the filter runs over.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Where each stands among the reference rows.
    pub index: Vec<usize>,
    /// Its time, s.
    pub t: Vec<f64>,
    /// ∫ω²dt since the one before, rad²/s.
    pub turned: Vec<f64>,
    /// Its variance over R.
    pub spread: Vec<f64>,
    /// Whether something was lost since the one before.
    pub lost: Vec<bool>,
    /// How many reference rows there are.
    pub rows: usize,
}

/// The gains of the filter along one log: computed once, applied to many series.
#[derive(Clone, Debug)]
pub struct Whitener {
    steps: Vec<Step>,
    index: Vec<usize>,
    rows: usize,
    /// Σ ln S over the readings that count.
    pub log_determinant: f64,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    dt: f64,
    phi: f64,
    gain: [f64; 3],
    /// 1/√S; 0 where the row says nothing.
    weight: f64,
}

/// The covariance of the filter along the rows of a log.
struct Gains<'a> {
    noise: &'a NoiseModel,
    rows: &'a Rows,
}

impl Gains<'_> {
    /// Hands each row's step and its innovation variance S to `take`; S is `None` where the row says nothing.
    fn run(&self, mut take: impl FnMut(Step, Option<f64>)) {
        let (noise, rows) = (self.noise, self.rows);
        let (n2, b2, r) = (noise.angle_random_walk.powi(2), noise.bias_random_walk.powi(2), noise.encoder.powi(2));
        let (c2, m2) = (noise.correlated.powi(2), noise.rate_random_walk.powi(2));
        // Covariance of (a, b, c), upper triangle; a starts unknown: the first reading sets it.
        let (mut aa, mut ab, mut ac, mut bb, mut bc, mut cc) = (1e6, 0.0, 0.0, 0.0, 0.0, c2);
        let (mut even, mut phi) = (f64::NAN, 0.0);
        for i in 0..rows.t.len() {
            let dt = if i == 0 { 0.0 } else { rows.t[i] - rows.t[i - 1] };
            if c2 > 0.0 && (dt - even).abs().partial_cmp(&1e-9) != Some(std::cmp::Ordering::Less) {
                phi = (-dt / noise.correlation_time).exp();
                even = dt;
            }
            let gap = rows.lost[i] && i > 0;
            if gap {
                aa += 1e6;
            } else {
                // a += dt (b + c), c *= phi
                aa += dt * (2.0 * (ab + ac) + dt * (bb + 2.0 * bc + cc))
                    + n2 * dt
                    + m2 * rows.turned[i]
                    + b2 * dt * dt * dt / 3.0;
                ab += dt * (bb + bc) + 0.5 * b2 * dt * dt;
                ac = phi * (ac + dt * (bc + cc));
                bb += b2 * dt;
                bc *= phi;
                cc = phi * phi * cc + c2 * (1.0 - phi * phi);
            }
            let own = r * rows.spread[i];
            let s = aa + own + 1e-24;
            let share = s.recip();
            let gain = [aa * share, ab * share, ac * share];
            bb -= gain[1] * ab;
            bc -= gain[1] * ac;
            cc -= gain[2] * ac;
            let left = own * share;
            aa *= left;
            ab *= left;
            ac *= left;
            let counts = i > 0 && !gap;
            let weight = if counts { share.sqrt() } else { 0.0 };
            take(Step { dt, phi, gain, weight }, counts.then_some(s));
        }
    }
}

/// Series that are filtered side by side: as many as a register holds.
const TOGETHER: usize = 4;

/// Σ ln x with one logarithm for many x.
pub(super) struct LogSum {
    product: f64,
    sum: f64,
}

impl Default for LogSum {
    fn default() -> Self {
        Self { product: 1.0, sum: 0.0 }
    }
}

impl LogSum {
    pub(super) fn add(&mut self, x: f64) {
        self.product *= x;
        if !(1e-200..1e200).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }

    pub(super) fn total(&self) -> f64 {
        self.sum + self.product.ln()
    }
}

impl Whitener {
    /// The filter's gains along `rows`.
    #[must_use]
    pub fn new(noise: &NoiseModel, rows: &Rows) -> Self {
        let (mut steps, mut logs) = (Vec::with_capacity(rows.t.len()), LogSum::default());
        Gains { noise, rows }.run(|step, s| {
            if let Some(s) = s {
                logs.add(s);
            }
            steps.push(step);
        });
        Self { steps, index: rows.index.clone(), rows: rows.rows, log_determinant: logs.total() }
    }

    /// How many of the rows say something of white noise of this N², the noise since the row before over all that a row is unsure by,
    /// summed.
    pub(super) fn fresh(&self, n2: f64) -> f64 {
        self.steps.iter().map(|step| (n2 * step.dt * step.weight.powi(2)).min(1.0)).sum()
    }

    /// The whitened series at the reference rows: innovations over their standard deviations; 0 where a row says nothing.
    #[must_use]
    pub fn apply(&self, y: &[f64]) -> Vec<f64> {
        self.apply_all(&[y]).swap_remove(0)
    }

    /// The same of every channel.
    #[must_use]
    pub fn apply_each(&self, channels: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.apply_all(&channels.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }

    /// The same of many series, some of them side by side: the filter of one would wait for itself at every row.
    #[must_use]
    pub fn apply_all(&self, series: &[&[f64]]) -> Vec<Vec<f64>> {
        let mut all = Vec::with_capacity(series.len());
        for some in series.chunks(TOGETHER) {
            match *some {
                [a] => all.extend(self.side_by_side([a])),
                [a, b] => all.extend(self.side_by_side([a, b])),
                [a, b, c] => all.extend(self.side_by_side([a, b, c])),
                [a, b, c, d] => all.extend(self.side_by_side([a, b, c, d])),
                _ => {}
            }
        }
        all
    }

    fn side_by_side<const N: usize>(&self, series: [&[f64]; N]) -> [Vec<f64>; N] {
        let mut out = [(); N].map(|()| vec![0.0; self.rows]);
        let [mut a, mut b, mut c] = [[0.0; N]; 3];
        for (step, &row) in self.steps.iter().zip(&self.index) {
            let Step { dt, phi, gain, weight } = *step;
            let mut e = [0.0; N];
            for k in 0..N {
                a[k] += dt * (b[k] + c[k]);
                e[k] = series[k][row] - a[k];
                a[k] += gain[0] * e[k];
                b[k] += gain[1] * e[k];
                c[k] = phi * c[k] + gain[2] * e[k];
            }
            for k in 0..N {
                out[k][row] = e[k] * weight;
            }
        }
        out
    }

    /// Σ ln S over some of the reference rows.
    #[must_use]
    pub fn log_determinant_of(&self, rows: std::ops::Range<usize>) -> f64 {
        let mut logs = LogSum::default();
        let part = self.steps.iter().zip(&self.index).filter(|(s, row)| s.weight > 0.0 && rows.contains(row));
        part.for_each(|(s, _)| logs.add(s.weight));
        -2.0 * logs.total()
    }
}
