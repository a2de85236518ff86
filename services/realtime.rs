//! What the kernel is asked for so that a rate comes in time: a real-time priority, cores, memory that stays, exact timers.
//! What it refuses is said once; the process works without.

use anyhow::{Context, bail};
use ipc_types::{ServiceId, health::Scheduling};
use rustix::{
    io::Errno,
    mm::{MlockAllFlags, mlockall},
    process::{Resource, getrlimit},
    thread::{
        CapabilitySet, CpuSet, capabilities, current_timer_slack, sched_getaffinity, sched_setaffinity,
        set_current_timer_slack,
    },
};
use serde::{Deserialize, Serialize};
use std::{fs, hint::black_box, num::NonZeroU64};

/// The kernel's highest real-time priority.
pub const HIGHEST: u8 = 99;
/// Bytes of stack that are touched beforehand: more than any turn of a process takes.
const STACK: usize = 256 << 10;
/// The longest timer slack that makes sense, µs.
const LONGEST_SLACK_US: u64 = 1_000_000;

/// What is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Realtime {
    /// SCHED_FIFO priority of acquisition, kalman and sender; 0 for none.
    pub priority: u8,
    /// Memory of the same processes stays where it is, their stacks are there beforehand.
    pub lock_memory: bool,
    /// By how much a timer of the same processes may be late without a real-time priority, µs.
    pub timer_slack_us: u64,
    /// The threads that learn run only where nobody else wants the core (SCHED_IDLE).
    pub idle_learning: bool,
    /// Cores that each process is kept to; where none is named, all.
    pub cores: Cores,
}

/// The cores of each process.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cores {
    /// acquisition.
    pub acquisition: Vec<usize>,
    /// kalman.
    pub kalman: Vec<usize>,
    /// compensator, with the threads that learn.
    pub compensator: Vec<usize>,
    /// recorder.
    pub recorder: Vec<usize>,
    /// dashboard.
    pub dashboard: Vec<usize>,
    /// sender.
    pub sender: Vec<usize>,
}

impl Default for Realtime {
    fn default() -> Self {
        Self { priority: 0, lock_memory: false, timer_slack_us: 50, idle_learning: false, cores: Cores::default() }
    }
}

impl Cores {
    /// Of this process.
    #[must_use]
    pub fn of(&self, service: ServiceId) -> &[usize] {
        match service {
            ServiceId::Acquisition => &self.acquisition,
            ServiceId::Kalman => &self.kalman,
            ServiceId::Compensator => &self.compensator,
            ServiceId::Recorder => &self.recorder,
            ServiceId::Dashboard => &self.dashboard,
            ServiceId::Sender => &self.sender,
        }
    }

    /// Takes `NAME=LIST`, such as `kalman=1` or `compensator=0,2,3`.
    ///
    /// # Errors
    /// No process of that name, no list of cores.
    pub fn set(&mut self, text: &str) -> anyhow::Result<()> {
        let (name, list) =
            text.split_once('=').with_context(|| format!("'{text}': expected NAME=LIST, such as kalman=1"))?;
        let cores: Result<Vec<usize>, _> = list.split(',').map(str::parse).collect();
        let cores = cores.ok().with_context(|| format!("'{list}' is not a list of cores, such as 1 or 0,2"))?;
        *match name {
            "acquisition" => &mut self.acquisition,
            "kalman" => &mut self.kalman,
            "compensator" => &mut self.compensator,
            "recorder" => &mut self.recorder,
            "dashboard" => &mut self.dashboard,
            "sender" => &mut self.sender,
            _ => bail!("unknown process '{name}': use one of {}", ServiceId::ALL.map(ServiceId::name).join(", ")),
        } = cores;
        Ok(())
    }
}

/// Whether a sample passes through this process on its way to the vehicle.
#[must_use]
pub fn is_on_the_way(service: ServiceId) -> bool {
    matches!(service, ServiceId::Acquisition | ServiceId::Kalman | ServiceId::Sender)
}

impl Realtime {
    /// Whether the numbers make sense; `spins` are the processes that look without pause.
    ///
    /// # Errors
    /// Which one does not, and why.
    pub fn check(&self, spins: &[ServiceId]) -> anyhow::Result<()> {
        if self.priority > HIGHEST {
            bail!("realtime.priority = {}: is 1 to {HIGHEST}, or 0 for none", self.priority);
        }
        if self.timer_slack_us > LONGEST_SLACK_US {
            bail!("realtime.timer_slack_us = {}: is {LONGEST_SLACK_US} at most", self.timer_slack_us);
        }
        for service in ServiceId::ALL {
            if let Some(core) = self.cores.of(service).iter().find(|&&core| core >= CpuSet::MAX_CPU) {
                bail!("realtime.cores.{} = {core}: no machine has that core", service.name());
            }
        }
        // Nobody else would ever get that core, the process that it waits for included.
        let alone = |id: &ServiceId| {
            let own = self.cores.of(*id);
            let others = ServiceId::ALL.into_iter().filter(|other| other != id);
            !own.is_empty()
                && others.map(|other| self.cores.of(other)).all(|c| c.is_empty() || c.iter().any(|n| !own.contains(n)))
        };
        if self.priority > 0
            && let Some(id) = spins.iter().find(|id| is_on_the_way(**id) && !alone(id))
        {
            bail!(
                "{0} is to spin at a real-time priority: that takes a whole core from everybody; name it, \
                 realtime.cores.{0} = [1], and keep no other process to it alone",
                id.name()
            );
        }
        Ok(())
    }

    /// Asks the kernel for all of it, for this thread and those that it starts. What is refused is a warning.
    pub fn begin(&self, service: ServiceId) {
        let name = service.name();
        // The cores first: at a real-time priority this thread might keep the one that it is on from all others.
        let cores = self.cores.of(service);
        if let Err(error) = keep_to(cores) {
            tracing::warn!(
                "{name} runs on any core, not on {cores:?} ({error}): which there are says `nproc`, `lscpu`"
            );
        }
        if !is_on_the_way(service) {
            return;
        }
        if self.lock_memory
            && let Err(error) = lock_memory()
        {
            tracing::warn!("{name}'s memory is not locked ({error}): LimitMEMLOCK=infinity, or `ulimit -l unlimited`");
        }
        if self.timer_slack_us != Self::default().timer_slack_us {
            // 0 would mean the default again.
            let slack = NonZeroU64::new(self.timer_slack_us * 1000).unwrap_or(NonZeroU64::MIN);
            if let Err(error) = set_current_timer_slack(Some(slack)) {
                tracing::warn!("{name}'s timers stay as they are ({error})");
            }
        }
        if self.priority > 0
            && let Err(error) = set_policy(Policy::Fifo(self.priority))
        {
            tracing::warn!(
                "{name} has no real-time priority {} ({error}): LimitRTPRIO={0}, `ulimit -r {0}`, or CAP_SYS_NICE",
                self.priority
            );
        }
    }
}

fn keep_to(cores: &[usize]) -> Result<(), Errno> {
    if cores.is_empty() {
        return Ok(());
    }
    let mut set = CpuSet::new();
    for &core in cores.iter().filter(|&&core| core < CpuSet::MAX_CPU) {
        set.set(core);
    }
    sched_setaffinity(None, &set)
}

/// Memory that this process has and will have stays where it is.
fn lock_memory() -> anyhow::Result<()> {
    // Under a limit this might succeed now, and what is asked for later be refused: that would end the process.
    let unlimited = getrlimit(Resource::Memlock).current.is_none()
        || capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    if !unlimited {
        bail!("the limit is {} KB", getrlimit(Resource::Memlock).current.unwrap_or(0) >> 10);
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)?;
    touch_stack();
    Ok(())
}

#[inline(never)]
#[allow(clippy::large_stack_arrays, reason = "the stack is the point")]
fn touch_stack() {
    black_box(&mut [0_u8; STACK]);
}

/// Who comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// Before everybody who is not real-time, at this priority.
    Fifo(u8),
    /// After everybody else.
    Idle,
}

/// Sets how this thread, and those that it starts, share the cores with others.
///
/// # Errors
/// Where the kernel refuses.
#[allow(unsafe_code, reason = "rustix has no safe form of it")]
pub fn set_policy(policy: Policy) -> Result<(), Errno> {
    let (policy, priority) = match policy {
        Policy::Fifo(priority) => (libc::SCHED_FIFO, i32::from(priority)),
        Policy::Idle => (libc::SCHED_IDLE, 0),
    };
    // The kernel's struct is this one number. Its own call: that of musl does nothing but refuse.
    // SAFETY: reads one number that lives until then; 0 is this thread.
    match unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, policy, &raw const priority) } {
        0 => Ok(()),
        _ => Err(Errno::from_io_error(&std::io::Error::last_os_error()).unwrap_or(Errno::PERM)),
    }
}

/// What is in force for this thread, as the kernel says.
#[must_use]
pub fn in_force() -> Scheduling {
    // Of the fields behind the name, which may hold anything but ends at the last bracket, the 38th and 39th.
    let stat = fs::read_to_string("/proc/thread-self/stat").unwrap_or_default();
    let fields = || stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let number = |n: usize| fields().nth(n).and_then(|word| word.parse().ok()).unwrap_or(0);
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let locked = status.lines().find_map(|line| line.strip_prefix("VmLck:")).is_some_and(|kb| kb.trim() != "0 kB");
    let cores = sched_getaffinity(None).unwrap_or_default();
    Scheduling {
        policy: number(38),
        priority: number(37),
        cores: (0..64).filter(|&core| cores.is_set(core)).fold(0, |mask, core| mask | 1 << core),
        timer_slack_ns: current_timer_slack().unwrap_or(0),
        locked: u32::from(locked),
        unused: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::{Cores, Errno, Policy, Realtime, in_force, set_policy};
    use ipc_types::ServiceId;
    use std::thread;

    #[test]
    fn a_thread_has_the_policy_that_was_set_or_the_one_it_had() {
        for (policy, number, priority) in [(Policy::Idle, libc::SCHED_IDLE, 0), (Policy::Fifo(7), libc::SCHED_FIFO, 7)]
        {
            thread::spawn(move || match set_policy(policy) {
                Ok(()) => assert_eq!((in_force().policy, in_force().priority), (number as u32, priority)),
                Err(error) => {
                    assert_eq!((error, in_force().policy), (Errno::PERM, libc::SCHED_OTHER as u32));
                    eprintln!("skipped: {policy:?} is refused here");
                }
            })
            .join()
            .unwrap();
        }
    }

    #[test]
    fn cores_are_taken_as_they_are_written() {
        let mut cores = Cores::default();
        cores.set("compensator=0,2").unwrap();
        assert_eq!(cores.of(ServiceId::Compensator), [0, 2]);
        for text in ["kalman", "kalman=", "kalman=x", "nobody=1", "kalman=-1"] {
            assert!(cores.set(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_process_that_spins_at_a_real_time_priority_wants_a_core_of_its_own() {
        let spins = [ServiceId::Kalman];
        let mut realtime = Realtime { priority: 50, ..Realtime::default() };
        assert!(realtime.check(&[]).is_ok() && realtime.check(&spins).is_err());
        realtime.cores.set("kalman=1").unwrap();
        assert!(realtime.check(&spins).is_ok());
        realtime.cores.set("acquisition=1").unwrap();
        assert!(realtime.check(&spins).is_err(), "acquisition would never run");
        realtime.cores.set("acquisition=0,1").unwrap();
        assert!(realtime.check(&spins).is_ok());
        assert!(Realtime { priority: 100, ..Realtime::default() }.check(&[]).is_err());
    }
}
