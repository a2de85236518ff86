//! `truerate service NAME`: one process of the pipeline; what `truerate run` starts.

use crate::{
    acquisition, compensator, dashboard,
    domain::{self, Lock},
    hopeless::Hopeless,
    kalman, recorder,
    run_folder::RunFolder,
    sender,
    stop::Stop,
    supervisor::process::HOPELESS,
};
use anyhow::{Context, bail};
use ipc_types::{ServiceId, domain::Domain, port::Hub};
use std::{
    process::ExitCode,
    thread::sleep,
    time::{Duration, Instant},
};

/// What `truerate service` takes.
#[derive(clap::Args, Debug, Clone)]
pub struct Args {
    /// Which process: acquisition, kalman, compensator, recorder, dashboard, sender
    #[arg(value_name = "NAME")]
    pub name: String,
    /// The pipeline that it belongs to
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}

/// How long to try while the domain is being made, or a dead predecessor's ports are not yet swept.
const PATIENCE: Duration = Duration::from_secs(8);
const LONGEST_PAUSE: Duration = Duration::from_millis(200);

/// Runs one process until it is told to stop.
///
/// # Errors
/// An unknown name, no pipeline to belong to, or broken plumbing.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let known = ServiceId::ALL.map(ServiceId::name);
    let service = ServiceId::ALL
        .into_iter()
        .find(|id| id.name() == args.name)
        .with_context(|| format!("unknown process '{}': use one of {}", args.name, known.join(", ")))?;
    let stop = Stop::on_signals().context("signals")?;
    let domain = domain::existing(&args.instance)?;
    let folder = RunFolder::of(&domain);
    let Some(_lock) = Lock::wait_for(&folder.lock(service), PATIENCE)? else {
        bail!("{} of pipeline '{}' already runs", service.name(), args.instance);
    };
    match serve(service, &domain, &folder, &stop) {
        Err(error) if error.is::<Hopeless>() => {
            eprintln!("truerate: {error:#}");
            Ok(ExitCode::from(HOPELESS))
        }
        result => result.map(|()| ExitCode::SUCCESS),
    }
}

/// Enters the service; tries again while its ports cannot be opened yet.
fn serve(service: ServiceId, domain: &Domain, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let run = folder.run()?;
    run.settings.realtime.begin(service);
    let hub = patiently(stop, || Ok(Hub::join(domain, service.name())?))?;
    match service {
        ServiceId::Acquisition => acquisition::run(&hub, &run, folder, stop),
        ServiceId::Kalman => kalman::run(&hub, &run, folder, stop),
        ServiceId::Compensator => compensator::run(&hub, &run, folder, stop),
        ServiceId::Recorder => recorder::run(&hub, &run, folder, stop),
        ServiceId::Sender => sender::run(&hub, &run, stop),
        ServiceId::Dashboard => dashboard::run(&hub, domain, &run, folder, stop),
    }
}

fn patiently<T>(stop: &Stop, mut attempt: impl FnMut() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let start = Instant::now();
    let mut pause = Duration::from_millis(5);
    loop {
        match attempt() {
            Err(_) if start.elapsed() < PATIENCE && !stop.asked() => {
                sleep(pause);
                pause = (2 * pause).min(LONGEST_PAUSE);
            }
            result => return result,
        }
    }
}
