//! The noise of the angle that a shaft encoder counts, beside its steps.

use super::{
    encoder::Encoder,
    gain::gain,
    incoherent::incoherent,
    integrate::{integral, smooth},
    rough::{POOR, Spread, TENTH, evenly, median_apart, stretches, walked, windows},
};
use crate::{effects::sixth_differences, parallel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Standard deviation of the angle that an encoder counts about the shaft's, rad, where the shaft turns by a count a row or more:
/// such that the sixth differences of what the gyro, vibrations taken out, does not know of its angle are those of the
/// errors that its steps make of so noisy an angle, and of the noise of the readings. 0 where it is too little to tell. `shaft`
/// is times and values, `gyro` times and what gives the values without vibrations, `rows` where in these the former stand.
#[must_use]
pub(super) fn encoder_noise<'a>(
    encoder: &Encoder,
    shaft: (&[f64], &[f64]),
    gyro: (&[f64], impl FnOnce() -> &'a [f64]),
    rows: &[usize],
) -> f64 {
    let ((t, angle), step) = (shaft, encoder.step);
    if step <= 0.0 || encoder.distinct(angle).1 > RETURNS {
        return 0.0;
    }
    let readings = gyro.1();
    let whole = integral(gyro.0, readings);
    let turned: Vec<f64> = rows.iter().map(|&k| whole[k]).collect();
    let alpha = gain(t, &turned, angle);
    let less: Vec<f64> = angle.iter().zip(&turned).map(|(r, own)| r - alpha * own).collect();
    let seen: Vec<f64> = windows(&incoherent((gyro.0, readings), &whole, rows, angle)).collect();
    // Where the shaft was: under a motion that repeats itself it matters where an encoder counts from.
    let shaft: Vec<f64> =
        turned.iter().zip(smooth(t, &less, LEVEL)).map(|(turned, level)| alpha * turned + level).collect();
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let normal: Vec<f64> = turned.iter().map(|_| StandardNormal.sample(&mut random)).collect();
    let made_from = |zero: u32, noise: f64| -> Vec<f64> {
        let from = step * f64::from(zero) / f64::from(ALL_ZEROS);
        let along = |i: usize| shaft[i] + from;
        let error = |i: usize| encoder.noisy_error(&along, shaft.len(), i, noise * normal[i]);
        windows(&sixth_differences(&(0..shaft.len()).map(error).collect::<Vec<_>>())).collect()
    };
    let exact = parallel::map(&(0..ALL_ZEROS).collect::<Vec<_>>(), |&zero| made_from(zero, 0.0));
    let usual = encoder.step.powi(2) / 12.0 / encoder.readings as f64;
    let moves =
        |window: usize| exact.iter().map(|made| made[window]).sum::<f64>() / f64::from(ALL_ZEROS) > MOVES * usual;
    let moving =
        |of: &[f64]| -> Vec<f64> { (0..of.len()).filter(|&window| moves(window)).map(|window| of[window]).collect() };
    let mean_of = |made: &[f64]| Spread::of(moving(made)).mean;
    let mut seen = moving(&seen);
    if seen.len() < ENOUGH {
        return 0.0;
    }
    seen.sort_by(f64::total_cmp);
    let quiet = seen[seen.len() / 10] / TENTH;
    let count = seen.len() as f64;
    let mean = seen.iter().sum::<f64>() / count;
    let error = (seen.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count / count).sqrt();
    let own = Spread::of(seen);
    // What is here and not there is no noise: jerks that gyro and encoder see each in its own way.
    if own.mean > EVEN * quiet {
        return 0.0;
    }
    let apart = median_apart(gyro.0);
    let read = Spread::of(stretches(&evenly(gyro.0, readings, apart)));
    // Where the motion never rests the two see it at other times, and no noise of either is known.
    if read.quiet > POOR.powi(2) / apart {
        return 0.0;
    }
    let read = if read.uneven() { read.quiet } else { read.mean };
    let wanted = own.mean - (alpha * apart).powi(2) * read * walked(median_apart(t) / apart);
    let exact: Vec<f64> = exact.iter().map(|made| mean_of(made)).collect();
    // Where a motion repeats itself one zero makes much more of the same errors than another.
    if wanted < exact.iter().copied().fold(0.0, f64::max) + TELLING * error {
        return 0.0;
    }
    let mean_made =
        |noise: f64| (0..ZEROS).map(|zero| mean_of(&made_from(zero, noise))).sum::<f64>() / f64::from(ZEROS);
    let mut before = (0.0, exact.iter().sum::<f64>() / f64::from(ZEROS));
    for noise in TRIED.map(|counts| counts * step) {
        let next = (noise, mean_made(noise));
        if next.1 > wanted {
            // Between two of them the variance goes about evenly with that of the angle.
            let share = ((wanted - before.1) / (next.1 - before.1)).clamp(0.0, 1.0);
            return (before.0 * before.0 + share * (noise * noise - before.0 * before.0)).sqrt();
        }
        before = next;
    }
    (before.0 * before.0 + wanted - before.1).max(0.0).sqrt()
}

/// Times more counts than it is seen at that a motion would have come to which did not repeat itself exactly: noise would have
/// brought this one to others.
const RETURNS: f64 = 6.0;
/// Half width of the window over which the gyro's angle is held to the encoder's, s: it walks by less than a count meanwhile.
const LEVEL: f64 = 2.0;
/// Share of the variance that an encoder's steps make that is moved through.
const MOVES: f64 = 0.5;

/// Times what the quietest stretches say that noise which is everywhere the same may be in the mean.
const EVEN: f64 = 1.5;
/// Stretches of the log that the noise of an encoder is told from, and the standard errors of their mean that it has to show by.
const ENOUGH: usize = 10;
const TELLING: f64 = 4.0;
/// Noises that are tried, counts; of more, steps only add their own.
const TRIED: [f64; 5] = [0.1, 0.2, 0.3, 0.5, 1.0];

/// Places of an encoder's zero that its errors are the mean of, and those that it may stand at.
pub(super) const ZEROS: u32 = 4;
const ALL_ZEROS: u32 = 16;
