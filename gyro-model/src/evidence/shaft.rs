//! Where the shaft was, as far as gyro and reference tell together: the gyro's shape on the reference's level.

use super::{integrate::smooth, series::Series};
use crate::{effects::white_noise, nls};
use std::ops::Range;

/// Half width of the window over which an angle is held to the reference's level, s: long enough that the reference's
/// own errors do not come in.
pub(super) const LEVEL: f64 = 8.0;

/// The half width at which the gyro's walk and the mean of the encoder's steps err alike, s.
pub(super) fn nearness(s: &Series) -> Option<f64> {
    (s.encoder.step > 0.0 && s.margin > 0.0).then(|| (s.encoder.step / s.margin).clamp(0.1, LEVEL))
}

/// An integrated angle held to the level of the reference over ±`half` s, on each stretch between what is lost to its own; where the
/// reference is `silent` (empty: nowhere), to what it said before and after.
pub(super) fn best_angle(
    s: &Series,
    reference: &[f64],
    silent: &[bool],
    angle: &[f64],
    lost: &[bool],
    half: f64,
) -> Vec<f64> {
    if reference.is_empty() {
        return angle.to_vec();
    }
    let rows = s.reference_rows.iter().zip(reference);
    let mut error: Vec<f64> = rows.map(|(&k, r)| angle[k] - r).collect();
    let levels = stretch_levels(s, angle, lost, &error);
    error.iter_mut().zip(&levels).for_each(|(error, level)| *error -= level);
    if silent.contains(&true) {
        let (t, said): (Vec<f64>, Vec<f64>) =
            (0..error.len()).filter(|&i| !silent[i]).map(|i| (s.reference_t[i], error[i])).unzip();
        let mut hint = 0;
        if said.len() > 1 {
            error = s.reference_t.iter().map(|&at| linear(&t, &said, at, &mut hint)).collect();
        }
    }
    let mut level = smooth(&s.reference_t, &error, half);
    level.iter_mut().zip(&levels).for_each(|(level, own)| *level += own);
    let mut hint = 0;
    angle.iter().zip(&s.t).map(|(a, &t)| a - linear(&s.reference_t, &level, t, &mut hint)).collect()
}

/// What an angle's `error` at the reference's rows has of a level for each stretch between what is lost, and of a scale and a bias
/// for all: e = c_stretch + a θ + b t, by least squares. How far the shaft turned in between, one reading on either side would
/// tell no better than to a step. Nothing where nothing is lost.
fn stretch_levels(s: &Series, angle: &[f64], lost: &[bool], error: &[f64]) -> Vec<f64> {
    let mut levels = vec![0.0; error.len()];
    let is_cut = |i: usize| lost[s.reference_rows[i - 1]..=s.reference_rows[i]].contains(&true);
    let mut edges: Vec<usize> = (1..error.len()).filter(|&i| is_cut(i)).collect();
    if edges.is_empty() {
        return levels;
    }
    edges.insert(0, 0);
    edges.push(error.len());
    let stretches: Vec<Range<usize>> = edges.windows(2).map(|edge| edge[0]..edge[1]).collect();
    let columns: [Vec<f64>; 2] =
        [s.reference_rows.iter().map(|&k| angle[k]).collect(), s.reference_t.iter().map(|t| t - s.t[0]).collect()];
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let about_its_mean = |values: &[f64]| -> Vec<f64> {
        let each = |stretch: &Range<usize>| {
            let mean = mean(&values[stretch.clone()]);
            values[stretch.clone()].iter().map(move |v| v - mean).collect::<Vec<_>>()
        };
        stretches.iter().flat_map(each).collect()
    };
    let [turned, passed] = [0, 1].map(|k| about_its_mean(&columns[k]));
    let mut normal = nls::Normal::zeros(2);
    normal.add(&about_its_mean(error), &[&turned, &passed]);
    let (_, step) = normal.rise(1e-8);
    for stretch in stretches {
        for i in stretch.clone() {
            levels[i] = -(step[0] * columns[0][i] + step[1] * columns[1][i]);
        }
        let own = mean(&error[stretch.clone()]) - mean(&levels[stretch.clone()]);
        levels[stretch].iter_mut().for_each(|level| *level += own);
    }
    levels
}

/// Lets an angle stand where the sensor rests: what it wanders there is the gyro's noise, which no play takes up and no tooth
/// passes.
pub(super) fn stand(t: &[f64], rate: &[f64], angle: &mut [f64]) {
    let white = white_noise(rate);
    let rows = (RESTS * (t.len() - 1) as f64 / (t[t.len() - 1] - t[0])).ceil().max(4.0) as usize;
    let rests = |part: &[f64]| {
        let n = part.len() as f64;
        let mean = part.iter().sum::<f64>() / n;
        let spread = part.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        part.len() == rows && mean.abs() < STANDS * white / n.sqrt() && spread < NO_MORE * white * white
    };
    let still: Vec<bool> = rate.chunks(rows).map(rests).collect();
    let mut first = 0;
    for run in still.chunk_by(|a, b| a == b) {
        let part = first * rows..((first + run.len()) * rows).min(angle.len());
        first += run.len();
        if run[0] {
            let part = &mut angle[part];
            let mean = part.iter().sum::<f64>() / part.len() as f64;
            part.fill(mean);
        }
    }
}

/// What a sensor rests for at least, s, and the standard deviations of its mean rate, and times the variance of its noise, that
/// it shows meanwhile at most.
const RESTS: f64 = 0.25;
const STANDS: f64 = 4.0;
const NO_MORE: f64 = 2.0;

/// Linear interpolation, held at the ends.
fn linear(t: &[f64], y: &[f64], x: f64, hint: &mut usize) -> f64 {
    let n = t.len();
    let mut k = (*hint).min(n - 2);
    while k + 2 < n && t[k + 1] <= x {
        k += 1;
    }
    *hint = k;
    let w = ((x - t[k]) / (t[k + 1] - t[k])).clamp(0.0, 1.0);
    y[k] + w * (y[k + 1] - y[k])
}

/// Where a shaft turned round about a sample, to the parabola through it and its neighbours.
pub(super) fn turning_point(angle: &[f64], k: usize) -> Option<f64> {
    let [before, here, after] = [angle.get(k.checked_sub(1)?)?, &angle[k], angle.get(k + 1)?];
    let turns = (here - before) * (after - here) < 0.0;
    turns.then(|| here - (after - before).powi(2) / (8.0 * (after - 2.0 * here + before)))
}
