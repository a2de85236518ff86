//! Increments over averaging times: the error curve, fitted and held out from one accumulation.
//!
//! For each averaging time τ the increments z = Δ_τ[r, c₁ … c_n] of the residual and its derivatives are accumulated
//! into Gram matrices, block by block in time. Minimising Σ_τ E(τ)²/F(τ)² over the parameters is then a small set of
//! normal equations; leaving one block out of the sum and evaluating the form on it is the held-out error.

use super::{problem::Problem, rough::median_apart};
use crate::nls::{self, dot};
use std::ops::Range;

/// Blocks that a log is cut into: short enough that what shows for a while (a warm-up, a step) is seen from both sides.
pub(crate) const BLOCKS: usize = 30;
/// Averaging times that are always among them, s: those of the headline.
const HEADLINE: [f64; 3] = [0.1, 1.0, 10.0];
const PAIRS: usize = 8_000;

/// The increments that are looked at: their averaging times and which rows they join.
#[derive(Clone, Debug)]
pub struct Windows {
    /// Averaging times, s, ascending.
    pub tau: Vec<f64>,
    /// The increments over each.
    pairs: Vec<Pairs>,
}

/// The increments over one averaging time, in order of time.
#[derive(Clone, Debug)]
struct Pairs {
    /// First and last row of each.
    rows: Vec<(u32, u32)>,
    /// Which of them start in each block.
    starts: [Range<usize>; BLOCKS],
    /// Which of them reach into it from before.
    reaches: [Range<usize>; BLOCKS],
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
        let step = median_apart(t);
        let (low, high) = (2.0 * step, (0.1 * span).max(2.0 * step));
        let count = ((high / low).log10() * 6.0).ceil() as usize + 1;
        let mut samples: Vec<usize> = (0..count.max(2))
            .map(|i| ((low * (high / low).powf(i as f64 / (count.max(2) - 1) as f64)) / step).round() as usize)
            .collect();
        samples.extend(HEADLINE.iter().filter(|&&h| h >= low && h <= high).map(|h| (h / step).round() as usize));
        samples.sort_unstable();
        samples.dedup();
        let block = |row: u32| (((t[row as usize] - first) / span * BLOCKS as f64) as usize).min(BLOCKS - 1);
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
                    list.push((i as u32, j as u32));
                }
                i += stride;
            }
            if list.len() >= BLOCKS {
                // Times hold nanoseconds, whatever their difference is rounded to.
                tau.push((length * 1e9).round() / 1e9);
                pairs.push(Pairs::new(list, block));
            }
        }
        Self { tau, pairs }
    }

    /// Every increment as (first row, last row, weight): weight² is what its square counts in Σ_τ E²/F².
    #[must_use]
    pub fn weighted(&self, floor: &[f64]) -> Vec<(u32, u32, f64)> {
        let of = |k: usize| {
            let list = &self.pairs[k].rows;
            let weight = 1.0 / ((list.len() as f64).sqrt() * self.tau[k] * floor[k]);
            list.iter().map(move |&(i, j)| (i, j, weight))
        };
        (0..self.tau.len()).flat_map(of).collect()
    }

    /// The increments of one series, its channels one after another, so weighted that the sum of their squares is Σ_τ E²/F².
    #[must_use]
    pub fn weigh(&self, series: &[Vec<f64>], floor: &[f64]) -> Vec<f64> {
        let many = self.pairs.iter().map(|pairs| pairs.rows.len()).sum::<usize>() * series.len();
        let mut all = Vec::with_capacity(many);
        for ((pairs, tau), floor) in self.pairs.iter().zip(&self.tau).zip(floor) {
            let weight = 1.0 / (((pairs.rows.len() * series.len()) as f64).sqrt() * tau * floor);
            for channel in series {
                all.extend(pairs.rows.iter().map(|&(i, j)| weight * (channel[j as usize] - channel[i as usize])));
            }
        }
        all
    }

    /// E² of one series, averaging time by averaging time, (rad/s)².
    #[must_use]
    pub fn mean_squares(&self, series: &[f64]) -> Vec<f64> {
        let mean = |(pairs, tau): (&Pairs, &f64)| {
            let square = |&(i, j): &(u32, u32)| (series[j as usize] - series[i as usize]).powi(2);
            pairs.rows.iter().map(square).sum::<f64>() / (pairs.rows.len() as f64 * tau * tau)
        };
        self.pairs.iter().zip(&self.tau).map(mean).collect()
    }

    /// How much of each averaging time counts where some steps say nothing, 1 where all do: what the errors are divided by
    /// to be those of the mean rate over the time κ that an increment is known for.
    ///
    /// ```text
    /// √(mean κ²) / τ
    /// ```
    #[must_use]
    pub fn kept(&self, t: &[f64], lost: &[bool]) -> Vec<f64> {
        let mut known = vec![0.0; t.len()];
        for i in 1..t.len() {
            known[i] = known[i - 1] + if lost[i] { 0.0 } else { t[i] - t[i - 1] };
        }
        let share = |(pairs, tau): (&Pairs, &f64)| {
            let square = |&(i, j): &(u32, u32)| (known[j as usize] - known[i as usize]).powi(2);
            let kept = (pairs.rows.iter().map(square).sum::<f64>() / pairs.rows.len() as f64).sqrt() / tau;
            if kept > 0.0 { kept } else { 1.0 }
        };
        if lost.contains(&true) {
            self.pairs.iter().zip(&self.tau).map(share).collect()
        } else {
            vec![1.0; self.tau.len()]
        }
    }

    /// Accumulates z = [residual, columns…] for each of several residuals; a series has its channels one after another.
    /// `component`: of the increments of a rotation only that component, in the body's frame where they start.
    #[must_use]
    pub fn grams(
        &self,
        problem: &Problem,
        residuals: &[&[Vec<f64>]],
        columns: &[&[Vec<f64>]],
        component: Option<usize>,
    ) -> Vec<Grams> {
        let size = columns.len() + 1;
        let mut all = vec![Grams { size, starts: Vec::new(), reaches: Vec::new() }; residuals.len()];
        for pairs in &self.pairs {
            let directions = pairs.directions(problem, component);
            let directions = directions.as_deref();
            let own: Vec<Vec<f64>> = columns.iter().map(|c| pairs.steps(c, directions)).collect();
            let [starts, reaches] = [&pairs.starts, &pairs.reaches].map(|ranges| pairs.accumulate(ranges, &own));
            for (grams, residual) in all.iter_mut().zip(residuals) {
                let residual = pairs.steps(residual, directions);
                let (mut starts, mut reaches) = (starts.clone(), reaches.clone());
                pairs.join(&pairs.starts, &mut starts, &residual, &own);
                pairs.join(&pairs.reaches, &mut reaches, &residual, &own);
                grams.starts.push(starts);
                grams.reaches.push(reaches);
            }
        }
        all
    }
}

impl Pairs {
    fn new(rows: Vec<(u32, u32)>, block: impl Fn(u32) -> usize) -> Self {
        let before = |row: &dyn Fn(&(u32, u32)) -> u32, b: usize| rows.partition_point(|pair| block(row(pair)) < b);
        let starts = std::array::from_fn(|b| before(&|p| p.0, b)..before(&|p| p.0, b + 1));
        let reaches = std::array::from_fn(|b| {
            let from = before(&|p| p.1, b);
            from..before(&|p| p.0, b).max(from)
        });
        Self { rows, starts, reaches }
    }

    /// The direction, in the frame that a residual is seen from, of the body axis `component` where each increment starts;
    /// `None` where its channels are looked at as they are.
    fn directions(&self, problem: &Problem, component: Option<usize>) -> Option<Vec<[f64; 3]>> {
        let (axis, attitude) = (component?, problem.attitude()?);
        Some(self.rows.iter().map(|&(i, _)| attitude.direction(axis, i as usize)).collect())
    }

    /// The increments of one series, its channels one after another, or along these directions.
    fn steps(&self, series: &[Vec<f64>], directions: Option<&[[f64; 3]]>) -> Vec<f64> {
        let step = |channel: &[f64], &(i, j): &(u32, u32)| channel[j as usize] - channel[i as usize];
        let Some(directions) = directions else {
            let mut all = Vec::with_capacity(series.len() * self.rows.len());
            for channel in series {
                all.extend(self.rows.iter().map(|pair| step(channel, pair)));
            }
            return all;
        };
        let along = |(pair, direction): (&(u32, u32), &[f64; 3])| {
            series.iter().zip(direction).map(|(channel, share)| share * step(channel, pair)).sum()
        };
        self.rows.iter().zip(directions).map(along).collect()
    }

    /// Runs `sum` over the parts of steps that belong to a range of pairs, channel by channel.
    fn parts(&self, range: &Range<usize>, steps: usize, mut sum: impl FnMut(Range<usize>)) {
        for channel in 0..steps / self.rows.len() {
            let offset = channel * self.rows.len();
            sum(offset + range.start..offset + range.end);
        }
    }

    /// The Gram matrices of the columns, the residual's row left empty.
    fn accumulate(&self, ranges: &[Range<usize>; BLOCKS], columns: &[Vec<f64>]) -> [Packed; BLOCKS] {
        ranges.each_ref().map(|range| {
            let size = columns.len() + 1;
            let mut packed = Packed { sum: vec![0.0; size * (size + 1) / 2], count: 0.0 };
            self.parts(range, columns.first().map_or(0, Vec::len), |part| {
                for (i, x) in columns.iter().enumerate() {
                    for (j, y) in columns[..=i].iter().enumerate() {
                        packed.sum[(i + 1) * (i + 2) / 2 + j + 1] += dot(&x[part.clone()], &y[part.clone()]);
                    }
                }
            });
            packed
        })
    }

    /// Puts a residual's row in.
    fn join(
        &self,
        ranges: &[Range<usize>; BLOCKS],
        grams: &mut [Packed; BLOCKS],
        residual: &[f64],
        columns: &[Vec<f64>],
    ) {
        for (range, packed) in ranges.iter().zip(grams) {
            self.parts(range, residual.len(), |part| {
                let r = &residual[part.clone()];
                packed.sum[0] += dot(r, r);
                for (i, column) in columns.iter().enumerate() {
                    packed.sum[(i + 1) * (i + 2) / 2] += dot(r, &column[part.clone()]);
                }
                packed.count += part.len() as f64;
            });
        }
    }
}

impl Packed {
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

    /// Mean over τ of (E/F)² in each block; `None` for a block without increments, or with all of it left out.
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
                (sum > 0.0).then(|| sum / count)
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
    /// The sums over all blocks, one an averaging time.
    fn totals(&self) -> Vec<Packed> {
        let total = |blocks: &[Packed; BLOCKS]| {
            let mut sum = blocks[0].clone();
            blocks[1..].iter().for_each(|block| sum.merge(block, 1.0));
            sum
        };
        self.starts.iter().map(total).collect()
    }

    /// The normal equations of Σ_τ E²/F².
    #[must_use]
    pub fn normal(&self, tau: &[f64], floor: &[f64]) -> nls::Normal {
        self.normal_of(&self.totals(), tau, floor)
    }

    fn normal_of(&self, sums: &[Packed], tau: &[f64], floor: &[f64]) -> nls::Normal {
        let n = self.size - 1;
        let mut normal = nls::Normal::zeros(n);
        for (g, (tau, floor)) in sums.iter().zip(tau.iter().zip(floor)).filter(|(g, _)| g.count >= 1.0) {
            let w = 1.0 / (g.count * (tau * floor).powi(2));
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
        judged.judged(tau, &self.refits(tau, floor, hold))
    }

    /// By how much each parameter scatters from block to block, whatever the residual is (the jackknife: Tukey 1958).
    ///
    /// ```text
    /// Var p ≈ (B − 1)/B Σ_b (p_b − p̄)²,   p_b fitted without block b of B
    /// ```
    #[must_use]
    pub fn scatter(&self, tau: &[f64], floor: &[f64], hold: &[f64]) -> Vec<f64> {
        let steps = self.refits(tau, floor, hold);
        let n = steps.len() as f64;
        (0..self.size - 1)
            .map(|k| {
                let mean = steps.iter().map(|step| step[k]).sum::<f64>() / n;
                ((n - 1.0) / n * steps.iter().map(|step| (step[k] - mean).powi(2)).sum::<f64>()).sqrt()
            })
            .collect()
    }

    /// From the present parameters to those fitted without each block.
    fn refits(&self, tau: &[f64], floor: &[f64], hold: &[f64]) -> Vec<Vec<f64>> {
        let held = |sums: &[Packed]| {
            let mut normal = self.normal_of(sums, tau, floor);
            for (k, precision) in hold.iter().enumerate() {
                normal.matrix[(k, k)] += precision;
            }
            normal
        };
        let totals = self.totals();
        let whole = held(&totals);
        let without = |b: usize| -> Vec<Packed> {
            let mut rest = totals.clone();
            for ((sum, starts), reaches) in rest.iter_mut().zip(&self.starts).zip(&self.reaches) {
                sum.merge(&starts[b], -1.0);
                sum.merge(&reaches[b], -1.0);
            }
            rest
        };
        (0..BLOCKS).map(|b| held(&without(b)).step_from(&whole, 1e-3)).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_time_that_is_known() {
        let t: Vec<f64> = (0..6000).map(|k| f64::from(k) * 0.01).collect();
        let windows = Windows::new(&t);
        let lost: Vec<bool> = (0..t.len()).map(|k| k % 500 >= 150).collect();
        let mut angle = vec![0.0; t.len()];
        for k in 1..t.len() {
            angle[k] = angle[k - 1] + if lost[k] { 0.0 } else { 0.3 * (t[k] - t[k - 1]) };
        }
        for (k, kept) in windows.kept(&t, &lost).iter().enumerate() {
            let pairs = &windows.pairs[k].rows;
            let square = pairs.iter().map(|&(i, j)| (angle[j as usize] - angle[i as usize]).powi(2)).sum::<f64>();
            let error = (square / pairs.len() as f64).sqrt() / windows.tau[k];
            assert!((error / kept - 0.3).abs() < 1e-9, "τ {}: {error} of {kept}", windows.tau[k]);
            assert!(*kept < 0.6, "{kept}");
        }
        assert!(windows.kept(&t, &vec![false; t.len()]).iter().all(|kept| *kept == 1.0));
    }
}
