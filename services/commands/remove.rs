//! `truerate remove`: a model with fewer effects, refitted, before and after.

use super::change::{self, Direction};
use anyhow::Result;
use std::process::ExitCode;

/// What `truerate remove` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate remove log.csv.gz delay --model model.toml -o without.toml

Both models are refitted to the log and judged on data that the fit did not use.")]
pub struct Args {
    #[command(flatten)]
    change: change::ChangeArgs,
}

/// Removes, refits, prints.
///
/// # Errors
/// As [`change::run`].
pub fn run(args: &Args) -> Result<ExitCode> {
    change::run(&args.change, Direction::Remove)
}
