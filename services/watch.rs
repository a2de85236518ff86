//! A place from which to look at a running pipeline: status, terminal and dashboard use it. It only reads.

use anyhow::bail;
use ipc_types::{
    Status,
    domain::Domain,
    port::{Hub, Reader},
    topic,
    wait::Wait,
};
use std::{
    thread::sleep,
    time::{Duration, Instant},
};

/// A watcher's ports.
#[derive(Debug)]
pub struct Watch {
    /// For further ports.
    pub hub: Hub,
    status: Reader<Status>,
    instance: String,
}

impl Watch {
    /// Joins a running pipeline.
    ///
    /// # Errors
    /// Where its topics are not there.
    pub fn join(domain: &Domain, name: &'static str) -> anyhow::Result<Self> {
        let hub = Hub::join(domain, name)?;
        let status = hub.reader(&topic::STATUS, None, Wait::Event)?;
        Ok(Self { hub, status, instance: domain.name().to_owned() })
    }

    /// The supervisor's newest word that waits, if any.
    ///
    /// # Errors
    /// Broken plumbing.
    pub fn newest_status(&self) -> anyhow::Result<Option<Status>> {
        Ok(self.status.newest()?)
    }

    /// The supervisor's next word.
    ///
    /// # Errors
    /// Where it is silent.
    pub fn status(&self, patience: Duration) -> anyhow::Result<Status> {
        let start = Instant::now();
        loop {
            if let Some(status) = self.status.newest()? {
                return Ok(status);
            }
            if start.elapsed() > patience {
                bail!(
                    "the supervisor of pipeline '{0}' is silent: start one with `truerate run --instance {0}`; it takes over what still runs",
                    self.instance
                );
            }
            sleep(Duration::from_millis(5));
        }
    }
}
