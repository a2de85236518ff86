//! How a log is opened: its header understood, and its reference joined from a second file.

use super::{LogError, Maps, Options, Reader, input::STANDARD_INPUT, join, reader::no_reference, rows::begin};
use std::path::Path;

impl Reader {
    /// Opens a log (`-`: standard input) and understands its header.
    ///
    /// # Errors
    /// Whatever makes the log unreadable from its first row on.
    pub fn open(path: &Path, options: &Options) -> Result<Self, LogError> {
        let log = if path == Path::new("-") { STANDARD_INPUT.to_owned() } else { path.display().to_string() };
        let refuse = |line, column, problem| LogError::new(&log, line, column, problem);
        let maps = Maps::load(options).map_err(|p| refuse(None, None, p))?;
        let (layout, rows_from, tally, line) = begin(&log, path, &maps)?;
        if options.needs_reference && options.reference.is_none() && !layout.has_reference() {
            return Err(refuse(line, None, no_reference(&layout)));
        }
        let reader = Self::of(log, layout, rows_from, tally);
        match &options.reference {
            Some(second) => join::with_reference(reader, of_reference(second, options)?, second),
            None => Ok(reader),
        }
    }
}

/// Opens a file for its reference alone.
fn of_reference(path: &Path, options: &Options) -> Result<Reader, LogError> {
    let log = path.display().to_string();
    let refuse = |line, column, problem| LogError::new(&log, line, column, problem);
    let maps = Maps::of_reference(options).map_err(|p| refuse(None, None, p))?;
    let (layout, rows_from, tally, _) = begin(&log, path, &maps)?;
    Ok(Reader::of(log, layout, rows_from, tally))
}
