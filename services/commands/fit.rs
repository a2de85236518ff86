//! `truerate fit`: the base model, by nonlinear least squares.

use crate::{
    arguments::{LogsArgs, ReportArgs, StartArgs},
    commands::subject,
    progress::Progress,
};
use anyhow::{Context, Result, ensure};
use gyro_model::{Model, evidence::study::Bench};
use std::{path::PathBuf, process::ExitCode};
use workbench::{
    model_file, prior,
    report::{self, Command},
    subject::Subject,
};

/// What `truerate fit` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate fit log.csv.gz -o model.toml
      scale factor and bias of every axis with a reference
  truerate fit log.csv.gz --axis x
      of one axis; printed only
  truerate fit log.csv.gz new.csv.gz -o model.toml
      one model of several logs of one sensor, each with its own zero
  truerate fit new.csv.gz --prior type.toml -o new.toml
      of a new part, begun from its type
  truerate fit new.csv.gz --model old.toml -o new.toml
      the effects of old.toml, refitted

Then `truerate compare` and `truerate diagnose` show what error the model leaves.")]
pub struct Args {
    #[command(flatten)]
    log: LogsArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    report: ReportArgs,
    /// The model file to write
    #[arg(short, long, value_name = "M")]
    output: Option<PathBuf>,
}

/// Fits, prints, writes the model.
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
    let mut says = Vec::new();
    let (model, own_effects, laid) = match (&args.start.prior, &args.start.model) {
        (Some(path), _) => {
            let begun = subject::begin(&subject, path)?;
            says = begun.says;
            (begun.start.file.model, Vec::new(), None)
        }
        (None, Some(path)) => {
            let file = model_file::load(path, &subject.record.free_names)?;
            file.check_channels(&subject.record, &subject.axes).with_context(|| subject.name.clone())?;
            let (model, laid) = fitted(&subject, &file.model)?;
            (model, file.own_effects, laid)
        }
        (None, None) => {
            let (model, laid) = fitted(&subject, &subject.base())?;
            (model, Vec::new(), laid)
        }
    };
    // Blocked refits would forget the type.
    let mut diagnosis = subject::compare(&subject, &model, args.start.prior.is_none(), laid.as_ref())?;
    prior::say_beside(&mut diagnosis.axes, &says);
    let file = subject.fitted(model, own_effects);
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context = subject::context(
        &subject,
        Command::Fit,
        &log,
        args.start.axis,
        args.start.model.as_deref(),
        args.output.as_deref(),
    );
    context.product = Subject::product(&file, args.output.as_deref());
    args.report.give(args.output.as_deref(), context, |format, context| report::render(&diagnosis, format, context))?;
    Ok(ExitCode::SUCCESS)
}

fn fitted(subject: &Subject, start: &Model) -> Result<(Model, Option<Bench>)> {
    let (fitted, laid) = subject::fit(subject, start)?;
    Ok((Model { epoch: start.epoch + 1, ..fitted }, laid))
}

fn run_all(args: &Args) -> Result<ExitCode> {
    let several = subject::read_all(&args.log, args.start.axis)?;
    let start = several.start(args.start.model.as_deref())?;
    let (joint, diagnosis) = {
        let spinner = Progress::spinner("fitting");
        let progress = |what: &str| spinner.says(what);
        several.fit_and_compare(&start.file.model, &subject::options_of_all(&progress))?
    };
    let file = several.fitted(joint.model, &start.file);
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context = subject::context_of_all(
        &several,
        Command::Fit,
        &args.log,
        args.start.axis,
        args.start.model.as_deref(),
        args.output.as_deref(),
    );
    context.product = Subject::product(&file, args.output.as_deref());
    args.report.give(args.output.as_deref(), context, |format, context| report::render(&diagnosis, format, context))?;
    Ok(ExitCode::SUCCESS)
}
