//! What all formats have in common: bytes in, messages of topics out.

use crate::unit::Unit;
use std::{
    fmt,
    io::{self, Read},
};

/// One format of log files.
pub trait Format: Sync {
    /// Its name, for people.
    fn name(&self) -> &'static str;

    /// Whether a file that begins like this is one.
    fn recognises(&self, start: &[u8]) -> bool;

    /// Reads a file from its first byte on. What is whole before a damage is given; the damage is a note.
    ///
    /// # Errors
    /// Nothing of it can be read.
    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable>;

    /// How its bytes become text, where it is a table that is only stored in another way.
    fn as_text(&self) -> Option<AsText> {
        None
    }
}

/// Makes text of a table's bytes.
pub type AsText = fn(&mut dyn Read) -> Result<Converted, Unreadable>;

/// A table as text.
pub struct Converted {
    /// The text.
    pub text: Box<dyn Read + Send>,
    /// What a reader has to know beside it.
    pub notes: Vec<Note>,
}

/// Bytes of a file's beginning that tell its format.
pub const START: usize = 64;

/// Who takes what a file holds.
pub trait Sink {
    /// A topic whose messages follow; `false` where they are not wanted. Topics are numbered from 0 in this order.
    fn topic(&mut self, topic: &Topic) -> bool;

    /// One message of a topic: its time on the log's own clock, ns, and a value a field, NaN where there is none.
    fn message(&mut self, topic: usize, time_ns: i64, values: &[f64]);

    /// Something that a reader has to know.
    fn note(&mut self, note: Note);

    /// Something that the log says of the vehicle, the board or the sensor: `sys_uuid`, `ver_hw`, …
    fn said(&mut self, key: &str, value: &str) {
        let _ = (key, value);
    }
}

/// The kind of the messages of a topic whose rows stand in a text beside those of other topics.
pub const ROW: &str = "row";

/// Messages of one kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topic {
    /// Its name; empty for a table of text.
    pub name: String,
    /// The kind of its messages.
    pub kind: String,
    /// The numbers in each.
    pub fields: Vec<Field>,
}

/// One number of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Its name within the message.
    pub name: String,
    /// Its unit, where the format says it.
    pub unit: Option<Unit>,
}

impl Field {
    /// A field of this name; a unit in brackets is read.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), unit: None }
    }
}

impl Topic {
    /// The full name of a channel.
    #[must_use]
    pub fn channel(&self, field: &Field) -> String {
        if self.name.is_empty() { field.name.clone() } else { format!("{}.{}", self.name, field.name) }
    }
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Bytes from its beginning.
    Byte(u64),
    /// Line, from 1.
    Line(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(at) => write!(f, "byte {at}"),
            Self::Line(line) => write!(f, "line {line}"),
        }
    }
}

/// What a reader has to know of a file beside its messages.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Note {
    /// The file ends within a record: what came before was read.
    #[error("the file breaks off at {at}: all that came before is read")]
    BreaksOff {
        /// Where.
        at: Place,
    },
    /// Bytes that are no record, passed by.
    #[error("{bytes} bytes from {at} on are damaged: passed by")]
    Damaged {
        /// Where.
        at: Place,
        /// How many.
        bytes: u64,
    },
    /// Messages that are not understood.
    #[error("the messages of {topic} are not read ({why})")]
    NotRead {
        /// Whose.
        topic: String,
        /// Why.
        why: &'static str,
    },
    /// Columns of a table that are no readings.
    #[error("not read, for they hold no numbers, times or text: {}", names.join(", "))]
    LeftOut {
        /// Their names.
        names: Vec<String>,
    },
    /// The logger says that it lost messages.
    #[error("the logger lost messages for {milliseconds} ms in all, {count} times")]
    Lost {
        /// How long.
        milliseconds: u64,
        /// How often.
        count: u64,
    },
    /// How the messages' own times lie to those at which the log took them.
    #[error("{topic}: taken into the log {later_ms:.1} ms after their own stamps, give or take {scatter_ms:.1} ms")]
    Stamps {
        /// Whose.
        topic: String,
        /// The mean.
        later_ms: f64,
        /// The standard deviation.
        scatter_ms: f64,
        /// Messages without a stamp: the log's time counts.
        absent: u64,
    },
    /// Lines of a text that are no rows.
    #[error("{} no rows but {kind}, the first at line {line}", if *count == 1 { "1 line is".to_owned() } else { format!("{count} lines are") })]
    Skipped {
        /// What they are.
        kind: crate::text::Skip,
        /// How many.
        count: u64,
        /// The first.
        line: u64,
    },
}

/// Why nothing of a file can be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Unreadable {
    /// The source failed.
    #[error("{0}")]
    Read(#[from] io::Error),
    /// The file is of a version or kind that is not read.
    #[error("{0}")]
    Unknown(&'static str),
    /// No table in a text.
    #[error("{0}")]
    Text(#[from] crate::text::HeadError),
}
