//! A sensor that hung: from one row to the next all its channels repeat, to the last digit, what they gave before.
//!
//! A reading that stands still at rest may be a coarse one. Noise of several channels at once stands still by chance in no log: where
//! they changed in most rows before, at rest as well, and then do not in so many, nobody measures any more. What is repeated is no
//! reading: where it lasts to the end the log ends there.

use super::{Report, seconds};
use crate::{Axis, Record, Row, fault::FaultKind};
use std::ops::Range;

/// Rows that repeat at least.
const FEWEST: usize = 200;
/// Rows before them that have to change.
const BEFORE: usize = 200;
/// Channels at least: those of a gyro alone may be coarse.
const CHANNELS: usize = 4;
/// Standard deviation of a gyro that rests within those rows at most, rad/s: the noise of a poor one, and a tenth of slow motion.
const RESTS: f64 = 0.05;

/// Reports it, and takes out what the gyro read meanwhile.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let Some(first) = record.rows.first() else { return };
    let channels = values(first).iter().filter(|value| value.is_finite()).count();
    if channels < CHANNELS {
        return;
    }
    let hung: Vec<Range<usize>> = runs(&record.rows).filter(|run| is_alive_before(&record.rows, run.start)).collect();
    let Some(run) = hung.iter().max_by_key(|run| run.len()) else { return };
    let rows: usize = hung.iter().map(|run| run.len() - 1).sum();
    let (from, lasts) = (seconds(record, run.start), seconds(record, run.end - 1) - seconds(record, run.start));
    let ends = run.end == record.len();
    let says = format!(
        "all {channels} channels of the sensor repeat one row for {lasts:.1} s, to the last digit, though they changed before: the sensor or \
         what reads it hung, and gave no measurement then; {}. Check its supply and its bus",
        if ends { "the log ends there" } else { "its readings are left out" }
    );
    report.add(FaultKind::StuckChannel, rows as u64, Some(from), says);
    for run in hung.into_iter().rev() {
        if run.end == record.len() {
            record.rows.truncate(run.start + 1);
            continue;
        }
        record.rows[run.start + 1..run.end].iter_mut().for_each(|row| row.gyro.fill(f64::NAN));
    }
}

/// What the sensor gave.
fn values(row: &Row) -> [f64; 6] {
    let ([a, b, c], [d, e, f]) = (row.gyro, row.accel);
    [a, b, c, d, e, f]
}

/// Whether two rows are one, to the last digit.
fn is_same(a: &Row, b: &Row) -> bool {
    values(a).iter().zip(values(b)).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Runs of rows that are the same.
fn runs(rows: &[Row]) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut from = 0;
    rows.chunk_by(is_same)
        .map(move |run| {
            let own = from..from + run.len();
            from = own.end;
            own
        })
        .filter(|run| run.len() >= FEWEST)
}

/// Whether the sensor rested before a row, and its channels changed in more than half of the rows.
fn is_alive_before(rows: &[Row], start: usize) -> bool {
    let Some(before) = start.checked_sub(BEFORE).map(|from| &rows[from..start]) else { return false };
    let changes = before.windows(2).filter(|pair| !is_same(&pair[0], &pair[1])).count();
    let rests = Axis::ALL.iter().all(|axis| {
        let read = || before.iter().map(|row| row.gyro[axis.index()]).filter(|x| x.is_finite());
        let count = read().count().max(1) as f64;
        let mean = read().sum::<f64>() / count;
        read().map(|x| (x - mean).powi(2)).sum::<f64>() < RESTS * RESTS * count || read().next().is_none()
    });
    2 * changes > before.len() && rests
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sensor at rest at 100 Hz that reads whole counts of noise, up to a row; from there on `then` says.
    fn record(hangs_at: usize, rows: u32, then: impl Fn(&mut Row)) -> Record {
        let noise = |k: u32, channel: u32| f64::from((k * 7919 + channel * 104_729) % 13) - 6.0;
        let mut all: Vec<Row> = (0..rows)
            .map(|k| Row {
                t_ns: i64::from(k) * 10_000_000,
                gyro: [0, 1, 2].map(|channel| 0.001 * noise(k, channel)),
                accel: [3, 4, 5].map(|channel| 0.02 * noise(k, channel)),
                ref_rate: [0.0; 3],
                ..Row::EMPTY
            })
            .collect();
        let last = all.get(hangs_at).copied();
        for (row, last) in all.iter_mut().skip(hangs_at).zip(last.into_iter().cycle()) {
            *row = Row { t_ns: row.t_ns, ..last };
            then(row);
        }
        Record { rows: all, ..Record::default() }
    }

    fn faults(record: &mut Record) -> Vec<crate::diagnosis::DataFault> {
        let mut report = Report { already: vec![false; record.len()], ..Report::default() };
        check(record, &mut report);
        report.faults
    }

    #[test]
    fn a_sensor_that_repeats_its_last_row_hung() {
        let mut half = record(3000, 6000, |_| {});
        let found = faults(&mut half);
        assert_eq!((found.len(), found[0].count, found[0].first_t), (1, 2999, Some(30.0)), "{found:?}");
        assert_eq!(half.len(), 3001, "the log ends there");
        let mut end = record(5700, 6000, |_| {});
        assert_eq!(faults(&mut end)[0].count, 299);
        assert!(end.len() == 5701 && end.rows[5700].gyro[2].is_finite());
    }

    #[test]
    fn one_that_measures_again_has_no_readings_meanwhile() {
        let mut back = record(3000, 6000, |row| {
            if row.t_ns >= 40_000_000_000 {
                row.gyro[2] += 1e-12 * (row.t_ns % 7_000_003) as f64;
            }
        });
        assert_eq!((faults(&mut back)[0].count, back.len()), (999, 6000));
        assert!(back.rows[3500].gyro[2].is_nan() && back.rows[4000].gyro[2].is_finite());
    }

    #[test]
    fn one_that_measures_did_not() {
        assert!(faults(&mut record(6000, 6000, |_| {})).is_empty());
        // One channel still measures.
        let mut alive = record(3000, 6000, |row| row.accel[1] += 1e-9 * row.t_ns as f64);
        assert!(faults(&mut alive).is_empty());
        // Coarse readings at rest never changed.
        let mut coarse = record(0, 6000, |_| {});
        assert!(faults(&mut coarse).is_empty());
    }
}
