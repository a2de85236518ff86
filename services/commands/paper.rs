//! `truerate paper`: the paper's experiment and its seven figures, each number beside the printed one.

use crate::commands::print;
use anyhow::{Context, Result};
use gyro_model::paper::reproduce;
use std::{fs, path::PathBuf, process::ExitCode};
use workbench::{output, plot};

mod figures;
mod numbers;
mod page;

/// What `truerate paper` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate paper -o paper        writes paper/index.html and its seven figures, prints the numbers")]
pub struct Args {
    /// The folder for the page and its figures
    #[arg(short, long, value_name = "DIR", default_value = "paper")]
    pub output: PathBuf,
    /// The seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// Runs the experiment, writes figures and page, prints the numbers.
///
/// # Errors
/// The folder cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let folder = &args.output;
    fs::create_dir_all(folder)
        .with_context(|| format!("{}: this folder cannot be made: choose another with -o", folder.display()))?;
    let reproduction = reproduce(args.seed);
    let figures = figures::all(&reproduction)
        .into_iter()
        .map(|(number, figure, caption)| Ok((number, plot::svg(&figure)?, caption)))
        .collect::<Result<Vec<_>, plot::PlotError>>()?;
    for (number, svg, _) in &figures {
        output::write(&folder.join(format!("figure-{number}.svg")), svg.as_bytes())?;
    }
    let numbers = numbers::all(&reproduction);
    let page = folder.join("index.html");
    output::write(&page, page::html(&numbers, &figures, args.seed).as_bytes())?;
    print(&format!("{}\nFigures 4–10 and these numbers: {}", numbers::table(&numbers), page.display()))?;
    Ok(ExitCode::SUCCESS)
}
