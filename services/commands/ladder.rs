//! `truerate ladder`: diagnose and add until nothing is missing.

use crate::{
    arguments::{LogsArgs, ReportArgs, SearchArgs, StartArgs},
    commands::subject,
};
use anyhow::{Result, ensure};
use gyro_model::{
    Axis, diagnose,
    diagnosis::{ErrorPoint, LadderStep},
    headline,
};
use std::{
    path::PathBuf,
    process::ExitCode,
    sync::{Mutex, PoisonError},
};
use workbench::{
    prior,
    report::{self, Command, Format, units},
    subject::Subject,
};

/// What `truerate ladder` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate ladder log.csv.gz -o model.toml                 from the base model up
  truerate ladder log.csv.gz --model model.toml -o new.toml
  truerate ladder log.csv.gz new.csv.gz -o model.toml      one model of several logs of one sensor
  truerate ladder log.csv.gz --axis x --report page.html   with charts of every step
  truerate ladder log.csv.gz --open                        the same, in a browser
  truerate ladder log.csv.gz --budget 30                   the best model that 30 s find

Each step adds the effect that removes most of the held-out error and refits the model. At the end,
effects that are no longer needed are removed. It stops at the floor, the error that noise alone
leaves, or says what error is left and where.")]
pub struct Args {
    #[command(flatten)]
    log: LogsArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    search: SearchArgs,
    #[command(flatten)]
    report: ReportArgs,
    /// The final model to write
    #[arg(short, long, value_name = "NEW")]
    output: Option<PathBuf>,
}

/// Climbs, prints, writes the final model.
///
/// # Errors
/// A refused log or model, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.report.check_with_all(&args.log.paths(), args.output.as_deref())?;
    if args.log.are_several() {
        ensure!(args.start.prior.is_none(), "--prior is for one log of a new part: give one log");
        return run_all(args);
    }
    let log = args.log.first();
    let subject = subject::read(&log, args.start.axis)?;
    let (start, says) = subject::begun(&subject, &args.start)?;
    let (file, mut ladder) = subject::search("climbing", &args.search, &subject.faults, |spinner, options| {
        let before: Mutex<[Vec<ErrorPoint>; 3]> = Mutex::default();
        let took = |axis: Axis, step: &LadderStep| {
            if args.report.format == Format::Text {
                let mut all = before.lock().unwrap_or_else(PoisonError::into_inner);
                let before = std::mem::replace(&mut all[axis.index()], step.error_curve.clone());
                spinner.line(&told(axis, step, &before));
            }
        };
        subject.ladder(&start, &diagnose::Options { took: &took, ..*options })
    })?;
    prior::say_beside(&mut ladder.axes, &says);
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context = subject::context(
        &subject,
        Command::Ladder,
        &log,
        args.start.axis,
        args.start.model.as_deref(),
        args.output.as_deref(),
    );
    context.product = Subject::product(&file, args.output.as_deref());
    context.explained = subject::explained(&args.search);
    context.unfinished = ladder.axes.iter().any(|axis| axis.unfinished);
    args.report.give(args.output.as_deref(), context, |format, context| report::render(&ladder, format, context))?;
    Ok(ExitCode::SUCCESS)
}

fn run_all(args: &Args) -> Result<ExitCode> {
    let several = subject::read_all(&args.log, args.start.axis)?;
    let start = several.start(args.start.model.as_deref())?;
    let (file, ladder) = subject::search("climbing", &args.search, &[], |_, options| several.ladder(&start, options))?;
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context = subject::context_of_all(
        &several,
        Command::Ladder,
        &args.log,
        args.start.axis,
        args.start.model.as_deref(),
        args.output.as_deref(),
    );
    context.product = Subject::product(&file, args.output.as_deref());
    context.explained = subject::explained(&args.search);
    context.unfinished = ladder.axes.iter().any(|axis| axis.unfinished);
    args.report.give(args.output.as_deref(), context, |format, context| report::render(&ladder, format, context))?;
    Ok(ExitCode::SUCCESS)
}

/// A step, as it is told when it is taken: what it has won, or the error where it has won nothing.
fn told(axis: Axis, step: &LadderStep, before: &[ErrorPoint]) -> String {
    let what = match (&step.added, &step.removed) {
        (Some(added), Some(removed)) => format!("{added} in the place of {removed}"),
        (Some(added), None) => format!("+ {added}"),
        (None, Some(removed)) => format!("- {removed}"),
        (None, None) => "start".to_owned(),
    };
    let error = || {
        headline::said(&step.error_curve).map_or_else(
            || "error not known".to_owned(),
            |point| format!("error over {} {} °/s", units::time(point.tau_s), units::rate(point.error)),
        )
    };
    let error = headline::gain(before, &step.error_curve).unwrap_or_else(error);
    format!("axis {axis}  {what:<32}  {error}")
}
