//! `truerate status`: what runs, and every stage's latency, once.

use clap::ValueEnum;

/// What `truerate status` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate status
  truerate status --format json --instance left-wheel")]
pub struct Args {
    /// What is printed to standard output
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
    /// The pipeline that is meant
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
