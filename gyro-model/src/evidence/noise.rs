//! The noise of a model's residual, and generalised least squares under it.
//!
//! What comes out besides the parameters' step and covariance is the log likelihood block by block, each block judged with
//! the parameters of the others: by that models are compared.

use super::{
    dilution,
    draws::Draws,
    growth,
    prior::Prior,
    rough::median_apart,
    series::Reading,
    study::Study,
    whiten::{NoiseModel, Rows, Whitener},
};
use crate::{model::Noise, nls, record::ReferenceKind};
use faer::Mat;

/// Blocks in time over which the likelihood is held out.
pub(crate) const BLOCKS: usize = 20;

/// Generalised least squares about the parameters of a study.
#[derive(Clone, Debug)]
pub struct Gls {
    /// The identified noise.
    pub noise: NoiseModel,
    /// ln L at the optimum.
    pub log_likelihood: f64,
    /// ln L of each block under the parameters of the others.
    pub held_out: Vec<f64>,
    /// From the study's parameters to the optimum.
    pub step: Vec<f64>,
    /// Covariance of the parameters; infinite where unobservable.
    pub covariance: Mat<f64>,
}

impl Gls {
    /// Standard error of parameter `k`.
    #[must_use]
    pub fn std_error(&self, k: usize) -> f64 {
        self.covariance[(k, k)].sqrt()
    }
}

/// Size of a correlated rate error that still counts as bias instability, rad/s (0.14 °/s).
const WANDER: f64 = 2.5e-3;
/// Share of a log that a correlated rate may last.
pub(super) const LASTS: f64 = 0.1;
/// Bias random walk that still counts as wander, rad/s/√s.
pub(super) const WALK: f64 = 3e-4;

/// Angle random walk per rate that still counts as noise, √s: 1 % of the rate in each of a hundred readings a second.
const RATE_WALK: f64 = 1e-3;

impl NoiseModel {
    /// The largest slow part that the bias instability of even a poor gyro has, beside that much of the rest.
    #[must_use]
    pub fn of_a_sensor(angle_random_walk: f64, encoder: f64) -> Self {
        let (bias_random_walk, correlated) = (WALK, WANDER);
        let (correlation_time, rate_random_walk) = (f64::INFINITY, RATE_WALK);
        Self { angle_random_walk, bias_random_walk, encoder, correlated, correlation_time, rate_random_walk }
    }

    /// Whether its slow part is more than the bias instability of even a poor gyro.
    #[must_use]
    pub fn beyond_wander(&self) -> bool {
        self.correlated > WANDER || self.bias_random_walk > WALK
    }

    /// Whether its correlated rate lasts too long for a log of this length to show that it comes and goes: it would be
    /// any drift.
    pub(crate) fn forgets_later_than(&self, span: f64) -> bool {
        self.correlated > 0.0 && self.correlation_time > LASTS * span
    }

    /// N of its correlated rate to a filter that looks for longer than it lasts, rad/√s: N² = 2 s² T.
    pub(crate) fn walk_of_correlated(&self) -> f64 {
        self.correlated * (2.0 * self.correlation_time).sqrt()
    }

    /// As the model file has it, for a log of this mean square rate. A rate error s that is correlated over a time T is white
    /// to a filter that looks for longer, of N² = 2 s² T, as far as the sensors' own signals say that there is so much: beneath
    /// an encoder's noise the one looks like the other.
    #[must_use]
    pub fn summary(&self, rate_square: f64, prior: &Prior) -> Noise {
        let short = self.walk_of_correlated();
        let known = if prior.assumed { 0.0 } else { prior.angle_random_walk };
        let white = self.angle_random_walk.hypot(short).min(self.angle_random_walk.max(known));
        Noise {
            angle_random_walk: white.hypot(self.rate_random_walk * rate_square.sqrt()),
            bias_random_walk: self.bias_random_walk,
            encoder: self.encoder,
            unexplained: 0.0,
        }
    }

    /// The same with just those parts that `other` has.
    pub(crate) fn with_the_parts_of(&self, other: &Self) -> Self {
        let part = |own: f64, other: f64| if other > 0.0 { own.max(f64::MIN_POSITIVE) } else { 0.0 };
        Self {
            correlated: part(self.correlated, other.correlated),
            rate_random_walk: part(self.rate_random_walk, other.rate_random_walk),
            ..*self
        }
    }

    pub(crate) fn from_logs(p: &[f64]) -> Self {
        let e = |k: usize| p.get(k).map_or(0.0, |v| v.clamp(-60.0, 20.0).exp());
        Self {
            angle_random_walk: e(0),
            bias_random_walk: e(1),
            encoder: e(2),
            correlated: if p.len() > 4 { e(3) } else { 0.0 },
            correlation_time: if p.len() > 4 { e(4) } else { 1.0 },
            rate_random_walk: if p.len().is_multiple_of(2) { e(p.len() - 1) } else { 0.0 },
        }
    }

    /// The logarithms of the parts that are there: N, B, √R, then s and T, then N_ω.
    pub(crate) fn logs(&self) -> Vec<f64> {
        let mut out = vec![self.angle_random_walk, self.bias_random_walk, self.encoder];
        if self.correlated > 0.0 {
            out.extend([self.correlated, self.correlation_time]);
        }
        if self.rate_random_walk > 0.0 {
            out.push(self.rate_random_walk);
        }
        out.into_iter().map(|v| v.max(1e-20).ln()).collect()
    }
}

/// The nearest noise that sensors have, where this is none: what a missing effect leaves is no noise, and a filter that
/// took it for such would not believe its own gyro.
pub(crate) fn sober(study: &Study, noise: &NoiseModel) -> Option<NoiseModel> {
    let most = of_sensors(&study.bench.prior[0]);
    let is_usual = of_trapezoids(study, noise).is_some_and(|walk| walk <= most.angle_random_walk);
    let sober = NoiseModel {
        angle_random_walk: noise.angle_random_walk.min(most.angle_random_walk),
        bias_random_walk: noise.bias_random_walk.min(most.bias_random_walk),
        encoder: noise.encoder.min(most.encoder),
        correlated: if is_usual { noise.correlated } else { noise.correlated.min(most.correlated) },
        rate_random_walk: noise.rate_random_walk.min(most.rate_random_walk),
        ..*noise
    };
    (sober != *noise).then_some(sober)
}

/// The largest noise that is noise and no physics, where this much is known beforehand.
pub(crate) fn of_sensors(prior: &Prior) -> NoiseModel {
    NoiseModel::of_a_sensor((ABOVE_PRIOR * prior.angle_random_walk).max(POOR), ABOVE_PRIOR * prior.encoder)
}

/// N of the white noise that this noise is beside a reference that is a rate, rad/√s, where it goes together over a row or two: both
/// are integrated by trapezoids, each step of which is the mean of two readings.
///
/// ```text
/// v = N₀² h + 2 σ² T² (h/T − 1 + e^(−h/T)),   N² = 2 v/h
/// ```
///
/// with v the variance of a step of h. A correlated rate that fits the steps adds up to more than that over many of them.
fn of_trapezoids(study: &Study, noise: &NoiseModel) -> Option<f64> {
    let (h, time) = (median_apart(study.bench.problem.times()), noise.correlation_time);
    let is_rate = study.bench.problem.series[0].kind == ReferenceKind::Rate && study.every == 1;
    let is_short = is_rate && noise.correlated > 0.0 && time < FEW_ROWS * h;
    let correlated = 2.0 * (noise.correlated * time).powi(2) * (h / time + (-h / time).exp_m1());
    is_short.then(|| (2.0 * (noise.angle_random_walk.powi(2) + correlated / h)).sqrt())
}

/// What standard errors are, over what a noise says that goes together over a row or two.
pub(super) fn error_of_trapezoids(study: &Study, noise: &NoiseModel) -> f64 {
    let said = noise.angle_random_walk.hypot((2.0 * noise.correlation_time).sqrt() * noise.correlated);
    of_trapezoids(study, noise).map_or(1.0, |walk| (walk / said).min(1.0))
}

/// Correlation time, in rows, up to which noise is white.
const FEW_ROWS: f64 = 4.0;
/// How far the noise may lie above its prior and still be noise.
const ABOVE_PRIOR: f64 = 2.0;
/// N of a poor MEMS gyro, rad/√s (0.03 °/√s): noise of this size needs no physics.
const POOR: f64 = 5.2e-4;

/// The readings of a study, every one that its likelihood is made of or one in so many of those.
pub(super) fn rows(study: &Study, every: usize) -> Rows {
    rows_of(study, study.bench.problem.series[0].readings.iter().step_by(every * study.every))
}

/// These readings of a study.
fn rows_of<'r>(study: &Study, readings: impl Iterator<Item = &'r Reading>) -> Rows {
    let (t, lost) = (study.bench.problem.times(), &study.evaluation.lost);
    let mut rows = Rows { rows: t.len(), ..Rows::default() };
    let (turned, mut before) = (growth::turned(study), 0);
    for reading in readings {
        rows.index.push(reading.row);
        rows.t.push(t[reading.row]);
        rows.turned.push(turned[reading.row] - turned[before]);
        rows.spread.push(reading.spread);
        rows.lost.push(lost[(before + 1).min(reading.row)..=reading.row].contains(&true));
        before = reading.row;
    }
    rows
}

/// By how much each parameter scatters more on draws of noise alone than its covariance says: an encoder's quantisation
/// under a regular motion repeats itself, and is then not worth as many readings as there are. At least 1.
pub(crate) fn beyond_white(study: &Study, gls: &Gls) -> Vec<f64> {
    let (normal, whitener) = normal(study, &gls.noise);
    let (inverse, _) = nls::invert_observable(&normal.matrix, 1e-10);
    let columns: Vec<Vec<Vec<f64>>> = study.columns.iter().map(|c| whitener.apply_each(c)).collect();
    let n = columns.len();
    let scattered = |noise_alone: Draws| {
        let mut squares = vec![0.0; n];
        for seed in 0..SCATTER {
            let white = whitener.apply_each(&noise_alone.read(seed));
            let dot = |c: &Vec<Vec<f64>>| -> f64 { c.iter().zip(&white).map(|(a, b)| nls::dot(a, b)).sum() };
            let along: Vec<f64> = columns.iter().map(dot).collect();
            for (i, sum) in squares.iter_mut().enumerate() {
                *sum += (0..n).map(|j| inverse[(i, j)] * along[j]).sum::<f64>().powi(2);
            }
        }
        squares
    };
    // Where the encoder is seen to count from tells what its steps did here, but for counts that readings lie at the edge of.
    let anywhere = scattered(Draws::anywhere(study, 0));
    let here = Draws::where_seen(study, 0).map_or_else(|| anywhere.clone(), scattered);
    let squares: Vec<f64> = anywhere.into_iter().zip(here).map(|(a, b)| a.max(b)).collect();
    let uneven = unevenness(&columns, &whitener.apply_each(&study.as_read()), &inverse);
    let factor = |i: usize| (squares[i] / SCATTER as f64 / inverse[(i, i)]).max(uneven[i]).sqrt();
    (0..n).map(|i| if inverse[(i, i)] > 0.0 { factor(i).max(1.0) } else { 1.0 }).collect()
}

/// The variance of each parameter over what its covariance says, where the whitened residual is not everywhere of the same
/// size (White 1980): noise that grows with the rate is large just where the rate says most.
///
/// ```text
/// Var p_k ≈ Σᵢ (Σⱼ V_kj c_ji)² eᵢ²,   V the inverse of the normal equations, c_j the columns, e the residual
/// ```
pub(crate) fn unevenness(columns: &[Vec<Vec<f64>>], residual: &[Vec<f64>], inverse: &Mat<f64>) -> Vec<f64> {
    let n = columns.len();
    let mut sums = vec![0.0; n];
    for (channel, e) in residual.iter().enumerate() {
        let mut pull = vec![0.0; e.len()];
        for (k, sum) in sums.iter_mut().enumerate() {
            pull.fill(0.0);
            for (j, column) in columns.iter().enumerate() {
                let share = inverse[(k, j)];
                pull.iter_mut().zip(&column[channel]).for_each(|(pull, c)| *pull += share * c);
            }
            *sum += pull.iter().zip(e).map(|(pull, e)| (pull * e).powi(2)).sum::<f64>();
        }
    }
    let ratio = |(k, sum): (usize, f64)| if inverse[(k, k)] > 0.0 { sum / inverse[(k, k)] } else { 1.0 };
    sums.into_iter().enumerate().map(ratio).collect()
}

/// Draws of noise alone for that.
const SCATTER: u64 = 12;

/// Whitened residual and columns under one noise, as normal equations.
pub(crate) fn normal(study: &Study, noise: &NoiseModel) -> (nls::Normal, Whitener) {
    let whitener = Whitener::new(noise, &rows(study, 1));
    let mut normal = nls::Normal::zeros(study.columns.len());
    for channel in white(study, &whitener) {
        normal.add(&channel[0], &channel[1..].iter().map(Vec::as_slice).collect::<Vec<_>>());
    }
    (normal, whitener)
}

/// The gains of one noise along a study's rows.
pub(crate) fn whitener(study: &Study, noise: &NoiseModel) -> Whitener {
    Whitener::new(noise, &rows(study, 1))
}

/// The same where the encoder's counts single out other readings.
pub(crate) fn whitener_of(study: &Study, noise: &NoiseModel, readings: &[Reading]) -> Whitener {
    Whitener::new(noise, &rows_of(study, readings.iter()))
}

/// Each channel's residual and, behind it, its columns, whitened.
fn white(study: &Study, whitener: &Whitener) -> Vec<Vec<Vec<f64>>> {
    let residual = study.as_read();
    let channel = |(k, own): (usize, &Vec<f64>)| {
        let columns = study.columns.iter().map(|c| c[k].as_slice());
        whitener.apply_all(&std::iter::once(own.as_slice()).chain(columns).collect::<Vec<_>>())
    };
    residual.iter().enumerate().map(channel).collect()
}

/// Least squares on whitened normal equations: step, covariance, remaining sum of squares.
pub(super) fn solve(normal: &nls::Normal) -> (Vec<f64>, Mat<f64>, f64) {
    let n = normal.gradient.len();
    let (inverse, unobservable) = nls::invert_observable(&normal.matrix, 1e-10);
    let step: Vec<f64> = (0..n).map(|i| -(0..n).map(|j| inverse[(i, j)] * normal.gradient[j]).sum::<f64>()).collect();
    let rss = normal.cost + step.iter().zip(&normal.gradient).map(|(s, g)| s * g).sum::<f64>();
    let mut covariance = inverse;
    for i in unobservable {
        covariance[(i, i)] = f64::INFINITY;
    }
    (step, covariance, rss.max(0.0))
}

/// The residual after a step of the parameters, to first order.
pub(super) fn moved(study: &Study, step: &[f64]) -> Vec<Vec<f64>> {
    let mut residual = study.as_read();
    for (column, s) in study.columns.iter().zip(step) {
        for (r, c) in residual.iter_mut().zip(column) {
            for (r, c) in r.iter_mut().zip(c) {
                *r += s * c;
            }
        }
    }
    residual
}

/// Share of what the whole log tells of a direction that has to stand outside a block, for the rest to be asked about it:
/// what happened once, in this block, nothing else can know.
const ELSEWHERE: f64 = 0.1;

/// Generalised least squares under a given noise.
pub(crate) fn at_noise(study: &Study, noise: &NoiseModel) -> Gls {
    let whitener = Whitener::new(noise, &rows(study, 1));
    let t = study.bench.problem.times();
    let edge = |b: usize| t.partition_point(|&x| x < t[0] + (t[t.len() - 1] - t[0]) * b as f64 / BLOCKS as f64);
    let n = study.columns.len();
    let mut blocks = vec![nls::Normal::zeros(n); BLOCKS];
    let channels = study.bench.problem.channels();
    for channel in white(study, &whitener) {
        for (b, block) in blocks.iter_mut().enumerate() {
            let range = edge(b)..if b + 1 == BLOCKS { t.len() } else { edge(b + 1) };
            block.add(&channel[0][range.clone()], &channel[1..].iter().map(|c| &c[range.clone()]).collect::<Vec<_>>());
        }
    }
    let mut total = nls::Normal::zeros(n);
    for block in &blocks {
        total.merge(block, 1.0);
    }
    let (mut step, covariance, rss) = solve(&total);
    if let Some(mean) = dilution::mean_gradient(study, noise, &whitener, &covariance) {
        let mut corrected = total.clone();
        corrected.gradient.iter_mut().zip(mean).for_each(|(gradient, mean)| *gradient -= mean);
        step = solve(&corrected).0;
    }
    let held_out = (0..BLOCKS)
        .map(|b| {
            let mut rest = total.clone();
            rest.merge(&blocks[b], -1.0);
            let p = rest.step_from(&total, ELSEWHERE);
            let cost = blocks[b].cost_after(&p);
            let range = edge(b)..if b + 1 == BLOCKS { t.len() } else { edge(b + 1) };
            -0.5 * (cost + channels as f64 * whitener.log_determinant_of(range))
        })
        .collect();
    Gls {
        noise: *noise,
        log_likelihood: -0.5 * (channels as f64 * whitener.log_determinant + rss),
        held_out,
        step,
        covariance,
    }
}
