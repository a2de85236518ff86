//! recorder: takes estimates, writes them in the columns of `truerate apply`.

use crate::{
    clock::now_ns,
    estimates::EstimateWriter,
    hopeless::Hopeless,
    model_file,
    pulse::Pulse,
    run_folder::{Run, RunFolder},
    stop::Stop,
    wire,
};
use anyhow::{Context, anyhow};
use gyro_model::Axis;
use ipc_types::{Estimate, MARK_DATA, ServiceId, State, port::Hub, topic};
use std::{path::Path, time::Duration};

const NAP: Duration = Duration::from_millis(20);

/// The process.
///
/// # Errors
/// A file that cannot be written, or broken plumbing.
pub fn run(hub: &Hub, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let settings = &run.settings;
    let path = settings.record.as_deref().context("no file to record to")?;
    let mut pulse = Pulse::begin(hub, run.number, ServiceId::Recorder, ["kalman-to-recorder", "recorder", ""])?;
    let begun = folder.mark("recording");
    if begun.exists() {
        let lost = anyhow!("{}: the recorder died, and what it had is lost: run again", path.display());
        return Err(Hopeless::from_error(lost));
    }
    std::fs::write(&begun, []).with_context(|| begun.display().to_string())?;
    let estimates = hub.reader(&topic::ESTIMATE, None, settings.wait.recorder)?;
    let mut writer: Option<EstimateWriter> = None;
    let mut ended = false;
    let mut sequence = 0;
    pulse.become_state(State::Running)?;
    while !stop.asked() {
        while let Some(message) = estimates.take()? {
            let took_ns = now_ns();
            if message.run != run.number || message.sequence <= sequence {
                continue;
            }
            pulse.health.lost += message.sequence - sequence - 1;
            sequence = message.sequence;
            pulse.health.acknowledged = sequence;
            if message.mark == MARK_DATA {
                pulse.health.received += 1;
                if writer.is_none() {
                    writer = Some(begin(folder, path)?);
                }
                if let Some(writer) = &mut writer {
                    writer.row(message.valid_ns, &wire::estimate_of(&message)).map_err(Hopeless::from_error)?;
                }
                pulse.health.sent += 1;
                stamp(&mut pulse, &message, took_ns);
            } else {
                ended = true;
            }
            pulse.beat(128)?;
        }
        if ended && let Some(writer) = writer.take() {
            writer.finish().map_err(Hopeless::from_error)?;
        }
        if ended {
            pulse.become_state(State::Finished)?;
        }
        pulse.beat(1)?;
        estimates.wait(NAP)?;
    }
    // Interrupted: what there is is kept.
    if let Some(writer) = writer.take() {
        writer.finish()?;
    }
    Ok(pulse.beat_now()?)
}

/// The axes of `apply`: those of the model that have a gyro; of a model that is still to be learned, those with a gyro.
fn begin(folder: &RunFolder, path: &Path) -> anyhow::Result<EstimateWriter> {
    let facts = folder.source()?;
    let model = model_file::load(&folder.model(), &facts.free_names)?.model;
    let gyros: Vec<Axis> = facts.axes.iter().filter_map(|a| a.parse().ok()).collect();
    let modelled: Vec<Axis> = gyros.iter().copied().filter(|a| model.axes[a.index()].is_some()).collect();
    let axes = if modelled.is_empty() { gyros } else { modelled };
    EstimateWriter::create(path, &axes, facts.start_ns).map_err(Hopeless::from_error)
}

fn stamp(pulse: &mut Pulse, message: &Estimate, took_ns: u64) {
    pulse.health.stages[0].record(took_ns.saturating_sub(message.kalman_gave_ns));
    pulse.health.stages[1].record(now_ns().saturating_sub(took_ns));
}
