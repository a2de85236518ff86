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
        let name = inside.strip_prefix(b"\"").and_then(|rest| Some(&rest[rest.iter().position(|&b| b == b'"')? + 1..]));
        let Some(value) = name.and_then(|after| after.trim_ascii_start().strip_prefix(b":")) else { return false };
        match value.trim_ascii_start() {
            // A list of records is none.
            [b'[', items @ ..] => items.trim_ascii_start().first().is_some_and(|&b| b != b'{'),
            [b'{', items @ ..] => items.trim_ascii_start().starts_with(b"\"0\""),
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
        Unreadable::Unknown("it is JSON by columns, but damaged or incomplete: write it anew, or as CSV")
    })?;
    drop(bytes);
    let (mut names, mut columns, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
    for (name, value) in all {
        match column(value) {
            Some(items) => named(&name, &items, &mut names, &mut columns),
            None => left_out.push(name),
        }
    }
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
        assert!(converted(&mut &json[..40]).is_err());
        assert!(!Columns.recognises(b"{\"imu\": [{\"t\": 1") && !Columns.recognises(b"{\"t\": 0.01, \"gz\":"));
    }
}
