//! Text without the signs by which a terminal is told colours and places.

use std::io::{self, Read};

/// What such a sign begins with.
const ESCAPE: u8 = 0x1b;

/// Takes them out of bytes that come piece by piece.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unescaped {
    within: Within,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Within {
    #[default]
    Text,
    /// Behind the escape.
    Begun,
    /// Behind `ESC [`: up to a letter.
    Sequence,
    /// Behind `ESC ]`: up to a bell, or the next escape.
    Title,
}

impl Unescaped {
    /// Adds what is text to `out`.
    pub fn take(&mut self, bytes: &[u8], out: &mut Vec<u8>) {
        for &b in bytes {
            self.within = match (self.within, b) {
                // A line's end ends all.
                (_, b'\n') => {
                    out.push(b);
                    Within::Text
                }
                (_, ESCAPE) => Within::Begun,
                (Within::Text, b) => {
                    out.push(b);
                    Within::Text
                }
                (Within::Begun, b'[') => Within::Sequence,
                (Within::Begun, b']') => Within::Title,
                (Within::Sequence, b) if !(0x40..=0x7e).contains(&b) => Within::Sequence,
                (Within::Title, b) if b != 0x07 => Within::Title,
                _ => Within::Text,
            };
        }
    }
}

/// Whether a text that begins like this has such signs.
#[must_use]
pub fn has_escapes(start: &[u8]) -> bool {
    start.windows(2).any(|pair| pair[0] == ESCAPE && matches!(pair[1], b'[' | b']'))
}

/// A text without them.
pub struct Plain<R> {
    source: R,
    escapes: Unescaped,
    text: Vec<u8>,
    given: usize,
    ended: bool,
}

impl<R: Read> Plain<R> {
    /// Of this source.
    pub fn new(source: R) -> Self {
        Self { source, escapes: Unescaped::default(), text: Vec::new(), given: 0, ended: false }
    }
}

impl<R: Read> Read for Plain<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        const PIECE: usize = 1 << 14;
        while self.given == self.text.len() && !self.ended {
            let mut piece = [0; PIECE];
            let count = self.source.read(&mut piece)?;
            self.ended = count == 0;
            (self.given, self.text) = (0, Vec::with_capacity(count));
            self.escapes.take(&piece[..count], &mut self.text);
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

    #[test]
    fn colours_and_titles_are_taken_out_however_the_bytes_come() {
        let text = b"\x1b[0;32mI (12) imu: gz=1\x1b[0m\r\n\x1b]0;title\x07a\x1b[2K\x1b[1Gb\n\x1b[3";
        assert!(has_escapes(text) && !has_escapes(b"t,gyro_z\n"));
        for size in 1..text.len() {
            let (mut escapes, mut out) = (Unescaped::default(), Vec::new());
            for piece in text.chunks(size) {
                escapes.take(piece, &mut out);
            }
            assert_eq!(String::from_utf8(out).unwrap(), "I (12) imu: gz=1\r\nab\n");
        }
        let mut whole = String::new();
        Plain::new(&text[..]).read_to_string(&mut whole).unwrap();
        assert_eq!(whole, "I (12) imu: gz=1\r\nab\n");
    }
}
