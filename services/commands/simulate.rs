//! `truerate simulate`: a log whose truth is known.

use crate::{
    commands::{print, subject::writable},
    log,
    model_file::{self, ModelFile, Provenance},
    progress::Progress,
};
use anyhow::{Result, bail};
use gyro_model::{
    Axis, Record,
    simulate::{Hidden, Motion, Scenario, SensorSpec, Simulator},
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// What `truerate simulate` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate simulate -o clean.csv.gz                             nothing hidden
  truerate simulate --hide delay:d=0.012 -o late.csv.gz         the gyro is 12 ms late
  truerate simulate --hide warm-up --hide cross-axis -o two.csv two effects at their typical sizes
  truerate simulate --motion drive --seconds 300 --rate 200 --seed 7 -o drive.csv.gz

The log holds three gyro axes, the shaft encoder of the tested axis, accelerometer, temperature and
supply. What was hidden stands in LOG.truth.toml, a model file: `truerate compare LOG --model
LOG.truth.toml` holds it against the log. `truerate effects` lists what can be hidden.")]
pub struct Args {
    /// Hide this effect, at its typical size or with these values; may be given several times
    #[arg(long, value_name = "ID[:NAME=VALUE,…]", num_args = 1..)]
    pub hide: Vec<String>,
    /// How the shaft moves: `sine` (one frequency, as in the paper), `multisine` (several), `drive` (a vehicle's turns),
    /// `rate-table` (one rate after another, held)
    #[arg(long, value_name = "sine|multisine|drive|rate-table", default_value = "multisine")]
    pub motion: Motion,
    /// How long, s
    #[arg(long, value_name = "S", default_value = "120", value_parser = positive)]
    pub seconds: f64,
    /// Rows a second
    #[arg(long, value_name = "HZ", default_value = "100", value_parser = positive)]
    pub rate: f64,
    /// Which draw of everything random
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// The axis on the shaft
    #[arg(long, value_name = "x|y|z", default_value = "x")]
    pub axis: Axis,
    /// The log to write: CSV, packed where it ends in .gz, or `-` for standard output
    #[arg(short, long, value_name = "LOG")]
    pub output: PathBuf,
}

/// A finite number above zero.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("a number above zero is wanted".to_owned()),
    }
}

/// More rows than this are refused rather than swapped to disk: at 220 bytes each, 11 GB.
const MOST_ROWS: f64 = 5e7;

/// Writes the log and its truth.
///
/// # Errors
/// An unknown effect or parameter, a size out of bounds, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let rows = (args.seconds * args.rate).round();
    if !(1.0..=MOST_ROWS).contains(&rows) {
        bail!("{} s at {} Hz are {rows:e} rows: choose 1 to {MOST_ROWS:e}", args.seconds, args.rate);
    }
    let hidden = args.hide.iter().map(|text| Hidden::parse(text, args.axis)).collect::<Result<Vec<_>, _>>()?;
    writable(&args.output, &[])?;
    let scenario = Scenario {
        motion: args.motion,
        seconds: args.seconds,
        rate_hz: args.rate,
        seed: args.seed,
        hidden,
        sensor: SensorSpec::on(args.axis),
    };
    let (record, truth) = simulate(&scenario, rows as usize);
    log::write_record(&args.output, &record, 0)?;
    if args.output == Path::new("-") {
        return Ok(ExitCode::SUCCESS);
    }
    let mut beside = args.output.clone().into_os_string();
    beside.push(".truth.toml");
    let beside = PathBuf::from(beside);
    model_file::save(&beside, &truth(&args.output))?;
    let hidden: Vec<&str> = scenario.hidden.iter().map(|h| h.effect.card().id).collect();
    print(&format!(
        "{}: {} rows, {} s at {} Hz, axis {}\nhidden: {}; the truth is in {}\n",
        args.output.display(),
        record.len(),
        args.seconds,
        args.rate,
        args.axis,
        if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(", ") },
        beside.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// The rows, and the true model of whatever the log is called.
fn simulate(scenario: &Scenario, rows: usize) -> (Record, impl Fn(&Path) -> ModelFile) {
    let mut simulator = Simulator::new(scenario);
    let mut record = Record { rows: Vec::with_capacity(rows), ..Record::default() };
    let progress = Progress::of(rows as u64, "simulating");
    for k in 0..rows {
        record.rows.push(simulator.step().row);
        if k % 4096 == 0 {
            progress.at(k as u64);
        }
    }
    let (model, samples) = (simulator.truth(), rows as u64);
    let truth = move |log: &Path| ModelFile {
        model: model.clone(),
        provenance: Some(Provenance {
            log: log.file_name().map(|name| name.to_string_lossy().into_owned()),
            samples: Some(samples),
            ..Provenance::default()
        }),
        own_effects: Vec::new(),
    };
    (record, truth)
}
