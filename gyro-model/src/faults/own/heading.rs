//! Whether an angle is the gyro's integral, pulled to another heading.
//!
//! The yaw of a filter that runs on this gyro (a complementary filter: Mahony, Hamel and Pflimlin 2008) is its integral, pulled with a
//! time constant τ to a heading φ that something else tells, or to zero:
//!
//! ```text
//! y' = κ(g − β) + (φ − y)/τ,   φ ≈ c κ∫g
//! ```
//!
//! A φ that turns as far as the gyro does (c = 1) cannot be told from a gyro whose bias warms up. One that does not is no heading at all:
//! what changes quickly follows the gyro, what changes slowly does not, and no gear between a shaft and its encoder does that.

use super::{
    super::{
        channel::Readings,
        thresholds::{OWN_PULLED, PULLED_TO},
        witness::integral,
    },
    ENOUGH,
};
use crate::nls::Normal;

/// Share of the log, 1 of so many, that an increment is at most.
const LAST: usize = 12;
/// Time of an increment, s.
const INCREMENT: f64 = 0.25;
/// Increments that a time constant has at least.
const SLOW: f64 = 3.0;

/// The time constant, s, within which an angle that is the gyro's integral is pulled to something that does not turn as the gyro does.
pub(super) fn pulled(gyro: &Readings, reference: &Readings) -> Option<f64> {
    let n = gyro.values.len().min(ENOUGH);
    if n < 1000 || reference.values.len() < n || gyro.rows[..n] != reference.rows[..n] {
        return None;
    }
    let (t, y) = (&gyro.t[..n], &reference.values[..n]);
    let rows = ((INCREMENT * (n - 1) as f64 / (t[n - 1] - t[0])).round() as usize).max(4);
    if rows > n / LAST {
        return None;
    }
    let turned = integral(t, &gyro.values[..n]);
    let summed = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / n as f64;
        integral(t, &values.iter().map(|x| x - mean).collect::<Vec<f64>>())
    };
    let increments = |of: &[f64]| (0..n - rows).step_by(rows).map(|k| of[k + rows] - of[k]).collect::<Vec<f64>>();
    // r = Δy − X p: the columns ∂r/∂p are −X.
    let columns =
        [&turned, t, &summed(t), &summed(y), &summed(&turned)].map(|of| increments(of).iter().map(|x| -x).collect());
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let mut all = Normal::zeros(columns.len());
    all.add(&increments(y), &columns);
    let left = |equations: &Normal| equations.cost_after(&equations.rise(1e-12).1).max(0.0);
    // A scale factor, a bias and its drift: all that a gyro beside a shaft has.
    if left(&all) > OWN_PULLED * left(&all.part(0..3)) {
        return None;
    }
    let [scale, _, _, back, along] = all.rise(1e-12).1[..] else { return None };
    let time = -1.0 / back;
    let turns = along * time / scale;
    let slow = SLOW * INCREMENT..(t[n - 1] - t[0]) / SLOW;
    (slow.contains(&time) && turns < PULLED_TO).then_some(time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_yaw_of_a_filter_is_pulled_and_an_encoder_behind_a_gear_is_not() {
        let motion = |k: usize| (0.013 * k as f64).sin() + 0.4 * (0.0471 * k as f64).sin();
        for seed in 0..4 {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut white = || -> f64 { StandardNormal.sample(&mut random) };
            // A bias that warms up, and the noise of a heading.
            let warm = |k: usize| 0.02 * (-(k as f64) / 1500.0).exp();
            let gyro: Vec<f64> = (0..12_000).map(|k| motion(k) + warm(k) + 2e-3 * white()).collect();
            let mut yaw = |time: f64, of: &dyn Fn(f64) -> f64| {
                let (mut y, mut heading) = (0.3, 0.0);
                let made = (0..12_000).map(|k| {
                    heading += 0.01 * motion(k);
                    y += 0.01 * (gyro[k] - 0.01 + (of(heading) + 0.026 * white() - y) / time);
                    y
                });
                made.collect::<Vec<f64>>()
            };
            let of = |values: Vec<f64>| pulled(&Readings::at_100_hz(gyro.clone()), &Readings::at_100_hz(values));
            for time in [2.0, 4.0, 15.0] {
                for values in [yaw(time, &|_| 0.0), yaw(time, &|heading| 0.45 * heading.sin())] {
                    let found = of(values);
                    assert!(found.is_some_and(|found| (0.6..1.6).contains(&(found / time))), "{seed} {time} {found:?}");
                }
                assert_eq!(of(yaw(time, &|heading| heading)), None, "{seed} {time}");
            }
            let mut angle = 0.0;
            let geared = (0..12_000).map(|k| {
                angle += 0.01 * 0.6 * motion(k);
                (angle / 1.5e-3).round() * 1.5e-3
            });
            assert_eq!(of(geared.collect()), None, "{seed}");
        }
    }
}
