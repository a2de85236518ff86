//! JSON as a table: a record a line, or records in a list, as the CSV that they mean.
//!
//! ```text
//! {"t": 0.01, "gyro": {"x": 0.1, "z": -2}, "angle": 3}        t,gyro.x,gyro.z,angle
//! {"t": 0.02, "gyro": {"x": 0.2, "z": -1}}              →     0.01,0.1,-2,3
//!                                                             0.02,0.2,-1,
//! ```
//!
//! Before each record may stand a topic, as `mosquitto_sub -v` writes it: names of several topics are told apart by it.
//! A list of three numbers is x, y, z; of another length, its items are numbered from 0. The columns are those of the first records.

mod record;
mod senml;
mod sensors;

pub(crate) use record::write_text;
pub use sensors::{is_of_sensors, table_of_sensors};

use crate::{
    meaning::{What, understand},
    text::stamp,
};
use record::Cell;
use std::{
    collections::{HashMap, HashSet},
    io::{self, Read},
};

/// Bytes of a record at most.
const LONGEST: usize = 1 << 16;
/// Records, and bytes of them, that the columns are taken from.
const LOOKED_AT: (usize, usize) = (500, 1 << 20);
/// Columns of a table at most.
const MOST_COLUMNS: usize = 2000;
/// Bytes that are asked for at once.
const PIECE: usize = 1 << 16;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Whether a file that begins like this holds records, one after the other: not one record of whole columns.
#[must_use]
pub fn is_records(start: &[u8]) -> bool {
    let whole = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start).trim_ascii_start();
    let line = whole.split(|&b| b == b'\n').next().unwrap_or_default();
    if is_of_sensors(whole) {
        return false;
    }
    // A topic before each record.
    let start = prefixed(line).filter(|at| *at > 0).map_or(whole, |at| &whole[at..]);
    let first = match start.strip_prefix(b"[") {
        Some(rest) => rest.trim_ascii_start(),
        None => start,
    };
    let Some(after) = first.strip_prefix(b"{").map(<[u8]>::trim_ascii_start) else { return false };
    let Some(name) = after.strip_prefix(b"\"") else { return false };
    let Some(end) = name.iter().position(|&b| b == b'"') else { return true };
    let Some(value) = name[end + 1..].trim_ascii_start().strip_prefix(b":").map(<[u8]>::trim_ascii_start) else {
        return name[end + 1..].trim_ascii().is_empty();
    };
    // Columns by name: `{"t": {"0": …` and `{"t": [0, …`, as data frames are written; or a list of records within one.
    let is_number = |key: &[u8]| !key.is_empty() && key.iter().all(u8::is_ascii_digit);
    let key = |inner: &[u8]| inner.trim_ascii_start().strip_prefix(b"\"")?.split(|&b| b == b'"').next().map(is_number);
    let is_columns = value.strip_prefix(b"{").is_some_and(|inner| is_number(&name[..end]) || key(inner) == Some(true));
    // Records a line, of which the first begins with a list.
    let is_line = || {
        let next = whole.splitn(2, |&b| b == b'\n').nth(1).unwrap_or_default().trim_ascii_start();
        is_record_line(line) && prefixed(next.split(|&b| b == b'\n').next().unwrap_or_default()).is_some()
    };
    !is_columns && (!value.starts_with(b"[") || is_line())
}

/// Whether records stand below other text: two of the first whole lines that are not blank are such, one after the other.
#[must_use]
pub fn is_records_below(start: &[u8]) -> bool {
    let whole = start.iter().rposition(|&b| b == b'\n').map_or(&b""[..], |end| &start[..end]);
    let lines: Vec<&[u8]> = whole.split(|&b| b == b'\n').filter(|line| !line.trim_ascii().is_empty()).collect();
    lines.windows(2).any(|pair| pair.iter().all(|line| is_record_line(line)))
}

/// A line of a stream as a record: where what stands before it ends, a topic or a stamp, and whether it is one.
#[must_use]
pub fn is_record_line(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    prefixed(line).is_some_and(|at| record::cells(&line[at..]).is_some_and(|cells| !cells.is_empty()))
}

/// Where the record begins in a line before which something else stands: an MQTT topic, as `mosquitto_sub -v` writes it.
fn prefixed(line: &[u8]) -> Option<usize> {
    const LONGEST_PREFIX: usize = 200;
    let at = line.iter().take(LONGEST_PREFIX).position(|&b| b == b'{')?;
    let (before, after) = (&line[..at], line[at + 1..].trim_ascii_start());
    // `{'t': …` and `{TimeUS : …`, as scripts print them.
    let word = after.iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count();
    let is_named = word > 0 && after[word..].trim_ascii_start().starts_with(b":");
    let opens = after.first().is_none_or(|&b| matches!(b, b'"' | b'\'' | b'}')) || is_named;
    let is_prefix = before.is_empty()
        || before.ends_with(b" ") && !before.contains(&b'"') && !matches!(before[0], b'#' | b'%' | b'/');
    (opens && is_prefix).then_some(at)
}

/// Records as lines of a CSV, whoever has their bytes: a file or a stream. What is no record stands in a line of its own.
#[derive(Default)]
pub struct Records {
    /// Bytes from the first that is not used yet.
    bytes: Vec<u8>,
    from: usize,
    ended: bool,
    columns: HashMap<(String, String), usize>,
    count: usize,
    /// What the columns are taken from.
    first: Vec<Part>,
    looked_at: usize,
    /// Kinds of records so far: the names in them, and how many there were of each.
    kinds: HashMap<Vec<String>, usize>,
    /// Parts of a record that have a time each.
    clocks: Vec<String>,
    begun: bool,
    /// What records of SenML count from.
    base: senml::Base,
}

/// A part of the source.
enum Part {
    /// A record's cells, and the topic before it.
    Record(String, Vec<(String, Cell)>),
    /// What stands where a record should.
    Other(Vec<u8>),
}

impl Records {
    /// Takes bytes; none at all: there are no more.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.ended |= bytes.is_empty();
        self.bytes.drain(..self.from);
        self.from = 0;
        let bytes = if self.begun || !self.first.is_empty() {
            bytes
        } else {
            bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)
        };
        self.bytes.extend_from_slice(bytes);
    }

    /// Adds the lines of what has come to `out`, below their header; of a stream the columns are settled after a few records.
    pub fn write(&mut self, out: &mut Vec<u8>, is_stream: bool) {
        while let Some(part) = self.next_part(is_stream) {
            if self.begun {
                self.line(part, out);
                continue;
            }
            if let Part::Record(topic, cells) = &part {
                let mut kind: Vec<String> = cells.iter().map(|(name, _)| name.clone()).collect();
                self.looked_at += kind.iter().map(|name| name.len() + size_of::<Cell>()).sum::<usize>();
                kind.push(topic.clone());
                *self.kinds.entry(kind).or_default() += 1;
            }
            self.looked_at += usize::from(matches!(part, Part::Other(_)));
            self.first.push(part);
            let full = self.first.len() >= LOOKED_AT.0 || self.looked_at >= LOOKED_AT.1;
            if full || is_stream && self.is_settled() {
                self.begin(out);
            }
        }
        if self.ended && !self.begun {
            self.begin(out);
        }
    }

    /// Whether each kind of record of a stream has come often enough to expect no other.
    fn is_settled(&self) -> bool {
        const EACH: usize = 3;
        const OF_STREAM: usize = 12;
        self.first.len() >= OF_STREAM && self.kinds.values().all(|count| *count >= EACH)
            || self.first.len() >= 8 * OF_STREAM
    }

    /// Takes the columns from the first records, and writes the header and their lines.
    fn begin(&mut self, out: &mut Vec<u8>) {
        self.begun = true;
        let first = std::mem::take(&mut self.first);
        let records = first.iter().filter_map(|part| match part {
            Part::Record(topic, cells) => Some((topic, cells)),
            Part::Other(_) => None,
        });
        // A name of several topics is told apart by them; a time is one time.
        let mut topics: HashMap<&str, HashSet<&str>> = HashMap::new();
        for (topic, cells) in records.clone() {
            for (name, _) in cells {
                topics.entry(name).or_default().insert(topic);
            }
        }
        let is_time = |name: &str| understand(name, None).is_some_and(|meaning| meaning.what == What::Time);
        let times: Vec<&str> = topics.keys().copied().filter(|name| is_time(name)).collect();
        self.clocks = clocks(&times);
        let mut names: Vec<String> = Vec::new();
        for (topic, cells) in records {
            for (name, _) in cells {
                let place = (topic.clone(), name.clone());
                if self.columns.contains_key(&place) || names.len() >= MOST_COLUMNS {
                    continue;
                }
                let apart = topics.get(name.as_str()).is_some_and(|topics| topics.len() > 1) && !is_time(name);
                let own_clock = self.clocks.iter().any(|part| is_time_of(part, name) && times.contains(&name.as_str()));
                let full = if own_clock {
                    // The times of all parts are one column.
                    CLOCK.to_owned()
                } else if apart {
                    format!("{topic}.{name}")
                } else {
                    name.clone()
                };
                let column = names.iter().position(|known| *known == full).unwrap_or_else(|| {
                    names.push(full);
                    names.len() - 1
                });
                self.columns.insert(place, column);
            }
        }
        self.count = names.len();
        for (k, name) in names.iter().enumerate() {
            if k > 0 {
                out.push(b',');
            }
            write_text(out, name);
        }
        out.push(b'\n');
        for part in first {
            self.line(part, out);
        }
    }

    /// Writes a part's line.
    fn line(&mut self, part: Part, out: &mut Vec<u8>) {
        match part {
            Part::Record(topic, cells) if !self.clocks.is_empty() => {
                for cells in self.apart(cells) {
                    self.row(topic.clone(), cells, out);
                }
            }
            Part::Record(topic, cells) => self.row(topic, cells, out),
            Part::Other(bytes) => {
                out.extend(bytes.iter().map(|&b| if b == b'\n' || b == b'\r' { b' ' } else { b }));
                out.push(b'\n');
            }
        }
    }

    /// The parts of a record that have a time each, in the order of these; what has none stands with the first.
    fn apart(&self, cells: Vec<(String, Cell)>) -> Vec<Vec<(String, Cell)>> {
        let mut parts: Vec<(f64, Vec<(String, Cell)>)> = vec![(f64::NEG_INFINITY, Vec::new()); self.clocks.len() + 1];
        for (name, cell) in cells {
            let place = self.clocks.iter().position(|part| is_of(part, &name)).map_or(0, |place| place + 1);
            if place > 0 && is_time_of(&self.clocks[place - 1], &name) {
                parts[place].0 = cell.number().unwrap_or(f64::NEG_INFINITY);
            }
            parts[place].1.push((name, cell));
        }
        parts.retain(|(_, cells)| !cells.is_empty());
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut parts: Vec<Vec<(String, Cell)>> = parts.into_iter().map(|(_, cells)| cells).collect();
        if parts.len() > 1 && parts[0].iter().all(|(name, _)| self.clocks.iter().all(|part| !is_of(part, name))) {
            let without = parts.remove(0);
            parts[0].extend(without);
        }
        parts
    }

    /// Writes a row of cells.
    fn row(&self, topic: String, cells: Vec<(String, Cell)>, out: &mut Vec<u8>) {
        let mut row: Vec<Option<Cell>> = vec![None; self.count];
        let mut place = (topic, String::new());
        for (name, cell) in cells {
            place.1 = name;
            if let Some(&column) = self.columns.get(&place) {
                row[column] = Some(cell);
            }
        }
        for (k, cell) in row.iter().enumerate() {
            if k > 0 {
                out.push(b',');
            }
            if let Some(cell) = cell {
                cell.write(out);
            }
        }
        out.push(b'\n');
    }

    /// The next record, or what stands in its place up to the end of its line; `None` where more has to come first. In a stream a record
    /// stands in one line.
    fn next_part(&mut self, is_stream: bool) -> Option<Part> {
        loop {
            // Between records.
            let rest = &self.bytes[self.from..];
            self.from += rest
                .iter()
                .position(|&b| !(b.is_ascii_whitespace() || matches!(b, b',' | b'[' | b']')))
                .unwrap_or(rest.len());
            let rest = &self.bytes[self.from..];
            let line = rest.iter().take(LONGEST).position(|&b| b == b'\n').unwrap_or(rest.len().min(LONGEST));
            let is_line = line < rest.len() || self.ended;
            if rest.is_empty() || is_stream && !is_line {
                return None;
            }
            let begins = prefixed(&rest[..line]);
            let within = if is_stream { line } else { rest.len() };
            let length = begins.map_or(Length::None, |at| record_length(&rest[at..within]));
            match length {
                Length::Open if within < LONGEST && !self.ended && !is_stream => return None,
                Length::Closed(length) => {
                    let at = begins.unwrap_or_default();
                    if let Some(cells) = record::cells(&rest[at..at + length]) {
                        let (topic, cells) = with_stamp(&rest[..at], self.base.resolved(cells));
                        self.from += at + length;
                        return Some(Part::Record(topic, cells));
                    }
                }
                _ => {}
            }
            if !is_line && line < LONGEST {
                return None;
            }
            let other = rest[..line].to_vec();
            self.from += line;
            if !other.trim_ascii().is_empty() {
                return Some(Part::Other(other));
            }
        }
    }
}

/// The topic before a record, and its cells with the time that a logger put before it, where they have none.
fn with_stamp(before: &[u8], mut cells: Vec<(String, Cell)>) -> (String, Vec<(String, Cell)>) {
    // A line goes on behind its stamp.
    let line = [before, b"{"].concat();
    let Some(found) = stamp(&line) else {
        let topic = message_of(&mut cells);
        return (topic.unwrap_or_else(|| String::from_utf8_lossy(before.trim_ascii()).into_owned()), cells);
    };
    let has_time =
        cells.iter().any(|(name, _)| understand(name, None).is_some_and(|meaning| meaning.what == What::Time));
    if !has_time {
        let time = String::from_utf8_lossy(&line[found.time]).into_owned();
        cells.insert(0, (if found.in_ms { "time [ms]" } else { "time" }.to_owned(), Cell::Text(time)));
    }
    let mut topic = String::from_utf8_lossy(line[found.end..line.len() - 1].trim_ascii()).into_owned();
    if let Some(number) = number_of(&mut cells) {
        topic = format!("{topic}[{number}]");
    }
    (topic, cells)
}

/// The number of a sensor among those of its kind, which ArduPilot gives in a field; the field goes.
fn number_of(cells: &mut Vec<(String, Cell)>) -> Option<f64> {
    let place = cells.iter().position(|(name, cell)| name == "I" && matches!(cell, Cell::Integer(_)))?;
    cells.remove(place).1.number()
}

/// The kind of a message that says it of itself, `{"meta": {"type": "IMU"}, "data": {"I": 0, …}}` as pymavlink writes logs; its values are
/// those of the message then.
fn message_of(cells: &mut Vec<(String, Cell)>) -> Option<String> {
    let place = cells.iter().position(|(name, cell)| name == "meta.type" && matches!(cell, Cell::Text(_)))?;
    let Cell::Text(kind) = cells.remove(place).1 else { return None };
    for (name, _) in cells.iter_mut() {
        if let Some(own) = name.strip_prefix("data.") {
            *name = own.to_owned();
        }
    }
    Some(number_of(cells).map_or_else(|| kind.clone(), |number| format!("{kind}[{number}]")))
}

/// What the column of several times is called.
const CLOCK: &str = "timestamp";

/// Parts of records that have a time each, where no time is that of the whole record.
fn clocks(times: &[&str]) -> Vec<String> {
    let mut parts: Vec<String> = times.iter().filter_map(|name| Some(name.rsplit_once('.')?.0.to_owned())).collect();
    parts.sort();
    parts.dedup();
    let is_inside = |part: &String| times.iter().all(|name| is_of(part, name));
    if parts.len() < 2 || times.iter().any(|name| !name.contains('.')) || parts.iter().any(is_inside) {
        parts.clear();
    }
    parts
}

/// Whether a name is within a part of a record.
fn is_of(part: &str, name: &str) -> bool {
    name.strip_prefix(part).is_some_and(|rest| rest.starts_with('.'))
}

/// Whether a name is that of a part's time, not of something further inside.
fn is_time_of(part: &str, name: &str) -> bool {
    is_of(part, name)
        && !name[part.len() + 1..].contains('.')
        && understand(name, None).is_some_and(|meaning| meaning.what == What::Time)
}

/// How long a record is.
enum Length {
    /// Up to the brace that closes the first one.
    Closed(usize),
    /// It goes on.
    Open,
    /// There is none.
    None,
}

/// Bytes up to the brace that closes the first one.
fn record_length(bytes: &[u8]) -> Length {
    let (mut depth, mut quoted, mut escaped) = (0_usize, false, false);
    for (at, &b) in bytes.iter().take(LONGEST).enumerate() {
        match b {
            _ if escaped => escaped = false,
            b'\\' if quoted => escaped = true,
            b'"' => quoted = !quoted,
            b'{' if !quoted => depth += 1,
            b'}' if !quoted => {
                depth -= 1;
                if depth == 0 {
                    return Length::Closed(at + 1);
                }
            }
            _ => {}
        }
    }
    if bytes.len() < LONGEST { Length::Open } else { Length::None }
}

/// The bytes of JSON turned into those of a CSV, a record a line. What is no record stands in a line of its own.
pub struct AsCsv<R> {
    source: R,
    records: Records,
    piece: Vec<u8>,
    ended: bool,
    /// Lines that wait, and how much of them was given.
    text: Vec<u8>,
    given: usize,
}

impl<R: Read> AsCsv<R> {
    /// Of a source, from its first byte on.
    pub fn new(source: R) -> Self {
        Self { source, records: Records::default(), piece: vec![0; PIECE], ended: false, text: Vec::new(), given: 0 }
    }
}

impl<R: Read> Read for AsCsv<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.given == self.text.len() {
            if self.ended {
                return Ok(0);
            }
            self.text.clear();
            self.given = 0;
            let come = match self.source.read(&mut self.piece) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                other => other?,
            };
            self.ended = come == 0;
            self.records.feed(&self.piece[..come]);
            self.records.write(&mut self.text, false);
        }
        let n = buffer.len().min(self.text.len() - self.given);
        buffer[..n].copy_from_slice(&self.text[self.given..self.given + n]);
        self.given += n;
        Ok(n)
    }
}

/// Makes names of one record differ that are written there twice.
fn distinct(cells: &mut Vec<(String, Cell)>) {
    let mut seen = HashSet::new();
    cells.retain(|(name, _)| seen.insert(name.clone()));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(json: &str) -> String {
        let mut text = String::new();
        AsCsv::new(json.as_bytes()).read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn records_become_rows_with_a_column_for_each_number() {
        let lines =
            "{\"t\": 0.01, \"gyro\": {\"x\": 0.1, \"z\": -2}, \"on\": true}\n{\"t\": 0.02, \"gyro\": {\"z\": null}}\n";
        assert_eq!(csv(lines), "t,gyro.x,gyro.z,on\n0.01,0.1,-2,1\n0.02,,,\n");
        let list = "[ {\"t_ns\": 1764165600123456789, \"w\": [1, 2, 3.5], \"q\": [1, 0, 0, 0]},\n  {\"t_ns\": 2} ]";
        assert_eq!(csv(list), "t_ns,w.x,w.y,w.z,q.0,q.1,q.2,q.3\n1764165600123456789,1,2,3.5,1,0,0,0\n2,,,,,,,\n");
    }

    #[test]
    fn a_number_in_quotation_marks_is_one_and_a_text_stays_one() {
        assert_eq!(
            csv("{\"t\":\"0.5\",\"at\":\"26.11., 14:03 \\\"x\\\"\",\"a,b\":1}"),
            "t,at,\"a,b\"\n0.5,\"26.11., 14:03 \"\"x\"\"\",1\n"
        );
    }

    #[test]
    fn what_is_no_record_is_a_line_of_its_own() {
        let cut = "{\"t\":1,\"w\":2}\n{\"t\":2,\"w\n{\"t\":3,\"w\":4}\nrebooted\n{\"t\":4,\"w\":5";
        // The second record never ends, for its text does not: each stands as it is.
        assert_eq!(csv(cut), "t,w\n1,2\n{\"t\":2,\"w\n3,4\nrebooted\n{\"t\":4,\"w\":5\n");
        assert_eq!(csv(""), "\n");
        assert_eq!(csv("{}{}"), "\n\n\n");
    }

    #[test]
    fn a_topic_before_each_record_tells_equal_names_apart_but_not_the_time() {
        let lines = "a/imu {\"ms\":1,\"g\":{\"z\":2}}\na/ref {\"ms\":3,\"deg\":4}\na/imu {\"ms\":5,\"g\":{\"z\":6}\n";
        assert!(is_records(lines.as_bytes()) && is_record_line(b"x {\"a\":1}") && !is_record_line(b"x {\"a\":1"));
        assert_eq!(csv(lines), "ms,g.z,deg\n1,2,\n3,,4\na/imu {\"ms\":5,\"g\":{\"z\":6}\n");
        let two = "a {\"t\":1,\"z\":2}\nb {\"t\":1,\"z\":3}\n";
        assert_eq!(csv(two), "t,a.z,b.z\n1,2,\n1,,3\n");
    }

    #[test]
    fn parts_of_a_record_that_have_a_time_each_are_rows_of_their_own() {
        let lines = "{\"gyro\":{\"timestamp\":20,\"value\":[1,2,3]}}\n\
            {\"gyro\":{\"timestamp\":40,\"value\":[4,5,6]},\"ref\":{\"timestamp\":30,\"deg\":7},\"n\":1}\n";
        assert_eq!(
            csv(lines),
            "timestamp,gyro.value.x,gyro.value.y,gyro.value.z,ref.deg,n\n20,1,2,3,,\n30,,,,7,1\n40,4,5,6,,\n"
        );
        let one = "{\"imu\":{\"t\":1,\"z\":2},\"t\":3}\n";
        assert_eq!(csv(one), "imu.t,imu.z,t\n1,2,3\n");
    }

    #[test]
    fn a_stream_gives_its_lines_as_soon_as_its_kinds_of_records_are_known() {
        let (mut records, mut out) = (Records::default(), Vec::new());
        for k in 0..40 {
            records.feed(format!("{{\"t\":{k},\"w\":1}}\n{{\"t\":{k}.5,\"a\":").as_bytes());
            records.write(&mut out, true);
            records.feed(b"2}\nrst {\n");
            records.write(&mut out, true);
        }
        let text = String::from_utf8(out).unwrap();
        assert!(text.starts_with("t,w,a\n0,1,\n0.5,,2\nrst {\n1,1,\n"), "{text}");
        assert!(text.ends_with("39.5,,2\nrst {\n"), "{text}");
    }

    #[test]
    fn what_scripts_print_of_their_records_is_read_and_a_stamp_before_them_is_their_time() {
        let dicts = "{'t': 0.5, 'gyro': (1, 2e-3, -3), 'on': True, 'x': None}\n".repeat(2);
        assert!(is_records_below(dicts.as_bytes()));
        assert!(csv(&dicts).starts_with("t,gyro.x,gyro.y,gyro.z,on,x\n0.5,1,0.002,-3,1,\n"), "{}", csv(&dicts));
        let loose = "2026-05-02 09:14:00.01: IMU {TimeUS : 10, I : 0, GyrX : 0.5}\n2026-05-02 09:14:00.01: IMU {TimeUS : 10, I : 1, GyrX : 2}\n";
        assert!(csv(loose).starts_with("TimeUS,IMU[0].GyrX,IMU[1].GyrX\n10,0.5,\n10,,2\n"), "{}", csv(loose));
        let of_pymavlink = [("0", "0.5"), ("1", "2")].map(|(number, rate)| {
            format!(
                "{{\"meta\": {{\"type\": \"IMU\"}}, \"data\": {{\"TimeUS\": 10, \"I\": {number}, \"GyrX\": {rate}}}}}\n"
            )
        });
        let of_pymavlink = csv(&of_pymavlink.concat());
        assert!(of_pymavlink.starts_with("TimeUS,IMU[0].GyrX,IMU[1].GyrX\n10,0.5,\n10,,2\n"), "{of_pymavlink}");
        let stamped = "2026-05-02T09:14:00.01+0100 robot/imu {\"gz\":1}\n".repeat(2);
        assert!(csv(&stamped).starts_with("time,gz\n2026-05-02T09:14:00.01+0100,1\n"), "{}", csv(&stamped));
    }

    #[test]
    fn records_are_known_and_whole_columns_are_not_taken_for_them() {
        for start in [
            "{\"t\": 0.01, \"gz\":",
            "[{\"t\":1",
            "  [\n {\"imu\": {\"t\":",
            "{ \"a long name that does not end within the",
            "{\"gyro\": [1, 2, 3], \"t\": 0.1}\n{\"gyro\": [1,",
        ] {
            assert!(is_records(start.as_bytes()), "{start}");
        }
        for start in
            ["{\"t\":{\"0\":0.0,", "{\"t\": [0.0, 0.1", "[1,2,3]", "{\"imu\": [{\"t\": 1", "t,gyro_z", "[[0,1],[2,3]]"]
        {
            assert!(!is_records(start.as_bytes()), "{start}");
        }
    }
}
