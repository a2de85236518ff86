//! sender: the process that gives the rate to sockets and to standard output.

use crate::clock::now_ns;
use crate::{
    hopeless::Hopeless,
    pulse::Pulse,
    rate_out::{
        Target, Way,
        datagrams::Datagrams,
        row_of,
        sink::{Form, Sink},
        socket::Socket,
        standard_output::StandardOutput,
        text,
    },
    run_folder::Run,
    stop::Stop,
};
use ipc_types::{Estimate, MARK_DATA, ServiceId, State, port::Hub, topic};
use std::time::{Duration, Instant};

const NAP: Duration = Duration::from_millis(20);
/// So long standard output may take for the last rows.
const PATIENCE: Duration = Duration::from_secs(1);

struct Out {
    sink: Box<dyn Sink>,
    form: Form,
}

impl Out {
    /// `None` where kalman serves the target itself.
    fn open(target: &Target) -> anyhow::Result<Option<Self>> {
        let sink: Box<dyn Sink> = match &target.way {
            Way::Unix(path) => Box::new(Socket::open(path)?),
            Way::Udp(place) => Box::new(Datagrams::open(place)?),
            Way::StandardOutput => Box::new(StandardOutput::default()),
            Way::Shared(_) => return Ok(None),
        };
        Ok(Some(Self { sink, form: if target.as_text { Form::Text } else { Form::Binary } }))
    }
}

/// The process.
///
/// # Errors
/// A target that cannot be opened, or broken plumbing.
pub fn run(hub: &Hub, run: &Run, stop: &Stop) -> anyhow::Result<()> {
    let settings = &run.settings;
    let mut pulse = Pulse::begin(hub, run.number, ServiceId::Sender, ["kalman-to-sender", "sender", "sample-to-sent"])?;
    let opened: anyhow::Result<Vec<_>> = settings.out.iter().map(Out::open).collect();
    let mut outs: Vec<Out> = opened.map_err(Hopeless::from_error)?.into_iter().flatten().collect();
    let estimates = hub.reader(&topic::ESTIMATE, None, settings.wait.sender)?;
    let (mut sequence, mut ended) = (0, false);
    pulse.become_state(State::Running)?;
    let mut line = String::new();
    while !stop.asked() {
        // Of a log that is not to lose a row no more is taken than there is room for.
        while !(settings.lossless() && outs.iter().any(|out| out.sink.is_full()))
            && let Some(message) = estimates.take()?
        {
            let took_ns = now_ns();
            if message.run != run.number || message.sequence <= sequence {
                continue;
            }
            if sequence > 0 {
                pulse.health.lost += message.sequence - sequence - 1;
            }
            sequence = message.sequence;
            pulse.health.rejected += give(&mut outs, &message, &mut line);
            pulse.health.acknowledged = sequence;
            if message.mark == MARK_DATA {
                pulse.health.received += 1;
                pulse.health.sent += 1;
                let now = now_ns();
                pulse.health.stages[0].record(took_ns.saturating_sub(message.kalman_gave_ns));
                pulse.health.stages[1].record(now.saturating_sub(took_ns));
                pulse.health.stages[2].record(now.saturating_sub(message.arrived_ns));
            } else {
                ended = true;
            }
            pulse.beat(128)?;
        }
        let mut all_gone = true;
        for out in &mut outs {
            all_gone &= out.sink.turn(out.form);
        }
        if ended && all_gone {
            pulse.become_state(State::Finished)?;
        }
        pulse.beat(1)?;
        estimates.wait(if all_gone { NAP } else { Duration::from_millis(1) })?;
    }
    let asked = Instant::now();
    while outs.iter_mut().any(|out| !out.sink.turn(out.form)) && asked.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(pulse.beat_now()?)
}

/// Gives one row everywhere; to how many it could not be given.
fn give(outs: &mut [Out], message: &Estimate, line: &mut String) -> u64 {
    let row = row_of(message);
    let bytes = row.to_bytes();
    line.clear();
    let mut left_out = 0;
    for out in outs {
        left_out += match out.form {
            Form::Binary => out.sink.give(&bytes, out.form),
            // A line has no word for the end.
            Form::Text if message.mark != MARK_DATA => 0,
            Form::Text => {
                if line.is_empty() {
                    text::write(&row, line);
                }
                out.sink.give(line.as_bytes(), out.form)
            }
        };
    }
    left_out
}
