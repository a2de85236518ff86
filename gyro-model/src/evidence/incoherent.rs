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

/// Sixth differences of the reference at `rows` of the gyro's samples less the nearest combination of those that the readings
/// make, over the freedom that is left to them. `turned` is the angle that the readings add up to.
pub(super) fn incoherent(gyro: (&[f64], &[f64]), turned: &[f64], rows: &[usize], reference: &[f64]) -> Vec<f64> {
    let mut left = sixth_differences(reference);
    let count = left.len();
    let at_rows = |made: Vec<f64>| sixth_differences(&rows.iter().map(|&k| made[k]).collect::<Vec<_>>());
    let made = made(gyro, turned).into_iter().take((count / ENOUGH).max(1));
    let columns: Vec<Vec<f64>> = made.map(at_rows).collect();
    let known: Vec<usize> =
        (0..count).filter(|&i| left[i].is_finite() && columns.iter().all(|column| column[i].is_finite())).collect();
    if known.len() <= columns.len() {
        return left;
    }
    let pick = |values: &[f64]| -> Vec<f64> { known.iter().map(|&i| values[i]).collect() };
    let picked: Vec<Vec<f64>> = columns.iter().map(|column| pick(column)).collect();
    let mut normal = Normal::zeros(columns.len());
    normal.add(&pick(&left), &picked.iter().map(Vec::as_slice).collect::<Vec<_>>());
    let step = normal.step_from(&normal, 1e-10);
    let freedom = (known.len() as f64 / (known.len() - columns.len()) as f64).sqrt();
    for (i, left) in left.iter_mut().enumerate() {
        *left = freedom * (*left + columns.iter().zip(&step).map(|(column, step)| step * column[i]).sum::<f64>());
    }
    left
}

/// What the readings make of an angle, at their times, the largest first: a scale, and a bias where references come unevenly; a
/// gyro's lateness and what a lag makes beyond that; plays; asymmetry, quadratic and cubic nonlinearity; a scale and a
/// lateness that change with time; a hysteresis.
pub(crate) fn made((t, rate): (&[f64], &[f64]), turned: &[f64]) -> Vec<Vec<f64>> {
    let slow = steadied(t, rate);
    let mean = slow.iter().sum::<f64>() / slow.len() as f64;
    let slow: Vec<f64> = slow.iter().map(|rate| rate - mean).collect();
    let change = derivative(t, &slow);
    let span = t[t.len() - 1] - t[0];
    let of = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..t.len()).map(f).collect() };
    let ago = |k: usize| (t[k] - t[0]) / span;
    let angle = integral(t, &slow);
    let play = |width: f64| -> Vec<f64> {
        let follow = |gear: &mut f64, angle: &f64| {
            *gear = within(*gear, angle - 0.5 * width, angle + 0.5 * width);
            Some(*gear - angle)
        };
        angle.iter().scan(angle[0], follow).collect()
    };
    let mut all = vec![turned.to_vec(), of(&|k| t[k] - t[0]), slow.clone(), change.clone(), of(&|k| slow[k].signum())];
    all.extend(PLAYS.map(play));
    all.extend([
        integral(t, &of(&|k| slow[k].abs())),
        integral(t, &of(&|k| slow[k].powi(2))),
        integral(t, &of(&|k| slow[k].powi(3))),
        integral(t, &of(&|k| ago(k) * slow[k])),
        of(&|k| ago(k) * slow[k]),
        integral(t, &of(&|k| change[k].signum())),
    ]);
    all
}

/// Widths of a gear's play, rad: what one of any width makes lies between those of two.
const PLAYS: [f64; 4] = [0.003, 0.006, 0.012, 0.024];
/// Differences for each of those from which on there are enough.
const ENOUGH: usize = 20;
