//! A place that rows are given to, and the form that they have there.

use super::text;

/// A place that rows are given to.
pub trait Sink {
    /// Gives a row without waiting; to how many it could not be given.
    fn give(&mut self, bytes: &[u8], form: Form) -> u64;

    /// Does what waits: new receivers, rows without room; whether nothing waits any more.
    fn turn(&mut self, form: Form) -> bool;

    /// Whether more would have to wait too long.
    fn is_full(&self) -> bool {
        false
    }
}

/// The form of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Fixed bytes.
    Binary,
    /// Lines.
    Text,
}

impl Form {
    /// What comes first.
    #[must_use]
    pub fn header(self) -> &'static [u8] {
        if self == Self::Text { text::HEADER.as_bytes() } else { &[] }
    }
}
