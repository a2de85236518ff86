//! Channels that stand still while another one shows motion.

use super::{Report, motion::Motion, seconds};
use crate::{
    Axis, Record, Row,
    fault::{FaultKind, STUCK_UP_TO},
};
use std::f64::consts::SQRT_2;

/// Shorter than this, s, nothing is called stuck.
const SHORTEST: f64 = 0.5;

/// Pieces of a run over which rates are compared, s, and how many readings of the reference they hold at least.
const PIECE: f64 = 0.1;
const READINGS: f64 = 4.0;

/// Reports gyros and references that are stuck, and takes out what they read meanwhile.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        let Some(motion) = Motion::of(record, axis) else { continue };
        let runs = gyro(record, axis, &motion);
        say(record, report, axis, &format!("gyro_{axis}"), "the reference turns", &runs);
        take_out(record, &runs, |row| &mut row.gyro[axis.index()]);
        let runs = encoder(record, axis);
        say(record, report, axis, &format!("ref_angle_{axis}"), "the gyro turns", &runs);
        take_out(record, &runs, |row| &mut row.ref_angle[axis.index()]);
    }
}

fn take_out(record: &mut Record, runs: &[(usize, usize)], value: impl Fn(&mut Row) -> &mut f64) {
    let rows: usize = runs.iter().map(|&(from, to)| to - from).sum();
    if (rows as f64) < STUCK_UP_TO * record.len() as f64 {
        for &(from, to) in runs {
            record.rows[from + 1..to].iter_mut().for_each(|row| *value(row) = f64::NAN);
        }
    }
}

fn say(record: &Record, report: &mut Report, axis: Axis, name: &str, while_: &str, runs: &[(usize, usize)]) {
    let Some(&(first, _)) = runs.first() else { return };
    let rows: usize = runs.iter().map(|&(from, to)| to - from).sum();
    let t = seconds(record, first);
    report.add_on(
        axis,
        FaultKind::StuckChannel,
        rows as u64,
        Some(t),
        format!("{name} stands still in {rows} rows while {while_}: check its wiring and driver"),
    );
}

/// Runs `from..to` of one value, at least [`SHORTEST`] long; rows without value don't end a run.
fn runs(record: &Record, value: impl Fn(usize) -> f64) -> Vec<(usize, usize)> {
    let (mut found, mut from): (Vec<(usize, usize)>, Option<usize>) = (Vec::new(), None);
    let mut last = 0;
    for k in 0..record.len() {
        let x = value(k);
        if !x.is_finite() {
            continue;
        }
        if let Some(start) = from
            && value(start) != x
        {
            found.push((start, last + 1));
            from = None;
        }
        from.get_or_insert(k);
        last = k;
    }
    found.extend(from.map(|start| (start, last + 1)));
    found.retain(|&(a, b)| b - a >= 20 && seconds(record, b - 1) - seconds(record, a) >= SHORTEST);
    found
}

/// Stuck runs of a gyro: the reference's rate changes inside them as it does elsewhere. A reading held at the range's end,
/// or at zero while the axis turns slowly, is physics.
fn gyro(record: &Record, axis: Axis, motion: &Motion) -> Vec<(usize, usize)> {
    let value = |k: usize| record.rows[k].gyro[axis.index()];
    let ends = (0..record.len()).map(value).filter(|x| x.is_finite()).fold(0.0_f64, |most, x| most.max(x.abs()));
    let piece = PIECE.max(READINGS * motion.apart());
    // Two angles make a mean rate, and noise carries the rates of a run some six standard deviations apart.
    let noise = 6.0 * SQRT_2 * motion.noise() / piece;
    let mut found = runs(record, value);
    found.retain(|&(from, to)| {
        let rates = motion.rates(seconds(record, from), seconds(record, to - 1), piece);
        let (low, high) = rates.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
        let held = value(from);
        let least = (0.5 * motion.rate_rms).max(0.05 + noise);
        let clipped = held.abs() >= 0.97 * ends && held.abs() > 0.0 && {
            let beyond = rates.iter().filter(|&&x| x * held.signum() > 0.7 * held.abs()).count();
            10 * beyond >= 9 * rates.len()
        };
        high - low > least && !clipped && (held.abs() > 1e-9 || high.max(-low) > least)
    });
    found
}

/// Stuck runs of an encoder: the gyro's angle inside them, less a straight line, goes further than any play.
fn encoder(record: &Record, axis: Axis) -> Vec<(usize, usize)> {
    let i = axis.index();
    let mut found = runs(record, |k| record.rows[k].ref_angle[i]);
    let quantum = {
        let values: Vec<f64> = record.rows.iter().map(|r| r.ref_angle[i]).filter(|x| x.is_finite()).collect();
        let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        steps.filter(|&x| x > 1e-9).fold(f64::INFINITY, f64::min)
    };
    let play = if quantum.is_finite() { 0.2_f64.max(3.0 * quantum) } else { 0.2 };
    found.retain(|&(from, to)| {
        let (mut angle, mut curve) = (0.0, vec![(seconds(record, from), 0.0)]);
        for k in from + 1..to {
            let (rate, dt) = (record.rows[k].gyro[i], seconds(record, k) - seconds(record, k - 1));
            if rate.is_finite() {
                angle += rate * dt;
            }
            curve.push((seconds(record, k), angle));
        }
        let (start, span) = (curve[0].0, curve[curve.len() - 1].0 - curve[0].0);
        let line = |t: f64| angle * (t - start) / span;
        let (low, high) = curve
            .iter()
            .map(|&(t, a)| a - line(t))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high - low > play || (angle / span).abs() > 1.0 && angle.abs() > std::f64::consts::PI
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Row;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A minute at 100 rows a second: a gyro of this step, a heading in every so many rows with this noise, and whether the gyro is stuck
    /// from 20 s to 22 s.
    fn log(rate: impl Fn(f64) -> f64, step: f64, (every, noise): (usize, f64), is_stuck: bool) -> Record {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (mut angle, mut held) = (0.0, 0.0);
        let rows = (0..6000).map(|k| {
            let t = k as f64 * 0.01;
            angle += 0.01 * rate(t);
            if !(is_stuck && (20.0..22.0).contains(&t)) {
                held = ((rate(t) + 1e-3 * normal()) / step).round() * step;
            }
            let mut row = Row { t_ns: (1e9 * t).round() as i64, ..Row::EMPTY };
            row.gyro[2] = held;
            if k % every == 0 {
                row.ref_angle[2] = angle + noise * normal();
            }
            row
        });
        Record { rows: rows.collect(), ..Record::default() }
    }

    #[test]
    fn a_coarse_gyro_that_stands_is_not_stuck_and_one_that_turns_and_stands_is() {
        let stops = |t: f64| if t % 12.0 < 6.0 { 0.0 } else { 0.4 * (t % 12.0 - 6.0).sin() };
        let turns = |t: f64| 0.4 * (1.3 * t).sin();
        let shakes = |t: f64| 1.5 * (19.0 * t).sin();
        let (coarse, fine, heading, encoder) = (0.5_f64.to_radians(), 1e-5, (10, 2e-3), (1, 1e-4));
        let found = |record: &Record| !gyro(record, Axis::Z, &Motion::of(record, Axis::Z).unwrap()).is_empty();
        assert!(!found(&log(stops, coarse, heading, false)));
        assert!(!found(&log(stops, coarse, (10, 2e-2), false)));
        for (rate, reference) in [(&turns as &dyn Fn(f64) -> f64, heading), (&turns, encoder), (&shakes, encoder)] {
            assert!(found(&log(rate, fine, reference, true)));
        }
    }
}
