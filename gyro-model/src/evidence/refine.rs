//! A fitted model under the noise of its residual: parameters at their likeliest, and how well each is known.

use super::{
    growth, identify, instants,
    noise::{self, Gls},
    problem::{Slot, is_scale, value},
    series::Rest,
    study::{Study, is_tone, parameter_card},
    whiten::NoiseModel,
};
use crate::{effects::Role, nls};
use faer::Mat;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

impl Study<'_> {
    /// Identifies the noise of the residual, and with it generalised least squares about the present parameters.
    #[must_use]
    pub fn identify(&self) -> Gls {
        identify::identify(self)
    }

    /// The same beside a noise that is known to be near.
    #[must_use]
    pub fn identify_near(&self, known: &NoiseModel) -> Gls {
        identify::near(self, known)
    }

    /// Moves the parameters to the generalised least-squares optimum, the noise being identified anew each time, and
    /// gives the noise and the covariance there.
    #[must_use]
    pub fn refine(self) -> (Self, Gls) {
        let gls = self.identify();
        self.refine_by(gls, |_, gls| gls.step.clone())
    }

    /// The same of the tones alone, the other parameters standing where they are, from a noise that is known.
    #[must_use]
    pub fn refine_tones(self, gls: Gls) -> (Self, Gls) {
        let is_tone = |slot: &Slot| is_tone(&self.bench.problem, &self.model, *slot);
        let tones: Vec<bool> = self.slots.iter().map(is_tone).collect();
        // To first order the likelihood has moved them already: as far as that holds they need no more.
        let stands = |k: usize| !tones[k] || gls.step[k].abs() < gls.std_error(k);
        if (0..tones.len()).all(stands) {
            return (self, gls);
        }
        let step = |study: &Self, gls: &Gls| {
            let (mut normal, _) = noise::normal(study, &gls.noise);
            for k in (0..tones.len()).filter(|&k| !tones[k]) {
                normal.fix(k);
            }
            normal.step_from(&normal, 1e-9)
        };
        self.refine_by(gls, step)
    }

    fn refine_by(self, gls: Gls, step: impl Fn(&Self, &Gls) -> Vec<f64>) -> (Self, Gls) {
        let bench = self.bench;
        let (mut study, mut gls) = (self, gls);
        for _ in 0..4 {
            let mut model = study.model.clone();
            let mut largest: f64 = 0.0;
            for (k, (slot, step)) in study.slots.iter().zip(step(&study, &gls)).enumerate() {
                let bounds = parameter_card(&bench.problem, &model, *slot).bounds;
                if let Some(v) = value(&bench.problem, &mut model, *slot) {
                    *v = (*v + step).clamp(bounds.0, bounds.1);
                    let sigma = gls.std_error(k);
                    if sigma.is_finite() && sigma > 0.0 {
                        largest = largest.max(step.abs() / sigma);
                    }
                }
            }
            let warm = bench.problem.warm(&bench.problem.evaluate(&model, &study.warm), &study.warm);
            study = Self::hold(bench, &model, &study.slots, warm, study.unobservable);
            gls = noise::at_noise(&study, &gls.noise);
            if largest < 0.02 {
                break;
            }
        }
        (study, gls)
    }

    /// By how many standard errors an effect of a stamped model differs from nothing: those that one normal number would differ by as
    /// rarely as χ² = vᵀ C⁻¹ v of n degrees of freedom is as large. v: its n coefficients or, where it has none, its widths and times; C
    /// their covariance, the correlations those of `gls`. `None` where nothing lies elsewhere, as with a frequency, or an error is not
    /// known.
    #[must_use]
    pub fn size_in_errors(&self, gls: &Gls, series: usize, id: &str) -> Option<f64> {
        let axis = self.bench.problem.series[series].axis;
        let terms = &self.model.axes[axis.index()].as_ref()?.terms;
        let place = terms.iter().position(|term| term.effect.card().id == id)?;
        let cards = terms[place].effect.parameters(axis);
        let sizes = |role: Role| -> Vec<usize> {
            let is_size = |slot: &Slot| {
                let is_own = slot.series == series && slot.term == place;
                is_own && cards[slot.parameter].role == role && cards[slot.parameter].neutral == 0.0
            };
            (0..self.slots.len()).filter(|&k| is_size(&self.slots[k])).collect()
        };
        let rows = [Role::Linear, Role::Shape].map(sizes).into_iter().find(|rows| !rows.is_empty())?;
        let own = |k: usize| self.slots[rows[k]].parameter;
        let (value, error) = (|k| terms[place].values[own(k)], |k| terms[place].std_errors[own(k)]);
        let n = rows.len();
        let correlation = Mat::from_fn(n, n, |i, j| {
            gls.covariance[(rows[i], rows[j])] / (gls.std_error(rows[i]) * gls.std_error(rows[j]))
        });
        if !(0..n).all(|i| error(i).is_finite() && (0..n).all(|j| correlation[(i, j)].is_finite())) {
            return None;
        }
        let (inverse, _) = nls::invert_observable(&correlation, 1e-9);
        let form = |i: usize| (0..n).map(|j| value(i) / error(i) * inverse[(i, j)] * value(j) / error(j)).sum::<f64>();
        Some(in_errors((0..n).map(form).sum(), n))
    }

    /// Writes standard errors and noise into the model. Where generalised least squares would end elsewhere than these
    /// parameters stand, nobody knows which of the two is right: the way between them is part of the error. A bias may have
    /// walked unseen, or not: the variance is the mean of the two. Where the residual is no noise that sensors have, the
    /// parameters' scatter from block to block says how well they are known.
    pub fn stamp(&mut self, gls: &Gls) {
        let sober = noise::sober(self, &gls.noise);
        let scatter = sober.map(|_| self.grams.scatter(&self.bench.windows.tau, &self.bench.weights, &self.hold));
        let beyond = noise::beyond_white(self, gls);
        let walking = identify::with_unseen_walk(self, gls);
        let whitener = noise::whitener(self, &gls.noise);
        let less = noise::error_of_trapezoids(self, &gls.noise);
        let in_forms = self.apart_in_forms();
        let of_instants: Vec<Option<f64>> =
            self.slots.iter().map(|slot| instants::std_error(self, &whitener, *slot)).collect();
        for (k, slot) in self.slots.iter().enumerate() {
            let axis = self.bench.problem.series[slot.series].axis.index();
            if let Some(model) = &mut self.model.axes[axis] {
                let sigmas = [beyond[k] * gls.std_error(k), walking.std_error(k)].map(|sigma| less * sigma);
                let sigma = sigmas[0].max(sigmas[0].hypot(sigmas[1]) / 2_f64.sqrt());
                model.terms[slot.term].std_errors[slot.parameter] = match &scatter {
                    Some(scatter) if sigma.is_finite() => scatter[k],
                    _ => gls.step[k].hypot(sigma).max(of_instants[k].unwrap_or(0.0)),
                }
                .hypot(in_forms[k]);
            }
        }
        let rate_square = growth::rate_square(self);
        let left = self.grams.normal(&self.bench.windows.tau, &self.bench.weights);
        for (place, series) in self.bench.problem.series.iter().enumerate() {
            if let Some(model) = &mut self.model.axes[series.axis.index()] {
                // Σ (E/F)² of the averaging times is one each where there is but noise.
                let scale =
                    self.slots.iter().position(|slot| slot.series == place && is_scale(&model.terms[slot.term]));
                let unexplained = scale.filter(|_| sober.is_some()).map_or(0.0, |k| {
                    ((left.cost - self.bench.windows.tau.len() as f64).max(0.0) / left.matrix[(k, k)]).sqrt()
                        / model.alpha().abs()
                });
                for term in model.terms.iter_mut().filter(|term| series.rest == Rest::Whole && is_scale(term)) {
                    term.std_errors.fill(f64::INFINITY);
                }
                model.noise = sober.unwrap_or(gls.noise).summary(rate_square, &self.bench.prior[0]);
                model.noise.unexplained = if unexplained.is_finite() { unexplained } else { 0.0 };
            }
        }
    }
}

/// How many standard errors of one normal number are as rare as χ² of `n` degrees of freedom.
fn in_errors(chi_squared: f64, n: usize) -> f64 {
    let rare = ChiSquared::new(n as f64).map_or(0.0, |law| law.sf(chi_squared));
    // What is rarer than a double tells is as far out as the mean of the square says.
    if n == 1 || rare < RAREST {
        return (chi_squared - (n - 1) as f64).max(0.0).sqrt();
    }
    -Normal::standard().inverse_cdf(0.5 * rare)
}

/// Chances below this are not told from nothing.
const RAREST: f64 = 1e-14;

#[cfg(test)]
mod tests {
    use super::in_errors;

    #[test]
    fn several_parameters_differ_from_nothing_as_rarely_as_one_number_does() {
        assert!((in_errors(16.0, 1) - 4.0).abs() < 1e-12);
        // χ² of three degrees of freedom is above 22.1 as rarely as a normal number lies beyond four standard deviations.
        assert!((in_errors(22.06, 3) - 4.0).abs() < 0.01, "{}", in_errors(22.06, 3));
        assert!(in_errors(2.0, 3) < 0.6 && in_errors(1e6, 3) > 900.0);
    }
}
