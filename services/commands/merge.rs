//! `truerate merge`: evidence files put together.

use crate::commands::{print, subject::writable};
use anyhow::Result;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::evidence::merge;

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
    let merged = merge(&args.files, &args.output)?;
    if args.output != Path::new("-") {
        let again = match merged.twice {
            0 => String::new(),
            twice => format!("; {twice} came more than once and count once"),
        };
        let word = if merged.logs == 1 { "log" } else { "logs" };
        let kb = merged.bytes.div_ceil(1000);
        print(&format!("{}: {} {word}, {kb} kB{again}\n", args.output.display(), merged.logs))?;
    }
    Ok(ExitCode::SUCCESS)
}
