//! Channels that were logged faster than they are read: each reading stands in several rows, one after the other.
//!
//! The first row is the one nearest to when it was taken; what the others repeat is as late as they are. A quantised
//! reading may repeat too, but not between changes of many of its steps.

use super::{Report, quantum, seconds};
use crate::{Axis, Record, Row};

/// Steps by which a reading has to change on both sides of one that stands for more than it is worth.
const STEPS: f64 = 8.0;
/// Readings between such changes that are needed to tell.
const FEWEST: usize = 30;
/// Share of the readings that have to stand in more rows than one: a dead zone's are few.
const OFTEN: f64 = 0.2;
/// Share of the readings that stand no longer than what is taken for usual.
const USUAL: f64 = 0.9;

/// Leaves of each reading the first row that it stands in, and says so.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        let i = axis.index();
        channel(record, report, Some(axis), &format!("gyro_{axis}"), |row| std::slice::from_mut(&mut row.gyro[i]));
        let name = format!("ref_angle_{axis}");
        channel(record, report, Some(axis), &name, |row| std::slice::from_mut(&mut row.ref_angle[i]));
        let name = format!("ref_rate_{axis}");
        channel(record, report, Some(axis), &name, |row| std::slice::from_mut(&mut row.ref_rate[i]));
    }
    channel(record, report, None, "the reference orientation", |row| &mut row.ref_quaternion);
}

fn channel(
    record: &mut Record,
    report: &mut Report,
    axis: Option<Axis>,
    name: &str,
    place: impl Fn(&mut Row) -> &mut [f64],
) {
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for (k, row) in record.rows.iter_mut().enumerate() {
        let value = place(row);
        if value.iter().all(|x| x.is_finite()) {
            rows.push(k);
            values.push(value.to_vec());
        }
    }
    let width = values.first().map_or(0, Vec::len);
    let part = |c: usize| values.iter().map(|v| v[c]).collect::<Vec<f64>>();
    let Some(usual) = (0..width).filter_map(|c| stands_in(&part(c))).max() else { return };
    let (mut repeats, mut first, mut start) = (0, None, 0);
    for run in values.chunk_by(|a, b| a == b) {
        for k in (start..start + run.len()).filter(|k| (k - start) % usual != 0) {
            place(&mut record.rows[rows[k]]).fill(f64::NAN);
            first.get_or_insert(rows[k]);
            repeats += 1;
        }
        start += run.len();
    }
    let t = first.map(|k| seconds(record, k));
    let says = format!(
        "{name} is logged faster than it is read: each reading stands in up to {usual} rows; the first of them is taken and \
         {repeats} repeats are left out. Log each reading once, with its own time"
    );
    match axis {
        Some(axis) => report.add_on(axis, "held-samples", repeats, t, says),
        None => report.add("held-samples", repeats, t, says),
    }
}

/// Rows that a reading usually stands in at most; `None` where each has one of its own.
fn stands_in(values: &[f64]) -> Option<usize> {
    let step = quantum(values);
    let runs: Vec<&[f64]> = values.chunk_by(|a, b| a == b).collect();
    let turns = |w: &&[&[f64]]| {
        let (before, after) = (w[1][0] - w[0][0], w[2][0] - w[1][0]);
        before * after > 0.0 && before.abs().min(after.abs()) > STEPS * step
    };
    let mut lengths: Vec<usize> = runs.windows(3).filter(turns).map(|w| w[1].len()).collect();
    let several = lengths.iter().filter(|&&rows| rows > 1).count();
    if lengths.len() < FEWEST || (several as f64) < OFTEN * lengths.len() as f64 {
        return None;
    }
    let usual = (USUAL * (lengths.len() - 1) as f64).round() as usize;
    Some(*lengths.select_nth_unstable(usual).1)
}
