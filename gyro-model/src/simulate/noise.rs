//! Random errors, each from its own stream so that switching one on changes no other.

use super::motion::normal;
use crate::effects::low_pass;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The streams of one seed.
pub(super) fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number);
    random
}

/// x' = −x/T + white, with the stationary standard deviation σ (Ornstein–Uhlenbeck; AR(1) when sampled).
#[derive(Clone, Copy, Debug)]
pub(super) struct Wander {
    pub value: f64,
    std: f64,
    time_constant: f64,
}

impl Wander {
    /// Starting at zero.
    pub(super) fn new(std: f64, time_constant: f64) -> Self {
        Self { value: 0.0, std, time_constant }
    }

    /// Starting anywhere in its stationary distribution.
    pub(super) fn settled(std: f64, time_constant: f64, random: &mut ChaCha8Rng) -> Self {
        Self { value: normal(random, std), std, time_constant }
    }

    /// Exact for any step.
    pub(super) fn step(&mut self, dt: f64, random: &mut ChaCha8Rng) -> f64 {
        let keep = (-dt / self.time_constant).exp();
        self.value = keep * self.value + normal(random, self.std * (1.0 - keep * keep).sqrt());
        self.value
    }
}

/// A wander through a low-pass of its own time constant: smooth, as shaking is. r(τ) = (1 + τ/T) e^{−τ/T}.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smooth {
    pub value: f64,
    drive: Wander,
}

impl Smooth {
    /// Starting at zero.
    pub(super) fn new(std: f64, time_constant: f64) -> Self {
        Self { value: 0.0, drive: Wander::new(std * 2_f64.sqrt(), time_constant) }
    }

    /// For steps well below the time constant.
    pub(super) fn step(&mut self, dt: f64, random: &mut ChaCha8Rng) -> f64 {
        let before = self.drive.value;
        let after = self.drive.step(dt, random);
        self.value = low_pass(self.value, before, after, dt, self.drive.time_constant);
        self.value
    }
}

/// 1/f noise: wanders of equal strength, their time constants a factor of four apart.
#[derive(Clone, Debug)]
pub(super) struct Flicker(Vec<Wander>);

impl Flicker {
    /// `std` is that of each decade-and-a-half or so of time constants between 0.1 s and 400 s.
    pub(super) fn new(std: f64, random: &mut ChaCha8Rng) -> Self {
        Self((0..7).map(|k| Wander::settled(std, 0.1 * 4_f64.powi(k), random)).collect())
    }

    pub(super) fn step(&mut self, dt: f64, random: &mut ChaCha8Rng) -> f64 {
        self.0.iter_mut().map(|wander| wander.step(dt, random)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wander_has_its_standard_deviation_and_forgets_with_its_time_constant() {
        let mut random = stream(1, 0);
        let mut wander = Wander::settled(2.0, 0.5, &mut random);
        let values: Vec<f64> = (0..200_000).map(|_| wander.step(0.05, &mut random)).collect();
        let n = values.len() as f64;
        let variance = values.iter().map(|v| v * v).sum::<f64>() / n;
        let after = values.windows(11).map(|w| w[0] * w[10]).sum::<f64>() / n;
        assert!((variance / 4.0 - 1.0).abs() < 0.06, "{variance}");
        assert!((after / variance - (-1_f64).exp()).abs() < 0.04, "{}", after / variance);
    }

    #[test]
    fn smooth_shaking_has_its_standard_deviation_and_correlation() {
        let mut random = stream(3, 0);
        let mut shaking = Smooth::new(2.0, 0.5);
        let values: Vec<f64> = (0..400_000).map(|_| shaking.step(0.025, &mut random)).collect();
        let n = values.len() as f64;
        let variance = values.iter().map(|v| v * v).sum::<f64>() / n;
        let after = values.windows(21).map(|w| w[0] * w[20]).sum::<f64>() / n;
        assert!((variance / 4.0 - 1.0).abs() < 0.06, "{variance}");
        assert!((after / variance - 2.0 * (-1_f64).exp()).abs() < 0.04, "{}", after / variance);
    }

    #[test]
    fn flicker_noise_averages_down_far_slower_than_white_noise() {
        let mut random = stream(2, 0);
        let mut flicker = Flicker::new(1.0, &mut random);
        let values: Vec<f64> = (0..200_000).map(|_| flicker.step(0.05, &mut random)).collect();
        let allan = |m: usize| {
            let means: Vec<f64> = values.chunks_exact(m).map(|c| c.iter().sum::<f64>() / m as f64).collect();
            let sum: f64 = means.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
            (0.5 * sum / (means.len() - 1) as f64).sqrt()
        };
        let fall = allan(10) / allan(400);
        assert!((0.6..1.6).contains(&fall), "white noise falls by 6.3, this by {fall}");
    }
}
