//! The newest rows in shared memory, laid out in `ipc_types::rate`: written by kalman, read by whoever may read the file.
//!
//! A row's slot holds its number; while it is written that is 0. So readers need no lock, and a writer that is killed at
//! any moment leaves no half row behind that looks whole.

use anyhow::{Context, bail};
use ipc_types::{
    RateRow,
    rate::{RING, RING_HEAD, RING_MAGIC, RING_SLOT, RING_SLOTS, ROW, VERSION, ring_at},
};
use rustix::{
    fs::{FallocateFlags, fallocate},
    mm::{MapFlags, ProtFlags, mmap, munmap},
    thread::futex,
};
use std::{
    fs::{self, File, OpenOptions, Permissions},
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::{Path, PathBuf},
    ptr,
    sync::atomic::{AtomicU32, AtomicU64, Ordering, fence},
};

/// State of a ring whose pipeline runs, and of one that has ended.
const RUNS: u32 = 1;
const ENDED: u32 = 2;

/// Where an instance's ring lies when it is not said.
#[must_use]
pub fn path(instance: &str) -> PathBuf {
    PathBuf::from(format!("/dev/shm/truerate-{}-{}", rustix::process::geteuid().as_raw(), instance))
}

/// A mapped ring.
#[derive(Debug)]
pub struct Ring {
    base: *mut u8,
}

impl Ring {
    /// Makes a new ring at `path`, in place of what is there; a ring of the same run stays as it is.
    ///
    /// # Errors
    /// Where there is no room, or the place may not be written.
    pub fn create(path: &Path, run: u64) -> anyhow::Result<()> {
        if Self::open(path, run).is_ok() {
            return Ok(());
        }
        let what = || format!("{}: the rate's shared memory cannot be made", path.display());
        let part = path.with_extension("part");
        let _ = fs::remove_file(&part);
        let file =
            OpenOptions::new().read(true).write(true).create_new(true).mode(0o600).open(&part).with_context(what)?;
        // The group reads it, whatever the umask.
        file.set_permissions(Permissions::from_mode(0o640)).with_context(what)?;
        // Taken now, so that no row ever finds the memory full.
        fallocate(&file, FallocateFlags::empty(), 0, RING as u64).with_context(what)?;
        let ring = Self::map(&file).with_context(what)?;
        ring.word(ring_at::VERSION).store(u32::from(VERSION).to_le(), Ordering::Relaxed);
        ring.word(ring_at::ROW).store((ROW as u32).to_le(), Ordering::Relaxed);
        ring.word(ring_at::SLOTS).store((RING_SLOTS as u32).to_le(), Ordering::Relaxed);
        ring.word(ring_at::HEAD).store((RING_HEAD as u32).to_le(), Ordering::Relaxed);
        ring.word(ring_at::STATE).store(RUNS.to_le(), Ordering::Relaxed);
        ring.long(ring_at::RUN).store(run.to_le(), Ordering::Relaxed);
        ring.long(ring_at::MAGIC).store(u64::from_ne_bytes(RING_MAGIC), Ordering::Release);
        fs::rename(&part, path).with_context(what)
    }

    /// Opens the ring of this run.
    ///
    /// # Errors
    /// Where there is none, or it is another run's.
    pub fn open(path: &Path, run: u64) -> anyhow::Result<Self> {
        let what = || format!("{}: the rate's shared memory cannot be opened", path.display());
        let file = OpenOptions::new().read(true).write(true).open(path).with_context(what)?;
        if file.metadata().with_context(what)?.len() != RING as u64 {
            bail!("{}: not shared memory of this version", path.display());
        }
        let ring = Self::map(&file).with_context(what)?;
        let good = ring.long(ring_at::MAGIC).load(Ordering::Acquire) == u64::from_ne_bytes(RING_MAGIC)
            && ring.word(ring_at::VERSION).load(Ordering::Relaxed) == u32::from(VERSION).to_le()
            && ring.long(ring_at::RUN).load(Ordering::Relaxed) == run.to_le();
        if !good {
            bail!("{}: is the shared memory of another run", path.display());
        }
        Ok(ring)
    }

    /// Tells the readers that no row comes any more, and removes the file: who has it open keeps it.
    pub fn end(path: &Path, run: u64) {
        if let Ok(ring) = Self::open(path, run) {
            ring.word(ring_at::STATE).store(ENDED.to_le(), Ordering::Release);
            ring.wake();
            let _ = fs::remove_file(path);
        }
    }

    #[allow(unsafe_code, reason = "shared memory is the point")]
    fn map(file: &File) -> rustix::io::Result<Self> {
        // SAFETY: a fresh shared mapping of a file of `RING` bytes, reached through atomics and copies of bytes only.
        let base =
            unsafe { mmap(ptr::null_mut(), RING, ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED, file, 0) }?;
        Ok(Self { base: base.cast() })
    }

    #[allow(unsafe_code, reason = "see `map`")]
    #[allow(
        clippy::cast_ptr_alignment,
        reason = "a mapping begins at a page; the words lie at multiples of their size"
    )]
    fn word(&self, at: usize) -> &AtomicU32 {
        debug_assert!(at.is_multiple_of(4) && at + 4 <= RING);
        // SAFETY: inside the mapping, aligned; lives as long as `self`.
        unsafe { AtomicU32::from_ptr(self.base.add(at).cast()) }
    }

    #[allow(unsafe_code, reason = "see `map`")]
    #[allow(clippy::cast_ptr_alignment, reason = "see `word`")]
    fn long(&self, at: usize) -> &AtomicU64 {
        debug_assert!(at.is_multiple_of(8) && at + 8 <= RING);
        // SAFETY: inside the mapping, aligned; lives as long as `self`.
        unsafe { AtomicU64::from_ptr(self.base.add(at).cast()) }
    }

    /// Gives a row, and wakes who waits. One copy and one system call, no allocation.
    #[allow(unsafe_code, reason = "see `map`")]
    pub fn give(&self, row: &RateRow) {
        let number = u64::from_le(self.long(ring_at::WRITTEN).load(Ordering::Relaxed)) + 1;
        let at = RING_HEAD + (number - 1) as usize % RING_SLOTS * RING_SLOT;
        let bytes = row.to_bytes();
        self.long(at).store(0, Ordering::Relaxed);
        fence(Ordering::SeqCst);
        // SAFETY: the slot lies inside the mapping; kalman's lock keeps other writers away, and readers look at the number
        // before and after.
        unsafe { ptr::copy_nonoverlapping(bytes.as_ptr(), self.base.add(at + 8), ROW) };
        fence(Ordering::SeqCst);
        self.long(at).store(number.to_le(), Ordering::Release);
        self.long(ring_at::WRITTEN).store(number.to_le(), Ordering::Release);
        self.wake();
    }

    fn wake(&self) {
        let word = self.word(ring_at::WAKE);
        word.store(u32::from_le(word.load(Ordering::Relaxed)).wrapping_add(1).to_le(), Ordering::Release);
        let _ = futex::wake(word, futex::Flags::empty(), i32::MAX as u32);
    }
}

impl Drop for Ring {
    #[allow(unsafe_code, reason = "see `map`")]
    fn drop(&mut self) {
        // SAFETY: the mapping is ours, and nothing refers into it any more.
        let _ = unsafe { munmap(self.base.cast(), RING) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_goes_on_in_another_life_and_is_told_from_another_runs() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("rate");
        Ring::create(&path, 7).unwrap();
        for sequence in 1..=3 {
            Ring::open(&path, 7).unwrap().give(&RateRow { sequence, ..RateRow::default() });
        }
        let bytes = fs::read(&path).unwrap();
        assert_eq!(bytes[40..48], 3_u64.to_le_bytes());
        let third = &bytes[RING_HEAD + 2 * RING_SLOT..];
        assert_eq!((&third[..8], &third[16..24]), (&3_u64.to_le_bytes()[..], &3_u64.to_le_bytes()[..]));
        assert!(Ring::open(&path, 8).is_err());
        Ring::create(&path, 7).unwrap();
        assert_eq!(fs::read(&path).unwrap(), bytes, "adopted");
        let held = File::open(&path).unwrap();
        Ring::end(&path, 7);
        assert!(!path.exists() && held.metadata().unwrap().len() == RING as u64);
    }
}
