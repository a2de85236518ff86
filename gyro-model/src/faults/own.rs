//! A reference that is made of the gyro's own readings: a copy, an integral, a filter of them.
//!
//! Of a reference that something else measured, no sum of the gyro's readings makes the rate to better than a share of the
//! gyro's noise: that noise is in the readings and not in the reference. So the reference's increments are fitted by the
//! readings nearby,
//!
//! ```text
//! r_k = c + Σ h_i g_{k+i},  i = −8 … 8
//! ```
//!
//! by least squares, and what is left over is held against the noise of the readings, which their neighbours tell.
//!
//! An integral that was printed with few digits, or is pulled slowly to a heading, is off by more than that from row to row. But over a
//! longer time T the gyro's noise adds up to a walk N√T, which an independent reference does not follow: second differences of the
//! reference's angle less the gyro's have a variance of 2N²T at least. Where it is much less, for any T, the walk is in the reference too.
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
    Report,
    channel::{Channel, Readings},
    neighbours::Neighbours,
    thresholds::{OWN, OWN_PULLED, OWN_WALK, PULLED_TO},
    witness::integral,
};
use crate::{Axis, Record, effects::white_noise, fault::FaultKind, nls::Normal, record::ReferenceKind, units};
use nalgebra::{DMatrix, DVector};

/// Readings on either side that a filter may reach to.
const REACH: usize = 8;
/// Readings that are enough to tell.
const ENOUGH: usize = 20_000;

/// Reports references that are the gyro's own.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL.into_iter().filter(|&axis| record.has_gyro(axis)) {
        let channel = match record.reference(axis) {
            Some(ReferenceKind::Angle) => Channel::Angle(axis),
            Some(ReferenceKind::Rate) => Channel::Rate(axis),
            Some(ReferenceKind::Quaternion) | None => continue,
        };
        let (gyro, reference) = (Readings::of(record, Channel::Gyro(axis)), Readings::of(record, channel));
        // One that is the same throughout says that this axis does not turn.
        if reference.values.windows(2).all(|pair| pair[0] == pair[1]) {
            continue;
        }
        let is_angle = matches!(channel, Channel::Angle(_));
        let how = if is_own(channel, &gyro, &reference) {
            format!("what they do not explain of it is less than {OWN} of their noise")
        } else if is_angle && follows_the_walk(&gyro, &reference) {
            "it follows the random walk that the gyro's noise adds up to".to_owned()
        } else if let Some(time) = is_angle.then(|| pulled(&gyro, &reference)).flatten() {
            format!(
                "it is their integral, pulled to another heading (time constant {}), as the yaw of a filter is",
                units::time(time)
            )
        } else {
            continue;
        };
        let name = channel.name();
        let says = format!(
            "{name} is computed from this gyro's own readings (gyro_{axis}): {how}. It has the gyro's errors in it and shows none of them: use an encoder, \
             motion capture, cameras or a second IMU"
        );
        report.add_on(axis, FaultKind::DependentReference, reference.rows.len() as u64, Some(0.0), says);
    }
}

fn is_own(channel: Channel, gyro: &Readings, reference: &Readings) -> bool {
    let n = gyro.values.len().min(ENOUGH);
    // One made of the gyro's readings has the gyro's rows.
    let Some(noise) = Neighbours::new(gyro).map(|all| all.noise).filter(|noise| *noise > 0.0) else { return false };
    if n < 100 + 2 * REACH || gyro.rows[..n] != reference.rows[..n.min(reference.rows.len())] {
        return false;
    }
    let rate = |k: usize| match channel {
        Channel::Angle(_) => {
            (reference.values[k] - reference.values[k - 1]) / (reference.t[k] - reference.t[k - 1]).max(1e-9)
        }
        _ => reference.values[k],
    };
    let columns = 2 * REACH + 2;
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
    let row = |k: usize| {
        let of = |j: usize| if j == 0 { 1.0 } else { gyro.values[k + j - 1 - REACH] };
        DVector::from_fn(columns, |j, _| of(j))
    };
    let all = REACH + 1..n - REACH;
    // What stands still is made of nothing.
    let mean = all.clone().map(rate).sum::<f64>() / all.len() as f64;
    let spread = (all.clone().map(|k| (rate(k) - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt();
    if spread < noise {
        return false;
    }
    for k in all.clone() {
        let row = row(k);
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(rate(k), &row, 1.0);
    }
    let Some(filter) = normal.cholesky().map(|of| of.solve(&right)) else { return false };
    let left: f64 = all.clone().map(|k| (rate(k) - row(k).dot(&filter)).powi(2)).sum();
    (left / all.len() as f64).sqrt() < OWN * noise
}

/// Times over which the walk, and a pull, are looked for: from so many rows on, up to this share of the log.
const FIRST: usize = 4;
const LAST: usize = 12;
/// Rows that readings are averaged over for their noise: what vibrates is averaged out, what turns is not.
const MEANS: [usize; 5] = [1, 2, 4, 8, 16];

/// N of a gyro's white noise, rad/√s: the least that its readings show at any rate.
fn random_walk(gyro: &Readings) -> f64 {
    let dt = (gyro.t[gyro.t.len() - 1] - gyro.t[0]) / (gyro.t.len() - 1) as f64;
    let at = |rows: usize| {
        let mean = |part: &[f64]| part.iter().sum::<f64>() / rows as f64;
        let means: Vec<f64> = gyro.values.chunks_exact(rows).map(mean).collect();
        white_noise(&means) * (rows as f64 * dt).sqrt()
    };
    MEANS.into_iter().filter(|rows| gyro.values.len() / rows > 100).map(at).fold(f64::INFINITY, f64::min)
}

/// Whether an angle goes along with the random walk of the gyro's integral, for any time up to a twelfth of the log.
fn follows_the_walk(gyro: &Readings, reference: &Readings) -> bool {
    let n = gyro.values.len().min(ENOUGH);
    if n < 1000 || reference.values.len() < n || gyro.rows[..n] != reference.rows[..n] {
        return false;
    }
    let walk = random_walk(gyro);
    let (t, g) = (&gyro.t[..n], &gyro.values[..n]);
    let turned = integral(t, g);
    let change = |k: usize| g[(k + 1).min(n - 1)] - g[k.saturating_sub(1)];
    let least =
        std::iter::successors(Some(FIRST), |rows| Some(2 * rows)).take_while(|rows| rows * LAST < n).map(|rows| {
            let places: Vec<usize> = (rows..n - rows).step_by((rows / 2).max(1)).collect();
            let bent = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
                places.iter().map(|&k| of(k + rows) - 2.0 * of(k) + of(k - rows)).collect()
            };
            let shown = bent(&|k| reference.values[k]);
            // Scale, lateness and lag of what was made of the readings.
            let columns = [bent(&|k| turned[k]), bent(&|k| g[k]), bent(&change)];
            let mut normal = Normal::zeros(columns.len());
            normal.add(&shown, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let step = normal.step_from(&normal, 1e-12);
            let left = normal.cost_after(&step).max(0.0) / places.len() as f64;
            let time = (t[n - 1] - t[0]) / (n - 1) as f64 * rows as f64;
            // In the reference's unit, which may be another one than the gyro's.
            let walk = step[0] * walk;
            left / (2.0 * walk * walk * time).max(f64::MIN_POSITIVE)
        });
    let least = least.fold(f64::INFINITY, f64::min);
    walk > 0.0 && least < OWN_WALK
}

/// Time of an increment, s.
const INCREMENT: f64 = 0.25;
/// Increments that a time constant has at least.
const SLOW: f64 = 3.0;

/// The time constant, s, within which an angle that is the gyro's integral is pulled to something that does not turn as the gyro does.
fn pulled(gyro: &Readings, reference: &Readings) -> Option<f64> {
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

    fn readings(values: Vec<f64>) -> Readings {
        let n = values.len();
        Readings { rows: (0..n).collect(), t: (0..n).map(|k| k as f64 * 0.01).collect(), values }
    }

    fn noise(k: usize) -> f64 {
        f64::from((k as u32).wrapping_mul(2_654_435_761) >> 8) / 1.68e7 - 0.5
    }

    #[test]
    fn a_copy_an_integral_and_a_filter_are_the_gyros_own_and_a_quiet_encoder_is_not() {
        let motion = |k: usize| (0.013 * k as f64).sin() + 0.4 * (0.0471 * k as f64).sin();
        let gyro: Vec<f64> = (0..3000).map(|k| motion(k) + 0.002 * noise(k)).collect();
        let sums = |of: &dyn Fn(usize) -> f64| {
            let mut sum = 0.0;
            (0..3000)
                .map(|k| {
                    sum += 0.01 * of(k);
                    sum
                })
                .collect::<Vec<f64>>()
        };
        let of = |channel, values: Vec<f64>| is_own(channel, &readings(gyro.clone()), &readings(values));
        let (rate, angle) = (Channel::Rate(Axis::Z), Channel::Angle(Axis::Z));
        assert!(of(rate, gyro.iter().map(|x| 1.01 * x - 0.02).collect()));
        let mean = |k: usize| gyro[k.saturating_sub(4)..=k].iter().sum::<f64>() / 5.0;
        assert!(of(rate, (0..3000).map(mean).collect()));
        assert!(of(angle, sums(&|k| gyro[k])));
        assert!(of(angle, sums(&|k| 0.5 * (gyro[k] + gyro[k.saturating_sub(1)]))));
        assert!(!of(angle, sums(&motion)));
        assert!(!of(rate, (0..3000).map(motion).collect()));
        assert!(!of(rate, vec![0.0; 3000]));
    }

    #[test]
    fn an_integral_that_is_printed_or_pulled_follows_the_walk_and_an_encoder_does_not() {
        let motion = |k: usize| (0.013 * k as f64).sin() + 0.4 * (0.0471 * k as f64).sin();
        for seed in 0..4 {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut white = || -> f64 { StandardNormal.sample(&mut random) };
            let gyro: Vec<f64> = (0..12_000).map(|k| motion(k) + 6e-4 * white()).collect();
            let angle = |of: &dyn Fn(usize) -> f64, pull: f64| {
                let (mut sum, mut heading) = (0.3, 0.0);
                let made = (0..12_000).map(|k| {
                    heading += 0.01 * motion(k);
                    sum += 0.01 * (of(k) + pull * (heading - sum));
                    sum
                });
                made.collect::<Vec<f64>>()
            };
            let count = |values: Vec<f64>, step: f64| values.into_iter().map(|x| (x / step).round() * step).collect();
            let of = |values: Vec<f64>| follows_the_walk(&readings(gyro.clone()), &readings(values));
            assert!(of(count(angle(&|k| gyro[k], 0.0), 1e-4)), "{seed}");
            assert!(of(angle(&|k| gyro[k], 0.05)), "{seed}");
            assert!(!of(angle(&motion, 0.0)) && !of(count(angle(&motion, 0.0), 1.5e-3)), "{seed}");
            // A gyro in °/s beside an angle in rad: its noise only seems large.
            let degrees: Vec<f64> = gyro.iter().map(|rate| rate.to_degrees()).collect();
            let of = |values: Vec<f64>| follows_the_walk(&readings(degrees.clone()), &readings(values));
            assert!(!of(count(angle(&motion, 0.0), 1.5e-3)), "{seed}");
            assert!(of(count(angle(&|k| gyro[k], 0.0), 1e-4)), "{seed}");
        }
    }

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
            let of = |values: Vec<f64>| pulled(&readings(gyro.clone()), &readings(values));
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
