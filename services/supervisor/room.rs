//! Room for a pipeline: in shared memory, where its messages lie, and in its folder, where it keeps what outlives a process.
//! Memory that was promised and is not there ends a process by SIGBUS, without a word: it is asked for beforehand.

use anyhow::{Context, bail};
use ipc_types::domain::Domain;
use rustix::{
    fs::{FallocateFlags, fallocate, statvfs},
    io::Errno,
    process::geteuid,
};
use std::{
    collections::HashSet,
    fs::{self, OpenOptions},
    os::unix::fs::MetadataExt,
    path::Path,
};

/// Where shared memory lies.
pub const MEMORY: &str = "/dev/shm";

/// What a pipeline of all its processes takes of shared memory, and once more what one takes that is started again before what
/// its earlier life had is cleared, bytes.
pub const IN_MEMORY: u64 = 60 << 20;
/// What it takes in its folder, bytes.
const IN_FOLDER: u64 = 2 << 20;
/// Less than that is as good as nothing, bytes.
const NOTHING: u64 = 64 << 10;

/// Whether a pipeline has room to begin.
///
/// # Errors
/// Where it has not: how much is missing, and what to do.
pub fn check(domain: &Domain) -> anyhow::Result<()> {
    let free = free(Path::new(MEMORY))?;
    if free < IN_MEMORY {
        bail!(
            "{MEMORY} has {} free, a pipeline needs {}: free some, or enlarge it (mount -o remount,size=128M {MEMORY}; of a \
             container --shm-size=128m)",
            bytes(free),
            bytes(IN_MEMORY)
        );
    }
    let free = self::free(domain.folder())?;
    if free < IN_FOLDER {
        bail!(
            "{} has {} free, a pipeline needs {}: free some, or set TRUERATE_RUNTIME_DIR to another folder",
            domain.folder().display(),
            bytes(free),
            bytes(IN_FOLDER)
        );
    }
    Ok(())
}

/// What is full, in words, where something is.
#[must_use]
pub fn shortage(domain: &Domain) -> Option<String> {
    [Path::new(MEMORY), domain.folder()]
        .into_iter()
        .find(|place| free(place).is_ok_and(|free| free < NOTHING))
        .map(|place| format!("{} is full", place.display()))
}

fn free(place: &Path) -> anyhow::Result<u64> {
    let there = statvfs(place).with_context(|| place.display().to_string())?;
    // A file system without a limit says 0 blocks.
    Ok(if there.f_blocks == 0 { u64::MAX } else { there.f_bavail.saturating_mul(there.f_frsize) })
}

fn bytes(count: u64) -> String {
    if count < 1 << 20 { format!("{} KB", count >> 10) } else { format!("{} MB", count >> 20) }
}

/// The shared memory of a pipeline, taken as soon as it is made.
#[derive(Debug, Default)]
pub struct Reserve {
    taken: HashSet<u64>,
    full: bool,
}

impl Reserve {
    /// Takes what was made since the last time, of the segments whose names begin so.
    pub fn take(&mut self, prefix: &str) {
        let mut there = HashSet::new();
        for entry in fs::read_dir(MEMORY).into_iter().flatten().flatten() {
            let Ok(meta) = entry.metadata() else { continue };
            let ours = entry.file_name().to_string_lossy().starts_with(prefix) && meta.uid() == geteuid().as_raw();
            if !ours || meta.len() == 0 {
                continue;
            }
            if self.taken.contains(&meta.ino()) {
                there.insert(meta.ino());
                continue;
            }
            // One that is still being made cannot be opened yet.
            let Ok(file) = OpenOptions::new().read(true).write(true).open(entry.path()) else { continue };
            match fallocate(&file, FallocateFlags::KEEP_SIZE, 0, meta.len()) {
                Ok(()) => _ = there.insert(meta.ino()),
                Err(Errno::NOSPC) => {
                    if !std::mem::replace(&mut self.full, true) {
                        tracing::error!("{MEMORY} is full: a process may die of it; free some, or enlarge it");
                    }
                    return;
                }
                Err(_) => {}
            }
        }
        self.full = false;
        self.taken = there;
    }
}
