//! The one program. It only enters; `truerate::cli` does the rest.

use std::process::ExitCode;

fn main() -> ExitCode {
    truerate::cli::enter()
}
