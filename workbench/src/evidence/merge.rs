//! Evidence files read log by log, and merged without holding them: of each log only its hash and its place are kept.

use super::{Evidence, LogEvidence, differ, head, tail, unsound};
use crate::output::{Output, failed};
use anyhow::{Context, Result, ensure};
use gyro_model::parallel;
use sha2::{Digest, Sha256};
use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// One log of a file.
pub(super) struct Line<'a> {
    /// Where it stands.
    at: u64,
    /// Its text, without the comma behind it.
    text: &'a str,
    /// What it says.
    pub(super) log: LogEvidence,
}

/// How a file is written.
pub(super) enum Written {
    /// As this program writes one, a log a line, and whole.
    Whole,
    /// So, and with a log that holds what no log makes: its name, and what that is.
    Unsound(String, String),
    /// In another way, or not whole: [`Evidence::parse`] says what is wrong with it, if anything is.
    Otherwise,
}

/// Hands each log of a file to `take`, if the file is whole and written as this program writes one, a log a line.
pub(super) fn lines(file: impl Read, mut take: impl FnMut(Line)) -> Written {
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let (mut line, mut at) = (String::new(), 0);
    let mut next = |line: &mut String| -> Option<u64> {
        line.clear();
        let start = at;
        at += reader.read_line(line).ok().filter(|length| *length > 0)? as u64;
        Some(start)
    };
    if next(&mut line).is_none() || line.trim_end() != head() {
        return Written::Otherwise;
    }
    let (mut sum, mut many, mut faulty) = (Sha256::new(), 0, None);
    while let Some(at) = next(&mut line) {
        let text = line.trim_end();
        if text.starts_with(']') {
            let is_whole = many > 0 && text == tail(&sum.finalize()) && next(&mut line).is_none();
            return match faulty {
                _ if !is_whole => Written::Otherwise,
                Some((log, why)) => Written::Unsound(log, why),
                None => Written::Whole,
            };
        }
        let text = text.strip_suffix(',').unwrap_or(text);
        let Ok(log) = serde_json::from_str::<LogEvidence>(text) else { return Written::Otherwise };
        if many > 0 {
            sum.update(b"\n");
        }
        sum.update(text);
        many += 1;
        faulty = faulty.or_else(|| Some((log.log.clone(), unsound(&log)?)));
        if faulty.is_none() {
            take(Line { at, text, log });
        }
    }
    Written::Otherwise
}

fn opened(path: &Path) -> Result<File> {
    File::open(path).with_context(|| format!("{}: cannot be read: check the path", path.display()))
}

/// Hands each log of a file to `take`, in the order of the file. Only one is held at a time, if the file is written as this program
/// writes one.
///
/// # Errors
/// As [`Evidence::parse`], and a file that cannot be read: some of its logs have been taken by then.
pub fn each(path: &Path, mut take: impl FnMut(LogEvidence)) -> Result<()> {
    let mut taken = 0;
    let written = lines(opened(path)?, |line| {
        take(line.log);
        taken += 1;
    });
    if !matches!(written, Written::Whole) {
        Evidence::read(path)?.logs.into_iter().skip(taken).for_each(take);
    }
    Ok(())
}

/// Where one log stands.
struct Entry {
    sha256: String,
    /// Which file it is in.
    file: usize,
    at: u64,
    length: usize,
    /// Hash of the line.
    line: [u8; 32],
}

impl Entry {
    fn of(file: usize, at: u64, text: &str, sha256: String) -> Self {
        Self { sha256, file, at, length: text.len(), line: Sha256::digest(text).into() }
    }
}

/// A file that is merged: its path or, where it is not written as this program writes one, its lines.
enum Source {
    File(PathBuf),
    Lines(String),
}

impl Source {
    /// File number `file`, and its logs.
    fn new(path: &Path, file: usize) -> Result<(Self, Vec<Entry>)> {
        let mut entries = Vec::new();
        let written = lines(opened(path)?, |line| entries.push(Entry::of(file, line.at, line.text, line.log.sha256)));
        if matches!(written, Written::Whole) {
            return Ok((Self::File(path.to_owned()), entries));
        }
        entries.clear();
        let mut text = String::new();
        for log in Evidence::read(path)?.logs {
            let line = serde_json::to_string(&log)?;
            entries.push(Entry::of(file, text.len() as u64, &line, log.sha256));
            text.push_str(&line);
        }
        Ok((Self::Lines(text), entries))
    }
}

/// The sources, of which the file that was read last stays open.
struct Sources {
    all: Vec<Source>,
    open: Option<(usize, File)>,
}

impl Sources {
    /// The line of one log.
    fn line(&mut self, entry: &Entry) -> Result<String> {
        let path = match &self.all[entry.file] {
            Source::Lines(text) => return Ok(text[entry.at as usize..][..entry.length].to_owned()),
            Source::File(path) => path,
        };
        let mut file = match self.open.take() {
            Some((number, file)) if number == entry.file => file,
            _ => opened(path)?,
        };
        let mut bytes = vec![0; entry.length];
        let read = file.seek(SeekFrom::Start(entry.at)).and_then(|_| file.read_exact(&mut bytes));
        self.open = Some((entry.file, file));
        let whole = read.is_ok() && <[u8; 32]>::from(Sha256::digest(&bytes)) == entry.line;
        let text = String::from_utf8(bytes).ok().filter(|_| whole);
        text.with_context(|| format!("{}: changed while it was read: merge again", path.display()))
    }

    fn log(&mut self, entry: &Entry) -> Result<LogEvidence> {
        Ok(serde_json::from_str(&self.line(entry)?)?)
    }
}

/// What a merge came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Merged {
    /// Logs in the file.
    pub logs: usize,
    /// Logs that came once more.
    pub twice: usize,
    /// Bytes of the file.
    pub bytes: u64,
}

/// Merges files into one, which may be one of them. Every file is read before anything is written.
///
/// # Errors
/// As [`Evidence::parse`] and [`Evidence::new`], and a file that cannot be read or written.
pub fn merge(files: &[PathBuf], output: &Path) -> Result<Merged> {
    let mut entries = Vec::new();
    let mut sources = Sources { all: Vec::new(), open: None };
    let numbered: Vec<(usize, &PathBuf)> = files.iter().enumerate().collect();
    for read in parallel::map(&numbered, |(file, path)| Source::new(path, *file)) {
        let (source, own) = read?;
        sources.all.push(source);
        entries.extend(own);
    }
    let many = entries.len();
    entries.sort_by(|a, b| (&a.sha256, a.file, a.at).cmp(&(&b.sha256, b.file, b.at)));
    let mut kept: Vec<Entry> = Vec::with_capacity(many);
    for entry in entries {
        match kept.last().filter(|known| known.sha256 == entry.sha256) {
            None => kept.push(entry),
            Some(known) if known.line == entry.line => {}
            Some(known) => {
                let name = |own: &Entry| files[own.file].display().to_string();
                let (first, second) = (name(known), name(&entry));
                let (known, other) = (sources.log(known)?, sources.log(&entry)?);
                ensure!(known == other, differ((&known, &first), (&other, &second)));
            }
        }
    }
    let mut to = Counted { output: Output::create(output)?, bytes: 0 };
    let mut write = |text: &str| to.write_all(text.as_bytes()).with_context(|| failed(output));
    write(&(head() + "\n"))?;
    let mut sum = Sha256::new();
    for (number, entry) in kept.iter().enumerate() {
        let line = sources.line(entry)?;
        if number > 0 {
            write(",\n")?;
            sum.update(b"\n");
        }
        sum.update(&line);
        write(&line)?;
    }
    write(&format!("\n{}\n", tail(&sum.finalize())))?;
    let bytes = to.bytes;
    to.output.finish()?;
    Ok(Merged { logs: kept.len(), twice: many - kept.len(), bytes })
}

/// An output that counts.
struct Counted {
    output: Output,
    bytes: u64,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.output.write(bytes)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}
