//! Removes shared memory whose maker was killed before giving it a size, and takes what the others promise.
//!
//! Whoever clears the dead maker's node opens that memory, and iceoryx2 0.10 waits for its size without end
//! (`dynamic_storage::posix_shared_memory`): the supervisor in its sweep, every other process at its start. Once it is
//! gone they go on. The janitor uses nothing of iceoryx2, on a thread of its own, so that it never waits with them.

use super::room::Reserve;
use anyhow::Context;
use std::{
    collections::HashSet,
    fs,
    os::unix::fs::MetadataExt,
    path::Path,
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread::JoinHandle,
    time::Duration,
};

/// Between two rounds. A maker that lives needs some microseconds.
const ROUND: Duration = Duration::from_millis(100);

/// At work until it is dropped.
#[derive(Debug)]
pub struct Janitor {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Janitor {
    /// Looks after the shared memory whose names begin with `prefix`.
    ///
    /// # Errors
    /// Where no thread can be started.
    pub fn start(prefix: &str) -> anyhow::Result<Self> {
        let (stop, stopped) = channel();
        let prefix = prefix.to_owned();
        let work = move || {
            let (mut suspects, mut reserve) = (HashSet::new(), Reserve::default());
            while stopped.recv_timeout(ROUND) == Err(RecvTimeoutError::Timeout) {
                suspects = round(&prefix, &suspects);
                reserve.take(&prefix);
            }
        };
        let thread = std::thread::Builder::new().name("janitor".to_owned()).spawn(work).context("the janitor")?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Janitor {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Removes what has no size, had none in the last round (`suspects`, by inode) and is open nowhere; returns the suspects
/// for the next round.
fn round(prefix: &str, suspects: &HashSet<u64>) -> HashSet<u64> {
    let mut next = HashSet::new();
    for entry in fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(prefix) {
            continue;
        }
        let Some(inode) = entry.metadata().ok().filter(|m| m.len() == 0).map(|m| m.ino()) else { continue };
        let path = entry.path();
        if suspects.contains(&inode) && !is_open(&path) && fs::remove_file(&path).is_ok() {
            tracing::warn!("{}: its maker was killed while making it; removed", path.display());
        } else {
            next.insert(inode);
        }
    }
    next
}

/// Whether a process has the file open. Those that wait for its size look at it for an instant, once a millisecond;
/// its maker holds it.
fn is_open(path: &Path) -> bool {
    let numbered = |e: &fs::DirEntry| e.file_name().to_string_lossy().bytes().all(|b| b.is_ascii_digit());
    fs::read_dir("/proc").into_iter().flatten().flatten().filter(numbered).any(|process| {
        let files = fs::read_dir(process.path().join("fd")).into_iter().flatten().flatten();
        files.into_iter().any(|file| fs::read_link(file.path()).is_ok_and(|target| target == path))
    })
}

#[cfg(test)]
mod tests {
    use super::{HashSet, fs, round};
    use std::{fs::File, io::Write, path::PathBuf};

    #[test]
    fn only_what_has_no_size_and_no_maker_goes() {
        let prefix = format!("truerate_janitor_{}_", std::process::id());
        let path = |name: &str| PathBuf::from(format!("/dev/shm/{prefix}{name}"));
        File::create(path("whole")).unwrap().write_all(b"x").unwrap();
        File::create(path("abandoned")).unwrap();
        let held = File::create(path("held")).unwrap();
        let first = round(&prefix, &HashSet::new());
        assert!(first.len() == 2 && path("abandoned").exists(), "nothing goes the first time it is seen: {first:?}");
        let second = round(&prefix, &first);
        assert!(!path("abandoned").exists() && path("held").exists() && path("whole").exists());
        drop(held);
        assert!(round(&prefix, &second).is_empty() && !path("held").exists() && path("whole").exists());
        fs::remove_file(path("whole")).unwrap();
    }
}
