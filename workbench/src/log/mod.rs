//! Logs: CSV in, checked, in SI units; CSV out, whole or not at all.
//!
//! [`read`] takes a whole log, as the offline commands need it; [`Reader`] gives the same rows one by one, as acquisition
//! needs them. What cannot be read at all is a [`LogError`] with file, line, column and remedy; what is faulty in a log that
//! can be read is left out or marked as "no value", counted, located and reported as a
//! [`DataFault`](gyro_model::diagnosis::DataFault).

mod advice;
mod advised;
mod attitude;
pub mod channels;
mod column_map;
pub mod dbc;
pub mod dependent;
mod error;
mod folder;
mod frames;
mod gravity;
mod header;
mod input;
mod join;
mod jump;
mod lacking;
mod look;
mod made_time;
mod map;
mod messages;
mod names;
mod opening;
mod packing;
mod pending;
mod reader;
mod refused;
mod remedy;
mod row;
mod rows;
mod sample;
mod skipped;
mod tally;
#[cfg(test)]
mod tests;
mod timer;
mod unit;
mod unsaid;
mod whole;
mod words;
mod writer;

pub use advice::{advise, advise_frames};
pub use advised::{read, read_beside};
pub use error::{Known, LogError, Problem, Refused};
pub use frames::Frames;
pub use header::{Layout, Refusal};
pub use lacking::Advice;
pub use look::{Look, look};
pub use reader::{Reader, is_apart};
pub use remedy::remedy;
pub use row::{Parsed, RowParser};
pub use rows::head_problem;
pub use sample::Sample;
pub use tally::RowFault;
pub use unsaid::find_units;
pub use writer::{GrowingLog, RecordWriter, Time, create, write_record};

use column_map::ColumnMap;
use log_readers::{can::Database, meaning::Pick};
use map::MapFlag;
use std::{collections::BTreeMap, ops::RangeInclusive, path::PathBuf};
use unit::Channel;

/// How a log is to be read.
#[derive(Clone, Debug)]
pub struct Options {
    /// A column map: a TOML file that renames foreign headers.
    pub columns: Option<PathBuf>,
    /// Channels under the names of the format, `NAME=CHANNEL` each.
    pub map: Vec<String>,
    /// A second file, which the reference is taken from.
    pub reference: Option<PathBuf>,
    /// A DBC file: what the frames of a CAN log mean.
    pub dbc: Option<PathBuf>,
    /// Whether a log without an axis that has both a gyro and a reference is refused.
    pub needs_reference: bool,
    /// Whether [`read`] keeps the readings as acquisition gives them, repeats of held ones taken out and other whole-log faults
    /// only reported: for what must come out the same live and from the file.
    pub as_streamed: bool,
    /// Whether a log that is refused is looked at for what would make it one.
    pub advises: bool,
    /// Lines that are left out, to try whether the others are a log.
    pub left_out: Vec<RangeInclusive<u64>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            columns: None,
            map: Vec::new(),
            reference: None,
            dbc: None,
            needs_reference: false,
            as_streamed: false,
            advises: true,
            left_out: Vec::new(),
        }
    }
}

/// The names that channels are given.
#[derive(Default)]
pub struct Maps {
    columns: Option<ColumnMap>,
    flags: Vec<MapFlag>,
    /// What the frames of a CAN log mean.
    database: Option<Database>,
    /// Whether it is a file of a reference alone, which needs no gyro.
    reference: bool,
    /// Columns that hold no number, whatever their names say.
    without_numbers: Vec<String>,
}

impl Maps {
    /// Those of a log's own columns.
    ///
    /// # Errors
    /// A map that cannot be read, or is none.
    pub fn load(options: &Options) -> Result<Self, Problem> {
        let columns = options.columns.as_deref().map(ColumnMap::load).transpose()?;
        let flags = options.map.iter().map(|text| MapFlag::parse(text)).collect::<Result<Vec<_>, _>>()?;
        // With a second file the names of a reference mean its channels.
        let own = |flag: &MapFlag| options.reference.is_none() || !flag.is_of_reference();
        if let Some(flag) = flags.iter().find(|flag| flag.is_of_second() && options.reference.is_none()) {
            return Err(Problem::NoSecondFile(flag.text.clone()));
        }
        let flags = flags.into_iter().filter(own);
        Ok(Self {
            columns,
            flags: flags.collect(),
            database: database(options)?,
            reference: false,
            without_numbers: Vec::new(),
        })
    }

    /// Those of the second file, which the reference is taken from.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn of_reference(options: &Options) -> Result<Self, Problem> {
        let flags = options.map.iter().map(|text| MapFlag::parse(text)).collect::<Result<Vec<_>, _>>()?;
        let flags = flags.into_iter().filter(MapFlag::is_of_reference);
        Ok(Self {
            columns: None,
            flags: flags.collect(),
            database: database(options)?,
            reference: true,
            without_numbers: Vec::new(),
        })
    }

    /// The same with the names of a column map.
    ///
    /// # Errors
    /// A map that cannot be read, or is none.
    pub fn and_columns(self, options: &Options) -> Result<Self, Problem> {
        Ok(Self { columns: options.columns.as_deref().map(ColumnMap::load).transpose()?, ..self })
    }

    /// Whether these names need no further look: those of the format, or those that the maps name.
    pub fn know(&self, names: &[String]) -> bool {
        let has = |is: fn(&Channel) -> bool| {
            names.iter().any(|name| matches!(unit::name(name), unit::Name::Known(channel, _) if is(&channel)))
        };
        let own = has(|c| *c == Channel::Time) && has(|c| matches!(c, Channel::Gyro(_)) || c.is_reference());
        // A time that nobody named is known by its first rows.
        let timed = has(|c| *c == Channel::Time) || self.flags.iter().any(MapFlag::is_of_time);
        let flagged = timed && !self.flags.is_empty() && self.flags.iter().all(|flag| flag.picks(names).is_ok());
        let renamed = self.columns.as_ref().is_some_and(|map| map.rename(names).is_ok());
        own || names.len() > 1 && (flagged && self.flags.iter().all(MapFlag::is_named) || renamed)
    }

    fn is_empty(&self) -> bool {
        self.columns.is_none() && self.flags.is_empty()
    }
}

fn database(options: &Options) -> Result<Option<Database>, Problem> {
    options.dbc.as_deref().map(dbc::load).transpose()
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
    /// Channels that were taken without being named, for their own names are clear.
    pub chosen: Vec<Pick>,
    /// What is not sure of the counts that were found.
    pub unsure: Option<String>,
    /// What the log says of the vehicle, the board or the sensor: `sys_uuid`, `ver_hw`, `ver_sw`, …
    pub said: BTreeMap<String, String>,
}

/// Fewer usable rows than this are refused: nothing that is fitted to them could be trusted.
pub const FEWEST_ROWS: usize = 100;

/// A larger share of faulty rows than this is refused.
pub const FAULTY_SHARE: f64 = 0.1;
