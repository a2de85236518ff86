//! The bytes of a log: from a file or standard input, unpacked, hashed on the way.

use super::{
    error::{Problem, first_of},
    folder::is_of_gyro,
    packing::Packing,
};
use crate::{
    files::{
        self,
        archive::{self, Archive},
    },
    recording::{AsCsv, is_own},
};
use flate2::read::MultiGzDecoder;
use log_readers::{
    can::Database,
    format::{Format, Note, START, Sink},
    formats::{Unread, can, columns::Columns, kinds::Kinds, recognise, unread},
    json, packed, shape,
    text::{self, Plain, has_escapes},
};
use sha2::{Digest, Sha256};
use std::{
    fmt::Write,
    io::{self, BufReader, Cursor, Read},
    path::Path,
    sync::{Arc, Mutex},
};

/// The name under which `-` appears in messages and provenance.
pub const STANDARD_INPUT: &str = "standard input";

/// An opened log.
pub struct Input {
    bytes: Box<dyn Read + Send>,
    hash: Arc<Mutex<Sha256>>,
    packing: Packing,
    format: &'static dyn Format,
    /// What was noted when text was made of it; `None` where its bytes are its own.
    converted: Option<Vec<Note>>,
    unread: Option<Unread>,
    /// Whether its lines are those of the file as it is stored.
    is_as_stored: bool,
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
    /// Opens a file, or standard input for `-`; unpacks what begins like gzip or zstd, takes the one file out of a zip archive, and the samples
    /// out of a recording of ours.
    pub fn open(path: &Path) -> Result<Self, Problem> {
        let source: Box<dyn Read + Send> = if path == Path::new("-") {
            Box::new(io::stdin())
        } else {
            let file = files::open(path).map_err(Problem::Open)?;
            if path.is_dir() {
                return Err(Problem::Folder(None));
            }
            unwritten(path)?;
            file
        };
        Self::of(source, is_gz(path)).map_err(|problem| match problem {
            Problem::Archive { count, names, such } => {
                let archive = if path == Path::new("-") { Path::new("FILE.zip") } else { path };
                Problem::Archive { count, names, such: archive.join(such).display().to_string() }
            }
            problem => problem,
        })
    }

    /// The bytes of a source; `is_gz` where its name says that they are packed.
    pub fn of(source: Box<dyn Read + Send>, is_gz: bool) -> Result<Self, Problem> {
        let hash = Arc::new(Mutex::new(Sha256::new()));
        let mut source = BufReader::with_capacity(1 << 18, Hashing { inner: source, hash: hash.clone() });
        let start = start(&mut source, packed::ZSTD.len()).map_err(Problem::Read)?;
        let packing = match start.as_slice() {
            [] => return Err(Problem::Empty),
            archive::MAGIC => return Self::of_archive(Cursor::new(start).chain(source)),
            [0x1f, 0x8b, ..] => Packing::Gzip,
            start if start == packed::ZSTD => Packing::Zstd,
            _ if is_gz => return Err(Problem::NotGzip),
            _ => Packing::Plain,
        };
        let whole = Cursor::new(start).chain(source);
        let mut bytes: Box<dyn Read + Send> = match packing {
            Packing::Plain => Box::new(whole),
            Packing::Gzip => Box::new(MultiGzDecoder::new(whole)),
            Packing::Zstd => Box::new(packed::zstd(whole).map_err(|error| Problem::reading(error, packing))?),
        };
        let mut start = self::start(&mut bytes, START).map_err(|error| Problem::reading(error, packing))?;
        let mut encoding = text::marked(&start);
        if let Some(encoding) = encoding {
            bytes = Box::new(text::decoded(Cursor::new(start).chain(bytes), encoding));
            start = self::start(&mut bytes, START).map_err(|error| Problem::reading(error, packing))?;
        }
        let (own, mut records) = (is_own(&start), json::is_records(&start));
        let mut shaped = None;
        let mut format = recognise(if own || records { TEXT } else { &start });
        if !own && start.trim_ascii_start().starts_with(b"{") && is_text(format) {
            let is_whole = look_further(&mut bytes, &mut start).map_err(|error| Problem::reading(error, packing))?;
            if Columns::is_document(&start, is_whole) {
                (format, records) = (&Columns, false);
            }
        }
        if is_text(format) && !own && !records {
            if let Err(error) = look_further(&mut bytes, &mut start) {
                // What is whole before the damage is read, and the damage reported at its line.
                bytes = Box::new(Broken(Some(error)));
            }
            let (unmarked, has_escapes) = (text::unmarked(&start), has_escapes(&start));
            if unmarked.is_some() || has_escapes {
                encoding = encoding.or(unmarked);
                bytes = Box::new(Cursor::new(std::mem::take(&mut start)).chain(bytes));
                if let Some(unmarked) = unmarked {
                    bytes = Box::new(text::decoded(bytes, unmarked));
                }
                if has_escapes {
                    bytes = Box::new(Plain::new(bytes));
                }
                if let Err(error) = look_further(&mut bytes, &mut start) {
                    bytes = Box::new(Broken(Some(error)));
                }
            }
            records = json::is_records_below(&start);
            if !records && Kinds::is_text_of(&start) {
                format = &Kinds;
            } else if !records {
                shaped = shape::of_start(&start);
            }
        }
        if records && !own {
            let _ = look_further(&mut bytes, &mut start);
            shaped = shape::of_records(shape::whole_lines(&start));
            records = shaped.is_none();
        }
        let unread = if own || records || shaped.is_some() || !is_text(format) { None } else { unread(&start) };
        let mut whole = Cursor::new(start).chain(bytes);
        if let Some(as_text) = format.as_text() {
            let table = as_text(&mut whole).map_err(|cause| Problem::unreadable(format, cause, packing))?;
            return Ok(Self {
                bytes: table.text,
                hash,
                packing,
                format,
                converted: Some(table.notes),
                unread: None,
                is_as_stored: false,
            });
        }
        let is_as_stored = packing == Packing::Plain && !(encoding.is_some() || own || records || shaped.is_some());
        let bytes: Box<dyn Read + Send> = match () {
            () if own => Box::new(AsCsv::new(whole)),
            () if records => shaped_again(Box::new(json::AsCsv::new(whole)))?,
            () => match shaped {
                Some(shape) => Box::new(shape::AsCsv::new(whole, shape)),
                None => Box::new(whole),
            },
        };
        Ok(Self { bytes, hash, packing, format, converted: None, unread, is_as_stored })
    }

    /// The one file of an archive that is meant.
    fn of_archive(source: impl Read) -> Result<Self, Problem> {
        let mut archive = Archive::read(source).map_err(Problem::Zip)?;
        if archive.is_sheet() {
            return Err(Problem::Unread { what: "an Excel sheet", remedy: "save it as CSV" });
        }
        let names = archive.names();
        let Some(name) = archive.only() else {
            let gyros = names.iter().find(|name| is_of_gyro(Path::new(name)));
            let such = gyros.or(names.first()).ok_or(Problem::Empty)?.clone();
            return Err(Problem::Archive { count: names.len(), names: first_of(&names, "files"), such });
        };
        let bytes = archive.file(&name).map_err(Problem::Zip)?;
        // One that holds itself would be unpacked for ever.
        if bytes.starts_with(archive::MAGIC) {
            return Err(Problem::Unread { what: "an archive within an archive", remedy: "unpack it" });
        }
        Self::of(Box::new(Cursor::new(bytes)), is_gz(Path::new(&name)))
    }

    /// Whether it is read row by row, as text is.
    pub fn is_text(&self) -> bool {
        self.converted.is_some() || is_text(self.format)
    }

    /// Whether the numbers of its lines are those of the file, as a tool that edits lines counts them.
    pub fn is_as_stored(&self) -> bool {
        self.is_as_stored && is_text(self.format)
    }

    /// What it is where it is of no format that is read.
    pub fn unread(&self) -> Option<Unread> {
        self.unread
    }

    /// The format of its bytes.
    pub fn format(&self) -> &'static dyn Format {
        self.format
    }

    /// Reads it to its end, with what a DBC file says of frames.
    pub fn read_all(&mut self, database: Option<&Database>, sink: &mut dyn Sink) -> Result<(), Problem> {
        let (format, packing) = (self.format, self.packing);
        let read = match database.and_then(|database| can::with(format, database)) {
            Some(frames) => frames.read(self, sink),
            None if self.converted.is_some() => recognise(TEXT).read(self, sink),
            None => format.read(self, sink),
        };
        read.map_err(|cause| Problem::unreadable(format, cause, packing))?;
        self.converted.iter().flatten().for_each(|note| sink.note(note.clone()));
        Ok(())
    }

    /// How it is packed.
    pub fn packing(&self) -> Packing {
        self.packing
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
        self.bytes.read(buffer)
    }
}

fn is_gz(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gz"))
}

/// The table that records mean, which may name a sensor or a value in each row.
fn shaped_again(mut table: Box<dyn Read + Send>) -> Result<Box<dyn Read + Send>, Problem> {
    const LOOK: u64 = 1 << 15;
    let mut start = Vec::new();
    (&mut table).take(LOOK).read_to_end(&mut start).map_err(Problem::Read)?;
    let shape = shape::of_table(shape::whole_lines(&start));
    let whole = Cursor::new(start).chain(table);
    Ok(match shape {
        Some(shape) => Box::new(shape::AsCsv::new(whole, shape)),
        None => Box::new(whole),
    })
}

/// How a text may begin.
const TEXT: &[u8] = b"t";

fn is_text(format: &dyn Format) -> bool {
    format.name() == recognise(TEXT).name()
}

/// Refuses a database beside which messages lie that were not written into it yet.
fn unwritten(path: &Path) -> Result<(), Problem> {
    let mut log = path.as_os_str().to_owned();
    log.push("-wal");
    let is_database = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("db3"));
    if is_database && files::size(Path::new(&log)).is_ok_and(|size| size > 0) {
        return Err(Problem::Unwritten(Path::new(&log).display().to_string()));
    }
    Ok(())
}

/// A source that ends in an error.
struct Broken(Option<io::Error>);

impl Read for Broken {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        self.0.take().map_or(Ok(0), Err)
    }
}

/// Adds what comes next of a text to its start: as much as tells whether its rows are of several kinds.
/// Whether nothing follows.
fn look_further(source: &mut impl Read, start: &mut Vec<u8>) -> io::Result<bool> {
    const LOOK: u64 = 1 << 15;
    source.take(LOOK).read_to_end(start).map(|count| (count as u64) < LOOK)
}

/// The first bytes of a source: those of its first line, where that comes alone.
fn start(source: &mut impl Read, count: usize) -> io::Result<Vec<u8>> {
    let (mut start, mut buffer) = (Vec::with_capacity(count), [0; START]);
    // A line is enough, but of JSON, whose lines may hold a bracket each.
    while start.len() < count && (matches!(start.first(), Some(b'[' | b'{')) || !start.contains(&b'\n')) {
        match source.read(&mut buffer[..count - start.len()]) {
            Ok(0) => break,
            Ok(n) => start.extend_from_slice(&buffer[..n]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(start)
}
