//! `truerate demo`: the main job in one go.

use super::print;
use crate::{
    dashboard::free_address,
    demo::{self, Player},
    domain::free_name,
    settings::{Learning, Settings, Source, Speed},
    source::scenario,
    stop::Stop,
    supervisor,
};
use anyhow::Context;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    thread,
};

/// What `truerate demo` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate demo                       a simulated vehicle with an effect hidden at random; says what to look at
  truerate demo --auto --seed 7       plays the whole loop by itself, to the terminal
  truerate demo --log log.csv.gz      the same on a recording")]
pub struct Args {
    /// Use this recording in place of the simulated vehicle
    #[arg(long, value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Play the whole loop to the terminal: compare, diagnose, add, see the error fall
    #[arg(long)]
    pub auto: bool,
    /// Which vehicle and which hidden effect; without it one at random
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// The name of this pipeline: several of different names run side by side [default: demo, or demo-2, … where that runs]
    #[arg(long, value_name = "NAME")]
    pub instance: Option<String>,
}

/// Plays the demo.
///
/// # Errors
/// Where the pipeline cannot run.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let seed = args.seed.unwrap_or_else(|| crate::clock::now_ns() % 1_000_000);
    let hidden = args.log.is_none().then(|| demo::hidden(seed));
    let settings = settings(args, seed, hidden)?;
    let instance = args.instance.clone().map_or_else(|| free_name("demo"), Ok)?;
    let source = args.log.as_ref().map_or_else(|| format!("simulated vehicle {seed}"), |p| p.display().to_string());
    let stop = Stop::on_signals().context("signals")?;
    if args.auto {
        play(&instance, &source, settings, hidden, &stop)
    } else {
        show(&instance, &source, settings, hidden, &stop)
    }
}

fn settings(args: &Args, seed: u64, hidden: Option<&str>) -> anyhow::Result<Settings> {
    let default = Settings::default();
    let mut settings = Settings {
        source: args.log.clone().map_or(Source::Simulated, Source::at),
        speed: Speed::Times(if args.auto { demo::SPEED } else { 1.0 }),
        hide: hidden.iter().map(ToString::to_string).collect(),
        dashboard: if args.auto { "off".to_owned() } else { free_address(&default.dashboard)? },
        simulation: demo::vehicle(seed),
        learning: Learning { duty: if args.auto { 0.7 } else { 0.3 }, ..Learning::default() },
        ..default
    };
    settings.make_absolute(Path::new("."))?;
    Ok(settings)
}

/// Runs it for somebody to look at, until Ctrl-C.
fn show(
    instance: &str,
    source: &str,
    settings: Settings,
    hidden: Option<&str>,
    stop: &Stop,
) -> anyhow::Result<ExitCode> {
    let axis = hidden.map(|_| scenario(&settings)).transpose()?.map(|scenario| scenario.sensor.axis);
    print(&demo::invitation(source, instance, &settings.dashboard, axis))?;
    let ending = supervisor::supervise(instance, settings, stop)?;
    print(&ending.summary)?;
    if !ending.hidden.is_empty() {
        print(&format!("hidden: {}", ending.hidden.join(", ")))?;
    }
    Ok(ending.code)
}

/// Plays the loop: the pipeline in one thread, the player, who only watches and asks, in this one.
fn play(
    instance: &str,
    source: &str,
    settings: Settings,
    hidden: Option<&str>,
    stop: &Stop,
) -> anyhow::Result<ExitCode> {
    let about = if hidden.is_some() { "something is wrong with the gyro" } else { "let us see what the gyro does" };
    print(&format!("{source}: acquisition, kalman and compensator are starting; {about}."))?;
    let (name, other) = (instance.to_owned(), stop.clone());
    let pipeline = thread::spawn(move || {
        let ending = supervisor::supervise(&name, settings, &other);
        // Nothing runs any more: the player must not wait for it.
        other.ask();
        ending
    });
    let played = Player::join(instance, stop).and_then(|player| player.map(|p| p.play(stop)).transpose());
    stop.ask();
    let ending = pipeline.join().map_err(|_| anyhow::anyhow!("the supervisor died"))??;
    let Some(played) = played?.flatten() else {
        print(&ending.summary)?;
        anyhow::bail!("the demo was interrupted before it had named anything");
    };
    print(&ending.summary)?;
    let shown = if ending.hidden.is_empty() { "unknown".to_owned() } else { ending.hidden.join(", ") };
    print(&format!(
        "hidden: {shown}  named: {}  error/floor: {:.2} -> {:.2}",
        played.named, played.before, played.after
    ))?;
    let agree = hidden.is_none_or(|hidden| hidden == played.named);
    Ok(if agree { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
