//! The lines of a text, numbered as an editor numbers them, never more than one line and a look ahead in memory.

use std::{
    io::{self, Read},
    ops::Range,
};

/// Longest line that is read, bytes: 10⁵ columns of 40 characters.
pub const LONGEST_LINE: usize = 4 << 20;
/// Read at once.
const PIECE: usize = 1 << 18;
/// What some programs put before UTF-8 text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Why there is no next line.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// The source failed.
    #[error("{0}")]
    Read(io::Error),
    /// A line without end.
    #[error("a line is longer than {LONGEST_LINE} bytes")]
    TooLong,
}

/// Where a line stands in the buffer, and in the text.
#[derive(Clone, Debug)]
pub struct Line {
    place: Range<usize>,
    /// Its number, from 1.
    pub number: u64,
    /// Whether a line end follows it.
    pub ended: bool,
}

/// The lines of a text. A line end between quotation marks ends no line.
pub struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    /// Where what has not been given begins, and ends.
    start: usize,
    end: usize,
    /// Line ends passed.
    passed: u64,
    /// `\n`, or `\r` in texts that have no other.
    terminator: Option<u8>,
    source_ended: bool,
}

impl<R: Read> Lines<R> {
    /// Of this source, from its first byte on.
    pub fn new(source: R) -> Self {
        Self { source, buffer: Vec::new(), start: 0, end: 0, passed: 0, terminator: None, source_ended: false }
    }

    /// The source.
    pub fn source(&self) -> &R {
        &self.source
    }

    /// Lines passed so far.
    pub fn passed(&self) -> u64 {
        self.passed
    }

    /// The bytes of a line that was found and not passed by yet, or was passed by last.
    pub fn bytes(&self, line: &Line) -> &[u8] {
        &self.buffer[line.place.clone()]
    }

    /// The next line, which is passed by.
    ///
    /// # Errors
    /// The source failed, or a line has no end.
    pub fn next(&mut self) -> Result<Option<Line>, LineError> {
        let Some((found, after)) = self.find(0, self.passed)? else { return Ok(None) };
        self.start += after;
        self.passed += found.ends;
        Ok(Some(found.line))
    }

    /// The lines to come, as long as `more` wants further ones; none is passed by.
    ///
    /// # Errors
    /// As [`Self::next`].
    pub fn look(&mut self, mut more: impl FnMut(&[u8], u64) -> bool) -> Result<(), LineError> {
        let (mut from, mut passed) = (0, self.passed);
        while let Some((found, after)) = self.find(from, passed)? {
            if !more(self.bytes(&found.line), found.line.number) {
                break;
            }
            from = after;
            passed += found.ends;
        }
        Ok(())
    }

    /// Passes `count` lines by.
    ///
    /// # Errors
    /// As [`Self::next`].
    pub fn skip(&mut self, count: usize) -> Result<(), LineError> {
        for _ in 0..count {
            self.next()?;
        }
        Ok(())
    }

    /// The line that begins `from` bytes after the start, and where the one after it does.
    fn find(&mut self, from: usize, passed: u64) -> Result<Option<(Found, usize)>, LineError> {
        while self.terminator.is_none() {
            self.fill()?;
        }
        let (mut searched, mut quoted, mut closed_at, mut ends) = (from, false, usize::MAX, 0);
        loop {
            let terminator = self.terminator.unwrap_or(b'\n');
            let text = &self.buffer[self.start..self.end];
            while let Some(at) = memchr::memchr2(terminator, b'"', &text[searched..]).map(|at| at + searched) {
                searched = at + 1;
                if text[at] == b'"' {
                    // Two of them within a quotation stand for one.
                    let opens = at == from || at - 1 == closed_at || b",;\t| ".contains(&text[at - 1]);
                    closed_at = if quoted { at } else { closed_at };
                    quoted = !quoted && opens;
                    continue;
                }
                ends += 1;
                if !quoted {
                    let found = self.found(from..at, passed, ends, true);
                    return Ok(Some((found, at + 1)));
                }
            }
            searched = text.len();
            if searched - from > LONGEST_LINE {
                return Err(LineError::TooLong);
            }
            if self.source_ended {
                if searched == from {
                    return Ok(None);
                }
                let found = self.found(from..searched, passed, ends, false);
                return Ok(Some((found, searched)));
            }
            self.fill()?;
        }
    }

    fn found(&self, place: Range<usize>, passed: u64, ends: u64, ended: bool) -> Found {
        let mut place = self.start + place.start..self.start + place.end;
        while place.end > place.start && self.buffer[place.end - 1] == b'\r' {
            place.end -= 1;
        }
        Found { line: Line { place, number: passed + 1, ended }, ends }
    }

    fn fill(&mut self) -> Result<(), LineError> {
        if self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if self.buffer.len() - self.end < PIECE {
            let length = self.end + 2 * PIECE;
            // The system gives a first buffer as zeros.
            if self.buffer.is_empty() { self.buffer = vec![0; length] } else { self.buffer.resize(length, 0) }
        }
        let got = loop {
            match self.source.read(&mut self.buffer[self.end..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other.map_err(LineError::Read)?,
            }
        };
        self.source_ended = got == 0;
        self.end += got;
        if self.terminator.is_none() {
            let text = &self.buffer[self.start..self.end];
            if text.len() < BYTE_ORDER_MARK.len() && !self.source_ended {
                return Ok(());
            }
            if text.starts_with(BYTE_ORDER_MARK) {
                self.start += BYTE_ORDER_MARK.len();
            }
            // Old programs end a line with a carriage return alone.
            let old = memchr::memchr(b'\n', text).is_none()
                && memchr::memchr(b'\r', &text[..text.len() - usize::from(!text.is_empty())]).is_some();
            self.terminator = Some(if old { b'\r' } else { b'\n' });
        }
        Ok(())
    }
}

struct Found {
    line: Line,
    ends: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &[u8]) -> Vec<(u64, String)> {
        let mut lines = Lines::new(text);
        std::iter::from_fn(|| {
            let line = lines.next().unwrap()?;
            Some((line.number, String::from_utf8_lossy(lines.bytes(&line)).into_owned()))
        })
        .collect()
    }

    #[test]
    fn lines_are_numbered_as_an_editor_numbers_them_whatever_ends_them() {
        let wanted = vec![(1, "a".to_owned()), (2, String::new()), (3, "b,c".to_owned())];
        for text in ["a\n\nb,c\n", "a\r\n\r\nb,c\r\n", "a\n\nb,c", "\u{feff}a\n\nb,c", "a\r\rb,c\r"] {
            assert_eq!(all(text.as_bytes()), wanted, "{text:?}");
        }
    }

    #[test]
    fn a_line_end_between_quotation_marks_ends_no_line() {
        assert_eq!(all(b"\"a \"\"b\"\"\n\",c\nd").len(), 2);
        let wanted = vec![(1, "\"a\nb\",c".to_owned()), (3, "5\" pipe".to_owned()), (4, "d".to_owned())];
        assert_eq!(all(b"\"a\nb\",c\n5\" pipe\nd"), wanted);
    }

    #[test]
    fn looking_ahead_passes_nothing_by() {
        let mut lines = Lines::new(&b"a\nb\nc\n"[..]);
        let mut seen = Vec::new();
        lines
            .look(|bytes, number| {
                seen.push((bytes.to_vec(), number));
                number < 2
            })
            .unwrap();
        assert_eq!(seen, [(b"a".to_vec(), 1), (b"b".to_vec(), 2)]);
        lines.skip(1).unwrap();
        let line = lines.next().unwrap().unwrap();
        assert_eq!((lines.bytes(&line), line.number, line.ended), (&b"b"[..], 2, true));
    }

    #[test]
    fn a_line_without_end_is_an_error_before_it_fills_the_memory() {
        let endless = io::repeat(b'x');
        assert!(matches!(Lines::new(endless).next(), Err(LineError::TooLong)));
        assert!(matches!(Lines::new(io::repeat(b'"')).next(), Err(LineError::TooLong)));
    }
}
