//! Sources that come while they are read: standard input, a pipe, a serial line, the network.
//!
//! ```text
//! link (bytes as they come) ─▶ format (rows in them) ─▶ timeline (times that only grow) ─▶ acquisition
//! ```
//!
//! Nothing that a link says ends the stream: what is no good row is counted in a [`Tally`], told once, and left out; a link
//! that is lost is opened again. Only what is a file by nature, a pipe, has an end.

pub mod address;
mod arrival;
mod fast;
mod format;
#[cfg(test)]
mod hostile;
pub mod joined;
pub mod kind;
pub mod link;
mod reading;
mod spikes;
pub mod stream;
pub mod tally;
pub mod timeline;
mod trouble;
pub mod words;

pub use address::Address;
pub use arrival::{Arrival, Origin};
pub use joined::Joined;
pub use stream::Stream;
pub use tally::{Fault, Tally};

use gyro_model::Axis;
use workbench::log::Layout;

/// What a source's rows hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// The axes with a gyro.
    pub gyros: Vec<Axis>,
    /// Those that have a reference of their own besides.
    pub referenced: Vec<Axis>,
    /// Names of the free channels.
    pub free_names: Vec<String>,
}

impl Content {
    /// Of a log's columns.
    #[must_use]
    pub fn of(layout: &Layout) -> Self {
        Self { gyros: layout.gyros(), referenced: layout.referenced(), free_names: layout.free_names.clone() }
    }
}
