//! An angle that wraps, averaged, interpolated or differentiated across the wrap.
//!
//! Where an angle in −180° … 180° crosses its end, a mean or a straight line of readings on both sides lies between the two ends:
//! within a few rows the reference goes nearly a whole turn back, and the gyro says that it went on. A difference across the
//! wrap is a whole turn too large, divided by the time between two rows or, of central differences, by two of them.

use super::{
    Report,
    channel::wraps_in_degrees,
    channel::{Channel, Readings},
    counted, quantile,
    thresholds::{CROSSED, CROSSING},
    witness::angle_read,
};
use crate::{Axis, Record, fault::FaultKind, record::ReferenceKind};
use std::f64::consts::TAU;

/// Takes out readings that come of crossings, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        if !record.has_gyro(axis) {
            continue;
        }
        let (channel, found) = match record.reference(axis) {
            Some(ReferenceKind::Angle) => (Channel::Angle(axis), between(record, axis)),
            Some(ReferenceKind::Rate) => (Channel::Rate(axis), differences(record, axis)),
            Some(ReferenceKind::Quaternion) | None => continue,
        };
        let Some(&first) = found.first() else { continue };
        for &row in &found {
            *channel.place(&mut record.rows[row]) = f64::NAN;
            report.mark(row);
        }
        let how = if matches!(channel, Channel::Angle(_)) {
            "was averaged or interpolated across the end of its range, where the angle wraps: readings between the two ends"
        } else {
            "was differentiated across the end of an angle's range, where it wraps: readings off by a whole turn in a row"
        };
        let says = format!(
            "{} {how} ({}) are left out. Unwrap the angle first (numpy.unwrap), then filter it",
            channel.name(),
            counted(found.len(), "reading")
        );
        report.add_on(axis, FaultKind::ReferenceJumps, found.len() as u64, Some(super::seconds(record, first)), says);
    }
}

/// Rows of an angle that lie between the ends of its range while it crosses them.
fn between(record: &Record, axis: Axis) -> Vec<usize> {
    let value = |k: usize| record.rows[k].ref_angle[axis.index()];
    let rows: Vec<usize> = (0..record.len()).filter(|&k| value(k).is_finite()).collect();
    let values: Vec<f64> = rows.iter().map(|&k| value(k)).collect();
    let whole = if wraps_in_degrees(&values) { 360.0 } else { TAU };
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    // An angle that does not wrap, or one that hardly comes to its ends.
    if !(0.9 * whole..1.01 * whole).contains(&(high - low)) {
        return Vec::new();
    }
    let angle = angle_read(record, axis);
    let gyro: Vec<f64> = rows.iter().map(|&k| angle[k] * whole / TAU).collect();
    // How far the angle went beyond what the gyro turned, as whole turns back.
    let back = |a: usize, b: usize| ((gyro[b] - gyro[a]) - (values[b] - values[a])) / whole;
    let is_whole = |turns: f64| (turns.abs() - 1.0).abs() < CROSSED;
    let (mut found, mut k) = (Vec::new(), 0);
    while k + 2 < rows.len() {
        let end = (k + 2..=(k + CROSSING).min(rows.len() - 1)).find(|&end| is_whole(back(k, end)));
        let Some(end) = end.filter(|&end| (k..end).all(|j| !is_whole(back(j, j + 1)) && back(j, j + 1).abs() > 0.02))
        else {
            k += 1;
            continue;
        };
        found.extend(rows[k + 1..end].iter().copied());
        k = end;
    }
    found
}

/// Rows of a rate that are off by a whole turn between two rows, or three.
fn differences(record: &Record, axis: Axis) -> Vec<usize> {
    let all = Readings::of(record, Channel::Rate(axis));
    let dt: Vec<f64> = all.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let fastest = (record.rows.iter()).map(|row| row.gyro[axis.index()].abs()).filter(|x| x.is_finite());
    let (Some(dt), fastest) = (quantile(dt, 0.5).filter(|dt| *dt > 0.0), fastest.fold(0.0, f64::max)) else {
        return Vec::new();
    };
    let off = TAU / dt;
    if off < 10.0 * fastest {
        return Vec::new();
    }
    let is_off = |k: &usize| {
        let gyro = record.rows[all.rows[*k]].gyro[axis.index()];
        let beyond = (all.values[*k] - if gyro.is_finite() { gyro } else { 0.0 }).abs();
        [off, 0.5 * off].iter().any(|off| (beyond / off - 1.0).abs() < CROSSED)
    };
    (0..all.rows.len()).filter(is_off).map(|k| all.rows[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Row;

    /// A shaft that turns to and fro through several turns, its angle within ±π.
    fn record(of: impl Fn(&[f64]) -> Vec<f64>, reference: impl Fn(&mut Row, f64)) -> Record {
        let angle = |t: f64| 9.0 * (0.4 * t).sin();
        let wrapped: Vec<f64> =
            (0..6000).map(|k| angle(f64::from(k) * 0.01)).map(|x| x - TAU * (x / TAU).round()).collect();
        let rows = of(&wrapped).into_iter().zip(0_i32..).map(|(x, k)| {
            let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
            row.gyro[2] = 3.6 * (0.4 * f64::from(k) * 0.01).cos();
            reference(&mut row, x);
            row
        });
        Record { rows: rows.collect(), ..Record::default() }
    }

    #[test]
    fn readings_between_the_ends_are_found_and_a_wrap_is_none() {
        let set = |row: &mut Row, x: f64| row.ref_angle[2] = x;
        assert_eq!(between(&record(<[f64]>::to_vec, set), Axis::Z).len(), 0);
        let crossings = {
            let rows = record(<[f64]>::to_vec, set).rows;
            rows.windows(2).filter(|pair| (pair[1].ref_angle[2] - pair[0].ref_angle[2]).abs() > 3.0).count()
        };
        let mean = |x: &[f64]| (0..x.len()).map(|k| x[k.saturating_sub(3)..=k].iter().sum::<f64>() / 4.0).collect();
        assert!(crossings > 5);
        assert_eq!(between(&record(mean, set), Axis::Z).len(), 3 * crossings);
    }

    #[test]
    fn a_difference_across_the_end_is_found() {
        let set = |row: &mut Row, x: f64| row.ref_rate[2] = x;
        let central = |x: &[f64]| {
            let of = |k: usize| (x[(k + 1).min(x.len() - 1)] - x[k.saturating_sub(1)]) / 0.02;
            (0..x.len()).map(of).collect()
        };
        let found = differences(&record(central, set), Axis::Z);
        assert!(found.len() > 10 && found.len().is_multiple_of(2), "{}", found.len());
    }
}
