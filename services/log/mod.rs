//! Logs: CSV in, checked, in SI units; CSV out, whole or not at all.
//!
//! [`read`] takes a whole log, as the offline commands need it; [`Reader`] gives the same rows one by one, as acquisition
//! needs them. What cannot be read at all is a [`LogError`] with file, line, column and remedy; what is faulty in a log that
//! can be read is left out or marked as "no value", counted, located and reported as a
//! [`DataFault`](gyro_model::diagnosis::DataFault).

mod column_map;
mod error;
mod header;
mod input;
mod jump;
mod number;
mod reader;
mod row;
mod tally;
#[cfg(test)]
mod tests;
mod unit;
mod whole;
mod writer;

pub use column_map::ColumnMap;
pub use error::{LogError, Problem, Refused};
pub use header::{Layout, Refusal};
pub use reader::Reader;
pub use row::{Parsed, RowParser};
pub use tally::RowFault;
pub use whole::read;
pub use writer::{RecordWriter, Time, create, write_record};

use std::path::PathBuf;

/// How a log is to be read.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// A column map: a TOML file that renames foreign headers.
    pub columns: Option<PathBuf>,
    /// Whether a log without an axis that has both a gyro and a reference is refused.
    pub needs_reference: bool,
    /// Whether [`read`] keeps the readings as acquisition gives them, repeats of held ones taken out and other whole-log faults
    /// only reported: for what must come out the same live and from the file.
    pub as_streamed: bool,
}

/// Where a model's numbers come from: the log, and what it held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// The log's name, without its folder.
    pub log: String,
    /// SHA-256 of the log's bytes as stored, in hexadecimal.
    pub sha256: String,
    /// Rows in use.
    pub samples: u64,
    /// Lowest and highest temperature, °C.
    pub temperature: Option<(f64, f64)>,
    /// Median supply voltage, V.
    pub supply: Option<f64>,
    /// The first row's own time, ns: what all other times count from.
    pub start_ns: i128,
}

/// Fewer usable rows than this are refused: nothing that is fitted to them could be trusted.
pub const FEWEST_ROWS: usize = 100;

/// A larger share of faulty rows than this is refused.
pub const FAULTY_SHARE: f64 = 0.1;
