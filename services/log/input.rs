//! The bytes of a log: from a file or standard input, unpacked, hashed on the way, and never more than a line at once.

use super::error::Problem;
use crate::recording::{AsCsv, MAGIC};
use flate2::read::MultiGzDecoder;
use sha2::{Digest, Sha256};
use std::{
    fmt::Write,
    fs::File,
    io::{self, BufReader, Cursor, Read},
    path::Path,
    sync::{Arc, Mutex},
};

/// Longest line that is read, bytes: 10⁵ columns of 40 characters.
pub const LONGEST_LINE: usize = 4 << 20;

/// The name under which `-` appears in messages and provenance.
pub const STANDARD_INPUT: &str = "standard input";

/// What some programs put before UTF-8 text.
const BYTE_ORDER_MARK: [u8; 3] = [0xef, 0xbb, 0xbf];

/// An opened log.
pub struct Input {
    bytes: Box<dyn Read + Send>,
    hash: Arc<Mutex<Sha256>>,
    packed: bool,
    /// What may still be read before the current line counts as endless.
    left: usize,
}

/// The bytes as stored, hashed while they pass.
struct Hashing<R> {
    inner: R,
    hash: Arc<Mutex<Sha256>>,
}

impl<R: Read> Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        if let Ok(mut hash) = self.hash.lock() {
            hash.update(&buffer[..n]);
        }
        Ok(n)
    }
}

impl Input {
    /// Opens a file, or standard input for `-`; unpacks what begins like gzip, and takes the samples out of an MCAP recording.
    pub fn open(path: &Path) -> Result<Self, Problem> {
        let hash = Arc::new(Mutex::new(Sha256::new()));
        let source: Box<dyn Read + Send> = if path == Path::new("-") {
            Box::new(io::stdin())
        } else {
            let file = File::open(path).map_err(Problem::Open)?;
            if file.metadata().map_err(Problem::Open)?.is_dir() {
                return Err(Problem::Folder);
            }
            Box::new(file)
        };
        let mut source = BufReader::with_capacity(1 << 16, Hashing { inner: source, hash: hash.clone() });
        let mut start = Vec::with_capacity(MAGIC.len());
        source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut start).map_err(Problem::Read)?;
        let packed = start.starts_with(&[0x1f, 0x8b]);
        let recording = start == MAGIC;
        if start.is_empty() {
            return Err(Problem::Empty);
        }
        if !packed && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
            return Err(Problem::NotGzip);
        }
        if start.starts_with(&BYTE_ORDER_MARK) {
            start.drain(..BYTE_ORDER_MARK.len());
        }
        let whole = Cursor::new(start).chain(source);
        let bytes: Box<dyn Read + Send> = match (packed, recording) {
            (true, _) => Box::new(MultiGzDecoder::new(whole)),
            (_, true) => Box::new(AsCsv::new(whole)),
            _ => Box::new(whole),
        };
        Ok(Self { bytes, hash, packed, left: LONGEST_LINE })
    }

    /// A new line begins.
    pub fn next_line(&mut self) {
        self.left = LONGEST_LINE;
    }

    /// What a failed read means.
    pub fn problem(&self, error: io::Error) -> Problem {
        if error.kind() == io::ErrorKind::FileTooLarge {
            Problem::LongLine(LONGEST_LINE)
        } else if self.packed {
            Problem::Gzip(error)
        } else {
            Problem::Read(error)
        }
    }

    /// SHA-256 of what was read so far, in hexadecimal.
    pub fn sha256(&self) -> String {
        let digest = self.hash.lock().map(|hash| hash.clone().finalize()).unwrap_or_default();
        digest.iter().fold(String::with_capacity(64), |mut hex, byte| {
            let _ = write!(hex, "{byte:02x}");
            hex
        })
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.bytes.read(buffer)?;
        match self.left.checked_sub(n) {
            Some(left) => self.left = left,
            None => return Err(io::ErrorKind::FileTooLarge.into()),
        }
        Ok(n)
    }
}
