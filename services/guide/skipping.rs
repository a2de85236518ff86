//! Enter, in the terminal, skips what is ordered now.

use super::From;
use std::{
    io::{BufRead, IsTerminal, stdin},
    sync::mpsc::{Receiver, TryRecvError, channel},
    thread,
};

/// The lines that somebody enters.
pub(super) struct Skips(Option<Receiver<()>>);

/// Whether standard input is free, and somebody sits at it.
pub(super) fn are_possible(from: &From) -> bool {
    !from.is_standard_input() && stdin().is_terminal()
}

impl Skips {
    /// Listens, where standard input is a terminal that gives no rows. The thread ends with the process: nothing else reads there.
    pub fn listen(from: &From) -> Self {
        if !are_possible(from) {
            return Self(None);
        }
        let (sender, lines) = channel();
        thread::spawn(move || {
            for _ in stdin().lock().lines().map_while(Result::ok) {
                if sender.send(()).is_err() {
                    return;
                }
            }
        });
        Self(Some(lines))
    }

    /// Whether Enter was pressed since it was last asked.
    pub fn asked(&self) -> bool {
        let Some(lines) = &self.0 else { return false };
        let mut asked = false;
        loop {
            match lines.try_recv() {
                Ok(()) => asked = true,
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return asked,
            }
        }
    }
}
