//! One supervised process: started, watched, started again with back-off, stopped.

use crate::{clock::now_ns, domain::Lock, run_folder::RunFolder, settings::Settings};
use anyhow::Context;
use ipc_types::ServiceId;
use rustix::process::{Pid, Signal, kill_process, test_kill_process};
use signal_hook::consts::SIGBUS;
use std::{
    collections::VecDeque,
    os::unix::process::{CommandExt, ExitStatusExt},
    process::{Child, Command, ExitStatus, Stdio},
    time::Duration,
};

/// Exit code of a service that would fail in the same way again: a log that cannot be read, say. It has told why.
pub const HOPELESS: u8 = 65;

/// Deaths within [`WINDOW`] that are forgiven at once.
const FORGIVEN: usize = 2;
const WINDOW: Duration = Duration::from_secs(10);
const FIRST_DELAY: Duration = Duration::from_millis(250);
const LONGEST_DELAY: Duration = Duration::from_secs(8);
/// Bytes from which on a block of memory goes back to the system as soon as it is freed.
const LARGE_BLOCK: &str = "131072";

/// A supervised process.
#[derive(Debug)]
pub struct Process {
    /// Which one.
    pub service: ServiceId,
    /// How often it was started again.
    pub restarts: u32,
    life: Life,
    deaths: VecDeque<u64>,
    folder: RunFolder,
}

#[derive(Debug)]
enum Life {
    /// Not started.
    None,
    /// Ended for good.
    Over,
    /// Ours.
    Child(Child),
    /// Left by a supervisor that died.
    Adopted(u32),
    /// Dead; to be started again then, ns.
    Waiting(u64),
}

/// What became of a process.
#[derive(Debug, PartialEq, Eq)]
pub enum Fate {
    /// It lives, or waits for its next start.
    Alive,
    /// It has just died, in these words.
    Died(String),
    /// It says that another start would be of no use.
    Hopeless,
}

impl Process {
    /// A process that is not started yet; one that lives already in this folder is adopted.
    #[must_use]
    pub fn new(service: ServiceId, folder: RunFolder) -> Self {
        let life = Lock::holder(&folder.lock(service)).map_or(Life::None, Life::Adopted);
        Self { service, restarts: 0, life, deaths: VecDeque::new(), folder }
    }

    /// Whether it was left by another supervisor.
    #[must_use]
    pub fn is_adopted(&self) -> bool {
        matches!(self.life, Life::Adopted(_))
    }

    /// Its process id while it lives.
    #[must_use]
    pub fn pid(&self) -> Option<u32> {
        match &self.life {
            Life::Child(child) => Some(child.id()),
            Life::Adopted(pid) => Some(*pid),
            _ => None,
        }
    }

    /// Deaths within the last ten seconds.
    #[must_use]
    pub fn recent_deaths(&self) -> usize {
        self.deaths.len()
    }

    /// Starts it.
    ///
    /// # Errors
    /// Where the program cannot be executed.
    pub fn start(&mut self, instance: &str, settings: &Settings) -> anyhow::Result<()> {
        let input = self.service == ServiceId::Acquisition && settings.source.comes_once();
        let output = self.service == ServiceId::Sender && settings.uses_standard_output();
        // This very program, even where another one has been installed in its place meanwhile.
        let child = Command::new("/proc/self/exe")
            .arg0("truerate")
            .args(["service", self.service.name(), "--instance", instance])
            // glibc otherwise raises this with each large block that is freed, up to 32 MB, and keeps what is smaller:
            // a process that judges one log after another would grow with every one.
            .env("MALLOC_MMAP_THRESHOLD_", LARGE_BLOCK)
            // The service manager hears the supervisor alone.
            .env_remove("NOTIFY_SOCKET")
            .env_remove("WATCHDOG_USEC")
            .env_remove("WATCHDOG_PID")
            .stdin(if input { Stdio::inherit() } else { Stdio::null() })
            .stdout(if output { Stdio::inherit() } else { Stdio::null() })
            .stderr(Stdio::inherit())
            .process_group(0)
            .spawn()
            .context("/proc/self/exe")?;
        tracing::info!(service = self.service.name(), pid = child.id(), "started");
        self.life = Life::Child(child);
        Ok(())
    }

    /// Looks whether it died, without waiting; plans its next start if so.
    pub fn look(&mut self) -> Fate {
        let death = match &mut self.life {
            Life::Child(child) => match child.try_wait() {
                Ok(Some(status)) if status.code() == Some(i32::from(HOPELESS)) => {
                    self.life = Life::Over;
                    return Fate::Hopeless;
                }
                Ok(Some(status)) => Some(in_words(status)),
                _ => None,
            },
            Life::Adopted(_) if Lock::holder(&self.folder.lock(self.service)).is_none() => Some("ended".to_owned()),
            _ => None,
        };
        let Some(words) = death else { return Fate::Alive };
        let now = now_ns();
        self.deaths.push_back(now);
        self.forget_old_deaths(now);
        self.life = Life::Waiting(now + self.delay().as_nanos() as u64);
        Fate::Died(words)
    }

    /// Whether it has ended for good.
    #[must_use]
    pub fn is_over(&self) -> bool {
        matches!(self.life, Life::Over)
    }

    /// Whether it waits for a start that is due.
    #[must_use]
    pub fn is_due(&self) -> bool {
        match self.life {
            Life::None => true,
            Life::Waiting(when) => now_ns() >= when,
            _ => false,
        }
    }

    /// Nothing up to the second death in ten seconds, then twice as long each time.
    fn delay(&self) -> Duration {
        match self.deaths.len() {
            0..=FORGIVEN => Duration::ZERO,
            n => LONGEST_DELAY.min(FIRST_DELAY * (1 << (n - FORGIVEN - 1).min(5))),
        }
    }

    fn forget_old_deaths(&mut self, now: u64) {
        while self.deaths.front().is_some_and(|&t| t + (WINDOW.as_nanos() as u64) < now) {
            self.deaths.pop_front();
        }
    }

    /// Asks it to end.
    pub fn ask_to_end(&self) {
        self.signal(Signal::TERM);
    }

    /// Ends it at once.
    pub fn kill(&self) {
        self.signal(Signal::KILL);
    }

    fn signal(&self, signal: Signal) {
        if let Some(pid) = self.pid().and_then(|p| i32::try_from(p).ok()).and_then(Pid::from_raw) {
            let _ = kill_process(pid, signal);
        }
    }

    /// Whether it has ended, for good.
    pub fn has_ended(&mut self) -> bool {
        match &mut self.life {
            Life::Child(child) => matches!(child.try_wait(), Ok(Some(_)) | Err(_)),
            Life::Adopted(pid) => {
                i32::try_from(*pid).ok().and_then(Pid::from_raw).is_none_or(|p| test_kill_process(p).is_err())
            }
            _ => true,
        }
    }
}

fn in_words(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with code {code}"),
        (None, Some(SIGBUS)) => "was killed by SIGBUS: memory that it shares is full, or was cut short".to_owned(),
        (None, Some(signal)) => format!("was killed by signal {signal}"),
        _ => "ended".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Duration, Life, Process, RunFolder, ServiceId};
    use ipc_types::domain::Domain;

    #[test]
    fn the_third_death_in_ten_seconds_begins_the_back_off() {
        let domain = Domain::new(std::path::Path::new("/nonexistent"), "x").unwrap();
        let mut process = Process::new(ServiceId::Kalman, RunFolder::of(&domain));
        let delays: Vec<Duration> = (0..12u64)
            .map(|n| {
                process.deaths.push_back(n * 1_000_000);
                process.delay()
            })
            .collect();
        assert_eq!(delays[..2], [Duration::ZERO; 2]);
        assert!(delays[2] > Duration::ZERO && delays[2] < Duration::from_secs(1));
        assert!(delays.windows(2).all(|d| d[0] <= d[1]));
        assert!(*delays.last().unwrap() <= Duration::from_secs(8));
        process.forget_old_deaths(10_000_500_000);
        assert_eq!(process.recent_deaths(), 11);
        assert!(matches!(process.life, Life::None));
    }
}
