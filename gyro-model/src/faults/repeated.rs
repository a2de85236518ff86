//! Samples that were logged again in place of new ones.

use super::{Report, counted, quantum, seconds};
use crate::{Record, Row};

/// Where more of the rows repeat than this, the log was polled faster than the sensor samples: said, but left as it is.
const MARKED_UP_TO: f64 = 0.1;

/// Takes repeated samples out, and reports them.
///
/// A quantised reading repeats by itself now and then, so a sample counts as repeated only where all gyro and
/// accelerometer channels repeat together much more often than they would independently; with few channels, where a
/// reading stands still between large changes far more often than it changes by one step.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let channels: Vec<fn(&Row) -> f64> = [
        (|r| r.gyro[0]) as fn(&Row) -> f64,
        |r| r.gyro[1],
        |r| r.gyro[2],
        |r| r.accel[0],
        |r| r.accel[1],
        |r| r.accel[2],
    ]
    .into_iter()
    .filter(|of| record.rows.iter().any(|r| of(r).is_finite()))
    .collect();
    let rows: Vec<usize> =
        (0..record.len()).filter(|&k| channels.iter().all(|of| of(&record.rows[k]).is_finite())).collect();
    if rows.len() < 100 {
        return;
    }
    let pairs = rows.len() as f64 - 1.0;
    let repeats = |of: &fn(&Row) -> f64, k: usize| of(&record.rows[rows[k]]) == of(&record.rows[rows[k - 1]]);
    let by_chance: f64 =
        channels.iter().map(|of| (1..rows.len()).filter(|&k| repeats(of, k)).count() as f64 / pairs).product();
    let mut found: Vec<usize> = (1..rows.len()).filter(|&k| channels.iter().all(|of| repeats(of, k))).collect();
    if channels.len() < 4 {
        found = channels.first().map_or_else(Vec::new, |of| {
            let values: Vec<f64> = rows.iter().map(|&k| of(&record.rows[k])).collect();
            let ends = values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            found.retain(|&k| stands_between_changes(&values, ends, k));
            if standing_still_is_an_excess(&values, found.len()) { found } else { Vec::new() }
        });
    } else if (found.len() as f64) < 3.0 + 20.0 * by_chance * pairs {
        found.clear();
    }
    let Some(&first) = found.first() else { return };
    let share = found.len() as f64 / pairs;
    let mark = share <= MARKED_UP_TO;
    // Where readings change slowly nobody knows which of those alike were logged again: single ones are left out too.
    let all = |k: usize| (1..rows.len()).contains(&k) && channels.iter().all(|of| repeats(of, k));
    let alone: Vec<usize> = (1..rows.len()).filter(|&k| all(k) && !all(k - 1) && !all(k + 1)).collect();
    for &k in found.iter().chain(&alone).filter(|_| mark) {
        record.rows[rows[k]].gyro = [f64::NAN; 3];
    }
    found.iter().filter(|_| mark).for_each(|&k| report.mark(rows[k]));
    let t = seconds(record, rows[first]);
    let then = if mark { "left out" } else { "they are kept, and look like a delay: log at the sensor's own rate" };
    report.add(
        "repeated-samples",
        found.len() as u64,
        Some(t),
        format!("{} logged again in place of a new one; {then}", counted(found.len(), "sample")),
    );
}

/// Whether reading `k` repeats the one before while the readings around change by many steps, off the range's `ends`.
fn stands_between_changes(values: &[f64], ends: f64, k: usize) -> bool {
    if k < 2 || k + 1 >= values.len() {
        return false;
    }
    let q = quantum(&values[k.saturating_sub(200)..(k + 200).min(values.len())]);
    let (before, after) = (values[k - 1] - values[k - 2], values[k + 1] - values[k]);
    before.abs() > 8.0 * q && after.abs() > 8.0 * q && before * after > 0.0 && values[k].abs() < 0.97 * ends
}

/// Among readings between large changes in one direction, exact repetition is as likely as a change by one small step;
/// whether it is far more frequent.
fn standing_still_is_an_excess(values: &[f64], still: usize) -> bool {
    let q = quantum(values);
    let small = (2..values.len() - 1)
        .filter(|&k| {
            let (before, here, after) =
                (values[k - 1] - values[k - 2], values[k] - values[k - 1], values[k + 1] - values[k]);
            before.abs() > 8.0 * q
                && after.abs() > 8.0 * q
                && before * after > 0.0
                && here != 0.0
                && here.abs() < 4.0 * q
        })
        .count();
    still as f64 > 5.0 + 3.0 * small as f64
}
