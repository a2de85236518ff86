//! One record of JSON as cells: the path to each number, text or nothing in it.

use serde::de::{DeserializeSeed, Error, MapAccess, SeqAccess, Visitor};
use std::{fmt, io::Write as _};

/// What stands at the end of a path.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Integer(i128),
    Number(f64),
    Text(String),
    Nothing,
}

impl Cell {
    /// Its number.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(value) => Some(*value as f64),
            Self::Number(value) => Some(*value),
            Self::Text(text) => text.parse().ok(),
            Self::Nothing => None,
        }
    }

    /// Writes it as a field of a CSV.
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        // Into memory nothing fails.
        let _ = match self {
            Self::Integer(value) => write!(out, "{value}"),
            Self::Number(value) => write!(out, "{value}"),
            Self::Text(text) => {
                write_text(out, text);
                Ok(())
            }
            Self::Nothing => Ok(()),
        };
    }
}

/// Writes a text as a field of a CSV, in quotation marks where it needs them.
pub(crate) fn write_text(out: &mut Vec<u8>, text: &str) {
    let plain = text.bytes().map(|b| if b < b' ' { b' ' } else { b });
    if text.contains([',', '"']) {
        out.push(b'"');
        for b in plain {
            if b == b'"' {
                out.push(b'"');
            }
            out.push(b);
        }
        out.push(b'"');
    } else {
        out.extend(plain);
    }
}

/// The cells of a record in its order, each with its path; the first where a path is written twice. `None` where it is no record.
pub(super) fn cells(bytes: &[u8]) -> Option<Vec<(String, Cell)>> {
    strict(bytes).or_else(|| strict(&loosened(bytes)?))
}

/// What scripts print of their own records as JSON: `{'t': 0.5, 'gyro': (1, 2, 3), 'ok': True}`, `{TimeUS : 1, GyrX : 0.5}`; `None` where
/// nothing is to change.
fn loosened(bytes: &[u8]) -> Option<Vec<u8>> {
    let (mut json, mut at) = (Vec::with_capacity(bytes.len() + 16), 0);
    while at < bytes.len() {
        let b = bytes[at];
        match b {
            b'"' | b'\'' => {
                let end = bytes[at + 1..].iter().position(|other| *other == b).map(|length| at + 1 + length)?;
                json.push(b'"');
                json.extend(bytes[at + 1..end].iter().filter(|b| **b != b'"'));
                json.push(b'"');
                at = end + 1;
                continue;
            }
            b'(' => json.push(b'['),
            b')' => {
                // `(1,)` is a list of one.
                while json.last().is_some_and(|b| matches!(b, b',' | b' ')) {
                    json.pop();
                }
                json.push(b']');
            }
            b'A'..=b'Z' | b'a'..=b'z' | b'_' => {
                let is_word = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.');
                let end = at + bytes[at..].iter().position(|b| !is_word(b)).unwrap_or(bytes.len() - at);
                let (word, rest) = (&bytes[at..end], bytes[end..].trim_ascii_start());
                match word {
                    _ if rest.starts_with(b":") => json.extend([b"\"", word, b"\""].concat()),
                    // `array([1, 2])`, `np.float64(1)` are what stands in their brackets.
                    _ if rest.starts_with(b"([") || rest.starts_with(b"(") => {
                        let open = end + bytes[end..].iter().position(|&b| b == b'(')?;
                        let close = open + bytes[open..].iter().position(|&b| b == b')')?;
                        json.extend_from_slice(&bytes[open + 1..close]);
                        at = close + 1;
                        continue;
                    }
                    b"True" | b"true" => json.extend_from_slice(b"true"),
                    b"False" | b"false" => json.extend_from_slice(b"false"),
                    b"None" | b"null" | b"nan" | b"NaN" | b"inf" | b"Infinity" => json.extend_from_slice(b"null"),
                    _ => json.extend([b"\"", word, b"\""].concat()),
                }
                at = end;
                continue;
            }
            // `1e-3` is one number.
            b'0'..=b'9' => {
                let is_of = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'E' | b'+' | b'-');
                let end = at + bytes[at..].iter().position(|b| !is_of(b)).unwrap_or(bytes.len() - at);
                json.extend_from_slice(&bytes[at..end]);
                at = end;
                continue;
            }
            b => json.push(b),
        }
        at += 1;
    }
    (json != bytes).then_some(json)
}

/// The cells of a record that is written as JSON is.
fn strict(bytes: &[u8]) -> Option<Vec<(String, Cell)>> {
    let mut cells = Vec::new();
    let mut json = serde_json::Deserializer::from_slice(bytes);
    Inside { path: "", cells: &mut cells }.deserialize(&mut json).ok()?;
    json.end().ok()?;
    super::distinct(&mut cells);
    Some(cells)
}

/// The value at a path.
struct Inside<'a> {
    path: &'a str,
    cells: &'a mut Vec<(String, Cell)>,
}

impl Inside<'_> {
    fn put(self, cell: Cell) {
        self.cells.push((self.path.to_owned(), cell));
    }

    fn below(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }
}

impl<'de> DeserializeSeed<'de> for Inside<'_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, json: D) -> Result<(), D::Error> {
        json.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Inside<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a record of numbers")
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<(), E> {
        self.put(Cell::Integer(i128::from(value)));
        Ok(())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<(), E> {
        self.put(Cell::Integer(i128::from(value)));
        Ok(())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        self.put(Cell::Integer(i128::from(value)));
        Ok(())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<(), E> {
        self.put(Cell::Number(value));
        Ok(())
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        self.put(Cell::Text(text.to_owned()));
        Ok(())
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        self.put(Cell::Nothing);
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        let first = self.cells.len();
        let mut count = 0;
        while items.next_element_seed(Inside { path: &self.below(&count.to_string()), cells: self.cells })?.is_some() {
            count += 1;
        }
        if count == 3 && self.cells.len() == first + 3 {
            for (k, letter) in ["x", "y", "z"].into_iter().enumerate() {
                self.cells[first + k].0 = self.below(letter);
            }
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        while let Some(name) = entries.next_key::<String>()? {
            entries.next_value_seed(Inside { path: &self.below(&name), cells: self.cells })?;
        }
        Ok(())
    }
}
