//! Findings in sentences: the last stage, which nothing that decides depends on.
//!
//! A [`Finding`] and its [`Remark`]s become [`Piece`]s of text, each with its [`Role`], so that a report can leave out what it shows in
//! another place and need not take sentences apart. A [`Voice`] says whether a log or a stream is spoken of, and what can be called next.

mod argument;
mod figures;
mod finding;
mod floor;
pub mod headline;
pub mod labels;
mod limits;
mod remark;
#[cfg(test)]
mod tests;

use crate::{
    Axis,
    diagnosis::{AxisResult, DataFault},
    finding::{Finding, Remark},
};
pub use argument::{Argument, shell_word};
pub use finding::pieces;
pub(crate) use floor::floor_source;

/// Who speaks, and of what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Voice {
    /// The command line, of a log.
    #[default]
    Log,
    /// A page or a terminal that watches a stream.
    Stream,
    /// A library, of a log: functions in place of commands.
    Library,
    /// A page that holds a log: what is asked for is pressed.
    Page,
}

impl Voice {
    /// What is judged.
    #[must_use]
    pub const fn log(self) -> &'static str {
        match self {
            Self::Log | Self::Library | Self::Page => "this log",
            Self::Stream => "the motion so far",
        }
    }

    /// The same at the beginning of a sentence.
    #[must_use]
    pub const fn log_first(self) -> &'static str {
        match self {
            Self::Log | Self::Library | Self::Page => "This log",
            Self::Stream => "The motion so far",
        }
    }

    /// Its error is …
    #[must_use]
    pub const fn of_log(self) -> &'static str {
        match self {
            Self::Log | Self::Library | Self::Page => "this log's",
            Self::Stream => "the motion so far's",
        }
    }

    /// Who looks for an effect that is missing.
    const fn searcher(self) -> &'static str {
        match self {
            Self::Log => "`truerate diagnose`",
            Self::Stream => "the search that runs beside the stream",
            Self::Library => "`diagnose`",
            Self::Page => "the search",
        }
    }

    /// How effects that are named are added.
    const fn adding(self, several: bool) -> &'static str {
        match (self, several) {
            (Self::Log, false) => "`truerate ladder` adds it",
            (Self::Log, true) => "`truerate ladder` adds them one by one",
            (Self::Stream | Self::Page, false) => "Add it",
            (Self::Stream | Self::Page, true) => "Add them, one after the other",
            (Self::Library, false) => "`ladder` adds it",
            (Self::Library, true) => "`ladder` adds them one by one",
        }
    }
}

/// What a piece of text is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It names what is missing.
    Name,
    /// It gives the answer in short.
    Lead,
    /// It says what to do next.
    Step,
    /// It says how to tell apart what the headline names.
    Split,
    /// It says what limits the log.
    Limit,
    /// It says that nothing is missing.
    Nothing,
    /// Whatever is said nowhere else.
    More,
}

/// A piece of text and what stands behind it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// What it is for.
    pub role: Role,
    /// The text.
    pub text: String,
    /// `: `, `. `, a full stop or nothing.
    pub end: &'static str,
}

impl Piece {
    pub(crate) fn new(role: Role, text: impl Into<String>, end: &'static str) -> Self {
        Self { role, text: text.into(), end }
    }
}

/// What is said of one axis depends on nothing else.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The axis.
    pub axis: Axis,
    /// What was found.
    pub finding: &'a Finding,
    /// What is said beside it.
    pub remarks: &'a [Remark],
    /// What limits the log.
    pub limited_says: &'a str,
    /// The faults of its data.
    pub faults: &'a [DataFault],
}

impl<'a> From<&'a AxisResult> for Subject<'a> {
    fn from(own: &'a AxisResult) -> Self {
        let AxisResult { axis, finding, remarks, limited_says, data_faults, .. } = own;
        Self { axis: *axis, finding, remarks, limited_says, faults: data_faults }
    }
}

/// The finding in one or two sentences, with what to do next, and the remarks behind it.
#[must_use]
pub fn says<'a>(subject: impl Into<Subject<'a>>, voice: Voice) -> String {
    let subject = subject.into();
    let finding: String = pieces(&subject, voice).into_iter().map(|piece| piece.text + piece.end).collect();
    let remarks = subject.remarks.iter().filter_map(|remark| remark::sentence(remark, &subject, voice));
    remarks.fold(finding, |says, remark| format!("{}. {remark}", says.trim_end_matches('.')))
}

impl AxisResult {
    /// What was found, in words.
    #[must_use]
    pub fn in_words(&self, voice: Voice) -> String {
        says(self, voice)
    }
}

/// What a finding says that is not in the headline, in the label, in what limits the log or in the next command; with its lead where the
/// headline gives another answer.
#[must_use]
pub fn beyond<'a>(subject: impl Into<Subject<'a>>, with_lead: bool, voice: Voice) -> String {
    let subject = subject.into();
    let is_left = |piece: &Piece| piece.role == Role::More || with_lead && piece.role == Role::Lead;
    let left = pieces(&subject, voice).into_iter().filter(is_left);
    let left: Vec<String> = left.map(|piece| (piece.text + piece.end).trim().to_owned()).collect();
    let remarks = subject.remarks.iter().filter_map(|remark| remark::sentence(remark, &subject, voice));
    remarks.fold(left.join(" "), |says, remark| match says.trim_end_matches('.') {
        "" => remark,
        says => format!("{says}. {remark}"),
    })
}

/// The answer in short: what stands first, without what to do about it.
#[must_use]
pub fn lead<'a>(subject: impl Into<Subject<'a>>, voice: Voice) -> String {
    let pieces = pieces(&subject.into(), voice);
    pieces.into_iter().next().map_or_else(String::new, |piece| piece.text)
}
