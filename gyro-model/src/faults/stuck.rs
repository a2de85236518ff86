//! Channels that stand still while another one shows motion.

use super::{Report, motion::Motion, seconds};
use crate::{
    Axis, Record, Row,
    fault::{FaultKind, STUCK_UP_TO},
    order::quantile,
};

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
    let noise = noise_of_range(&motion.rates(seconds(record, 0), seconds(record, record.len() - 1), piece));
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

/// How far noise of the reference's angle alone carries its mean rates apart: what they differ from a straight line by, from one piece
/// to the next, is mostly noise where the motion is quietest.
fn noise_of_range(rates: &[f64]) -> f64 {
    let bends = rates.windows(3).map(|r| (r[2] - 2.0 * r[1] + r[0]).abs());
    // Of normal numbers a quarter lies within 0.32 of the standard deviation. That of the bends is √(20/2) of the rates', and the rates
    // of a run differ by some six of those.
    quantile(bends.collect(), 0.25).map_or(0.0, |size| 6.0 * size / 0.32 / 10_f64.sqrt())
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
