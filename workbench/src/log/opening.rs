//! How a log is opened: its header understood, and its reference joined from a second file.

use super::{
    LogError, Maps, Options, Reader,
    advice::motionless,
    input::{Input, STANDARD_INPUT},
    join,
    pending::Pending,
    reader::no_reference,
    rows::{Rows, begin},
    sample::Sample,
    unsaid::{self, timed},
};
use gyro_model::Row;
use std::path::Path;

impl Reader {
    /// Opens a log (`-`: standard input) and understands its header.
    ///
    /// # Errors
    /// Whatever makes the log unreadable from its first row on.
    pub fn open(path: &Path, options: &Options) -> Result<Self, LogError> {
        let log = if path == Path::new("-") { STANDARD_INPUT.to_owned() } else { path.display().to_string() };
        let refuse = |line, column, problem| LogError::new(&log, line, column, problem);
        let mut maps = Maps::load(options).map_err(|p| refuse(None, None, p))?;
        let (mut layout, mut rows_from, mut tally, mut line) = begin(&log, path, &maps)?;
        // A name alone makes no reference of what shows no motion while the gyro turns.
        if path != Path::new("-") && layout.chosen.iter().any(|pick| pick.name.starts_with("ref_")) {
            maps.without_numbers = Input::open(path)
                .ok()
                .filter(Input::is_text)
                .and_then(Sample::of_table)
                .map_or_else(Vec::new, |sample| motionless(&sample, &maps));
            if !maps.without_numbers.is_empty() {
                (layout, rows_from, tally, line) = begin(&log, path, &maps)?;
            }
        }
        if options.needs_reference && options.reference.is_none() && !layout.has_reference() {
            return Err(refuse(line, None, no_reference(&layout)));
        }
        let mut reader = Self::of(log, layout, rows_from, tally);
        reader.left_out.clone_from(&options.left_out);
        if let Some(second) = &options.reference {
            return join::with_reference(reader, of_reference(second, options)?, second);
        }
        reader.find_units(path, &maps)?;
        Ok(reader)
    }

    /// Takes the units that nobody said, where gyro and reference agree in them.
    fn find_units(&mut self, path: &Path, maps: &Maps) -> Result<(), LogError> {
        if !self.layout.has_unsaid_units() {
            return Ok(());
        }
        match &mut self.rows_from {
            Rows::Ready { rows, .. } => {
                let mut all: Vec<Pending> = std::mem::take(rows).collect();
                let factors = unsaid::factors(&mut self.layout, &timed(&all));
                for row in &mut all {
                    unsaid::convert(&mut row.row, &factors);
                }
                *rows = all.into_iter();
            }
            // What comes only once cannot be looked through before.
            Rows::Text { .. } if path == Path::new("-") => {}
            Rows::Text { .. } => {
                let (layout, rows_from, tally, _) = begin(&self.log, path, maps)?;
                let mut first = Self::of(self.log.clone(), layout, rows_from, tally);
                first.left_out.clone_from(&self.left_out);
                // What is damaged further on is refused where it is.
                let rows: Vec<Row> =
                    std::iter::from_fn(|| first.next_row().ok().flatten()).take(unsaid::LOOKED_AT).collect();
                unsaid::factors(&mut self.layout, &rows);
            }
        }
        Ok(())
    }
}

/// Opens a file for its reference alone.
fn of_reference(path: &Path, options: &Options) -> Result<Reader, LogError> {
    let log = path.display().to_string();
    let refuse = |line, column, problem| LogError::new(&log, line, column, problem);
    let mut maps = Maps::of_reference(options).map_err(|p| refuse(None, None, p))?;
    let open = |maps: &Maps| {
        let (layout, rows_from, tally, _) = begin(&log, path, maps)?;
        Ok(Reader::of(log.clone(), layout, rows_from, tally))
    };
    let mut reader = open(&maps)?;
    let layout = reader.layout();
    if layout.gyros().is_empty()
        || layout.columns.iter().any(|column| column.channel.is_reference())
        || path == Path::new("-")
    {
        return Ok(reader);
    }
    // Rates of which the file names the columns only are no second gyro.
    let rates = layout.chosen.iter().filter(|pick| pick.name.starts_with("gyro_"));
    let rates = rates.map(|pick| pick.channel.clone()).collect();
    let mut first = std::iter::from_fn(|| reader.next_row().ok().flatten()).take(unsaid::LOOKED_AT);
    if first.all(|row| row.gyro.iter().all(|x| x.is_nan())) {
        maps.without_numbers = rates;
    }
    open(&maps)
}
