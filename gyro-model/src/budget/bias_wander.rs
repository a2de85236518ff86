//! A bias that wanders: E² = B²τ/3 of a random walk, more slowly of one that forgets. As much as was identified in the error, and
//! no more than even a poor gyro has; what goes with the motion is not its.

use super::{Claim, seen::Seen};
use crate::evidence::whiten::NoiseModel;
use std::f64::consts::TAU;

/// A correlated rate error that is forgotten sooner is no bias, s.
const LASTS: f64 = 0.5;

/// What it makes of the error that is `left`, band by band.
pub(super) fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    let most = NoiseModel::of_a_sensor(0.0, 0.0);
    let noise = seen.noise;
    let walk = noise.bias_random_walk.min(most.bias_random_walk);
    let (size, time) = (noise.correlated.min(most.correlated), noise.correlation_time);
    let size = if time > LASTS { size } else { 0.0 };
    let found = walk > 0.0 || size > 0.0;
    let level = |k: usize| {
        let band = &seen.bands[k];
        let turn = TAU * band.frequency();
        // The mean of 1/f² over the band.
        2.0 * (walk / TAU).powi(2) / (band.low * band.high)
            + if size > 0.0 { 4.0 * size * size * time / (1.0 + (turn * time).powi(2)) } else { 0.0 }
    };
    found.then(|| Claim::up_to(seen, &incoherent(seen, left), level).saying([walk, size, time]))
}

/// How much larger than expected the mean square of a walk may be within one log: the 97.5 % point of χ² with two degrees of freedom, over
/// two.
pub(super) const MOST: f64 = 3.7;

/// Whether the bias is seen to wander once: it walks, or remembers for longer than a twentieth of the log.
pub(super) fn is_seen_once(seen: &Seen) -> bool {
    let lasts = seen.error.len() as f64 * seen.dt;
    let (walk, noise) = (seen.noise.bias_random_walk, seen.noise);
    walk > 0.0 && walk * walk * lasts > noise.correlated.powi(2) || noise.correlation_time > 0.05 * lasts
}

/// What is left beside what goes with the gyro's rate.
pub(super) fn incoherent(seen: &Seen, left: &[f64]) -> Vec<f64> {
    if seen.rests {
        return left.to_vec();
    }
    seen.bands.iter().zip(left).map(|(band, left)| (left - band.coherent()).max(0.0)).collect()
}
