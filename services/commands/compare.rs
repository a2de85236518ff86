//! `truerate compare`: model against measurements, and where it fails.

use crate::{
    arguments::{LogsArgs, ReportArgs},
    commands::subject,
    progress::Progress,
};
use anyhow::{Result, bail};
use gyro_model::{Axis, diagnosis::Diagnosis};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::{
    report::{self, Against, Command},
    sides::{Judged, beside},
    subject::Subject,
};

/// What `truerate compare` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate compare log.csv.gz
      the base model, fitted to this log
  truerate compare new.csv.gz --model model.toml
      a model on a log that it was not fitted to
  truerate compare log.csv.gz new.csv.gz --model model.toml
      on several logs of one sensor
  truerate compare log.csv.gz --model a.toml --against b.toml
      two models on the same samples
  truerate compare log.csv.gz new.csv.gz --side-by-side
      two sensors: which is better, by what, and over which time
  truerate compare log.csv.gz --model model.toml --report page.html
  truerate compare log.csv.gz --open
      with charts, in a browser

The model's parameters stay as they are. If the model was fitted on this very log (it stores that),
the errors shown are those of refits without the block that is judged.")]
pub struct Args {
    #[command(flatten)]
    log: LogsArgs,
    /// The model to compare with the log; without it the base model, fitted to the log
    #[arg(long, value_name = "M")]
    model: Option<PathBuf>,
    /// Another model to compare with the same samples
    #[arg(long, value_name = "M2")]
    against: Option<PathBuf>,
    /// Two logs are of two sensors: which is better, by what, and over which time. Each has its own model: scale factor and bias fitted to its
    /// log, or --model for the first and --against for the second
    #[arg(long)]
    side_by_side: bool,
    /// Only this axis
    #[arg(long, value_name = "x|y|z")]
    axis: Option<Axis>,
    #[command(flatten)]
    report: ReportArgs,
}

/// Compares and prints.
///
/// # Errors
/// A refused log or model, or a report that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.report.check(&args.log.paths())?;
    if args.side_by_side {
        return sides(args);
    }
    if args.log.are_several() {
        return run_all(args);
    }
    let log = args.log.first();
    let mut subject = subject::read(&log, args.axis)?;
    let start = subject::start(&subject, args.model.as_deref())?;
    let other = args.against.as_deref().map(|path| subject::start(&subject, Some(path))).transpose()?;
    for (start, path) in [(Some(&start), &args.model), (other.as_ref(), &args.against)] {
        if let (Some(start), Some(path)) = (start, path) {
            subject.keep_axes_of(&start.file.model, &path.display().to_string())?;
        }
    }
    let diagnosis = subject::judge(&subject, &start)?;
    let warning = args.model.as_ref().and_then(|_| subject.hotter(&start.file)).unwrap_or_default();
    let context = subject::context(&subject, Command::Compare, &log, args.axis, args.model.as_deref(), None);
    let context = report::Context { warning, ..context };
    let other = other.map(|other| subject::judge(&subject, &other)).transpose()?;
    show(args, context, &diagnosis, other.as_ref())
}

/// Prints a comparison, beside that of another model where there is one.
fn show(args: &Args, context: report::Context, diagnosis: &Diagnosis, other: Option<&Diagnosis>) -> Result<ExitCode> {
    if let (Some(against), Some(other)) = (&args.against, other) {
        let model = args.model.as_ref().map_or_else(|| "base model".to_owned(), |path| label(path, against));
        let against = args.model.as_ref().map_or_else(|| label(against, Path::new("")), |model| label(against, model));
        let both = Against { model: &model, diagnosis, other_model: &against, other };
        args.report.give(None, context, |format, context| report::render_against(&both, format, context))?;
    } else {
        args.report.give(None, context, |format, context| report::render(diagnosis, format, context))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Two sensors, each on its own log.
fn sides(args: &Args) -> Result<ExitCode> {
    let [first, second] = &args.log.logs[..] else {
        bail!("--side-by-side takes two logs, one of each sensor; {} given", args.log.logs.len());
    };
    let read = subject::read_each(&args.log, args.axis)?;
    let of = |mut subject: Subject, model: Option<&Path>| -> Result<Judged> {
        let start = subject::start(&subject, model)?;
        if let Some(model) = model {
            subject.keep_axes_of(&start.file.model, &model.display().to_string())?;
        }
        let diagnosis = subject::judge(&subject, &start)?;
        Ok(Judged { subject, start, diagnosis })
    };
    let [one, other] = read;
    let own = [of(one, args.model.as_deref())?, of(other, args.against.as_deref())?];
    let names = [label(first, second), label(second, first)];
    let context =
        subject::context(&own[0].subject, Command::Compare, &args.log.first(), args.axis, args.model.as_deref(), None);
    let context = report::Context {
        log: first.display().to_string(),
        more: vec![second.display().to_string()],
        about: Vec::new(),
        maps: None,
        ..context
    };
    let both = beside(own, names)?;
    args.report.give(None, context, |format, context| report::render_sides(&both, format, context))?;
    Ok(ExitCode::SUCCESS)
}

fn run_all(args: &Args) -> Result<ExitCode> {
    let several = subject::read_all(&args.log, args.axis)?;
    let held = |model: Option<&Path>| {
        let spinner = Progress::spinner("comparing");
        let progress = |what: &str| spinner.says(what);
        several.compare(&several.start(model)?, &subject::options_of_all(&progress))
    };
    let diagnosis = held(args.model.as_deref())?;
    let context =
        subject::context_of_all(&several, Command::Compare, &args.log, args.axis, args.model.as_deref(), None);
    let other = args.against.as_deref().map(|path| held(Some(path))).transpose()?;
    show(args, context, &diagnosis, other.as_ref())
}

/// A model's name: its file's, or its path where that of the other has the same.
fn label(path: &Path, other: &Path) -> String {
    match path.file_name().filter(|name| other.file_name() != Some(name)) {
        Some(name) => name.to_string_lossy().into_owned(),
        None => path.display().to_string(),
    }
}
