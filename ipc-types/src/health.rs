//! every service → supervisor, acquisition (credit), watchers: who I am, how far I am, what I lost.

use crate::{Histogram, Text};
use iceoryx2::prelude::ZeroCopySend;

/// The services of a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum ServiceId {
    /// Reads the source.
    Acquisition = 0,
    /// Compensates and filters.
    Kalman = 1,
    /// Learns.
    Compensator = 2,
    /// Writes the estimates to a file.
    Recorder = 3,
    /// Shows them in a browser.
    Dashboard = 4,
    /// Gives the rate to others.
    Sender = 5,
}

impl ServiceId {
    /// All of them, in the order of the flow.
    pub const ALL: [Self; 6] =
        [Self::Acquisition, Self::Kalman, Self::Compensator, Self::Recorder, Self::Dashboard, Self::Sender];

    /// As on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        ["acquisition", "kalman", "compensator", "recorder", "dashboard", "sender"][self as usize]
    }

    /// The service of this number.
    #[must_use]
    pub fn from_u32(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

/// What a service is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum State {
    /// Opening its ports.
    Starting = 0,
    /// At work.
    Running = 1,
    /// Its stream has ended and it has done all that was to do.
    Finished = 2,
    /// It cannot go on and nothing will change that.
    Failed = 3,
}

/// Latency histograms that one service can keep.
pub const STAGES: usize = 3;

/// How a live source is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Link {
    /// The source is a log or a simulated vehicle.
    None = 0,
    /// It has not been there yet.
    Waiting = 1,
    /// Rows come.
    Connected = 2,
    /// It is open, and no row has come for a while.
    Silent = 3,
    /// It was there and is gone; it is looked for.
    Lost = 4,
    /// It has ended.
    Ended = 5,
}

impl Link {
    /// As it is shown.
    #[must_use]
    pub fn name(number: u32) -> &'static str {
        ["none", "waiting", "connected", "silent", "lost", "ended"].get(number as usize).copied().unwrap_or("unknown")
    }
}

/// What a live source gave, and what of it was no good (acquisition only).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.SourceHealth.v3")]
pub struct SourceHealth {
    /// [`Link`].
    pub link: u32,
    /// How often the link was opened again.
    pub reconnects: u32,
    /// Rows given.
    pub rows: u64,
    /// Rows with text where a number should be, or a checksum that does not fit.
    pub garbled: u64,
    /// Rows of another length.
    pub cut: u64,
    /// Lines between the rows: boot messages, a header again.
    pub remarks: u64,
    /// Values that nothing physical has, taken as no value.
    pub values: u64,
    /// Readings far from those beside them, which stand for none.
    pub left_out: u64,
    /// Rows without a time, or whose time repeats, goes back, or jumps ahead.
    pub times: u64,
    /// Rows that are missing by the source's own count.
    pub missed: u64,
    /// How often its clock began again or jumped.
    pub segments: u64,
    /// What keeps it from being of use, and what to do: first of all that is shown. Empty where there is nothing.
    pub trouble: Text<TROUBLE>,
}

/// Bytes of a source's trouble, in words.
pub const TROUBLE: usize = 598;

impl SourceHealth {
    /// Rows left out, or of which a value was.
    #[must_use]
    pub fn faulty(&self) -> u64 {
        self.garbled + self.cut + self.values + self.left_out + self.times
    }
}

/// How a process shares the machine with others, as the kernel says.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Scheduling.v1")]
pub struct Scheduling {
    /// The kernel's number: 0 for everybody's, 1 for first come first served at a real-time priority.
    pub policy: u32,
    /// Real-time priority; 0 for none.
    pub priority: u32,
    /// Cores that it may use, of the first 64, the first in the lowest bit.
    pub cores: u64,
    /// By how much its timers may be late, ns.
    pub timer_slack_ns: u64,
    /// 1 where its memory is locked.
    pub locked: u32,
    /// 0.
    pub unused: u32,
}

/// The heart-beat of one service, about 10 Hz; more often while it must acknowledge an unpaced stream.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Health.v1")]
pub struct Health {
    /// The run that this belongs to.
    pub run: u64,
    /// [`ServiceId`].
    pub service: u32,
    /// Process id.
    pub pid: u32,
    /// [`State`].
    pub state: u32,
    /// 1 where the source can start from a row again.
    pub resumable: u32,
    /// When this process began.
    pub born_ns: u64,
    /// When this was given.
    pub beat_ns: u64,
    /// Messages taken since `born_ns` (acquisition: rows read).
    pub received: u64,
    /// Messages given since `born_ns`.
    pub sent: u64,
    /// Messages missed, by their numbers, since `born_ns`.
    pub lost: u64,
    /// Values refused since `born_ns`.
    pub rejected: u64,
    /// Everything up to this number is done.
    pub acknowledged: u64,
    /// Epoch of the parameters in use.
    pub epoch: u64,
    /// Its live source (acquisition).
    pub source: SourceHealth,
    /// How its main thread shares the machine.
    pub scheduling: Scheduling,
    /// What learning is at (compensator): one word, a colon, a figure.
    pub learning: Text<126>,
    /// Latencies.
    pub stages: [Histogram; STAGES],
}

impl Health {
    /// Which service this is.
    #[must_use]
    pub fn id(&self) -> Option<ServiceId> {
        ServiceId::from_u32(self.service)
    }
}

impl Default for Health {
    fn default() -> Self {
        Self {
            run: 0,
            service: u32::MAX,
            pid: 0,
            state: State::Starting as u32,
            resumable: 0,
            born_ns: 0,
            beat_ns: 0,
            received: 0,
            sent: 0,
            lost: 0,
            rejected: 0,
            acknowledged: 0,
            epoch: 0,
            source: SourceHealth::default(),
            scheduling: Scheduling::default(),
            learning: Text::EMPTY,
            stages: [Histogram::default(); STAGES],
        }
    }
}

const _: () = assert!(size_of::<Health>() == 12312 + size_of::<SourceHealth>() + size_of::<Scheduling>());
