//! What the regressors of a model are evaluated at, and refreshed with from fit to fit: rate, angle, motion.

use super::integrate::integral;
use crate::effects::{Parabola, derivative, quieter};
use std::sync::{Arc, OnceLock};

/// What the regressors of one axis are evaluated at; refreshed after each fit.
#[derive(Clone, Debug)]
pub struct Warm {
    /// Compensated rate at the samples, rad/s.
    pub rate: Vec<f64>,
    pub(crate) rate_dot: Vec<f64>,
    /// The rate at the samples' own times where readings are re-stamped, as a reference sees it, rad/s; empty where that is `rate`.
    pub(super) turning: Vec<f64>,
    /// What the sensor felt of it, the ringing of its mount still in it, rad/s; empty where that is the same.
    pub(super) felt: Vec<f64>,
    /// The integral of the compensated rate, re-stamped, at the samples, rad.
    pub(super) whole: Arc<Vec<f64>>,
    pub(super) motion: OnceLock<Quiet>,
    /// Best known angle at the samples: the gyro's shape on the reference's level, rad.
    pub angle: Vec<f64>,
    /// The same on the reference's level over so short a time that it is as near to the true angle as can be, with the
    /// encoder's own errors: what its quantisation is drawn along. Empty where there is no step.
    pub close: Vec<f64>,
    /// Samples whose compensation is a guess under the model they were made with; empty where there are none.
    pub unsure: Vec<bool>,
    /// Samples to be left out whatever the model says, so that models can be compared on the same ones; empty: none.
    pub left_out: Vec<bool>,
}

/// A motion without the gyro's noise, as far as it is slower than that.
#[derive(Clone, Debug)]
pub(super) struct Quiet {
    /// At the samples, rad.
    pub angle: Vec<f64>,
    /// Its derivative, rad/s.
    pub rate: Vec<f64>,
    /// What took the noise out; `None` where the motion allows nothing.
    pub by: Option<Parabola>,
}

impl Quiet {
    fn of(t: &[f64], rate: &[f64], by: Option<Parabola>) -> Self {
        let rate = by.as_ref().map_or_else(|| rate.to_vec(), |by| by.through_all(t, rate));
        Self { angle: integral(t, &rate), rate, by }
    }

    /// What is left of another angle, noise alone say, where the same is done to it.
    pub(super) fn likewise(&self, t: &[f64], angle: &[f64]) -> Self {
        Self::of(t, &derivative(t, angle), self.by.clone())
    }
}

impl Warm {
    /// What a reference shows a part of: with the noise in it, a mean over several samples would make the residual's noise less.
    pub(super) fn motion(&self, t: &[f64]) -> &Quiet {
        self.motion.get_or_init(|| {
            let rate = derivative(t, &self.whole);
            Quiet::of(t, &rate, quieter(t, &rate))
        })
    }

    /// The same with these samples as guesses.
    pub(super) fn unsure_as(&self, unsure: &[bool]) -> Self {
        let unsure = if self.left_out.is_empty() { unsure.to_vec() } else { Vec::new() };
        Self { unsure, ..self.clone() }
    }

    /// What an encoder's quantisation is drawn along.
    #[must_use]
    pub fn drawn_along(&self) -> &[f64] {
        if self.close.is_empty() { &self.angle } else { &self.close }
    }

    /// The same without what another model is unsure of.
    #[must_use]
    pub fn without(&self, other: &Self) -> Self {
        Self { left_out: other.frozen().left_out, unsure: Vec::new(), ..self.clone() }
    }

    /// The same with what is unsure left out for good.
    #[must_use]
    pub fn frozen(&self) -> Self {
        let left_out = if self.left_out.is_empty() { self.unsure.clone() } else { self.left_out.clone() };
        Self { left_out, unsure: Vec::new(), ..self.clone() }
    }
}
