//! `truerate paper`: the paper's experiment and its seven figures, each number beside the printed one.

use std::path::PathBuf;

/// What `truerate paper` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate paper -o paper        writes paper/index.html and its seven figures, prints the numbers")]
pub struct Args {
    /// The folder for the page and its figures
    #[arg(short, value_name = "DIR", default_value = "paper")]
    pub output: PathBuf,
    /// Which draw of the noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}
