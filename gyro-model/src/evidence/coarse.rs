//! A temperature that is read in coarse steps: a degree, say, while what it drives goes on smoothly.
//!
//! Where a reading changes from one value to the next, the temperature is known: it lies at the edge between the two. A smooth curve
//! through those instants stands for it. As it is read it would be off by up to half a step everywhere, and an effect that goes by it would
//! leave a staircase that a gyro at rest shows at once.

use super::integrate::{hermite, three_point_slopes};
use crate::order::median;

/// Rows without a change, in the mean, from which on a reading is coarse: a finer or a noisy one is used as it is.
const UNCHANGED: usize = 8;
/// Changes that are needed.
const CHANGES: usize = 3;
/// Share of the changes, 1, that have to be of one step.
const OF_ONE_STEP: f64 = 0.9;
/// A change of fewer steps than this is of one step.
const ONE_STEP: f64 = 1.5;
/// An edge that is passed again within this share of the usual time from one edge to the next is passed by noise of the reading: one
/// instant.
const AGAIN: f64 = 0.5;

/// The values between their steps; `None` where they are not in coarse steps.
pub(super) fn between_steps(t: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let changes = |values: &[f64]| (1..values.len()).filter(|&k| values[k] != values[k - 1]).collect::<Vec<usize>>();
    let sizes: Vec<f64> = changes(values).into_iter().map(|k| (values[k] - values[k - 1]).abs()).collect();
    let of_one = |step: f64| sizes.iter().filter(|&&size| size < ONE_STEP * step).count() as f64;
    let step = median(sizes.clone())?;
    if of_one(step) < OF_ONE_STEP * sizes.len() as f64 {
        return None;
    }
    let values = &without_flicker(values, step);
    let changes = changes(values);
    if changes.len() < CHANGES || changes.len() * UNCHANGED > values.len() {
        return None;
    }
    let edge = |k: usize| (0.5 * (t[k] + t[k - 1]), 0.5 * (values[k] + values[k - 1]));
    let to_another = |pair: &&[usize]| edge(pair[0]).1 != edge(pair[1]).1;
    let usual = median(changes.windows(2).filter(to_another).map(|pair| t[pair[1]] - t[pair[0]]).collect())?;
    // (t, T) where the temperature is known.
    let mut knots: Vec<(f64, f64)> = Vec::new();
    for run in changes.chunk_by(|&a, &b| edge(a).1 == edge(b).1 && edge(b).0 - edge(a).0 < AGAIN * usual) {
        let mean = run.iter().map(|&k| edge(k).0).sum::<f64>() / run.len() as f64;
        let (at, level) = (mean, edge(run[0]).1);
        if let Some(&(before, same)) = knots.last()
            && same == level
        {
            knots.push((0.5 * (before + at), values[run[0] - 1]));
        }
        knots.push((at, level));
    }
    if knots.len() < CHANGES {
        return None;
    }
    let (at, of): (Vec<f64>, Vec<f64>) = knots.into_iter().unzip();
    let slopes = three_point_slopes(&at, &of);
    let (last, mut hint) = (at.len() - 1, 0);
    let along = |(&t, &value): (&f64, &f64)| {
        let known = if t < at[0] {
            of[0] + slopes[0] * (t - at[0])
        } else if t > at[last] {
            of[last] + settles(&at, &of, t - at[last])
        } else {
            hermite(&at, &of, &slopes, t, &mut hint)
        };
        known.clamp(value - 0.5 * step, value + 0.5 * step)
    };
    Some(t.iter().zip(values).map(along).collect())
}

/// The medians of readings over a quarter of the time for which one value lasts in the mean: where noise passes an edge to and fro, they
/// pass it when the temperature does.
fn without_flicker(values: &[f64], step: f64) -> Vec<f64> {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let level = |value: f64| ((value - low) / step).round() as usize;
    let widest = (0.125 * values.len() as f64 / level(high).max(1) as f64) as usize;
    // How many of the readings in the window are at each level; of them, how many below the median.
    let mut count = vec![0; level(high) + 1];
    let (mut from, mut to, mut median, mut below) = (0, 0, 0, 0);
    let around = (0..values.len()).map(|k| {
        let half = widest.min(k).min(values.len() - 1 - k);
        while to <= k + half {
            count[level(values[to])] += 1;
            below += usize::from(level(values[to]) < median);
            to += 1;
        }
        while from < k - half {
            count[level(values[from])] -= 1;
            below -= usize::from(level(values[from]) < median);
            from += 1;
        }
        while below > half {
            median -= 1;
            below -= count[median];
        }
        while below + count[median] <= half {
            below += count[median];
            median += 1;
        }
        low + step * median as f64
    });
    around.collect()
}

/// How far the temperature goes on within a time after the last instant: exponentially if the last two slopes fall, else straight on.
fn settles(at: &[f64], of: &[f64], time: f64) -> f64 {
    let n = at.len();
    let slope = |k: usize| (of[k] - of[k - 1]) / (at[k] - at[k - 1]);
    let (before, last) = (slope(n - 2), slope(n - 1));
    let apart = 0.5 * (at[n - 1] - at[n - 3]);
    let rate = (before / last).ln() / apart;
    if !(rate.is_finite() && rate * time > 1e-6) {
        return last * time;
    }
    let now = last * (-0.5 * rate * (at[n - 1] - at[n - 2])).exp();
    now / rate * -(-rate * time).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    fn times() -> Vec<f64> {
        (0..36_000).map(|k| f64::from(k) * 0.05).collect()
    }

    /// Root mean square of what is left beside a constant.
    fn off(values: &[f64], truth: impl Fn(f64) -> f64) -> f64 {
        let apart: Vec<f64> = times().iter().zip(values).map(|(&t, v)| v - truth(t)).collect();
        let mean = apart.iter().sum::<f64>() / apart.len() as f64;
        (apart.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / apart.len() as f64).sqrt()
    }

    #[test]
    fn whole_degrees_give_the_course_between_them() {
        let heats = |t: f64| 24.0 + 20.0 * (1.0 - (-t / 400.0).exp());
        let and_cools = |t: f64| 24.3 + 22.0 * (std::f64::consts::PI * t / 1800.0).sin();
        for truth in [&heats as &dyn Fn(f64) -> f64, &and_cools] {
            for round in [f64::floor, f64::round] {
                let read: Vec<f64> = times().into_iter().map(|t| round(truth(t))).collect();
                let (coarse, smooth) = (off(&read, truth), off(&between_steps(&times(), &read).unwrap(), truth));
                assert!(smooth < 0.3 * coarse, "{smooth} of {coarse}");
            }
        }
    }

    #[test]
    fn noise_that_passes_an_edge_to_and_fro_is_one_instant() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let heats = |t: f64| 24.0 + 20.0 * (1.0 - (-t / 400.0).exp());
        for noise in [0.005, 0.02, 0.1, 0.2] {
            let noise = Normal::new(0.0, noise).unwrap();
            let read: Vec<f64> = times().into_iter().map(|t| (heats(t) + noise.sample(&mut random)).round()).collect();
            let (coarse, smooth) = (off(&read, heats), off(&between_steps(&times(), &read).unwrap(), heats));
            assert!(smooth < 0.2 * coarse, "noise of {noise:?}: {smooth} of {coarse}");
        }
    }

    #[test]
    fn a_fine_a_noisy_and_a_constant_reading_stay_as_they_are() {
        let fine: Vec<f64> = times().into_iter().map(|t| (100.0 * (24.0 + 0.1 * t)).round() / 100.0).collect();
        let noisy: Vec<f64> = (0..36_000_u32).map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 30)).collect();
        for values in [fine, noisy, vec![25.0; 36_000]] {
            assert_eq!(between_steps(&times(), &values), None);
        }
    }
}
