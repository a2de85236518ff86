//! A log row by row: the same rows, checks and units for acquisition and for the offline commands.

use super::{
    LogError, Options,
    column_map::ColumnMap,
    error::Problem,
    header::{Layout, Refusal},
    input::{Input, STANDARD_INPUT},
    row::RowParser,
    tally::{RowFault, Tally},
};
use crate::clock::now_ns;
use csv::ByteRecord;
use gyro_model::{Row, diagnosis::DataFault};
use std::path::Path;

/// Reads rows in order. Times repeated or going back are left out, infinite values are taken as no value, both counted.
///
/// It reads one row ahead, so that a single time far ahead of its neighbours costs that row and not all after it.
pub struct Reader {
    log: String,
    csv: csv::Reader<Input>,
    layout: Layout,
    record: ByteRecord,
    /// Own time of the first row, ns.
    start: Option<i128>,
    /// Own time of the last row given, ns.
    last: Option<i128>,
    pending: Option<Pending>,
    tally: Tally,
    parser: RowParser,
    rows: u64,
    faulty: u64,
    marked: bool,
    read_ns: u64,
    ended: bool,
    /// Rows left out in a row because the time had not caught up.
    behind: u64,
    /// The line of the first of them.
    behind_since: u64,
    /// Rows to come that keep apart what is no neighbour.
    apart: u64,
}

struct Pending {
    row: Row,
    time: i128,
    line: u64,
    marked: bool,
    read_ns: u64,
}

/// A row counts as jumping ahead where it lies this many times further on than the row after it.
const AHEAD: i128 = 10;
/// The first row counts as jumping ahead where it lies so much further on than the second, ns.
const FIRST_AHEAD: i128 = 1_000_000_000;
/// So many rows left out at once are a clock that was set back, not rows in the wrong order.
const SET_BACK: u64 = 10;
/// Rows without a value that keep apart what such a clock joins: more than any hole that is bridged.
const APART: u64 = 5;

impl Reader {
    /// Opens a log (`-`: standard input) and understands its header.
    ///
    /// # Errors
    /// Whatever makes the log unreadable from its first row on.
    pub fn open(path: &Path, options: &Options) -> Result<Self, LogError> {
        let log = if path == Path::new("-") { STANDARD_INPUT.to_owned() } else { path.display().to_string() };
        let refuse = |line, column, problem| LogError::new(&log, line, column, problem);
        let map = options.columns.as_deref().map(ColumnMap::load).transpose().map_err(|p| refuse(None, None, p))?;
        let input = Input::open(path).map_err(|p| refuse(None, None, p))?;
        let mut csv = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(input);
        let mut record = ByteRecord::new();
        // The first line that could have been the header and is none.
        let mut remark = None;
        let (line, layout) = loop {
            let found = csv.read_byte_record(&mut record).map_err(|e| refuse(Some(1), None, read_problem(&csv, e)))?;
            if !found {
                return Err(refuse(None, None, Problem::Empty));
            }
            let line = record.position().map(csv::Position::line);
            match header(&record, map.as_ref()) {
                Ok(layout) => break (line, layout),
                Err(refusal) if stands_above(&record) => _ = remark.get_or_insert((line, refusal)),
                Err(refusal) => {
                    let headless = matches!(refusal.1, Problem::NoHeader);
                    let (line, (column, problem)) = remark.filter(|_| headless).unwrap_or((line, refusal));
                    return Err(refuse(line, column, problem));
                }
            }
        };
        if options.needs_reference && !layout.has_reference() {
            let axis = layout.gyros().first().map_or("z", |a| a.letter());
            return Err(refuse(line, None, Problem::NoReference(axis)));
        }
        let parser = RowParser::new(&layout);
        Ok(Self {
            log,
            csv,
            layout,
            record,
            start: None,
            last: None,
            pending: None,
            tally: Tally::default(),
            parser,
            rows: 0,
            faulty: 0,
            marked: false,
            read_ns: 0,
            ended: false,
            behind: 0,
            behind_since: 0,
            apart: 0,
        })
    }

    /// What the columns hold.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The first row's own time, ns, once it has been read: what all times count from.
    #[must_use]
    pub fn start_ns(&self) -> Option<i128> {
        self.start
    }

    /// Data rows read so far, faulty ones included.
    #[must_use]
    pub fn rows_read(&self) -> u64 {
        self.rows
    }

    /// The line from which on the time went back and never caught up, of a log that has been read to its end.
    #[must_use]
    pub fn starts_again(&self) -> Option<u64> {
        (self.behind >= SET_BACK).then_some(self.behind_since)
    }

    /// Rows so far that were left out, or of which a value was.
    #[must_use]
    pub fn rows_faulty(&self) -> u64 {
        self.faulty
    }

    /// Whether a value of the row given last was taken as no value for a fault.
    #[must_use]
    pub fn row_was_marked(&self) -> bool {
        self.marked
    }

    /// When the row given last was read, ns: the row after it had to come before it was given.
    #[must_use]
    pub fn row_read_ns(&self) -> u64 {
        self.read_ns
    }

    /// SHA-256 of the bytes read so far; of the whole log once the rows have ended.
    #[must_use]
    pub fn sha256(&self) -> String {
        self.csv.get_ref().sha256()
    }

    /// The log's path, or `standard input`.
    #[must_use]
    pub fn log(&self) -> &str {
        &self.log
    }

    /// The faults so far, counted and located.
    #[must_use]
    pub fn faults(&self) -> Vec<DataFault> {
        let mut faults = self.tally.report(|column| {
            let column = &self.layout.columns[column];
            (column.name.clone(), column.channel.axis())
        });
        if let Some(first) = self.layout.unused_names.first() {
            faults.push(DataFault {
                fault: "unused-columns".to_owned(),
                axis: None,
                count: self.layout.unused_names.len() as u64,
                first_t: None,
                says: format!(
                    "{} free channels are not read, from '{first}' on: only the first {} are; put yours further left",
                    self.layout.unused_names.len(),
                    self.layout.free_names.len()
                ),
            });
        }
        faults
    }

    /// The next row, or `None` at the log's end.
    ///
    /// # Errors
    /// Text where a number should be, a row of another length, a damaged file; nothing can be read after that.
    pub fn next_row(&mut self) -> Result<Option<Row>, LogError> {
        loop {
            let Some(next) = self.parse_row()? else {
                return self.pending.take().map(|row| self.give(&row)).transpose();
            };
            let Some(held) = self.pending.take() else {
                self.pending = Some(next);
                continue;
            };
            if next.time > held.time {
                let was_set_back = std::mem::take(&mut self.behind) >= SET_BACK;
                if was_set_back {
                    self.tally.add(RowFault::SetBack, 0, next.line, self.seconds(next.time));
                }
                self.pending = Some(next);
                let row = self.give(&held).map(Some);
                if was_set_back {
                    self.apart = APART;
                }
                return row;
            }
            let held_is_ahead = self.last.map_or(held.time - next.time > FIRST_AHEAD, |last| {
                next.time > last && held.time - last > AHEAD * (next.time - last)
            });
            let (kept, dropped, fault) =
                if held_is_ahead { (next, held, RowFault::TimeAhead) } else { (held, next, RowFault::TimeGoingBack) };
            self.tally.add(fault, 0, dropped.line, self.seconds(dropped.time));
            self.faulty += u64::from(!dropped.marked);
            if fault == RowFault::TimeGoingBack {
                self.behind_since = if self.behind == 0 { dropped.line } else { self.behind_since };
                self.behind += 1;
            }
            self.pending = Some(kept);
        }
    }

    fn seconds(&self, time: i128) -> Option<f64> {
        self.start.map(|start| (time - start) as f64 / 1e9)
    }

    fn give(&mut self, held: &Pending) -> Result<Row, LogError> {
        let start = *self.start.get_or_insert(held.time);
        self.last = Some(held.time);
        self.marked = held.marked;
        self.read_ns = held.read_ns;
        let t_ns = i64::try_from(held.time - start)
            .map_err(|_| self.error(held.line, None, Problem::TimeRange(held.time.to_string())))?;
        let row = Row { t_ns, ..held.row };
        if self.apart > 0 {
            self.apart -= 1;
            self.faulty += u64::from(!self.marked);
            self.marked = true;
            let none = [f64::NAN; 3];
            return Ok(Row { gyro: none, ref_angle: none, ref_rate: none, ref_quaternion: [f64::NAN; 4], ..row });
        }
        Ok(row)
    }

    fn error(&self, line: u64, column: Option<usize>, problem: Problem) -> LogError {
        let column = column.map(|i| (i + 1, self.layout.columns[i].name.clone()));
        LogError::new(&self.log, Some(line), column, problem)
    }

    /// The next row that has a time.
    fn parse_row(&mut self) -> Result<Option<Pending>, LogError> {
        loop {
            if self.ended {
                return Ok(None);
            }
            self.csv.get_mut().next_line();
            let before = self.csv.position().line();
            let found = self.csv.read_byte_record(&mut self.record).map_err(|e| {
                let problem = read_problem(&self.csv, e);
                self.error(before, None, problem)
            })?;
            if !found {
                self.ended = true;
                return Ok(None);
            }
            self.rows += 1;
            let record = std::mem::take(&mut self.record);
            let row = self.parse(&record);
            self.record = record;
            if let Some(row) = row? {
                return Ok(Some(row));
            }
        }
    }

    /// A row with its time, its faults counted; `None` where it has no time.
    fn parse(&mut self, record: &ByteRecord) -> Result<Option<Pending>, LogError> {
        let line = record.position().map_or(0, csv::Position::line);
        let parsed = match self.parser.parse(record, &self.layout) {
            Ok(parsed) => parsed,
            Err((column, problem)) => return Err(self.error(line, column, problem)),
        };
        let t = parsed.time.map_or_else(
            || self.last.and_then(|last| self.seconds(last)),
            |time| Some(self.seconds(time).unwrap_or(0.0)),
        );
        // A text column is a note about the column; it makes no row faulty.
        let marked = parsed.faults.iter().any(|&(fault, _)| fault != RowFault::TextColumn);
        self.faulty += u64::from(marked);
        for &(fault, column) in &parsed.faults {
            self.tally.add(fault, column, line, t);
        }
        Ok(parsed.time.map(|time| Pending { row: parsed.row, time, line, marked, read_ns: now_ns() }))
    }
}

/// What a line says of the columns. NumPy puts `#` before a header.
fn header(record: &ByteRecord, map: Option<&ColumnMap>) -> Result<Layout, Refusal> {
    let mut fields: Vec<&[u8]> = record.iter().collect();
    Layout::new(&fields, map).or_else(|refusal| {
        let Some(bare) = record[0].trim_ascii().strip_prefix(b"#") else { return Err(refusal) };
        fields[0] = bare;
        Layout::new(&fields, map).map_err(|_| refusal)
    })
}

/// Whether a line is a remark, or a spreadsheet's `sep=,`, as they stand above a header.
fn stands_above(record: &ByteRecord) -> bool {
    let first = record[0].trim_ascii();
    first.starts_with(b"#") || first.get(..4).is_some_and(|first| first.eq_ignore_ascii_case(b"sep="))
}

impl Iterator for Reader {
    type Item = Result<Row, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_row().transpose()
    }
}

fn read_problem(csv: &csv::Reader<Input>, error: csv::Error) -> Problem {
    let error = match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => std::io::Error::other(format!("{other:?}")),
    };
    csv.get_ref().problem(error)
}
