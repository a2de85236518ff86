//! A recording in several files of one folder, as ROS 2 splits it.

use super::error::Problem;
use log_readers::format::{Note, Sink, Topic};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// The files of a recording, in order: those of a folder, or the one file that is named.
pub fn files(path: &Path) -> Result<Vec<PathBuf>, Problem> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = fs::read_dir(path).map_err(Problem::Open)?;
    let mut files: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(|path| is_recording(path)).collect();
    // A split is numbered, and the tenth comes after the ninth.
    let number = |path: &PathBuf| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        stem.rsplit('_').next().and_then(|end| end.parse::<u64>().ok())
    };
    files.sort_by_cached_key(|path| (number(path), path.clone()));
    if files.is_empty() { Err(Problem::Folder) } else { Ok(files) }
}

fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

/// Passes on what several files hold as one: a topic that is there already goes on.
pub struct Continued<'a> {
    sink: &'a mut dyn Sink,
    topics: Vec<(Topic, bool)>,
    /// Of the file under way: its topics' numbers among all.
    numbers: Vec<usize>,
}

impl<'a> Continued<'a> {
    /// Of no file yet.
    pub fn new(sink: &'a mut dyn Sink) -> Self {
        Self { sink, topics: Vec::new(), numbers: Vec::new() }
    }

    /// A file begins.
    pub fn next_file(&mut self) {
        self.numbers.clear();
    }
}

impl Sink for Continued<'_> {
    fn topic(&mut self, topic: &Topic) -> bool {
        let known = self.topics.iter().position(|(known, _)| known == topic);
        let number = known.unwrap_or_else(|| {
            let wanted = self.sink.topic(topic);
            self.topics.push((topic.clone(), wanted));
            self.topics.len() - 1
        });
        self.numbers.push(number);
        self.topics[number].1
    }

    fn message(&mut self, topic: usize, time_ns: i64, values: &[f64]) {
        if let Some(&number) = self.numbers.get(topic) {
            self.sink.message(number, time_ns, values);
        }
    }

    fn note(&mut self, note: Note) {
        self.sink.note(note);
    }
}
