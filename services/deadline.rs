//! The end of long work before it is done: its budget is spent, or somebody pressed Ctrl-C.

use anyhow::{Context, Result, ensure};
use signal_hook::{consts::SIGINT, flag, low_level::unregister};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

/// Says when to stop. The first Ctrl-C asks for that, the second one ends the program.
pub struct Deadline {
    end: Option<Instant>,
    interrupted: Arc<AtomicBool>,
    handlers: Vec<signal_hook::SigId>,
}

/// The exit code of a program that Ctrl-C ended.
const INTERRUPTED: i32 = 130;

impl Deadline {
    /// After so many seconds, where they are given.
    ///
    /// # Errors
    /// A budget that is no time, or a signal handler that the system refuses.
    pub fn after(budget: Option<f64>) -> Result<Self> {
        let time = budget.map(|seconds| {
            let time = Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero());
            time.with_context(|| format!("--budget {seconds}: give a time in seconds, more than 0"))
        });
        let end = time.transpose()?.map(|time| Instant::now().checked_add(time));
        ensure!(end != Some(None), "--budget: longer than any clock here counts");
        let interrupted = Arc::new(AtomicBool::new(false));
        // In this order: the second signal finds the flag set by the first.
        let handlers = vec![
            flag::register_conditional_shutdown(SIGINT, INTERRUPTED, Arc::clone(&interrupted))?,
            flag::register(SIGINT, Arc::clone(&interrupted))?,
        ];
        Ok(Self { end: end.flatten(), interrupted, handlers })
    }

    /// Whether to stop now.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed) || self.end.is_some_and(|end| Instant::now() >= end)
    }
}

impl Drop for Deadline {
    fn drop(&mut self) {
        for handler in self.handlers.drain(..) {
            unregister(handler);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Deadline;

    #[test]
    fn a_budget_ends_and_none_does_not() {
        let [brief, none] = [Some(1e-9), None].map(|budget| Deadline::after(budget).unwrap().is_over());
        assert_eq!((brief, none), (true, false));
    }

    #[test]
    fn a_budget_that_is_no_time_is_refused() {
        for budget in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Deadline::after(Some(budget)).is_err(), "{budget}");
        }
    }
}
