//! The thread that asks: a command waits for its answer here, so that watching and serving go on meanwhile.

use super::server::Errand;
use anyhow::Context;
use ipc_types::{Command, Reply, command::Kind, domain::Domain, port::Hub, topic};
use std::{
    sync::mpsc::{Sender, channel},
    thread,
    time::Duration,
};

/// How long one attempt waits for an answer, and how often a command is sent again (it is done once all the same): a
/// process that was just killed is back by then, and a trial has told how it goes.
const PATIENCE: Duration = Duration::from_millis(500);
const ATTEMPTS: u32 = 60;

/// Starts the thread; it ends when nobody can send it anything any more.
#[must_use]
pub fn start(domain: Domain) -> Sender<Errand> {
    let (sender, errands) = channel::<Errand>();
    thread::spawn(move || {
        let mut hub = None;
        for (command, answer) in errands {
            let reply = ask(&domain, &mut hub, command).map_err(|error| format!("{error:#}"));
            if reply.is_err() {
                hub = None;
            }
            // A page that was closed meanwhile doesn't want its answer.
            let _ = answer.send(reply);
        }
    });
    sender
}

/// Asks once, over a hub that is opened where there is none.
///
/// # Errors
/// Where nobody answers, or the plumbing is broken.
pub fn ask(domain: &Domain, hub: &mut Option<Hub>, command: Command) -> anyhow::Result<Reply> {
    let kind = Kind::from_u32(command.kind).context("an unknown command")?;
    let hub = match hub {
        Some(hub) => hub,
        None => hub.insert(Hub::join(domain, "dashboard-errands")?),
    };
    let caller = hub.caller(topic::answers(kind))?;
    caller
        .ask(command, PATIENCE, ATTEMPTS, |reply: &Reply| reply.id == command.id)
        .context("no answer: the process that should give it may just be starting again; try once more")
}
