//! What the machine does beside the measurement.

use clap::ValueEnum;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
};

/// What the machine does beside the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Load {
    /// Nothing of ours
    Quiet,
    /// A loop without pause on every core
    Busy,
}

impl Load {
    /// As on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["quiet", "busy"][self as usize]
    }

    /// Begins it; it ends with the result.
    #[must_use]
    pub fn begin(self) -> Busy {
        let stop = Arc::new(AtomicBool::new(false));
        let cores = match self {
            Self::Quiet => Vec::new(),
            Self::Busy => {
                let ours = sched_getaffinity(None).unwrap_or_default();
                (0..CpuSet::MAX_CPU).filter(|&core| ours.is_set(core)).collect()
            }
        };
        let on = |core: usize| {
            let stop = Arc::clone(&stop);
            thread::spawn(move || {
                let mut here = CpuSet::new();
                here.set(core);
                // Where that is refused, the kernel spreads them.
                let _ = sched_setaffinity(None, &here);
                while !stop.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        };
        let threads = cores.into_iter().map(on).collect();
        Busy { stop, threads }
    }
}

/// The loops, until dropped.
pub struct Busy {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}
