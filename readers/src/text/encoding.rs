//! Text in another encoding than UTF-8, as UTF-8: UTF-16, as its mark says, and Windows-1252, as older programs write `°`.

use encoding_rs::{Encoding, UTF_8, WINDOWS_1252};
use encoding_rs_io::DecodeReaderBytesBuilder;
use std::io::Read;

/// The encoding that the mark at a text's beginning says; `None` where it is UTF-8, or there is no mark.
#[must_use]
pub fn marked(start: &[u8]) -> Option<&'static Encoding> {
    Encoding::for_bom(start).map(|(encoding, _)| encoding).filter(|encoding| *encoding != UTF_8)
}

/// The encoding of a text that begins like this without a mark; `None` where it is UTF-8, or no text.
#[must_use]
pub fn unmarked(start: &[u8]) -> Option<&'static Encoding> {
    is_windows_1252(start).then_some(WINDOWS_1252)
}

/// Whether there are letters and signs beyond ASCII, and none of them in UTF-8.
fn is_windows_1252(start: &[u8]) -> bool {
    let is_text = |b: &u8| matches!(b, b'\t' | b'\n' | b'\r' | 0x1b | 0x20..=0x7e | 0xa0..);
    if !start.iter().all(is_text) {
        return false;
    }
    // What is looked at may end within a character.
    let whole = &start[..start.len().saturating_sub(3)];
    let mut chunks = whole.utf8_chunks().peekable();
    let mut has_any = false;
    while let Some(chunk) = chunks.next() {
        if !chunk.valid().is_ascii() {
            return false;
        }
        has_any |= !chunk.invalid().is_empty() && chunks.peek().is_some();
    }
    has_any
}

/// A source in this encoding, in UTF-8 and without its mark; what is no character becomes U+FFFD.
pub fn decoded<R: Read + Send>(source: R, encoding: &'static Encoding) -> impl Read + Send {
    DecodeReaderBytesBuilder::new().encoding(Some(encoding)).bom_override(true).strip_bom(true).build(source)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One byte at a time.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let n = self.0.len().min(1);
            buffer[..n].copy_from_slice(&self.0[..n]);
            self.0 = &self.0[n..];
            Ok(n)
        }
    }

    #[test]
    fn each_encoding_is_read_however_the_bytes_come() {
        let text = "t,ω °/s,𝛼\n1,2\n";
        let wide = |big: bool| -> Vec<u8> {
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            units.flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect()
        };
        let old = b"t [s];Drehrate [\xb0/s]\n0,1;2,5\n".to_vec();
        for (bytes, means) in [(wide(false), text), (wide(true), text), (old, "t [s];Drehrate [°/s]\n0,1;2,5\n")] {
            let mut found = String::new();
            decoded(Slow(&bytes), marked(&bytes).or_else(|| unmarked(&bytes)).unwrap())
                .read_to_string(&mut found)
                .unwrap();
            assert_eq!(found, means);
        }
    }

    #[test]
    fn ascii_utf8_damaged_or_not_and_bytes_are_not_foreign() {
        let plain = ["t,gyro\n1,2\n", "t,ω °/s\n1,2\n"].map(|text| text.as_bytes().to_vec());
        let torn = b"t,\xc2\xb0/s,\xb0\n1,2\n".to_vec();
        let dump = b"\x01\x02\xb0\xb1\n\xff\x00".to_vec();
        let cut = "1,2,°".as_bytes()[..5].to_vec();
        for bytes in plain.into_iter().chain([torn, dump, cut, b"\xef\xbb\xbft\n".to_vec(), Vec::new()]) {
            assert_eq!(marked(&bytes).or_else(|| unmarked(&bytes)), None, "{bytes:?}");
        }
    }
}
