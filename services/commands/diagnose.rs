//! `truerate diagnose`: which physical effect is missing.

use crate::{
    arguments::{LogsArgs, ReportArgs, SearchArgs, StartArgs},
    commands::subject,
};
use anyhow::{Result, ensure};
use clap::ValueEnum;
use gyro_model::{
    diagnosis::{Diagnosis, Verdict},
    finding::Remark,
};
use std::process::ExitCode;
use workbench::{
    prior,
    report::{self, Command},
};

/// What `truerate diagnose` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate diagnose log.csv.gz
      what the base model is missing
  truerate diagnose log.csv.gz --model model.toml
      what this model is missing
  truerate diagnose log.csv.gz new.csv.gz
      what several logs of one sensor show together: what repeats is the sensor's
  truerate diagnose log.csv.gz --axis x --format json
      for programs
  truerate diagnose log.csv.gz --open
      and its charts, in a browser
  truerate diagnose log.csv.gz --explain
      why each effect was named, or was not; with `--explain full` every test and its numbers
  truerate diagnose log.csv.gz --model model.toml --fail-on missing-effect,ambiguous
      exit code 3 if an effect is missing: for CI

The model is refitted to the log first. Verdicts: adequate, missing-effect, ambiguous, unexplained,
cannot-tell, bad-data. The last lines say what to run next.")]
pub struct Args {
    #[command(flatten)]
    log: LogsArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    search: SearchArgs,
    #[command(flatten)]
    report: ReportArgs,
    /// Exit with code 3 if an axis has one of these verdicts; may be given several times
    #[arg(long, value_enum, value_delimiter = ',', value_name = "VERDICT[,VERDICT…]")]
    fail_on: Vec<FailOn>,
}

/// The verdicts on which a script may want to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FailOn {
    /// Nothing is missing that the log can show
    Adequate,
    /// One physical effect is missing and named
    MissingEffect,
    /// An effect is missing, and this log cannot tell which of a group
    Ambiguous,
    /// The error is more than noise, and no effect explains it
    Unexplained,
    /// The log does not decide it: it lacks a motion, or noise explains it as well
    CannotTell,
    /// The data are faulty
    BadData,
}

impl FailOn {
    fn verdict(self) -> Verdict {
        match self {
            Self::Adequate => Verdict::Adequate,
            Self::MissingEffect => Verdict::MissingEffect,
            Self::Ambiguous => Verdict::Ambiguous,
            Self::Unexplained => Verdict::Unexplained,
            Self::CannotTell => Verdict::CannotTell,
            Self::BadData => Verdict::BadData,
        }
    }
}

/// The exit code of `--fail-on`.
const FOUND: u8 = 3;

/// Diagnoses and prints.
///
/// # Errors
/// A refused log or model, or a report that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.report.check(&args.log.paths())?;
    if args.log.are_several() {
        ensure!(args.start.prior.is_none(), "--prior is for one log of a new part: give one log");
        return run_all(args);
    }
    let log = args.log.first();
    let subject = subject::read(&log, args.start.axis)?;
    let (start, says) = subject::begun(&subject, &args.start)?;
    let mut diagnosis =
        subject::search("diagnosing", &args.search, &subject.faults, |_, options| subject.diagnose(&start, options))?;
    prior::say_beside(&mut diagnosis.axes, &says);
    let mut context =
        subject::context(&subject, Command::Diagnose, &log, args.start.axis, args.start.model.as_deref(), None);
    context.explained = subject::explained(&args.search);
    context.unfinished = diagnosis.axes.iter().any(|axis| axis.unfinished);
    context.moved = diagnosis.axes.iter().flat_map(|axis| &axis.remarks).any(|own| matches!(own, Remark::Moved { .. }));
    args.report.give(None, context, |format, context| report::render(&diagnosis, format, context))?;
    Ok(code(args, &diagnosis))
}

fn code(args: &Args, diagnosis: &Diagnosis) -> ExitCode {
    let found = diagnosis.axes.iter().any(|axis| args.fail_on.iter().any(|f| f.verdict() == axis.verdict));
    if found { ExitCode::from(FOUND) } else { ExitCode::SUCCESS }
}

fn run_all(args: &Args) -> Result<ExitCode> {
    let several = subject::read_all(&args.log, args.start.axis)?;
    let start = several.start(args.start.model.as_deref())?;
    let diagnosis = subject::search("diagnosing", &args.search, &[], |_, options| several.diagnose(&start, options))?;
    let mut context = subject::context_of_all(
        &several,
        Command::Diagnose,
        &args.log,
        args.start.axis,
        args.start.model.as_deref(),
        None,
    );
    context.explained = subject::explained(&args.search);
    context.unfinished = diagnosis.axes.iter().any(|axis| axis.unfinished);
    args.report.give(None, context, |format, context| report::render(&diagnosis, format, context))?;
    Ok(code(args, &diagnosis))
}
