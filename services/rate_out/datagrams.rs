//! UDP: a packet a row, to one address.

use super::sink::{Form, Sink};
use anyhow::Context;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};

/// An open socket.
pub struct Datagrams(UdpSocket);

impl Datagrams {
    /// Opens a socket for this address.
    ///
    /// # Errors
    /// Where there is no such host, or no way to it.
    pub fn open(place: &str) -> anyhow::Result<Self> {
        let what = || format!("udp:{place}");
        let address = place.to_socket_addrs().with_context(what)?.next().with_context(what)?;
        let ours: SocketAddr = if address.is_ipv4() { ([0; 4], 0).into() } else { ([0; 16], 0).into() };
        let socket = UdpSocket::bind(ours).with_context(what)?;
        socket.set_nonblocking(true).with_context(what)?;
        socket.connect(address).with_context(what)?;
        Ok(Self(socket))
    }
}

impl Sink for Datagrams {
    fn give(&mut self, bytes: &[u8], _form: Form) -> u64 {
        // That nobody listens is told by the packet after the one that was lost: it is no error of this one.
        let sent = self.0.send(bytes).or_else(|_| self.0.send(bytes));
        u64::from(sent.is_err())
    }

    fn turn(&mut self, _form: Form) -> bool {
        true
    }
}
