//! supervisor → `truerate status`, terminal, dashboard: what runs, over all lives of each process.

use crate::{
    Text,
    health::{Scheduling, SourceHealth},
};
use iceoryx2::prelude::ZeroCopySend;

/// Services that are listed.
pub const SERVICES: usize = 8;
/// Stages that are listed.
pub const STAGES: usize = 16;

/// One service.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.ServiceStatus.v1")]
pub struct ServiceStatus {
    /// Its name; empty beyond the last.
    pub name: Text<30>,
    /// `starting`, `running`, `restarting`, `failed`, `stopped`.
    pub state: Text<22>,
    /// Process id of its present life.
    pub pid: u32,
    /// How often it was started again.
    pub restarts: u32,
    /// Messages taken.
    pub received: u64,
    /// Messages given.
    pub sent: u64,
    /// Messages missed, by their numbers.
    pub lost: u64,
    /// Values refused.
    pub rejected: u64,
    /// Epoch of its parameters.
    pub epoch: u64,
    /// How it shares the machine.
    pub scheduling: Scheduling,
    /// How it waits for its next message: `event`, `spin`, `hybrid(µs)`; empty where it waits for none.
    pub wait: Text<30>,
}

/// One stage.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.StageStatus.v1")]
pub struct StageStatus {
    /// Its name; empty beyond the last.
    pub stage: Text<46>,
    /// Messages.
    pub count: u64,
    /// Median, ns.
    pub p50_ns: u64,
    /// 99 % are below, ns.
    pub p99_ns: u64,
    /// 99.9 % are below, ns.
    pub p999_ns: u64,
    /// The slowest, ns.
    pub max_ns: u64,
}

/// The whole pipeline, about 5 Hz; late joiners get the last one.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Status.v1")]
pub struct Status {
    /// The run.
    pub run: u64,
    /// Process id of the supervisor.
    pub pid: u32,
    /// 1 where the source has ended and everything is done.
    pub finished: u32,
    /// When this was given.
    pub beat_ns: u64,
    /// The live source.
    pub source: SourceHealth,
    /// What the compensator's learning is at: one word, a colon, a figure.
    pub learning: Text<126>,
    /// The services.
    pub services: [ServiceStatus; SERVICES],
    /// The stages.
    pub stages: [StageStatus; STAGES],
}

impl Status {
    /// The services that are listed.
    pub fn listed_services(&self) -> impl Iterator<Item = &ServiceStatus> {
        self.services.iter().filter(|service| !service.name.as_str().is_empty())
    }

    /// The stages that are listed.
    pub fn listed_stages(&self) -> impl Iterator<Item = &StageStatus> {
        self.stages.iter().filter(|stage| !stage.stage.as_str().is_empty())
    }
}

const _: () = assert!(size_of::<Status>() == 152 + size_of::<SourceHealth>() + 168 * SERVICES + 88 * STAGES);
