//! A server that sends.

use super::{Got, Link, has_come, of_stream};
use std::{
    io::{self, Read},
    net::{TcpStream, ToSocketAddrs},
    time::Duration,
};

/// One that is right.
pub const EXAMPLE: &str = "tcp:192.168.1.20:5600";
/// A server that does not answer is tried again after that.
const PATIENCE: Duration = Duration::from_secs(3);

/// An open connection.
pub struct Tcp(TcpStream);

impl Tcp {
    /// Connects.
    ///
    /// # Errors
    /// Where nobody answers.
    pub fn open(place: &str) -> io::Result<Self> {
        let mut last = io::Error::new(io::ErrorKind::NotFound, "no such host");
        for address in place.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    stream.set_nonblocking(true)?;
                    return Ok(Self(stream));
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

impl Link for Tcp {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Got> {
        if has_come(&self.0, patience)? { of_stream(self.0.read(buffer)) } else { Ok(Got::Nothing) }
    }
}
