//! A table of text, row by row.

use super::{
    fields::Dialect,
    head::{self, Head, HeadError, is_number},
    lines::{LineError, Lines},
    skipped::{Skip, Skipped},
};
use std::{io::Read, ops::Range};

/// The rows of a text, and what is known of its columns.
pub struct Table<R> {
    lines: Lines<R>,
    sieve: Sieve,
}

/// Tells rows from what stands among them, line by line.
pub struct Sieve {
    head: Head,
    fields: Vec<Range<usize>>,
    skipped: Skipped,
}

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sifted {
    /// A row, whatever the number of its fields.
    Row,
    /// No row.
    Skip(Skip),
    /// Nothing.
    Blank,
}

/// One row.
#[derive(Clone, Copy, Debug)]
pub struct TextRow<'a> {
    bytes: &'a [u8],
    fields: &'a [Range<usize>],
    /// Its line, from 1.
    pub line: u64,
}

impl<'a> TextRow<'a> {
    /// A line whose fields stand at these places.
    #[must_use]
    pub fn new(bytes: &'a [u8], fields: &'a [Range<usize>], line: u64) -> Self {
        Self { bytes, fields, line }
    }

    /// Its fields, in order.
    #[must_use]
    pub fn fields(self) -> impl ExactSizeIterator<Item = &'a [u8]> {
        self.fields.iter().map(move |place| &self.bytes[place.clone()])
    }

    /// The field of a column.
    #[must_use]
    pub fn field(self, column: usize) -> Option<&'a [u8]> {
        self.fields.get(column).map(|place| &self.bytes[place.clone()])
    }
}

impl<R: Read> Table<R> {
    /// Finds the table in a text. `knows` says of names whether they need no further look: then a text is given row by row
    /// as it comes.
    ///
    /// # Errors
    /// There is none, or the source fails.
    pub fn open(source: R, knows: &dyn Fn(&[String]) -> bool) -> Result<Self, HeadError> {
        let (mut lines, mut skipped) = (Lines::new(source), Skipped::default());
        let head = head::find(&mut lines, knows, &mut skipped)?;
        Ok(Self { lines, sieve: Sieve::new(head, skipped) })
    }

    /// What is known of the columns.
    pub fn head(&self) -> &Head {
        &self.sieve.head
    }

    /// How the rows are written.
    pub fn dialect(&self) -> Dialect {
        self.sieve.head.dialect
    }

    /// The lines so far that are no rows.
    pub fn skipped(&self) -> &Skipped {
        &self.sieve.skipped
    }

    /// The source.
    pub fn source(&self) -> &R {
        self.lines.source()
    }

    /// Lines passed so far.
    pub fn line(&self) -> u64 {
        self.lines.passed()
    }

    /// The next row, whatever the number of its fields; `None` at the end.
    ///
    /// # Errors
    /// The source fails, or a line has no end.
    pub fn next_row(&mut self) -> Result<Option<TextRow<'_>>, LineError> {
        loop {
            let Some(line) = self.lines.next()? else { return Ok(None) };
            let sifted = self.sieve.sift(self.lines.bytes(&line), line.number, line.ended);
            if sifted == Sifted::Row {
                return Ok(Some(self.sieve.row(self.lines.bytes(&line), line.number)));
            }
        }
    }
}

impl Sieve {
    /// For the rows below this head; `skipped` is what was passed by above them.
    #[must_use]
    pub fn new(head: Head, skipped: Skipped) -> Self {
        Self { head, fields: Vec::new(), skipped }
    }

    /// What is known of the columns.
    #[must_use]
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// The row that was found in this line last.
    #[must_use]
    pub fn row<'a>(&'a self, line: &'a [u8], number: u64) -> TextRow<'a> {
        TextRow { bytes: line, fields: &self.fields, line: number }
    }

    /// What a line is; one that is no row is counted. `ended` is whether a line end follows it.
    pub fn sift(&mut self, line: &[u8], number: u64, ended: bool) -> Sifted {
        self.head.dialect.split(line, &mut self.fields);
        let trails = self.fields.len() == self.head.names.len() + 1;
        if trails && self.fields.last().is_some_and(Range::is_empty) {
            self.fields.pop();
        }
        let kind = match line.first() {
            None => return Sifted::Blank,
            // A stamp before nothing.
            Some(_) if self.head.dialect.stamped && self.fields.iter().skip(1).all(Range::is_empty) => {
                return Sifted::Blank;
            }
            Some(_) if self.head.dialect.labelled && self.is_mislabelled(line) => Some(Skip::Text),
            // Almost every row of almost every text.
            Some(b'0'..=b'9' | b'-' | b'.') if ended && line.get(1) != Some(&b'-') => None,
            Some(_) if line.trim_ascii().is_empty() => return Sifted::Blank,
            Some(_) => self.no_row(line, ended),
        };
        match kind {
            Some(kind) => {
                self.skipped.add(kind, number);
                Sifted::Skip(kind)
            }
            None => Sifted::Row,
        }
    }

    /// Whether the names before a line's fields are not those of the first row.
    fn is_mislabelled(&self, line: &[u8]) -> bool {
        let labels = self.head.dialect.labels(line);
        let own = self.head.names.iter().map(String::as_bytes);
        labels.len() != own.len()
            || labels.into_iter().zip(own).any(|(label, own)| label.is_some_and(|label| label != own))
    }

    /// What a line is where it is no row.
    fn no_row(&self, bytes: &[u8], ended: bool) -> Option<Skip> {
        if bytes == self.head.raw {
            return Some(Skip::HeaderAgain);
        }
        if head::remark(bytes.trim_ascii()).is_some() || head::is_ruler(bytes) {
            return Some(Skip::Remark);
        }
        if !ended && (self.fields.len() < self.head.names.len() || bytes.contains(&0)) {
            return Some(Skip::Torn);
        }
        // Text at the beginning of a line that is no row in the number of its fields either.
        let begins = |field: &[u8]| !field.is_empty() && !is_number(self.head.dialect, field);
        let first = self.fields.first().is_some_and(|place| begins(&bytes[place.clone()]));
        let usual = self.head.samples.first().and_then(|row| row.first()).is_some_and(|field| !begins(field));
        if first && usual && self.fields.len() != self.head.names.len() {
            return Some(Skip::Text);
        }
        let mut fields =
            self.fields.iter().map(|place| &bytes[place.clone()]).filter(|field| !field.is_empty()).peekable();
        let text = fields.peek().is_some() && fields.all(|field| !is_number(self.head.dialect, field));
        // A column of text may be the only one that has a value.
        (text && (self.fields.len() != self.head.names.len() || self.fields.iter().all(|place| !place.is_empty())))
            .then_some(Skip::Text)
    }
}
