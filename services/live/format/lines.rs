//! Lines of text as logs have them, read by the readers of logs: whatever separates their fields, names before the values, records of
//! JSON. What stands above the header, and every line that is no row, is passed over.

use super::{
    Format, Found,
    cutter::{Cut, Cutter},
};
use crate::live::{Content, Fault};
use anyhow::anyhow;
use gyro_model::Row;
use log_readers::{
    can,
    formats::{Unread, kinds::Kinds, of_no_text},
    json::{Records, is_record_line},
    shape::{self, Shape},
    text::{CSV, Finder, Head, Sieve, Sifted, Skip, Skipped, Unescaped},
};
use std::{cell::RefCell, collections::VecDeque};
use workbench::log::{
    Advice, Layout, LogError, Maps, Options, Problem, RowFault, RowParser, Sample, advise, find_units, is_apart,
};

/// A longer line is no row, bytes.
const LONGEST: usize = 1 << 16;
/// Of a line, so much is shown.
const SHOWN: usize = 80;
/// The last lines may still be the first rows of a table, or the header and the units above them.
const MAY_BE_ROWS: usize = 8;
/// Lines that are kept to find out what they might be.
const KEPT: usize = 2000;
/// So often it is looked whether lines that were refused are of a shape.
const SHAPE_EVERY: u64 = 16;
/// Rows that are held back for their units, at least and at most, and how long of the source's own time, ns.
const HELD_AT_LEAST: usize = 200;
const HELD_AT_MOST: usize = 20_000;
const HELD_FOR_NS: i128 = 10_000_000_000;
/// Lines below a header of which none is a row: it is no header.
const BARREN: usize = 32;
/// Lines above a table.
const MOST_ABOVE: usize = 500;

/// Whether a line that is all of a stream is a whole document: a list of records, or lists within one.
fn is_document(line: &[u8]) -> bool {
    /// A record of a sensor is shorter, bytes.
    const RECORD: usize = 1000;
    let line = line.trim_ascii();
    line.len() > RECORD
        && (line.starts_with(b"{") && line.ends_with(b"}") || line.starts_with(b"[") && line.ends_with(b"]"))
}

/// Finds rows in lines.
pub struct Lines {
    maps: Maps,
    /// The columns' names, where the address says them.
    given: Option<Vec<String>>,
    cutter: Cutter,
    escapes: Unescaped,
    /// Lines that have begun so far.
    number: u64,
    /// What turns records of JSON into lines of fields, once they are known to be that.
    records: Option<Records>,
    /// Whether the strings of records hold the values.
    records_hold_text: bool,
    /// Whether a table looked as if its rows were those of several sensors in turn, and whether they are known to be of one.
    may_be_of_several: bool,
    is_of_one: bool,
    /// The same of any other shape.
    shape: Option<Box<dyn Shape>>,
    /// Refused lines after which it is looked for a shape again.
    look_again_at: u64,
    finder: Finder,
    /// Lines of the finder that were counted as none of a table.
    told: usize,
    table: Option<Table>,
    /// Rows that wait until their units are known, where no name says them.
    held: Option<Held>,
    content: Option<Content>,
    refusal: Option<Refused>,
    options: Options,
    /// The lines that were refused last.
    refused: VecDeque<Vec<u8>>,
    advised: RefCell<Option<(Looked, Option<Advice>)>>,
    /// The last line as it came, where fields are made of it.
    came: Option<Vec<u8>>,
    /// Lines that were not understood, and the last of them.
    unread: u64,
    example: String,
    /// Once bytes have come: whether they are those of another format.
    is_other: Option<bool>,
}

/// How much was looked at.
type Looked = (bool, usize, Option<u32>);

/// Where the rows stand.
struct Table {
    sieve: Sieve,
    layout: Layout,
    parser: RowParser,
    /// The last row.
    last: Option<(Row, Moment)>,
    /// What stands above the first row, and lines that are none while there is none.
    barren: Vec<Vec<u8>>,
    barren_count: usize,
}

/// The time of a row, ns: as it is written, and as it was given.
#[derive(Clone, Copy)]
struct Moment {
    as_written: i128,
    given: i128,
}

/// Rows that are held back.
struct Held {
    rows: Vec<(Row, i128)>,
    /// So many rows are looked at next.
    look_at: usize,
}

impl Default for Held {
    fn default() -> Self {
        Self { rows: Vec::new(), look_at: HELD_AT_LEAST }
    }
}

impl Held {
    /// Whether nobody waits for more: a sensor that rests for long tells no unit.
    fn is_full(&self) -> bool {
        let span = self.rows.first().zip(self.rows.last()).map_or(0, |((_, from), (_, to))| to - from);
        span > HELD_FOR_NS || self.rows.len() > HELD_AT_MOST
    }
}

impl Table {
    fn new(head: Head, layout: Layout) -> Self {
        Self {
            parser: RowParser::new(&layout, head.dialect),
            sieve: Sieve::new(head, Skipped::default()),
            layout,
            last: None,
            barren: Vec::new(),
            barren_count: 0,
        }
    }
}

/// Why what looked like a table is none.
struct Refused {
    head: Option<Head>,
    problem: Problem,
}

impl Refused {
    fn has_header(&self) -> bool {
        self.head.as_ref().is_some_and(|head| head.line.is_some())
    }
}

impl Lines {
    /// A header that is given makes one in the stream needless.
    ///
    /// # Errors
    /// A header, a column map or a `--map` that is none.
    pub fn new(header: Option<&str>, options: &Options, is_reference: bool) -> anyhow::Result<Self> {
        let wrong = |problem| LogError::new("the source", None, None, problem);
        let maps = super::maps(options, is_reference).map_err(wrong)?;
        let mut given = None;
        if let Some(header) = header {
            let names: Vec<&[u8]> = CSV.fields(header.as_bytes());
            Layout::of_names(&names, &maps)
                .map_err(|(_, problem)| anyhow!("the header {header} of the source: {problem}"))?;
            given = Some(names.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect());
        }
        Ok(Self {
            maps,
            given,
            cutter: Cutter::default(),
            escapes: Unescaped::default(),
            number: 0,
            records: None,
            records_hold_text: false,
            may_be_of_several: false,
            is_of_one: false,
            shape: None,
            look_again_at: SHAPE_EVERY,
            finder: Finder::default(),
            told: 0,
            table: None,
            held: None,
            content: None,
            refusal: None,
            options: options.clone(),
            refused: VecDeque::new(),
            advised: RefCell::new(None),
            came: None,
            unread: 0,
            example: String::new(),
            is_other: None,
        })
    }

    fn take_cut(&mut self, cut: Cut<'_>, found: &mut dyn FnMut(Found)) {
        match cut {
            Cut::Line(line) => {
                self.number += 1;
                if !line.trim_ascii().is_empty() {
                    self.line(line.trim_ascii_end(), found);
                }
            }
            Cut::TooLong(begins) => {
                if self.table.is_none() && matches!(begins.trim_ascii_start().first(), Some(b'{' | b'[')) {
                    self.not_understood(begins);
                    self.refuse(Problem::Document);
                }
                let says = format!("line {}: more than {LONGEST} bytes", self.number + 1);
                found(Found::Fault(Fault::Garbled, says));
            }
            Cut::Passed => self.number += 1,
        }
    }

    /// A line of the source.
    fn line(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        if self.records.is_none() && self.table.is_none() && is_record_line(line) {
            // One alone may be a remark of the source on itself.
            let before = self.finder.lines().position(|(line, _)| is_record_line(line));
            let is_told_in_strings = || {
                let lines = self.finder.lines().map(|(line, _)| line).chain([line]);
                self.records_hold_text || lines.filter(|line| is_record_line(line)).all(shape::tells_in_strings)
            };
            if before.is_some() && is_told_in_strings() {
                self.records_hold_text = true;
            } else if let Some(before) = before {
                self.tell(before, found);
                let mut records = Records::default();
                for (line, _) in self.finder.lines().skip(before) {
                    records.feed(line);
                    records.feed(b"\n");
                }
                self.begin_anew();
                self.records = Some(records);
            }
        }
        if self.shape.is_some() {
            return self.shaped(line, found);
        }
        let Some(records) = &mut self.records else {
            self.text(line, found);
            return self.look_for_shape(found);
        };
        self.came = Some(line.to_vec());
        let mut text = Vec::new();
        records.feed(line);
        records.feed(b"\n");
        records.write(&mut text, true);
        for line in text.split(|&b| b == b'\n').filter(|line| !line.is_empty()) {
            self.text(line, found);
        }
    }

    /// A line of a shape that is known.
    fn shaped(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        self.came = Some(line.to_vec());
        let mut text = Vec::new();
        if let Some(shape) = &mut self.shape {
            shape.line(line, &mut text);
        }
        for line in text.split(|&b| b == b'\n').filter(|line| !line.is_empty()) {
            self.text(line, found);
        }
    }

    /// Looks whether the lines that were refused are of a shape, and begins with them if so.
    fn look_for_shape(&mut self, found: &mut dyn FnMut(Found)) {
        let is_asked = self.shape.is_none() && self.given.is_none() && self.table.is_none();
        if !is_asked || self.unread < self.look_again_at {
            return;
        }
        self.look_again_at = self.unread + SHAPE_EVERY.max(self.unread / 4);
        let lines = || self.refused.iter().map(Vec::as_slice);
        self.shape = if self.records_hold_text {
            shape::of_records(lines())
        } else {
            Kinds::of_stream(lines()).or_else(|| shape::of(lines(), false))
        };
        if self.shape.is_none() {
            // The table that it looked like, of one sensor.
            if self.may_be_of_several && !std::mem::replace(&mut self.is_of_one, true) {
                let lines: Vec<Vec<u8>> = self.refused.drain(..).collect();
                self.begin_anew();
                self.unread = 0;
                for line in &lines {
                    self.text(line, found);
                }
            }
            return;
        }
        let lines: Vec<Vec<u8>> = self.refused.drain(..).collect();
        let rest: Vec<Vec<u8>> = self.finder.lines().skip(self.told).map(|(line, _)| line.to_vec()).collect();
        self.begin_anew();
        for line in lines.into_iter().chain(rest) {
            self.shaped(&line, found);
        }
    }

    /// A line of fields, of the source or of what its records mean.
    fn text(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        let Some(table) = &mut self.table else { return self.look(line, found) };
        let came = self.came.as_deref().unwrap_or(line);
        // A source without a reference may have one that nobody has named.
        if !table.layout.has_reference() && self.refused.len() < KEPT {
            self.refused.push_back(line.to_vec());
        }
        match table.sieve.sift(line, self.number, true) {
            Sifted::Blank => {}
            Sifted::Skip(Skip::HeaderAgain) => {
                found(Found::Fault(Fault::Remark, format!("line {}: the header again", self.number)));
                found(Found::Begins);
            }
            Sifted::Skip(Skip::Remark) => {
                found(Found::Fault(Fault::Remark, format!("line {}: {}", self.number, shown(came))));
            }
            Sifted::Skip(_) => self.other(Fault::Garbled, line, found),
            Sifted::Row => match table.parser.parse(table.sieve.row(line, self.number), &table.layout) {
                Ok(parsed) => {
                    for &(fault, column) in &parsed.faults {
                        let fault = match fault {
                            RowFault::TextColumn | RowFault::TimerOverflow => continue,
                            RowFault::NoTime => Fault::Time,
                            _ => Fault::Value,
                        };
                        let says = format!("line {}, column {}: {}", self.number, column + 1, shown(came));
                        found(Found::Fault(fault, says));
                    }
                    if let Some(mut time) = parsed.time {
                        table.barren.clear();
                        // Two sensors, each with a row of its own for one instant: one came after the other.
                        if let Some((row, last)) = table.last
                            && last.as_written == time
                            && is_apart(&row, &parsed.row)
                        {
                            time = last.given + 1;
                        }
                        let as_written = parsed.time.unwrap_or(time);
                        table.last = Some((parsed.row, Moment { as_written, given: time }));
                        match &mut self.held {
                            Some(held) => held.rows.push((parsed.row, time)),
                            None => found(Found::Row(parsed.row, time)),
                        }
                        self.give_held(false, found);
                    } else if self.is_none_of_a_table(line) {
                        self.look_for_shape(found);
                    }
                }
                Err((_, Problem::Length { .. })) => self.other(Fault::Cut, line, found),
                Err(_) => self.other(Fault::Garbled, line, found),
            },
        }
    }

    /// Gives the rows that were held as soon as they tell their units, or when no more are to be waited for.
    fn give_held(&mut self, is_last: bool, found: &mut dyn FnMut(Found)) {
        let Some((held, table)) = self.held.as_mut().zip(self.table.as_mut()) else { return };
        let is_over = is_last || held.is_full();
        if !is_over && held.rows.len() < held.look_at {
            return;
        }
        held.look_at = 2 * held.rows.len();
        let first = held.rows.first().map_or(0, |(_, time)| *time);
        let t_ns = |time: i128| i64::try_from(time - first).unwrap_or_default();
        let mut rows: Vec<Row> = held.rows.iter().map(|(row, time)| Row { t_ns: t_ns(*time), ..*row }).collect();
        find_units(&mut table.layout, &mut rows);
        if table.layout.has_unsaid_units() && !is_over {
            return;
        }
        let times: Vec<i128> = held.rows.drain(..).map(|(_, time)| time).collect();
        self.held = None;
        for (row, time) in rows.into_iter().zip(times) {
            found(Found::Row(Row { t_ns: 0, ..row }, time));
        }
    }

    /// A line that is no row: another header of the same channels, text, or a row that is spoilt.
    fn other(&mut self, fault: Fault, line: &[u8], found: &mut dyn FnMut(Found)) {
        let dialect = self.table.as_ref().map_or(CSV, |table| table.sieve.head().dialect);
        let head = Head::of_line(line, dialect);
        let same = |layout: &Layout| self.content.as_ref().is_some_and(|known| Content::of(layout) == *known);
        if let Some(layout) = Layout::new(&head, &self.maps).ok().filter(same) {
            found(Found::Fault(Fault::Remark, format!("line {}: another header: {}", self.number, shown(line))));
            found(Found::Begins);
            self.table = Some(Table::new(head, layout));
            return;
        }
        if self.is_none_of_a_table(line) {
            return self.look_for_shape(found);
        }
        let fault = if looks_like_numbers(line) || self.records.is_some() { fault } else { Fault::Remark };
        let came = self.came.as_deref().unwrap_or(line);
        found(Found::Fault(fault, format!("line {}: {}", self.number, shown(came))));
    }

    /// Whether what was taken for a header had none: no line below it is a row. They are looked at anew then.
    fn is_none_of_a_table(&mut self, line: &[u8]) -> bool {
        let Some(table) = self.table.as_mut().filter(|table| table.last.is_none() && self.shape.is_none()) else {
            return false;
        };
        table.barren.push(line.to_vec());
        table.barren_count += 1;
        if table.barren_count < BARREN || self.given.is_some() {
            return false;
        }
        let lines = std::mem::take(&mut table.barren);
        (self.table, self.content, self.held) = (None, None, None);
        self.refused.clear();
        for line in &lines {
            self.not_understood(line);
        }
        true
    }

    /// A line before the first row.
    fn look(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        let maps = &self.maps;
        let more = match self.given.as_ref().map(|names| Head::given(names, line)) {
            None => self.finder.take(line, self.number, &|names| maps.know(names)),
            Some(Some(head)) if let Ok(layout) = Layout::new(&head, maps) => {
                self.adopt(head, layout);
                return self.text(line, found);
            }
            Some(_) => {
                self.not_understood(line);
                let says =
                    format!("line {}, no row of the columns that the address names: {}", self.number, shown(line));
                return found(Found::Fault(Fault::Remark, says));
            }
        };
        let lines = self.finder.lines().len();
        self.tell(lines.saturating_sub(MAY_BE_ROWS), found);
        if !more {
            self.settle(found);
        } else if lines > MOST_ABOVE {
            self.begin_anew();
        }
    }

    /// Takes the lines that were looked at for the beginning of a table.
    fn settle(&mut self, found: &mut dyn FnMut(Found)) {
        let lines: Vec<(Vec<u8>, u64)> = self.finder.lines().map(|(line, number)| (line.to_vec(), number)).collect();
        let (head, problem) = match self.finder.finish(&mut Skipped::default()) {
            Ok((head, above)) => match Layout::new(&head, &self.maps) {
                // Its rows may be those of several sensors in turn, or have the parts of a time, which more of them tell.
                Ok(_)
                    if !self.is_of_one
                        && (shape::instance_column(&head).is_some() || shape::has_parts_of_a_time(&head)) =>
                {
                    lines.iter().skip(self.told).for_each(|(line, _)| self.not_understood(line));
                    self.may_be_of_several = true;
                    return self.begin_anew();
                }
                Ok(layout) => {
                    let header = head.line.unwrap_or(u64::MAX);
                    let last = lines.iter().take(above).position(|(_, number)| *number >= header).unwrap_or(above);
                    self.tell(last, found);
                    let header = lines[last..above].iter().map(|(line, _)| line.clone());
                    let before = self.refused.iter().cloned().chain(header).collect();
                    self.adopt(head, layout);
                    if let Some(table) = &mut self.table {
                        table.barren = before;
                    }
                    let number = self.number;
                    for (line, at) in &lines[above..] {
                        self.number = *at;
                        self.text(line, found);
                    }
                    self.number = number;
                    return;
                }
                Err((_, problem)) => (Some(head), problem),
            },
            Err(error) => (None, workbench::log::head_problem(error)),
        };
        self.tell(lines.len(), found);
        self.begin_anew();
        let refused = Refused { head, problem };
        if refused.has_header() || self.refusal.as_ref().is_none_or(|before| !before.has_header()) {
            self.refusal = Some(refused);
        }
    }

    fn adopt(&mut self, head: Head, layout: Layout) {
        self.content.get_or_insert_with(|| Content::of(&layout));
        self.held = layout.has_unsaid_units().then(Held::default);
        self.table = Some(Table::new(head, layout));
        self.begin_anew();
        (self.refusal, self.unread) = (None, 0);
        self.refused.clear();
    }

    /// Counts lines that were looked at, up to this one, as none of a table.
    fn tell(&mut self, until: usize, found: &mut dyn FnMut(Found)) {
        let lines: Vec<(Vec<u8>, u64)> =
            (self.finder.lines().take(until).skip(self.told)).map(|(line, number)| (line.to_vec(), number)).collect();
        self.told = self.told.max(until);
        for (line, number) in lines {
            self.not_understood(&line);
            found(Found::Fault(Fault::Remark, format!("line {number}, above the header: {}", shown(&line))));
        }
    }

    fn not_understood(&mut self, line: &[u8]) {
        self.unread += 1;
        self.refused.push_back(line.to_vec());
        if self.refused.len() > KEPT {
            self.refused.pop_front();
        }
        if self.example.is_empty() || looks_like_numbers(line) {
            self.example = shown(self.came.as_deref().unwrap_or(line));
        }
    }

    fn refuse(&mut self, problem: Problem) {
        self.refusal = Some(Refused { head: None, problem });
    }

    /// Whether what comes is no text: a file of another format, known by its first bytes, which nothing of it makes rows.
    fn is_of_no_text(&mut self, bytes: &[u8]) -> bool {
        if let Some(is_other) = self.is_other {
            return is_other;
        }
        let other = of_no_text(bytes).filter(|_| self.given.is_none());
        self.is_other = Some(other.is_some());
        let Some(Unread { what, remedy }) = other else { return false };
        self.not_understood(&bytes[..bytes.len().min(SHOWN)]);
        self.refuse(Problem::Unread { what, remedy });
        true
    }

    fn begin_anew(&mut self) {
        (self.finder, self.told) = (Finder::default(), 0);
    }
}

impl Format for Lines {
    fn take(&mut self, bytes: &[u8], found: &mut dyn FnMut(Found)) {
        if self.is_of_no_text(bytes) {
            return;
        }
        let mut cutter = std::mem::take(&mut self.cutter);
        let mut plain = Vec::with_capacity(bytes.len());
        self.escapes.take(bytes, &mut plain);
        cutter.take(&plain, LONGEST, |cut| self.take_cut(cut, found));
        self.cutter = cutter;
    }

    fn cut(&mut self, found: &mut dyn FnMut(Found)) {
        let mut cutter = std::mem::take(&mut self.cutter);
        cutter.cut(|cut| self.take_cut(cut, found));
        self.cutter = cutter;
    }

    fn end(&mut self, found: &mut dyn FnMut(Found)) {
        self.cut(found);
        let mut text = Vec::new();
        if let Some(records) = &mut self.records {
            records.feed(b"");
            records.write(&mut text, true);
        }
        if let Some(shape) = &mut self.shape {
            shape.end(&mut text);
        }
        for line in text.split(|&b| b == b'\n').filter(|line| !line.is_empty()) {
            self.text(line, found);
        }
        let only = self.finder.lines().next().map(|(line, _)| line).filter(|_| self.finder.lines().len() == 1);
        if self.table.is_none() && only.is_some_and(is_document) {
            self.refuse(Problem::Document);
        }
        // What it is was found by its beginning.
        let is_known = self.refusal.as_ref().is_some_and(|refused| refused.head.is_none());
        if self.table.is_none() && self.finder.lines().len() > 0 && !is_known {
            self.settle(found);
        }
        self.give_held(true, found);
    }

    fn needs_dbc(&self) -> bool {
        let mut lines = can::Lines::new(can::Writer::Candump);
        let last = || self.refused.iter().rev().take(MAY_BE_ROWS);
        let is_frame = |line: &Vec<u8>| matches!(lines.next(line), can::Line::Frame(_));
        self.table.is_none() && last().count() == MAY_BE_ROWS && last().all(is_frame)
    }

    fn unsure(&self) -> Option<&str> {
        self.table.as_ref()?.layout.unsure.as_deref()
    }

    fn content(&self) -> Option<&Content> {
        self.content.as_ref()
    }

    fn refusal(&self) -> Option<String> {
        if self.needs_dbc() {
            return Some("these are frames of a CAN bus: a DBC file defines their contents".to_owned());
        }
        self.refusal.as_ref().filter(|_| self.table.is_none()).map(|refused| refused.problem.found())
    }

    fn advice(&self) -> Option<Advice> {
        // It takes longer than a row: again only where much more has come.
        let much = (self.table.is_some(), self.refused.len() / 200, self.unread.checked_ilog2());
        let mut advised = self.advised.borrow_mut();
        match &*advised {
            Some((before, advice)) if *before == much => advice.clone(),
            _ => {
                let advice = self.find_advice();
                *advised = Some((much, advice.clone()));
                advice
            }
        }
    }

    fn not_understood(&self) -> Option<String> {
        let lines = if self.unread == 1 { "line" } else { "lines" };
        let is_enough = self.refusal.is_some() || self.unread >= 20;
        (self.table.is_none() && is_enough && self.unread > 0)
            .then(|| format!("not understood: {} {lines} such as `{}`", self.unread, self.example))
    }
}

impl Lines {
    fn find_advice(&self) -> Option<Advice> {
        if self.needs_dbc() {
            return None;
        }
        let head = match &self.table {
            Some(table) if table.layout.has_reference() => return None,
            Some(table) => table.sieve.head(),
            None => self.refusal.as_ref()?.head.as_ref()?,
        };
        let rows = self.refused.iter().map(Vec::as_slice);
        let advice = advise(&Sample::of(head, rows), &self.maps, self.options.reference.is_none());
        let mut options = self.options.clone();
        options.map.extend(advice.flags.iter().cloned());
        let holds = advice.flags.is_empty() || Maps::load(&options).is_ok_and(|maps| Layout::new(head, &maps).is_ok());
        (holds && !advice.why.is_empty()).then_some(advice)
    }
}

/// Whether a line consists mostly of what numbers are written with.
fn looks_like_numbers(line: &[u8]) -> bool {
    let numeric = line.iter().filter(|b| b.is_ascii_digit() || b"+-.,;eE \t".contains(b)).count();
    2 * numeric > line.len()
}

/// A line for a message: a tab as an arrow, what cannot be shown escaped.
fn shown(line: &[u8]) -> String {
    let line = line.trim_ascii();
    let more = if line.len() > SHOWN { "…" } else { "" };
    let parts = line[..line.len().min(SHOWN)].split(|&b| b == b'\t');
    let text: Vec<String> =
        parts.map(|part| std::str::from_utf8(part).map_or_else(|_| part.escape_ascii().to_string(), escaped)).collect();
    format!("{}{more}", text.join("⇥"))
}

fn escaped(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect::<Vec<_>>() } else { vec![c] }).collect()
}

#[cfg(test)]
mod tests {
    use super::{
        Fault::{self, Cut, Garbled, Remark, Time, Value},
        Format, Found, Lines, Options,
    };

    /// Rows as (time, gyro z), and faults, of a text that comes in pieces of so many bytes.
    fn read(text: &[u8], piece: usize) -> (Vec<(i128, f64)>, Vec<Fault>) {
        let mut lines = Lines::new(None, &Options::default(), false).unwrap();
        let (mut rows, mut faults) = (Vec::new(), Vec::new());
        let mut found = |found| match found {
            Found::Row(row, time) => rows.push((time, row.gyro[2])),
            Found::Fault(fault, _) => faults.push(fault),
            _ => {}
        };
        for piece in text.chunks(piece) {
            lines.take(piece, &mut found);
        }
        lines.end(&mut found);
        (rows, faults)
    }

    #[test]
    fn rows_are_found_among_boot_text_garbage_and_headers_however_the_bytes_come() {
        let text =
            b"rst:0x1 (POWERON)\r\nboot ok\nt,gyro_z,ref_angle_z\n0,0.1,1\r\n\n0.01,0.2,1\n0.02,0.3\n0.03,0.\xff4,1\n\
                     t,gyro_z,ref_angle_z\n0.04,inf,1\n,0.6,1\n0.06,0.7,1\n0.07,0.8,1";
        for piece in [1, 2, 3, 7, 1000] {
            let (rows, faults) = read(text, piece);
            let times: Vec<i128> = rows.iter().map(|r| r.0 / 10_000_000).collect();
            assert_eq!(times, [0, 1, 4, 6, 7]);
            assert!(rows[2].1.is_nan() && rows[4].1 == 0.8);
            assert_eq!(faults, [Remark, Remark, Cut, Garbled, Remark, Value, Time]);
        }
    }

    #[test]
    fn what_is_not_understood_is_shown_as_it_came() {
        let line = |k: u32| format!("#000381 T{k:05}.810 U{}.25 V{}.5", k * k % 7, k % 5);
        let text: String = (0..60).map(|k| line(k) + "\n").collect::<Vec<_>>().concat();
        let mut lines = Lines::new(None, &Options::default(), false).unwrap();
        lines.take(text.as_bytes(), &mut |_| {});
        assert!(lines.shape.is_some());
        let says = lines.not_understood().unwrap();
        assert!(says.contains("`#000381 T000"), "{says}");
    }

    #[test]
    fn parts_of_a_time_are_one_time_live_too() {
        let row = |k: u32| format!("9,14,{},{},{}.5,7\n", 20 + k / 50, k % 50 * 20, k % 3);
        let text = (0..200).map(row).collect::<Vec<_>>().concat();
        let text = format!("Hour,Minute,Second,Millisecond,gyro_z_dps,ref_angle_z_deg\n{text}");
        let (rows, _) = read(text.as_bytes(), 100);
        assert_eq!((rows.len(), rows[199].0 - rows[0].0), (200, 3_980_000_000));
    }

    #[test]
    fn a_line_without_end_costs_itself_alone() {
        let mut text = b"t,gyro_z\n0,1\n".to_vec();
        text.resize(text.len() + 200_000, b'7');
        text.extend(b"\n1,2\n");
        let (rows, faults) = read(&text, 4096);
        assert_eq!((rows.len(), faults), (2, vec![Garbled]));
    }

    #[test]
    fn a_header_in_the_address_serves_where_the_stream_has_none() {
        let mut lines = Lines::new(Some("t_ms,gyro_z_dps"), &Options::default(), false).unwrap();
        let mut rows = 0;
        lines.take(b"3,4.5\n4,4.5\n", &mut |found| rows += usize::from(matches!(found, Found::Row(..))));
        assert_eq!((rows, lines.content().unwrap().gyros.len()), (2, 1));
        assert!(Lines::new(Some("t_ms,temp"), &Options::default(), false).is_err());
    }

    #[test]
    fn rows_whose_units_no_name_says_wait_until_gyro_and_reference_tell_them() {
        use std::fmt::Write as _;
        let mut text = "t,gz,encoder_angle_z\n".to_owned();
        for k in 0..1500 {
            let t = f64::from(k) * 0.01;
            let _ = writeln!(text, "{t:.2},{:.3},{:.3}", 115.0 * (1.3 * t).cos(), 115.0 / 1.3 * (1.3 * t).sin());
        }
        let (rows, _) = read(text.as_bytes(), 1000);
        assert_eq!(rows.len(), 1500);
        assert!((rows[0].1.to_degrees() - 115.0).abs() < 0.01, "{}", rows[0].1);
        assert!(rows[1499].1.to_degrees().abs() > 50.0, "{}", rows[1499].1);
    }

    #[test]
    fn a_document_in_one_line_and_a_file_of_another_format_are_named() {
        let record = |k: usize| format!("{{\"t\":{:.2},\"gyro_z\":0.{k}}}", k as f64 * 0.01);
        let records = |count: usize| (0..count).map(record).collect::<Vec<_>>().join(",");
        let document = |count: usize| format!("{{\"samples\":[{}]}}", records(count));
        let json = "is one JSON document in one line";
        for (text, says) in [
            (document(9000), json),
            (format!("[{}]\n", records(9000)), json),
            (document(200), json),
            (format!("[{}]", records(200)), json),
        ] {
            let mut lines = Lines::new(None, &Options::default(), false).unwrap();
            for piece in text.as_bytes().chunks(1000) {
                lines.take(piece, &mut |_| {});
            }
            lines.end(&mut |_| {});
            let refusal = lines.refusal().unwrap_or_default();
            assert!(refusal.contains(says), "{refusal}");
            assert!(refusal.ends_with("truerate run --source FILE.json"), "{refusal}");
        }
        for (bytes, says) in [
            (&b"\x93NUMPY\x01\x00v\x00{'descr': '<f8'}\n\x00\x01"[..], "is a NumPy array"),
            (b"\x1f\x8b\x08\x00\x00\x00", "is packed with gzip"),
        ] {
            let mut lines = Lines::new(None, &Options::default(), false).unwrap();
            lines.take(bytes, &mut |_| {});
            lines.end(&mut |_| {});
            let refusal = lines.refusal().unwrap_or_default();
            assert!(refusal.contains(says), "{refusal}");
        }
        // One record alone is none.
        let mut lines = Lines::new(None, &Options::default(), false).unwrap();
        lines.take(b"{\"t\":0.01,\"gyro_z\":0.1}\n", &mut |_| {});
        lines.end(&mut |_| {});
        assert!(!lines.refusal().unwrap_or_default().contains(json));
    }

    #[test]
    fn a_reference_needs_no_gyro() {
        let mut lines = Lines::new(None, &Options::default(), true).unwrap();
        let mut angles = Vec::new();
        lines.take(b"boot\nt,ref_angle_z\n0,0.5\n1,0.25\n", &mut |found| {
            if let Found::Row(row, _) = found {
                assert!(row.gyro[0].is_nan());
                angles.push(row.ref_angle[2]);
            }
        });
        assert_eq!(angles, [0.5, 0.25]);
    }
}
