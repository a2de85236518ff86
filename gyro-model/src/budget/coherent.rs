//! What of an error goes with the catalogue's columns: fitted to the increments of all blocks but one, judged on that one.
//!
//! Missing physics must not pass for noise. Whatever the sensor's motion and surroundings predict of the error of a stretch
//! of the log that took no part in the prediction is physics or a mistake, named or not, and no component of noise gets it.

use crate::{
    evidence::{
        incoherent::made,
        integrate::integral,
        series::{Rest, Series},
    },
    nls::Normal,
};
use std::f64::consts::TAU;

/// An error divided.
pub(super) struct Conditioned {
    /// What is left without the columns, rad.
    pub rest: Vec<f64>,
    /// Share of the error² of each averaging time that the columns foretell.
    pub share: Vec<f64>,
}

/// Blocks that a log is cut into.
const BLOCKS: usize = 20;
/// Increments of one averaging time that are looked at, about.
const INCREMENTS: usize = 3000;

/// What becomes of the column that a slow response of either side makes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Response {
    /// It is a column like the others.
    Column,
    /// It is left to the spectra, which tell one side from the other.
    ToSpectra,
}

/// Divides the angle error at the reference's rows of one axis; `whole` is the angle there that the readings add up to.
pub(super) fn conditioned(
    s: &Series,
    whole: &[f64],
    error: &[f64],
    (tau, dt): (&[f64], f64),
    response: Response,
) -> Conditioned {
    let columns = columns(s, whole, response);
    let n = error.len();
    let block = |row: usize| row * BLOCKS / n;
    let m = columns.len();
    if m == 0 {
        return Conditioned { rest: error.to_vec(), share: vec![0.0; tau.len()] };
    }
    // The equations of each averaging time and block, each averaging time counting alike.
    let mut each: Vec<Vec<Normal>> = Vec::new();
    for tau in tau {
        let lag = ((tau / dt).round() as usize).clamp(1, n - 1);
        let stride = ((n - lag) / INCREMENTS).max(1);
        let starts: Vec<usize> = (0..n - lag).step_by(stride).collect();
        let step = |values: &[f64]| -> Vec<f64> { starts.iter().map(|&i| values[i + lag] - values[i]).collect() };
        let own = step(error);
        let mean = own.iter().map(|d| d * d).sum::<f64>().max(1e-300);
        let size = mean.sqrt().recip();
        let own: Vec<f64> = own.iter().map(|d| size * d).collect();
        let made: Vec<Vec<f64>> = columns.iter().map(|c| step(c).iter().map(|d| size * d).collect()).collect();
        let mut blocks = Vec::new();
        let mut first = 0;
        for b in 0..BLOCKS {
            let after = first + starts[first..].iter().take_while(|&&i| block(i) == b).count();
            let mut normal = Normal::zeros(m);
            normal.add(&own[first..after], &made.iter().map(|c| &c[first..after]).collect::<Vec<_>>());
            blocks.push(normal);
            first = after;
        }
        each.push(blocks);
    }
    let sum = |without: Option<usize>| {
        let mut total = Normal::zeros(m);
        for blocks in &each {
            for (b, normal) in blocks.iter().enumerate() {
                // Increments reach into the next block.
                if without.is_none_or(|out| b != out && b + 1 != out) {
                    total.merge(normal, 1.0);
                }
            }
        }
        total
    };
    let whole = sum(None);
    let all = whole.step_from(&whole, RANK);
    let without: Vec<Vec<f64>> = (0..BLOCKS).map(|b| sum(Some(b)).step_from(&whole, RANK)).collect();
    let share: Vec<f64> = each
        .iter()
        .map(|blocks| {
            let before = blocks.iter().map(|normal| normal.cost).sum::<f64>();
            let after = blocks.iter().zip(&without).map(|(normal, step)| left(normal, step)).sum::<f64>();
            if before > 0.0 { (1.0 - after / before).clamp(0.0, 1.0) } else { 0.0 }
        })
        .collect();
    // Where they foretell nothing they are noise themselves.
    if share.iter().sum::<f64>() < LEAST * share.len() as f64 {
        return Conditioned { rest: error.to_vec(), share: vec![0.0; share.len()] };
    }
    let mut rest = error.to_vec();
    for (column, step) in columns.iter().zip(&all) {
        rest.iter_mut().zip(column).for_each(|(rest, c)| *rest += step * c);
    }
    Conditioned { rest, share }
}

/// Mean share below which columns foretell nothing.
const LEAST: f64 = 0.02;
/// Relative size below which a direction of the columns is none.
const RANK: f64 = 1e-6;

/// Sum of squares after a step.
fn left(normal: &Normal, step: &[f64]) -> f64 {
    let n = step.len();
    let mut sum = normal.cost;
    for i in 0..n {
        sum += 2.0 * step[i] * normal.gradient[i];
        sum += (0..n).map(|j| step[i] * step[j] * normal.matrix[(i, j)]).sum::<f64>();
    }
    sum.max(0.0)
}

/// What the catalogue's kinds of error make of this motion, as angles at the reference's rows: those that go with the rate
/// and the way it changes, with other axes, with acceleration, temperature and supply.
fn columns(s: &Series, whole: &[f64], response: Response) -> Vec<Vec<f64>> {
    let turned = {
        let mut at = vec![0.0; s.t.len()];
        for (&row, angle) in s.reference_rows.iter().zip(whole) {
            at[row] = *angle;
        }
        at
    };
    let at_rows = |made: &[f64]| -> Vec<f64> { s.reference_rows.iter().map(|&k| made[k]).collect() };
    // What a sensor at rest reads is its error, and no motion.
    let mut all: Vec<Vec<f64>> = if s.rest == Rest::Whole {
        Vec::new()
    } else {
        let mut made: Vec<Vec<f64>> = made((&s.t, &s.gyro), &turned).iter().map(|made| at_rows(made)).collect();
        if response == Response::ToSpectra {
            made.remove(RESPONSE);
        }
        made
    };
    // An encoder that sits off its shaft's centre errs with the angle. Over less than a turn sine and cosine of the reference are
    // together nearly the reference itself, and with the gyro's angle the whole error: there the gyro says the angle.
    if let [first, ..] = s.reference_angle[..] {
        let [least, most] = [f64::min, f64::max].map(|of| s.reference_angle.iter().copied().fold(first, of));
        let shaft = if most - least < TAU { whole } else { &s.reference_angle };
        for turns in [1.0, 2.0] {
            let angle = |k: &f64| turns * (k - shaft[0]);
            all.push(shaft.iter().map(|k| angle(k).sin()).collect());
            all.push(shaft.iter().map(|k| angle(k).cos()).collect());
        }
    }
    let mut more = |of: &dyn Fn(usize) -> f64| {
        let values: Vec<f64> = (0..s.t.len()).map(of).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        if values.iter().any(|value| (value - mean).abs() > 1e-12) {
            let about: Vec<f64> = values.iter().map(|value| value - mean).collect();
            all.push(at_rows(&integral(&s.t, &about)));
        }
    };
    for axis in 0..3 {
        if axis != s.axis.index() {
            more(&|k| s.signals[k].rates[axis]);
        }
        more(&|k| s.signals[k].accel[axis]);
    }
    more(&|k| s.signals[k].delta_temperature);
    if s.rest != Rest::Whole {
        more(&|k| s.signals[k].delta_temperature * s.gyro[k]);
    }
    more(&|k| s.signals[k].delta_supply);
    all
}

/// Place of the column of a slow response among those.
const RESPONSE: usize = 3;
