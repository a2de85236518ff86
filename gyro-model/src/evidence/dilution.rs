//! Errors in variables: the gyro's noise is in the residual and in its derivatives.
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
    prior::Prior,
    study::Study,
    whiten::{NoiseModel, Whitener},
};
use crate::nls;
use faer::Mat;

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
    if !study.scales().any(|slot| (MATTERS..f64::INFINITY).contains(&moved(slot))) {
        return None;
    }
    let shaken = study.shaken(&whites);
    let residual = whitener.apply_each(&shaken.residual);
    let product = |column: &Vec<Vec<f64>>| -> f64 {
        residual.iter().zip(whitener.apply_each(column)).map(|(r, c)| nls::dot(r, &c)).sum()
    };
    Some(shaken.columns.iter().map(product).collect())
}
