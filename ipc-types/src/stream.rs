//! Messages that one process gives and others take.

use crate::{
    doorbell::Doorbell,
    port_error::{PortError, refused},
    wait::Wait,
};
use iceoryx2::{
    port::{publisher::Publisher, subscriber::Subscriber, update_connections::UpdateConnections},
    prelude::{ZeroCopySend, ipc},
};
use std::{
    fmt::Debug,
    time::{Duration, Instant},
};

/// Gives messages.
#[derive(Debug)]
pub struct Writer<M: Debug + Copy + ZeroCopySend + 'static> {
    pub(crate) publisher: Publisher<ipc::Service, M, ()>,
    pub(crate) doorbell: Option<Doorbell>,
    pub(crate) topic: &'static str,
}

/// Takes messages.
#[derive(Debug)]
pub struct Reader<M: Debug + Copy + ZeroCopySend + 'static> {
    pub(crate) subscriber: Subscriber<ipc::Service, M, ()>,
    pub(crate) doorbell: Option<Doorbell>,
    pub(crate) wait: Wait,
    pub(crate) topic: &'static str,
}

impl<M: Debug + Copy + ZeroCopySend + 'static> Writer<M> {
    /// Gives one message; says how many readers got it. One allocation, inside iceoryx2's loan.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn give(&self, message: M) -> Result<usize, PortError> {
        let loan = self.publisher.loan_uninit().map_err(refused("a loan", self.topic))?;
        let readers = loan.write_payload(message).send().map_err(refused("sending", self.topic))?;
        if let Some(doorbell) = &self.doorbell {
            doorbell.ring();
        }
        Ok(readers)
    }

    /// Connects new readers without giving anything new: late joiners get the last message.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn connect(&self) -> Result<(), PortError> {
        self.publisher.update_connections().map_err(refused("connecting", self.topic))
    }
}

impl<M: Debug + Copy + ZeroCopySend + 'static> Reader<M> {
    /// The next message, if one waits.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn take(&self) -> Result<Option<M>, PortError> {
        Ok(self.subscriber.receive().map_err(refused("taking", self.topic))?.map(|sample| *sample))
    }

    /// The newest message that waits, the others being dropped.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn newest(&self) -> Result<Option<M>, PortError> {
        let mut newest = None;
        while let Some(message) = self.take()? {
            newest = Some(message);
        }
        Ok(newest)
    }

    /// Returns when a message waits, or after `longest`; may return early. A topic that wakes nobody is waited for by
    /// looking every millisecond.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn wait(&self, longest: Duration) -> Result<(), PortError> {
        let spin_for = match self.wait {
            Wait::Event => Duration::ZERO,
            Wait::Spin => longest,
            Wait::Hybrid(spin) => spin.min(longest),
        };
        if !spin_for.is_zero() {
            let start = Instant::now();
            loop {
                for _ in 0..32 {
                    if self.subscriber.has_samples().map_err(refused("looking", self.topic))? {
                        return Ok(());
                    }
                    std::hint::spin_loop();
                }
                if start.elapsed() >= spin_for {
                    break;
                }
            }
        }
        if spin_for < longest {
            match &self.doorbell {
                Some(doorbell) => {
                    let rung = doorbell.rung();
                    if !self.subscriber.has_samples().map_err(refused("looking", self.topic))? {
                        doorbell.wait(rung, longest.saturating_sub(spin_for));
                    }
                }
                None => std::thread::sleep(longest.saturating_sub(spin_for).min(Duration::from_millis(1))),
            }
        }
        Ok(())
    }
}
