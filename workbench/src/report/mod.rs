//! Results as people and programs read them: text for a terminal screen, JSON, and one self-contained HTML page.
//!
//! ```text
//! Diagnosis · Change · Against ─▶ view (human units, verdict in words, next command) ─▶ text | html
//!                                      └─▶ json (SI, the interface's keys)
//! ```
//!
//! Commands call one function a kind of result and print the string that comes back.

mod bars;
mod html;
mod json;
mod next;
pub mod stream;
pub(crate) mod terminal;
mod text;
pub use gyro_model::units;
pub mod view;

pub use next::Command;
pub use terminal::{Ink, Terminal};

use gyro_model::{
    diagnosis::{AxisResult, Diagnosis},
    headline::sides::Sides,
    words::Voice,
};
use serde::Serialize;
use std::path::Path;

/// The forms of a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Format {
    /// For people, in the terminal
    #[default]
    Text,
    /// For programs: SI units, keys that stay
    Json,
    /// One self-contained page with charts
    Html,
}

/// How much is told of each suspect, where that was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Explained {
    /// A sentence.
    #[default]
    Sentence,
    /// Each test with its numbers.
    Tests,
}

/// What the result itself doesn't say: how the command was called, and where its output goes.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own, and none excludes another")]
pub struct Context {
    /// Which command made the result.
    pub command: Command,
    /// The log as it was typed.
    pub log: String,
    /// Further logs of the same sensor, as they were typed.
    pub more: Vec<String>,
    /// `--model` as it was typed.
    pub model: Option<String>,
    /// `-o` as it was typed.
    pub output: Option<String>,
    /// Further flags that the next command needs again (`--columns F`, `--axis x`), each word an entry.
    pub flags: Vec<String>,
    /// The maps with which the log can be judged, where it cannot as it is.
    pub maps: Option<Vec<String>>,
    /// Whether the log has parameters of that model otherwise.
    pub moved: bool,
    /// How much is told of each suspect.
    pub explained: Explained,
    /// Whether the page is shown in a browser, too.
    pub opened: bool,
    /// Whether the search was stopped before its end.
    pub unfinished: bool,
    /// What has to be known before anything else; empty where there is nothing.
    pub warning: String,
    /// What the log is, in a few words each: its length, its rate, when it was recorded.
    pub about: Vec<String>,
    /// The new model.
    pub product: Option<Product>,
    /// Whether the result leaves this machine: then no folder of it is named.
    pub mailed: bool,
    /// The terminal that text is for.
    pub terminal: Terminal,
    /// Of what is spoken, and to whom.
    pub voice: Voice,
}

/// The model that a command made, to be taken along with its page.
#[derive(Clone, Debug, Serialize)]
pub struct Product {
    /// A file's name.
    pub name: String,
    /// What stands in it.
    pub text: String,
}

impl Context {
    /// For a command on this log: without colour, in the voice of the program.
    #[must_use]
    pub fn new(command: Command, log: impl Into<String>) -> Self {
        Self {
            command,
            log: log.into(),
            more: Vec::new(),
            model: None,
            output: None,
            flags: Vec::new(),
            maps: None,
            moved: false,
            explained: Explained::default(),
            opened: false,
            unfinished: false,
            warning: String::new(),
            about: Vec::new(),
            product: None,
            mailed: false,
            terminal: Terminal::PLAIN,
            voice: Voice::Log,
        }
    }

    /// The same with output that goes to a file: no colour, a fixed width, and no folder of this machine, for it will be mailed.
    #[must_use]
    pub fn for_file(&self) -> Self {
        let name = |path: &String| file_name(path);
        let mut flags = self.flags.clone();
        for k in 1..flags.len() {
            if matches!(flags[k - 1].as_str(), "--columns" | "--reference") {
                flags[k] = file_name(&flags[k]);
            }
        }
        Self {
            terminal: Terminal::PLAIN,
            mailed: true,
            log: file_name(&self.log),
            more: self.more.iter().map(name).collect(),
            model: self.model.as_ref().map(name),
            output: self.output.as_ref().map(name),
            flags,
            ..self.clone()
        }
    }

    /// A page is mailed, wherever it is printed to.
    fn for_format(&self, format: Format) -> Self {
        if format == Format::Html { self.for_file() } else { self.clone() }
    }
}

/// What stands behind the last slash of a path; what is no path stays.
fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}

/// `add` and `remove`: one model before, another after, on the same samples.
#[derive(Clone, Debug)]
pub struct Change<'a> {
    /// Effects that were added.
    pub added: &'a [String],
    /// Effects that were removed.
    pub removed: &'a [String],
    /// With the model as it was.
    pub before: &'a Diagnosis,
    /// With the new model.
    pub after: &'a Diagnosis,
}

/// `compare --against`: two models on the same samples.
#[derive(Clone, Debug)]
pub struct Against<'a> {
    /// Name of the first model.
    pub model: &'a str,
    /// What it comes to.
    pub diagnosis: &'a Diagnosis,
    /// Name of the other.
    pub other_model: &'a str,
    /// What that comes to.
    pub other: &'a Diagnosis,
}

/// `compare --side-by-side`: two sensors, each with its own log and model.
#[derive(Clone, Debug)]
pub struct BothSides {
    /// What the logs are called.
    pub names: [String; 2],
    /// What each comes to.
    pub diagnoses: [Diagnosis; 2],
    /// Axis by axis.
    pub sides: Vec<Sides>,
}

/// `compare`, `diagnose` and `ladder`.
#[must_use]
pub fn render(diagnosis: &Diagnosis, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::diagnosis(diagnosis, context.voice),
        _ => page(diagnosis, view::Page::of, format, context),
    }
}

/// Why each effect was named or was not, axis by axis, where that was asked for; with `tests`, each test with its numbers.
#[must_use]
pub fn explanation(axes: &[AxisResult], tests: bool, terminal: Terminal) -> String {
    let told = |axis: &AxisResult| (axis.axis, view::explained(axis));
    text::explanation(&axes.iter().map(told).collect::<Vec<_>>(), tests, terminal)
}

/// `add` and `remove`: before and after.
#[must_use]
pub fn render_change(change: &Change, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::change(change, context.voice),
        _ => page(change, view::Page::of_change, format, context),
    }
}

/// `compare --against`: side by side.
#[must_use]
pub fn render_against(against: &Against, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::against(against, context.voice),
        _ => page(against, view::Page::of_against, format, context),
    }
}

/// `compare --side-by-side`: which sensor is better, and by what.
#[must_use]
pub fn render_sides(both: &BothSides, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::sides(both, context.voice),
        _ => page(both, view::Page::of_sides, format, context),
    }
}

fn page<T>(result: &T, view: fn(&T, &Context) -> view::Page, format: Format, context: &Context) -> String {
    let context = context.for_format(format);
    let page = view(result, &context);
    let page = view::Page {
        warning: context.warning.clone(),
        about: context.about.clone(),
        log: if context.mailed { file_name(&page.log) } else { page.log },
        product: context.product.clone(),
        tests: context.explained == Explained::Tests,
        look: next::look(&context).filter(|_| !context.mailed),
        ..page
    };
    if format == Format::Html { html::render(&page) } else { text::render(&page, context.terminal) }
}

#[cfg(test)]
mod tests;
