//! What the thread that reads a live source hands to whoever takes its rows.

use super::Content;
use gyro_model::Row;
use ipc_types::health::SourceHealth;
use std::time::Duration;

/// Between two looks at whether to go on waiting.
pub(super) const LOOK: Duration = Duration::from_millis(20);

/// What is known of a source once its first row has come.
#[derive(Clone, Debug)]
pub struct Origin {
    /// What its rows hold.
    pub content: Content,
    /// Its own time of the stream's beginning, ns.
    pub start_ns: i128,
}

/// A row that has come.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// The row.
    pub row: Row,
    /// When it was read, ns.
    pub read_ns: u64,
    /// The source's own time of the stream's beginning, by which the row's time is told, ns.
    pub start_ns: i128,
}

/// What the thread says.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "a box would be an allocation a row")]
pub(super) enum Told {
    Row(Arrival),
    End,
    Failed(anyhow::Error),
}

/// What is seen of the link while no row comes.
#[derive(Debug, Default)]
pub(super) struct Watched {
    pub(super) counts: SourceHealth,
    pub(super) row_ns: u64,
}
