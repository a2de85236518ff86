//! `truerate run`: the processes, supervised, on a live source or a log.

use super::print;
use crate::{
    arguments::NameArgs,
    domain::Claim,
    settings::{Settings, Source},
    stop::Stop,
    supervisor,
};
use anyhow::{Context, bail};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::prior::Prior;

/// What `truerate run` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate run
      a simulated vehicle, live, with the dashboard
  truerate run --priority 50 --lock-memory
      acquisition, kalman and sender run before everything that is not real-time
  truerate run --source log.csv.gz --speed max --profile trace.json
      the times of each sample at each stage, for ui.perfetto.dev
  truerate run --hide delay g-sensitivity
      a simulated vehicle with two effects that the model lacks
  truerate run --source log.csv.gz --speed max
      a log through the processes, as fast as possible, without loss
  truerate run --source serial:/dev/ttyUSB0 --prior type.toml
      a new part of a known type
  truerate run --source serial:/dev/ttyUSB0 --out shm
      a sensor on a serial line, the rate in shared memory
  truerate run --source log.csv.gz --speed max --model m.toml --freeze --record out.csv
      the same rows as `truerate apply`, byte for byte")]
pub struct Args {
    /// A TOML file with the pipeline's settings (see deploy/truerate.toml); flags override it
    #[arg(long, value_name = "F")]
    pub config: Option<PathBuf>,
    /// Where samples come from: `sim`, a log of any format, `-` for standard input, or a sensor's address such as
    /// serial:/dev/ttyUSB0?baud=115200, can:can0?dbc=car.dbc, udp:0.0.0.0:5600, tcp:HOST:PORT,
    /// mavlink:udp:0.0.0.0:14550 (docs/feed.md)
    /// [default: sim]
    #[arg(long, value_name = "sim|LOG|-|ADDRESS")]
    pub source: Option<String>,
    #[command(flatten)]
    pub(crate) names: NameArgs,
    /// Speed of the replay of a log: 1 is real time, 10 ten times that, `max` as fast as possible without loss.
    /// With `max`, rows that come live through `-` are processed at once [default: 1]
    #[arg(long, value_name = "X|max")]
    pub speed: Option<String>,
    /// The model to start from; without it the base model, learned during the run
    #[arg(long, value_name = "M")]
    pub model: Option<PathBuf>,
    /// Start from a type, as `truerate fleet F --export` writes it (FILE:TYPE where it holds several): a new part then needs
    /// seconds; a value that differs from the type's is reported, and not pulled to it
    #[arg(long, value_name = "type.toml", conflicts_with_all = ["model", "freeze"])]
    pub prior: Option<PathBuf>,
    /// No learning: the model stays as it is
    #[arg(long)]
    pub freeze: bool,
    /// Hide this effect in the source, at its typical size or with these values; may be given several times
    #[arg(long, value_name = "ID[:NAME=VALUE,…]", num_args = 1..)]
    pub hide: Vec<String>,
    /// Record the estimates, in the columns of `truerate apply`: CSV, or MCAP by the file's ending
    #[arg(long, value_name = "F")]
    pub record: Option<PathBuf>,
    /// Write the times of every sample at every stage, as a trace for ui.perfetto.dev (0.6 MB a second at 1 kHz)
    #[arg(long, value_name = "F")]
    pub profile: Option<PathBuf>,
    /// Send the rate to `unix:PATH`, `udp:HOST:PORT`, `-` (standard output; the summary goes to stderr), `shm`
    /// (shared memory); add `?format=csv` or `?format=binary` to choose the form. May be given several times (docs/feed.md)
    #[arg(long, value_name = "PLACE", value_parser = place, allow_hyphen_values = true)]
    pub out: Vec<String>,
    /// Where the dashboard listens: HOST:PORT, HOST:FIRST-LAST for the first free port of these, or `off`
    /// [default: 127.0.0.1:7777]
    #[arg(long, value_name = "ADDR|off")]
    pub dashboard: Option<String>,
    /// Run acquisition, kalman and sender before everything that is not real-time: SCHED_FIFO at this priority, 1 to 99
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: Option<u8>,
    /// Keep a process to these cores: `kalman=1`, `compensator=0,2`; may be given several times
    #[arg(long, value_name = "NAME=LIST")]
    pub cores: Vec<String>,
    /// Lock the memory of acquisition, kalman and sender, and touch their stacks beforehand
    #[arg(long)]
    pub lock_memory: bool,
    /// Largest delay of the timers of acquisition, kalman and sender, µs (0: as exact as possible) [default: 50]
    #[arg(long, value_name = "US")]
    pub timer_slack: Option<u64>,
    /// Learn only when the core is otherwise idle (SCHED_IDLE)
    #[arg(long)]
    pub idle_learning: bool,
    /// How kalman waits for its next sample: `event` sleeps, `spin` occupies a core, `hybrid(50)` spins for 50 µs and then
    /// sleeps [default: event]
    #[arg(long, value_name = "WAY")]
    pub wait: Option<String>,
    /// The name of this pipeline; pipelines of different names run side by side
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}

/// A place for the rate. `-` and `-?format=csv` mean standard output. Any other text that begins with a dash is the next flag: the place is
/// missing.
fn place(text: &str) -> Result<String, String> {
    match text.strip_prefix('-') {
        Some(rest) if !rest.is_empty() && !rest.starts_with('?') => {
            Err(format!("'{text}' is a flag: --out needs a place before it"))
        }
        _ => Ok(text.to_owned()),
    }
}

/// Runs the pipeline until its source ends or a signal comes, and prints the summary.
///
/// # Errors
/// Settings that make no sense, an instance that already runs, a folder that cannot be used.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let settings = settings(args)?;
    let uses_standard_output = settings.uses_standard_output();
    let ending =
        supervisor::supervise(Claim::take(&args.instance)?, settings, &Stop::on_signals().context("signals")?)?;
    let found: String = ending.found.iter().flat_map(|line| [line.as_str(), "\n"]).collect();
    let said = format!("{}{found}", ending.summary);
    if uses_standard_output {
        eprint!("{said}");
    } else if !said.is_empty() {
        print(&said)?;
    }
    Ok(ending.code)
}

/// The configuration file's settings, or the defaults, with the flags laid over them.
fn settings(args: &Args) -> anyhow::Result<Settings> {
    let mut settings = args.config.as_deref().map(Settings::read).transpose()?.unwrap_or_default();
    if let Some(source) = &args.source {
        settings.source = Source::told(source, args.names.dbc.as_deref())?;
    }
    if let Some(speed) = &args.speed {
        settings.speed = speed.parse().context("--speed")?;
    }
    settings.map.extend(args.names.map.iter().cloned());
    settings.columns = args.names.columns.clone().or(settings.columns);
    settings.dbc = args.names.dbc.clone().or(settings.dbc);
    let reference = args.names.reference.as_ref().map(|place| place.display().to_string());
    settings.reference = reference.or(settings.reference);
    if let Some(model) = &args.model {
        settings.model = Some(model.clone());
    }
    if let Some(prior) = &args.prior {
        settings.prior = Some(prior.clone());
    }
    if let Some(record) = &args.record {
        settings.record = Some(record.clone());
    }
    if let Some(profile) = &args.profile {
        settings.profile = Some(profile.clone());
    }
    for place in &args.out {
        settings.out.push(place.parse().context("--out")?);
    }
    if let Some(dashboard) = &args.dashboard {
        settings.dashboard.clone_from(dashboard);
    }
    settings.freeze |= args.freeze;
    settings.hide.extend(args.hide.iter().cloned());
    let realtime = &mut settings.realtime;
    realtime.priority = args.priority.unwrap_or(realtime.priority);
    for text in &args.cores {
        realtime.cores.set(text).context("--cores")?;
    }
    realtime.lock_memory |= args.lock_memory;
    realtime.idle_learning |= args.idle_learning;
    realtime.timer_slack_us = args.timer_slack.unwrap_or(realtime.timer_slack_us);
    if let Some(wait) = &args.wait {
        settings.wait.kalman = wait.parse().context("--wait")?;
    }
    settings.make_absolute(Path::new("."))?;
    settings.check()?;
    if let Some(path) = &settings.prior {
        Prior::load(path)?;
    }
    if settings.freeze && settings.model.is_none() {
        bail!("--freeze keeps the model as it is, so give one with --model");
    }
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::Args;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn the_rate_goes_to_standard_output_in_the_form_that_is_asked_for() {
        let out = |words: &[&str]| Line::try_parse_from([&["run"], words].concat()).map(|line| line.args.out);
        assert_eq!(out(&["--out", "-?format=csv", "--out", "-"]).unwrap(), ["-?format=csv", "-"]);
        assert!(out(&["--out", "--record"]).is_err());
    }
}
