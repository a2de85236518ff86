//! How restless the motion is: the intensity of the white jerk that drives the filter's rate, by maximum likelihood.
//!
//! A bank of small Kalman filters [rate, acceleration] runs on the compensated rate alone. They differ in the jerk's
//! spectral density q, that is in the time over which they average,
//!
//! ```text
//! τ_i = (N²/q_i)^¼ = 0.01 dt · r^i      N² = R dt, the noise of the rate
//! ```
//!
//! from one that follows every reading to one that averages over a hundred. Each collects the likelihood of its
//! innovations, ln S + ν²/S with ν²/S clipped, forgetting over `MEMORY`; the main filter takes q where the parabola
//! through the best member and its neighbours is lowest. Nothing is fitted to the innovation that is judged: q of a
//! sample comes from the samples before it.

/// Filters in the bank.
const MEMBERS: usize = 13;

/// τ of the first member in sample intervals: it follows every reading of any motion.
const FIRST: f64 = 0.01;

/// Ratio of neighbouring τ.
const RATIO: f64 = 2.154_434_69;

/// Over what time the likelihood is collected, s; at least [`SAMPLES`] of them.
const MEMORY: f64 = 0.5;

/// See [`MEMORY`].
const SAMPLES: f64 = 50.0;

/// Longer than so many intervals without a reading is a hole: what the motion did before it says nothing of what it does after.
pub(crate) const HOLE: f64 = 20.0;

/// ν²/S counts up to this, so that one outlier does not choose for all.
const CLIP: f64 = 25.0;

/// The bank of one axis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ProcessNoise {
    members: [Tracker; MEMBERS],
    score: [f64; MEMBERS],
    started: bool,
}

/// A Kalman filter [rate, acceleration] on the rate.
#[derive(Clone, Copy, Debug, Default)]
struct Tracker {
    rate: f64,
    acceleration: f64,
    /// P₁₁, P₁₂, P₂₂.
    p: [f64; 3],
}

impl Tracker {
    /// Predicts over `dt` and takes the rate `z` of variance `r`; returns ln S + ν²/S.
    fn step(&mut self, z: f64, r: f64, q: f64, dt: f64) -> f64 {
        let [p11, p12, p22] = self.p;
        let p11 = p11 + dt * (2.0 * p12 + dt * p22) + q * dt * dt * dt / 3.0;
        let p12 = p12 + dt * p22 + 0.5 * q * dt * dt;
        let p22 = p22 + q * dt;
        self.rate += self.acceleration * dt;
        let (s, nu) = (p11 + r, z - self.rate);
        let (k1, k2) = (p11 / s, p12 / s);
        self.rate += k1 * nu;
        self.acceleration += k2 * nu;
        self.p = [r * k1, r * k2, p22 - k2 * p12];
        s.ln() + (nu * nu / s).min(CLIP)
    }
}

impl ProcessNoise {
    /// Takes the rate `z`, `dt` after the last one, with white noise of variance `r` at the nominal interval `nominal`.
    pub(crate) fn step(&mut self, z: f64, r: f64, dt: f64, nominal: f64) {
        if !self.started || dt > HOLE * nominal {
            let acceleration_variance = r / (nominal * nominal);
            let tracker = Tracker { rate: z, acceleration: 0.0, p: [r, 0.0, 1e4 * acceleration_variance] };
            let score = if self.started { self.score } else { [0.0; MEMBERS] };
            *self = Self { members: [tracker; MEMBERS], score, started: true };
            return;
        }
        let forget = -(-dt / MEMORY.max(SAMPLES * nominal)).exp_m1();
        let mut q = density(0.0, r, nominal);
        for (member, score) in self.members.iter_mut().zip(&mut self.score) {
            let likelihood = member.step(z, r, q, dt);
            *score += forget * (likelihood - *score);
            q /= RATIO * RATIO * RATIO * RATIO;
        }
        if !self.members.iter().all(|m| (m.rate + m.acceleration + m.p[2]).is_finite()) {
            *self = Self::default();
        }
    }

    /// The rate that the bank follows makes a step that is none of the motion's.
    pub(crate) fn shift(&mut self, step: f64) {
        for member in &mut self.members {
            member.rate += step;
        }
    }

    /// The most likely spectral density of the jerk, rad²/s⁵.
    #[must_use]
    pub(crate) fn density(&self, r: f64, nominal: f64) -> f64 {
        let best = (0..MEMBERS).min_by(|&a, &b| self.score[a].total_cmp(&self.score[b])).unwrap_or(0);
        let mut index = best as f64;
        if best > 0 && best + 1 < MEMBERS {
            let [a, b, c] = [self.score[best - 1], self.score[best], self.score[best + 1]];
            let curvature = a - 2.0 * b + c;
            if curvature > 0.0 {
                index += (0.5 * (a - c) / curvature).clamp(-0.5, 0.5);
            }
        }
        density(index, r, nominal)
    }
}

/// q of the member of this index.
fn density(index: f64, r: f64, nominal: f64) -> f64 {
    let tau = FIRST * nominal * RATIO.powf(index);
    r * nominal / (tau * tau * tau * tau)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_density_of_a_jerk_that_is_white_is_found_within_a_factor_of_three() {
        for (seed, q) in [(1, 1e-2), (2, 1.0), (3, 1e2)] {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let (dt, sigma) = (1e-2_f64, 1e-3);
            let (mut rate, mut acceleration) = (0.0, 0.0);
            let mut bank = ProcessNoise::default();
            let (mut sum, mut count) = (0.0, 0.0);
            for k in 0..5000 {
                let jerk: f64 = normal() * (q / dt).sqrt();
                rate += acceleration * dt + 0.5 * jerk * dt * dt;
                acceleration += jerk * dt;
                bank.step(rate + sigma * normal(), sigma * sigma, dt, dt);
                if k > 500 {
                    sum += bank.density(sigma * sigma, dt).ln();
                    count += 1.0;
                }
            }
            let found = (sum / count).exp();
            assert!((q / 3.0..q * 3.0).contains(&found), "{q} found as {found}");
        }
    }
}
