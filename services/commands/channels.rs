//! `truerate channels`: what a file holds, and a map to the names of a log.

use crate::commands::print;
use anyhow::Result;
use clap::ValueEnum;
use comfy_table::{CellAlignment, Table, presets};
use gyro_model::words::shell_word;
use log_readers::{
    meaning::Dependent,
    survey::{Survey, Surveyed},
};
use std::{fmt::Write, path::PathBuf, process::ExitCode, slice};
use workbench::{
    log::{self, Look, channels},
    words::typed,
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
channels under `map` are used without it; those under `likely` have to be chosen with it.
  --map gyro_z_dps=gz/131                 131 counts a °/s
  --map ref_rpy_deg=roll,pitch,yaw        an orientation by its angles
  --map ref_r=R                           by its rotation matrix: R00 … R22, or R_0 … R_8
  --map t_us='sum(dt_us)'                 a column with the time from row to row
  --map t=0.01*row                        no time: 100 rows a second")]
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
        Form::Json => print(&serde_json::to_string_pretty(&channels::json(&name, &look))?)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn text(name: &str, look: &Look) -> String {
    let mut out = format!("{name}: {}\n", look.format);
    let frames = channels::identifiers(&look.survey);
    let table = if frames.is_empty() { of_channels(&look.survey) } else { of_frames(&frames) };
    let _ = writeln!(out, "{}", table.trim_fmt());
    if !frames.is_empty() {
        let _ = writeln!(
            out,
            "\nWhat their bytes mean is defined in a DBC file of the vehicle or sensor: `truerate channels {} --dbc FILE.dbc` lists the \
             signals, with a map.",
            shell_word(name)
        );
    }
    let empty = look.survey.topics.iter().filter(|of| of.messages == 0).map(|of| of.topic.name.as_str());
    let empty: Vec<&str> = empty.filter(|name| !name.is_empty()).collect();
    if !empty.is_empty() {
        let _ = writeln!(out, "topics that have no message: {}", empty.join(", "));
    }
    for note in &look.survey.notes {
        let _ = writeln!(out, "{note}");
    }
    if !look.own.is_empty() {
        let _ = writeln!(out, "\nnames of a log already: {}", look.own.join(", "));
    }
    for (title, picks) in [("map", &look.proposal.chosen), ("likely", &look.proposal.offered)] {
        if !picks.is_empty() {
            let flags: Vec<String> = picks.iter().map(|pick| typed(slice::from_ref(pick))).collect();
            let _ = writeln!(out, "\n{title}:\n  {}", flags.join(" \\\n  "));
        }
    }
    if let Some(advice) = &look.advice {
        let flags = advice.flags.iter().map(|flag| format!("--map {}", shell_word(flag)));
        let file = advice.needs_file.then(|| "--reference REFERENCE.csv".to_owned());
        let flags: Vec<String> = flags.chain(file).chain(advice.at_rest.then(|| "--at-rest".to_owned())).collect();
        let _ = writeln!(out, "\nas a log:\n  {}\n{}", flags.join(" \\\n  "), advice.why);
    }
    let is_named = |begin: &str| {
        let picks = look.proposal.chosen.iter().map(|pick| pick.name.as_str());
        picks.chain(look.own.iter().map(String::as_str)).any(|name| name.starts_with(begin))
    };
    if look.has_no_channel() {
        let _ = writeln!(
            out,
            "\nno channel can be read: is the DBC file that of this bus? `truerate channels {}` lists the identifiers that came",
            shell_word(name)
        );
    } else if frames.is_empty() && look.advice.is_none() {
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
            let _ =
                writeln!(out, "\n{} cannot be a reference for this gyro: {} computed it from it", of.channel, of.by);
        }
    }
    if let Some(others) = log::dependent::others(&look.proposal.seconds) {
        let _ = writeln!(out, "\n{others}");
    }
    out
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
        table.add_row([name, channels::bits(of).to_string(), frames, bytes, rate(of), span(of), gaps(of)]);
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
                of.rate_of(range).map_or(String::new(), |rate| format!("{rate:.1} Hz")),
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
    format!("{:.1} s", channels::seconds(of.last_ns.saturating_sub(of.first_ns)))
}

fn gaps(of: &Surveyed) -> String {
    let (count, longest) = of.gaps();
    if count > 0 { format!("{count}, up to {:.2} s", channels::seconds(longest)) } else { "none".to_owned() }
}

/// Numbers stand at the right.
fn right(table: &mut Table, from: usize) {
    for column in from..table.column_count() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}
