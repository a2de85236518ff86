//! How likely an angle error is, all of it together, if some random causes act beside noise.
//!
//! What one window is off by and what the next one is off by go together where a scale wanders for longer than a window lasts: as if
//! they were independent, few swings of it count as many. So the log is cut into windows side by side, and the covariance of their
//! errors y is a sum over noise and causes, V = Σ c Z:
//!
//! ```text
//! ln L = −½ ln |V| − ½ yᵀ P y,   P = V⁻¹ − V⁻¹ X (Xᵀ V⁻¹ X)⁻¹ Xᵀ V⁻¹,   X = ∂y/∂p
//! c ← c √(yᵀ P Z P y / tr(V⁻¹ Z))
//! ```
//!
//! A mixed linear model; the parameters p of the gyro's model are its fixed effects (Searle, Casella and McCulloch 1992, chapter 6). Each step of
//! c raises ln L (Zhou, Hu, Zhou and Lange 2019, MM algorithms for variance components models).

use super::{
    Cause, FEWEST, SHORTEST,
    cause::FORGETS,
    course::{Course, Remembered, Window},
};
use crate::{fit::judged::finite, nls::invert_observable};
use faer::{
    Mat, Scale, Side,
    linalg::solvers::{DenseSolveCore as _, Llt, Solve as _},
};

/// Windows side by side at most.
const WINDOWS: usize = 250;
/// Variance added to each window, over their mean: keeps V positive definite.
const RIDGE: f64 = 1e-6;
/// Steps at most, and the rise of ln L below which none follows.
const STEPS: usize = 60;
const RISE: f64 = 0.02;

/// ln L of this error at its largest; `None` where there are too few windows, or nothing fits them. Two models are compared beside the
/// same `motion`: that of each is off by its own bias, and a shaft that seems to turn has the noise of one that turns.
pub(super) fn log_likelihood(course: &Course, motion: &Course, causes: &[Cause]) -> Option<f64> {
    let span = course.t.last()? - course.t.first()?;
    let windows = side_by_side(course, (SHORTEST * course.dt).max(span / WINDOWS as f64));
    let n = windows.len();
    if n < FEWEST {
        return None;
    }
    let over = |along: &[f64], k: usize| along[windows[k].to] - along[windows[k].from];
    let y = Mat::from_fn(n, 1, |k, _| over(&course.error, k));
    let x = Mat::from_fn(n, course.fitted.len(), |k, j| over(&course.fitted[j], k));
    let parts = parts(motion, causes, &windows);
    let mut c = vec![y.squared_norm_l2() / (n * parts.len()) as f64; parts.len()];
    let mut best: Option<f64> = None;
    for _ in 0..STEPS {
        let factor = covariance(&parts, &c)?;
        let (py, log_likelihood) = profiled(&factor, &x, &y);
        let log_likelihood = finite(log_likelihood)?;
        if best.is_some_and(|best| log_likelihood < best + RISE) {
            break;
        }
        best = Some(log_likelihood);
        let inverse = factor.inverse();
        for (z, c) in parts.iter().zip(&mut c) {
            let square = (py.transpose() * (z * &py))[(0, 0)];
            let along =
                |j: usize| inverse.col_as_slice(j).iter().zip(z.col_as_slice(j)).map(|(v, z)| v * z).sum::<f64>();
            let trace: f64 = (0..n).map(along).sum();
            *c *= (square / trace).max(0.0).sqrt();
        }
    }
    best
}

fn covariance(parts: &[Mat<f64>], c: &[f64]) -> Option<Llt<f64>> {
    let n = parts.first()?.nrows();
    let mut v = Mat::<f64>::zeros(n, n);
    for (z, c) in parts.iter().zip(c).filter(|(_, c)| **c > 0.0) {
        v += Scale(*c) * z;
    }
    let mean = (0..n).map(|k| v[(k, k)]).sum::<f64>() / n as f64;
    (0..n).for_each(|k| v[(k, k)] += RIDGE * mean);
    v.llt(Side::Lower).ok()
}

/// P y and ln L.
fn profiled(factor: &Llt<f64>, x: &Mat<f64>, y: &Mat<f64>) -> (Mat<f64>, f64) {
    let (vy, vx) = (factor.solve(y), factor.solve(x));
    let (inverse, _) = invert_observable(&(x.transpose() * &vx), 1e-10);
    let py = &vy - &vx * (inverse * (x.transpose() * &vy));
    let lower = factor.L();
    let determinant: f64 = (0..y.nrows()).map(|k| lower[(k, k)].ln()).sum();
    let left = (y.transpose() * &py)[(0, 0)];
    (py, -determinant - 0.5 * left)
}

/// Windows of one length, each from the row where the one before ends. Those with rows that tell nothing are left out.
fn side_by_side(course: &Course, length: f64) -> Vec<Window> {
    let mut end = 0;
    let follows = |window: &Window| {
        let follows = window.from >= end;
        end = if follows { window.to } else { end };
        follows
    };
    course.windows(length, usize::MAX).into_iter().filter(follows).collect()
}

/// The covariance that each kind of noise and each form of a cause makes, 1 in the mean over the windows.
fn parts(course: &Course, causes: &[Cause], windows: &[Window]) -> Vec<Mat<f64>> {
    let over = |along: &[f64], w: &Window| along[w.to] - along[w.from];
    let time = |row: usize| course.t[row] - course.t[0];
    let length = |w: &Window| time(w.to) - time(w.from);
    let middle = |w: &Window| 0.5 * (time(w.from) + time(w.to));
    let counted = |along: &[f64]| diagonal(windows, |w| over(along, w));
    let at_ends = |of: &dyn Fn(usize) -> f64| {
        let next = |a: &Window, b: &Window| if a.to == b.from { -of(b.from) } else { 0.0 };
        symmetric(windows, |w| of(w.from) + of(w.to), next)
    };
    let mut parts = vec![
        at_ends(&|_| 1.0),
        at_ends(&|row| course.rate[row].powi(2)),
        diagonal(windows, length),
        symmetric(
            windows,
            |w| length(w).powi(2) * (time(w.from) + length(w) / 3.0),
            |a, b| length(a) * length(b) * middle(a),
        ),
    ];
    if course.count > 0.0 {
        let turning = |w: &Window| (over(&course.travelled, w) / course.count).min(1.0);
        let next = |a: &Window, b: &Window| if a.to == b.from { -0.5 * turning(a).min(turning(b)) } else { 0.0 };
        parts.push(symmetric(windows, turning, next));
    }
    for cause in causes {
        match cause {
            Cause::RandomScale => parts.extend(FORGETS.map(|tau| scale(course, windows, tau))),
            Cause::RateNoise => parts.extend([&course.travelled, &course.squared].map(|along| counted(along))),
            Cause::ReversalSteps => parts.extend([counted(&course.reversals), undone(windows, &course.reversals)]),
            Cause::StartStopSteps => parts.extend([counted(&course.starts), undone(windows, &course.starts)]),
            Cause::LostMotion => parts.extend([&course.lost, &course.lost_changes].map(|along| counted(along))),
        }
    }
    let n = windows.len();
    parts.retain_mut(|z| {
        let mean = (0..n).map(|k| z[(k, k)]).sum::<f64>() / n as f64;
        *z *= Scale(mean.recip());
        mean > 0.0
    });
    parts
}

/// A scale that wanders: E ∫∫ ω(a) ω(b) e^(−|a − b|/T) da db over two windows.
fn scale(course: &Course, windows: &[Window], tau: f64) -> Mat<f64> {
    let each: Vec<Remembered> = windows.iter().map(|w| course.remembered(*w, tau)).collect();
    let mut z = Mat::zeros(windows.len(), windows.len());
    for i in 0..windows.len() {
        z[(i, i)] = each[i].inside;
        for j in 0..i {
            let gap = course.t[windows[i].from] - course.t[windows[j].to];
            let shared = each[j].to_end * each[i].from_start * (-gap.max(0.0) / tau).exp();
            (z[(i, j)], z[(j, i)]) = (shared, shared);
        }
    }
    z
}

/// Events of which each undoes the one before.
fn undone(windows: &[Window], along: &[f64]) -> Mat<f64> {
    let share = |w: &Window| (along[w.to] - along[w.from]).min(1.0);
    let mut z = diagonal(windows, share);
    let eventful: Vec<usize> = (0..windows.len()).filter(|&k| share(&windows[k]) > 1e-9).collect();
    for pair in eventful.windows(2) {
        let shared = -0.5 * share(&windows[pair[0]]).min(share(&windows[pair[1]]));
        (z[(pair[0], pair[1])], z[(pair[1], pair[0])]) = (shared, shared);
    }
    z
}

fn diagonal(windows: &[Window], of: impl Fn(&Window) -> f64) -> Mat<f64> {
    symmetric(windows, of, |_, _| 0.0)
}

/// From the variance of a window, and the covariance of one with a later one.
fn symmetric(windows: &[Window], own: impl Fn(&Window) -> f64, shared: impl Fn(&Window, &Window) -> f64) -> Mat<f64> {
    Mat::from_fn(windows.len(), windows.len(), |i, j| {
        if i == j { own(&windows[i]) } else { shared(&windows[i.min(j)], &windows[i.max(j)]) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn windows(n: usize) -> Vec<Window> {
        (0..n).map(|k| Window { from: 10 * k, to: 10 * (k + 1) }).collect()
    }

    /// A shaft that swings, seen at 100 Hz.
    fn course(n: usize) -> Course {
        let t: Vec<f64> = (0..=10 * n).map(|k| 0.01 * k as f64).collect();
        let rate: Vec<f64> = t.iter().map(|t| 2.0 * (1.3 * t).sin()).collect();
        let along = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            rate.iter()
                .scan(0.0, |sum, w| {
                    *sum += 0.01 * of(*w);
                    Some(*sum)
                })
                .collect()
        };
        let mut course = Course::default();
        (course.travelled, course.squared) = (along(&f64::abs), along(&|w| w * w));
        course.turned = along(&|w| w);
        course.reversals = t.iter().map(|t| (1.3 * t / std::f64::consts::PI).floor()).collect();
        (course.rate, course.t, course.dt, course.count) = (rate, t, 0.01, 1e-3);
        course
    }

    #[test]
    fn every_part_of_the_covariance_is_one() {
        let course = course(40);
        for z in parts(&course, &[Cause::RandomScale, Cause::RateNoise, Cause::ReversalSteps], &windows(40)) {
            let mut ridged = z.clone();
            (0..40).for_each(|k| ridged[(k, k)] += 1e-9);
            assert!(ridged.llt(Side::Lower).is_ok());
            assert!(((0..40).map(|k| z[(k, k)]).sum::<f64>() / 40.0 - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_wandering_scale_goes_together_from_window_to_window() {
        let course = course(40);
        let z = scale(&course, &windows(40), 8.0);
        // Two windows of one swing: nearly all of the error is common to both.
        let correlation = z[(5, 6)] / (z[(5, 5)] * z[(6, 6)]).sqrt();
        assert!((0.95..1.0).contains(&correlation), "{correlation}");
        // The shaft turns back: what one was off by, the other is off by the other way.
        assert!(z[(5, 30)] < 0.0);
    }
}
