//! What of an error goes with the catalogue's columns: fitted to the increments of all blocks but one, judged on that one.
//!
//! Missing physics must not pass for noise. Whatever the sensor's motion and surroundings predict of the error of a stretch
//! of the log that took no part in the prediction is physics or a mistake, named or not, and no component of noise gets it.

use crate::{
    evidence::{
        incoherent::{RESPONSE, made},
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
    let columns = || columns(s, whole, response);
    let n = error.len();
    let block = |row: usize| row * BLOCKS / n;
    let looked_at: Vec<Increments> = tau.iter().map(|tau| Increments::over(*tau, dt, error)).collect();
    let mut made: Vec<Vec<Vec<f64>>> = vec![Vec::new(); tau.len()];
    for column in columns() {
        looked_at.iter().zip(&mut made).for_each(|(over, made)| made.push(over.of(&column)));
    }
    let m = made.first().map_or(0, Vec::len);
    if m == 0 {
        return Conditioned { rest: error.to_vec(), share: vec![0.0; tau.len()] };
    }
    let mut each: Vec<Vec<Normal>> = Vec::new();
    for (over, made) in looked_at.iter().zip(&made) {
        let own = over.of(error);
        let mut blocks = Vec::new();
        let mut first = 0;
        for b in 0..BLOCKS {
            let after = first + over.starts[first..].iter().take_while(|&&i| block(i) == b).count();
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
    for (column, step) in columns().zip(&all) {
        rest.iter_mut().zip(&column).for_each(|(rest, c)| *rest += step * c);
    }
    Conditioned { rest, share }
}

/// The increments of one averaging time, in units of those of the error.
struct Increments {
    lag: usize,
    starts: Vec<usize>,
    size: f64,
}

impl Increments {
    fn over(tau: f64, dt: f64, error: &[f64]) -> Self {
        let n = error.len();
        let lag = ((tau / dt).round() as usize).clamp(1, n - 1);
        let stride = ((n - lag) / INCREMENTS).max(1);
        let plain = Self { lag, starts: (0..n - lag).step_by(stride).collect(), size: 1.0 };
        let square = plain.of(error).iter().map(|d| d * d).sum::<f64>().max(1e-300);
        Self { size: square.sqrt().recip(), ..plain }
    }

    fn of(&self, values: &[f64]) -> Vec<f64> {
        self.starts.iter().map(|&i| self.size * (values[i + self.lag] - values[i])).collect()
    }
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

/// What the catalogue's kinds of error make of this motion, as angles at the reference's rows, one after the other: those that go with
/// the rate and the way it changes, with other axes, with acceleration, temperature and supply.
fn columns<'a>(s: &'a Series, whole: &'a [f64], response: Response) -> impl Iterator<Item = Vec<f64>> + 'a {
    let mut turned = vec![0.0; s.t.len()];
    for (&row, angle) in s.reference_rows.iter().zip(whole) {
        turned[row] = *angle;
    }
    // What a sensor at rest reads is its error, and no motion.
    let of_readings = (s.rest != Rest::Whole).then(|| made((&s.t, &s.gyro), turned)).into_iter().flatten();
    let asked = of_readings.enumerate().filter(move |(k, _)| response == Response::Column || *k != RESPONSE);
    let at_rows = |made: Vec<f64>| -> Vec<f64> { s.reference_rows.iter().map(|&k| made[k]).collect() };
    asked.map(move |(_, made)| at_rows(made)).chain(of_shaft(s, whole)).chain(of_others(s).map(at_rows))
}

/// What goes with the angle of the shaft: an encoder that sits off its centre errs with it. Over less than a turn sine and cosine of the
/// reference are together nearly the reference itself, and with the gyro's angle the whole error: there the gyro says the angle.
fn of_shaft<'a>(s: &'a Series, whole: &'a [f64]) -> impl Iterator<Item = Vec<f64>> + 'a {
    let angle = &s.reference_angle[..];
    let [least, most] = [f64::min, f64::max].map(|of| angle.iter().copied().reduce(of).unwrap_or_default());
    let shaft = if most - least < TAU && !angle.is_empty() { whole } else { angle };
    let waves = |turns: f64| {
        let angle = |k: &f64| turns * (k - shaft[0]);
        [shaft.iter().map(|k| angle(k).sin()).collect(), shaft.iter().map(|k| angle(k).cos()).collect()]
    };
    [1.0, 2.0].into_iter().filter(|_| !shaft.is_empty()).flat_map(waves)
}

/// What goes with other channels than the gyro and its reference, at all samples.
fn of_others(s: &Series) -> impl Iterator<Item = Vec<f64>> {
    let mut others: Vec<Box<dyn Fn(usize) -> f64 + '_>> = Vec::new();
    for axis in 0..3 {
        if axis != s.axis.index() {
            others.push(Box::new(move |k| s.signals(k).rates[axis]));
        }
        others.push(Box::new(move |k| s.signals(k).accel[axis]));
    }
    others.push(Box::new(|k| s.signals(k).delta_temperature));
    if s.rest != Rest::Whole {
        others.push(Box::new(|k| s.signals(k).delta_temperature * s.gyro[k]));
    }
    others.push(Box::new(|k| s.signals(k).delta_supply));
    others.into_iter().filter_map(|of| {
        let values: Vec<f64> = (0..s.t.len()).map(of).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let changes = values.iter().any(|value| (value - mean).abs() > 1e-12);
        changes.then(|| integral(&s.t, &values.iter().map(|value| value - mean).collect::<Vec<_>>()))
    })
}
