//! `truerate demo`: the main job in one go.

use std::path::PathBuf;

/// What `truerate demo` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate demo                       a simulated vehicle with an effect hidden at random; says what to look at
  truerate demo --auto --seed 7       plays the whole loop by itself, to the terminal
  truerate demo --log log.csv.gz      the same on a recording")]
pub struct Args {
    /// Use this recording in place of the simulated vehicle
    #[arg(long, value_name = "LOG")]
    pub log: Option<PathBuf>,
    /// Play the whole loop to the terminal: compare, diagnose, add, see the error fall
    #[arg(long)]
    pub auto: bool,
    /// Which vehicle and which hidden effect; without it one at random
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// The name of this pipeline: several of different names run side by side
    #[arg(long, value_name = "NAME", default_value = "demo")]
    pub instance: String,
}
