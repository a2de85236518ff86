//! Text whose lines are no rows of a table, as the lines of a CSV that they mean, whoever has them: a file or a stream.

mod blocks;
mod documents;
mod long;

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
    if let Some(long) = long::Long::of(&lines, is_file) {
        return Some(Box::new(long));
    }
    if let Some(documents) = documents::Documents::of(&lines) {
        return Some(Box::new(documents));
    }
    Blocks::of(lines.iter().copied()).map(|blocks| Box::new(blocks) as Box<dyn Shape>)
}

/// The same of a file's beginning.
#[must_use]
pub fn of_start(start: &[u8]) -> Option<Box<dyn Shape>> {
    let whole = start.iter().rposition(|&b| b == b'\n').map_or(&b""[..], |end| &start[..end]);
    of(whole.split(|&b| b == b'\n'), true)
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
