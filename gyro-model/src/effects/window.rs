//! A mean of the motion about an instant: of what was before alone, or of what was before and after with the same weights.

/// What is shown: w₀ x(t) + Σₖ wₖ (x(t − k h) + x(t + k h)) for k > 0, or without x(t + k h) of the past alone. The weights' sum is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// h, s.
    pub step: f64,
    /// w₀, w₁, …: never empty.
    pub weights: Vec<f64>,
    /// Whether nothing after the instant counts.
    pub past_alone: bool,
}

impl Window {
    /// What is there, and no mean.
    #[must_use]
    pub fn of_nothing() -> Self {
        Self { step: 0.0, weights: vec![1.0], past_alone: false }
    }

    /// The normal distribution's density of standard deviation `w`, s, at instants `step` apart, as far as `reach` from its middle.
    #[must_use]
    pub fn gaussian(w: f64, step: f64, reach: f64) -> Self {
        if !(step > 0.0 && reach / step < MOST) {
            return Self::of_nothing();
        }
        let density = |k: u32| (-0.5 * (f64::from(k) * step / w).powi(2)).exp();
        let mut weights: Vec<f64> = (0..=(reach / step).ceil() as u32).map(density).collect();
        let sum: f64 = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        for weight in &mut weights {
            *weight /= sum;
        }
        Self { step, weights, past_alone: false }
    }

    /// The first-order low-pass filter of time constant `tau`, s, by the trapezoidal rule at instants `step` ≤ 2 `tau` apart, as far back as
    /// `reach`: w₀ = h/(2τ + h), wₖ = w₀ (1 + a) aᵏ⁻¹ with a = (2τ − h)/(2τ + h). Mean and variance of the delay are τ and τ².
    #[must_use]
    pub fn first_order(tau: f64, step: f64, reach: f64) -> Self {
        let (first, stays) = (step / (2.0 * tau + step), (2.0 * tau - step) / (2.0 * tau + step));
        Self::of_past(step, reach, |k| if k == 0 { first } else { first * (1.0 + stays) * stays.powi(k - 1) })
    }

    /// The same filter as software computes it every `step`, by the implicit Euler method: wₖ = K (1 − K)ᵏ with K = h/(τ + h).
    #[must_use]
    pub fn first_order_in_steps(tau: f64, step: f64, reach: f64) -> Self {
        let stays = tau / (tau + step);
        Self::of_past(step, reach, |k| stays.powi(k))
    }

    fn of_past(step: f64, reach: f64, weight: impl Fn(i32) -> f64) -> Self {
        if !(step > 0.0 && reach / step < MOST) {
            return Self::of_nothing();
        }
        let mut weights: Vec<f64> = (0..=(reach / step).ceil() as i32).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        for weight in &mut weights {
            *weight /= sum;
        }
        Self { step, weights, past_alone: true }
    }

    /// The mean of what is `at` this many seconds from now, asked for from the earliest on.
    pub fn mean(&self, mut at: impl FnMut(f64) -> f64) -> f64 {
        let before = self.weights.iter().enumerate().skip(1).rev().map(|(k, weight)| (-(k as f64), weight));
        let ahead = if self.past_alone { 1 } else { self.weights.len() };
        let after = self.weights[..ahead].iter().enumerate().map(|(k, weight)| (k as f64, weight));
        before.chain(after).map(|(k, weight)| weight * at(k * self.step)).sum()
    }

    /// How many steps it reaches to either side.
    #[must_use]
    pub fn reach(&self) -> usize {
        self.weights.len() - 1
    }

    /// The means around each of the values `step` apart that have [`Self::reach`] others on both sides.
    #[must_use]
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let reach = self.reach();
        let Some(count) = values.len().checked_sub(2 * reach) else { return Vec::new() };
        let mut means: Vec<f64> = values[reach..reach + count].iter().map(|x| self.weights[0] * x).collect();
        for (k, weight) in self.weights.iter().enumerate().skip(1) {
            let before = &values[reach - k..][..count];
            if self.past_alone {
                mean_of(&mut means, before, *weight);
                continue;
            }
            let after = &values[reach + k..][..count];
            for ((mean, before), after) in means.iter_mut().zip(before).zip(after) {
                *mean += weight * (before + after);
            }
        }
        means
    }
}

/// Adds these values, weighed.
fn mean_of(means: &mut [f64], values: &[f64], weight: f64) {
    means.iter_mut().zip(values).for_each(|(mean, value)| *mean += weight * value);
}

/// Steps that a window may reach to either side.
const MOST: f64 = 1e4;

#[cfg(test)]
mod tests {
    use super::Window;

    #[test]
    fn means_of_many_are_the_means_of_each() {
        for window in [Window::gaussian(0.02, 0.01, 0.08), Window::first_order_in_steps(0.02, 0.01, 0.08)] {
            are_those_of_each(&window);
        }
    }

    fn are_those_of_each(window: &Window) {
        let value = |k: usize| (0.3 * k as f64).sin();
        let values: Vec<f64> = (0..60).map(value).collect();
        let means = window.means(&values);
        assert_eq!(means.len(), 60 - 2 * window.reach());
        for (i, mean) in means.iter().enumerate() {
            let at = |u: f64| values[(i as f64 + window.reach() as f64 + u / 0.01).round() as usize];
            assert!((mean - window.mean(at)).abs() < 1e-12);
        }
        assert!(window.means(&values[..5]).is_empty());
    }
}
