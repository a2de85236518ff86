//! Channels that stand still for a moment, and jump as they go on: a driver that hands out its last reading, a tracker that keeps
//! its last pose.
//!
//! Of the gyro: readings of one value, to the last digit, after which it jumps by many of its usual steps, to what the reference
//! says. Of the reference: the same, after which it jumps by what the gyro turned meanwhile. A quantised reading stands still
//! too, but goes on by a step; a dead zone stands at zero, saturation at the range's end, and play goes on without a jump.

use super::{
    Report,
    channel::{Channel, Readings},
    counted,
    motion::Motion,
    quantile, quantum, seconds,
    thresholds::{CAUGHT_UP, GOES_ON, LEAST_STEP},
    witness::angle_read,
};
use crate::{
    Axis, Record,
    fault::{FaultKind, STUCK_UP_TO},
    record::{ReferenceKind, turn},
};
use std::ops::Range;

/// Rows that stand still at least.
const FEWEST: usize = 4;
/// Share of the jump, 1, by which the reference went on in the mean while the reading stood: half of it where it went evenly.
const MISSED: f64 = 0.3;
/// Time on either side over which the reference's rate is taken, s.
const BESIDE: f64 = 0.1;

/// Takes out what stands still, and reports it.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        if !record.has_gyro(axis) {
            continue;
        }
        let name = format!("gyro_{axis}");
        let found = Motion::of(record, axis).map(|motion| gyro(record, axis, &motion)).unwrap_or_default();
        take_out(record, report, Some(axis), &name, &found, |row| row.gyro[axis.index()] = f64::NAN);
        if record.reference(axis) == Some(ReferenceKind::Angle) {
            let found = encoder(record, axis);
            let name = format!("ref_angle_{axis}");
            take_out(record, report, Some(axis), &name, &found, |row| row.ref_angle[axis.index()] = f64::NAN);
        }
    }
    let found = orientation(record);
    take_out(record, report, None, "the reference orientation", &found, |row| row.ref_quaternion.fill(f64::NAN));
}

/// Rows of a run but the first, which may be right.
fn take_out(
    record: &mut Record,
    report: &mut Report,
    axis: Option<Axis>,
    name: &str,
    runs: &[Range<usize>],
    forget: impl Fn(&mut crate::Row),
) {
    let rows: Vec<usize> = runs.iter().flat_map(|run| run.start + 1..run.end).collect();
    let Some(&first) = rows.first() else { return };
    if rows.len() as f64 >= STUCK_UP_TO * record.len() as f64 {
        return;
    }
    let longest = runs.iter().map(|run| seconds(record, run.end - 1) - seconds(record, run.start)).fold(0.0, f64::max);
    for &row in &rows {
        forget(&mut record.rows[row]);
        report.mark(row);
    }
    let says = format!(
        "{name} stands still {} for up to {longest:.2} s while the other sensor turns, and jumps as it goes on: those {} are left out. \
         The last one was handed out again: check what reads the sensor",
        if runs.len() == 1 { "once".to_owned() } else { format!("{} times", runs.len()) },
        counted(rows.len(), "reading")
    );
    report.add_for(axis, FaultKind::StuckChannel, rows.len() as u64, Some(seconds(record, first)), says);
}

/// Runs of one value among all that there are, with the readings that follow.
fn runs<T: PartialEq>(values: &[T]) -> Vec<Range<usize>> {
    let (mut found, mut from) = (Vec::new(), 0);
    for k in 1..values.len() {
        if values[k] != values[from] {
            if k - from >= FEWEST {
                found.push(from..k);
            }
            from = k;
        }
    }
    found
}

fn gyro(record: &Record, axis: Axis, motion: &Motion) -> Vec<Range<usize>> {
    let all = Readings::of(record, Channel::Gyro(axis));
    let ends = all.values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let steps = all.values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let Some(usual) = quantile(steps.collect(), 0.9) else { return Vec::new() };
    let stands = |run: &Range<usize>| {
        let (held, then) = (all.values[run.start], all.values[run.end]);
        let jump = then - held;
        if held.abs() < 1e-9 || held.abs() > 0.97 * ends || jump.abs() < LEAST_STEP.max(GOES_ON * usual) {
            return false;
        }
        // From when it stood still to when it goes on, its own interval and a little on either side.
        let (from, to) = (all.t[run.start], all.t[run.end]);
        let rate = |a: f64, b: f64| (motion.at(b) - motion.at(a)) / (b - a);
        let shown = rate(to - 0.5 * BESIDE, to + 0.5 * BESIDE) - rate(from - 0.5 * BESIDE, from + 0.5 * BESIDE);
        // Fast motion is gone from a mean over that time: then the run as a whole tells.
        let missed = (rate(from, to) - held) / jump;
        CAUGHT_UP.contains(&(shown / jump)) || missed > MISSED && jump.abs() > 2.0 * LEAST_STEP
    };
    let found = runs(&all.values).into_iter().filter(stands);
    found.map(|run| all.rows[run.start]..all.rows[run.end - 1] + 1).collect()
}

fn encoder(record: &Record, axis: Axis) -> Vec<Range<usize>> {
    let all = Readings::of(record, Channel::Angle(axis));
    let least = LEAST_STEP.max(10.0 * quantum(&all.values));
    let usual = quantile(all.values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect(), 0.99).unwrap_or(0.0);
    let angle = angle_read(record, axis);
    let stands = |run: &Range<usize>| {
        let jump = all.values[run.end] - all.values[run.start];
        let gyro = angle[all.rows[run.end]] - angle[all.rows[run.start]];
        jump.abs() > least.max(usual) && CAUGHT_UP.contains(&(jump / gyro))
    };
    let found = runs(&all.values).into_iter().filter(stands);
    found.map(|run| all.rows[run.start]..all.rows[run.end - 1] + 1).collect()
}

fn orientation(record: &Record) -> Vec<Range<usize>> {
    if !Axis::ALL.iter().all(|&axis| record.has_gyro(axis)) {
        return Vec::new();
    }
    let rows: Vec<usize> = (0..record.len()).filter(|&k| record.rows[k].ref_quaternion[0].is_finite()).collect();
    let values: Vec<[f64; 4]> = rows.iter().map(|&k| record.rows[k].ref_quaternion).collect();
    let size = |turn: [f64; 3]| turn.iter().map(|x| x * x).sum::<f64>().sqrt();
    let usual = quantile(values.windows(2).map(|pair| size(turn(pair[0], pair[1]))).collect(), 0.99).unwrap_or(0.0);
    let angles = Axis::ALL.map(|axis| angle_read(record, axis));
    let stands = |run: &Range<usize>| {
        let jump = turn(values[run.start], values[run.end]);
        let gyro = [0, 1, 2].map(|axis: usize| angles[axis][rows[run.end]] - angles[axis][rows[run.start]]);
        let along: f64 = jump.iter().zip(gyro).map(|(a, b)| a * b).sum();
        size(jump) > LEAST_STEP.max(usual) && CAUGHT_UP.contains(&(along / size(gyro).powi(2)))
    };
    let found = runs(&values).into_iter().filter(stands);
    found.map(|run| rows[run.start]..rows[run.end - 1] + 1).collect()
}
