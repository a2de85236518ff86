//! every service → supervisor, acquisition (credit), watchers: who I am, how far I am, what I lost.

use crate::Histogram;
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
}

impl ServiceId {
    /// All of them, in the order of the flow.
    pub const ALL: [Self; 5] = [Self::Acquisition, Self::Kalman, Self::Compensator, Self::Recorder, Self::Dashboard];

    /// As on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        ["acquisition", "kalman", "compensator", "recorder", "dashboard"][self as usize]
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
            stages: [Histogram::default(); STAGES],
        }
    }
}

const _: () = assert!(size_of::<Health>() == 3640);
