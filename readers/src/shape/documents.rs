//! Documents of YAML with a ruler between them, as `rostopic echo` and `ros2 topic echo` print messages.
//!
//! ```text
//! header:
//!   stamp:
//!     sec: 10
//!     nanosec: 5000                     header.stamp.sec,header.stamp.nanosec,angular_velocity.z
//! angular_velocity:               →     10,5000,-0.2
//!   z: -0.2
//! ---
//! ```

use super::Shape;
use crate::json::Records;
use serde_json::{Map, Value};

/// The line between two documents.
const RULER: &[u8] = b"---";
/// Lines of a document at most.
const LONGEST: usize = 2000;

/// Documents as lines of a CSV.
#[derive(Default)]
pub struct Documents {
    lines: Vec<String>,
    records: Records,
}

impl Documents {
    /// What lines like these are: rulers, and hardly anything but names and items between them.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let first = lines.iter().find(|line| !line.is_empty())?;
        let is_named = |line: &&&[u8]| {
            let text = line.trim_ascii_start();
            text.starts_with(b"- ") || **line == RULER || {
                let key = text.iter().position(|&b| b == b':').map(|at| (&text[..at], &text[at + 1..]));
                key.is_some_and(|(key, rest)| {
                    let plain = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'.');
                    !key.is_empty() && key.iter().all(plain) && (rest.is_empty() || rest[0] == b' ')
                })
            }
        };
        let all = lines.iter().filter(|line| !line.is_empty());
        let named = all.clone().filter(is_named).count();
        let is_nested = lines.iter().any(|line| line.starts_with(b"  "));
        let has_ruler = lines.contains(&RULER);
        (has_ruler && is_nested && is_named(&first) && 10 * named > 9 * all.count()).then(Self::default)
    }

    /// Gives the document that has come.
    fn give(&mut self, out: &mut Vec<u8>) {
        let lines = std::mem::take(&mut self.lines);
        let record = Value::Object(record(&lines));
        if record.as_object().is_some_and(|record| !record.is_empty()) {
            self.records.feed(record.to_string().as_bytes());
            self.records.feed(b"\n");
            self.records.write(out, true);
        }
    }
}

impl Shape for Documents {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let line = line.trim_ascii_end();
        if line == RULER {
            self.give(out);
        } else if !line.is_empty() && self.lines.len() < LONGEST {
            self.lines.push(String::from_utf8_lossy(line).into_owned());
        }
    }

    fn end(&mut self, out: &mut Vec<u8>) {
        // A last document without its ruler may be cut.
        self.records.feed(b"");
        self.records.write(out, true);
    }
}

/// A document as a record of its paths.
fn record(lines: &[String]) -> Map<String, Value> {
    let mut record = Map::new();
    // Names above, each with its indentation.
    let mut above: Vec<(usize, String)> = Vec::new();
    // Items so far of the list at a path.
    let mut counts: Map<String, Value> = Map::new();
    for line in lines {
        let mut text = line.trim_start();
        let mut indent = line.len() - text.len();
        let mut item = None;
        while let Some(rest) = text.strip_prefix("- ").or_else(|| (text == "-").then_some("")) {
            // A list may stand as far to the left as its name.
            above.retain(|(at, name)| *at < indent || *at == indent && name.parse::<usize>().is_err());
            let path = joined(&above, "");
            let count = counts.entry(path).or_insert_with(|| 0.into());
            let place = count.as_u64().unwrap_or_default();
            *count = (place + 1).into();
            item = Some((joined(&above, ""), rest.trim().to_owned()));
            indent += text.len() - rest.len();
            above.push((indent - 1, place.to_string()));
            text = rest.trim_start();
        }
        let named = text
            .split_once(':')
            .filter(|(key, rest)| (rest.is_empty() || rest.starts_with(' ')) && !key.contains([' ', '[', '"', '\'']));
        let Some((key, value)) = named else {
            if let Some((path, value)) = item {
                above.pop();
                push(&mut record, &path, scalar(&value));
            }
            continue;
        };
        above.retain(|(at, _)| *at < indent);
        let value = value.trim();
        if value.is_empty() {
            above.push((indent, key.to_owned()));
        } else if let Some(list) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            let items = list.split(',').map(str::trim).filter(|item| !item.is_empty()).map(scalar);
            record.insert(joined(&above, key), Value::Array(items.collect()));
        } else {
            record.insert(joined(&above, key), scalar(value));
        }
    }
    record
}

fn push(record: &mut Map<String, Value>, path: &str, value: Value) {
    match record.entry(path.to_owned()).or_insert_with(|| Value::Array(Vec::new())) {
        Value::Array(items) => items.push(value),
        other => *other = value,
    }
}

fn joined(above: &[(usize, String)], key: &str) -> String {
    let names = above.iter().map(|(_, name)| name.as_str()).chain([key]);
    names.filter(|name| !name.is_empty()).collect::<Vec<_>>().join(".")
}

fn scalar(text: &str) -> Value {
    let text = text.trim_matches(['"', '\'']);
    let number = text.parse::<i64>().ok().map(Value::from);
    number
        .or_else(|| text.parse::<f64>().ok().and_then(serde_json::Number::from_f64).map(Value::Number))
        .unwrap_or_else(|| match text {
            "true" | "True" => 1.into(),
            "false" | "False" => 0.into(),
            ".nan" | "nan" | "null" | "~" | "''" => Value::Null,
            _ => text.into(),
        })
}

#[cfg(test)]
mod tests {
    use super::super::{AsCsv, of_start};
    use std::io::Read;

    fn csv(text: &str) -> String {
        let mut out = String::new();
        AsCsv::new(text.as_bytes(), of_start(text.as_bytes()).expect(text)).read_to_string(&mut out).unwrap();
        out
    }

    #[test]
    fn messages_are_rows_with_a_column_for_each_number() {
        let message = "header: \n  seq: 1\n  stamp: \n    secs: 10\n    nsecs: 5000\n  frame_id: \"imu\"\norientation_covariance: [-1.0, 0.0]\nangular_velocity: \n  x: 0.5\n  y: 1e-3\n  z: -2\n---\n";
        let wide = csv(&message.repeat(20));
        assert!(wide.starts_with("angular_velocity.x,") || wide.starts_with("header."), "{wide}");
        let (header, rows) = wide.split_once('\n').unwrap();
        assert_eq!(rows.lines().count(), 20);
        let of = |name: &str| {
            let place = header.split(',').position(|column| column == name).expect(name);
            rows.lines().next().unwrap().split(',').nth(place).unwrap().to_owned()
        };
        assert_eq!(
            (of("header.stamp.nsecs"), of("angular_velocity.z"), of("orientation_covariance.0")),
            ("5000".into(), "-2".into(), "-1".into())
        );
    }

    #[test]
    fn items_are_numbered_and_those_of_a_list_of_three_are_axes() {
        let message = "header:\n  stamp:\n    sec: 1\n    nanosec: 2\nname:\n- table\nposition:\n- 0.5\ntransforms:\n- header:\n    frame_id: map\n  transform:\n    rotation:\n      w: 0.75\n---\n";
        let wide = csv(&message.repeat(20));
        assert!(
            wide.contains("position.0") && wide.contains("transforms.0.transform.rotation.w") && wide.contains("0.75"),
            "{wide}"
        );
    }

    #[test]
    fn other_text_with_rulers_is_none() {
        for text in ["t,gyro_z\n---\n0,1\n", "gx: 1\ngy: 2\n---\n", "Title\n---\n  text\n"] {
            assert!(of_start(text.repeat(9).as_bytes()).is_none_or(|_| !text.contains("  ")), "{text}");
        }
    }
}
