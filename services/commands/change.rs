//! What `truerate add` and `truerate remove` share: another set of effects, refitted, shown before and after.

use crate::{
    arguments::{LogArgs, ReportArgs},
    commands::subject,
    progress::Progress,
};
use anyhow::{Context, Result};
use gyro_model::Axis;
use std::{path::PathBuf, process::ExitCode};
pub use workbench::change::Direction;
use workbench::{
    report::{self, Change, Command},
    subject::Subject,
};

/// What both take.
#[derive(clap::Args, Debug, Clone)]
pub struct ChangeArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Effect ids, as `truerate effects` lists them, or a user's own effect of the model file
    #[arg(value_name = "EFFECT", required = true)]
    effects: Vec<String>,
    /// The model to change; without it the base model, fitted to the log
    #[arg(long, value_name = "M")]
    model: Option<PathBuf>,
    /// Only this axis; without it every axis that has a reference
    #[arg(long, value_name = "x|y|z")]
    axis: Option<Axis>,
    #[command(flatten)]
    report: ReportArgs,
    /// The changed model to write
    #[arg(short, long, value_name = "NEW")]
    output: Option<PathBuf>,
}

/// Changes, refits, prints before and after, writes the new model.
///
/// # Errors
/// A refused log or model, an effect that is not there or is there already, a file that cannot be written.
pub fn run(args: &ChangeArgs, direction: Direction) -> Result<ExitCode> {
    args.report.check_with(&args.log.log, args.output.as_deref())?;
    let subject = subject::read(&args.log, args.axis)?;
    let start = subject.load(args.model.as_deref())?;
    if direction == Direction::Add {
        start.file.check_channels(&subject.record, &subject.axes).with_context(|| subject.name.clone())?;
    }
    // Both are refitted to this log, so that before and after differ by the effects alone.
    let before =
        if args.model.is_some() { subject::fit(&subject, &start.file.model)?.0 } else { start.file.model.clone() };
    let mut after = {
        let _spinner = Progress::spinner("fitting");
        subject.changed(&start.file, &before, &args.effects, direction)?
    };
    after.epoch = start.file.model.epoch + 1;
    let judged = |model| subject::compare(&subject, model, true, start.laid.as_ref());
    let (old, new) = (judged(&before)?, judged(&after)?);
    let file = subject.fitted(after, start.file.own_effects);
    if let Some(path) = &args.output {
        subject::keep(path, &file)?;
    }
    let none: &[String] = &[];
    let (command, added, removed) = match direction {
        Direction::Add => (Command::Add, args.effects.as_slice(), none),
        Direction::Remove => (Command::Remove, none, args.effects.as_slice()),
    };
    let change = Change { added, removed, before: &old, after: &new };
    let mut context =
        subject::context(&subject, command, &args.log, args.axis, args.model.as_deref(), args.output.as_deref());
    context.product = Subject::product(&file, args.output.as_deref());
    args.report
        .give(args.output.as_deref(), context, |format, context| report::render_change(&change, format, context))?;
    Ok(ExitCode::SUCCESS)
}
