//! `truerate demo`: the main job in one go.

use super::print;
use crate::{
    demo::{self, Player},
    domain::Claim,
    run_folder::RunFolder,
    settings::{Learning, Settings, Source, Speed},
    source::scenario,
    stop::Stop,
    supervisor,
};
use anyhow::Context;
use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    thread::{self, sleep},
    time::{Duration, Instant},
};
use workbench::vehicle;

/// The first free of these is the dashboard's: several demos run side by side.
const DASHBOARD: &str = "127.0.0.1:7777-7876";
/// A dashboard that has not said where it listens by then has trouble, which it says itself.
const LISTENS_WITHIN: Duration = Duration::from_secs(20);

/// What `truerate demo` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate demo
      a simulated vehicle with a random hidden effect; prints what to look at
  truerate demo --auto --seed 7
      runs the whole loop by itself, in the terminal
  truerate demo --log log.csv.gz
      the same on a recording")]
pub struct Args {
    /// Use this recording in place of the simulated vehicle
    #[arg(long, value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Show the whole loop in the terminal: compare, diagnose, add, and how the error falls
    #[arg(long)]
    pub auto: bool,
    /// Seed of the vehicle and its hidden effect; without it a random one
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// The name of this pipeline; pipelines of different names run side by side [default: demo, or demo-2, … if that runs]
    #[arg(long, value_name = "NAME")]
    pub instance: Option<String>,
}

/// Plays the demo.
///
/// # Errors
/// Where the pipeline cannot run.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let seed = args.seed.unwrap_or_else(|| crate::clock::now_ns() % 1_000_000);
    let hidden = args.log.is_none().then(|| vehicle::hidden(seed));
    let settings = settings(args, seed, hidden)?;
    let claim = args.instance.as_deref().map_or_else(|| Claim::take_free("demo"), Claim::take)?;
    let source = args.log.as_ref().map_or_else(|| format!("simulated vehicle {seed}"), |p| p.display().to_string());
    let stop = Stop::on_signals().context("signals")?;
    if args.auto { play(claim, &source, settings, hidden, &stop) } else { show(claim, &source, settings, &stop) }
}

fn settings(args: &Args, seed: u64, hidden: Option<&str>) -> anyhow::Result<Settings> {
    let (default, simulation) = (Settings::default(), demo::vehicle(seed));
    let mut settings = Settings {
        source: args.log.clone().map_or(Source::Simulated, Source::at),
        speed: Speed::Times(if args.auto { demo::SPEED } else { 1.0 }),
        hide: hidden.map(|hidden| vehicle::sized(hidden, &vehicle::scenario(seed)?)).transpose()?.into_iter().collect(),
        dashboard: if args.auto { "off".to_owned() } else { DASHBOARD.to_owned() },
        simulation,
        learning: Learning { duty: if args.auto { 0.7 } else { 0.3 }, ..Learning::default() },
        ..default
    };
    settings.make_absolute(Path::new("."))?;
    Ok(settings)
}

/// Runs it for somebody to look at, until Ctrl-C.
fn show(claim: Claim, source: &str, settings: Settings, stop: &Stop) -> anyhow::Result<ExitCode> {
    let is_simulated = settings.source == Source::Simulated;
    let axis = is_simulated.then(|| scenario(&settings)).transpose()?.map(|scenario| scenario.sensor.axis);
    let (folder, source, other) = (RunFolder::of(claim.domain()), source.to_owned(), stop.clone());
    let url = folder.mark("dashboard.url");
    // Left by a demo that was killed.
    let _ = fs::remove_file(&url);
    let inviting = thread::spawn(move || {
        let start = Instant::now();
        while !url.exists() && start.elapsed() < LISTENS_WITHIN && !other.asked() {
            sleep(Duration::from_millis(20));
        }
        let url = fs::read_to_string(&url).ok();
        print(&demo::invitation(&source, folder.instance(), url.as_deref(), axis))
    });
    let ending = supervisor::supervise(claim, settings, stop);
    // Where nothing runs any more there is nobody to invite.
    stop.ask();
    inviting.join().map_err(|_| anyhow::anyhow!("the invitation died"))??;
    let ending = ending?;
    print(&ending.summary)?;
    for line in &ending.found {
        print(line)?;
    }
    if !ending.hidden.is_empty() {
        print(&format!("hidden: {}", ending.hidden.join(", ")))?;
    }
    Ok(ending.code)
}

/// Plays the loop: the pipeline in one thread, the player, who only watches and asks, in this one.
fn play(claim: Claim, source: &str, settings: Settings, hidden: Option<&str>, stop: &Stop) -> anyhow::Result<ExitCode> {
    let about = if hidden.is_some() { "its gyro has a hidden error" } else { "its gyro is examined" };
    print(&format!("{source}: acquisition, kalman and compensator are starting; {about}."))?;
    let (instance, other) = (claim.domain().name().to_owned(), stop.clone());
    let pipeline = thread::spawn(move || {
        let ending = supervisor::supervise(claim, settings, &other);
        // Nothing runs any more: the player must not wait for it.
        other.ask();
        ending
    });
    let played = Player::join(&instance, stop).and_then(|player| player.map(|p| p.play(stop)).transpose());
    stop.ask();
    let ending = pipeline.join().map_err(|_| anyhow::anyhow!("the supervisor died"))??;
    let Some(played) = played?.flatten() else {
        print(&ending.summary)?;
        anyhow::bail!("the demo was interrupted before it had named anything");
    };
    print(&ending.summary)?;
    for line in &ending.found {
        print(line)?;
    }
    // With its size, which a comparison of names leaves out.
    let hidden = hidden.and_then(|text| text.split(':').next());
    let shown = hidden.unwrap_or("unknown");
    print(&format!(
        "hidden: {shown}  named: {}  error/floor: {:.2} -> {:.2}",
        played.named, played.before, played.after
    ))?;
    let agree = hidden.is_none_or(|hidden| hidden == played.named);
    Ok(if agree { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
