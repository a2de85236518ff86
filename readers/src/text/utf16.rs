//! Text in UTF-16, as some programs of Windows write it, to UTF-8.

use std::io::{self, Read};

/// What text in UTF-16 begins with: the little end first, or the big one.
const MARKS: [[u8; 2]; 2] = [[0xff, 0xfe], [0xfe, 0xff]];
/// Read at once.
const PIECE: usize = 1 << 16;

/// Whether a file that begins like this is text in UTF-16.
#[must_use]
pub fn is_utf16(start: &[u8]) -> bool {
    MARKS.iter().any(|mark| start.starts_with(mark))
}

/// UTF-8 of a source in UTF-16 that begins with its mark; what is no character becomes U+FFFD.
pub struct Utf16<R> {
    source: R,
    big_endian: Option<bool>,
    /// Bytes that are not decoded yet: less than a character.
    rest: Vec<u8>,
    text: Vec<u8>,
    given: usize,
    ended: bool,
}

impl<R: Read> Utf16<R> {
    /// Of this source, from its mark on.
    pub fn new(source: R) -> Self {
        Self { source, big_endian: None, rest: Vec::new(), text: Vec::new(), given: 0, ended: false }
    }

    fn fill(&mut self) -> io::Result<()> {
        let before = self.rest.len();
        self.rest.resize(before + PIECE, 0);
        let read = self.source.read(&mut self.rest[before..]);
        self.rest.truncate(before + read.as_ref().map_or(0, |n| *n));
        self.ended = read? == 0;
        if self.big_endian.is_none() && self.rest.len() >= 2 {
            self.big_endian = Some(self.rest[..2] == MARKS[1]);
            self.rest.drain(..2);
        }
        let Some(big_endian) = self.big_endian else { return Ok(()) };
        let unit = |pair: &[u8]| if big_endian { [pair[1], pair[0]] } else { [pair[0], pair[1]] };
        let mut units: Vec<u16> = self.rest.chunks_exact(2).map(|pair| u16::from_le_bytes(unit(pair))).collect();
        // The first half of a character waits for the second.
        if !self.ended && units.last().is_some_and(|unit| (0xd800..0xdc00).contains(unit)) {
            units.pop();
        }
        self.rest.drain(..2 * units.len());
        (self.text, self.given) = (Vec::new(), 0);
        let mut place = [0; 4];
        for character in char::decode_utf16(units) {
            let character = character.unwrap_or(char::REPLACEMENT_CHARACTER);
            self.text.extend_from_slice(character.encode_utf8(&mut place).as_bytes());
        }
        Ok(())
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.given == self.text.len() && !self.ended {
            self.fill()?;
        }
        let n = buffer.len().min(self.text.len() - self.given);
        buffer[..n].copy_from_slice(&self.text[self.given..self.given + n]);
        self.given += n;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One byte at a time.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let n = self.0.len().min(1);
            buffer[..n].copy_from_slice(&self.0[..n]);
            self.0 = &self.0[n..];
            Ok(n)
        }
    }

    #[test]
    fn both_ends_are_read_however_the_bytes_come() {
        let text = "t,ω °/s,𝛼\n1,2\n";
        for big in [false, true] {
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            let bytes: Vec<u8> =
                units.flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect();
            assert!(is_utf16(&bytes));
            for cut in [0, 1] {
                let mut found = String::new();
                Utf16::new(Slow(&bytes[..bytes.len() - cut])).read_to_string(&mut found).unwrap();
                assert_eq!(found, if cut == 0 { text } else { text.trim_end() });
            }
        }
        assert!(!is_utf16(b"t,gyro"));
    }
}
