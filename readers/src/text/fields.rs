//! One line cut into its fields.

use super::number::{self, Field, Point};
use std::{borrow::Cow, ops::Range};

/// What stands between two fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// One of this byte.
    Byte(u8),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    /// In words.
    #[must_use]
    pub fn says(self) -> &'static str {
        match self {
            Self::Byte(b';') => "semicolons",
            Self::Byte(b'\t') => "tabs",
            Self::Byte(b'|') => "bars",
            Self::Byte(_) => "commas",
            Self::Blanks => "blanks",
        }
    }
}

/// How the numbers of a text stand in its lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Between two fields.
    pub separator: Separator,
    /// Between whole and broken part of a number.
    pub point: Point,
}

/// As the format of our own logs has it.
pub const CSV: Dialect = Dialect { separator: Separator::Byte(b','), point: Point::Dot };

impl Dialect {
    /// The places of a line's fields, in order; surrounding blanks and quotation marks are not part of them.
    pub fn split(self, line: &[u8], fields: &mut Vec<Range<usize>>) {
        fields.clear();
        match self.separator {
            Separator::Byte(separator) => split_at(line, separator, fields),
            Separator::Blanks => split_at_blanks(line, fields),
        }
    }

    /// A line's fields.
    #[must_use]
    pub fn fields(self, line: &[u8]) -> Vec<&[u8]> {
        let mut places = Vec::new();
        self.split(line, &mut places);
        places.into_iter().map(|place| &line[place]).collect()
    }

    /// The value in a field.
    #[must_use]
    pub fn value(self, field: &[u8]) -> Field {
        number::value(field, self.point)
    }
}

fn split_at(line: &[u8], separator: u8, fields: &mut Vec<Range<usize>>) {
    let mut start = 0;
    loop {
        while start < line.len() && line[start] == b' ' && separator != b' ' {
            start += 1;
        }
        let quoted = line.get(start) == Some(&b'"');
        let mut end = start;
        if quoted {
            end = closing(line, start);
        }
        while end < line.len() && line[end] != separator {
            end += 1;
        }
        fields.push(trimmed(line, start..end));
        if end >= line.len() {
            return;
        }
        start = end + 1;
    }
}

fn split_at_blanks(line: &[u8], fields: &mut Vec<Range<usize>>) {
    let blank = |b: u8| b == b' ' || b == b'\t';
    let mut start = 0;
    loop {
        while start < line.len() && blank(line[start]) {
            start += 1;
        }
        if start >= line.len() {
            return;
        }
        let mut end = if line[start] == b'"' { closing(line, start) } else { start };
        while end < line.len() && !blank(line[end]) {
            end += 1;
        }
        fields.push(trimmed(line, start..end));
        start = end;
    }
}

/// The place after the quotation mark that closes the one at `open`, or the line's end.
fn closing(line: &[u8], open: usize) -> usize {
    let mut at = open + 1;
    while at < line.len() {
        if line[at] != b'"' {
            at += 1;
        } else if line.get(at + 1) == Some(&b'"') {
            at += 2;
        } else {
            return at + 1;
        }
    }
    line.len()
}

fn trimmed(line: &[u8], mut place: Range<usize>) -> Range<usize> {
    while place.start < place.end && line[place.start].is_ascii_whitespace() {
        place.start += 1;
    }
    while place.end > place.start && line[place.end - 1].is_ascii_whitespace() {
        place.end -= 1;
    }
    if place.len() >= 2 && line[place.start] == b'"' && line[place.end - 1] == b'"' {
        place.start += 1;
        place.end -= 1;
    }
    place
}

/// A field as a name: two quotation marks in it stand for one.
#[must_use]
pub fn name(field: &[u8]) -> String {
    let text = String::from_utf8_lossy(field);
    let text: Cow<str> = if text.contains("\"\"") { text.replace("\"\"", "\"").into() } else { text };
    text.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(separator: Separator, line: &str) -> Vec<String> {
        let dialect = Dialect { separator, point: Point::Dot };
        dialect.fields(line.as_bytes()).into_iter().map(name).collect()
    }

    #[test]
    fn fields_lose_their_blanks_and_quotation_marks() {
        let comma = Separator::Byte(b',');
        assert_eq!(cut(comma, " t , \"a, b\",\"say \"\"x\"\"\", "), ["t", "a, b", "say \"x\"", ""]);
        assert_eq!(cut(comma, ""), [""]);
        assert_eq!(cut(comma, "1,,2"), ["1", "", "2"]);
        assert_eq!(cut(comma, "\"open, 1"), ["\"open, 1"]);
    }

    #[test]
    fn any_number_of_blanks_is_one_separator() {
        assert_eq!(cut(Separator::Blanks, "  1 \t 2   \"a b\" "), ["1", "2", "a b"]);
        assert_eq!(cut(Separator::Blanks, "   "), Vec::<String>::new());
        assert_eq!(cut(Separator::Byte(b'\t'), "1\t\t2"), ["1", "", "2"]);
    }
}
