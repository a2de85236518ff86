//! State that survives its process: plain data in a mapped file of the run's folder, two slots in turn, so that the
//! process can be killed at any moment and one of them is whole. Saving is a copy in memory: no call, no allocation.

use anyhow::Context;
use rustix::{
    fs::{FallocateFlags, MemfdFlags, fallocate, memfd_create},
    mm::{MapFlags, ProtFlags, mmap, munmap},
};
use std::{
    fs::{File, OpenOptions},
    marker::PhantomData,
    path::Path,
    ptr,
    sync::atomic::{Ordering, fence},
};

/// One slot. It is whole where both numbers agree.
#[repr(C)]
struct Slot<T> {
    before: u64,
    value: T,
    after: u64,
}

/// What the two slots begin with: who wrote them.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq)]
struct Owner {
    run: u64,
    size: u64,
}

/// Two slots of `T` in a file.
#[derive(Debug)]
pub struct Vault<T: Copy> {
    base: *mut u8,
    length: usize,
    number: u64,
    kind: PhantomData<T>,
}

impl<T: Copy> Vault<T> {
    /// Opens the file, or makes it. What another run left in it does not count; a run belongs to one build of the program.
    ///
    /// # Errors
    /// Where it cannot be made or mapped.
    #[allow(unsafe_code, reason = "a mapping outlives the process, which is the point")]
    #[allow(clippy::cast_ptr_alignment, reason = "a mapping begins at a page")]
    pub fn open(path: &Path, run: u64) -> anyhow::Result<Self> {
        let what = || path.display().to_string();
        let length = size_of::<Owner>() + 2 * size_of::<Slot<T>>() + 64;
        let mut file: File =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).with_context(what)?;
        // Taken now, so that no save ever finds the disk full.
        if let Err(error) = fallocate(&file, FallocateFlags::empty(), 0, length as u64) {
            tracing::error!("{}: {error}: going on, but nothing survives this process", path.display());
            file = memfd_create("vault", MemfdFlags::CLOEXEC).with_context(what)?.into();
            file.set_len(length as u64).with_context(what)?;
        }
        // SAFETY: a fresh shared mapping of `length` bytes of a file of that length; nobody else in this process maps it,
        // and the service's lock keeps other processes away.
        let base =
            unsafe { mmap(ptr::null_mut(), length, ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED, &file, 0) }
                .with_context(what)?
                .cast::<u8>();
        let mut vault = Self { base, length, number: 0, kind: PhantomData };
        let owner = Owner { run, size: size_of::<T>() as u64 };
        // SAFETY: the mapping begins page-aligned and holds an `Owner`, for which every bit pattern is valid.
        unsafe {
            let place = base.cast::<Owner>();
            if ptr::read(place) == owner {
                vault.number = (0..2).map(|i| vault.whole(i).unwrap_or(0)).max().unwrap_or(0);
            } else {
                ptr::write_bytes(base, 0, length);
                ptr::write(place, owner);
            }
        }
        Ok(vault)
    }

    fn slot(&self, number: u64) -> *mut Slot<T> {
        let offset = size_of::<Owner>().next_multiple_of(align_of::<Slot<T>>());
        self.base.wrapping_add(offset + (number % 2) as usize * size_of::<Slot<T>>()).cast()
    }

    /// The number of slot `i`, where it is whole.
    #[allow(unsafe_code, reason = "see `open`")]
    fn whole(&self, i: u64) -> Option<u64> {
        let slot = self.slot(i);
        // SAFETY: both numbers lie inside the mapping, aligned; any bit pattern is a number.
        let (before, after) =
            unsafe { (ptr::read_volatile(&raw const (*slot).before), ptr::read_volatile(&raw const (*slot).after)) };
        (before == after && before > 0 && before % 2 == i).then_some(before)
    }

    /// What was saved last, if anything.
    #[must_use]
    #[allow(unsafe_code, reason = "see `open`")]
    pub fn load(&self) -> Option<T> {
        let slot = self.slot(self.number);
        // SAFETY: the slot is whole and of this run, which only this build of the program goes on with: it wrote a `T` there.
        (self.whole(self.number % 2) == Some(self.number) && self.number > 0)
            .then(|| unsafe { ptr::read(&raw const (*slot).value) })
    }

    /// Saves; what was saved before stays whole until this is.
    #[allow(unsafe_code, reason = "see `open`")]
    pub fn save(&mut self, value: &T) {
        self.number += 1;
        let slot = self.slot(self.number);
        // SAFETY: the slot lies inside the mapping, aligned; only this process writes.
        unsafe {
            ptr::write_volatile(&raw mut (*slot).before, 0);
            fence(Ordering::SeqCst);
            ptr::copy_nonoverlapping(value, &raw mut (*slot).value, 1);
            fence(Ordering::SeqCst);
            ptr::write_volatile(&raw mut (*slot).after, self.number);
            ptr::write_volatile(&raw mut (*slot).before, self.number);
        }
    }
}

impl<T: Copy> Drop for Vault<T> {
    #[allow(unsafe_code, reason = "see `open`")]
    fn drop(&mut self) {
        // SAFETY: the mapping that `open` made; nothing refers to it any more.
        let _ = unsafe { munmap(self.base.cast(), self.length) };
    }
}

#[cfg(test)]
mod tests {
    use super::Vault;

    #[test]
    fn what_was_saved_last_is_there_in_the_next_life_and_not_in_another_run() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        let mut vault = Vault::<[f64; 9]>::open(&path, 7).unwrap();
        assert!(vault.load().is_none());
        for i in 0..5 {
            vault.save(&[f64::from(i); 9]);
            assert_eq!(vault.load().unwrap(), [f64::from(i); 9]);
        }
        drop(vault);
        assert_eq!(Vault::<[f64; 9]>::open(&path, 7).unwrap().load().unwrap(), [4.0; 9]);
        assert!(Vault::<[f64; 9]>::open(&path, 8).unwrap().load().is_none());
    }

    #[test]
    fn a_save_cut_short_leaves_the_one_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        let mut vault = Vault::<u64>::open(&path, 7).unwrap();
        (1..=3).for_each(|i| vault.save(&i));
        drop(vault);
        let mut bytes = std::fs::read(&path).unwrap();
        // Number 3 lies in slot 1: owner (16 bytes), slot 0 (24 bytes), then its first number.
        bytes[40..48].fill(0);
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(Vault::<u64>::open(&path, 7).unwrap().load(), Some(2));
    }
}
