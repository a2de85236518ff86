//! Packets that others send to a port of ours.

use super::{Got, Link, has_come};
use std::{io, net::UdpSocket, time::Duration};

/// One that is right.
pub const EXAMPLE: &str = "udp:0.0.0.0:5600";

/// An open port.
pub struct Udp(UdpSocket);

impl Udp {
    /// Opens the port.
    ///
    /// # Errors
    /// Where it is taken, or the address is not ours.
    pub fn open(place: &str) -> io::Result<Self> {
        let socket = UdpSocket::bind(place)?;
        socket.set_nonblocking(true)?;
        Ok(Self(socket))
    }
}

impl Link for Udp {
    fn gives_packets(&self) -> bool {
        true
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Got> {
        if !has_come(&self.0, patience)? {
            return Ok(Got::Nothing);
        }
        match self.0.recv(buffer) {
            Ok(n) => Ok(Got::Bytes(n)),
            Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => Ok(Got::Nothing),
            Err(e) => Err(e),
        }
    }
}
