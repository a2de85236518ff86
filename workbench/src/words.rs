//! How a refusal names what to do next: a command or its flag, a function or its argument, in a browser what is pressed or dropped.
//!
//! A process speaks in one voice, which it is given once, before anything is refused.

use gyro_model::words::{Argument, Voice};
use log_readers::meaning::Pick;
use std::sync::OnceLock;

static VOICE: OnceLock<Voice> = OnceLock::new();
static COMMAND: OnceLock<Vec<String>> = OnceLock::new();

/// Says in which voice this process refuses what it cannot do. The first call counts.
pub fn speak_as(voice: Voice) {
    VOICE.get_or_init(|| voice);
}

/// The voice of this process.
#[must_use]
pub fn voice() -> Voice {
    VOICE.get().copied().unwrap_or_default()
}

/// Says what command this process was given, without the program's name: a refusal repeats it with what was lacking. The first call counts.
pub fn answer_to(command: Vec<String>) {
    COMMAND.get_or_init(|| command);
}

/// The command that this process was given; empty where it was given none.
pub(crate) fn command() -> &'static [String] {
    COMMAND.get().map_or(&[], Vec::as_slice)
}

/// What can be done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// List the channels of a log.
    Channels,
    /// List the effects of the catalogue.
    Effects,
    /// Fit a model to a log.
    Fit,
    /// Compensate a log.
    Apply,
    /// Take an effect out of a model.
    Remove,
    /// Compensate a stream.
    Run,
    /// Reduce a log to what it says of its sensor.
    Evidence,
    /// Read the evidence of many sensors.
    Fleet,
}

impl Task {
    const fn command(self) -> &'static str {
        match self {
            Self::Channels => "channels",
            Self::Effects => "effects",
            Self::Fit => "fit",
            Self::Apply => "apply",
            Self::Remove => "remove",
            Self::Run => "run",
            Self::Evidence => "evidence",
            Self::Fleet => "fleet",
        }
    }

    /// What the Python package has for it.
    const fn function(self) -> Option<&'static str> {
        match self {
            Self::Effects => Some("`truerate.effects()`"),
            Self::Fit => Some("`Log.fit`"),
            Self::Apply => Some("`Model.apply`"),
            Self::Evidence => Some("`truerate.evidence`"),
            Self::Fleet => Some("`Fleet.save_types`"),
            Self::Channels | Self::Remove | Self::Run => None,
        }
    }

    /// Its name in a voice; a command has these arguments.
    #[must_use]
    fn named(self, arguments: &str, voice: Voice) -> String {
        let command = format!("truerate {} {arguments}", self.command());
        let command = format!("`{}`", command.trim_end());
        match (voice, self.function()) {
            (Voice::Log | Voice::Stream, _) => command,
            (Voice::Library, Some(function)) => function.to_owned(),
            (Voice::Library | Voice::Page, _) => format!("the program ({command})"),
        }
    }
}

/// The name of a task in the voice of this process; a command has these arguments.
#[must_use]
pub fn call(task: Task, arguments: &str) -> String {
    task.named(arguments, voice())
}

/// The name of an argument in the voice of this process.
#[must_use]
pub fn name(argument: Argument) -> String {
    argument.name(voice())
}

/// "with" this argument, in the voice of this process.
#[must_use]
pub fn with(argument: Argument) -> String {
    argument.with(voice())
}

/// Channels under the names of a log, as they are typed, in the voice of this process.
#[must_use]
pub fn typed(picks: &[Pick]) -> String {
    let maps: Vec<String> = picks.iter().map(Pick::to_string).collect();
    if maps.is_empty() { String::new() } else { Argument::Map(&maps).typed(voice()) }
}

/// One `NAME=CHANNEL` or DBC file as it was given, at the beginning of a refusal.
#[must_use]
pub fn given(flag: &str, text: &str) -> String {
    match voice() {
        Voice::Log | Voice::Stream => format!("--{flag} {text}"),
        Voice::Library => format!("{flag} {text}"),
        Voice::Page => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_names_functions_and_a_page_the_program() {
        assert_eq!(Task::Fit.named("LOG -o M", Voice::Log), "`truerate fit LOG -o M`");
        assert_eq!(Task::Effects.named("", Voice::Log), "`truerate effects`");
        assert_eq!(Task::Fit.named("LOG -o M", Voice::Library), "`Log.fit`");
        assert_eq!(Task::Channels.named("LOG", Voice::Library), "the program (`truerate channels LOG`)");
        assert_eq!(Task::Evidence.named("LOG", Voice::Page), "the program (`truerate evidence LOG`)");
    }
}
