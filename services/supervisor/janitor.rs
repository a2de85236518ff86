//! Removes shared memory that a process left when it was killed and that iceoryx2 0.10 does not remove, and takes what
//! the others promise.
//!
//! - **Without a size**: its maker was killed before giving it one. Whoever clears the dead maker's node opens that
//!   memory and waits for its size without end (`dynamic_storage::posix_shared_memory`): the supervisor in its sweep,
//!   every other process at its start. Once it is gone they go on.
//! - **Without a port**: a connection whose maker was killed between making it and entering itself
//!   (`zero_copy_connection::common::create_or_open_shm`). Clearing the maker removes its entry, and the memory only when
//!   that was the last one; here there never was one. A port has its tag before its memory and until after it, so
//!   memory of ports without tags is nobody's.
//!
//! The janitor uses nothing of iceoryx2, on a thread of its own, so that it never waits with them.

use super::room::Reserve;
use anyhow::Context;
use ipc_types::domain::Domain;
use std::{
    collections::HashSet,
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
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
    /// Looks after the shared memory of `domain`.
    ///
    /// # Errors
    /// Where no thread can be started.
    pub fn start(domain: &Domain) -> anyhow::Result<Self> {
        let (stop, stopped) = channel();
        let (prefix, nodes) = (domain.prefix().to_owned(), domain.root().join("nodes"));
        let work = move || {
            let (mut suspects, mut reserve) = (HashSet::new(), Reserve::default());
            while stopped.recv_timeout(ROUND) == Err(RecvTimeoutError::Timeout) {
                suspects = round(&prefix, &nodes, &suspects);
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

/// Removes what has no size or no port, had none in the last round (`suspects`, by inode) and is open nowhere; returns
/// the suspects for the next round. `nodes` is the folder where iceoryx2 has a folder of tags for every node.
fn round(prefix: &str, nodes: &Path, suspects: &HashSet<u64>) -> HashSet<u64> {
    let tags = tags(nodes);
    let mut next = HashSet::new();
    for entry in fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with(prefix) {
            continue;
        }
        let Ok(meta) = entry.metadata() else { continue };
        // Without any tag, not even the supervisor's, the folder was not read.
        let alone =
            || !tags.is_empty() && ports(&name).is_some_and(|ports| ports.iter().all(|port| !tags.contains(port)));
        if meta.len() > 0 && !alone() {
            continue;
        }
        let path = entry.path();
        if suspects.contains(&meta.ino()) && !is_open(&path) && fs::remove_file(&path).is_ok() {
            tracing::warn!("{}: its maker was killed while making it; removed", path.display());
        } else {
            next.insert(meta.ino());
        }
    }
    next
}

/// The ports that have a tag.
fn tags(nodes: &Path) -> HashSet<u128> {
    let files = |folder: PathBuf| fs::read_dir(folder).into_iter().flatten().flatten();
    let of_nodes = files(nodes.to_owned()).filter(|node| node.file_type().is_ok_and(|kind| kind.is_dir()));
    of_nodes
        .flat_map(|node| files(node.path()))
        .filter_map(|file| {
            file.file_name().to_string_lossy().strip_suffix(".port_tag")?.rsplit('_').next()?.parse().ok()
        })
        .collect()
}

/// The ports at the two ends of a connection, from its name: `…_SENDER_RECEIVER.connection`.
fn ports(name: &str) -> Option<[u128; 2]> {
    let mut from_end = name.strip_suffix(".connection")?.rsplit('_').map_while(|word| word.parse().ok());
    Some([from_end.next()?, from_end.next()?])
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
    use super::{HashSet, Path, fs, round};
    use ipc_types::{domain::Domain, port::Hub, topic, wait::Wait};
    use std::{fs::File, io::Write, path::PathBuf};

    #[test]
    fn only_what_has_no_size_and_no_maker_goes() {
        let prefix = format!("truerate_janitor_{}_", std::process::id());
        let path = |name: &str| PathBuf::from(format!("/dev/shm/{prefix}{name}"));
        let round = |suspects: &HashSet<u64>| round(&prefix, Path::new("/nowhere"), suspects);
        File::create(path("whole")).unwrap().write_all(b"x").unwrap();
        File::create(path("abandoned")).unwrap();
        let held = File::create(path("held")).unwrap();
        let first = round(&HashSet::new());
        assert!(first.len() == 2 && path("abandoned").exists(), "nothing goes the first time it is seen: {first:?}");
        let second = round(&first);
        assert!(!path("abandoned").exists() && path("held").exists() && path("whole").exists());
        drop(held);
        assert!(round(&second).is_empty() && !path("held").exists() && path("whole").exists());
        fs::remove_file(path("whole")).unwrap();
    }

    #[test]
    fn a_connection_of_no_port_goes_and_that_of_a_living_one_stays() {
        let place = tempfile::tempdir().unwrap();
        let domain = Domain::new(place.path(), "janitor").unwrap();
        fs::create_dir_all(domain.root()).unwrap();
        domain.begin_generation().unwrap();
        let hub = Hub::join(&domain, "test").unwrap();
        let held = hub.create_all().unwrap();
        let ends = (hub.writer(&topic::SAMPLE).unwrap(), hub.reader(&topic::SAMPLE, None, Wait::Event).unwrap());
        let memory = || {
            let all = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
            let of_us = |path: &PathBuf| path.to_string_lossy().contains(domain.prefix());
            let mut all: Vec<_> = all.filter(of_us).collect();
            all.sort();
            all
        };
        let before = memory();
        let alive = before.iter().find(|path| path.extension().is_some_and(|kind| kind == "connection")).unwrap();
        let [.., kind, _, _] = alive.to_str().unwrap().split('_').collect::<Vec<_>>()[..] else { panic!("{alive:?}") };
        let (begin, _) = alive.to_str().unwrap().split_once(kind).unwrap();
        let left = PathBuf::from(format!("{begin}{kind}_12_34.connection"));
        fs::copy(alive, &left).unwrap();
        let round = |suspects: &HashSet<u64>| round(domain.prefix(), &domain.root().join("nodes"), suspects);
        let first = round(&HashSet::new());
        assert!(first.len() == 1 && left.exists(), "nothing goes the first time it is seen: {first:?}");
        assert!(round(&first).is_empty());
        assert_eq!(memory(), before);
        drop((ends, held, hub));
        for path in memory() {
            fs::remove_file(path).unwrap();
        }
    }
}
