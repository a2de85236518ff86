//! Bytes taken from a source in order. A length that stands in a file is held against what is there: memory grows only with
//! bytes that have come.

use std::io::{self, Read};

/// Longest record that is taken whole.
pub const LONGEST: usize = 64 << 20;
/// Read at once.
const PIECE: usize = 1 << 18;

/// A source with a position.
pub struct Bytes<'a> {
    source: &'a mut dyn Read,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Bytes taken so far.
    position: u64,
    ended: bool,
}

impl<'a> Bytes<'a> {
    /// Of this source, from its first byte on.
    pub fn new(source: &'a mut dyn Read) -> Self {
        Self { source, buffer: Vec::new(), start: 0, end: 0, position: 0, ended: false }
    }

    /// Bytes taken so far.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// The next bytes, not taken; fewer than asked for at the end, and no more than [`LONGEST`].
    pub fn peek(&mut self, count: usize) -> io::Result<&[u8]> {
        let count = count.min(LONGEST);
        while self.end - self.start < count && !self.ended {
            self.fill(count)?;
        }
        Ok(&self.buffer[self.start..self.end.min(self.start + count)])
    }

    /// The next bytes; `None` where fewer are left, or more are asked for than [`LONGEST`]: then none is taken.
    pub fn take(&mut self, count: usize) -> io::Result<Option<&[u8]>> {
        if self.peek(count)?.len() < count {
            return Ok(None);
        }
        let from = self.start;
        self.start += count;
        self.position += count as u64;
        Ok(Some(&self.buffer[from..from + count]))
    }

    /// The next bytes as an array.
    pub fn array<const N: usize>(&mut self) -> io::Result<Option<[u8; N]>> {
        Ok(self.take(N)?.and_then(|bytes| bytes.try_into().ok()))
    }

    /// Passes bytes by; `false` where fewer are left.
    pub fn skip(&mut self, count: u64) -> io::Result<bool> {
        let mut left = count;
        while left > 0 {
            if self.start == self.end {
                if self.ended {
                    return Ok(false);
                }
                self.fill(1)?;
                continue;
            }
            let now = left.min((self.end - self.start) as u64);
            self.start += now as usize;
            self.position += now;
            left -= now;
        }
        Ok(true)
    }

    fn fill(&mut self, wanted: usize) -> io::Result<()> {
        if self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        // The buffer doubles with what has come, whatever is asked for.
        let room = wanted.clamp(PIECE, (2 * self.end).max(PIECE));
        if self.buffer.len() < room.max(self.end + 1) {
            let length = room.max(self.end + PIECE);
            // The system gives a first buffer as zeros.
            if self.buffer.is_empty() { self.buffer = vec![0; length] } else { self.buffer.resize(length, 0) }
        }
        let got = loop {
            match self.source.read(&mut self.buffer[self.end..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        self.ended = got == 0;
        self.end += got;
        Ok(())
    }
}

/// Numbers taken from a slice in order; `None` past its end.
#[derive(Clone, Copy, Debug)]
pub struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

macro_rules! numbers {
    ($($name:ident $type:ty),*) => {$(
        #[doc = concat!("The next ", stringify!($type), ", little-endian.")]
        pub fn $name(&mut self) -> Option<$type> {
            let bytes = self.take(size_of::<$type>())?;
            Some(<$type>::from_le_bytes(bytes.try_into().ok()?))
        }
    )*};
}

impl<'a> Cursor<'a> {
    /// From the slice's first byte on.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// The next bytes.
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let found = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(found)
    }

    /// What is left.
    pub fn rest(self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// Bytes after a length of four bytes.
    pub fn prefixed(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(usize::try_from(length).ok()?)
    }

    numbers!(u8 u8, u16 u16, u32 u32, u64 u64);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_that_lies_takes_no_memory() {
        let mut source = &b"abc"[..];
        let mut bytes = Bytes::new(&mut source);
        assert!(bytes.take(usize::MAX).unwrap().is_none());
        assert!(bytes.take(LONGEST).unwrap().is_none());
        assert!(bytes.buffer.len() <= 2 * PIECE);
        assert_eq!(bytes.take(2).unwrap(), Some(&b"ab"[..]));
        assert_eq!(bytes.position(), 2);
        assert!(!bytes.skip(u64::MAX).unwrap());
    }

    #[test]
    fn a_long_record_comes_whole() {
        let long: Vec<u8> = (0..3_000_000_u32).map(|i| i as u8).collect();
        let mut source = &long[..];
        let mut bytes = Bytes::new(&mut source);
        assert!(bytes.skip(5).unwrap());
        assert_eq!(bytes.take(2_000_000).unwrap().unwrap(), &long[5..2_000_005]);
        assert_eq!(bytes.peek(10).unwrap(), &long[2_000_005..2_000_015]);
        let mut cursor = Cursor::new(&[2, 0, 0, 0, 7, 8, 9]);
        assert_eq!((cursor.prefixed(), cursor.rest(), cursor.u16()), (Some(&[7, 8][..]), &[9][..], None));
    }
}
