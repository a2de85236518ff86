//! A recording in several files of one folder, as ROS 2 splits it.

use super::error::Problem;
use log_readers::format::{Note, Sink, Topic};
use std::{
    fs,
    path::{Path, PathBuf},
};
use yaml_rust2::{Yaml, YamlLoader};

/// What ROS 2 writes beside the files of a recording.
const METADATA: &str = "metadata.yaml";

/// The files of a recording, in order: those of a folder, or the one file that is named. The folder's own list counts, where
/// it has one.
pub fn files(path: &Path) -> Result<Vec<PathBuf>, Problem> {
    if path.file_name().is_some_and(|name| name == METADATA) && path.is_file() {
        return listed(path);
    }
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let list = path.join(METADATA);
    if list.is_file() {
        return listed(&list);
    }
    let entries = fs::read_dir(path).map_err(Problem::Open)?;
    let mut files: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(|path| is_recording(path)).collect();
    // A split is numbered, and the tenth comes after the ninth.
    let number = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let stem = name.split('.').next().unwrap_or_default();
        stem.rsplit('_').next().and_then(|end| end.parse::<u64>().ok())
    };
    files.sort_by_cached_key(|path| (number(path), path.clone()));
    if files.is_empty() { Err(Problem::Folder(of_gyro(path))) } else { Ok(files) }
}

/// The file of a folder whose name says that it is a gyro's.
fn of_gyro(folder: &Path) -> Option<String> {
    let files = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path()).filter(|path| path.is_file());
    files.filter(|path| is_of_gyro(path)).min().map(|path| path.display().to_string())
}

/// Whether the name of a file says that it is a gyro's.
pub fn is_of_gyro(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    ["gyro", "imu", "angular"].iter().any(|word| name.contains(word))
}

fn is_recording(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".zstd").unwrap_or(&name);
    [".mcap", ".db3"].iter().any(|ending| name.ends_with(ending))
}

/// The files that a recording's own list names.
fn listed(list: &Path) -> Result<Vec<PathBuf>, Problem> {
    let text = fs::read_to_string(list).map_err(Problem::Open)?;
    let document = YamlLoader::load_from_str(&text).map_err(|error| Problem::Metadata(error.to_string()))?;
    let information = document.first().map(|of| &of["rosbag2_bagfile_information"]);
    let names: Vec<&str> = information
        .and_then(|of| of["relative_file_paths"].as_vec())
        .map(|names| names.iter().filter_map(Yaml::as_str).collect())
        .unwrap_or_default();
    if names.is_empty() {
        return Err(Problem::Metadata("no relative_file_paths in it".to_owned()));
    }
    let folder = list.parent().unwrap_or(Path::new("."));
    let there = |name: &str| {
        // Older recordings name a file with its folder, and a file that was packed afterwards without its new ending.
        let bare = Path::new(name).file_name().unwrap_or_default();
        let mut packed = bare.to_owned();
        packed.push(".zstd");
        let places = [folder.join(name), folder.join(bare), folder.join(packed)];
        places.into_iter().find(|path| path.is_file()).ok_or_else(|| Problem::Incomplete(name.to_owned()))
    };
    names.into_iter().map(there).collect()
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

    fn said(&mut self, key: &str, value: &str) {
        self.sink.said(key, value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str], list: Option<&str>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        if let Some(list) = list {
            let text = format!("rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n{list}");
            fs::write(folder.path().join(METADATA), text).unwrap();
        }
        folder
    }

    fn names(path: &Path) -> Vec<String> {
        files(path).unwrap().iter().map(|file| file.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_recording_is_the_files_that_it_lists_or_all_in_the_order_of_their_numbers() {
        let splits = ["bag_10.mcap", "bag_9.mcap", "bag_0.mcap.zstd", "other.mcap"];
        let without = folder(&splits[..3], None);
        assert_eq!(names(without.path()), ["bag_0.mcap.zstd", "bag_9.mcap", "bag_10.mcap"]);
        let with = folder(&splits, Some("    - bag/bag_0.mcap\n    - bag_10.mcap\n    - bag_9.mcap\n"));
        assert_eq!(names(with.path()), ["bag_0.mcap.zstd", "bag_10.mcap", "bag_9.mcap"]);
        assert_eq!(names(&with.path().join(METADATA)).len(), 3);
    }

    #[test]
    fn a_list_that_lacks_a_file_or_says_nothing_is_refused() {
        let lacking = folder(&["bag_0.mcap"], Some("    - bag_0.mcap\n    - bag_1.mcap\n"));
        assert!(files(lacking.path()).unwrap_err().to_string().contains("bag_1.mcap"));
        let empty = folder(&["bag_0.mcap"], Some(""));
        assert!(matches!(files(empty.path()), Err(Problem::Metadata(_))));
        let none = folder(&[], None);
        assert!(matches!(files(none.path()), Err(Problem::Folder(None))));
        let gyro = none.path().join("Gyroscope.csv");
        fs::write(&gyro, "").unwrap();
        assert!(matches!(files(none.path()), Err(Problem::Folder(Some(name))) if name == gyro.display().to_string()));
    }
}
