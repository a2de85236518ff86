//! `truerate top`: what runs, and every stage's latency, live in the terminal.

use crate::top;
use std::process::ExitCode;

/// What `truerate top` takes.
#[derive(clap::Args, Debug, Clone)]
pub struct Args {
    /// The name of the pipeline
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}

/// Shows it until `q` is pressed.
///
/// # Errors
/// Where no such pipeline runs, or standard output is no terminal.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    top::run(&args.instance)?;
    Ok(ExitCode::SUCCESS)
}
