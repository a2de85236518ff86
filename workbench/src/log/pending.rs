//! A row on its way from a file.

use gyro_model::Row;

#[derive(Clone)]
/// A row with its time, before it is known whether the next one fits.
pub struct Pending {
    pub row: Row,
    pub time: i128,
    pub line: u64,
    pub marked: bool,
}
