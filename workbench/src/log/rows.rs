//! Where rows come from: a text, row by row, or messages that were put in order.

use super::{
    LogError, Maps,
    error::Problem,
    folder,
    header::Layout,
    input::Input,
    messages::{self, Messages},
    packing::Packing,
    pending::Pending,
    row::RowParser,
    tally::Tally,
};
use gyro_model::diagnosis::DataFault;
use log_readers::{
    formats::Unread,
    text::{HeadError, LONGEST_LINE, LineError, Table},
};
use std::path::Path;

/// Where rows come from.
pub enum Rows {
    /// A text, row by row.
    Text { table: Box<Table<Input>>, parser: RowParser },
    /// Messages that were put in order.
    Ready { rows: std::vec::IntoIter<Pending>, sha256: String, notes: Vec<DataFault> },
}

/// What the columns or channels of a file hold, where its rows come from, and the line of its header.
pub fn begin(log: &str, path: &Path, maps: &Maps) -> Result<(Layout, Rows, Tally, Option<u64>), LogError> {
    let refuse = |line, column, problem| LogError::new(log, line, column, problem);
    let of_file = |problem| refuse(None, None, problem);
    let files = folder::files(path).map_err(of_file)?;
    let input = Input::open(&files[0]).map_err(of_file)?;
    if !input.is_text() {
        let Messages { layout, rows, tally, sha256, notes } =
            messages::read(&files, input, maps).map_err(|(column, problem)| refuse(None, column, problem))?;
        return Ok((layout, Rows::Ready { rows: rows.into_iter(), sha256, notes }, tally, None));
    }
    if let Some(Unread { what, remedy }) = input.unread() {
        return Err(of_file(Problem::Unread { what, remedy }));
    }
    let packing = input.packing();
    let table = Table::open(input, &|names| maps.know(names)).map_err(|error| {
        let line = if let HeadError::DecimalCommas { line, .. } = error { Some(line) } else { None };
        match error {
            HeadError::Line(error) => refuse(Some(1), None, line_problem(error, packing)),
            error => refuse(line, None, head_problem(error)),
        }
    })?;
    let head = table.head();
    let line = head.line.or(Some(1));
    let layout = Layout::new(head, maps).map_err(|(column, problem)| refuse(line, column, problem))?;
    let parser = RowParser::new(&layout, table.dialect());
    Ok((layout, Rows::Text { table: Box::new(table), parser }, Tally::default(), line))
}

/// Why a text has no table.
#[must_use]
pub fn head_problem(error: HeadError) -> Problem {
    match error {
        HeadError::Empty => Problem::Empty,
        HeadError::DecimalCommas { found, names, .. } => Problem::DecimalCommas { found, wanted: names },
        HeadError::Line(error) => line_problem(error, Packing::Plain),
    }
}

/// What a line that cannot be read means.
pub fn line_problem(error: LineError, packing: Packing) -> Problem {
    match error {
        LineError::TooLong => Problem::LongLine(LONGEST_LINE),
        LineError::Read(error) => Problem::reading(error, packing),
    }
}
