//! The command to run next, whatever came out.

use super::Context;
use gyro_model::{
    Axis,
    diagnosis::Verdict,
    words::{Voice, shell_word},
};
use serde::Serialize;

/// Which command made a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `fit`.
    Fit,
    /// `compare`.
    Compare,
    /// `diagnose`.
    Diagnose,
    /// `add`.
    Add,
    /// `remove`.
    Remove,
    /// `ladder`.
    Ladder,
}

/// One command to run and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Next {
    /// To copy and paste.
    pub command: String,
    /// Why, a few words.
    pub says: String,
}

/// What the choice depends on, of the axis that needs attention most.
pub(super) struct Finding<'a> {
    pub axis: Axis,
    /// Whether other axes came to something else, so that the axis has to be named.
    pub alone: bool,
    pub verdict: Verdict,
    /// What is missing.
    pub suspects: &'a [&'a str],
}

/// What to run next, best first.
pub(super) fn next(finding: &Finding, context: &Context) -> Vec<Next> {
    // These are shell commands, which a user of the library or of a page does not type.
    if matches!(context.voice, Voice::Library | Voice::Page) {
        return Vec::new();
    }
    // What came by a pipe is not there to be read again.
    let log = if context.log == "-" { "LOG.csv" } else { &context.log };
    let line = Line { context, log, why: "adds what is missing until nothing is, and keeps the model" };
    let made = context.output.as_deref();
    match (context.command, finding.verdict) {
        (Command::Ladder, _) if context.unfinished => vec![Line { why: ON, ..line }.ladder()],
        (Command::Diagnose, _) if context.unfinished => {
            vec![line.of("diagnose", &[], context.model.as_deref(), &[], ON)]
        }
        (command, Verdict::BadData) => vec![
            line.of_mended(if command == Command::Diagnose { "diagnose" } else { "compare" }, context.maps.as_deref()),
        ],
        (Command::Diagnose, Verdict::Adequate) if context.moved => vec![line.of(
            "fit",
            &[],
            context.model.as_deref(),
            &["-o", "model.toml"],
            "keeps the parameters as this log has them",
        )],
        (Command::Compare | Command::Fit | Command::Diagnose, Verdict::Adequate) => {
            match made.or(context.model.as_deref()) {
                Some(model) => vec![line.apply(model)],
                None => vec![line.of(
                    "fit",
                    &[],
                    None,
                    &["-o", "model.toml"],
                    "keeps this model in a file, for `apply` and `run`",
                )],
            }
        }
        (Command::Compare | Command::Fit, _) => {
            vec![line.of(
                "diagnose",
                &[],
                made.or(context.model.as_deref()),
                &[],
                "looks for the physical effect that is missing",
            )]
        }
        (Command::Diagnose, Verdict::MissingEffect | Verdict::Ambiguous) => {
            if finding.suspects.is_empty() {
                return vec![line.ladder()];
            }
            let letter = finding.axis.letter();
            let mut rest = vec!["-o", "model.toml"];
            if finding.alone && !context.flags.iter().any(|f| f == "--axis") {
                rest.extend(["--axis", letter]);
            }
            let why = if finding.verdict == Verdict::Ambiguous {
                "adds the best of the group; the manoeuvre above would tell them apart"
            } else if finding.suspects.len() > 1 {
                "adds them, refits, and shows before and after"
            } else {
                "adds it, refits, and shows before and after"
            };
            vec![line.of("add", finding.suspects, context.model.as_deref(), &rest, why), line.ladder()]
        }
        // What was added and not kept is not there to be looked at.
        (Command::Ladder, Verdict::Unexplained) if made.is_none() => vec![Line { why: AGAIN, ..line }.ladder()],
        (Command::Diagnose | Command::Ladder, Verdict::Unexplained) => vec![line.of(
            "compare",
            &[],
            made.or(context.model.as_deref()),
            &["--report", "left.html"],
            "shows what is left and where; an effect of your own can be written into the model file",
        )],
        (Command::Ladder, Verdict::CannotTell) if made.is_none() => vec![line.on_another_log().ladder()],
        (Command::Diagnose | Command::Ladder, Verdict::CannotTell) => {
            vec![line.on_another_log().of("diagnose", &[], made.or(context.model.as_deref()), &[], ANOTHER)]
        }
        (Command::Add | Command::Remove, _) => match made {
            Some(model) => vec![line.of("diagnose", &[], Some(model), &[], "looks for what is still missing")],
            None => vec![Line { why: "finds what is missing by itself, and keeps the model", ..line }.ladder()],
        },
        (Command::Ladder, _) => match made {
            Some(model) => vec![line.apply(model)],
            None => vec![Line { why: AGAIN, ..line }.ladder()],
        },
    }
}

/// How the charts of a result are seen; `None` where they are shown already, or the command would have to be run all over for long.
pub(super) fn look(context: &Context) -> Option<Next> {
    let log = context.log.as_str();
    // Data that are read in a wrong unit or order are not worth a look.
    let is_mended = context.maps.is_some();
    if matches!(context.voice, Voice::Library | Voice::Page) || context.opened || log == "-" || is_mended {
        return None;
    }
    let line = Line { context, log, why: "" };
    let says = "shows the same with charts, in a browser";
    let model = context.model.as_deref();
    match context.command {
        Command::Compare => Some(line.of("compare", &[], model, &["--open"], says)),
        Command::Diagnose => Some(line.of("diagnose", &[], model, &["--open"], says)),
        // What was made is shown as it is.
        Command::Ladder | Command::Fit | Command::Add | Command::Remove => {
            let made = context.output.as_deref().filter(|made| *made != "-")?;
            Some(line.of("compare", &[], Some(made), &["--open"], says))
        }
    }
}

/// Puts command lines together.
struct Line<'a> {
    context: &'a Context,
    log: &'a str,
    /// What `ladder` is for.
    why: &'a str,
}

/// What is said of a log that cannot be judged as it is, and of the maps with which it can.
const ONCE_FIXED: &str = "once the faults named above are fixed, in the log or in how its columns are named (`--map`; a channel with its sign turned is `--map NAME=-CHANNEL`)";
const MENDED: &str = "reads the channels in the units, the order and with the signs in which gyro and reference agree";
/// What is said of a ladder that was climbed and not kept.
const AGAIN: &str = "finds the same model again and writes it to a file, for `compare`, `apply` and `run`";
/// What is said of a search that was stopped.
const ON: &str = "looks to the end, however long that takes";
/// What is said of a log that is still to be recorded.
const ANOTHER: &str = "once NEW.csv is recorded with the motion that is asked for above";

impl Line<'_> {
    /// The same of a log that is still to be recorded.
    fn on_another_log(&self) -> Self {
        Self { log: "NEW.csv", why: ANOTHER, ..*self }
    }

    fn of(&self, command: &str, effects: &[&str], model: Option<&str>, rest: &[&str], says: &str) -> Next {
        let mut words = vec!["truerate".to_string(), command.to_string(), shell_word(self.log)];
        if self.log == self.context.log && command != "apply" {
            words.extend(self.context.more.iter().map(|log| shell_word(log)));
        }
        words.extend(effects.iter().map(|e| (*e).to_string()));
        if let Some(model) = model {
            words.extend(["--model".to_string(), shell_word(model)]);
        }
        words.extend(self.context.flags.iter().map(|f| shell_word(f)));
        words.extend(rest.iter().map(|r| (*r).to_string()));
        Next { command: words.join(" "), says: says.to_string() }
    }

    /// The command again on a log whose data are at fault: with the maps that take the faults out, where there are such.
    fn of_mended(&self, command: &str, maps: Option<&[String]>) -> Next {
        let model = self.context.model.as_deref();
        let Some(maps) = maps else { return self.of(command, &[], model, &[], ONCE_FIXED) };
        let mut flags = self.context.flags.clone();
        while let Some(place) = flags.iter().position(|flag| flag == "--map") {
            flags.drain(place..(place + 2).min(flags.len()));
        }
        flags.extend(maps.iter().flat_map(|map| ["--map".to_owned(), map.clone()]));
        let context = Context { flags, ..self.context.clone() };
        Line { context: &context, ..*self }.of(command, &[], model, &[], MENDED)
    }

    fn ladder(&self) -> Next {
        let model = self.context.model.as_deref();
        self.of("ladder", &[], model, &["-o", "model.toml"], self.why)
    }

    fn apply(&self, model: &str) -> Next {
        self.of("apply", &[], Some(model), &["-o", "compensated.csv"], "writes the compensated log")
    }
}
