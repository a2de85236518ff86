//! The reading of a recording: its samples as the CSV that every command reads.

use super::{SAMPLE, TIME};
use mcap::io::MessageReader;
use serde_json::{Deserializer, Value};
use std::io::{self, Read, Write as _};

/// The first bytes of an MCAP file.
pub const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// Turns the bytes of a recording into those of a log, a message a line.
pub struct AsCsv<R: Read> {
    messages: MessageReader<R>,
    columns: Vec<String>,
    text: Vec<u8>,
    at: usize,
}

impl<R: Read> AsCsv<R> {
    /// Reads a recording from its first byte on.
    pub fn new(bytes: R) -> Self {
        Self { messages: MessageReader::new(bytes), columns: Vec::new(), text: Vec::new(), at: 0 }
    }

    /// Puts the next sample's line into the empty buffer; `false` at the end.
    fn next_line(&mut self) -> io::Result<bool> {
        for message in self.messages.by_ref() {
            let message = message.map_err(io::Error::other)?;
            if message.channel.topic != SAMPLE {
                continue;
            }
            let damaged = |what: &str| io::Error::other(format!("message {} of {SAMPLE}: {what}", message.sequence));
            if self.columns.is_empty() {
                let schema = message.channel.schema.as_ref().ok_or_else(|| damaged("its channel has no schema"))?;
                self.columns = columns(&schema.data).ok_or_else(|| damaged("its schema names no columns"))?;
                self.text.extend_from_slice(TIME.as_bytes());
                for column in &self.columns {
                    write!(self.text, ",\"{}\"", column.replace('"', "\"\""))?;
                }
                self.text.push(b'\n');
            }
            let row = fields(&message.data).ok_or_else(|| damaged("it is no flat JSON object"))?;
            let value = |key: &str| row.iter().find(|(name, _)| name == key).map(|(_, value)| *value);
            match value(TIME) {
                Some(time) if time.parse::<i128>().is_ok() => write!(self.text, "{time}")?,
                _ => return Err(damaged("it has no time")),
            }
            for column in &self.columns {
                match value(column) {
                    None | Some("null") => self.text.push(b','),
                    Some(number) if number.parse::<f64>().is_ok() => write!(self.text, ",{number}")?,
                    Some(other) => return Err(damaged(&format!("{column} is {other}, not a number"))),
                }
            }
            self.text.push(b'\n');
            return Ok(true);
        }
        Ok(false)
    }
}

/// Keys and values of a flat JSON object, the values as they are written: numbers go on digit for digit.
fn fields(json: &[u8]) -> Option<Vec<(String, &str)>> {
    let mut rest = std::str::from_utf8(json).ok()?.trim().strip_prefix('{')?.strip_suffix('}')?.trim_start();
    let mut fields = Vec::new();
    while !rest.is_empty() {
        let mut keys = Deserializer::from_str(rest).into_iter::<String>();
        let key = keys.next()?.ok()?;
        rest = rest[keys.byte_offset()..].trim_start().strip_prefix(':')?;
        let (value, after) = rest.split_once(',').unwrap_or((rest, ""));
        fields.push((key, value.trim()));
        rest = after.trim_start();
    }
    Some(fields)
}

/// The columns that a sample's schema names, but the time.
fn columns(schema: &[u8]) -> Option<Vec<String>> {
    let schema: Value = serde_json::from_slice(schema).ok()?;
    let columns: Vec<String> = schema.get("properties")?.as_object()?.keys().filter(|k| *k != TIME).cloned().collect();
    (!columns.is_empty()).then_some(columns)
}

impl<R: Read> Read for AsCsv<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at == self.text.len() {
            self.text.clear();
            self.at = 0;
            if !self.next_line()? {
                return Ok(0);
            }
        }
        let n = buffer.len().min(self.text.len() - self.at);
        buffer[..n].copy_from_slice(&self.text[self.at..self.at + n]);
        self.at += n;
        Ok(n)
    }
}
