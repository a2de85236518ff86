//! The command line: every command, and the exit code.

use crate::commands;
use anyhow::Error;
use clap::{CommandFactory, Parser, Subcommand};
use signal_hook::consts::SIGXFSZ;
use std::{
    env,
    ffi::OsString,
    io::{self, IsTerminal},
    process::ExitCode,
    sync::Arc,
};
use tracing_subscriber::EnvFilter;
use workbench::words;

/// Finds and corrects the errors of a low-cost gyro.
///
/// It compares the gyro with a reference, names the physical effect that its model lacks, and
/// compensates the rate, on a log or live.
#[derive(Parser, Debug)]
#[command(
    name = "truerate",
    version,
    max_term_width = 100,
    propagate_version = false,
    after_help = "Start with `truerate diagnose LOG`, or `truerate simulate -o log.csv.gz` if you have no log yet.",
    after_long_help = "\
The usual steps:
  truerate simulate --hide delay -o log.csv.gz     a log to try things on, with its true model
  truerate fit log.csv.gz -o model.toml            scale factor and bias
  truerate diagnose log.csv.gz                     which physical effect is missing
  truerate ladder log.csv.gz -o model.toml         add what is missing until nothing is
  truerate apply log.csv.gz --model model.toml -o compensated.csv

LOG is CSV, plain or .gz, or `-` for standard input: a header row with `t` (s) and any of
  gyro_x gyro_y gyro_z                 rad/s, at least one
  ref_angle_x …                        rad, shaft encoder of that axis
  ref_rate_x …                         rad/s, a reference that gives rate
  ref_qw ref_qx ref_qy ref_qz          reference orientation, body to world
  accel_x …, temp, supply              m/s², °C, V
A suffix gives another unit: gyro_x_dps, ref_angle_x_deg, accel_x_g, temp_f, t_ns, supply_mv. An
empty field or `nan` means no value. Logs of other programs are read too. Where their names are
not clear, `--map NAME=CHANNEL` names a channel; `truerate channels LOG` lists the channels.

Exit codes: 0 done; 1 failed, one line on standard error; 2 wrong usage; 3 `diagnose --fail-on`, or
a `guide` that ended before its log was sufficient.
TRUERATE_LOG=info (or debug, truerate=trace, …) shows more on standard error."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Every command. A new one is a variant here and an arm in [`Command::run`]; its `Args` and `run` live in its own file
/// under `commands/`.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Record a log with instructions for the next motion, until the log is sufficient
    Guide(commands::guide::Args),
    /// Fit the base model: scale factor and bias
    Fit(commands::fit::Args),
    /// Compare a model with the measurements, and show where it fails
    Compare(commands::compare::Args),
    /// Find out which physical effect is missing
    Diagnose(commands::diagnose::Args),
    /// Add effects to a model, refit it, and show before and after
    Add(commands::add::Args),
    /// Remove effects from a model, refit it, and show before and after
    Remove(commands::remove::Args),
    /// Diagnose and add effects until nothing is missing
    Ladder(commands::ladder::Args),
    /// Reduce logs to what they say: an evidence file, to be merged with others
    Evidence(commands::evidence::Args),
    /// Put evidence files together
    Merge(commands::merge::Args),
    /// Show what many logs say together: of types, of parts, of changes in time
    Fleet(commands::fleet::Args),
    /// Compensate a log with the same filter that runs live
    Apply(commands::apply::Args),
    /// Export a model: C header, Kalibr, ROS, Autoware, OpenVINS, ArduPilot, PX4, INAV, JSON
    Export(commands::export::Args),
    /// Show the channels of a file, and propose a map to the names of a log
    Channels(commands::channels::Args),
    /// Simulate a log whose true model is written beside it
    Simulate(commands::simulate::Args),
    /// Show the catalogue of physical effects, or one effect of it
    Effects(commands::effects::Args),
    /// Reproduce the paper behind this project: its seven figures, each number beside the published one
    Paper(commands::paper::Args),
    /// Demonstrate it: a simulated vehicle with a hidden effect, found and corrected while it drives
    Demo(commands::demo::Args),
    /// Run the supervised processes of the pipeline on a live source or a log
    Run(commands::run::Args),
    /// Run one process of a pipeline
    Service(commands::service::Args),
    /// Show what runs, and the latency of every stage
    Status(commands::status::Args),
    /// Change the model or the source of a running pipeline
    Control(commands::control::Args),
    /// Watch a running pipeline in the terminal, and add what is missing
    Top(commands::top::Args),
    /// Measure the latency from process to process on this machine, beside sockets and pipes
    Bench(commands::bench::Args),
    /// Print the completions of commands and flags for a shell
    Completions(commands::completions::Args),
    /// Write the manual pages to a folder
    Man(commands::man::Args),
}

impl Command {
    /// Runs the command.
    ///
    /// # Errors
    /// What went wrong, where, and what to do, as a chain that reads as one line.
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        match self {
            Self::Guide(args) => commands::guide::run(args),
            Self::Fit(args) => commands::fit::run(args),
            Self::Compare(args) => commands::compare::run(args),
            Self::Diagnose(args) => commands::diagnose::run(args),
            Self::Add(args) => commands::add::run(args),
            Self::Remove(args) => commands::remove::run(args),
            Self::Ladder(args) => commands::ladder::run(args),
            Self::Evidence(args) => commands::evidence::run(args),
            Self::Merge(args) => commands::merge::run(args),
            Self::Fleet(args) => commands::fleet::run(args),
            Self::Apply(args) => commands::apply::run(args),
            Self::Export(args) => commands::export::run(args),
            Self::Channels(args) => commands::channels::run(args),
            Self::Simulate(args) => commands::simulate::run(args),
            Self::Effects(args) => commands::effects::run(args),
            Self::Paper(args) => commands::paper::run(args),
            Self::Demo(args) => commands::demo::run(args),
            Self::Run(args) => commands::run::run(args),
            Self::Service(args) => commands::service::run(args),
            Self::Status(args) => commands::status::run(args),
            Self::Control(args) => commands::control::run(args),
            Self::Top(args) => commands::top::run(args),
            Self::Bench(args) => commands::bench::run(args),
            Self::Completions(args) => commands::completions::run(args, Cli::command()),
            Self::Man(args) => commands::man::run(args, Cli::command()),
        }
    }
}

/// Parses the command line, runs the command, and turns what came of it into an exit code.
#[must_use]
pub fn enter() -> ExitCode {
    let cli = Cli::parse_from(joined(env::args_os()));
    words::answer_to(env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect());
    // A file that outgrows the limit of its size is an error of the write, and no reason to be killed.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    let filter = EnvFilter::try_from_env("TRUERATE_LOG").unwrap_or_else(|_| EnvFilter::new("error,truerate=warn"));
    // A process whose standard error has gone (its supervisor's terminal, say) works on in silence.
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .log_internal_errors(false)
        .init();
    match cli.command.run() {
        Ok(code) => code,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("truerate: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The words of a command line, `--explain full` as the one word `--explain=full`: what follows `--explain` otherwise is the log.
pub fn joined(words: impl Iterator<Item = OsString>) -> impl Iterator<Item = OsString> {
    let mut words = words.peekable();
    std::iter::from_fn(move || {
        let word = words.next()?;
        let is_full = word == "--explain" && words.next_if(|next| next == "full").is_some();
        Some(if is_full { "--explain=full".into() } else { word })
    })
}

/// Whether whoever read our standard output has left (`truerate … | head`): not a failure of ours.
fn is_broken_pipe(error: &Error) -> bool {
    error.chain().filter_map(|cause| cause.downcast_ref::<io::Error>()).any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn what_several_commands_take_is_written_alike() {
        for (command, rest) in [("run", &[][..]), ("simulate", &["-o", "log.csv"])] {
            let words = ["truerate", command, "--hide", "delay", "lag:tau=0.01", "--hide", "bias"];
            let parsed = Cli::try_parse_from(words.iter().chain(rest)).unwrap().command;
            let hide = match parsed {
                Command::Run(args) => args.hide,
                Command::Simulate(args) => args.hide,
                other => panic!("{other:?}"),
            };
            assert_eq!(hide, ["delay", "lag:tau=0.01", "bias"], "{command}");
        }
        for command in Cli::command().get_subcommands() {
            for output in command.get_arguments().filter(|a| a.get_short() == Some('o')) {
                assert_eq!(output.get_long(), Some("output"), "{}", command.get_name());
            }
        }
    }

    #[test]
    fn what_follows_explain_is_its_value_or_the_log() {
        let parsed = |line: &str| match Cli::parse_from(joined(line.split(' ').map(Into::into))).command {
            Command::Diagnose(args) => args,
            other => panic!("{other:?}"),
        };
        for line in ["truerate diagnose --explain full log.csv", "truerate diagnose log.csv --explain full"] {
            assert!(format!("{:?}", parsed(line)).contains("explain: Some(Full)"), "{line}");
        }
        let line = "truerate diagnose --explain log.csv";
        assert!(format!("{:?}", parsed(line)).contains("explain: Some(Plain)"), "{line}");
    }

    #[test]
    fn every_command_and_flag_explains_itself() {
        for command in Cli::command().get_subcommands() {
            assert!(command.get_about().is_some(), "`{}` says nothing about itself", command.get_name());
            for argument in command.get_arguments().filter(|a| a.get_id() != "help") {
                assert!(argument.get_help().is_some(), "`{} {}` says nothing", command.get_name(), argument.get_id());
            }
        }
    }
}
