//! Standard input, or a named pipe: text as it comes, unpacked where it begins like gzip or MCAP.

use super::{Got, Link, of_stream};
use flate2::read::MultiGzDecoder;
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
        if start.starts_with(&BYTE_ORDER_MARK) {
            start.drain(..BYTE_ORDER_MARK.len());
        }
        let whole = Cursor::new(start).chain(raw);
        Ok(Self(match (packed, recording) {
            (true, _) => Box::new(MultiGzDecoder::new(whole)),
            (_, true) => Box::new(AsCsv::new(whole)),
            _ => Box::new(whole),
        }))
    }
}

impl Link for Pipe {
    fn read(&mut self, buffer: &mut [u8], _patience: Duration) -> io::Result<Got> {
        of_stream(self.0.read(buffer))
    }
}
