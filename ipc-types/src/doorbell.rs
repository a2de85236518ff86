//! What wakes the readers of a topic: a word in shared memory that each message adds one to, and that the kernel lets sleep
//! upon (futex). It costs one system call a message, however many wait, where iceoryx2's notifier sends to each one's socket.
//!
//! The word belongs to nobody and is always valid: whoever dies, at any moment, leaves nothing locked and nobody waiting
//! for longer than it meant to. A message whose writer died before it rang is found when the wait ends.

use rustix::{
    mm::{MapFlags, ProtFlags, mmap, munmap},
    thread::futex,
};
use std::{
    fs::{self, OpenOptions},
    io::{self, ErrorKind},
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
    ptr,
    sync::atomic::{AtomicU32, Ordering},
    time::Duration,
};

/// Where shared memory lies.
const MEMORY: &str = "/dev/shm";
/// Bytes that are mapped; the word is at their begin.
const LENGTH: usize = 64;

/// The doorbell of one topic.
#[derive(Debug)]
pub struct Doorbell {
    base: *mut u8,
}

fn path(prefix: &str, topic: &str) -> PathBuf {
    Path::new(MEMORY).join(format!("{prefix}{topic}.doorbell"))
}

impl Doorbell {
    /// Hangs the doorbell of this topic where there is none. It stays for as long as the domain's shared memory: processes that
    /// outlive whoever hung it go on ringing it.
    pub(crate) fn hang(prefix: &str, topic: &str) -> io::Result<()> {
        let path = path(prefix, topic);
        // It has its size before it has its name, so that nobody opens half of it.
        let part = path.with_extension(format!("{}.part", std::process::id()));
        let file = OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&part)?;
        let made = file.set_len(LENGTH as u64).and_then(|()| fs::hard_link(&part, &path));
        fs::remove_file(&part)?;
        match made {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
            made => made,
        }
    }

    /// Opens the doorbell of this topic.
    #[allow(unsafe_code, reason = "shared memory is the point")]
    pub(crate) fn open(prefix: &str, topic: &str) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path(prefix, topic))?;
        if file.metadata()?.len() < LENGTH as u64 {
            return Err(io::Error::from(ErrorKind::UnexpectedEof));
        }
        // SAFETY: a fresh shared mapping of a file that is long enough, reached through one atomic only.
        let base =
            unsafe { mmap(ptr::null_mut(), LENGTH, ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED, &file, 0) }?;
        Ok(Self { base: base.cast() })
    }

    #[allow(unsafe_code, reason = "see `open`")]
    #[allow(clippy::cast_ptr_alignment, reason = "a mapping begins at a page")]
    fn word(&self) -> &AtomicU32 {
        // SAFETY: inside the mapping, aligned; lives as long as `self`.
        unsafe { AtomicU32::from_ptr(self.base.cast()) }
    }

    /// How often it rang. Taken before looking for a message, so that none is slept over that comes in between.
    pub(crate) fn rung(&self) -> u32 {
        self.word().load(Ordering::SeqCst)
    }

    /// Wakes everybody who waits.
    pub(crate) fn ring(&self) {
        self.word().fetch_add(1, Ordering::SeqCst);
        // Nothing of it can fail for a word that is mapped.
        let _ = futex::wake(self.word(), futex::Flags::empty(), i32::MAX as u32);
    }

    /// Sleeps until it has rung more often than `rung` says, or so long; a signal ends it early.
    pub(crate) fn wait(&self, rung: u32, longest: Duration) {
        let longest = longest.try_into().ok();
        // Rung already, woken, too late, a signal: whoever waits looks in any case.
        let _ = futex::wait(self.word(), futex::Flags::empty(), rung, longest.as_ref());
    }
}

impl Drop for Doorbell {
    #[allow(unsafe_code, reason = "see `open`")]
    fn drop(&mut self) {
        // SAFETY: the mapping is ours, and nothing refers into it any more.
        let _ = unsafe { munmap(self.base.cast(), LENGTH) };
    }
}

#[cfg(test)]
mod tests {
    use super::{Doorbell, MEMORY, path};
    use std::{
        env, fs,
        process::{Command, Stdio},
        sync::mpsc,
        thread,
        time::{Duration, Instant},
    };

    const FOR_EVER: Duration = Duration::from_secs(3600);
    /// The environment of a victim: the doorbell's prefix and what the victim does.
    const VICTIM: &str = "TRUERATE_DOORBELL_VICTIM";

    #[test]
    fn who_waits_is_woken_and_a_ring_before_the_wait_is_not_slept_over() {
        let prefix = format!("truerate_test_{}_", std::process::id());
        Doorbell::hang(&prefix, "sample").unwrap();
        let (ours, theirs) = (Doorbell::open(&prefix, "sample").unwrap(), Doorbell::open(&prefix, "sample").unwrap());
        let rung = theirs.rung();
        // Whoever hangs it again finds it.
        Doorbell::hang(&prefix, "sample").unwrap();
        let file = path(&prefix, "sample");
        ours.ring();
        theirs.wait(rung, FOR_EVER);
        let rung = theirs.rung();
        // Whichever comes first, the wait or the ring: it ends.
        let ringer = thread::spawn(move || Doorbell::open(&prefix, "sample").unwrap().ring());
        theirs.wait(rung, FOR_EVER);
        assert_eq!(theirs.rung(), rung.wrapping_add(1));
        ringer.join().unwrap();
        let start = Instant::now();
        theirs.wait(theirs.rung(), Duration::from_millis(20));
        assert!(start.elapsed() >= Duration::from_millis(20));
        fs::remove_file(file).unwrap();
    }

    /// What the processes do that are killed below; nothing in a run of all tests.
    #[test]
    fn victim() {
        let Ok(victim) = env::var(VICTIM) else { return };
        let (prefix, does) = victim.split_once(' ').unwrap();
        let doorbell = || Doorbell::open(prefix, "sample").unwrap();
        match does {
            "rings" => {
                let doorbell = doorbell();
                loop {
                    doorbell.ring();
                }
            }
            "waits" => {
                let doorbell = doorbell();
                loop {
                    doorbell.wait(doorbell.rung(), FOR_EVER);
                }
            }
            _ => loop {
                Doorbell::hang(prefix, "sample").unwrap();
                drop(doorbell());
            },
        }
    }

    #[test]
    fn whoever_is_killed_at_it_the_others_are_woken() {
        let prefix = format!("truerate_test_killed_{}_", std::process::id());
        Doorbell::hang(&prefix, "sample").unwrap();
        let ours = Doorbell::open(&prefix, "sample").unwrap();
        // Two that live, and would sleep for an hour over a ring that they missed.
        let survivors = [(); 2].map(|()| {
            let prefix = prefix.clone();
            let (saw, seen) = mpsc::channel();
            let survivor = thread::spawn(move || {
                let doorbell = Doorbell::open(&prefix, "sample").unwrap();
                loop {
                    let rung = doorbell.rung();
                    if saw.send(rung).is_err() {
                        return;
                    }
                    doorbell.wait(rung, FOR_EVER);
                }
            });
            (survivor, seen)
        });
        for round in 0..40_u64 {
            let mut victims = ["rings", "waits", "waits", "hangs"].map(|does| {
                let mut command = Command::new(env::current_exe().unwrap());
                command.args(["--exact", "doorbell::tests::victim"]).env(VICTIM, format!("{prefix} {does}"));
                command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
            });
            // From before they have opened it to long after.
            thread::sleep(Duration::from_micros(round * 7919 % 10_000));
            for victim in &mut victims {
                victim.kill().unwrap();
            }
            for victim in &mut victims {
                assert_eq!(victim.wait().unwrap().code(), None, "it ended by itself");
            }
            // Nobody else rings now.
            ours.ring();
            let rung = ours.rung();
            for (_, seen) in &survivors {
                while seen.recv_timeout(Duration::from_secs(60)).expect("a survivor slept over a ring") != rung {}
            }
        }
        for (survivor, seen) in survivors {
            drop(seen);
            ours.ring();
            survivor.join().unwrap();
        }
        for file in fs::read_dir(MEMORY).unwrap().flatten() {
            if file.file_name().to_string_lossy().starts_with(&prefix) {
                fs::remove_file(file.path()).unwrap();
            }
        }
    }
}
