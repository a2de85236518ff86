//! One command a file, all alike: `Args` is what clap parses, `run` does it. What several share is in [`subject`] and
//! [`change`].
//!
//! To hook one in: the file and its `pub mod` here, a variant in [`crate::cli::Command`] and its arm in `run` there.
//! A command writes its result with [`print()`], never `println!`, so that `truerate … | head` ends quietly.

use anyhow::Context;
use std::io::{self, Write};

pub mod add;
pub mod apply;
pub mod bench;
pub mod change;
pub mod channels;
pub mod compare;
pub mod completions;
pub mod control;
pub mod demo;
pub mod diagnose;
pub mod effects;
pub mod export;
pub mod fit;
pub mod guide;
pub mod ladder;
pub mod man;
pub mod paper;
pub mod remove;
pub mod run;
pub mod service;
pub mod simulate;
pub mod status;
pub mod subject;
pub mod top;

/// Writes to standard output, whole.
///
/// # Errors
/// What standard output answers; a reader that has left ends the program quietly at the top.
pub fn print(text: &str) -> anyhow::Result<()> {
    let write = || -> io::Result<()> {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes())?;
        if !text.ends_with('\n') {
            out.write_all(b"\n")?;
        }
        out.flush()
    };
    write().context("standard output cannot be written: send it to a place with room")
}
