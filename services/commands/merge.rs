//! `truerate merge`: evidence files put together.

use crate::commands::{print, subject::writable};
use anyhow::Result;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::{evidence::Evidence, output};

/// What `truerate merge` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate merge a.evidence b.evidence -o fleet.evidence
      both together; a log that is in both counts once
  truerate merge fleet.evidence c.evidence -o fleet.evidence
      one more

The result depends on the logs alone: files may be merged in any order, in any groups and on any
machine, and give the same bytes. A file that is damaged or of a newer version is refused by its
name, and nothing is written.")]
pub struct Args {
    /// Evidence files, of `truerate evidence` or `truerate merge`
    #[arg(value_name = "E", required = true, num_args = 1..)]
    files: Vec<PathBuf>,
    /// The file to write, or `-` for standard output; it may be one of those that are read
    #[arg(short, long, value_name = "F")]
    output: PathBuf,
}

/// Reads all, and writes one.
///
/// # Errors
/// A file that is refused, two that say different things of one log, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    writable(&args.output, &[])?;
    let all = args.files.iter().map(|path| Evidence::read(path)).collect::<Result<Vec<_>>>()?;
    let (merged, twice) = Evidence::merge(all)?;
    let text = merged.render()?;
    output::write(&args.output, text.as_bytes())?;
    if args.output != Path::new("-") {
        let again = if twice > 0 { format!("; {twice} came more than once and count once") } else { String::new() };
        let word = if merged.logs.len() == 1 { "log" } else { "logs" };
        let kb = text.len().div_ceil(1000);
        print(&format!("{}: {} {word}, {kb} kB{again}\n", args.output.display(), merged.logs.len()))?;
    }
    Ok(ExitCode::SUCCESS)
}
