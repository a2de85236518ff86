//! The DBC file that says what the frames of a CAN log mean.

use super::error::Problem;
use crate::files;
use log_readers::can::Database;
use std::{io::Read, path::Path};

/// A longer file is none, bytes: those of whole vehicles have a few millions.
const LONGEST: u64 = 256 << 20;

/// Reads it.
///
/// # Errors
/// It cannot be read, or is none.
pub fn load(path: &Path) -> Result<Database, Problem> {
    let refuse = |says: String| Problem::Dbc { file: path.display().to_string(), says };
    let mut bytes = Vec::new();
    let file = files::open(path).map_err(|error| refuse(error.to_string()))?;
    file.take(LONGEST).read_to_end(&mut bytes).map_err(|error| refuse(error.to_string()))?;
    Database::parse(&bytes).map_err(|error| refuse(error.to_string()))
}
