//! What coarse steps of the temperature may make of a likelihood.

use super::{noise, series::Series, study::Study, whiten::NoiseModel};

impl Study<'_> {
    /// What coarse steps of the temperature may make of ln L: ½ |W Δr|². W whitens by this noise, and Δr is what the residual changes by
    /// where the temperature is taken as it was read. 0 where it is fine, or the model does not see it.
    #[must_use]
    pub(crate) fn of_temperature_steps(&self, noise: &NoiseModel) -> f64 {
        if !self.bench.problem.series.iter().any(Series::has_coarse_temperature) {
            return 0.0;
        }
        let mut problem = self.bench.problem.clone();
        problem.series.iter_mut().for_each(Series::take_temperature_as_read);
        let as_read = problem.evaluate(&self.model, &self.warm).residual;
        let pairs = as_read.iter().zip(&self.evaluation.residual);
        let change: Vec<Vec<f64>> = pairs.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
        let white = noise::whitener(self, noise).apply_each(&change);
        0.5 * white.iter().flatten().map(|x| x * x).sum::<f64>()
    }
}
