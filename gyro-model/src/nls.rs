//! Nonlinear least squares: Levenberg–Marquardt on the normal equations, solved with faer.
//!
//! Minimises f(p) = Σᵢ rᵢ(p)². One iteration solves, with scaled columns D = diag(JᵀJ)^½ and S = D⁻¹ JᵀJ D⁻¹,
//!
//! ```text
//! (S + λ I) D Δp = −D⁻¹ Jᵀ r
//! ```
//!
//! and takes the step where f falls (Marquardt 1963; Nocedal & Wright, Numerical Optimization, ch. 10). The scaling
//! makes λ and the rank test independent of units. A direction in which S has no weight is left alone, and the
//! parameters that lie in it are named.

#![allow(clippy::inline_always)] // what is not inlined is not compiled for the wider instructions

use faer::{Mat, Side, linalg::solvers::Solve as _};

/// Σ aᵢ bᵢ over the shorter of the two, with the widest instructions that the machine has.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    pulp::Arch::new().dispatch(Dot { a: &a[..length], b: &b[..length] })
}

/// A scalar product, in sums side by side: one sum would wait for itself at every term.
struct Dot<'a> {
    a: &'a [f64],
    b: &'a [f64],
}

impl pulp::NullaryFnOnce for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        const LANES: usize = 16;
        let (heads, others) = (self.a.chunks_exact(LANES), self.b.chunks_exact(LANES));
        let rest: f64 = heads.remainder().iter().zip(others.remainder()).map(|(x, y)| x * y).sum();
        let mut sums = [0.0; LANES];
        for (x, y) in heads.zip(others) {
            for lane in 0..LANES {
                sums[lane] += x[lane] * y[lane];
            }
        }
        sums.iter().sum::<f64>() + rest
    }
}

/// The normal equations at one point.
#[derive(Clone, Debug)]
pub struct Normal {
    /// f(p) = Σ r².
    pub cost: f64,
    /// Jᵀ r, one entry a parameter.
    pub gradient: Vec<f64>,
    /// Jᵀ J, square.
    pub matrix: Mat<f64>,
}

impl Normal {
    /// Equations of `n` parameters with nothing in them yet.
    #[must_use]
    pub fn zeros(n: usize) -> Self {
        Self { cost: 0.0, gradient: vec![0.0; n], matrix: Mat::zeros(n, n) }
    }

    /// Adds residuals `r` with columns `columns` (∂r/∂p, each as long as `r`).
    pub fn add(&mut self, r: &[f64], columns: &[&[f64]]) {
        self.cost += dot(r, r);
        for (i, a) in columns.iter().enumerate() {
            self.gradient[i] += dot(a, r);
            for (j, b) in columns.iter().enumerate().take(i + 1) {
                self.matrix[(i, j)] += dot(a, b);
                self.matrix[(j, i)] = self.matrix[(i, j)];
            }
        }
    }
}

impl Normal {
    /// Adds `sign` times another set of equations.
    pub fn merge(&mut self, other: &Self, sign: f64) {
        self.cost += sign * other.cost;
        for (a, b) in self.gradient.iter_mut().zip(&other.gradient) {
            *a += sign * b;
        }
        for k in 0..self.gradient.len() {
            let columns = self.matrix.col_as_slice_mut(k).iter_mut().zip(other.matrix.col_as_slice(k));
            columns.for_each(|(a, b)| *a += sign * b);
        }
    }

    /// Makes these, the first equations of `all`, those of the residual with column `k` of `all` added to it.
    pub fn shift(&mut self, all: &Self, k: usize) {
        self.cost += 2.0 * all.gradient[k] + all.matrix[(k, k)];
        for (i, g) in self.gradient.iter_mut().enumerate() {
            *g += all.matrix[(i, k)];
        }
    }

    /// The undamped step of these equations, a part of `whole`. Directions of which less than `share` of the whole's
    /// information is left stay where the whole put them.
    #[must_use]
    pub fn step_from(&self, whole: &Self, share: f64) -> Vec<f64> {
        let n = self.gradient.len();
        let d = scales(&whole.matrix);
        let scaled = Mat::from_fn(n, n, |i, j| self.matrix[(i, j)] / (d[i] * d[j]));
        let Ok(eigen) = scaled.self_adjoint_eigen(Side::Lower) else { return vec![0.0; n] };
        let (u, s) = (eigen.U(), eigen.S().column_vector());
        let rows: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| whole.matrix[(i, j)]).collect()).collect();
        // How much the whole holds in a direction of the part.
        let held = |u: &[f64]| -> f64 {
            let row = |i: usize| (0..n).map(|j| u[i] * rows[i][j] / (d[i] * d[j]) * u[j]).sum::<f64>();
            (0..n).map(row).sum()
        };
        let mut step = vec![0.0; n];
        for k in 0..n {
            let u: Vec<f64> = (0..n).map(|i| u[(i, k)]).collect();
            if s[k] > share * held(&u) && s[k] > 1e-10 {
                let along = (0..n).map(|i| u[i] * self.gradient[i] / d[i]).sum::<f64>() / s[k];
                step.iter_mut().zip(&u).zip(&d).for_each(|((step, u), d)| *step -= u * along / d);
            }
        }
        step
    }

    /// The equations of some of the parameters, the others standing where they are.
    #[must_use]
    pub fn part(&self, which: impl IntoIterator<Item = usize>) -> Self {
        let which: Vec<usize> = which.into_iter().collect();
        Self {
            cost: self.cost,
            gradient: which.iter().map(|&k| self.gradient[k]).collect(),
            matrix: Mat::from_fn(which.len(), which.len(), |i, j| self.matrix[(which[i], which[j])]),
        }
    }

    /// Half of what f falls by at its optimum, which is what ln L rises by where r is white, and the step to it, along
    /// the directions that the data determine.
    #[must_use]
    pub fn rise(&self, rank_tolerance: f64) -> (f64, Vec<f64>) {
        let n = self.gradient.len();
        let (inverse, _) = invert_observable(&self.matrix, rank_tolerance);
        let step: Vec<f64> = (0..n).map(|i| -(0..n).map(|j| inverse[(i, j)] * self.gradient[j]).sum::<f64>()).collect();
        (-0.5 * step.iter().zip(&self.gradient).map(|(s, g)| s * g).sum::<f64>(), step)
    }

    /// The same where parameter `k` stands where it is.
    pub fn fix(&mut self, k: usize) {
        self.gradient[k] = 0.0;
        for j in (0..self.gradient.len()).filter(|&j| j != k) {
            (self.matrix[(k, j)], self.matrix[(j, k)]) = (0.0, 0.0);
        }
    }

    /// f to second order after a step.
    #[must_use]
    pub fn cost_after(&self, step: &[f64]) -> f64 {
        let n = step.len();
        let quadratic: f64 = (0..n).map(|i| (0..n).map(|j| step[i] * self.matrix[(i, j)] * step[j]).sum::<f64>()).sum();
        let linear: f64 = step.iter().zip(&self.gradient).map(|(s, g)| s * g).sum();
        self.cost + 2.0 * linear + quadratic
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// At most so many accepted or refused steps.
    pub max_iterations: usize,
    /// At most so many accepted ones.
    pub max_accepted: usize,
    /// Converged when a step changes the cost by less than this share.
    pub tolerance: f64,
    /// Or by less than this.
    pub absolute: f64,
    /// λ to begin with.
    pub damping: f64,
    /// No parameter moves further in one step.
    pub longest_step: f64,
    /// A direction counts as unobservable when its eigenvalue of the scaled matrix is below this.
    pub rank_tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            max_iterations: 50,
            max_accepted: usize::MAX,
            tolerance: 1e-12,
            absolute: 0.0,
            damping: 1e-6,
            longest_step: f64::INFINITY,
            rank_tolerance: 1e-11,
        }
    }
}

/// One accepted step.
#[derive(Clone, Debug)]
pub struct Iteration {
    /// The parameters after it.
    pub values: Vec<f64>,
    /// f there.
    pub cost: f64,
}

/// Where the minimisation ended.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The parameters.
    pub values: Vec<f64>,
    /// f there.
    pub cost: f64,
    /// (JᵀJ)⁻¹ there; times the variance of one residual it is the covariance. Infinite on the diagonal where a
    /// parameter is unobservable.
    pub inverse: Mat<f64>,
    /// The start and every accepted step.
    pub iterations: Vec<Iteration>,
    /// Indices of the parameters that the data do not determine.
    pub unobservable: Vec<usize>,
    /// Whether it stopped because nothing improved any more.
    pub converged: bool,
}

/// Minimises Σ r² from `start` within `bounds`. `evaluate(p, true)` gives cost, gradient and matrix; with `false` only
/// the cost is looked at.
pub fn minimise(
    start: &[f64],
    bounds: &[(f64, f64)],
    mut evaluate: impl FnMut(&[f64], bool) -> Normal,
    options: &Options,
) -> Solution {
    let mut values = start.to_vec();
    let mut normal = evaluate(&values, true);
    let mut iterations = vec![Iteration { values: values.clone(), cost: normal.cost }];
    let mut lambda = options.damping;
    let enough = |cost: f64| options.tolerance * cost.abs() + options.absolute;
    let mut converged = false;
    for _ in 0..options.max_iterations {
        let Some(step) = solve(&normal, lambda) else { break };
        let (longest, steps) = (options.longest_step, values.iter().zip(&step).zip(bounds));
        let trial: Vec<f64> = steps.map(|((v, s), b)| (v + s.clamp(-longest, longest)).clamp(b.0, b.1)).collect();
        let moved: Vec<f64> = trial.iter().zip(&values).map(|(t, v)| t - v).collect();
        // A step that was cut short is another one than these equations ask for: what it brings is to be seen.
        let is_whole = moved.iter().zip(&step).all(|(m, s)| (m - s).abs() <= 1e-9 * s.abs());
        if is_whole && normal.cost - normal.cost_after(&moved) <= HOPELESS * enough(normal.cost) {
            converged = true;
            break;
        }
        let cost = evaluate(&trial, false).cost;
        if cost.is_finite() && cost <= normal.cost {
            let fall = normal.cost - cost;
            values = trial;
            normal = evaluate(&values, true);
            iterations.push(Iteration { values: values.clone(), cost: normal.cost });
            lambda = (lambda * 0.1).max(1e-12);
            converged = fall <= enough(normal.cost);
            if converged || iterations.len() > options.max_accepted {
                break;
            }
        } else {
            lambda *= 10.0;
            if lambda > 1e8 || (cost - normal.cost).abs() <= enough(normal.cost) {
                converged = true;
                break;
            }
        }
    }
    let (inverse, unobservable) = invert(&normal.matrix, options.rank_tolerance);
    Solution { values, cost: normal.cost, inverse, iterations, unobservable, converged }
}

/// Share of the fall with which it is converged that a step has to promise to be tried.
const HOPELESS: f64 = 0.1;

fn scales(matrix: &Mat<f64>) -> Vec<f64> {
    (0..matrix.nrows()).map(|i| matrix[(i, i)].sqrt()).map(|d| if d > 0.0 && d.is_finite() { d } else { 1.0 }).collect()
}

/// Δp of the damped, scaled normal equations; `None` where they are not finite.
fn solve(normal: &Normal, lambda: f64) -> Option<Vec<f64>> {
    let n = normal.gradient.len();
    let d = scales(&normal.matrix);
    let scaled = Mat::from_fn(n, n, |i, j| normal.matrix[(i, j)] / (d[i] * d[j]) + if i == j { lambda } else { 0.0 });
    let right = Mat::from_fn(n, 1, |i, _| -normal.gradient[i] / d[i]);
    let factor = scaled.llt(Side::Lower).ok()?;
    let step = factor.solve(&right);
    let step: Vec<f64> = (0..n).map(|i| step[(i, 0)] / d[i]).collect();
    step.iter().all(|s| s.is_finite()).then_some(step)
}

/// Inverse of a symmetric positive semidefinite matrix, infinite on the diagonal where a parameter lies in a direction
/// that the data do not determine; and which parameters those are.
#[must_use]
pub fn invert(matrix: &Mat<f64>, rank_tolerance: f64) -> (Mat<f64>, Vec<usize>) {
    let (mut inverse, unobservable) = invert_observable(matrix, rank_tolerance);
    for &i in &unobservable {
        inverse[(i, i)] = f64::INFINITY;
    }
    (inverse, unobservable)
}

/// Inverse over the observable directions alone (zero along the others), and which parameters lie in the others.
#[must_use]
pub fn invert_observable(matrix: &Mat<f64>, rank_tolerance: f64) -> (Mat<f64>, Vec<usize>) {
    let n = matrix.nrows();
    if n == 0 {
        return (Mat::zeros(0, 0), Vec::new());
    }
    let d = scales(matrix);
    let scaled = Mat::from_fn(n, n, |i, j| matrix[(i, j)] / (d[i] * d[j]));
    let Ok(eigen) = scaled.self_adjoint_eigen(Side::Lower) else {
        return (Mat::zeros(n, n), (0..n).collect());
    };
    let (u, s) = (eigen.U(), eigen.S().column_vector());
    let mut unobservable = Vec::new();
    let mut inverse = Mat::zeros(n, n);
    for k in 0..n {
        if s[k] > rank_tolerance {
            for i in 0..n {
                for j in 0..n {
                    inverse[(i, j)] += u[(i, k)] * u[(j, k)] / s[k] / (d[i] * d[j]);
                }
            }
        } else {
            unobservable.extend((0..n).filter(|&i| u[(i, k)].abs() > 0.3));
        }
    }
    unobservable.sort_unstable();
    unobservable.dedup();
    (inverse, unobservable)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponential(p: &[f64]) -> Normal {
        let t: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).collect();
        let r: Vec<f64> = t.iter().map(|t| p[0] * (-t * p[1]).exp() - 3.0 * (-t * 0.7).exp()).collect();
        let a: Vec<f64> = t.iter().map(|t| (-t * p[1]).exp()).collect();
        let b: Vec<f64> = t.iter().map(|t| -p[0] * t * (-t * p[1]).exp()).collect();
        let mut normal = Normal::zeros(2);
        normal.add(&r, &[&a, &b]);
        normal
    }

    #[test]
    fn a_nonlinear_problem_converges_to_its_truth_from_afar() {
        let s = minimise(&[1.0, 3.0], &[(-10.0, 10.0), (0.0, 10.0)], |p, _| exponential(p), &Options::default());
        assert!((s.values[0] - 3.0).abs() < 1e-6 && (s.values[1] - 0.7).abs() < 1e-6, "{:?}", s.values);
        assert!(s.converged && s.unobservable.is_empty());
        assert!(s.iterations.windows(2).all(|w| w[1].cost <= w[0].cost));
    }

    #[test]
    fn two_equal_columns_are_named_unobservable() {
        let (_, names) = invert(&Mat::from_fn(3, 3, |i, j| if i < 2 && j < 2 || i == j { 4.0 } else { 0.0 }), 1e-11);
        assert_eq!(names, vec![0, 1]);
    }

    #[test]
    fn a_first_step_that_leads_too_far_is_shortened_until_it_is_taken() {
        // From here the first steps end where the curve has long decayed.
        let start = [3.0, 8.0];
        let options = Options { max_accepted: 1, ..Options::default() };
        let s = minimise(&start, &[(-10.0, 10.0), (0.0, 1e6)], |p, _| exponential(p), &options);
        assert!(s.iterations.len() == 2 && s.cost < exponential(&start).cost, "{:?}", s.iterations);
    }

    #[test]
    fn bounds_hold() {
        let s = minimise(&[1.0, 3.0], &[(-10.0, 2.0), (0.0, 10.0)], |p, _| exponential(p), &Options::default());
        assert!(s.values[0] <= 2.0);
    }
}
