//! `truerate completions`: what a shell needs to complete our commands and flags.

use super::print;
use clap::Command;
use clap_complete::Shell;
use std::process::ExitCode;

/// What `truerate completions` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate completions bash > truerate.bash
      then: . ./truerate.bash, or keep it as /etc/bash_completion.d/truerate
  truerate completions zsh > _truerate
      in a folder of zsh's fpath
  truerate completions fish > truerate.fish
      in ~/.config/fish/completions/")]
pub struct Args {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Prints the completions of this program.
///
/// # Errors
/// Where standard output cannot be written.
pub fn run(args: &Args, mut program: Command) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "truerate", &mut script);
    print(&String::from_utf8(script)?)?;
    Ok(ExitCode::SUCCESS)
}
