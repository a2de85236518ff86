//! Increments over averaging times: the error curve, fitted and held out from one accumulation.
//!
//! For each averaging time τ the increments z = Δ_τ[r, c₁ … c_n] of the residual and its derivatives are accumulated
//! into Gram matrices, block by block in time. Minimising Σ_τ E(τ)²/F(τ)² over the parameters is then a small set of
//! normal equations; leaving one block out of the sum and evaluating the form on it is the held-out error.

use super::problem::Problem;
use crate::nls;

/// Blocks that a log is cut into: short enough that what shows for a while (a warm-up, a step) is seen from both sides.
pub const BLOCKS: usize = 30;
/// Averaging times that are always among them, s: those of the headline.
const HEADLINE: [f64; 3] = [0.1, 1.0, 10.0];
const PAIRS: usize = 8_000;

/// The increments that are looked at: their averaging times and which rows they join.
#[derive(Clone, Debug)]
pub struct Windows {
    /// Averaging times, s, ascending.
    pub tau: Vec<f64>,
    /// For each, (first row, last row, block of the first row, block of the last).
    pairs: Vec<Vec<(u32, u32, u8, u8)>>,
}

/// Gram matrices of z for each τ and block: of the increments that start in it, and of those from before that reach
/// into it.
#[derive(Clone, Debug)]
pub struct Grams {
    /// Size of z.
    pub size: usize,
    starts: Vec<[Packed; BLOCKS]>,
    reaches: Vec<[Packed; BLOCKS]>,
}

/// Lower triangle of a symmetric sum, and how many were added.
#[derive(Clone, Debug, Default)]
struct Packed {
    sum: Vec<f64>,
    count: f64,
}

impl Windows {
    /// Log-spaced averaging times from two samples to a tenth of the log.
    #[must_use]
    pub fn new(t: &[f64]) -> Self {
        Self::with(t, PAIRS)
    }

    /// The same with at most about `most` increments an averaging time.
    #[must_use]
    pub fn with(t: &[f64], most: usize) -> Self {
        let n = t.len();
        let (first, span) = (t[0], t[n - 1] - t[0]);
        let step = {
            let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
            steps.sort_by(f64::total_cmp);
            steps[steps.len() / 2]
        };
        let (low, high) = (2.0 * step, (0.1 * span).max(2.0 * step));
        let count = ((high / low).log10() * 6.0).ceil() as usize + 1;
        let mut samples: Vec<usize> = (0..count.max(2))
            .map(|i| ((low * (high / low).powf(i as f64 / (count.max(2) - 1) as f64)) / step).round() as usize)
            .collect();
        samples.extend(HEADLINE.iter().filter(|&&h| h >= low && h <= high).map(|h| (h / step).round() as usize));
        samples.sort_unstable();
        samples.dedup();
        let block = |x: f64| (((x - first) / span * BLOCKS as f64) as usize).min(BLOCKS - 1) as u8;
        let mut tau = Vec::new();
        let mut pairs = Vec::new();
        for m in samples {
            let length = m as f64 * step;
            let stride = (m / 4).max(1).max(n / most);
            let mut list = Vec::with_capacity(n / stride + 1);
            let mut j = 0;
            let mut i = 0;
            while i < n {
                j = j.max(i);
                while j < n && t[j] < t[i] + length - 0.5 * step {
                    j += 1;
                }
                if j == n {
                    break;
                }
                // Across a gap in the reference the increment is of another length: left out.
                if t[j] - t[i] < length + 0.5 * step + 1e-3 * length {
                    list.push((i as u32, j as u32, block(t[i]), block(t[j])));
                }
                i += stride;
            }
            if list.len() >= BLOCKS {
                tau.push(length);
                pairs.push(list);
            }
        }
        Self { tau, pairs }
    }

    /// Every increment as (first row, last row, weight): weight² is what its square counts in Σ_τ E²/F².
    #[must_use]
    pub fn weighted(&self, floor: &[f64]) -> Vec<(u32, u32, f64)> {
        let of = |k: usize| {
            let list: &[_] = &self.pairs[k];
            let weight = 1.0 / ((list.len() as f64).sqrt() * self.tau[k] * floor[k]);
            list.iter().map(move |&(i, j, _, _)| (i, j, weight))
        };
        (0..self.tau.len()).flat_map(of).collect()
    }

    /// Accumulates z = [residual, columns…]; each is one series a channel. With `frame` (channel axis, rotations to the
    /// body frame at the window's start) only that body component is taken.
    #[must_use]
    pub fn grams(&self, problem: &Problem, series: &[&[Vec<f64>]], component: Option<usize>) -> Grams {
        let (size, channels, rows) = (series.len(), problem.channels(), problem.times().len());
        let mut rowwise = vec![0.0; rows * channels * size];
        for (column, s) in series.iter().enumerate() {
            for (channel, values) in s.iter().enumerate() {
                for (row, value) in values.iter().enumerate() {
                    rowwise[(row * channels + channel) * size + column] = *value;
                }
            }
        }
        let empty = || std::array::from_fn(|_| Packed { sum: vec![0.0; size * (size + 1) / 2], count: 0.0 });
        let mut grams = Grams { size, starts: Vec::new(), reaches: Vec::new() };
        let stride = channels * size;
        let mut z = vec![0.0; stride];
        let mut turned = vec![0.0; size];
        for (list, _) in self.pairs.iter().zip(&self.tau) {
            let (mut starts, mut reaches): ([Packed; BLOCKS], [Packed; BLOCKS]) = (empty(), empty());
            for &(i, j, a, b) in list {
                let (from, to) = (&rowwise[i as usize * stride..][..stride], &rowwise[j as usize * stride..][..stride]);
                for ((z, x), y) in z.iter_mut().zip(to).zip(from) {
                    *z = x - y;
                }
                match (component, problem.attitude()) {
                    (Some(axis), Some(attitude)) => {
                        let rotation = attitude.world_from_body[i as usize].to_rotation_matrix();
                        let m = rotation.matrix();
                        for (c, out) in turned.iter_mut().enumerate() {
                            *out = (0..3).map(|k| m[(k, axis)] * z[k * size + c]).sum();
                        }
                        starts[a as usize].add(&turned);
                        if b != a {
                            reaches[b as usize].add(&turned);
                        }
                    }
                    _ => {
                        for part in z.chunks_exact(size) {
                            starts[a as usize].add(part);
                            if b != a {
                                reaches[b as usize].add(part);
                            }
                        }
                    }
                }
            }
            grams.starts.push(starts);
            grams.reaches.push(reaches);
        }
        grams
    }
}

impl Packed {
    fn add(&mut self, z: &[f64]) {
        let mut k = 0;
        for (i, &x) in z.iter().enumerate() {
            for &y in &z[..=i] {
                self.sum[k] += x * y;
                k += 1;
            }
        }
        self.count += 1.0;
    }

    fn merge(&mut self, other: &Self, sign: f64) {
        for (a, b) in self.sum.iter_mut().zip(&other.sum) {
            *a += sign * b;
        }
        self.count += sign * other.count;
    }

    fn get(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.sum[i * (i + 1) / 2 + j]
    }
}

/// Held-out squared errors: for each τ and block, the sum of squared increments / τ² and how many there were.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// `[τ][block]`: (sum of squares, rad²/s²; increments).
    pub sums: Vec<[(f64, f64); BLOCKS]>,
}

impl HeldOut {
    /// E(τ) for every averaging time, rad/s.
    #[must_use]
    pub fn curve(&self) -> Vec<f64> {
        self.sums
            .iter()
            .map(|blocks| {
                let (s, n) = blocks.iter().fold((0.0, 0.0), |(s, n), b| (s + b.0, n + b.1));
                (s / n).sqrt()
            })
            .collect()
    }

    /// Mean over τ of (E/F)² in each block; `None` for a block without increments.
    #[must_use]
    pub fn by_block(&self, floor: &[f64]) -> Vec<Option<f64>> {
        (0..BLOCKS)
            .map(|b| {
                let (mut sum, mut count) = (0.0, 0.0);
                for (blocks, f) in self.sums.iter().zip(floor) {
                    if blocks[b].1 > 0.0 {
                        sum += blocks[b].0 / blocks[b].1 / (f * f);
                        count += 1.0;
                    }
                }
                (count > 0.0).then(|| sum / count)
            })
            .collect()
    }

    /// J = mean over τ of (E/F)².
    #[must_use]
    pub fn excess(&self, floor: &[f64]) -> f64 {
        let curve = self.curve();
        curve.iter().zip(floor).map(|(e, f)| (e / f).powi(2)).sum::<f64>() / curve.len() as f64
    }
}

impl Grams {
    fn total(&self, k: usize) -> Packed {
        let mut sum = Packed { sum: vec![0.0; self.starts[k][0].sum.len()], count: 0.0 };
        for block in &self.starts[k] {
            sum.merge(block, 1.0);
        }
        sum
    }

    /// The normal equations of Σ_τ E²/F² over all blocks, or all that do not touch `without`.
    #[must_use]
    pub fn normal(&self, tau: &[f64], floor: &[f64], without: Option<usize>) -> nls::Normal {
        let n = self.size - 1;
        let mut normal = nls::Normal::zeros(n);
        for k in 0..tau.len() {
            let mut g = self.total(k);
            if let Some(b) = without {
                g.merge(&self.starts[k][b], -1.0);
                g.merge(&self.reaches[k][b], -1.0);
            }
            if g.count < 1.0 {
                continue;
            }
            let w = 1.0 / (g.count * (tau[k] * floor[k]).powi(2));
            normal.cost += w * g.get(0, 0);
            for i in 0..n {
                normal.gradient[i] += w * g.get(i + 1, 0);
                for j in 0..n {
                    normal.matrix[(i, j)] += w * g.get(i + 1, j + 1);
                }
            }
        }
        normal
    }

    /// Each block judged with the parameters of the others (one Gauss–Newton step from where the derivatives stand, each
    /// parameter held there with the precision `hold`).
    #[must_use]
    pub fn held_out(&self, tau: &[f64], floor: &[f64], hold: &[f64]) -> HeldOut {
        self.held_out_on(self, tau, floor, hold)
    }

    /// The same with the parameters from these increments and the judgement on others (one axis of three).
    #[must_use]
    pub fn held_out_on(&self, judged: &Self, tau: &[f64], floor: &[f64], hold: &[f64]) -> HeldOut {
        let held = |without: Option<usize>| {
            let mut normal = self.normal(tau, floor, without);
            for (k, precision) in hold.iter().enumerate() {
                normal.matrix[(k, k)] += precision;
            }
            normal
        };
        let whole = held(None);
        let steps: Vec<Vec<f64>> = (0..BLOCKS).map(|b| held(Some(b)).step_from(&whole, 1e-3)).collect();
        judged.judged(tau, &steps)
    }

    /// Every block judged as it stands: no parameter refitted.
    #[must_use]
    pub fn as_is(&self, tau: &[f64]) -> HeldOut {
        self.judged(tau, &vec![vec![0.0; self.size - 1]; BLOCKS])
    }

    fn judged(&self, tau: &[f64], steps: &[Vec<f64>]) -> HeldOut {
        let sums = (0..tau.len())
            .map(|k| {
                std::array::from_fn(|b| {
                    let (g, p) = (&self.starts[k][b], &steps[b]);
                    let mut s = g.get(0, 0);
                    for i in 0..p.len() {
                        s += 2.0 * p[i] * g.get(i + 1, 0);
                        for j in 0..p.len() {
                            s += p[i] * p[j] * g.get(i + 1, j + 1);
                        }
                    }
                    (s.max(0.0) / tau[k].powi(2), g.count)
                })
            })
            .collect();
        HeldOut { sums }
    }
}
