//! `truerate fleet`: what many logs of many sensors say together.

use crate::{arguments::ReportArgs, commands::subject::writable, progress::Progress};
use anyhow::Result;
use std::{path::PathBuf, process::ExitCode};
use workbench::{
    fleet::{self, Fleet},
    output,
    report::Terminal,
};

/// What `truerate fleet` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate fleet fleet.evidence
      types, parts that are not of their type, changes in time
  truerate fleet fleet.evidence --report fleet.html
      with forest and caterpillar plots
  truerate fleet fleet.evidence --format json
      for programs
  truerate fleet fleet.evidence --export type.toml
      the means and spreads of the types, for new parts

Each effect has a mean of the type, a spread between its parts, and an interval in which the next
part lies (95 %). Outliers are named at a false discovery rate of 5 % and left out of their type.")]
pub struct Args {
    /// An evidence file, of `truerate merge` or `truerate evidence`
    #[arg(value_name = "F")]
    file: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
    /// Write the types with their means and spreads to this file
    #[arg(long, value_name = "type.toml")]
    export: Option<PathBuf>,
}

/// Computes and prints.
///
/// # Errors
/// A file that is refused, or one that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.report.check(&[&args.file])?;
    if let Some(path) = &args.export {
        writable(path, &[&args.file])?;
    }
    let fleet = {
        let _spinner = Progress::spinner("adding up");
        Fleet::read(&args.file)?
    };
    if let Some(path) = &args.export {
        output::write(path, fleet::type_file::render(&fleet).as_bytes())?;
    }
    let name = args.file.display().to_string();
    args.report.emit(args.export.as_deref(), |format, file| {
        let terminal = if file { Terminal::PLAIN } else { Terminal::detect() };
        fleet.render(&name, format, terminal)
    })?;
    Ok(ExitCode::SUCCESS)
}
