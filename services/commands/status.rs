//! `truerate status`: what a pipeline has found, what runs, and every stage's latency, once.

use super::print;
use crate::clock::now_ns;
use crate::{
    domain,
    found::{Finder, Found},
    live::words,
    watch::Watch,
};
use clap::ValueEnum;
use ipc_types::{
    ServiceId, Status,
    health::Scheduling,
    status::{ServiceStatus, StageStatus},
};
use serde_json::{Value, json};
use std::{
    fmt::Write,
    process::ExitCode,
    thread::sleep,
    time::{Duration, Instant},
};

/// What `truerate status` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate status
      verdict, error, parameters and what learning waits for; then processes and latencies
  truerate status --format json --instance left-wheel
      for programs: `verdict.axes` is as `diagnose` has it, without curves")]
pub struct Args {
    /// What is printed to standard output
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
    /// The name of the pipeline
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}

/// The forms of a status.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people
    #[default]
    Text,
    /// For programs: `truerate.status/1`
    Json,
}

/// How long to wait for the supervisor's word, which comes five times a second.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long to wait for what was found before: the compensator gives it within 0.1 s, and later on a machine that is busy.
const CATCHING_UP: Duration = Duration::from_millis(1500);

/// Prints what runs.
///
/// # Errors
/// Where no such pipeline runs, or it is another user's.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let domain = domain::existing(&args.instance)?;
    let (status, found) = loop {
        let watch = Watch::join_within(&domain, "status", PATIENCE)?;
        match looked(&watch) {
            Err(_) if watch.is_outdated() => {}
            looked => break looked?,
        }
    };
    match args.format {
        Format::Text => print(&text(&args.instance, &status, &found))?,
        Format::Json => print(&serde_json::to_string_pretty(&json(&status, &found))?)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// What runs, and what was found: waits for all that a compensator at work has given before.
fn looked(watch: &Watch) -> anyhow::Result<(Status, Found)> {
    let (mut found, mut finder) = (Found::default(), Finder::open(&watch.hub)?);
    let mut status = watch.status(PATIENCE)?;
    let until = Instant::now() + CATCHING_UP;
    loop {
        finder.look(&mut found)?;
        if let Some(newer) = watch.newest_status()? {
            status = newer;
        }
        if finder.has_caught_up() || !has_something_to_say(&status) || watch.is_outdated() || Instant::now() > until {
            return Ok((status, found));
        }
        sleep(Duration::from_millis(5));
    }
}

/// Whether a compensator gives parameters and diagnoses.
fn has_something_to_say(status: &Status) -> bool {
    let is_at_work = |s: &ServiceStatus| ["running", "stopped"].contains(&s.state.as_str());
    status.listed_services().any(|s| s.name.as_str() == ServiceId::Compensator.name() && is_at_work(s))
}

/// As the interface has it: `truerate.status/1`.
#[must_use]
pub fn json(status: &Status, found: &Found) -> Value {
    let service = |s: &ServiceStatus| {
        json!({
            "name": s.name.as_str(),
            "pid": (s.pid != 0).then_some(s.pid),
            "state": s.state.as_str(),
            "restarts": s.restarts,
            "received": s.received,
            "sent": s.sent,
            "lost": s.lost,
            "rejected": s.rejected,
            "epoch": s.epoch,
            "scheduling": {
                "policy": policy(s.scheduling.policy),
                "priority": s.scheduling.priority,
                "cores": cores(s.scheduling.cores),
                "locked_memory": s.scheduling.locked != 0,
                "timer_slack_ns": s.scheduling.timer_slack_ns,
                "wait": (!s.wait.as_str().is_empty()).then_some(s.wait.as_str()),
            },
        })
    };
    let stage = |s: &StageStatus| {
        json!({
            "stage": s.stage.as_str(),
            "count": s.count,
            "p50_ns": s.p50_ns,
            "p99_ns": s.p99_ns,
            "p999_ns": s.p999_ns,
            "max_ns": s.max_ns,
        })
    };
    json!({
        "schema": "truerate.status/1",
        "verdict": found.json(),
        "source": words::json(&status.source),
        "learning": learning(status),
        "services": status.listed_services().map(service).collect::<Vec<_>>(),
        "stages": status.listed_stages().map(stage).collect::<Vec<_>>(),
    })
}

/// What learning is at: its state in one word, and the whole; null where no compensator has said anything yet.
fn learning(status: &Status) -> Value {
    let says = status.learning.as_str();
    let state = says.split(':').next().filter(|state| !state.is_empty());
    state.map_or(Value::Null, |state| json!({ "state": state, "says": says }))
}

/// The kernel's scheduling policies by their names.
fn policy(number: u32) -> &'static str {
    match number {
        0 => "other",
        1 => "fifo",
        2 => "rr",
        3 => "batch",
        5 => "idle",
        6 => "deadline",
        _ => "unknown",
    }
}

fn cores(mask: u64) -> Vec<u32> {
    (0..u64::BITS).filter(|core| mask >> core & 1 == 1).collect()
}

/// What is in force of what the kernel can be asked for.
fn scheduling(s: &ServiceStatus) -> String {
    let Scheduling { policy: number, priority, cores: mask, timer_slack_ns, locked, .. } = s.scheduling;
    let priority = if priority > 0 { priority.to_string() } else { "–".to_owned() };
    let list = cores(mask).iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
    let (slack, locked) = (timer_slack_ns as f64 * 1e-3, if locked != 0 { "locked" } else { "–" });
    let wait = if s.wait.as_str().is_empty() { "–" } else { s.wait.as_str() };
    format!("{:<12} {:>8} {priority:>8} {locked:>8} {slack:>10.1} {wait:>11}  {list}", s.name, policy(number))
}

fn text(instance: &str, status: &Status, found: &Found) -> String {
    let mut out = String::new();
    let age = now_ns().saturating_sub(status.beat_ns) as f64 * 1e-9;
    let _ = writeln!(out, "pipeline '{instance}', supervisor {} ({age:.1} s ago)", status.pid);
    if let Some(trouble) = words::trouble(&status.source) {
        let _ = writeln!(out, "{trouble}");
    }
    if words::trouble(&status.source).is_none() || found.diagnosis.is_some() {
        out += &found.text();
    }
    if !status.learning.as_str().is_empty() {
        let _ = writeln!(out, "learning {}", status.learning);
    }
    if let Some(source) = words::text(&status.source) {
        let _ = writeln!(out, "source: {source}");
    }
    let _ = writeln!(
        out,
        "{:<12} {:>8} {:<10} {:>8} {:>11} {:>11} {:>8} {:>8} {:>6}",
        "process", "pid", "state", "restarts", "in", "out", "lost", "rejected", "epoch"
    );
    for s in status.listed_services() {
        let _ = writeln!(
            out,
            "{:<12} {:>8} {:<10} {:>8} {:>11} {:>11} {:>8} {:>8} {:>6}",
            s.name, s.pid, s.state, s.restarts, s.received, s.sent, s.lost, s.rejected, s.epoch
        );
    }
    let _ = writeln!(
        out,
        "{:<12} {:>8} {:>8} {:>8} {:>10} {:>11}  cores",
        "scheduling", "policy", "priority", "memory", "slack (µs)", "wait"
    );
    for s in status.listed_services().filter(|s| s.pid != 0) {
        let _ = writeln!(out, "{}", scheduling(s));
    }
    let _ = writeln!(out, "{:<28} {:>11} {:>9} {:>9} {:>9} {:>9}", "stage (µs)", "count", "p50", "p99", "p99.9", "max");
    for s in status.listed_stages() {
        let us = |ns: u64| ns as f64 * 1e-3;
        let _ = writeln!(
            out,
            "{:<28} {:>11} {:>9.1} {:>9.1} {:>9.1} {:>9.1}",
            s.stage,
            s.count,
            us(s.p50_ns),
            us(s.p99_ns),
            us(s.p999_ns),
            us(s.max_ns)
        );
    }
    out
}
