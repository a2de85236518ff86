//! JSON by columns, as data frames and scripts write it. It is read as the text that it means, so that its names, units and times are
//! understood as a text's are.
//!
//! ```text
//! {"t": [0, 0.01], "gyro": [[0.1, 0, -2], [0.2, 0, -1]]}        t,gyro.x,gyro.y,gyro.z
//! {"t": {"0": 0, "1": 0.01}, …}                            →     0,0.1,0,-2
//!                                                                0.01,0.2,0,-1
//! ```
//!
//! It is taken into memory whole.

use super::delimited;
use crate::{
    format::{AsText, Converted, Format, Note, Sink, Unreadable},
    json::write_text,
    meaning::epoch_unit,
};
use serde_json::{Map, Value};
use std::io::{Cursor, Read};

/// A larger one is not taken into memory.
const LARGEST: u64 = 1 << 30;

/// JSON by columns.
pub struct Columns;

impl Format for Columns {
    fn name(&self) -> &'static str {
        "JSON by columns"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        let Some(inside) = start.trim_ascii_start().strip_prefix(b"{").map(<[u8]>::trim_ascii_start) else {
            return false;
        };
        let name =
            inside.strip_prefix(b"\"").and_then(|rest| rest.split_at_checked(rest.iter().position(|&b| b == b'"')?));
        let Some((name, after)) = name else { return false };
        let Some(value) = after[1..].trim_ascii_start().strip_prefix(b":") else { return false };
        match value.trim_ascii_start() {
            [b'{', ..] if is_number(name) => true,
            // A list of records is none.
            [b'[', items @ ..] => items.trim_ascii_start().first().is_some_and(|&b| b != b'{'),
            [b'{', items @ ..] => items
                .trim_ascii_start()
                .strip_prefix(b"\"")
                .is_some_and(|key| is_number(key.split(|&b| b == b'"').next().unwrap_or_default())),
            _ => false,
        }
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        delimited::read(converted(bytes)?, sink)
    }

    fn as_text(&self) -> Option<AsText> {
        Some(converted)
    }
}

fn converted(source: &mut dyn Read) -> Result<Converted, Unreadable> {
    let mut bytes = Vec::new();
    source.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        return Err(Unreadable::Unknown("it is JSON by columns, larger than 1 GiB: write it as CSV"));
    }
    let parsed = serde_json::from_slice(&bytes).or_else(|_| serde_json::from_slice(&without_nan(&bytes)));
    let all: Map<String, Value> = parsed.map_err(|_| {
        Unreadable::Unknown("it is JSON by columns, but damaged or incomplete: write it again, or as CSV")
    })?;
    drop(bytes);
    let mut table = Table::default();
    // Rows by their numbers.
    if is_numbered(&all) && all.values().all(Value::is_object) {
        let stamps = stamps(&all);
        let mut rows = column(Value::Object(all)).unwrap_or_default();
        for (row, stamp) in rows.iter_mut().zip(stamps.into_iter().flatten()) {
            row[STAMP] = stamp.into();
        }
        table.take("", Map::from_iter([("row".to_owned(), Value::Array(rows))]));
    } else {
        table.take("", all);
    }
    table.keep_one();
    let Table { names, columns, left_out, .. } = table;
    let rows = columns.iter().map(Vec::len).max().unwrap_or(0);
    let mut text = Vec::new();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| {
        for (k, cell) in cells.enumerate() {
            if k > 0 {
                text.push(b',');
            }
            write_text(&mut text, cell);
        }
        text.push(b'\n');
    };
    line(&mut names.iter().map(String::as_str));
    for row in 0..rows {
        line(&mut columns.iter().map(|column: &Vec<String>| column.get(row).map_or("", String::as_str)));
    }
    let notes = if left_out.is_empty() { Vec::new() } else { vec![Note::LeftOut { names: left_out }] };
    Ok(Converted { text: Box::new(Cursor::new(text)), notes })
}

/// Columns that were found in a document, wherever in it.
#[derive(Default)]
struct Table {
    names: Vec<String>,
    columns: Vec<Vec<String>>,
    left_out: Vec<String>,
}

impl Table {
    /// The columns inside an object at a path.
    fn take(&mut self, path: &str, object: Map<String, Value>) {
        for (name, value) in object {
            if let Some(stamps) = value.as_object().and_then(stamps).filter(|_| self.names.iter().all(|of| of != STAMP))
            {
                self.names.push(STAMP.to_owned());
                self.columns.push(stamps);
            }
            let path = if path.is_empty() { name } else { format!("{path}.{name}") };
            match value {
                Value::Object(inner) if !is_numbered(&inner) => self.take(&path, inner),
                value => match column(value) {
                    // A list of records: a column for each of their fields.
                    Some(items) if items.iter().any(Value::is_object) => self.records(&path, items),
                    Some(items) => named(&path, &items, &mut self.names, &mut self.columns),
                    None => self.left_out.push(path),
                },
            }
        }
    }

    fn records(&mut self, path: &str, items: Vec<Value>) {
        let (first, count) = (self.names.len(), items.len());
        for (row, item) in items.into_iter().enumerate() {
            for (name, cell) in leaves(path, item) {
                let place = self.names[first..].iter().position(|known| *known == name).map(|place| first + place);
                let place = place.unwrap_or_else(|| {
                    self.names.push(name);
                    self.columns.push(vec![String::new(); count]);
                    self.names.len() - 1
                });
                self.columns[place][row] = cell;
            }
        }
    }

    /// Lists of another length than the longest ones are no columns of the same table; the path that all share says nothing.
    fn keep_one(&mut self) {
        let rows = self.columns.iter().map(Vec::len).max().unwrap_or_default();
        let (mut names, mut columns) = (Vec::new(), Vec::new());
        for (name, column) in std::mem::take(&mut self.names).into_iter().zip(std::mem::take(&mut self.columns)) {
            if 2 * column.len() > rows {
                names.push(name);
                columns.push(column);
            } else {
                self.left_out.push(name);
            }
        }
        let shared = |name: &String| name.split_once('.').map(|(first, _)| first.to_owned());
        while let Some(first) = names.first().and_then(shared)
            && names.iter().all(|name| shared(name).as_ref() == Some(&first))
        {
            for name in &mut names {
                name.drain(..=first.len());
            }
        }
        (self.names, self.columns) = (names, columns);
    }
}

/// The numbers and texts inside a value, with their paths.
fn leaves(path: &str, value: Value) -> Vec<(String, String)> {
    let inside = |parts: Vec<(String, Value)>| {
        parts.into_iter().flat_map(|(name, value)| leaves(&format!("{path}.{name}"), value)).collect()
    };
    match value {
        Value::Object(object) => inside(object.into_iter().collect()),
        Value::Array(items) => {
            let is_three = items.len() == 3;
            let name = |k: usize| if is_three { ["x", "y", "z"][k].to_owned() } else { k.to_string() };
            inside(items.into_iter().enumerate().map(|(k, item)| (name(k), item)).collect())
        }
        Value::Null => Vec::new(),
        Value::String(text) => vec![(path.to_owned(), text)],
        other => vec![(path.to_owned(), other.to_string())],
    }
}

/// Whether an object is a column whose rows are numbered.
fn is_numbered(object: &Map<String, Value>) -> bool {
    !object.is_empty() && object.keys().all(|key| is_number(key.as_bytes()))
}

fn is_number(key: &[u8]) -> bool {
    !key.is_empty() && key.iter().all(u8::is_ascii_digit)
}

/// What the times are called that rows have in place of numbers.
const STAMP: &str = "timestamp";

/// The keys of rows that are times since 1970, in order.
fn stamps(rows: &Map<String, Value>) -> Option<Vec<String>> {
    let mut keys = rows.keys().map(|key| key.parse().ok()).collect::<Option<Vec<u64>>>()?;
    keys.sort_unstable();
    let is_time = keys.first().is_some_and(|first| epoch_unit(*first as f64).is_some());
    is_time.then(|| keys.into_iter().map(|key| key.to_string()).collect())
}

impl Columns {
    /// Whether a text that begins like this is one document whose lists lie further inside: no records one after the other. `is_whole` is
    /// whether nothing follows.
    #[must_use]
    pub fn is_document(start: &[u8], is_whole: bool) -> bool {
        let text = start.trim_ascii_start();
        let (mut depth, mut quoted, mut escaped) = (0_usize, false, false);
        let mut end = None;
        for (at, &b) in text.iter().enumerate() {
            match b {
                _ if escaped => escaped = false,
                b'\\' if quoted => escaped = true,
                b'"' => quoted = !quoted,
                b'{' if !quoted => depth += 1,
                b'}' if !quoted => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth == 0 && end.is_none() {
                end = Some(at + 1);
                break;
            }
        }
        let has_list = text.contains(&b'[');
        let is_last = end.is_none_or(|end| is_whole && text[end..].trim_ascii().is_empty());
        text.starts_with(b"{") && has_list && is_last
    }
}

/// With `null` for what Python writes as `NaN`, which is no JSON.
fn without_nan(bytes: &[u8]) -> Vec<u8> {
    let (mut text, mut from) = (Vec::with_capacity(bytes.len()), 0);
    for at in memchr::memmem::find_iter(bytes, b"NaN") {
        text.extend_from_slice(&bytes[from..at]);
        text.extend_from_slice(b"null");
        from = at + 3;
    }
    text.extend_from_slice(&bytes[from..]);
    text
}

/// The items of a column in the order of its rows; `None` where it is none.
fn column(value: Value) -> Option<Vec<Value>> {
    match value {
        Value::Array(items) => Some(items),
        Value::Object(items) => {
            let by_row = |(row, item): (String, Value)| row.parse::<u64>().ok().map(|row| (row, item));
            let mut rows = items.into_iter().map(by_row).collect::<Option<Vec<_>>>()?;
            rows.sort_by_key(|(row, _)| *row);
            Some(rows.into_iter().map(|(_, item)| item).collect())
        }
        _ => None,
    }
}

/// A column under its name; one of lists as several.
fn named(name: &str, items: &[Value], names: &mut Vec<String>, columns: &mut Vec<Vec<String>>) {
    let cell = |item: &Value| match item {
        Value::Null | Value::Array(_) | Value::Object(_) => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let parts = items.iter().filter_map(|item| item.as_array().map(Vec::len)).max();
    let Some(parts) = parts else {
        names.push(name.to_owned());
        columns.push(items.iter().map(cell).collect());
        return;
    };
    for part in 0..parts {
        let own = if parts == 3 { ["x", "y", "z"][part].to_owned() } else { part.to_string() };
        names.push(format!("{name}.{own}"));
        columns.push(items.iter().map(|item| item.get(part).map_or_else(String::new, cell)).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_further_inside_are_columns_and_so_are_the_fields_of_records_in_a_list() {
        let text = |json: &[u8]| {
            let (mut table, mut text) = (converted(&mut &json[..]).unwrap(), String::new());
            table.text.read_to_string(&mut text).unwrap();
            let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
            let mut names: Vec<&str> = lines[0].split(',').collect();
            names.sort_unstable();
            lines[0] = names.join(",");
            lines
        };
        let nested = br#"{"meta": {"fs": 100, "axes": ["x"]}, "data": {"t": [0, 1, 2], "gyro": {"z": [3, 4, 5]}}}"#;
        assert!(
            Columns::is_document(nested, true) && !Columns::is_document(b"{\"t\": [0, 1]}\n{\"t\": [2, 3]}\n", true)
        );
        let lines = text(nested);
        assert_eq!((lines[0].as_str(), lines.len()), ("gyro.z,t", 4));
        let lines = text(br#"{"fs": 100, "samples": [{"t": 0, "w": [1, 2, 3]}, {"t": 1, "w": [4, 5, 6]}]}"#);
        assert_eq!((lines[0].as_str(), lines[1..].len()), ("t,w.x,w.y,w.z", 2));
    }

    #[test]
    fn lists_numbered_rows_and_lists_of_three_are_one_table() {
        let json = br#"{"t": {"0": 0, "10": 0.02, "2": 0.01}, "gyro": [[1, 2, NaN], [4, 5, 6], null], "fs": 100, "note": ["a, b", null]}"#;
        assert!(Columns.recognises(&json[..40]));
        let mut table = converted(&mut &json[..]).unwrap();
        let mut text = String::new();
        table.text.read_to_string(&mut text).unwrap();
        let mut rows: Vec<&str> = text.lines().collect();
        rows.sort_unstable();
        assert_eq!(rows, [",,,,0.02", "1,2,,\"a, b\",0", "4,5,6,,0.01", "gyro.x,gyro.y,gyro.z,note,t"]);
        assert_eq!(table.notes, [Note::LeftOut { names: vec!["fs".into()] }]);
        let by_row = br#"{"0": {"t": 0, "gz": 1}, "10": {"t": 10, "gz": 3}, "2": {"t": 2, "gz": 2}}"#;
        assert!(Columns.recognises(&by_row[..30]) && !crate::json::is_records(by_row));
        let mut text = String::new();
        converted(&mut &by_row[..]).unwrap().text.read_to_string(&mut text).unwrap();
        let stamped = br#"{"gz": {"1709377384010": 2, "1709377384000": 1}}"#;
        let mut of_stamps = String::new();
        converted(&mut &stamped[..]).unwrap().text.read_to_string(&mut of_stamps).unwrap();
        assert_eq!(of_stamps, "timestamp,gz\n1709377384000,1\n1709377384010,2\n");
        assert!(Columns.recognises(&stamped[..40]));
        assert!(["t,gz\n0,1\n2,2\n10,3\n", "gz,t\n1,0\n2,2\n3,10\n"].contains(&&*text), "{text}");
        assert!(converted(&mut &json[..40]).is_err());
        assert!(!Columns.recognises(b"{\"imu\": [{\"t\": 1") && !Columns.recognises(b"{\"t\": 0.01, \"gz\":"));
    }
}
