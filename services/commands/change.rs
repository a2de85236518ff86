//! What `truerate add` and `truerate remove` share: another set of effects, refitted, shown before and after.

use crate::{
    arguments::{LogArgs, ReportArgs},
    commands::subject,
};
use anyhow::{Context, Result, bail};
use gyro_model::{Axis, AxisModel, Model, Term, effects::Stage};
use std::{path::PathBuf, process::ExitCode};
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

/// In which direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// `add`.
    Add,
    /// `remove`.
    Remove,
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
        if args.model.is_some() { subject::fit(&subject, &start.file.model)? } else { start.file.model.clone() };
    let mut changed = before.clone();
    for id in &args.effects {
        let effect = start.file.effect(id)?;
        let id = effect.card().id;
        if direction == Direction::Remove && effect.stage() == Stage::Calibration {
            bail!("'{id}' belongs to the base model: it stays");
        }
        let mut touched = false;
        for &axis in &subject.axes {
            if direction == Direction::Add
                && let Some(need) = effect.card().needs.iter().find(|need| !need.is_in(&subject.record, axis))
            {
                bail!("{}: '{id}' needs {need}, which the log does not have", subject.name);
            }
            let model = changed.axes[axis.index()].get_or_insert_with(|| AxisModel::base(axis));
            let has = model.term(id).is_some();
            match direction {
                Direction::Add if !has => {
                    model.terms.push(Term::neutral(effect, axis));
                }
                Direction::Remove if has => model.terms.retain(|term| term.effect.card().id != id),
                Direction::Add | Direction::Remove => continue,
            }
            touched = true;
        }
        if !touched {
            bail!("{}", untouched(id, direction, &changed, &subject.axes));
        }
    }
    let mut after = subject::fit(&subject, &changed)?;
    if let Some((axis, id)) = after.unseen() {
        bail!("{}: nothing in this log shows '{id}' on axis {axis}: there is no shape of it to add", subject.name);
    }
    after.epoch = start.file.model.epoch + 1;
    let (old, new) = (subject::compare(&subject, &before, true)?, subject::compare(&subject, &after, true)?);
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

fn untouched(id: &str, direction: Direction, model: &Model, axes: &[Axis]) -> String {
    let letters: Vec<&str> = axes.iter().map(|a| a.letter()).collect();
    let has: Vec<&str> =
        axes.iter().filter_map(|a| model.axes[a.index()].as_ref()).flat_map(AxisModel::effect_ids).collect();
    let (letters, has) = (letters.join(", "), has.join(", "));
    match direction {
        Direction::Add => format!("the model of axis {letters} has '{id}' already: nothing to add"),
        Direction::Remove => format!("the model of axis {letters} has no '{id}', it has {has}: nothing to remove"),
    }
}
