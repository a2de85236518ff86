//! Standard output: rows as fast as they are taken from it. It is never waited for: what has no room waits here.

use super::sink::{Form, Sink};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::{
    collections::VecDeque,
    io::{self, ErrorKind},
};

/// Bytes that wait at most.
const ROOM: usize = 1 << 20;
/// A pipe that can be written takes so many bytes at once.
const AT_ONCE: usize = 4096;

/// Standard output.
#[derive(Default)]
pub struct StandardOutput {
    waiting: VecDeque<u8>,
    begun: bool,
    closed: bool,
}

impl StandardOutput {
    fn write(&mut self) {
        let out = io::stdout();
        while !self.closed && !self.waiting.is_empty() {
            let mut fds = [PollFd::new(&out, PollFlags::OUT)];
            match poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 0 })) {
                Ok(n) if n > 0 => {}
                _ => return,
            }
            let (first, _) = self.waiting.as_slices();
            match rustix::io::write(&out, &first[..first.len().min(AT_ONCE)]) {
                Ok(n) => _ = self.waiting.drain(..n),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => return,
                Err(error) => {
                    tracing::warn!("standard output takes no rows any more: {error}");
                    self.closed = true;
                    self.waiting.clear();
                }
            }
        }
    }
}

impl Sink for StandardOutput {
    fn give(&mut self, bytes: &[u8], form: Form) -> u64 {
        if !std::mem::replace(&mut self.begun, true) {
            self.waiting.extend(form.header());
        }
        if self.closed || self.waiting.len() + bytes.len() > ROOM {
            return 1;
        }
        self.waiting.extend(bytes);
        self.write();
        0
    }

    fn turn(&mut self, _form: Form) -> bool {
        self.write();
        self.waiting.is_empty()
    }

    fn is_full(&self) -> bool {
        !self.closed && self.waiting.len() > ROOM / 2
    }
}
