//! `truerate guide`: a recording, guided, until the log can tell.

use crate::{
    guide::{self, From, Precisions, Settings},
    listening,
    live::{Address, address::AddressError},
    settings::{Source, Speed},
    stop::Stop,
};
use anyhow::{Context, Result, bail};
use gyro_model::{
    Axis,
    effects::{self, Effect},
    guide::unguided,
    simulate::{Hidden, Scenario, SensorSpec},
};
use std::{path::PathBuf, process::ExitCode};
use workbench::log::Options;

/// What `truerate guide` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate guide --source serial:/dev/ttyUSB0 -o hand.csv
      says how to turn the sensor, and stops when the log shows what is missing
  truerate guide temperature --source serial:/dev/ttyUSB0 -o warm.csv
      leads through a fridge and a hair-dryer: effects of the temperature, apart from a warm-up
  truerate guide --source udp:0.0.0.0:5600 --axes x,y -o arm.csv
      about two axes alone
  truerate guide --source - --want delay --to delay=0.0002 -o late.csv
      until the delay is known to 0.2 ms
  truerate guide --source can:can0 --dbc car.dbc -o car.csv
      frames of a CAN bus, decoded by the DBC file
  truerate guide --source sim --hide lag --speed max -o try.csv
      a simulated hand that follows: what a recording looks like
  truerate guide --source serial:/dev/ttyUSB0 --dashboard 0.0.0.0:7777 -o hand.csv
      on a phone beside the sensor too, at the address that it prints
  truerate guide --source sim --want bias --to 1% --speed max --format json -o events.csv
      events for a program, a line of JSON each

In a terminal, Enter skips what is asked now (not with `--source -`).

Each row is written at once, so that Ctrl-C loses none; an existing log is not overwritten. Exit
code 0: the log is sufficient; 3: the recording ended before, and the program prints what it lacks.")]
pub struct Args {
    /// What the recording is for: `temperature` leads through a fridge and a hair-dryer, so that an effect of the temperature is distinguished from a
    /// warm-up [default: whatever is missing]
    #[arg(value_enum, value_name = "temperature")]
    course: Option<Course>,
    /// Where rows come from: a sensor's address such as serial:/dev/ttyUSB0?baud=115200, can:can0?dbc=car.dbc,
    /// udp:0.0.0.0:5600, tcp:HOST:PORT, mavlink:udp:0.0.0.0:14550 (docs/feed.md), `-` for standard input, or `sim` for a simulated hand
    #[arg(long, value_name = "ADDRESS|-|sim")]
    source: String,
    /// The log to record: CSV
    #[arg(long, short, value_name = "LOG.csv")]
    output: PathBuf,
    /// Take the reference from this address; its newest value is added to the gyro's next row
    #[arg(long, value_name = "ADDRESS")]
    reference: Option<String>,
    /// A TOML file that renames foreign headers: lines such as `"IMU gz (deg/s)" = "gyro_z_dps"`
    #[arg(long, value_name = "F")]
    columns: Option<PathBuf>,
    /// Take this channel under this name: `gyro_z_dps=gz/131`; `ref:NAME=CHANNEL` for the address of --reference; may be given several
    /// times
    #[arg(long, value_name = "NAME=CHANNEL")]
    map: Vec<String>,
    /// A DBC file, which defines the frames of a CAN bus: for `can:can0`, and for the lines of `candump` on standard input
    #[arg(long, value_name = "FILE.dbc")]
    dbc: Option<PathBuf>,
    /// Only these axes [default: all that have a reference]
    #[arg(long, value_name = "x,y,z", value_delimiter = ',')]
    axes: Vec<Axis>,
    /// Measure these effects (`truerate effects`) [default: whatever is missing]
    #[arg(long, value_name = "EFFECT,…", value_delimiter = ',')]
    want: Vec<String>,
    /// The wanted standard error, as a share of the effect's typical size, or of one effect in SI units, `delay=0.0002`; may
    /// be given several times [default: 2%]
    #[arg(long, value_name = "PERCENT%|EFFECT=VALUE")]
    to: Vec<String>,
    /// Hide this effect in the simulated sensor, at its typical size or with these values
    #[arg(long, value_name = "ID[:NAME=VALUE,…]", num_args = 1..)]
    hide: Vec<String>,
    /// Seed of the simulated sensor and hand
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Speed of the simulation: 1 is real time, `max` as fast as possible [default: 1]
    #[arg(long, value_name = "X|max")]
    speed: Option<String>,
    /// Show it on a page too, at this address: `127.0.0.1:0` for any free port, `0.0.0.0:7777` for a phone beside the sensor
    #[arg(long, value_name = "ADDR")]
    dashboard: Option<String>,
    /// `text`, or `json` for one event a line
    #[arg(long, value_parser = ["text", "json"], default_value = "text")]
    format: String,
}

/// What a recording may be for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Course {
    /// Effects of the temperature: cold, hot, and back again
    Temperature,
}

/// Effects that a course of temperatures is for.
const OF_TEMPERATURE: [&str; 4] = ["scale-factor", "bias", "temperature-bias", "temperature-scale"];
/// The swing of a simulated sensor's temperature on such a course, K, and its period, s.
const SIMULATED: (f64, f64) = (14.0, 120.0);

/// The exit code of a recording that lacks something.
const LACKS: u8 = 3;

/// Records.
///
/// # Errors
/// Words that make no sense together, a log that is there, a source that cannot be read.
pub fn run(args: &Args) -> Result<ExitCode> {
    let precisions = Precisions::parse(&args.to)?;
    let of_temperature = args.course == Some(Course::Temperature);
    let mut want = args.want.clone();
    if of_temperature {
        want.extend(
            OF_TEMPERATURE.iter().filter(|id| !args.want.iter().any(|own| own == *id)).map(|id| (*id).to_owned()),
        );
    }
    let effects = wanted(&want, &precisions)?;
    let mut axes = args.axes.clone();
    axes.sort_unstable();
    axes.dedup();
    let settings = Settings {
        from: from(args)?,
        log: args.output.clone(),
        axes,
        effects,
        temperature: of_temperature,
        precisions,
        json: args.format == "json",
        dashboard: args.dashboard.as_deref().map(listening::Address::parse).transpose()?.flatten(),
    };
    let ending = guide::run(&settings, &Stop::on_signals().context("signals")?)?;
    Ok(if ending.complete { ExitCode::SUCCESS } else { ExitCode::from(LACKS) })
}

/// The effects of `--want`, in the catalogue's order, behind scale factor and bias.
fn wanted(want: &[String], precisions: &Precisions) -> Result<Option<Vec<&'static dyn Effect>>> {
    let known = |id: &str| {
        let effect = effects::find(id);
        effect
            .with_context(|| format!("there is no effect '{id}'{}; `truerate effects` lists them", effects::meant(id)))
    };
    for id in want {
        let effect = known(id)?;
        if let Some(why) = unguided(effect) {
            bail!(
                "--want {id}: no manoeuvre can measure it, because {why}; without --want the guide records until the log names the effects"
            );
        }
    }
    for id in precisions.effects() {
        known(id).context("--to")?;
        if !(want.is_empty() && guide::USUAL.contains(&id) || want.iter().any(|own| own == id)) {
            bail!("--to {id}=…: {id} is not among the effects to be shown: add it to --want");
        }
    }
    let is_wanted = |effect: &&'static dyn Effect| want.iter().any(|id| id == effect.card().id);
    Ok((!want.is_empty()).then(|| effects::CATALOGUE.iter().copied().filter(is_wanted).collect()))
}

/// An address, with `--dbc` where frames come by it.
fn of_frames(text: &str, args: &Args) -> Result<Address, AddressError> {
    args.dbc.as_deref().map_or_else(|| text.parse(), |dbc| Address::of_frames(text, dbc))
}

fn from(args: &Args) -> Result<From> {
    let source = Source::told(&args.source, args.dbc.as_deref())?;
    if source != Source::Simulated && (!args.hide.is_empty() || args.speed.is_some()) {
        bail!("--hide and --speed are of a simulated hand: use them with --source sim");
    }
    let live = |address: Address| -> Result<From> {
        let reference =
            args.reference.as_deref().map(|text| of_frames(text, args)).transpose().context("--reference")?;
        let gives_frames = |address: &Address| address.dbc.is_some();
        if args.dbc.is_some() && !gives_frames(&address) && !reference.as_ref().is_some_and(gives_frames) {
            bail!("--dbc is of the frames of a CAN bus: {address} gives none (can:can0, or ?format=candump)");
        }
        let options = Options {
            columns: args.columns.clone(),
            map: args.map.clone(),
            reference: reference.as_ref().map(|address| address.to_string().into()),
            ..Options::default()
        };
        Ok(From::Live { address, reference, options })
    };
    match source {
        Source::Live(address) => live(address),
        Source::Stream(path) => live(Address::of_pipe(path, args.dbc.clone())),
        Source::Log(path) => bail!(
            "{}: is a log, and a recording needs a sensor: give its address, such as serial:/dev/ttyUSB0; of a log use `truerate diagnose`",
            path.display()
        ),
        Source::Simulated => {
            let mut sensor = SensorSpec::random(args.seed);
            if args.course == Some(Course::Temperature) {
                (sensor.temperature.swing, sensor.temperature.period) = SIMULATED;
                sensor.temperature.rise = 0.0;
            }
            let hidden: Result<Vec<Hidden>, _> =
                args.hide.iter().map(|text| Hidden::parse(text, sensor.axis)).collect();
            let scenario = Scenario { seed: args.seed, hidden: hidden?, sensor, ..Scenario::default() };
            let speed = args.speed.as_deref().map_or(Ok(Speed::Times(1.0)), str::parse).context("--speed")?;
            Ok(From::Hand(Box::new(scenario), speed))
        }
    }
}
