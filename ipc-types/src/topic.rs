//! The topics, each with its quality of service: the only place where these numbers stand.

use crate::{Command, Diagnosis, Estimate, Health, Parameters, Reply, Sample, Status, command, schema};
use std::marker::PhantomData;

/// A stream of messages of one type.
#[derive(Debug)]
pub struct Topic<M: ?Sized> {
    /// Name in the domain.
    pub name: &'static str,
    /// Hash of the message's definition.
    pub schema: u64,
    /// Writers at a time, the dead that are not yet swept included.
    pub writers: usize,
    /// Readers at a time.
    pub readers: usize,
    /// Messages that wait for each reader; the oldest is dropped when one more comes.
    pub buffer: usize,
    /// Messages that a late joiner gets.
    pub history: usize,
    /// Whether a writer wakes the readers.
    pub wakes: bool,
    message: PhantomData<fn() -> M>,
}

impl<M: ?Sized> Topic<M> {
    /// A topic that keeps nothing for late joiners and wakes nobody.
    #[must_use]
    pub const fn new(name: &'static str, schema: u64, buffer: usize) -> Self {
        Self { name, schema, writers: 3, readers: 10, buffer, history: 0, wakes: false, message: PhantomData }
    }
}

/// Samples that may be under way to one reader: half a second at 8 kHz, longer than a busy machine keeps a process waiting.
/// Unpaced sources stay half of this ahead at most.
pub const QUEUE: usize = 4096;

/// acquisition → kalman, compensator.
pub const SAMPLE: Topic<Sample> =
    Topic { wakes: true, readers: 8, ..Topic::new("sample", schema(include_str!("sample.rs")), QUEUE) };

/// kalman → recorder, dashboard, the vehicle, acquisition.
pub const ESTIMATE: Topic<Estimate> =
    Topic { wakes: true, ..Topic::new("estimate", schema(include_str!("estimate.rs")), QUEUE) };

/// compensator → kalman, watchers.
pub const PARAMETERS: Topic<Parameters> =
    Topic { history: 1, ..Topic::new("parameters", schema(include_str!("parameters.rs")), 1) };

/// compensator → watchers.
pub const DIAGNOSIS: Topic<Diagnosis> =
    Topic { history: 1, ..Topic::new("diagnosis", schema(include_str!("diagnosis.rs")), 1) };

/// Every service → supervisor, acquisition, watchers.
pub const HEALTH: Topic<Health> = Topic { writers: 16, ..Topic::new("health", schema(include_str!("health.rs")), 1) };

/// supervisor → watchers.
pub const STATUS: Topic<Status> = Topic { history: 1, ..Topic::new("status", schema(include_str!("status.rs")), 1) };

/// compensator → watchers: the whole diagnosis as JSON, bytes. Its definition is the JSON's, by name.
pub const REPORT: Topic<[u8]> = Topic { history: 1, ..Topic::new("report", schema("truerate.diagnosis/1"), 1) };

/// The longest report, bytes.
pub const REPORT_BYTES: usize = 512 * 1024;

/// A request with its answer.
#[derive(Debug)]
pub struct Service<Q, A> {
    /// Name in the domain.
    pub name: &'static str,
    /// Hash of the messages' definitions.
    pub schema: u64,
    message: PhantomData<fn() -> (Q, A)>,
}

/// watchers → compensator.
pub const CONTROL: Service<Command, Reply> =
    Service { name: "control", schema: schema(include_str!("command.rs")), message: PhantomData };

/// watchers → acquisition.
pub const INJECTION: Service<Command, Reply> =
    Service { name: "injection", schema: schema(include_str!("command.rs")), message: PhantomData };

/// The service that a command is for.
#[must_use]
pub const fn answers(kind: command::Kind) -> &'static Service<Command, Reply> {
    const C: &Service<Command, Reply> = &CONTROL;
    const I: &Service<Command, Reply> = &INJECTION;
    match kind {
        command::Kind::Hide => I,
        _ => C,
    }
}
