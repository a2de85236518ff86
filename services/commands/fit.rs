//! `truerate fit`: the base model, by nonlinear least squares.

use crate::{
    arguments::{LogArgs, ReportArgs},
    commands::subject,
};
use anyhow::{Context, Result};
use gyro_model::Axis;
use std::{path::PathBuf, process::ExitCode};
use workbench::{
    model_file,
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
  truerate fit new.csv.gz --model old.toml -o new.toml
      the effects of old.toml, refitted

Then `truerate compare` and `truerate diagnose` show what error the model leaves.")]
pub struct Args {
    #[command(flatten)]
    log: LogArgs,
    /// Refit this model's effects in place of the base model's
    #[arg(long, value_name = "M")]
    model: Option<PathBuf>,
    /// Only this axis
    #[arg(long, value_name = "x|y|z")]
    axis: Option<Axis>,
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
    args.report.check_with(&args.log.log, args.output.as_deref())?;
    let subject = subject::read(&args.log, args.axis)?;
    let (start, own_effects) = match &args.model {
        Some(path) => {
            let file = model_file::load(path, &subject.record.free_names)?;
            file.check_channels(&subject.record, &subject.axes).with_context(|| subject.name.clone())?;
            (file.model, file.own_effects)
        }
        None => (subject.base(), Vec::new()),
    };
    let mut model = subject::fit(&subject, &start)?;
    model.epoch = start.epoch + 1;
    let diagnosis = subject::compare(&subject, &model, true)?;
    let file = subject.fitted(model, own_effects);
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let mut context =
        subject::context(&subject, Command::Fit, &args.log, args.axis, args.model.as_deref(), args.output.as_deref());
    context.opened = args.report.open;
    context.product = Subject::product(&file, args.output.as_deref());
    args.report.emit(args.output.as_deref(), |format, file| {
        report::render(&diagnosis, format, &if file { context.for_file() } else { context.clone() })
    })?;
    Ok(ExitCode::SUCCESS)
}
