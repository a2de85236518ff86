//! Lines in which each value follows its name as a field of its own, as Mission Planner writes the messages of a flight.
//!
//! ```text
//! 2024-03-02T12:03:04.1,FE,1C,mavlink_attitude_t,time_boot_ms,5000,yaw,0.5,yawspeed,0.1,Len,36
//! t,0.01,gz,1.5,enc,3
//! ```
//!
//! What stands before the first pair is a time, and the kind of the message last.

use super::Shape;
use crate::{
    json::Records,
    text::{CSV, form, is_number},
};
use serde_json::{Map, Value};

/// Lines that are enough, their share, and pairs in each at least.
const FEWEST: usize = 8;
const SHARE: f64 = 0.8;
const PAIRS: usize = 2;

/// Pairs as lines of a CSV.
#[derive(Default)]
pub struct Pairs {
    records: Records,
}

impl Pairs {
    /// What lines like these are.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let filled = lines.iter().filter(|line| !line.is_empty()).count();
        let count = lines.iter().filter(|line| record(line).is_some()).count();
        (count >= FEWEST && count as f64 >= SHARE * filled as f64).then(Self::default)
    }
}

impl Shape for Pairs {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let line = line.trim_ascii_end();
        match record(line) {
            Some((kind, record)) => {
                let line = format!("{kind} {}\n", Value::Object(record));
                self.records.feed(line.trim_start().as_bytes());
            }
            None => self.records.feed(&[line, b"\n"].concat()),
        }
        self.records.write(out, true);
    }

    fn end(&mut self, out: &mut Vec<u8>) {
        self.records.feed(b"");
        self.records.write(out, true);
    }
}

/// The kind of a line, and its values with their names.
fn record(line: &[u8]) -> Option<(String, Map<String, Value>)> {
    let fields = CSV.fields(line);
    let is_name = |field: &[u8]| {
        field.first().is_some_and(|b| b.is_ascii_alphabetic() || *b == b'_')
            && !is_number(CSV, field)
            && field.len() > 1
            || matches!(field, b"t" | b"T")
    };
    // The last name that no number follows is that of the kind.
    let pairs = |from: usize| {
        fields[from..].chunks(2).all(|pair| pair.len() == 2 && is_name(pair[0]) && is_number(CSV, pair[1]))
    };
    let begin = (0..fields.len()).find(|from| pairs(*from))?;
    if fields.len() - begin < 2 * PAIRS {
        return None;
    }
    let text = |field: &[u8]| Value::String(String::from_utf8_lossy(field).into_owned());
    let mut record = Map::new();
    let is_time = |field: &&&[u8]| form(field).is_some();
    if let Some(time) = fields[..begin].first().filter(is_time) {
        record.insert("time".to_owned(), text(time));
    }
    for pair in fields[begin..].chunks(2) {
        record.insert(String::from_utf8_lossy(pair[0]).into_owned(), text(pair[1]));
    }
    let kind = fields[..begin].last().filter(|kind| is_name(kind)).map_or_else(String::new, |kind| {
        String::from_utf8_lossy(kind).chars().map(|c| if c.is_whitespace() { '_' } else { c }).collect()
    });
    Some((kind, record))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_follows_its_name() {
        let line = |k: usize| {
            format!("2024-03-02T12:03:{k:02}.1,FE,attitude_t,time_boot_ms,{k}0,yaw,{k}.5,Len,36").into_bytes()
        };
        let lines: Vec<Vec<u8>> = (10..40).map(line).collect();
        let refs: Vec<&[u8]> = lines.iter().map(Vec::as_slice).collect();
        let (mut of, mut out) = (Pairs::of(&refs).unwrap(), Vec::new());
        for line in &refs {
            of.line(line, &mut out);
        }
        of.end(&mut out);
        let text = String::from_utf8(out).unwrap();
        let mut names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        names.sort_unstable();
        assert_eq!((names, text.lines().count()), (vec!["Len", "time", "time_boot_ms", "yaw"], 31));
        for line in ["t,gz\n", "0.1,fast,2,slow", "a,1", "GYRO,1,2,3", ""] {
            assert!(Pairs::of(&[line.as_bytes(); 20]).is_none(), "{line}");
        }
    }
}
