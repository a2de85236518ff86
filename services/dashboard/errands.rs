//! The thread that asks: a command waits for its answer here, so that watching and serving go on meanwhile.

use super::server::Errand;
use crate::ask;
use anyhow::Context;
use ipc_types::{Command, Reply, domain::Domain, port::Hub};
use std::{
    sync::mpsc::{Sender, channel},
    thread,
};

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
    let hub = match hub {
        Some(hub) => hub,
        None => hub.insert(Hub::join(domain, "dashboard-errands")?),
    };
    ask::ask(hub, command)
        .context("no answer: the process that should give it may just be starting again; try once more")
}
