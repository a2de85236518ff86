//! `truerate control`: changes the model of a running pipeline.

use super::print;
use crate::clock::now_ns;
use crate::{ask::ask, domain};
use anyhow::{Context, bail};
use clap::Subcommand;
use gyro_model::Axis;
use ipc_types::{
    Command, Text,
    command::{ARGUMENT, Kind},
    port::Hub,
};
use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// What `truerate control` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate control add g-sensitivity --axis x
  truerate control undo
  truerate control save model.toml
  truerate control hide delay:d=0.012")]
pub struct Args {
    /// What to change
    #[command(subcommand)]
    pub request: Request,
    /// The name of the pipeline
    #[arg(long, value_name = "NAME", default_value = "default", global = true)]
    pub instance: String,
}

/// A change to a running pipeline.
#[derive(Subcommand, Debug, Clone)]
pub enum Request {
    /// Add an effect to the model of one axis
    ///
    /// Both models learn from the same samples. The new one takes over when its error on data that it did not learn from is
    /// significantly smaller: its effect is four standard errors from zero, or the error falls clearly. Otherwise it is given
    /// up after two minutes. `undo` ends the trial, or takes the effect out again.
    Add {
        /// Effect id
        effect: String,
        /// The axis
        #[arg(long, value_name = "x|y|z")]
        axis: Axis,
        /// A model file with the `[effect.NAME]` section of a user's own effect
        #[arg(long, value_name = "F")]
        file: Option<PathBuf>,
    },
    /// Take an effect out of the model of one axis
    Remove {
        /// Effect id
        effect: String,
        /// The axis
        #[arg(long, value_name = "x|y|z")]
        axis: Axis,
    },
    /// Return to the model before the last change
    Undo,
    /// Stop learning
    Pause,
    /// Go on learning
    Resume,
    /// Forget what was learned from the samples so far
    Forget,
    /// Save the model to a file
    Save {
        /// The model file to write
        #[arg(value_name = "F")]
        file: PathBuf,
    },
    /// Switch an effect on in the simulated or replayed source
    Hide {
        /// The effect, at its typical size or with these values
        #[arg(value_name = "ID[:NAME=VALUE,…]")]
        effect: String,
    },
}

/// Sends the command and prints the answer.
///
/// # Errors
/// Where no such pipeline runs, nobody answers, or the command is refused.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let command = command(&args.request)?;
    let domain = domain::existing(&args.instance)?;
    let hub = Hub::join(&domain, "control")?;
    let reply = ask(&hub, command).with_context(|| format!("pipeline '{}'", args.instance))?;
    if reply.done == 0 {
        bail!("{}", reply.says);
    }
    print(&format!("{} (epoch {})", reply.says, reply.epoch))?;
    Ok(ExitCode::SUCCESS)
}

/// The command as a message.
fn command(request: &Request) -> anyhow::Result<Command> {
    let every_axis = Axis::ALL.len() as u32;
    let of_axis = |axis: &Axis| axis.index() as u32;
    let (kind, axis, effect, argument) = match request {
        Request::Add { effect, axis, file } => {
            let text = file.as_deref().map(own_effects).transpose()?.unwrap_or_default();
            (Kind::Add, of_axis(axis), effect.as_str(), text)
        }
        Request::Remove { effect, axis } => (Kind::Remove, of_axis(axis), effect.as_str(), String::new()),
        Request::Undo => (Kind::Undo, every_axis, "", String::new()),
        Request::Pause => (Kind::Pause, every_axis, "", String::new()),
        Request::Resume => (Kind::Resume, every_axis, "", String::new()),
        Request::Forget => (Kind::Forget, every_axis, "", String::new()),
        Request::Save { file } => {
            let path = std::path::absolute(file).context("the current folder")?;
            (Kind::Save, every_axis, "", path.to_str().context("the file's path is not UTF-8")?.to_owned())
        }
        Request::Hide { effect } => {
            let (id, values) = effect.split_once(':').unwrap_or((effect, ""));
            (Kind::Hide, every_axis, id, values.to_owned())
        }
    };
    Ok(Command {
        id: now_ns() ^ (u64::from(std::process::id()) << 40),
        kind: kind as u32,
        axis,
        at_once: 0,
        effect: Text::whole(effect).with_context(|| format!("'{effect}' is too long for an effect's id"))?,
        argument: Text::whole(&argument).with_context(|| {
            let what = match request {
                Request::Add { file: Some(file), .. } => format!("{}: its effects are", file.display()),
                Request::Save { file } => format!("{}: the whole path is", file.display()),
                _ => format!("the values of {effect} are"),
            };
            format!("{what} {} bytes long, and a command holds {ARGUMENT}: make that shorter", argument.len())
        })?,
    })
}

/// The user's own effects of a model file, as a model file without anything else.
fn own_effects(path: &Path) -> anyhow::Result<String> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let mut table: toml::Table = text.parse().with_context(|| path.display().to_string())?;
    table.retain(|key, _| key == "effect" || key == "schema" || key == "epoch");
    if !table.contains_key("effect") {
        bail!("{}: there is no [effect.NAME] in it", path.display());
    }
    table.entry("schema").or_insert_with(|| workbench::model_file::SCHEMA.into());
    table.entry("epoch").or_insert_with(|| 0.into());
    Ok(toml::to_string(&table)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_says_what_was_asked() {
        let add = Request::Add { effect: "delay".into(), axis: Axis::Z, file: None };
        let command = command(&add).unwrap();
        assert_eq!((command.kind, command.axis, command.effect.as_str()), (Kind::Add as u32, 2, "delay"));
        let hide = super::command(&Request::Hide { effect: "delay:d=0.01".into() }).unwrap();
        assert_eq!((hide.effect.as_str(), hide.argument.as_str()), ("delay", "d=0.01"));
        let long = super::command(&Request::Hide { effect: format!("delay:d={}", "1".repeat(2000)) }).unwrap_err();
        assert_eq!(
            long.to_string(),
            "the values of delay are 2002 bytes long, and a command holds 1022: make that shorter"
        );
    }

    #[test]
    fn only_the_effects_of_a_file_are_sent() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        let own = "[effect.twist]\nregressor = \"k * sin(angle)\"\nparameters = { k = { unit = \"rad/s\", typical = 1e-4 } }\n";
        fs::write(&path, own).unwrap();
        let sent = own_effects(&path).unwrap();
        let file = workbench::model_file::parse(Path::new("sent"), &sent, &[]).unwrap();
        assert_eq!(file.own_effects.len(), 1);
        fs::write(&path, "epoch = 3\n").unwrap();
        assert!(own_effects(&path).is_err());
    }
}
