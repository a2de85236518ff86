//! What of a reference's angle a gyro knows nothing of, whatever its errors.
//!
//! A reference that comes seldom holds motion in its own sixth differences, and those of the reference less the gyro's angle
//! hold what physics makes of that motion: a gyro that is late by d is off by d ω, much more than an encoder's noise. So all
//! that the gyro's errors, its lateness and the encoder's gear make at a fast motion's time scale is fitted to the reference
//! in sixth differences, freely, and what is left is what neither knows of the other: noise.

use super::integrate::integral;
use crate::{
    effects::{derivative, sixth_differences, steadied, within},
    nls::Normal,
};
use std::borrow::Cow;

/// Sixth differences of the reference at `rows` of the gyro's samples less the nearest combination of those that the readings
/// make, over the freedom that is left to them. `turned` is the angle that the readings add up to.
pub(super) fn incoherent(gyro: (&[f64], &[f64]), turned: &[f64], rows: &[usize], reference: &[f64]) -> Vec<f64> {
    let mut left = sixth_differences(reference);
    let count = left.len();
    let at_rows = |made: Vec<f64>| sixth_differences(&rows.iter().map(|&k| made[k]).collect::<Vec<_>>());
    let columns: Vec<Vec<f64>> = made(gyro, turned.to_vec()).take((count / ENOUGH).max(1)).map(at_rows).collect();
    let known: Vec<usize> =
        (0..count).filter(|&i| left[i].is_finite() && columns.iter().all(|column| column[i].is_finite())).collect();
    if known.len() <= columns.len() {
        return left;
    }
    let all_known = known.len() == count;
    let pick = |values: &[f64]| -> Vec<f64> { known.iter().map(|&i| values[i]).collect() };
    let picked: Vec<Cow<[f64]>> =
        columns.iter().map(|column| if all_known { column.into() } else { pick(column).into() }).collect();
    let mut normal = Normal::zeros(columns.len());
    normal.add(&pick(&left), &picked.iter().map(AsRef::as_ref).collect::<Vec<_>>());
    let step = normal.step_from(&normal, 1e-10);
    let freedom = (known.len() as f64 / (known.len() - columns.len()) as f64).sqrt();
    for (i, left) in left.iter_mut().enumerate() {
        *left = freedom * (*left + columns.iter().zip(&step).map(|(column, step)| step * column[i]).sum::<f64>());
    }
    left
}

/// What the readings make of an angle, at their times, the largest first, one after the other: a scale, and a bias where references
/// come unevenly; a gyro's lateness and what a lag makes beyond that; plays; asymmetry, quadratic and cubic nonlinearity; a scale and
/// a lateness that change with time; a hysteresis.
pub(crate) fn made<'a>(
    (t, rate): (&'a [f64], &[f64]),
    mut turned: Vec<f64>,
) -> impl Iterator<Item = Vec<f64>> + use<'a> {
    let slow = steadied(t, rate);
    let mean = slow.iter().sum::<f64>() / slow.len() as f64;
    let slow: Vec<f64> = slow.iter().map(|rate| rate - mean).collect();
    let change = derivative(t, &slow);
    let span = t[t.len() - 1] - t[0];
    let of = move |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..t.len()).map(f).collect() };
    let ago = move |k: usize| (t[k] - t[0]) / span;
    let angle = integral(t, &slow);
    let play = move |width: f64| -> Vec<f64> {
        let follow = |gear: &mut f64, angle: &f64| {
            *gear = within(*gear, angle - 0.5 * width, angle + 0.5 * width);
            Some(*gear - angle)
        };
        angle.iter().scan(angle[0], follow).collect()
    };
    (0..MADE).map(move |column| match column {
        0 => std::mem::take(&mut turned),
        1 => of(&|k| t[k] - t[0]),
        2 => slow.clone(),
        RESPONSE => change.clone(),
        4 => of(&|k| slow[k].signum()),
        5..9 => play(PLAYS[column - 5]),
        9 => integral(t, &of(&|k| slow[k].abs())),
        10 => integral(t, &of(&|k| slow[k].powi(2))),
        11 => integral(t, &of(&|k| slow[k].powi(3))),
        12 => integral(t, &of(&|k| ago(k) * slow[k])),
        13 => of(&|k| ago(k) * slow[k]),
        _ => integral(t, &of(&|k| change[k].signum())),
    })
}

/// How many these are, and which of them a slow response makes.
const MADE: usize = 15;
pub(crate) const RESPONSE: usize = 3;
/// Widths of a gear's play, rad: what one of any width makes lies between those of two.
const PLAYS: [f64; 4] = [0.003, 0.006, 0.012, 0.024];
/// Differences for each of those from which on there are enough.
const ENOUGH: usize = 20;
