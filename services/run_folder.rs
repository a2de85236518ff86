//! The files of a run, in its instance's folder: they outlive a process that dies, and go when the run ends.

use crate::{settings::Settings, stop::Stop};
use anyhow::Context;
use ipc_types::{ServiceId, domain::Domain};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::{fs, os::unix::fs::MetadataExt, path::PathBuf, time::Duration};
use workbench::{
    model_file::{ModelFile, render},
    output::{For, write_for},
};

/// A run: its number and what it was told. The supervisor writes it, the others read it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Stamped on every message of this run.
    pub number: u64,
    /// When the run began, ns of `CLOCK_MONOTONIC`.
    pub began_ns: u64,
    /// The build of the program that runs it, see [`this_program`]: no other one can read the state that it leaves.
    pub program: [u64; 5],
    /// What it was told.
    pub settings: Settings,
}

/// What tells one build of the program from another: where its file lies, how large it is and when it was written.
///
/// # Errors
/// Without `/proc`.
pub fn this_program() -> anyhow::Result<[u64; 5]> {
    let file = fs::metadata("/proc/self/exe").context("/proc/self/exe")?;
    Ok([file.dev(), file.ino(), file.size(), file.mtime() as u64, file.mtime_nsec() as u64])
}

/// What the source said of itself, written before its first sample.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SourceFacts {
    /// A log's name, or what is simulated.
    pub name: String,
    /// A log's hash, hexadecimal.
    pub sha256: Option<String>,
    /// Names of the free channels.
    pub free_names: Vec<String>,
    /// The axes with a gyro: `x`, `y`, `z`.
    pub axes: Vec<String>,
    /// The source's own time of its first row, ns.
    pub start_ns: i128,
    /// Where a simulated vehicle's time is counted from: the clock's ns, and the source's.
    pub anchor: Option<(u64, i64)>,
    /// Effects switched on in a simulated vehicle while it ran: after which row, as it was said.
    pub switched: Vec<(u64, String)>,
}

/// The learner's last word, for the summary.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Learned {
    /// Why there is no solution, where there is none.
    pub without: Option<String>,
    /// Rows that it rests on.
    pub rows: usize,
    /// Axis by axis.
    pub axes: Vec<LearnedAxis>,
}

/// One axis of [`Learned`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearnedAxis {
    /// `x`, `y` or `z`.
    pub axis: String,
    /// The averaging time of the two errors, s.
    pub tau: f64,
    /// Open-loop error with the model that the run began with, rad/s.
    pub before: Option<f64>,
    /// The same with the model at the end, rad/s.
    pub after: Option<f64>,
}

/// The folder of one instance.
#[derive(Clone, Debug)]
pub struct RunFolder(PathBuf);

impl RunFolder {
    /// The folder of this domain.
    #[must_use]
    pub fn of(domain: &Domain) -> Self {
        Self(domain.folder().to_owned())
    }

    /// The instance's name.
    #[must_use]
    pub fn instance(&self) -> &str {
        self.0.file_name().and_then(|name| name.to_str()).unwrap_or_default()
    }

    /// The parameters in use, a model file.
    #[must_use]
    pub fn model(&self) -> PathBuf {
        self.0.join("parameters.toml")
    }

    /// The parameters before the last change, a model file.
    #[must_use]
    pub fn model_before(&self) -> PathBuf {
        self.0.join("parameters-before.toml")
    }

    /// kalman's state.
    #[must_use]
    pub fn kalman(&self) -> PathBuf {
        self.0.join("kalman.state")
    }

    /// What acquisition gave last of a live source.
    #[must_use]
    pub fn acquisition(&self) -> PathBuf {
        self.0.join("acquisition.state")
    }

    /// The truth behind a simulated source, a model file.
    #[must_use]
    pub fn truth(&self) -> PathBuf {
        self.0.join("truth.toml")
    }

    /// Writes the parameters in use.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn set_model(&self, file: &ModelFile) -> anyhow::Result<()> {
        write_for(For::Run, &self.model(), render(file).as_bytes())
    }

    /// Writes the truth behind a simulated source.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn set_truth(&self, file: &ModelFile) -> anyhow::Result<()> {
        write_for(For::Run, &self.truth(), render(file).as_bytes())
    }

    /// A file whose being there says something.
    #[must_use]
    pub fn mark(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The lock that a service holds while it lives.
    #[must_use]
    pub fn lock(&self, service: ServiceId) -> PathBuf {
        self.0.join(format!("{}.lock", service.name()))
    }

    /// Reads the run.
    ///
    /// # Errors
    /// Where there is none.
    pub fn run(&self) -> anyhow::Result<Run> {
        self.read(crate::settings::FILE)
    }

    /// Writes the run.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn set_run(&self, run: &Run) -> anyhow::Result<()> {
        self.write(crate::settings::FILE, run)
    }

    /// Reads what the source said.
    ///
    /// # Errors
    /// Where it has not said anything.
    pub fn source(&self) -> anyhow::Result<SourceFacts> {
        self.read("source.json")
    }

    /// Waits until the source has said what it is; `None` when asked to stop before.
    ///
    /// # Errors
    /// Those of `meanwhile`, which is called again and again.
    pub fn wait_for_source(
        &self,
        stop: &Stop,
        mut meanwhile: impl FnMut() -> anyhow::Result<()>,
    ) -> anyhow::Result<Option<SourceFacts>> {
        while !stop.asked() {
            if let Ok(facts) = self.source() {
                return Ok(Some(facts));
            }
            meanwhile()?;
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(None)
    }

    /// Writes what the source says.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn set_source(&self, facts: &SourceFacts) -> anyhow::Result<()> {
        self.write("source.json", facts)
    }

    /// Reads the learner's last word.
    ///
    /// # Errors
    /// Where it has not spoken.
    pub fn learned(&self) -> anyhow::Result<Learned> {
        self.read("learned.json")
    }

    /// Writes the learner's last word.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn set_learned(&self, learned: &Learned) -> anyhow::Result<()> {
        self.write("learned.json", learned)
    }

    fn read<T: DeserializeOwned>(&self, name: &str) -> anyhow::Result<T> {
        let path = self.0.join(name);
        let text = fs::read(&path).with_context(|| path.display().to_string())?;
        serde_json::from_slice(&text).with_context(|| path.display().to_string())
    }

    fn write<T: Serialize>(&self, name: &str, value: &T) -> anyhow::Result<()> {
        write_for(For::Run, &self.0.join(name), &serde_json::to_vec_pretty(value)?)
    }
}
