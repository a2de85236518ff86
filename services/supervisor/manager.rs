//! What the service manager (systemd) hears of a pipeline: that every process is there, that its supervisor lives, how
//! its source is, that it ends. Where there is no manager nothing is said.

use sd_notify::NotifyState;
use std::time::{Duration, Instant};

/// The manager's ear.
#[derive(Debug)]
pub struct Manager {
    /// Between two beats; `None` where the manager does not wait for any.
    period: Option<Duration>,
    beat: Option<Instant>,
    ready: bool,
    status: String,
}

impl Manager {
    /// The manager that started this process, if one did.
    #[must_use]
    pub fn of_this_process() -> Self {
        // Four beats within the time that it waits for one.
        let period = sd_notify::watchdog_enabled().map(|longest| longest / 4);
        Self { period, beat: None, ready: false, status: String::new() }
    }

    /// The supervisor lives: said once a period, however often it is called.
    pub fn beat(&mut self) {
        if let Some(period) = self.period
            && self.beat.is_none_or(|last| last.elapsed() >= period)
        {
            self.beat = Some(Instant::now());
            say(&[NotifyState::Watchdog]);
        }
    }

    /// Every process of the pipeline has been heard from. True the first time.
    pub fn is_ready(&mut self) -> bool {
        if self.ready {
            return false;
        }
        self.ready = true;
        say(&[NotifyState::Ready]);
        true
    }

    /// One line of what `systemctl status` shows; said where it is another than before.
    pub fn tell(&mut self, status: &str) {
        if self.status != status {
            status.clone_into(&mut self.status);
            say(&[NotifyState::Status(status)]);
        }
    }

    /// The pipeline ends.
    pub fn end(&mut self) {
        self.tell("ending");
        say(&[NotifyState::Stopping]);
    }
}

fn say(words: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(words) {
        tracing::debug!("the service manager does not hear: {error}");
    }
}
