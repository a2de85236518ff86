//! recorder: takes estimates, writes them in the columns of `truerate apply`; into an MCAP file, the samples too.

use crate::clock::now_ns;
use crate::{
    hopeless::Hopeless,
    pulse::Pulse,
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
use workbench::estimates::EstimateWriter;
use workbench::{model_file, recording::RecordingWriter};

const NAP: Duration = Duration::from_millis(20);

/// The process.
///
/// # Errors
/// A file that cannot be written, or broken plumbing.
pub fn run(hub: &Hub, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let settings = &run.settings;
    let wanted = settings.record.as_deref().context("no file to record to")?;
    let pulse = Pulse::begin(hub, run.number, ServiceId::Recorder, ["kalman-to-recorder", "recorder", ""])?;
    let begun = folder.mark("recording");
    let lives = std::fs::read(&begun).map_or(0, |marks| marks.len());
    if lives > 0 && settings.lossless() {
        let lost = anyhow!("{}: the recorder died, and what it had is lost: run again", wanted.display());
        return Err(Hopeless::from_error(lost));
    }
    std::fs::write(&begun, vec![b'.'; lives + 1]).with_context(|| begun.display().to_string())?;
    let path = part(wanted, lives);
    if lives > 0 {
        tracing::warn!("what a recorder that died had is lost; {} goes on from here", path.display());
    }
    let estimates = hub.reader(&topic::ESTIMATE, None, settings.wait.recorder)?;
    // The samples' bell is for those who estimate; they are looked at when an estimate rings.
    let samples = if is_mcap(&path) { Some(hub.reader(&topic::SAMPLE, None, Wait::Spin)?) } else { None };
    let mut recorder =
        Recorder { run: run.number, folder, path, pulse, samples, sampled: 0, writer: None, sequence: 0, ended: false };
    recorder.pulse.become_state(State::Running)?;
    while !stop.asked() {
        while let Some(message) = estimates.take()? {
            recorder.take(&message)?;
        }
        if recorder.ended {
            recorder.finish().map_err(Hopeless::from_error)?;
            recorder.pulse.become_state(State::Finished)?;
        }
        recorder.pulse.beat(1)?;
        estimates.wait(NAP)?;
    }
    // Interrupted: what there is is kept.
    recorder.finish()?;
    Ok(recorder.pulse.beat_now()?)
}

/// A recording under way.
struct Recorder<'a> {
    run: u64,
    folder: &'a RunFolder,
    path: PathBuf,
    pulse: Pulse,
    /// Where they are recorded too, and the number of the last one.
    samples: Option<Reader<Sample>>,
    sampled: u64,
    /// From the first estimate on.
    writer: Option<Writer>,
    /// Number of the last estimate.
    sequence: u64,
    ended: bool,
}

impl Recorder<'_> {
    fn take(&mut self, message: &Estimate) -> anyhow::Result<()> {
        let took_ns = now_ns();
        if message.run != self.run || message.sequence <= self.sequence {
            return Ok(());
        }
        self.pulse.health.lost += message.sequence - self.sequence - 1;
        self.sequence = message.sequence;
        self.pulse.health.acknowledged = self.sequence;
        if message.mark == MARK_DATA {
            self.pulse.health.received += 1;
            let mut writer = self.writer.take().map_or_else(|| begin(self.folder, &self.path), Ok)?;
            // A sample is given before its estimate, so what belongs to this one waits already.
            self.take_samples(&mut writer)?;
            writer.estimate(message).map_err(Hopeless::from_error)?;
            self.writer = Some(writer);
            self.pulse.health.sent += 1;
            self.pulse.health.stages[0].record(took_ns.saturating_sub(message.kalman_gave_ns));
            self.pulse.health.stages[1].record(now_ns().saturating_sub(took_ns));
        } else {
            self.ended = true;
        }
        Ok(self.pulse.beat(128)?)
    }

    /// Writes every sample that waits and was not written yet.
    fn take_samples(&mut self, writer: &mut Writer) -> anyhow::Result<()> {
        let (Some(samples), Writer::Mcap(recording)) = (&self.samples, writer) else { return Ok(()) };
        while let Some(sample) = samples.take()? {
            if sample.run == self.run && sample.sequence > self.sampled && sample.mark == MARK_DATA {
                self.pulse.health.lost += sample.sequence - self.sampled - 1;
                self.sampled = sample.sequence;
                recording.sample(&wire::row_of(&sample)).map_err(Hopeless::from_error)?;
            }
        }
        Ok(())
    }

    /// Puts the recording in its place.
    fn finish(&mut self) -> anyhow::Result<()> {
        self.writer.take().map_or(Ok(()), Writer::finish)
    }
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
