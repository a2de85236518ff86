//! JSON as a table: a record a line, or records in a list, as the CSV that they mean.
//!
//! ```text
//! {"t": 0.01, "gyro": {"x": 0.1, "z": -2}, "angle": 3}        t,gyro.x,gyro.z,angle
//! {"t": 0.02, "gyro": {"x": 0.2, "z": -1}}              →     0.01,0.1,-2,3
//!                                                             0.02,0.2,-1,
//! ```
//!
//! A list of three numbers is x, y, z; of another length, its items are numbered from 0. The columns are those of the first records.

mod record;

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
    let start = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start).trim_ascii_start();
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
    let is_columns = value.strip_prefix(b"{").is_some_and(|inner| inner.trim_ascii_start().starts_with(b"\"0\""));
    !is_columns && !value.starts_with(b"[")
}

/// The bytes of JSON turned into those of a CSV, a record a line. What is no record stands in a line of its own.
pub struct AsCsv<R> {
    source: R,
    /// Bytes of the source from the first that is not used yet.
    bytes: Vec<u8>,
    from: usize,
    ended: bool,
    columns: HashMap<String, usize>,
    /// Lines that wait, and how much of them was given.
    text: Vec<u8>,
    given: usize,
    begun: bool,
}

/// A part of the source.
enum Part {
    /// A record's cells.
    Record(Vec<(String, Cell)>),
    /// What stands where a record should.
    Other(Vec<u8>),
}

impl<R: Read> AsCsv<R> {
    /// Of a source, from its first byte on.
    pub fn new(source: R) -> Self {
        Self {
            source,
            bytes: Vec::new(),
            from: 0,
            ended: false,
            columns: HashMap::new(),
            text: Vec::new(),
            given: 0,
            begun: false,
        }
    }

    /// Takes the columns from the first records, and puts the header and their lines into the empty buffer.
    fn begin(&mut self) -> io::Result<()> {
        self.byte(BYTE_ORDER_MARK.len() - 1)?;
        if self.bytes.starts_with(BYTE_ORDER_MARK) {
            self.from += BYTE_ORDER_MARK.len();
        }
        let (mut parts, mut bytes) = (Vec::new(), 0);
        let mut names: Vec<String> = Vec::new();
        while parts.len() < LOOKED_AT.0 && bytes < LOOKED_AT.1 {
            let Some(part) = self.next_part()? else { break };
            match &part {
                Part::Record(cells) => {
                    for (name, _) in cells {
                        bytes += name.len() + size_of::<Cell>();
                        if !self.columns.contains_key(name) && names.len() < MOST_COLUMNS {
                            self.columns.insert(name.clone(), names.len());
                            names.push(name.clone());
                        }
                    }
                }
                Part::Other(line) => bytes += line.len(),
            }
            parts.push(part);
        }
        for (k, name) in names.iter().enumerate() {
            if k > 0 {
                self.text.push(b',');
            }
            record::write_text(&mut self.text, name);
        }
        self.text.push(b'\n');
        for part in parts {
            self.write(part);
        }
        Ok(())
    }

    /// Puts a part's line into the buffer.
    fn write(&mut self, part: Part) {
        match part {
            Part::Record(cells) => {
                let mut row: Vec<Option<Cell>> = vec![None; self.columns.len()];
                for (name, cell) in cells {
                    if let Some(&column) = self.columns.get(&name) {
                        row[column] = Some(cell);
                    }
                }
                for (k, cell) in row.iter().enumerate() {
                    if k > 0 {
                        self.text.push(b',');
                    }
                    if let Some(cell) = cell {
                        cell.write(&mut self.text);
                    }
                }
            }
            Part::Other(bytes) => {
                self.text.extend(bytes.iter().map(|&b| if b == b'\n' || b == b'\r' { b' ' } else { b }));
            }
        }
        self.text.push(b'\n');
    }

    /// The next record, or what stands in its place up to the end of its line; `None` at the end.
    fn next_part(&mut self) -> io::Result<Option<Part>> {
        loop {
            // Between records.
            while let Some(b) = self.byte(0)? {
                if b.is_ascii_whitespace() || matches!(b, b',' | b'[' | b']') {
                    self.from += 1;
                } else {
                    break;
                }
            }
            let Some(first) = self.byte(0)? else { return Ok(None) };
            let whole = if first == b'{' { self.record_length()? } else { None };
            if let Some(length) = whole {
                let part = record::cells(&self.bytes[self.from..self.from + length]);
                if let Some(cells) = part {
                    self.from += length;
                    return Ok(Some(Part::Record(cells)));
                }
            }
            let mut length = 0;
            while length < LONGEST
                && let Some(b) = self.byte(length)?
                && b != b'\n'
            {
                length += 1;
            }
            let other = self.bytes[self.from..self.from + length].to_vec();
            self.from += length;
            if !other.trim_ascii().is_empty() {
                return Ok(Some(Part::Other(other)));
            }
        }
    }

    /// Bytes up to the brace that closes the one that comes next; `None` where none does within [`LONGEST`] bytes.
    fn record_length(&mut self) -> io::Result<Option<usize>> {
        let (mut depth, mut quoted, mut escaped) = (0_usize, false, false);
        for at in 0..LONGEST {
            let Some(b) = self.byte(at)? else { return Ok(None) };
            match b {
                _ if escaped => escaped = false,
                b'\\' if quoted => escaped = true,
                b'"' => quoted = !quoted,
                b'{' if !quoted => depth += 1,
                b'}' if !quoted => {
                    depth -= 1;
                    if depth == 0 {
                        return Ok(Some(at + 1));
                    }
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// The byte so far from the first that is not used; `None` beyond the end.
    fn byte(&mut self, at: usize) -> io::Result<Option<u8>> {
        while self.from + at >= self.bytes.len() {
            if self.ended {
                return Ok(None);
            }
            self.bytes.drain(..self.from);
            self.from = 0;
            let before = self.bytes.len();
            self.bytes.resize(before + PIECE, 0);
            let read = self.source.read(&mut self.bytes[before..]);
            let come = *read.as_ref().unwrap_or(&0);
            self.bytes.truncate(before + come);
            if let Err(error) = read
                && error.kind() != io::ErrorKind::Interrupted
            {
                return Err(error);
            } else if come == 0 {
                self.ended = true;
            }
        }
        Ok(Some(self.bytes[self.from + at]))
    }
}

impl<R: Read> Read for AsCsv<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.given == self.text.len() {
            self.text.clear();
            self.given = 0;
            if !std::mem::replace(&mut self.begun, true) {
                self.begin()?;
            } else if let Some(part) = self.next_part()? {
                self.write(part);
            } else {
                return Ok(0);
            }
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
    fn records_are_known_and_whole_columns_are_not_taken_for_them() {
        for start in [
            "{\"t\": 0.01, \"gz\":",
            "[{\"t\":1",
            "  [\n {\"imu\": {\"t\":",
            "{ \"a long name that does not end within the",
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
