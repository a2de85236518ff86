//! Results as people and programs read them: text for a terminal screen, JSON, and one self-contained HTML page.
//!
//! ```text
//! Diagnosis · Ladder · Change · Against ─▶ view (human units, verdict in words, next command) ─▶ text | html
//!                                      └─▶ json (SI, the interface's keys)
//! ```
//!
//! Commands call one function a kind of result and print the string that comes back.

mod bars;
mod html;
mod json;
mod next;
mod terminal;
mod text;
pub use gyro_model::units;
pub mod view;

pub use next::Command;
pub use terminal::Terminal;

use crate::cli::Format;
use gyro_model::diagnosis::{Diagnosis, Ladder};

/// What the result itself doesn't say: how the command was called, and where its output goes.
#[derive(Clone, Debug)]
pub struct Context {
    /// Which command made the result.
    pub command: Command,
    /// The log as it was typed.
    pub log: String,
    /// `--model` as it was typed.
    pub model: Option<String>,
    /// `-o` as it was typed.
    pub output: Option<String>,
    /// Further flags that the next command needs again (`--columns F`, `--axis x`), each word an entry.
    pub flags: Vec<String>,
    /// Whether the log has parameters of that model otherwise.
    pub moved: bool,
    /// Whether the search was stopped before its end.
    pub unfinished: bool,
    /// What has to be known before anything else; empty where there is nothing.
    pub warning: String,
    /// The terminal that text is for.
    pub terminal: Terminal,
}

impl Context {
    /// For a command on this log, printed to wherever standard output goes.
    #[must_use]
    pub fn new(command: Command, log: impl Into<String>) -> Self {
        Self {
            command,
            log: log.into(),
            model: None,
            output: None,
            flags: Vec::new(),
            moved: false,
            unfinished: false,
            warning: String::new(),
            terminal: Terminal::detect(),
        }
    }

    /// The same with output that goes to a file: no colour, a fixed width.
    #[must_use]
    pub fn for_file(&self) -> Self {
        Self { terminal: Terminal::PLAIN, ..self.clone() }
    }
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

/// `compare` and `diagnose`.
#[must_use]
pub fn render(diagnosis: &Diagnosis, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::diagnosis(diagnosis),
        _ => page(&view::Page::of_diagnosis(diagnosis, context), format, context),
    }
}

/// `ladder`.
#[must_use]
pub fn render_ladder(ladder: &Ladder, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::ladder(ladder),
        _ => page(&view::Page::of_ladder(ladder, context), format, context),
    }
}

/// `add` and `remove`: before and after.
#[must_use]
pub fn render_change(change: &Change, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::change(change),
        _ => page(&view::Page::of_change(change, context), format, context),
    }
}

/// `compare --against`: side by side.
#[must_use]
pub fn render_against(against: &Against, format: Format, context: &Context) -> String {
    match format {
        Format::Json => json::against(against),
        _ => page(&view::Page::of_against(against, context), format, context),
    }
}

fn page(page: &view::Page, format: Format, context: &Context) -> String {
    let page = &view::Page { warning: context.warning.clone(), ..page.clone() };
    if format == Format::Html { html::render(page) } else { text::render(page, context.terminal) }
}

#[cfg(test)]
mod tests;
