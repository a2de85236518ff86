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
    domain: Domain,
    generation: Option<String>,
}

impl Watch {
    /// Joins a running pipeline.
    ///
    /// # Errors
    /// Where its topics are not there.
    pub fn join(domain: &Domain, name: &'static str) -> anyhow::Result<Self> {
        let generation = domain.generation();
        let hub = Hub::join(domain, name)?;
        let status = hub.reader(&topic::STATUS, None, Wait::Event)?;
        Ok(Self { hub, status, domain: domain.clone(), generation })
    }

    /// The same, tried again while the domain is being made anew.
    ///
    /// # Errors
    /// Where its topics are not there in time.
    pub fn join_within(domain: &Domain, name: &'static str, patience: Duration) -> anyhow::Result<Self> {
        let start = Instant::now();
        loop {
            match Self::join(domain, name) {
                Err(_) if start.elapsed() < patience => sleep(Duration::from_millis(20)),
                joined => return joined,
            }
        }
    }

    /// Whether the domain has been made anew since: nothing comes from the one that was joined any more.
    #[must_use]
    pub fn is_outdated(&self) -> bool {
        self.domain.generation() != self.generation
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
                    self.domain.name()
                );
            }
            sleep(Duration::from_millis(5));
        }
    }
}
