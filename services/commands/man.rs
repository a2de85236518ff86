//! `truerate man`: the manual, one page for the program and one for each command.

use super::print;
use anyhow::Context;
use clap::Command;
use clap_mangen::{
    Man,
    roff::{Roff, roman},
};
use std::{
    fs, io,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// What `truerate man` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate man man1
      writes man1/truerate.1, man1/truerate-diagnose.1, … read one: man -l man1/truerate-diagnose.1")]
pub struct Args {
    /// The folder to write the pages to; made where it is not there
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

/// Writes the pages of this program.
///
/// # Errors
/// A folder that cannot be made or written to.
pub fn run(args: &Args, program: Command) -> anyhow::Result<ExitCode> {
    let folder = args.folder.display();
    let mut program = program.disable_help_subcommand(true);
    program.build();
    fs::create_dir_all(&args.folder)
        .and_then(|()| write_pages(&program, &args.folder))
        .with_context(|| format!("{folder}: the manual cannot be written; name a folder of your own"))?;
    print(&format!("manual written: man -l {folder}/truerate.1"))?;
    Ok(ExitCode::SUCCESS)
}

/// The page of a command, and those of its own commands.
fn write_pages(command: &Command, folder: &Path) -> io::Result<()> {
    for below in command.get_subcommands().filter(|below| !below.is_hide_set()) {
        write_pages(below, folder)?;
    }
    let page = Man::new(command.clone()).source(concat!("truerate ", env!("CARGO_PKG_VERSION")));
    fs::write(folder.join(page.get_filename()), text_of(&page, command)?)
}

/// clap's own sections, but for the examples: their lines stay as they stand.
fn text_of(page: &Man, command: &Command) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    page.render_title(&mut text)?;
    page.render_name_section(&mut text)?;
    page.render_synopsis_section(&mut text)?;
    page.render_description_section(&mut text)?;
    page.render_options_section(&mut text)?;
    if command.has_subcommands() {
        page.render_subcommands_section(&mut text)?;
    }
    if let Some(more) = command.get_after_long_help().map(ToString::to_string) {
        let (heading, body) = more.strip_prefix("Examples:\n").map_or(("NOTES", &*more), |rest| ("EXAMPLES", rest));
        let mut section = Roff::new();
        section.control("SH", [heading]).control("nf", []);
        body.lines().for_each(|line| _ = section.text([roman(line)]));
        section.control("fi", []).to_writer(&mut text)?;
    }
    Ok(text)
}
