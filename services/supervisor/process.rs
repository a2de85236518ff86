//! One supervised process: started, watched, started again with back-off, stopped.

use crate::clock::now_ns;
use crate::{domain::Lock, run_folder::RunFolder, settings::Settings};
use anyhow::Context;
use ipc_types::ServiceId;
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open, test_kill_process};
use signal_hook::consts::{SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGSYS, SIGTRAP};
use std::{
    os::{
        fd::OwnedFd,
        unix::process::{CommandExt, ExitStatusExt},
    },
    process::{Child, Command, ExitStatus, Stdio},
    time::Duration,
};

/// Exit code of a service that would fail in the same way again: a log that cannot be read, say. It has told why.
pub const HOPELESS: u8 = 65;

/// A process that dies sooner after its start dies early: what ended it is likely to end the next one too, ns.
const EARLY_NS: u64 = 1_000_000_000;
/// Early deaths in a row that are forgiven at once.
const FORGIVEN: u32 = 2;
/// What kills it is no defect of its own: the pause only leaves the machine to others where the killing goes on.
const DELAY_AFTER_KILLS: Duration = Duration::from_millis(100);
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
    started_ns: u64,
    /// In a row, and of one cause.
    early_deaths: u32,
    cause: Cause,
    /// It was silent, and its supervisor has killed it.
    is_condemned: bool,
    /// Readable once it is dead; `None` where the kernel has none to give.
    death: Option<OwnedFd>,
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

/// Who ended a process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Cause {
    /// It failed, crashed or hung: the next one may do so in the same way.
    Itself,
    /// It was killed, or asked to end, from outside; or nobody knows.
    #[default]
    Others,
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
        let adopted = Lock::holder(&folder.lock(service));
        let life = adopted.map_or(Life::None, Life::Adopted);
        let death = adopted.and_then(death_of);
        Self {
            service,
            restarts: 0,
            life,
            started_ns: now_ns(),
            early_deaths: 0,
            cause: Cause::default(),
            is_condemned: false,
            death,
            folder,
        }
    }

    /// Its next life in a domain that was made anew: its past is not forgotten.
    #[must_use]
    pub fn anew(&self) -> Self {
        Self {
            restarts: self.restarts + 1,
            early_deaths: self.early_deaths,
            cause: self.cause,
            ..Self::new(self.service, self.folder.clone())
        }
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

    /// When its present life began, ns.
    #[must_use]
    pub fn started_ns(&self) -> u64 {
        self.started_ns
    }

    /// Deaths in a row, each soon after its start.
    #[must_use]
    pub fn early_deaths(&self) -> u32 {
        self.early_deaths
    }

    /// The same, but none where others killed it.
    #[must_use]
    pub fn early_failures(&self) -> u32 {
        if self.cause == Cause::Itself { self.early_deaths } else { 0 }
    }

    /// What becomes readable when it dies.
    #[must_use]
    pub fn death(&self) -> Option<&OwnedFd> {
        self.death.as_ref()
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
        self.started_ns = now_ns();
        self.is_condemned = false;
        self.death = death_of(child.id());
        self.life = Life::Child(child);
        Ok(())
    }

    /// Looks whether it died, without waiting; plans its next start if so.
    pub fn look(&mut self) -> Fate {
        let death = match &mut self.life {
            Life::Child(child) => match child.try_wait() {
                Ok(Some(status)) if status.code() == Some(i32::from(HOPELESS)) => {
                    self.life = Life::Over;
                    self.death = None;
                    return Fate::Hopeless;
                }
                Ok(Some(status)) => Some((in_words(status), cause_of(status))),
                _ => None,
            },
            Life::Adopted(_) if Lock::holder(&self.folder.lock(self.service)).is_none() => {
                Some(("ended".to_owned(), Cause::default()))
            }
            _ => None,
        };
        let Some((words, cause)) = death else { return Fate::Alive };
        let now = now_ns();
        self.count_death(now, if self.is_condemned { Cause::Itself } else { cause });
        self.death = None;
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

    /// How long it waits for its next start: nothing, but after several early deaths in a row; then little where others killed it,
    /// and twice as long each time where it failed by itself.
    #[must_use]
    pub fn delay(&self) -> Duration {
        match self.early_deaths {
            0..=FORGIVEN => Duration::ZERO,
            _ if self.cause == Cause::Others => DELAY_AFTER_KILLS,
            n => LONGEST_DELAY.min(FIRST_DELAY * (1 << (n - FORGIVEN - 1).min(5))),
        }
    }

    fn count_death(&mut self, now: u64, cause: Cause) {
        let before = if cause == self.cause { self.early_deaths } else { 0 };
        self.early_deaths = if now < self.started_ns + EARLY_NS { before + 1 } else { 0 };
        self.cause = cause;
    }

    /// Asks it to end.
    pub fn ask_to_end(&self) {
        self.signal(Signal::TERM);
    }

    /// Ends it at once, as it does nothing any more: that counts as its own failure.
    pub fn condemn(&mut self) {
        self.is_condemned = true;
        self.kill();
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
            // Dead though nobody has buried it yet: its lock is free.
            Life::Adopted(_) if Lock::holder(&self.folder.lock(self.service)).is_none() => true,
            Life::Adopted(pid) => {
                i32::try_from(*pid).ok().and_then(Pid::from_raw).is_none_or(|p| test_kill_process(p).is_err())
            }
            _ => true,
        }
    }
}

fn death_of(pid: u32) -> Option<OwnedFd> {
    pidfd_open(i32::try_from(pid).ok().and_then(Pid::from_raw)?, PidfdFlags::empty()).ok()
}

fn cause_of(status: ExitStatus) -> Cause {
    match (status.code(), status.signal()) {
        // It ends without an error only where it is asked to.
        (Some(0), _) => Cause::Others,
        (Some(_), _) | (None, Some(SIGABRT | SIGBUS | SIGFPE | SIGILL | SIGSEGV | SIGSYS | SIGTRAP)) => Cause::Itself,
        _ => Cause::Others,
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
    use super::{Cause, Duration, EARLY_NS, ExitStatus, ExitStatusExt, Life, Process, RunFolder, ServiceId, cause_of};
    use ipc_types::domain::Domain;

    fn process() -> Process {
        let domain = Domain::new(std::path::Path::new("/nonexistent"), "x").unwrap();
        Process::new(ServiceId::Kalman, RunFolder::of(&domain))
    }

    #[test]
    fn the_third_early_death_in_a_row_begins_the_back_off_and_a_longer_life_ends_it() {
        let mut process = process();
        assert!(matches!(process.life, Life::None));
        let delays: Vec<Duration> = (0..12)
            .map(|_| {
                process.count_death(process.started_ns + EARLY_NS / 2, Cause::Itself);
                process.delay()
            })
            .collect();
        assert_eq!(delays[..2], [Duration::ZERO; 2]);
        assert!(delays[2] > Duration::ZERO && delays[2] < Duration::from_secs(1));
        assert!(delays.windows(2).all(|d| d[0] <= d[1]));
        assert!(*delays.last().unwrap() <= Duration::from_secs(8));
        process.count_death(process.started_ns + 2 * EARLY_NS, Cause::Itself);
        assert_eq!((process.early_deaths(), process.delay()), (0, Duration::ZERO));
    }

    #[test]
    fn a_process_that_is_killed_again_and_again_but_works_in_between_never_waits() {
        let mut process = process();
        for _ in 0..100 {
            process.count_death(process.started_ns + EARLY_NS, Cause::Others);
            assert_eq!(process.delay(), Duration::ZERO);
        }
    }

    #[test]
    fn one_that_others_kill_at_its_start_hardly_waits_and_its_own_failures_in_a_row_are_counted_anew_after_that() {
        let mut process = process();
        for k in 0..100 {
            process.count_death(process.started_ns, Cause::Others);
            assert!(process.delay() <= Duration::from_millis(100) && process.early_failures() == 0, "{k}");
        }
        process.count_death(process.started_ns, Cause::Itself);
        assert_eq!((process.early_failures(), process.delay()), (1, Duration::ZERO));
    }

    #[test]
    fn errors_and_crashes_are_its_own_and_what_it_is_sent_is_not() {
        let cause = |wait_status| cause_of(ExitStatus::from_raw(wait_status));
        for (own, others) in [(1 << 8, 0), (101 << 8, 9), (6, 15), (11, 1)] {
            assert_eq!((cause(own), cause(others)), (Cause::Itself, Cause::Others), "{own} {others}");
        }
    }

    #[test]
    fn a_domain_made_anew_forgets_no_early_death() {
        let mut process = process();
        process.count_death(process.started_ns, Cause::Itself);
        let anew = process.anew();
        assert_eq!((anew.early_failures(), anew.restarts), (1, 1));
    }
}
