//! Parquet files as the table of text that they mean: bytes in, CSV out. What names and units say is for whoever reads the CSV.
//!
//! ```text
//! t: TIMESTAMP(us), imu: { gz: DOUBLE }, accel: LIST<FLOAT>       t,imu.gz,accel.x,accel.y,accel.z
//!                                                           →     2026-11-25 12:30:00.000005,0.1,0,0,9.8125
//! ```
//!
//! | module | noun |
//! | --- | --- |
//! | [`mod@columns`] | the columns of a schema: names, widths, kinds of values |
//! | `cell` | one value as a field of a CSV |
//! | `pages` | the pages of a column, unpacked |
//! | `batch` | some rows of one column |
//! | `guard` | what decoding panics of is an error |
//! | [`mod@rows`] | a file as lines |
//!
//! A field that is null is empty. A group's fields are `GROUP.FIELD`; a list of three numbers is `.x`, `.y`, `.z`, of another length its items
//! are numbered from 0. Times of the types TIMESTAMP, DATE, TIME and INT96 are written as dates and times of day.

mod batch;
mod cell;
pub mod columns;
mod guard;
mod pages;
pub mod rows;

pub use rows::{Rows, Unusable};

/// What a file begins and ends with.
pub const MAGIC: [u8; 4] = *b"PAR1";

/// What one begins with whose footer is encrypted.
pub const ENCRYPTED: [u8; 4] = *b"PARE";
