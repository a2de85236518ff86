//! `truerate ladder`: diagnose and add until nothing is missing.

use crate::{
    arguments::{LogsArgs, ReportArgs, SearchArgs},
    commands::subject,
    deadline::Deadline,
    progress::Progress,
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
    /// The model to start from; without it the base model
    #[arg(long, value_name = "M")]
    model: Option<PathBuf>,
    /// Start from a type, as `truerate fleet F --export` writes it (FILE:TYPE where it holds several): a new part then needs
    /// seconds; a part that is not of the type is noticed, and not pulled to it
    #[arg(long, value_name = "type.toml", conflicts_with = "model")]
    prior: Option<PathBuf>,
    /// Only this axis
    #[arg(long, value_name = "x|y|z")]
    axis: Option<Axis>,
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
        ensure!(args.prior.is_none(), "--prior is for one log of a new part: give one log");
        return run_all(args);
    }
    let log = args.log.first();
    let subject = subject::read(&log, args.axis)?;
    let (start, says) = match &args.prior {
        Some(path) => subject::begin(&subject, path).map(|begun| (begun.start, begun.says))?,
        None => (subject::start(&subject, args.model.as_deref())?, Vec::new()),
    };
    let (file, mut ladder) = {
        let spinner = Progress::spinner("climbing");
        let progress = |what: &str| spinner.says(what);
        let deadline = Deadline::after(args.search.budget)?;
        let is_over = || deadline.is_over();
        let before: Mutex<[Vec<ErrorPoint>; 3]> = Mutex::default();
        let took = |axis: Axis, step: &LadderStep| {
            if args.report.format == Format::Text {
                let mut all = before.lock().unwrap_or_else(PoisonError::into_inner);
                let before = std::mem::replace(&mut all[axis.index()], step.error_curve.clone());
                spinner.line(&told(axis, step, &before));
            }
        };
        let options = diagnose::Options {
            explain: args.search.explain.is_some(),
            stop: &is_over,
            took: &took,
            ..subject::options(&subject, &progress)
        };
        subject.ladder(&start, &options)?
    };
    prior::say_beside(&mut ladder.axes, &says);
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context =
        subject::context(&subject, Command::Ladder, &log, args.axis, args.model.as_deref(), args.output.as_deref());
    context.product = Subject::product(&file, args.output.as_deref());
    context.explained = subject::explained(&args.search);
    context.unfinished = ladder.axes.iter().any(|axis| axis.unfinished);
    args.report
        .give(args.output.as_deref(), context, |format, context| report::render_ladder(&ladder, format, context))?;
    Ok(ExitCode::SUCCESS)
}

fn run_all(args: &Args) -> Result<ExitCode> {
    let several = subject::read_all(&args.log, args.axis)?;
    let start = several.start(args.model.as_deref())?;
    let (file, ladder) = {
        let spinner = Progress::spinner("climbing");
        let progress = |what: &str| spinner.says(what);
        let deadline = Deadline::after(args.search.budget)?;
        let is_over = || deadline.is_over();
        let options = diagnose::Options {
            explain: args.search.explain.is_some(),
            stop: &is_over,
            ..subject::options_of_all(&progress)
        };
        several.ladder(&start, &options)?
    };
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context = subject::context_of_all(
        &several,
        Command::Ladder,
        &args.log,
        args.axis,
        args.model.as_deref(),
        args.output.as_deref(),
    );
    context.product = Subject::product(&file, args.output.as_deref());
    context.explained = subject::explained(&args.search);
    context.unfinished = ladder.axes.iter().any(|axis| axis.unfinished);
    args.report
        .give(args.output.as_deref(), context, |format, context| report::render_ladder(&ladder, format, context))?;
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
