//! The ports of the supervisor.

use crate::domain::Claim;
use ipc_types::{
    Health, Status,
    port::{Held, Hub, Reader, Writer},
    topic,
    wait::Wait,
};

/// See the head; dropped before the domain is wiped.
pub(super) struct Ports {
    /// By which what dead processes left is swept.
    pub hub: Hub,
    /// What every service says of itself.
    pub health: Reader<Health>,
    /// What is said of all.
    pub status: Writer<Status>,
    _held: Held,
}

impl Ports {
    /// Creates every topic, and opens its own.
    pub fn open(claim: &Claim) -> anyhow::Result<Self> {
        let hub = Hub::join(claim.domain(), "supervisor")?;
        // Nobody else clears the dead, an earlier supervisor among them.
        let _ = hub.sweep();
        let held = hub.create_all()?;
        Ok(Self {
            health: hub.reader(&topic::HEALTH, None, Wait::Event)?,
            status: hub.writer(&topic::STATUS)?,
            hub,
            _held: held,
        })
    }
}
