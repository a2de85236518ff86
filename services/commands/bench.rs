//! `truerate bench`: what a hop from one process to another costs on this machine, beside what else could carry it.

use super::print;
use crate::{
    hops::{self, Length, Load, Measured, Plan, Way, echo},
    progress::Progress,
    stop::Stop,
};
use anyhow::Context;
use clap::ValueEnum;
use ipc_types::{Estimate, Sample};
use serde_json::{Value, json};
use std::{fmt::Write, process::ExitCode, thread, time::Duration};

/// What `truerate bench` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate bench --count 500
      every way, quiet and busy, 500 round trips each
  truerate bench --count 500 --load busy --way event
      the pipeline's own hop on a busy machine, beside a pipe
  truerate bench --count 500 --rate 1000 --load quiet --format json

A round trip is a sample to another process and an estimate back, so two hops; the other process
does nothing else. Ways:
  event      the pipeline's own hop with the default wait: it sleeps until it is woken
  spin       the same with a busy wait (`wait` in the configuration)
  iceoryx2   publish and subscribe with notifier and listener, without what the pipeline adds
  socket     a Unix stream socket
  pipe       two pipes: the ratios are relative to them
The ways take turns, so that other load on the machine affects all of them equally. `spin` needs
two free cores: on a busy machine its figures show the scheduler. Compare ratios: times differ from
machine to machine and from hour to hour.")]
pub struct Args {
    /// Round trips of each way under each load; without it, as many as 1.5 s allow
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    count: Option<u64>,
    /// Round trips a second, as from a sensor; without it, each begins when the one before has ended
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// Under this load only: `quiet`, or `busy` (a loop on every core)
    #[arg(long, value_enum, value_name = "LOAD")]
    load: Option<Load>,
    /// This way only, and the pipe; may be given several times
    #[arg(long, value_enum, value_name = "WAY")]
    way: Vec<Way>,
    /// What is printed to standard output
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// The other process
    #[arg(long, value_enum, value_name = "WAY", hide = true, requires = "instance")]
    echo: Option<Way>,
    /// The domain of the other process
    #[arg(long, value_name = "NAME", hide = true)]
    instance: Option<String>,
}

/// The forms of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people
    #[default]
    Text,
    /// For programs: `truerate.bench/1`
    Json,
}

/// Each way under each load, where no count is given.
const LONGEST: Duration = Duration::from_millis(1500);
const TURNS: u64 = 4;

fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "expected a number of Hz, such as 1000".to_owned())?;
    if (0.1..=1e6).contains(&rate) { Ok(rate) } else { Err("0.1 to 1000000 Hz are wanted".to_owned()) }
}

/// Measures, and prints.
///
/// # Errors
/// Where the machine refuses a process or its shared memory, or it was asked to stop.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if let (Some(way), Some(instance)) = (args.echo, &args.instance) {
        return echo::run(way, instance).map(|()| ExitCode::SUCCESS);
    }
    let stop = Stop::on_signals().context("signals")?;
    let wanted = |way: &Way| args.way.is_empty() || *way == Way::Pipe || args.way.contains(way);
    let plan = Plan {
        ways: Way::ALL.into_iter().filter(wanted).collect(),
        loads: args.load.map_or_else(|| vec![Load::Quiet, Load::Busy], |load| vec![load]),
        length: args.count.map_or(Length::Time(LONGEST), Length::RoundTrips),
        rate_hz: args.rate,
        turns: TURNS,
    };
    let progress = Progress::of((plan.ways.len() * plan.loads.len()) as u64 * TURNS, "");
    let mut done = 0;
    let all = hops::measure(&plan, &stop, |load, way| {
        progress.says(&format!("{} {}", load.name(), way.name()));
        progress.at(done);
        done += 1;
    })?;
    drop(progress);
    match args.format {
        Format::Text => print(&text(&all))?,
        Format::Json => print(&serde_json::to_string_pretty(&json(&all))?)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// A way's time over the pipe's under the same load, at this share.
fn to_pipe(all: &[Measured], measured: &Measured, q: f64) -> Option<f64> {
    let pipe = all.iter().find(|m| m.way == Way::Pipe && m.load == measured.load)?.quantile(q);
    (pipe > 0).then(|| measured.quantile(q) as f64 / pipe as f64)
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

fn kernel() -> String {
    rustix::system::uname().release().to_string_lossy().into_owned()
}

fn json(all: &[Measured]) -> Value {
    let way = |m: &Measured| {
        json!({
            "load": m.load.name(),
            "way": m.way.name(),
            "round_trips": m.sorted_ns.len(),
            "p50_ns": m.quantile(0.5),
            "p99_ns": m.quantile(0.99),
            "p999_ns": m.quantile(0.999),
            "max_ns": m.quantile(1.0),
            "p50_to_pipe": to_pipe(all, m, 0.5),
            "p99_to_pipe": to_pipe(all, m, 0.99),
        })
    };
    json!({
        "schema": "truerate.bench/1",
        "cores": cores(),
        "kernel": kernel(),
        "bytes_there": size_of::<Sample>(),
        "bytes_back": size_of::<Estimate>(),
        "ways": all.iter().map(way).collect::<Vec<_>>(),
    })
}

fn text(all: &[Measured]) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "Round trips between two processes, µs; {} bytes there, {} back; {} cores, Linux {}",
        size_of::<Sample>(),
        size_of::<Estimate>(),
        cores(),
        kernel()
    );
    let mut load = None;
    for m in all {
        if load.replace(m.load) != Some(m.load) {
            let _ = writeln!(
                out,
                "\n{:<12} {:>11} {:>9} {:>9} {:>9} {:>9} {:>12} {:>12}",
                m.load.name(),
                "round trips",
                "p50",
                "p99",
                "p99.9",
                "max",
                "p50 ÷ pipe's",
                "p99 ÷ pipe's"
            );
        }
        let us = |q| m.quantile(q) as f64 * 1e-3;
        let ratio = |q| to_pipe(all, m, q).map_or_else(|| "–".to_owned(), |ratio| format!("{ratio:.2}"));
        let _ = writeln!(
            out,
            "  {:<10} {:>11} {:>9.1} {:>9.1} {:>9.1} {:>9.1} {:>12} {:>12}",
            m.way.name(),
            m.sorted_ns.len(),
            us(0.5),
            us(0.99),
            us(0.999),
            us(1.0),
            ratio(0.5),
            ratio(0.99)
        );
    }
    out
}
