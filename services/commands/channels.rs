//! `truerate channels`: what a file holds, and a map to the names of a log.

use crate::commands::print;
use anyhow::Result;
use clap::ValueEnum;
use comfy_table::{CellAlignment, Table, presets};
use log_readers::{
    formats::can,
    meaning::{Dependent, Pick},
    survey::{Survey, Surveyed},
};
use serde_json::{Value, json};
use std::{fmt::Write, path::PathBuf, process::ExitCode};
use workbench::{
    log::{self, Look},
    report,
};

/// What `truerate channels` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate channels flight.ulg
      channels with rate, unit, span and gaps, and a map
  truerate channels recording.mcap --format json
      for programs
  truerate channels candump.log
      the identifiers of a CAN log
  truerate channels candump.log --dbc car.dbc
      its signals

`--map NAME=CHANNEL` uses a channel under a name of a log, on every command that takes a log. The
channels under `map` are used without it; those under `likely` have to be chosen with it.")]
pub struct Args {
    /// The file: text, ULog, ArduPilot .bin, MCAP, ROS bag, Parquet, CAN log, …, plain or packed, or the folder of a ROS 2 bag
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// A DBC file, which defines the frames of a CAN log; without it their identifiers are listed
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
    let frames = identifiers(&look.survey);
    let table = if frames.is_empty() { of_channels(&look.survey) } else { of_frames(&frames) };
    let _ = writeln!(out, "{}", table.trim_fmt());
    if !frames.is_empty() {
        let _ = writeln!(
            out,
            "\nWhat their bytes mean stands in a DBC file of the vehicle or sensor: `truerate channels {} --dbc FILE.dbc` lists the \
             signals, with a map.",
            report::shell_word(name)
        );
    }
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
    let is_named = |begin: &str| {
        let picks = look.proposal.chosen.iter().map(|pick| pick.name.as_str());
        picks.chain(look.own.iter().map(String::as_str)).any(|name| name.starts_with(begin))
    };
    if look.has_no_channel() {
        let _ = writeln!(
            out,
            "\nno channel can be read: is the DBC file that of this bus? `truerate channels {}` lists the identifiers that came",
            report::shell_word(name)
        );
    } else if frames.is_empty() {
        let lacks = match (is_named("gyro_"), is_named("ref_")) {
            (true, true) => "",
            (true, false) => {
                "no name says what the reference is: name it (`--map ref_angle_z=CHANNEL`, `ref_rate_z`, `ref_q`), or give its file with `--reference FILE`"
            }
            (false, true) => "no name says what the gyro is: name it, such as `--map gyro_z=CHANNEL`",
            (false, false) => {
                "no name says what gyro and reference are: name them, such as `--map gyro_z=CHANNEL --map ref_angle_z=CHANNEL`; a reference in \
                another file is given with `--reference FILE`"
            }
        };
        if !lacks.is_empty() {
            let _ = writeln!(out, "\n{lacks}");
        }
    }
    let is_chosen = |of: &&Dependent| look.proposal.chosen.iter().any(|pick| pick.channel.starts_with(&of.channel));
    let mut said = Vec::new();
    for of in look.proposal.dependent.iter().filter(is_chosen) {
        if !said.contains(&of.by) {
            said.push(of.by);
            let _ = writeln!(out, "\n{} is no reference for this gyro: {} computed it from it", of.channel, of.by);
        }
    }
    if let Some(others) = log::dependent::others(&look.proposal.seconds) {
        let _ = writeln!(out, "\n{others}");
    }
    out
}

/// The frames of a CAN log that nothing is said of: an identifier each, those of 11 bits first.
fn identifiers(survey: &Survey) -> Vec<&Surveyed> {
    let mut frames: Vec<&Surveyed> = survey.topics.iter().filter(|of| of.topic.kind == can::UNNAMED).collect();
    frames.sort_by_key(|of| (bits(of), of.topic.name.as_str()));
    frames
}

/// Bits of a frame's identifier, which is shown with eight digits where it has 29, behind the bus if that is another.
fn bits(of: &Surveyed) -> u8 {
    let digits = of.topic.name.rsplit("0x").next().map_or(0, str::len);
    if digits == 8 { 29 } else { 11 }
}

fn of_frames(frames: &[&Surveyed]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["identifier", "bits", "frames", "bytes", "rate", "span", "gaps"]);
    for of in frames {
        let Some(length) = of.fields.first() else { continue };
        let bytes = if length.low == length.high {
            format!("{}", length.low)
        } else {
            format!("{} to {}", length.low, length.high)
        };
        let (name, frames) = (of.topic.name.clone(), of.messages.to_string());
        table.add_row([name, bits(of).to_string(), frames, bytes, rate(of), span(of), gaps(of)]);
    }
    right(&mut table, 1);
    table
}

fn of_channels(survey: &Survey) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["channel", "unit", "values", "rate", "span", "gaps", "from", "to"]);
    for of in &survey.topics {
        for (field, range) in of.topic.fields.iter().zip(&of.fields).filter(|_| of.messages > 0) {
            let number = |x: f64| if x.is_finite() { format!("{x:.6}") } else { String::new() };
            table.add_row([
                of.topic.channel(field),
                field.unit.map_or("", |unit| unit.symbol).to_owned(),
                range.values.to_string(),
                rate(of),
                span(of),
                gaps(of),
                number(range.low),
                number(range.high),
            ]);
        }
    }
    right(&mut table, 2);
    table
}

fn rate(of: &Surveyed) -> String {
    of.rate_hz().map_or(String::new(), |rate| format!("{rate:.1} Hz"))
}

fn span(of: &Surveyed) -> String {
    format!("{:.1} s", seconds(of.last_ns.saturating_sub(of.first_ns)))
}

fn gaps(of: &Surveyed) -> String {
    let (count, longest) = of.gaps();
    if count > 0 { format!("{count}, up to {:.2} s", seconds(longest)) } else { "none".to_owned() }
}

/// Numbers stand at the right.
fn right(table: &mut Table, from: usize) {
    for column in from..table.column_count() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

fn json(name: &str, look: &Look) -> Value {
    let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    let frames = identifiers(&look.survey);
    let identifiers = frames.iter().map(|of| {
        let (gaps, longest) = of.gaps();
        let length = of.fields.first().map_or([f64::NAN; 2], |length| [length.low, length.high]);
        json!({
            "identifier": of.topic.name,
            "bits": bits(of),
            "frames": of.messages,
            "bytes": length.map(finite),
            "rate_hz": of.rate_hz(),
            "from_s": seconds(of.first_ns),
            "span_s": seconds(of.last_ns.saturating_sub(of.first_ns)),
            "gaps": gaps,
            "longest_gap_s": if gaps > 0 { json!(seconds(longest)) } else { Value::Null },
        })
    });
    let named = look.survey.topics.iter().filter(|of| of.topic.kind != can::UNNAMED);
    let channels = named.flat_map(|of: &Surveyed| {
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
                "span_s": seconds(of.last_ns.saturating_sub(of.first_ns)),
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
        "identifiers": identifiers.collect::<Vec<_>>(),
        "map": strings(&look.proposal.chosen),
        "likely": strings(&look.proposal.offered),
        "dependent": look.proposal.dependent.iter().map(|d| json!({"channel": d.channel, "by": d.by})).collect::<Vec<_>>(),
        "seconds": look.proposal.seconds.iter().map(|of| json!({"topic": of.topic, "rate_hz": finite(of.rate_hz), "map": strings(&of.picks)})).collect::<Vec<_>>(),
        "notes": look.survey.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
