//! Faults of the data, as against physics: found over a whole log, counted, located, and taken out where that is possible.
//!
//! What a fault must not be mistaken for: a quantised sensor at rest repeats its reading; a dead zone gives many zeros;
//! saturation holds the reading at the range's end; backlash holds the encoder at reversals; an encoder slower than the
//! gyro leaves rows without value. None of these is reported here.

pub mod held;
mod missing;
mod orientation;
mod reference;
mod repeated;
mod slips;
mod spikes;
pub mod stuck;
#[cfg(test)]
mod tests;
mod timing;

use crate::{Axis, Record, diagnosis::DataFault, order::quantile};

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The faults, counted and located.
    pub faults: Vec<DataFault>,
    /// Rows of which a reading is missing or was taken out.
    pub rows_marked: u64,
}

/// Checks a whole log. Readings that are certainly wrong (single spikes, repeated samples) become "no value" in `record`.
///
/// `already` tells, row by row, which ones were counted as faulty before (empty: none); they are not counted again.
pub fn check(record: &mut Record, already: &[bool]) -> Report {
    let mut report = Report::default();
    let mut already = already.to_vec();
    already.resize(record.len(), false);
    missing::check(record, &mut already, &mut report);
    timing::check(record, &mut report);
    held::check(record, &mut report);
    spikes::check(record, &mut already, &mut report);
    slips::check(record, &mut report);
    repeated::check(record, &mut already, &mut report);
    stuck::check(record, &mut report);
    reference::check(record, &mut report);
    report
}

impl Report {
    /// Counts a row of which a reading is missing or was taken out, once.
    fn mark(&mut self, already: &mut [bool], row: usize) {
        if let Some(flag) = already.get_mut(row)
            && !*flag
        {
            *flag = true;
            self.rows_marked += 1;
        }
    }

    /// A fault of the log as a whole.
    fn add(&mut self, fault: &str, count: u64, first_t: Option<f64>, says: String) {
        self.faults.push(DataFault { fault: fault.to_owned(), axis: None, count, first_t, says });
    }

    /// A fault of one axis.
    fn add_on(&mut self, axis: Axis, fault: &str, count: u64, first_t: Option<f64>, says: String) {
        self.faults.push(DataFault { fault: fault.to_owned(), axis: Some(axis), count, first_t, says });
    }
}

/// Seconds from the first row.
fn seconds(record: &Record, row: usize) -> f64 {
    record.rows[row].t_ns as f64 / 1e9
}

/// `1 row`, `2 rows`.
fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Smallest difference between readings.
fn quantum(values: &[f64]) -> f64 {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.filter(|&step| step > 1e-12).fold(f64::INFINITY, f64::min)
}
