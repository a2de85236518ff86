//! Values with their standard errors, from the blocks of a log.

use std::ops::Neg;

/// A value and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error; infinite where too few blocks tell it.
    pub std_error: f64,
}

impl Estimate {
    /// A value that is known for certain.
    #[must_use]
    pub(crate) const fn exact(value: f64) -> Self {
        Self { value, std_error: 0.0 }
    }

    /// The value in standard errors: 0 where nothing is known of it.
    #[must_use]
    pub(crate) fn in_errors(self) -> f64 {
        if self.value == 0.0 { 0.0 } else { self.value / self.std_error }
    }

    /// Sum of independent block values.
    #[must_use]
    pub(crate) fn sum(values: &[f64]) -> Self {
        let n = values.len() as f64;
        if n < 2.0 {
            return Self { value: values.iter().sum(), std_error: f64::INFINITY };
        }
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { value: n * mean, std_error: (n * variance).sqrt() }
    }

    /// Mean of block values, of which those up to `reach` blocks apart may be correlated: their autocovariances count, with Bartlett
    /// weights (Newey and West 1987). The variance is taken for at least half of what independent blocks would give.
    #[must_use]
    pub(crate) fn mean(values: &[f64], reach: usize) -> Self {
        let n = values.len();
        if n < 4 {
            return Self { value: values.iter().sum::<f64>() / n.max(1) as f64, std_error: f64::INFINITY };
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let covariance =
            |lag: usize| values.windows(lag + 1).map(|w| (w[0] - mean) * (w[lag] - mean)).sum::<f64>() / (n - 1) as f64;
        let neighbours: f64 = (1..=reach).map(|k| 2.0 * (1.0 - k as f64 / (reach + 1) as f64) * covariance(k)).sum();
        let variance = (covariance(0) + neighbours).max(0.5 * covariance(0));
        Self { value: mean, std_error: (variance / n as f64).sqrt() }
    }
}

impl Neg for Estimate {
    type Output = Self;

    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::Estimate;

    #[test]
    fn the_error_of_a_sum_grows_with_the_root_of_the_blocks() {
        let sum = Estimate::sum(&[1.0, 3.0, 1.0, 3.0]);
        assert_eq!(sum.value, 8.0);
        assert!((sum.std_error - (4.0 * 4.0 / 3.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!(Estimate::sum(&[5.0]).in_errors(), 0.0, "one block has no spread");
    }

    #[test]
    fn neighbours_that_are_alike_widen_the_error_of_a_mean() {
        let alone: Vec<f64> = (0..40).map(|k| f64::from(k % 2)).collect();
        let alike: Vec<f64> = (0..40).map(|k| f64::from(k / 4 % 2)).collect();
        let [alone, alike] = [alone, alike].map(|values| Estimate::mean(&values, 3).std_error);
        assert!(alike > 1.5 * alone, "{alike} {alone}");
    }
}
