//! Text whose lines are no rows of a table, as the lines of a CSV that they mean, whoever has them: a file or a stream.

mod blocks;
mod dated;
mod documents;
mod hex;
mod instances;
mod long;
mod pairs;
mod sentence;
mod stepped;
mod wrapped;

pub use dated::has_parts as has_parts_of_a_time;
pub use instances::column as instance_column;
pub use sentence::tells_in_strings;

use crate::{
    json::write_text,
    text::{Finder, Head, Skipped},
};
use blocks::Blocks;
use std::io::{self, Read};

/// Turns lines of a text into lines of a CSV, its header first. What it does not understand is given as it is.
pub trait Shape: Send {
    /// Takes a line, without its end, and adds what it completes to `out`.
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>);

    /// Gives what was not complete: no line follows.
    fn end(&mut self, out: &mut Vec<u8>);
}

/// Lines that are looked at.
const LOOKED_AT: usize = 400;

/// What a text is that begins with these lines; `None` where it is a table, or nothing that is known. Of a file, whose lines all come, rows
/// may be put in the order of time.
#[must_use]
pub fn of<'a>(lines: impl Iterator<Item = &'a [u8]>, is_file: bool) -> Option<Box<dyn Shape>> {
    let lines: Vec<&[u8]> = lines.take(LOOKED_AT).map(<[u8]>::trim_ascii_end).collect();
    None.or_else(|| long::Long::of(&lines, is_file).map(boxed))
        .or_else(|| documents::Documents::of(&lines).map(boxed))
        .or_else(|| hex::Hex::of(&lines).map(boxed))
        .or_else(|| instances::Instances::of(&lines).map(boxed))
        .or_else(|| dated::Dated::of(&lines).map(boxed))
        .or_else(|| stepped::Stepped::of(&lines).map(boxed))
        .or_else(|| pairs::Pairs::of(&lines).map(boxed))
        .or_else(|| Blocks::of(lines.iter().copied()).map(boxed))
        .or_else(|| sentence::Sentence::of(&lines).map(boxed))
        .or_else(|| wrapped::Wrapped::of(&lines).map(boxed))
}

/// What records are whose strings hold the values; `None` where they have values of their own.
#[must_use]
pub fn of_records<'a>(lines: impl Iterator<Item = &'a [u8]>) -> Option<Box<dyn Shape>> {
    let lines: Vec<&[u8]> = lines.take(LOOKED_AT).map(<[u8]>::trim_ascii_end).collect();
    sentence::Sentence::in_records(&lines).map(boxed)
}

/// What a table is that names a sensor or a value in each row, in a file.
#[must_use]
pub fn of_table<'a>(lines: impl Iterator<Item = &'a [u8]>) -> Option<Box<dyn Shape>> {
    let lines: Vec<&[u8]> = lines.take(LOOKED_AT).map(<[u8]>::trim_ascii_end).collect();
    None.or_else(|| long::Long::of(&lines, true).map(boxed)).or_else(|| instances::Instances::of(&lines).map(boxed))
}

fn boxed(shape: impl Shape + 'static) -> Box<dyn Shape> {
    Box::new(shape)
}

/// The same of a file's beginning.
#[must_use]
pub fn of_start(start: &[u8]) -> Option<Box<dyn Shape>> {
    of(whole_lines(start), true)
}

/// The lines of a file's beginning that are whole.
pub fn whole_lines(start: &[u8]) -> impl Iterator<Item = &[u8]> {
    let whole = start.iter().rposition(|&b| b == b'\n').map_or(&b""[..], |end| &start[..end]);
    whole.split(|&b| b == b'\n')
}

/// The head of the table that lines are, and how many of them stand above its rows.
fn head_of(lines: &[&[u8]]) -> Option<(Head, usize)> {
    let mut finder = Finder::default();
    let mut numbered = lines.iter().zip(1..);
    let _ = numbered.all(|(line, number)| finder.take(line, number, &|_| false));
    finder.finish(&mut Skipped::default()).ok()
}

/// A line of a CSV.
pub(crate) fn write_row(out: &mut Vec<u8>, fields: impl IntoIterator<Item = impl AsRef<str>>) {
    for (k, field) in fields.into_iter().enumerate() {
        if k > 0 {
            out.push(b',');
        }
        write_text(out, field.as_ref());
    }
    out.push(b'\n');
}

/// How long the number is that a text begins with.
fn number_end(text: &str) -> Option<usize> {
    for word in ["nan", "NaN", "NAN", "inf", "-inf"] {
        if text.starts_with(word) {
            return Some(word.len());
        }
    }
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(sign);
    let mut end = sign + whole;
    let mut broken = 0;
    if bytes.get(end) == Some(&b'.') {
        broken = digits(end + 1);
        end += 1 + broken;
    }
    if whole + broken == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let power = digits((end + 1 + sign).min(bytes.len()));
        end += if power > 0 { 1 + sign + power } else { 0 };
    }
    Some(end)
}

/// A text of this shape as the CSV that it means.
pub struct AsCsv<R> {
    source: R,
    shape: Box<dyn Shape>,
    /// The line under way.
    line: Vec<u8>,
    text: Vec<u8>,
    given: usize,
    ended: bool,
}

impl<R: Read> AsCsv<R> {
    /// Of a source, from its first byte on.
    pub fn new(source: R, shape: Box<dyn Shape>) -> Self {
        Self { source, shape, line: Vec::new(), text: Vec::new(), given: 0, ended: false }
    }

    fn more(&mut self) -> io::Result<()> {
        const PIECE: usize = 1 << 16;
        let mut buffer = vec![0; PIECE];
        let count = self.source.read(&mut buffer)?;
        (self.text, self.given) = (Vec::new(), 0);
        for &b in &buffer[..count] {
            if b == b'\n' {
                self.shape.line(&std::mem::take(&mut self.line), &mut self.text);
            } else if self.line.len() <= PIECE {
                self.line.push(b);
            }
        }
        if count == 0 {
            self.ended = true;
            // A last line without its end is torn.
            self.shape.end(&mut self.text);
        }
        Ok(())
    }
}

impl<R: Read> Read for AsCsv<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.given == self.text.len() && !self.ended {
            match self.more() {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => other?,
            }
        }
        let n = buffer.len().min(self.text.len() - self.given);
        buffer[..n].copy_from_slice(&self.text[self.given..self.given + n]);
        self.given += n;
        Ok(n)
    }
}
