//! Standard input, or a named pipe: text as it comes, unpacked where it begins like gzip or MCAP, decoded where it begins like UTF-16.

use super::{Got, Link, of_stream};
use flate2::read::MultiGzDecoder;
use log_readers::text;
use mcap::MAGIC;
use std::{
    fs::File,
    io::{self, BufReader, Cursor, Read},
    path::Path,
    time::Duration,
};
use workbench::recording::AsCsv;

const GZIP: [u8; 2] = [0x1f, 0x8b];
const BYTE_ORDER_MARK: [u8; 3] = [0xef, 0xbb, 0xbf];

/// An open pipe.
pub struct Pipe(Box<dyn Read + Send>);

impl Pipe {
    /// Whether this path means standard input.
    #[must_use]
    pub fn is_standard_input(path: &Path) -> bool {
        path == Path::new("-")
    }

    /// Opens it, and waits for its first bytes.
    ///
    /// # Errors
    /// Where it is not there, or may not be read.
    pub fn open(path: &Path) -> io::Result<Self> {
        let raw: Box<dyn Read + Send> =
            if Self::is_standard_input(path) { Box::new(io::stdin()) } else { Box::new(File::open(path)?) };
        let mut raw = BufReader::with_capacity(1 << 16, raw);
        let mut start = Vec::with_capacity(MAGIC.len());
        raw.by_ref().take(MAGIC.len() as u64).read_to_end(&mut start)?;
        let (packed, recording) = (start.starts_with(&GZIP), start == MAGIC);
        let encoding = text::marked(&start);
        if start.starts_with(&BYTE_ORDER_MARK) {
            start.drain(..BYTE_ORDER_MARK.len());
        }
        let whole = Cursor::new(start).chain(raw);
        Ok(Self(match encoding {
            _ if packed => Box::new(MultiGzDecoder::new(whole)),
            _ if recording => Box::new(AsCsv::new(whole)),
            Some(encoding) => Box::new(text::decoded(whole, encoding)),
            None => Box::new(whole),
        }))
    }
}

impl Link for Pipe {
    fn read(&mut self, buffer: &mut [u8], _patience: Duration) -> io::Result<Got> {
        of_stream(self.0.read(buffer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn text_in_utf16_comes_as_utf8() {
        let text = "t_ms\tgyro_z_dps\n0\t1.5\n";
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let units = std::iter::once(0xfeff).chain(text.encode_utf16());
        file.write_all(&units.flat_map(u16::to_le_bytes).collect::<Vec<u8>>()).unwrap();
        let mut found = String::new();
        Pipe::open(file.path()).unwrap().0.read_to_string(&mut found).unwrap();
        assert_eq!(found, text);
    }
}
