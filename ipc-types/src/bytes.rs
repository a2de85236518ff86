//! Texts of bounded length that one process gives and others take.

use crate::{
    port_error::{PortError, refused},
    topic,
};
use iceoryx2::{
    port::{publisher::Publisher, subscriber::Subscriber, update_connections::UpdateConnections},
    prelude::ipc,
};

/// Gives texts of bounded length.
#[derive(Debug)]
pub struct BytesWriter(pub(crate) Publisher<ipc::Service, [u8], ()>);

/// Takes texts of bounded length.
#[derive(Debug)]
pub struct BytesReader(pub(crate) Subscriber<ipc::Service, [u8], ()>);

impl BytesWriter {
    /// Gives one text.
    ///
    /// # Errors
    /// Where it is too long, or the plumbing broken.
    pub fn give(&self, bytes: &[u8]) -> Result<(), PortError> {
        let loan = self.0.loan_slice_uninit(bytes.len()).map_err(refused("a loan", topic::REPORT.name))?;
        loan.write_from_slice(bytes).send().map_err(refused("sending", topic::REPORT.name))?;
        Ok(())
    }

    /// Connects new readers without giving anything new: late joiners get the last text.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn connect(&self) -> Result<(), PortError> {
        self.0.update_connections().map_err(refused("connecting", topic::REPORT.name))
    }
}

impl BytesReader {
    /// The newest text that waits.
    ///
    /// # Errors
    /// Where the plumbing is broken.
    pub fn newest(&self) -> Result<Option<Vec<u8>>, PortError> {
        let mut newest = None;
        while let Some(bytes) = self.0.receive().map_err(refused("taking", topic::REPORT.name))? {
            newest = Some(bytes.to_vec());
        }
        Ok(newest)
    }
}
