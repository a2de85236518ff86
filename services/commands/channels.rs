//! `truerate channels`: what a file holds, and a map to the names of a log.

use crate::{
    commands::print,
    log::{self, Look},
};
use anyhow::Result;
use clap::ValueEnum;
use comfy_table::{CellAlignment, Table, presets};
use log_readers::{meaning::Pick, survey::Surveyed};
use serde_json::{Value, json};
use std::{fmt::Write, path::PathBuf, process::ExitCode};

/// What `truerate channels` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate channels flight.ulg                     channels with rate, unit, span and gaps, and a map
  truerate channels recording.mcap --format json   for programs
  truerate channels candump.log --dbc car.dbc      the signals of a CAN log

A channel is taken under a name of a log with `--map NAME=CHANNEL`, on every command that takes a log.
What stands under `map` is taken without being named; what stands under `likely` has to be chosen.")]
pub struct Args {
    /// The file: text, ULog, ArduPilot .bin, MCAP, ROS bag, CAN log, …, plain or packed, or the folder of a ROS 2 bag
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// What the frames of a CAN log mean
    #[arg(long, value_name = "FILE.dbc")]
    dbc: Option<PathBuf>,
    /// What is printed to standard output
    #[arg(long, value_enum, default_value_t)]
    format: Form,
}

/// The forms of the list.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum Form {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

/// Looks and prints.
///
/// # Errors
/// A file that cannot be read, or standard output.
pub fn run(args: &Args) -> Result<ExitCode> {
    let look = log::look(&args.file, args.dbc.as_deref())?;
    let name = args.file.display().to_string();
    match args.format {
        Form::Text => print(&text(&name, &look))?,
        Form::Json => print(&serde_json::to_string_pretty(&json(&name, &look))?)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn seconds(ns: i64) -> f64 {
    ns as f64 / 1e9
}

fn text(name: &str, look: &Look) -> String {
    let mut out = format!("{name}: {}\n", look.format);
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["channel", "unit", "values", "rate", "span", "gaps", "from", "to"]);
    for of in &look.survey.topics {
        let (gaps, longest) = of.gaps();
        for (field, range) in of.topic.fields.iter().zip(&of.fields).filter(|_| of.messages > 0) {
            let number = |x: f64| if x.is_finite() { format!("{x:.6}") } else { String::new() };
            table.add_row([
                of.topic.channel(field),
                field.unit.map_or("", |unit| unit.symbol).to_owned(),
                range.values.to_string(),
                of.rate_hz().map_or(String::new(), |rate| format!("{rate:.1} Hz")),
                format!("{:.1} s", seconds(of.last_ns - of.first_ns)),
                if gaps > 0 { format!("{gaps}, up to {:.2} s", seconds(longest)) } else { "none".to_owned() },
                number(range.low),
                number(range.high),
            ]);
        }
    }
    for column in 2..8 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let _ = writeln!(out, "{}", table.trim_fmt());
    let empty: Vec<&str> =
        look.survey.topics.iter().filter(|of| of.messages == 0).map(|of| of.topic.name.as_str()).collect();
    if !empty.is_empty() {
        let _ = writeln!(out, "without a message: {}", empty.join(", "));
    }
    for note in &look.survey.notes {
        let _ = writeln!(out, "{note}");
    }
    if !look.own.is_empty() {
        let _ = writeln!(out, "\nnames of a log already: {}", look.own.join(", "));
    }
    for (title, picks) in [("map", &look.proposal.chosen), ("likely", &look.proposal.offered)] {
        if !picks.is_empty() {
            let flags: Vec<String> = picks.iter().map(Pick::flag).collect();
            let _ = writeln!(out, "\n{title}:\n  {}", flags.join(" \\\n  "));
        }
    }
    let mut said = Vec::new();
    for of in look
        .proposal
        .dependent
        .iter()
        .filter(|of| look.proposal.chosen.iter().any(|pick| pick.channel.starts_with(&of.channel)))
    {
        if !said.contains(&of.by) {
            said.push(of.by);
            let _ = writeln!(out, "\n{} is no reference for this gyro: {} computed it from it", of.channel, of.by);
        }
    }
    out
}

fn json(name: &str, look: &Look) -> Value {
    let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    let channels = look.survey.topics.iter().flat_map(|of: &Surveyed| {
        let (gaps, longest) = of.gaps();
        of.topic.fields.iter().zip(&of.fields).map(move |(field, range)| {
            json!({
                "channel": of.topic.channel(field),
                "topic": of.topic.name,
                "kind": of.topic.kind,
                "unit": field.unit.map(|unit| unit.symbol),
                "rows": of.messages,
                "values": range.values,
                "rate_hz": of.rate_hz(),
                "from_s": seconds(of.first_ns),
                "span_s": seconds(of.last_ns - of.first_ns),
                "gaps": gaps,
                "longest_gap_s": if gaps > 0 { json!(seconds(longest)) } else { Value::Null },
                "min": finite(range.low),
                "max": finite(range.high),
            })
        })
    });
    let strings = |picks: &[Pick]| picks.iter().map(ToString::to_string).collect::<Vec<_>>();
    json!({
        "schema": "truerate.channels/1",
        "log": name,
        "format": look.format,
        "channels": channels.collect::<Vec<_>>(),
        "map": strings(&look.proposal.chosen),
        "likely": strings(&look.proposal.offered),
        "dependent": look.proposal.dependent.iter().map(|d| json!({"channel": d.channel, "by": d.by})).collect::<Vec<_>>(),
        "notes": look.survey.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
