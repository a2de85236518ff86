//! `truerate simulate`: a log whose truth is known.

use crate::{
    commands::{print, subject::writable},
    progress::Progress,
};
use anyhow::{Context, Result, anyhow};
use gyro_model::{
    Axis,
    simulate::{self, Coloured, Motion, RandomCauses, Reference, Scenario, SensorSpec, SetUp},
};
use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::{
    log,
    model_file::{self, ModelFile, Provenance},
    output,
    simulated_fleet::Plan,
};

/// What `truerate simulate` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate simulate -o clean.csv.gz
      nothing hidden
  truerate simulate --hide delay:d=0.012 -o late.csv.gz
      the gyro is 12 ms late
  truerate simulate --hide warm-up --hide cross-axis -o two.csv
      two effects at their typical sizes
  truerate simulate --hide reversal-steps:size=0.005 -o play.csv
      a step of random size at each reversal; other random causes: random-scale, rate-noise,
      start-stop-steps, lost-motion
  truerate simulate --motion drive --seconds 300 --rate 200 --seed 7 -o drive.csv.gz
  truerate simulate --reference orientation --reference-noise 3e-4:10-70 --rate 286 -o cameras.csv
      noise of cameras between 10 and 70 Hz
  truerate simulate --fleet fleet.toml -o logs
      every log of a fleet into the folder `logs`, and the list logs.csv: docs/fleet.md

The log holds three gyro axes, the shaft encoder of the tested axis, accelerometer, temperature and
supply. The true model, with the hidden effects, is written to LOG.truth.toml: `truerate compare LOG
--model LOG.truth.toml` compares it with the log. `truerate effects` lists what can be hidden.")]
pub struct Args {
    /// Hide this effect, at its typical size or with these values; may be given several times
    #[arg(long, value_name = "ID[:NAME=VALUE,…]", num_args = 1..)]
    pub hide: Vec<String>,
    /// How the shaft moves: `sine` (one frequency, as in the paper), `multisine` (several), `drive` (a vehicle's turns),
    /// `rate-table` (one rate after another, held)
    #[arg(long, value_name = "sine|multisine|drive|rate-table", default_value = "multisine")]
    pub motion: Motion,
    /// Length of the log, s
    #[arg(long, value_name = "S", default_value = "120", value_parser = positive)]
    pub seconds: f64,
    /// Rows a second
    #[arg(long, value_name = "HZ", default_value = "100", value_parser = positive)]
    pub rate: f64,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// What the reference is: the angle of an `encoder`, a `rate`, or the `orientation` of the whole sensor
    #[arg(long, value_name = "encoder|rate|orientation", default_value = "encoder")]
    pub reference: ReferenceName,
    /// Noise of the reference, rad (rad/s of a rate), white or between two frequencies, Hz: 3e-4:10-70
    #[arg(long, value_name = "SIZE[:LOW-HIGH]", value_parser = Coloured::parse)]
    pub reference_noise: Option<Coloured>,
    /// Standard deviation of the reference's time stamps, s
    #[arg(long, value_name = "S", value_parser = positive)]
    pub jitter: Option<f64>,
    /// New values a second of the reference; between them it is interpolated linearly
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub reference_rate: Option<f64>,
    /// Standard deviation of the Gaussian window that smooths the reference, s
    #[arg(long, value_name = "S", value_parser = positive)]
    pub smoothing: Option<f64>,
    /// Add a ripple to the motion, with this frequency at the largest rate; above half the sampling rate it is aliased
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub fold: Option<f64>,
    /// The axis on the shaft
    #[arg(long, value_name = "x|y|z", default_value = "x")]
    pub axis: Axis,
    /// A fleet in place of one log: types, parts and logs with spreads between them, from this file
    #[arg(long, value_name = "FLEET.toml", conflicts_with_all = ["hide", "motion", "seconds", "rate", "seed", "reference",
        "reference_noise", "jitter", "reference_rate", "smoothing", "fold", "axis"])]
    pub fleet: Option<PathBuf>,
    /// The log to write: CSV, packed where it ends in .gz, or `-` for standard output
    #[arg(short, long, value_name = "LOG")]
    pub output: PathBuf,
}

/// What the reference is.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceName {
    /// The angle of a shaft, in counts.
    Encoder,
    /// A rate.
    Rate,
    /// The orientation of the whole sensor.
    Orientation,
}

impl Args {
    /// The rig, and what is around it.
    fn rig(&self) -> (SensorSpec, SetUp) {
        let own = SensorSpec::on(self.axis);
        let reference = match self.reference {
            ReferenceName::Encoder => own.reference,
            ReferenceName::Rate => Reference::Rate,
            ReferenceName::Orientation => Reference::Quaternion,
        };
        let set_up = SetUp {
            noise: self.reference_noise,
            jitter: self.jitter.unwrap_or(0.0),
            reference_rate: self.reference_rate.unwrap_or(0.0),
            smoothing: self.smoothing.unwrap_or(0.0),
            fold: self.fold.unwrap_or(0.0),
            random: RandomCauses::default(),
        };
        (SensorSpec { reference, ..own }, set_up)
    }
}

/// A finite number above zero.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("expected a number above zero".to_owned()),
    }
}

/// Writes the log and its truth.
///
/// # Errors
/// An unknown effect or parameter, a size out of bounds, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(plan) = &args.fleet {
        return run_fleet(plan, &args.output);
    }
    let (sensor, set_up) = args.rig();
    let (hidden, random) = simulate::hidden(&args.hide, args.axis).map_err(|wrong| anyhow!(wrong))?;
    let set_up = SetUp { random, ..set_up };
    let scenario =
        Scenario { motion: args.motion, seconds: args.seconds, rate_hz: args.rate, seed: args.seed, hidden, sensor };
    let rows = scenario.rows().map_err(|wrong| anyhow!(wrong))?;
    writable(&args.output, &[])?;
    let (record, truth) = {
        let progress = Progress::of(rows as u64, "simulating");
        set_up.simulate(&scenario, rows, |k| {
            if k % 4096 == 0 {
                progress.at(k as u64);
            }
        })
    };
    log::write_record(&args.output, &record, 0)?;
    if args.output == Path::new("-") {
        return Ok(ExitCode::SUCCESS);
    }
    let mut beside = args.output.clone().into_os_string();
    beside.push(".truth.toml");
    let beside = PathBuf::from(beside);
    let provenance = Provenance {
        log: args.output.file_name().map(|name| name.to_string_lossy().into_owned()),
        samples: Some(rows as u64),
        ..Provenance::default()
    };
    model_file::save(&beside, &ModelFile { model: truth, provenance: Some(provenance), own_effects: Vec::new() })?;
    let axes: Vec<&str> = record.fitted_axes().into_iter().map(Axis::letter).collect();
    let hidden: Vec<&str> = args.hide.iter().map(|text| text.split(':').next().unwrap_or(text)).collect();
    print(&format!(
        "{}: {} rows, {} s at {} Hz, {}\nhidden: {}; the truth is in {}\n",
        args.output.display(),
        record.len(),
        args.seconds,
        args.rate,
        if axes.len() > 1 { format!("axes {}", axes.join(" ")) } else { format!("axis {}", axes.concat()) },
        if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(", ") },
        beside.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes every log of a fleet, and the list of them.
fn run_fleet(plan: &Path, folder: &Path) -> Result<ExitCode> {
    let logs = Plan::load(plan)?.logs().with_context(|| plan.display().to_string())?;
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be made: give a folder that can be written to", folder.display()))?;
    let progress = Progress::of(logs.len() as u64, "simulating");
    let mut list = String::from("log,type,part,day\n");
    for (k, own) in logs.iter().enumerate() {
        progress.at(k as u64);
        log::write_record(&folder.join(&own.file), &own.simulate()?, own.start_ns())?;
        let _ = writeln!(list, "{},{},{},{}", own.file, own.kind, own.part, own.day);
    }
    output::write(&folder.join("logs.csv"), list.as_bytes())?;
    drop(progress);
    print(&format!("{}: {} logs, listed in logs.csv\n", folder.display(), logs.len()))?;
    Ok(ExitCode::SUCCESS)
}
