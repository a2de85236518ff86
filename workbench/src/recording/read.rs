//! The reading of a recording: its samples as the CSV that every command reads.

use super::{
    SAMPLE,
    schema::{Schema, TIME},
};
use mcap::io::MessageReader;
use std::io::{self, Read, Write as _};

/// The first bytes of an MCAP file.
pub(super) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// Whether a file that begins like this, its header in it, is a recording of ours.
#[must_use]
pub fn is_own(start: &[u8]) -> bool {
    start.starts_with(&MAGIC) && start.windows(LIBRARY.len()).any(|part| part == LIBRARY)
}

/// How the name of what wrote a recording of ours begins.
const LIBRARY: &[u8] = b"truerate ";

/// Turns the bytes of a recording into those of a log, a message a line.
pub struct AsCsv<R: Read> {
    messages: MessageReader<R>,
    schema: Option<Schema>,
    values: Vec<f64>,
    text: Vec<u8>,
    at: usize,
}

impl<R: Read> AsCsv<R> {
    /// Reads a recording from its first byte on.
    pub fn new(bytes: R) -> Self {
        Self { messages: MessageReader::new(bytes), schema: None, values: Vec::new(), text: Vec::new(), at: 0 }
    }

    /// Puts the next sample's line into the empty buffer; `false` at the end.
    fn next_line(&mut self) -> io::Result<bool> {
        for message in self.messages.by_ref() {
            let message = message.map_err(io::Error::other)?;
            if message.channel.topic != SAMPLE {
                continue;
            }
            let damaged = |what: &str| io::Error::other(format!("message {} of {SAMPLE}: {what}", message.sequence));
            let schema = match &mut self.schema {
                Some(schema) => schema,
                none => {
                    let said = message.channel.schema.as_ref().ok_or_else(|| damaged("its channel has no schema"))?;
                    let schema = Schema::decode(&said.name, &said.data)
                        .ok_or_else(|| damaged("its schema is not that of a recording by truerate"))?;
                    self.text.extend_from_slice(TIME.as_bytes());
                    for column in schema.columns() {
                        write!(self.text, ",\"{}\"", column.replace('"', "\"\""))?;
                    }
                    self.text.push(b'\n');
                    none.insert(schema)
                }
            };
            let time = schema
                .read(&message.data, &mut self.values)
                .ok_or_else(|| damaged("its fields or time are damaged"))?;
            write!(self.text, "{time}")?;
            for value in &self.values {
                // The shortest decimal that reads back to the same bits.
                if value.is_nan() { self.text.push(b',') } else { write!(self.text, ",{value:?}")? }
            }
            self.text.push(b'\n');
            return Ok(true);
        }
        Ok(false)
    }
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
