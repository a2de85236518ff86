//! A socket, or two pipes: the same bytes, through two files.

use super::End;
use anyhow::Context;
use std::{
    fs::File,
    io::{ErrorKind, Read, Write},
};

/// One end.
pub struct Bytes {
    /// Messages from the other process, and to it.
    pub input: File,
    pub output: File,
    /// As long as the messages are.
    pub taken: Vec<u8>,
    pub given: Vec<u8>,
}

impl End for Bytes {
    fn give(&mut self, number: u64) -> anyhow::Result<()> {
        self.given[..8].copy_from_slice(&number.to_ne_bytes());
        self.output.write_all(&self.given).context("the other process")
    }

    fn take(&mut self) -> anyhow::Result<Option<u64>> {
        match self.input.read_exact(&mut self.taken) {
            // A signal came between; whoever waits looks whether it is to stop.
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(None),
            done => done.context("the other process has gone")?,
        }
        let number = self.taken.first_chunk().map(|bytes| u64::from_ne_bytes(*bytes));
        Ok(number)
    }
}
