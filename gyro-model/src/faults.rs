//! Faults of the data, as against physics: found over a whole log, counted, located, and taken out where that is possible.
//!
//! | file | faults | judged by |
//! | --- | --- | --- |
//! | `missing`, `timing`, `bursts` | `non-finite`, `dropouts`, `timestamp-jitter`, `burst-timestamps` | the log's own rate |
//! | `held`, `repeated` | `held-samples`, `repeated-samples` | how often readings are alike |
//! | `markers` | `markers`: one value that stands for none | readings on both sides, and the reference |
//! | `wrapped` | `wrapped`: the other sign beyond the range | jumps of one size, and the reference |
//! | `spikes`, `torn` | `outliers`, `torn-readings` | their neighbours' cubic (`neighbours`), at the noise of the log |
//! | `jumps` | `reference-jumps`, a clock that was set | the gyro's integral |
//! | `crossings` | `reference-jumps`: readings made across an angle's wrap | the gyro's integral |
//! | `ratio` | `wrong-ratio` | α of a model, once it is fitted |
//! | `told` | `dependent-reference`: a command | how alike its steps are |
//! | `own` | `dependent-reference`: a copy or filter of the gyro, the yaw of a filter | what the gyro's readings leave of it |
//! | `stuck`, `frozen` | `stuck-channel` | the other sensor, and the jump as it goes on |
//! | `hung` | `stuck-channel` of all channels at once | their own noise before |
//! | `orientation` | `turned-reference`: axes turned against the gyro's | the gyro's rates about all three axes |
//! | `reference`, `orientation` | `wrong-unit`, `wrong-sign`, `swapped-axes`, `not-excited` | the other sensor |
//!
//! Thresholds stand in `thresholds`, each with its unit and reason. How often clean logs are flagged:
//! `cargo run --release -p gyro-model --example false_faults`.
//!
//! What a fault must not be mistaken for: a quantised sensor at rest repeats its reading; a dead zone gives many zeros;
//! saturation holds the reading at the range's end; backlash holds the encoder at reversals; an encoder slower than the
//! gyro leaves rows without value. None of these is reported here.

mod bursts;
mod channel;
mod crossings;
mod frozen;
pub mod held;
mod hung;
mod jumps;
mod markers;
mod missing;
mod motion;
mod neighbours;
mod orientation;
mod own;
pub(crate) mod ratio;
mod reference;
mod repeated;
mod spikes;
pub mod stuck;
#[cfg(test)]
mod tests;
mod thresholds;
mod timing;
mod told;
mod torn;
mod witness;
mod wrapped;

pub use orientation::{Meant, meant};
pub use ratio::is_wrong as is_wrong_ratio;
pub(crate) use reference::regress;
pub use reference::{FASTEST, TimeUnit, followed, ratio_to_reference, time_unit};

use crate::{
    Axis, Record,
    fault::{DataFault, FaultKind},
    order::quantile,
    streams,
};

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The faults, counted and located.
    pub faults: Vec<DataFault>,
    /// Rows of which a reading is missing or was taken out.
    pub rows_marked: u64,
    /// Row by row, whether it was counted as faulty before.
    already: Vec<bool>,
}

/// Looks for one kind of fault, takes out what is certainly wrong, and reports it.
type Check = fn(&mut Record, &mut Report);

/// One check after the other: what one takes out the next ones do not see.
static CHECKS: &[Check] = &[
    missing::check,
    timing::check,
    held::check,
    markers::check,
    wrapped::check,
    crossings::check,
    repeated::check,
    spikes::check,
    orientation::check,
    frozen::check,
    hung::check,
    pair,
    jumps::check,
    stuck::check,
    told::check,
    own::check,
    reference::check,
];

/// Checks a whole log. Readings that are certainly wrong (single spikes, repeated samples) become "no value" in `record`.
///
/// `already` tells, row by row, which ones were counted as faulty before (empty: none); they are not counted again.
pub fn check(record: &mut Record, already: &[bool]) -> Report {
    let mut already = already.to_vec();
    already.resize(record.len(), false);
    let mut report = Report { already, ..Report::default() };
    // Nothing is searched by times that are too far apart: a check that goes by seconds would go through years.
    let unit = time_unit(record);
    if let Some(unit) = unit {
        report.add(FaultKind::WrongUnit, record.len() as u64, Some(0.0), unit.says());
        record.rows.iter_mut().for_each(|row| row.t_ns /= unit.in_a_second);
    }
    for check in CHECKS {
        check(record, &mut report);
    }
    if let Some(unit) = unit {
        record.rows.iter_mut().for_each(|row| row.t_ns = row.t_ns.saturating_mul(unit.in_a_second));
    }
    report
}

/// Makes one row of two that are one instant. What a sensor does by itself (a reading that repeats, its steps) is seen before: in its
/// own readings, not in what is carried to the reference's times.
fn pair(record: &mut Record, report: &mut Report) {
    if let Some(last) = streams::paired(record) {
        let from = std::iter::once(0).chain(last.iter().map(|k| k + 1));
        report.already = from.zip(&last).map(|(from, &last)| report.already[from..=last].contains(&true)).collect();
    }
}

impl Report {
    /// Counts a row of which a reading is missing or was taken out, once.
    fn mark(&mut self, row: usize) {
        if let Some(flag) = self.already.get_mut(row)
            && !std::mem::replace(flag, true)
        {
            self.rows_marked += 1;
        }
    }

    /// A fault of the log as a whole.
    fn add(&mut self, kind: FaultKind, count: u64, first_t: Option<f64>, says: String) {
        self.add_for(None, kind, count, first_t, says);
    }

    /// A fault of one axis.
    fn add_on(&mut self, axis: Axis, kind: FaultKind, count: u64, first_t: Option<f64>, says: String) {
        self.add_for(Some(axis), kind, count, first_t, says);
    }

    fn add_for(&mut self, axis: Option<Axis>, kind: FaultKind, count: u64, first_t: Option<f64>, says: String) {
        self.faults.push(DataFault { kind, axis, count, first_t, says });
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
