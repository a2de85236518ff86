//! Errors in variables: the gyro's noise is in the residual and in its derivatives alike.
//!
//! At the true parameters the gradient of least squares is not zero in the mean, and a scale factor comes out too small (regression
//! dilution). Beside an encoder, whose counts hide the noise from row to row, nobody sees it; beside a reference that is as good as
//! exact the scale is off by several standard errors. The mean is taken off the gradient (the corrected score: Nakamura 1990,
//! Biometrika 77, 127; Carroll et al., Measurement Error in Nonlinear Models, ch. 7):
//!
//! ```text
//! c_k = E[(W ∂²r/∂p_k∂g n)ᵀ (W ∂r/∂g n)],     Δp = −(JᵀJ)⁻¹ (Jᵀz − c)
//! ```
//!
//! with n the gyro's white noise, W the whitening filter. One draw of n gives c: it is a sum over so many rows.

use super::{
    noise::scale_slots,
    prior::Prior,
    study::{Study, columns},
    whiten::{NoiseModel, Whitener},
};
use crate::nls;
use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a draw of the gyro's noise adds to the residual of a model and to its derivatives.
#[derive(Clone, Debug)]
pub(super) struct Shaken {
    /// By channel.
    residual: Vec<Vec<f64>>,
    /// By slot and channel.
    columns: Vec<Vec<Vec<f64>>>,
}

/// Standard errors by which the mean of the gradient has to move a scale factor for it to be worth the draw.
const MATTERS: f64 = 0.2;

/// The mean of the gradient that noise in both makes, one entry a slot; `None` where it moves no scale factor by much.
pub(super) fn mean_gradient(
    study: &Study,
    noise: &NoiseModel,
    whitener: &Whitener,
    covariance: &Mat<f64>,
) -> Option<Vec<f64>> {
    let white = |prior: &Prior| noise.summary(0.0, prior).angle_random_walk;
    let whites: Vec<f64> = study.bench.prior.iter().map(white).collect();
    let seen = whitener.fresh(whites.iter().copied().fold(0.0, f64::max).powi(2));
    let moved = |(k, alpha): (usize, f64)| seen / alpha.abs() * covariance[(k, k)].sqrt();
    if !scale_slots(study).any(|slot| (MATTERS..f64::INFINITY).contains(&moved(slot))) {
        return None;
    }
    let shaken = study.shaken(&whites);
    let residual = whitener.apply_each(&shaken.residual);
    let product = |column: &Vec<Vec<f64>>| -> f64 {
        residual.iter().zip(whitener.apply_each(column)).map(|(r, c)| nls::dot(r, &c)).sum()
    };
    Some(shaken.columns.iter().map(product).collect())
}

impl Shaken {
    /// A draw of white noise on the readings of every axis, each with its N, rad/√s.
    pub(super) fn of(study: &Study, white: &[f64]) -> Self {
        let (bench, model, warm, at) = (study.bench, &study.model, &study.warm, &study.evaluation);
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut problem = bench.problem.clone();
        for (series, white) in problem.series.iter_mut().zip(white) {
            let alpha = model.axes[series.axis.index()].as_ref().map_or(1.0, crate::AxisModel::alpha);
            let size = white / (alpha.abs().max(0.1) * series.span().dt.sqrt());
            for reading in &mut series.gyro {
                let normal: f64 = StandardNormal.sample(&mut random);
                *reading += size * normal;
            }
        }
        let own = problem.warm(&problem.evaluate(model, warm), warm);
        let evaluation = problem.evaluate(model, &own);
        let less = |mut a: Vec<Vec<f64>>, b: &[Vec<f64>]| {
            a.iter_mut().zip(b).for_each(|(a, b)| a.iter_mut().zip(b).for_each(|(a, b)| *a -= b));
            a
        };
        let moved = columns(&problem, model, &study.slots, &own, &evaluation);
        Self {
            columns: moved.into_iter().zip(&study.columns).map(|(a, b)| less(a, b)).collect(),
            residual: less(evaluation.residual, &at.residual),
        }
    }
}
