//! Ways by which bytes come: one a file, all alike.

pub mod can;
pub mod iio;
pub mod pipe;
pub mod scan;
pub mod serial;
pub mod tcp;
pub mod udp;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::{io, os::fd::AsFd, time::Duration};

/// What a read brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Got {
    /// So many bytes.
    Bytes(usize),
    /// None yet.
    Nothing,
    /// It is over: the writer has gone.
    End,
}

/// An open way.
pub trait Link: Send {
    /// Whether each read is a packet of its own: what is cut at its end does not go on in the next.
    fn gives_packets(&self) -> bool {
        false
    }

    /// Reads what has come; waits for it about so long at most (a pipe: until it comes).
    ///
    /// # Errors
    /// Where the link is lost.
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Got>;
}

/// Whether there is something to read, the end or an error included, within `patience`.
fn has_come(fd: &impl AsFd, patience: Duration) -> io::Result<bool> {
    let wait = Timespec { tv_sec: patience.as_secs().cast_signed(), tv_nsec: patience.subsec_nanos().into() };
    let mut fds = [PollFd::new(fd, PollFlags::IN)];
    match poll(&mut fds, Some(&wait)) {
        Ok(n) => Ok(n > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// A read of a stream: no byte is the end.
fn of_stream(read: io::Result<usize>) -> io::Result<Got> {
    match read {
        Ok(0) => Ok(Got::End),
        Ok(n) => Ok(Got::Bytes(n)),
        Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => Ok(Got::Nothing),
        Err(e) => Err(e),
    }
}
