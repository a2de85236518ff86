//! Identifies the noise of a residual by maximum likelihood, and estimates with it.

use super::{
    study::Study,
    whiten::{NoiseModel, Whitener, simplex},
};
use crate::{model::Noise, nls};
use faer::Mat;

/// Generalised least squares about the parameters of a study.
#[derive(Clone, Debug)]
pub struct Gls {
    /// The identified noise.
    pub noise: NoiseModel,
    /// ln L at the optimum.
    pub log_likelihood: f64,
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

impl NoiseModel {
    /// As the model file has it.
    #[must_use]
    pub fn summary(&self) -> Noise {
        Noise {
            angle_random_walk: self.angle_random_walk,
            bias_random_walk: self.bias_random_walk,
            encoder: self.encoder,
        }
    }

    fn from_logs(p: &[f64]) -> Self {
        let e = |k: usize| p.get(k).map_or(0.0, |v| v.clamp(-60.0, 20.0).exp());
        Self {
            angle_random_walk: e(0),
            bias_random_walk: e(1),
            encoder: e(2),
            correlated: e(3),
            correlation_time: if p.len() > 4 { e(4) } else { 1.0 },
        }
    }
}

/// Rows that are looked at while the noise is being searched for; the estimate itself uses all.
const SEARCH_ROWS: usize = 20_000;

/// Whitened residual and columns under one noise, as normal equations.
pub(crate) fn normal(study: &Study, noise: &NoiseModel, every: usize) -> (nls::Normal, Whitener) {
    let problem = &study.bench.problem;
    let (t, lost) = (problem.times(), &study.evaluation.lost);
    let plateau = &problem.series[0].plateau;
    let thin = |x: &[f64]| -> Vec<f64> { x.iter().step_by(every).copied().collect() };
    let whitener = if every == 1 {
        Whitener::new(noise, t, plateau, lost)
    } else {
        let lost: Vec<bool> =
            (0..lost.len()).step_by(every).map(|i| (i.saturating_sub(every - 1)..=i).any(|k| lost[k])).collect();
        let plateau: Vec<f64> = thin(plateau).iter().map(|p| (p / every as f64).max(1.0)).collect();
        Whitener::new(noise, &thin(t), &plateau, &lost)
    };
    let mut normal = nls::Normal::zeros(study.columns.len());
    for channel in 0..problem.channels() {
        let white = |x: &[f64]| if every == 1 { whitener.apply(x) } else { whitener.apply(&thin(x)) };
        let r = white(&study.evaluation.residual[channel]);
        let columns: Vec<Vec<f64>> = study.columns.iter().map(|c| white(&c[channel])).collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        normal.add(&r, &columns);
    }
    (normal, whitener)
}

/// Least squares on whitened normal equations: step, covariance, remaining sum of squares.
pub(crate) fn solve(normal: &nls::Normal) -> (Vec<f64>, Mat<f64>, f64) {
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

fn log_likelihood(study: &Study, noise: &NoiseModel, every: usize) -> f64 {
    let (normal, whitener) = normal(study, noise, every);
    let channels = study.bench.problem.channels() as f64;
    -0.5 * (channels * whitener.log_determinant + solve(&normal).2)
}

/// Maximum-likelihood noise with the parameters profiled out.
pub(crate) fn identify(study: &Study, start: Option<&NoiseModel>) -> Gls {
    let rows = study.bench.problem.times().len();
    let every = rows.div_ceil(SEARCH_ROWS);
    let prior = &study.bench.prior[0];
    let objective = |p: &[f64]| {
        let value = -log_likelihood(study, &NoiseModel::from_logs(p), every);
        if value.is_finite() { value } else { 1e300 }
    };
    let (n, e) = start.map_or((prior.angle_random_walk, prior.encoder), |s| (s.angle_random_walk, s.encoder));
    let b = start.map_or(0.01 * n, |s| s.bias_random_walk.max(1e-4 * n));
    let first = [n.max(1e-12).ln(), b.ln(), e.max(1e-12).ln()];
    let (best, value) = simplex(&first, 0.7, 70, objective);
    let (mut best, value) = simplex(&best, 0.3, 40, objective).min_by(value, best);
    let duration = study.bench.windows.tau.last().map_or(10.0, |t| 10.0 * t);
    let mut lowest = value;
    for time in [0.003 * duration, 0.03 * duration] {
        let mut wide = best[..3].to_vec();
        wide.extend([(0.3 * best[0].exp() / time.sqrt()).ln(), time.ln()]);
        let (point, value) = simplex(&wide, 0.8, 120, objective);
        // Two more parameters have to earn their keep.
        if value < lowest - if best.len() == 3 { 6.0 } else { 0.0 } {
            (best, lowest) = (point, value);
        }
    }
    let noise = NoiseModel::from_logs(&best);
    let (normal, whitener) = normal(study, &noise, 1);
    let (step, covariance, rss) = solve(&normal);
    let channels = study.bench.problem.channels() as f64;
    Gls { noise, log_likelihood: -0.5 * (channels * whitener.log_determinant + rss), step, covariance }
}

trait Better {
    fn min_by(self, value: f64, point: Vec<f64>) -> (Vec<f64>, f64);
}

impl Better for (Vec<f64>, f64) {
    fn min_by(self, value: f64, point: Vec<f64>) -> (Vec<f64>, f64) {
        if self.1 <= value { self } else { (point, value) }
    }
}
