//! `truerate add`: a model with more effects, refitted, before and after.

use super::change::{self, Direction};
use anyhow::Result;
use std::process::ExitCode;

/// What `truerate add` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate add log.csv.gz delay -o late.toml                     the base model and a delay
  truerate add log.csv.gz g-sensitivity lag --axis x --model late.toml -o new.toml

Both models are refitted to the log and judged on data that the fit did not use.")]
pub struct Args {
    #[command(flatten)]
    change: change::ChangeArgs,
}

/// Adds, refits, prints.
///
/// # Errors
/// As [`change::run`].
pub fn run(args: &Args) -> Result<ExitCode> {
    change::run(&args.change, Direction::Add)
}
