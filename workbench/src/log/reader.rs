//! A log row by row: the same rows, checks and units for acquisition and for the offline commands.

use super::{
    LogError,
    error::{Known, Problem, listed},
    header::{Layout, near_names},
    messages,
    pending::Pending,
    row::Parsed,
    rows::{Rows, line_problem},
    skipped::{self, Times},
    tally::{RowFault, Tally},
    unit::Channel,
};
use crate::words::typed;
use gyro_model::{
    Axis, Row,
    fault::{DataFault, FaultKind},
};
use std::ops::RangeInclusive;

/// Reads rows in order. Times repeated or going back are left out, infinite values are taken as no value, both counted.
///
/// It reads one row ahead, so that a single time far ahead of its neighbours costs that row and not all after it.
pub struct Reader {
    pub(super) log: String,
    pub(super) rows_from: Rows,
    pub(super) layout: Layout,
    /// Own time of the first row, ns.
    start: Option<i128>,
    /// Own time of the last row given, ns.
    last: Option<i128>,
    pending: Option<Pending>,
    tally: Tally,
    rows: u64,
    faulty: u64,
    marked: bool,
    ended: bool,
    /// Rows left out in a row because the time had not caught up.
    behind: u64,
    /// The line of the first of them.
    behind_since: u64,
    /// Rows of the very time of the row before.
    repeats: u64,
    skip_times: Times,
    /// How many of the next rows are marked, so that two segments are not joined.
    apart: u64,
    /// The rows that cannot be read, where they are passed by.
    pub(super) torn: Option<Torn>,
    /// Lines that are passed by.
    pub(super) left_out: Vec<RangeInclusive<u64>>,
}

/// Rows that cannot be read.
#[derive(Default)]
pub struct Torn {
    /// Why the first of them cannot.
    pub first: Option<LogError>,
    /// Their lines.
    pub lines: Vec<RangeInclusive<u64>>,
}

impl Torn {
    fn add(&mut self, line: u64, why: LogError) {
        self.first.get_or_insert(why);
        match self.lines.last_mut() {
            Some(last) if *last.end() + 1 == line => *last = *last.start()..=line,
            _ => self.lines.push(line..=line),
        }
    }
}

/// A parsed row, or the column where it could not be.
type Parsing = Result<Parsed, (Option<usize>, Problem)>;

/// A row counts as jumping ahead where it lies this many times further on than the row after it.
const AHEAD: i128 = 10;
/// The first row counts as jumping ahead where it lies so much further on than the second, ns.
const FIRST_AHEAD: i128 = 1_000_000_000;
/// So many rows left out at once are a clock that was set back, not rows in the wrong order.
const SET_BACK: u64 = 10;
/// Rows without a value that keep apart what such a clock joins: more than any hole that is bridged.
const APART: u64 = 5;

impl Reader {
    /// Of what stands behind a header.
    pub(super) fn of(log: String, layout: Layout, rows_from: Rows, tally: Tally) -> Self {
        Self {
            log,
            rows_from,
            layout,
            start: None,
            last: None,
            pending: None,
            tally,
            rows: 0,
            faulty: 0,
            marked: false,
            ended: false,
            behind: 0,
            behind_since: 0,
            repeats: 0,
            skip_times: Times::default(),
            apart: 0,
            torn: None,
            left_out: Vec::new(),
        }
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

    /// The line of the header, where the text has one.
    pub(super) fn header_line(&self) -> Option<u64> {
        match &self.rows_from {
            Rows::Text { table, .. } => table.head().line,
            Rows::Ready { .. } => None,
        }
    }

    /// Where most times repeat the one before for want of digits: that, as a refusal.
    pub(super) fn few_digits(&self) -> Option<Problem> {
        let rows = self.tally.rows(RowFault::TimeGoingBack);
        let step = match &self.rows_from {
            Rows::Text { parser, .. } => parser.finest_time(),
            Rows::Ready { .. } => return None,
        };
        let share = rows as f64 / self.rows.max(1) as f64;
        (share > 0.1 && self.repeats > rows / 2 && (1e-3..1e9).contains(&step)).then_some(Problem::FewDigits {
            step,
            rows: self.repeats,
            all: self.rows,
        })
    }

    /// Times that stand in many rows, where that is what is wrong with the log.
    pub(super) fn repeated_times(&self) -> Option<Problem> {
        let faulty = self.tally.rows(RowFault::TimeGoingBack);
        let is_most = self.repeats as f64 > 0.1 * self.rows.max(1) as f64 && 10 * self.repeats > 9 * faulty;
        is_most.then_some(Problem::RepeatedTimes { rows: self.repeats, all: self.rows })
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

    /// Whether the row given last holds no gyro because the message that it was did not.
    #[must_use]
    pub fn row_is_of_reference(&self, row: &Row) -> bool {
        matches!(self.rows_from, Rows::Ready { .. }) && row.gyro.iter().all(|x| x.is_nan())
    }

    /// SHA-256 of the bytes read so far; of the whole log once the rows have ended.
    #[must_use]
    pub fn sha256(&self) -> String {
        match &self.rows_from {
            Rows::Text { table, .. } => table.source().sha256(),
            Rows::Ready { sha256, .. } => sha256.clone(),
        }
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
        match &self.rows_from {
            Rows::Text { table, .. } => faults.extend(skipped::faults(table.skipped(), &self.skip_times)),
            Rows::Ready { notes, .. } => faults.extend(notes.iter().cloned()),
        }
        if !self.layout.left_out.is_empty() {
            let left_out = &self.layout.left_out;
            let says = format!("{}: accelerations in a unit that nobody says, not read", listed(left_out));
            let count = left_out.len() as u64;
            faults.push(DataFault { kind: FaultKind::UnusedColumns, axis: None, count, first_t: None, says });
        }
        if let Some(first) = self.layout.unused_names.first() {
            faults.push(DataFault {
                kind: FaultKind::UnusedColumns,
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
            // Two messages of one instant, of which one says nothing that a log needs.
            if next.time == held.time && (is_bare(&held.row) || is_bare(&next.row)) {
                let mut both = held;
                messages::fill(&mut both.row, &next.row);
                self.pending = Some(both);
                continue;
            }
            // Two sensors of one row, each with its own time, or two rows of one instant.
            if is_apart(&held.row, &next.row) && self.last.is_none_or(|last| next.time > last) {
                if next.time == held.time {
                    let mut both = held;
                    messages::fill(&mut both.row, &next.row);
                    self.pending = Some(both);
                    continue;
                }
                self.pending = Some(held);
                return self.give(&next).map(Some);
            }
            let held_is_ahead = self.last.map_or(held.time - next.time > FIRST_AHEAD, |last| {
                next.time > last && held.time - last > AHEAD * (next.time - last)
            });
            let repeats = next.time == held.time;
            let (kept, dropped, fault) =
                if held_is_ahead { (next, held, RowFault::TimeAhead) } else { (held, next, RowFault::TimeGoingBack) };
            self.repeats += u64::from(repeats);
            self.tally.add(fault, 0, dropped.line, self.seconds(dropped.time));
            self.faulty += u64::from(!dropped.marked);
            if fault == RowFault::TimeGoingBack {
                self.behind_since = if self.behind == 0 { dropped.line } else { self.behind_since };
                self.behind += 1;
            }
            self.pending = Some(kept);
        }
    }

    /// All rows that have a time, as they stand in the file.
    pub(super) fn drain(&mut self) -> Result<Vec<Pending>, LogError> {
        let mut rows = Vec::new();
        while let Some(row) = self.parse_row()? {
            rows.push(row);
        }
        Ok(rows)
    }

    /// Goes on with these rows and these faults in place of what was drained.
    pub(super) fn go_on(&mut self, rows: Vec<Pending>, layout: Layout, more: Vec<DataFault>) {
        let mut notes: Vec<DataFault> = self.faults();
        notes.extend(more);
        let sha256 = self.sha256();
        self.rows_from = Rows::Ready { rows: rows.into_iter(), sha256, notes };
        self.tally = Tally::of_messages();
        (self.layout, self.rows, self.faulty, self.ended) = (layout, 0, 0, false);
        // They are among the notes.
        self.layout.unused_names.clear();
    }

    fn seconds(&self, time: i128) -> Option<f64> {
        self.start.map(|start| (time - start) as f64 / 1e9)
    }

    fn give(&mut self, held: &Pending) -> Result<Row, LogError> {
        let start = *self.start.get_or_insert(held.time);
        self.last = Some(held.time);
        self.marked = held.marked;
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
            let before = self.pending.as_ref().map(|row| row.time).or(self.last);
            let last = before.and_then(|time| self.seconds(time)).unwrap_or(0.0);
            let parsed = match &mut self.rows_from {
                Rows::Ready { rows, .. } => {
                    let next = rows.next();
                    self.ended = next.is_none();
                    self.rows += u64::from(next.is_some());
                    self.faulty += u64::from(next.as_ref().is_some_and(|row| row.marked));
                    return Ok(next);
                }
                Rows::Text { table, parser } => {
                    let line = table.line() + 1;
                    self.skip_times.look(table.skipped(), last);
                    let packing = table.source().packing();
                    match table.next_row() {
                        Ok(Some(row)) => {
                            self.rows += 1;
                            (row.line, parser.parse(row, &self.layout))
                        }
                        Ok(None) => {
                            self.ended = true;
                            self.skip_times.look(table.skipped(), last);
                            return Ok(None);
                        }
                        Err(error) => return Err(self.error(line, None, line_problem(error, packing))),
                    }
                }
            };
            if let Some(row) = self.timed(parsed)? {
                return Ok(Some(row));
            }
        }
    }

    /// A row with its time, its faults counted; `None` where it has no time.
    fn timed(&mut self, (line, parsed): (u64, Parsing)) -> Result<Option<Pending>, LogError> {
        let parsed = match parsed {
            _ if self.left_out.iter().any(|lines| lines.contains(&line)) => return Ok(None),
            Ok(parsed) => parsed,
            Err((column, problem)) => {
                let error = self.error(line, column, problem);
                let Some(torn) = &mut self.torn else { return Err(error) };
                torn.add(line, error);
                return Ok(None);
            }
        };
        let t = parsed.time.map_or_else(
            || self.last.and_then(|last| self.seconds(last)),
            |time| Some(self.seconds(time).unwrap_or(0.0)),
        );
        let marked = parsed.faults.iter().any(|(fault, _)| fault.costs());
        self.faulty += u64::from(marked);
        for &(fault, column) in &parsed.faults {
            self.tally.add(fault, column, line, t);
        }
        Ok(parsed.time.map(|time| Pending { row: parsed.row, time, line, marked }))
    }
}

impl Iterator for Reader {
    type Item = Result<Row, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_row().transpose()
    }
}

/// Whether a row has neither a gyro's value nor a reference's: it is another sensor's, perhaps one of which the log uses no column.
fn is_bare(row: &Row) -> bool {
    let mut of_log = row.gyro.iter().chain(&row.ref_angle).chain(&row.ref_rate).chain(&row.ref_quaternion);
    of_log.all(|x| x.is_nan())
}

/// Whether one row holds a gyro and the other one a reference, and neither both.
#[must_use]
pub fn is_apart(a: &Row, b: &Row) -> bool {
    let gyro = |row: &Row| row.gyro.iter().any(|x| x.is_finite());
    let reference = |row: &Row| {
        let mut of = row.ref_angle.iter().chain(&row.ref_rate).chain(&row.ref_quaternion);
        of.any(|x| x.is_finite())
    };
    let is = |a: &Row, b: &Row| gyro(a) && !reference(a) && reference(b) && !gyro(b);
    is(a, b) || is(b, a)
}

/// The refusal of a log whose layout has no reference.
pub(super) fn no_reference(layout: &Layout) -> Problem {
    let axis = layout.gyros().first().map_or("z", |a| a.letter());
    let near = near_names(&layout.free_names);
    let (chosen, likely) = (typed(&layout.chosen), typed(&layout.offered));
    let other = Axis::ALL.into_iter().find(|a| layout.has(Channel::RefAngle(*a)) || layout.has(Channel::RefRate(*a)));
    let has = match other {
        Some(other) => format!(
            "there is a reference on axis {other}: where gyro and reference turn about one shaft, give both the same letter"
        ),
        None if likely.is_empty() && !layout.free_names.is_empty() => {
            format!("not used: {}", listed(&layout.free_names))
        }
        None => String::new(),
    };
    Problem::NoReference { axis, known: Box::new(Known { has, chosen, likely, near }) }
}
