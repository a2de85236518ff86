//! A command to a running pipeline, and its answer.

use anyhow::Context;
use ipc_types::{Command, Reply, command::Kind, port::Hub, topic};
use std::time::Duration;

/// How long one attempt waits for an answer, and how often a command is sent again (it is done once all the same): a
/// process that was just killed is back by then, and a trial has told how it goes.
const PATIENCE: Duration = Duration::from_millis(500);
const ATTEMPTS: u32 = 60;

/// Asks whoever the command is for.
///
/// # Errors
/// Where nobody answers, or the plumbing is broken.
pub fn ask(hub: &Hub, command: Command) -> anyhow::Result<Reply> {
    let kind = Kind::from_u32(command.kind).context("an unknown command")?;
    let caller = hub.caller(topic::answers(kind))?;
    Ok(caller.ask(command, PATIENCE, ATTEMPTS, |reply: &Reply| reply.id == command.id)?)
}
