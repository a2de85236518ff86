//! The other process: gives every message back until it is told to end.

use super::{
    END, End, Way,
    bytes::Bytes,
    ports::{Bare, Ours},
};
use crate::domain;
use anyhow::Context;
use ipc_types::{Estimate, Sample, port::Hub, topic};
use rustix::process::{Signal, set_parent_process_death_signal};
use std::{
    fs::File,
    io::{self, Write},
    os::fd::AsFd,
};

/// Answers until the other side has had enough, or is gone.
///
/// # Errors
/// Broken plumbing.
pub fn run(way: Way, instance: &str) -> anyhow::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL)).context("the parent's death")?;
    let file = |fd: io::Result<std::os::fd::OwnedFd>| fd.map(File::from).context("a file of the way");
    if matches!(way, Way::Socket | Way::Pipe) {
        let (input, output) = (io::stdin().as_fd().try_clone_to_owned(), io::stdout().as_fd().try_clone_to_owned());
        let (taken, given) = (vec![0; size_of::<Sample>()], vec![0; size_of::<Estimate>()]);
        return answer(&mut Bytes { input: file(input)?, output: file(output)?, taken, given });
    }
    let domain = domain::existing(instance)?;
    let hub = Hub::join(&domain, "echo")?;
    let mut end: Box<dyn End> = match way.wait() {
        Some(wait) => Box::new(Ours::<Estimate, Sample>::open(&hub, &topic::ESTIMATE, &topic::SAMPLE, wait)?),
        None => Box::new(Bare::<Estimate, Sample>::open(&domain, &topic::ESTIMATE, &topic::SAMPLE)?),
    };
    let mut out = io::stdout();
    out.write_all(b"!").and_then(|()| out.flush()).context("whoever measures")?;
    answer(end.as_mut())
}

fn answer(end: &mut dyn End) -> anyhow::Result<()> {
    loop {
        match end.take()? {
            Some(END) => return Ok(()),
            Some(number) => end.give(number)?,
            None => {}
        }
    }
}
