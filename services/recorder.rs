//! recorder: takes estimates, writes them in the columns of `truerate apply`; into an MCAP file, the samples too.

use crate::{
    clock::now_ns,
    estimates::EstimateWriter,
    hopeless::Hopeless,
    model_file,
    pulse::Pulse,
    recording::RecordingWriter,
    run_folder::{Run, RunFolder},
    stop::Stop,
    wire,
};
use anyhow::{Context, anyhow};
use gyro_model::Axis;
use ipc_types::{
    Estimate, MARK_DATA, Sample, ServiceId, State,
    port::{Hub, Reader},
    topic,
    wait::Wait,
};
use std::{
    path::{Path, PathBuf},
    time::Duration,
};

const NAP: Duration = Duration::from_millis(20);

/// The process.
///
/// # Errors
/// A file that cannot be written, or broken plumbing.
pub fn run(hub: &Hub, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let settings = &run.settings;
    let wanted = settings.record.as_deref().context("no file to record to")?;
    let mut pulse = Pulse::begin(hub, run.number, ServiceId::Recorder, ["kalman-to-recorder", "recorder", ""])?;
    let begun = folder.mark("recording");
    let lives = std::fs::read(&begun).map_or(0, |marks| marks.len());
    if lives > 0 && settings.lossless() {
        let lost = anyhow!("{}: the recorder died, and what it had is lost: run again", wanted.display());
        return Err(Hopeless::from_error(lost));
    }
    std::fs::write(&begun, vec![b'.'; lives + 1]).with_context(|| begun.display().to_string())?;
    let path = &part(wanted, lives);
    if lives > 0 {
        tracing::warn!("what a recorder that died had is lost; {} goes on from here", path.display());
    }
    let estimates = hub.reader(&topic::ESTIMATE, None, settings.wait.recorder)?;
    // The samples' bell is for those who estimate; they are looked at when an estimate rings.
    let samples = if is_mcap(path) { Some(hub.reader(&topic::SAMPLE, None, Wait::Spin)?) } else { None };
    let mut sampled = 0;
    let mut writer: Option<Writer> = None;
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
                    // A sample is given before its estimate, so what belongs to this one waits already.
                    take_samples(samples.as_ref(), run.number, &mut sampled, writer, &mut pulse)?;
                    writer.estimate(&message).map_err(Hopeless::from_error)?;
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

/// The file of a recorder's next life, where a vehicle goes on without waiting: `run.csv`, `run-2.csv`, ….
fn part(path: &Path, lives: usize) -> PathBuf {
    if lives == 0 {
        return path.to_owned();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
    path.with_file_name(format!("{stem}-{}{extension}", lives + 1))
}

/// The axes of `apply`: those of the model that have a gyro; of a model that is still to be learned, those with a gyro.
fn begin(folder: &RunFolder, path: &Path) -> anyhow::Result<Writer> {
    let facts = folder.source()?;
    let model = model_file::load(&folder.model(), &facts.free_names)?.model;
    let gyros: Vec<Axis> = facts.axes.iter().filter_map(|a| a.parse().ok()).collect();
    let modelled: Vec<Axis> = gyros.iter().copied().filter(|a| model.axes[a.index()].is_some()).collect();
    let axes = if modelled.is_empty() { gyros.clone() } else { modelled };
    let writer = if is_mcap(path) {
        RecordingWriter::create(path, &gyros, &facts.free_names, &axes, facts.start_ns)
            .map(|w| Writer::Mcap(Box::new(w)))
    } else {
        EstimateWriter::create(path, &axes, facts.start_ns).map(|writer| Writer::Csv(Box::new(writer)))
    };
    writer.map_err(Hopeless::from_error)
}

/// Whether this file is to be an MCAP recording.
fn is_mcap(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"))
}

/// Writes every sample that waits and was not written yet.
fn take_samples(
    samples: Option<&Reader<Sample>>,
    run: u64,
    sampled: &mut u64,
    writer: &mut Writer,
    pulse: &mut Pulse,
) -> anyhow::Result<()> {
    let (Some(samples), Writer::Mcap(recording)) = (samples, writer) else { return Ok(()) };
    while let Some(sample) = samples.take()? {
        if sample.run == run && sample.sequence > *sampled && sample.mark == MARK_DATA {
            pulse.health.lost += sample.sequence - *sampled - 1;
            *sampled = sample.sequence;
            recording.sample(&wire::row_of(&sample)).map_err(Hopeless::from_error)?;
        }
    }
    Ok(())
}

/// What is recorded into.
enum Writer {
    Csv(Box<EstimateWriter>),
    Mcap(Box<RecordingWriter>),
}

impl Writer {
    fn estimate(&mut self, message: &Estimate) -> anyhow::Result<()> {
        match self {
            Self::Csv(writer) => writer.row(message.valid_ns, &wire::estimate_of(message)),
            Self::Mcap(writer) => writer.estimate(&wire::estimate_of(message)),
        }
    }

    fn finish(self) -> anyhow::Result<()> {
        match self {
            Self::Csv(writer) => writer.finish(),
            Self::Mcap(writer) => writer.finish(),
        }
    }
}

fn stamp(pulse: &mut Pulse, message: &Estimate, took_ns: u64) {
    pulse.health.stages[0].record(took_ns.saturating_sub(message.kalman_gave_ns));
    pulse.health.stages[1].record(now_ns().saturating_sub(took_ns));
}
