//! Whether a reference goes along with the random walk of the gyro's integral.
//!
//! Over a time T the gyro's noise adds up to a walk N√T, which an independent reference does not follow: second differences of the
//! reference's angle less the gyro's have a variance of 2N²T at least. Where it is much less, for any T, the walk is in the reference too.
//!
//! Roll and pitch of a filter that has an accelerometer beside the gyro are that integral, pulled to the direction φ of gravity with a gain
//! k₁ and, where the filter has a state for the gyro's bias, k₂ (Mahony, Hamel and Pflimlin 2008; a Kalman filter in its steady state):
//!
//! ```text
//! y = κ∫(g − β) + k₁ ∫(φ − y) + k₂ ∫∫(φ − y)
//! ```
//!
//! Of an attitude φ − y is e = a/|a| × Rᵀu with u the world's vertical; a filter of fixed step (Madgwick 2011) has e over the length of its
//! gradient in its place. With φ of the logged accelerations, or of a free channel, these integrals are columns of the same test. A reference
//! that is the sum of a column and of what the gyro shows (the column may be its own copy, its rate, its error) is no filter's: κ has to be what
//! it is without the columns, and ∫y to pull back as much as ∫φ pulls.

use super::{
    super::{
        channel::{Readings, unwrap},
        thresholds::OWN_WALK,
        witness::integral,
    },
    ENOUGH,
};
use crate::{Axis, Record, Row, effects::white_noise, nls::Normal};
use nalgebra::{UnitQuaternion, Vector3};
use std::{
    cell::LazyCell,
    f64::consts::{PI, TAU},
};

/// The walk is looked for over times from so many rows on, up to this share of the log.
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

/// Share of the log, 1 of so many, after which a filter's gains have settled.
const SETTLED: usize = 4;
/// Columns that are made of the gyro's readings.
const OF_GYRO: usize = 3;
/// Columns fewer than windows that are enough to tell a quarter of a variance from all of it.
const FREE: usize = 16;
/// Factor within which the two pulls of a filter are alike, and its scale with them and without.
const ALIKE: f64 = 2.0;
/// Units that a free channel may have an angle in, rad.
const UNITS: [f64; 2] = [1.0, PI / 180.0];

/// The same readings as a program has them that takes all of its steps for alike.
pub(super) fn even(gyro: &Readings) -> Readings {
    let (first, steps) = (gyro.t.first().copied().unwrap_or(0.0), gyro.t.len().saturating_sub(1).max(1) as f64);
    let step = (gyro.t.last().copied().unwrap_or(first) - first) / steps;
    Readings { t: (0..gyro.t.len()).map(|k| first + k as f64 * step).collect(), ..gyro.clone() }
}

/// Whether an angle goes along with the random walk of the gyro's integral, for any time up to a twelfth of the log.
pub(super) fn follows(gyro: &Readings, reference: &Readings) -> bool {
    follows_beside(gyro, reference, &[], |_| true)
}

/// The same beside `pulls`, columns of what else the angle may be made of, where a filter may have their coefficients.
fn follows_beside(
    gyro: &Readings,
    reference: &Readings,
    pulls: &[Vec<f64>],
    is_filter: impl Fn(&[f64]) -> bool,
) -> bool {
    let n = gyro.values.len().min(ENOUGH);
    if n < 1000 || reference.values.len() < n || gyro.rows[..n] != reference.rows[..n] {
        return false;
    }
    let gyro_walk = LazyCell::new(|| random_walk(gyro));
    let (t, g) = (&gyro.t[..n], &gyro.values[..n]);
    let (turned, shown) = (integral(t, g), &reference.values[..n]);
    // A filter's gains settle.
    let begins = if pulls.is_empty() { 0 } else { n / SETTLED };
    // Scale, lateness and lag of what was made of the readings.
    let change = (0..n).map(|k| g[(k + 1).min(n - 1)] - g[k.saturating_sub(1)]).collect();
    let mut columns = vec![turned, g.to_vec(), change];
    columns.extend(pulls.iter().map(|of| of[..n].to_vec()));
    let times = std::iter::successors(Some(FIRST), |rows| Some(2 * rows)).take_while(|rows| rows * LAST < n);
    let least = times.filter_map(|rows| {
        let places: Vec<usize> = (begins + rows..n - rows).step_by((rows / 2).max(1)).collect();
        let free = places.len().saturating_sub(columns.len());
        let bent =
            |of: &[f64]| -> Vec<f64> { places.iter().map(|&k| of[k + rows] - 2.0 * of[k] + of[k - rows]).collect() };
        let bent_columns: Vec<Vec<f64>> = columns.iter().map(|of| bent(of)).collect();
        let mut normal = Normal::zeros(columns.len());
        normal.add(&bent(shown), &bent_columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
        // shown + X step is least: the coefficients of X are −step.
        let step = normal.step_from(&normal, 1e-12);
        let coefficients: Vec<f64> = step.iter().map(|step| -step).collect();
        let alone = normal.part(0..OF_GYRO);
        let alone = -alone.step_from(&alone, 1e-12)[0];
        let left = normal.cost_after(&step).max(0.0) / free as f64;
        let time = (t[n - 1] - t[0]) / (n - 1) as f64 * rows as f64;
        let may_be = free >= FREE && is_alike(coefficients[0], alone) && is_filter(&coefficients[OF_GYRO..]);
        may_be.then(|| {
            // In the reference's unit, which may be another one than the gyro's.
            let walk = coefficients[0].abs().min(alone.abs()) * *gyro_walk;
            left / (2.0 * walk * walk * time).max(f64::MIN_POSITIVE)
        })
    });
    let least = least.fold(f64::INFINITY, f64::min);
    least < OWN_WALK && *gyro_walk > 0.0
}

/// Whether two coefficients have one sign, and a size alike.
fn is_alike(a: f64, b: f64) -> bool {
    (1.0 / ALIKE..=ALIKE).contains(&(a / b))
}

/// Σ x Δt up to each row, with the value of this row or of the one before.
fn sum(t: &[f64], of: &[f64], earlier: usize) -> Vec<f64> {
    let mut sum = 0.0;
    (0..t.len())
        .map(|k| {
            sum += of[k.saturating_sub(earlier)] * (t[k] - t[k.saturating_sub(1)]);
            sum
        })
        .collect()
}

/// What an angle of this axis is pulled to, if it is the gyro's integral: the angle of the accelerations about it, or a free channel.
pub(super) fn pulled_to(record: &Record, axis: Axis, gyro: &Readings, reference: &Readings) -> Option<String> {
    let n = gyro.rows.len().min(ENOUGH);
    if reference.values.len() < n {
        return None;
    }
    let (rows, t, shown) = (&gyro.rows[..n], &gyro.t[..n], &reference.values[..n]);
    let of_rows = |of: &dyn Fn(&Row) -> f64| rows.iter().map(|&row| of(&record.rows[row])).collect::<Vec<f64>>();
    let [i, j, k] = [0, 1, 2].map(|other| (axis.index() + other) % 3);
    let mut about = of_rows(&|row| row.accel[j].atan2(row.accel[k]));
    unwrap(&mut about, TAU);
    let tilt = |of: usize, others: [usize; 2]| {
        of_rows(&|row| row.accel[of].atan2(row.accel[others[0]].hypot(row.accel[others[1]])))
    };
    let gravity = [about, tilt(j, [k, i]), tilt(k, [i, j])].map(|of| ("the angle of gravity".to_owned(), of));
    let free = record.free_names.iter().enumerate().map(|(c, name)| (name.clone(), of_rows(&|row| row.free[c])));
    let back = integral(t, shown);
    let is_pulled = |to: &[f64], earlier: usize| {
        let forth = sum(t, to, earlier);
        let pulls = [forth.clone(), back.clone(), integral(t, &forth), integral(t, &back)];
        // An angle to the left or to the right, in its unit.
        let is_filter = |of: &[f64]| of[1] < 0.0 && UNITS.iter().any(|unit| is_alike(of[0].abs(), -of[1] * unit));
        follows_beside(gyro, reference, &pulls, is_filter)
    };
    let mut all = gravity.into_iter().chain(free).filter(|(_, of)| of.iter().all(|value| value.is_finite()));
    all.find(|(_, of)| (0..2).any(|earlier| is_pulled(of, earlier))).map(|(name, _)| name)
}

/// What a reference orientation has turned about an axis of the body, added up over as many readings as are enough.
pub(super) fn turned(record: &Record, axis: Axis) -> Option<Readings> {
    let has = |k: &usize| record.rows[*k].attitude().is_some();
    let rows: Vec<usize> = (0..record.len()).filter(has).take(ENOUGH).collect();
    let mut before = record.rows[*rows.first()?].attitude()?;
    let mut sum = 0.0;
    let values = rows.iter().filter_map(|&k| {
        let now = record.rows[k].attitude()?;
        sum += (std::mem::replace(&mut before, now).inverse() * now).scaled_axis()[axis.index()];
        Some(sum)
    });
    Some(Readings {
        values: values.collect(),
        t: rows.iter().map(|&k| record.rows[k].t_ns as f64 * 1e-9).collect(),
        rows,
    })
}

/// Whether an orientation is the gyro's integral, pulled to the direction of gravity.
pub(super) fn is_levelled(record: &Record, axis: Axis, gyro: &Readings, turned: &Readings) -> bool {
    let n = gyro.rows.len().min(ENOUGH);
    if turned.rows.len() < n {
        return false;
    }
    let felt: Option<Vec<(UnitQuaternion<f64>, Vector3<f64>)>> = gyro.rows[..n]
        .iter()
        .map(|&row| {
            let row = &record.rows[row];
            let force = Vector3::from(row.accel).try_normalize(1e-3).filter(|of| of.iter().all(|x| x.is_finite()))?;
            Some((row.attitude()?, force))
        })
        .collect();
    let Some(felt) = felt else { return false };
    // A filter has one of its axes upright.
    let up = felt.iter().map(|(attitude, force)| attitude * force).sum::<Vector3<f64>>();
    let up = Vector3::from_fn(|i, _| if i == up.iamax() { up[i].signum() } else { 0.0 });
    // The attitude before is what a filter corrects.
    let vertical = |k: usize| felt[k.saturating_sub(1)].0.inverse() * up;
    let error = |k: usize| felt[k].1.cross(&vertical(k))[axis.index()];
    let proportional: Vec<f64> = (0..felt.len()).map(error).collect();
    let fixed = |k: usize| {
        let (force, down) = (felt[k].1, vertical(k));
        error(k) / force.cross(&down).norm().hypot((down - force).dot(&(down - up))).max(1e-9)
    };
    let fixed: Vec<f64> = (0..felt.len()).map(fixed).collect();
    let once = sum(&gyro.t[..n], &proportional, 0);
    let pulls = [integral(&gyro.t[..n], &once), once, proportional, sum(&gyro.t[..n], &fixed, 0), fixed];
    follows_beside(gyro, turned, &pulls, |_| true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::channel::Channel;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

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
            let of = |values: Vec<f64>| follows(&Readings::at_100_hz(gyro.clone()), &Readings::at_100_hz(values));
            assert!(of(count(angle(&|k| gyro[k], 0.0), 1e-4)), "{seed}");
            assert!(of(angle(&|k| gyro[k], 0.05)), "{seed}");
            assert!(!of(angle(&motion, 0.0)) && !of(count(angle(&motion, 0.0), 1.5e-3)), "{seed}");
            // A gyro in °/s beside an angle in rad: its noise only seems large.
            let degrees: Vec<f64> = gyro.iter().map(|rate| rate.to_degrees()).collect();
            let of = |values: Vec<f64>| follows(&Readings::at_100_hz(degrees.clone()), &Readings::at_100_hz(values));
            assert!(!of(count(angle(&motion, 0.0), 1.5e-3)), "{seed}");
            assert!(of(count(angle(&|k| gyro[k], 0.0), 1e-4)), "{seed}");
        }
    }

    fn gravity(tilt: f64) -> [f64; 3] {
        [-9.81 * tilt.sin(), 0.2, 9.81 * tilt.cos()]
    }

    #[test]
    fn the_pitch_of_a_filter_is_pulled_to_gravity_and_an_encoder_beside_an_accelerometer_is_not() {
        let tilt = |t: f64| 0.4 * (0.7 * t).sin() + 0.15 * (2.9 * t).sin();
        let rate = |t: f64| 0.28 * (0.7 * t).cos() + 0.435 * (2.9 * t).cos();
        for seed in 0..3 {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut white = || -> f64 { StandardNormal.sample(&mut random) };
            let mut rows: Vec<Row> = (0..12_000)
                .map(|k| {
                    let t = f64::from(k) * 0.01;
                    let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
                    row.gyro[1] = 1.02 * rate(t) + 0.02 + 1e-3 * white();
                    row.accel = gravity(tilt(t)).map(|a| a + 0.3 * white());
                    row
                })
                .collect();
            let pitch = |row: &Row| (-row.accel[0]).atan2(row.accel[1].hypot(row.accel[2]));
            // The gains of a filter, of its state for the bias, and digits.
            let mut verdict = |[gain, bias_gain]: [f64; 2], step: f64| {
                let (mut y, mut bias) = (0.0, 0.0);
                for row in &mut rows {
                    let off = pitch(row) - (y + 0.01 * (row.gyro[1] - bias));
                    y += 0.01 * (row.gyro[1] - bias) + gain * off;
                    bias -= bias_gain * off;
                    row.ref_angle[1] = (y / step).round() * step;
                }
                let record = Record { rows: rows.clone(), ..Record::default() };
                let [gyro, reference] =
                    [Channel::Gyro(Axis::Y), Channel::Angle(Axis::Y)].map(|channel| Readings::of(&record, channel));
                pulled_to(&record, Axis::Y, &gyro, &reference)
            };
            for gains in [[0.02, 0.0], [0.004, 0.0], [0.03, 0.002]] {
                assert!(verdict(gains, 1.75e-4).is_some(), "{seed} {gains:?}");
            }
            for (row, t) in rows.iter_mut().zip(0..).map(|(row, k)| (row, f64::from(k) * 0.01)) {
                row.ref_angle[1] = (tilt(t) / 1.5e-3).round() * 1.5e-3;
            }
            let record = Record { rows, ..Record::default() };
            let [gyro, reference] =
                [Channel::Gyro(Axis::Y), Channel::Angle(Axis::Y)].map(|channel| Readings::of(&record, channel));
            assert_eq!(pulled_to(&record, Axis::Y, &gyro, &reference), None, "{seed}");
            // A channel that has the encoder in it: its copy, its rate, what the gyro misses of it.
            let integral = integral(&gyro.t, &gyro.values);
            let rate = |k: usize| reference.values[(k + 1).min(11_999)] - reference.values[k.saturating_sub(1)];
            let traps: [&dyn Fn(usize) -> f64; 4] =
                [&|k| reference.values[k], &|k| reference.values[k] * 651.9, &rate, &|k| {
                    reference.values[k] - integral[k]
                }];
            for (number, trap) in traps.iter().enumerate() {
                let mut trapped = Record { free_names: vec!["aux".to_owned()], ..record.clone() };
                for (k, row) in trapped.rows.iter_mut().enumerate() {
                    row.free[0] = trap(k);
                }
                assert_eq!(pulled_to(&trapped, Axis::Y, &gyro, &reference), None, "{seed} trap {number}");
            }
        }
    }

    #[test]
    fn the_attitude_of_a_filter_is_levelled_by_gravity_and_one_of_cameras_is_not() {
        let omega = |t: f64| Vector3::new(0.5 * (0.9 * t).sin(), 0.4 * (1.7 * t).cos(), 0.6 * (0.5 * t).sin());
        for (gain, fixed) in [(0.5, 0.0), (2.0, 0.0), (0.0, 0.1), (0.0, 0.0)] {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
            let mut white = || -> f64 { StandardNormal.sample(&mut random) };
            let mut noise = |size: f64| Vector3::from_fn(|_, _| size * white());
            let (mut truth, mut own) = (UnitQuaternion::identity(), UnitQuaternion::identity());
            let rows = (0..9000).map(|k| {
                let t = f64::from(k) * 0.01;
                truth *= UnitQuaternion::from_scaled_axis(omega(t) * 0.01);
                let gyro = omega(t) * 1.01 + Vector3::new(0.01, -0.01, 0.005) + noise(2e-3);
                let accel = truth.inverse() * Vector3::new(0.4 * t.sin(), 0.0, 9.81) + noise(0.2);
                let (force, down) = (accel.normalize(), own.inverse() * Vector3::z());
                let error = force.cross(&down);
                let length = error.norm().hypot((down - force).dot(&(down - Vector3::z())));
                own *=
                    UnitQuaternion::from_scaled_axis((gyro + gain * error + fixed * error / length.max(1e-9)) * 0.01);
                let seen = if gain + fixed > 0.0 { own } else { truth * UnitQuaternion::from_scaled_axis(noise(1e-3)) };
                Row {
                    t_ns: i64::from(k) * 10_000_000,
                    gyro: gyro.into(),
                    accel: accel.into(),
                    ref_quaternion: [seen.w, seen.i, seen.j, seen.k],
                    ..Row::EMPTY
                }
            });
            let record = Record { rows: rows.collect(), ..Record::default() };
            for axis in Axis::ALL {
                let (gyro, turned) = (Readings::of(&record, Channel::Gyro(axis)), turned(&record, axis).unwrap());
                assert_eq!(is_levelled(&record, axis, &gyro, &turned), gain + fixed > 0.0, "{gain} {fixed} {axis}");
            }
        }
    }
}
