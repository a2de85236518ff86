//! One line cut into its fields.

use super::{
    number::{self, Field, Point},
    stamp::stamp,
};
use crate::unit::{self, Quantity, Unit};
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
    /// Whether a time stands before each line, as the Arduino IDE and ESP-IDF put it there: that is the first field.
    pub stamped: bool,
    /// Whether each field begins with its name, `gx: 0.1` or `gx=0.1`; the first one may be the time alone, `12 ms`.
    pub labelled: bool,
    /// Whether units stand behind values, `0.1 sec`, that have no name before them.
    pub united: bool,
}

/// As the format of our own logs has it.
pub const CSV: Dialect = Dialect::new(Separator::Byte(b','), Point::Dot);

impl Dialect {
    /// Of fields without names in lines without stamps.
    #[must_use]
    pub const fn new(separator: Separator, point: Point) -> Self {
        Self { separator, point, stamped: false, labelled: false, united: false }
    }

    /// The same for lines like this one, which may be stamped and its fields labelled.
    #[must_use]
    pub fn dressed(self, line: &[u8]) -> Self {
        let stamped = Self { stamped: stamp(line).is_some(), ..self };
        let labelled = Self { labelled: true, ..stamped };
        let names = labelled.labels(line);
        let times = || labelled.fields(line).first().is_some_and(|first| is_time(first));
        let bare = stamped.stamped || names.first().is_some_and(Option::is_none) && times();
        let all = names.len() > 1 && names.iter().skip(usize::from(bare)).all(Option::is_some);
        // `gyro: x=1 y=2` is a sentence, and so is `x=1, y=2 | t=3`.
        let names_more = |field: &&[u8]| {
            let mut parts = field.split(|b| matches!(b, b',' | b';' | b'|' | b'\t'));
            parts.next().is_some_and(|first| label(first).is_some()) || parts.any(|part| label(part).is_some())
        };
        let all = all && !labelled.fields(line).iter().any(names_more) && !has_carried(&names);
        if all { labelled } else { Self { united: stamped.has_units(line), ..stamped } }
    }

    /// Whether units stand behind the numbers between separators that are no blanks.
    fn has_units(self, line: &[u8]) -> bool {
        let is_united = |field: &[u8]| with_unit(field).is_some_and(|(_, unit)| unit.quantity != Quantity::Other);
        self.separator != Separator::Blanks && self.fields(line).into_iter().any(is_united)
    }

    /// The names before the fields of a line.
    #[must_use]
    pub fn labels(self, line: &[u8]) -> Vec<Option<&[u8]>> {
        let mut places = Vec::new();
        self.cut(line, &mut places);
        places.into_iter().map(|place| label(&line[place]).map(|(name, _)| name)).collect()
    }

    /// The units behind the values of a line's labelled fields, `gz: 1.5 deg/s`.
    #[must_use]
    pub fn units(self, line: &[u8]) -> Vec<Option<Unit>> {
        let mut places = Vec::new();
        self.cut(line, &mut places);
        let milliseconds = stamp(line).is_some_and(|stamp| self.stamped && stamp.in_ms);
        let unit = |place: Range<usize>| {
            let after = label(&line[place.clone()]).map_or(0, |(_, after)| after);
            with_unit(&line[trimmed(line, place.start + after..place.end)]).map(|(_, unit)| unit)
        };
        let mut units: Vec<Option<Unit>> = places.into_iter().map(unit).collect();
        if let Some(first) = units.first_mut().filter(|_| milliseconds) {
            *first = unit::parse("ms");
        }
        units
    }

    /// The places of a line's fields, in order; surrounding blanks and quotation marks are not part of them.
    pub fn split(self, line: &[u8], fields: &mut Vec<Range<usize>>) {
        self.cut(line, fields);
        if self.labelled || self.united {
            for place in fields {
                let named = label(&line[place.clone()]).filter(|_| self.labelled);
                let after = named.map_or(0, |(_, after)| after);
                *place = trimmed(line, place.start + after..place.end);
                if let Some((number, _)) = with_unit(&line[place.clone()]) {
                    place.end = place.start + number.len();
                }
            }
        }
    }

    /// The same with the names that stand before the fields.
    fn cut(self, line: &[u8], fields: &mut Vec<Range<usize>>) {
        fields.clear();
        let mut line = line;
        let mut from = 0;
        if let Some(stamp) = stamp(line).filter(|_| self.stamped) {
            fields.push(stamp.time);
            from = stamp.end;
        }
        line = line.strip_suffix(checksum(line)).unwrap_or(line);
        if let Some((begin, end)) = bracketed(line, from) {
            (from, line) = (begin, &line[..end]);
        }
        if self.labelled {
            // A record of JSON.
            line = line.trim_ascii_end();
            if let Some((begin, end)) = constructed(line, from) {
                (from, line) = (begin, &line[..end]);
            }
            line = line.strip_suffix(b"}").unwrap_or(line);
            from += usize::from(line.get(from) == Some(&b'{'));
        }
        match self.separator {
            Separator::Byte(separator) => split_at(line, from, separator, fields),
            Separator::Blanks => split_at_blanks(line, from, self.labelled, fields),
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

/// What stands between the brackets around a line, as scripts print a list: `[0.5, 1, 2]`, `(0.5, 1, 2),`.
fn bracketed(line: &[u8], from: usize) -> Option<(usize, usize)> {
    let close = match line.get(from)? {
        b'[' => b']',
        b'(' => b')',
        _ => return None,
    };
    let inside = line.trim_ascii_end();
    let inside = inside.strip_suffix(b",").unwrap_or(inside).strip_suffix(&[close])?;
    let is_one = inside.len() > from && !inside[from + 1..].iter().any(|b| matches!(b, b'[' | b'(' | b']' | b')'));
    is_one.then_some((from + 1, inside.len()))
}

/// What stands between the brackets behind the name of a type, as languages print a value of it: `Sample(t=0.5, gz=1)`,
/// `Sample { t: 0.5, gz: 1 }`.
fn constructed(line: &[u8], from: usize) -> Option<(usize, usize)> {
    let text = line.get(from..)?;
    let open = text.iter().position(|b| matches!(b, b'(' | b'[' | b'{'))?;
    let name = text[..open].trim_ascii();
    let is_name = name.first().is_some_and(u8::is_ascii_alphabetic)
        && name.iter().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.' | b':'))
        && !name.ends_with(b":");
    let close = match text[open] {
        b'(' => b')',
        b'[' => b']',
        _ => b'}',
    };
    let inside = text.strip_suffix(&[close])?;
    let is_one = inside.len() > open && !inside[open + 1..].iter().any(|b| b"()[]{}".contains(b));
    (is_name && is_one).then_some((from + open + 1, from + inside.len()))
}

/// The checksum at the end of a sentence as NMEA 0183 has it, `$IMU,1,2*5A`; empty where there is none.
fn checksum(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_end();
    match line {
        [b'$' | b'!', .., b'*', a, b] if a.is_ascii_hexdigit() && b.is_ascii_hexdigit() => &line[line.len() - 3..],
        _ => &[],
    }
}

/// Whether a field without a name may be the time: a number that is not negative.
fn is_time(field: &[u8]) -> bool {
    let digits = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b',');
    field.first().is_some_and(u8::is_ascii_digit) && field.iter().all(digits)
}

/// A number and the unit that stands behind it, after a blank or not; `None` where there is no such unit.
fn with_unit(field: &[u8]) -> Option<(&[u8], Unit)> {
    let of_number = |at: &usize| match field[*at] {
        b'0'..=b'9' | b'+' | b'-' | b'.' | b',' => true,
        b'e' | b'E' => field.get(at + 1).is_some_and(|next| matches!(next, b'0'..=b'9' | b'+' | b'-')),
        _ => false,
    };
    let end = (0..field.len()).take_while(of_number).count();
    let unit = unit(field[end..].trim_ascii())?;
    // `5A` may be a word of hexadecimal digits.
    let is_apart = field[end].is_ascii_whitespace() || unit.quantity != Quantity::Other;
    (end > 0 && is_apart).then_some((&field[..end], unit))
}

/// The unit that a word is: no number, and no sign that stands for none.
fn unit(word: &[u8]) -> Option<Unit> {
    let is_word = word.first().is_some_and(|b| b.is_ascii_alphabetic() || *b >= 0x80 || *b == b'%');
    std::str::from_utf8(word).ok().filter(|_| is_word).and_then(unit::parse)
}

/// The name that a field begins with, and where what follows its colon begins.
fn label(field: &[u8]) -> Option<(&[u8], usize)> {
    let at = field.iter().position(|&b| matches!(b, b':' | b'='))?;
    let name = field[..at].trim_ascii();
    let name = name.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\"")).unwrap_or(name);
    let begins = name.first().is_some_and(|&b| b.is_ascii_alphabetic() || b == b'_' || b >= 0x80);
    (begins && !name.contains(&b'"')).then_some((name, at + 1))
}

/// Whether the letter of an axis follows one of the same sensor, whose name is that of both: `Gyro X: 1, Y: 2`.
fn has_carried(names: &[Option<&[u8]>]) -> bool {
    let is_axis = |b: u8| matches!(b, b'x' | b'y' | b'z' | b'X' | b'Y' | b'Z');
    names.windows(2).any(|pair| match pair {
        [Some([.., b' ' | b'.' | b'_', first]), Some([letter])] => is_axis(*first) && is_axis(*letter),
        _ => false,
    })
}

fn split_at(line: &[u8], from: usize, separator: u8, fields: &mut Vec<Range<usize>>) {
    let mut start = from;
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

fn split_at_blanks(line: &[u8], from: usize, labelled: bool, fields: &mut Vec<Range<usize>>) {
    let blank = |b: u8| b == b' ' || b == b'\t';
    let mut start = from;
    loop {
        while start < line.len() && blank(line[start]) {
            start += 1;
        }
        if start >= line.len() {
            return;
        }
        let mut end = if line[start] == b'"' { closing(line, start) } else { start };
        loop {
            while end < line.len() && !blank(line[end]) {
                end += 1;
            }
            // A blank between name and value separates nothing.
            if !labelled || end >= line.len() || !matches!(line[end - 1], b':' | b'=') {
                break;
            }
            while end < line.len() && blank(line[end]) {
                end += 1;
            }
        }
        // Nor one between a value and its unit.
        if labelled && let Some(unit) = next_word(line, end).filter(|word| unit(&line[word.clone()]).is_some()) {
            end = unit.end;
        }
        fields.push(trimmed(line, start..end));
        start = end;
    }
}

/// The next word from a place on.
fn next_word(line: &[u8], from: usize) -> Option<Range<usize>> {
    let blank = |b: &u8| *b == b' ' || *b == b'\t';
    let start = from + line[from..].iter().position(|b| !blank(b))?;
    let end = line[start..].iter().position(blank).map_or(line.len(), |length| start + length);
    Some(start..end)
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

/// A field as a name: two quotation marks in it stand for one. What is no UTF-8 is Latin-1, as older programs write `°`.
#[must_use]
pub fn name(field: &[u8]) -> String {
    let text: Cow<str> = match std::str::from_utf8(field) {
        Ok(text) => text.into(),
        Err(_) => field.iter().map(|&b| char::from(b)).collect::<String>().into(),
    };
    let text: Cow<str> = if text.contains("\"\"") { text.replace("\"\"", "\"").into() } else { text };
    text.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(separator: Separator, line: &str) -> Vec<String> {
        let dialect = Dialect::new(separator, Point::Dot);
        dialect.fields(line.as_bytes()).into_iter().map(name).collect()
    }

    #[test]
    fn fields_lose_their_blanks_and_quotation_marks() {
        let comma = Separator::Byte(b',');
        assert_eq!(cut(comma, " t , \"a, b\",\"say \"\"x\"\"\", "), ["t", "a, b", "say \"x\"", ""]);
        assert_eq!(cut(comma, ""), [""]);
        assert_eq!(cut(comma, "1,,2"), ["1", "", "2"]);
        assert_eq!(cut(comma, "\"open, 1"), ["\"open, 1"]);
        assert_eq!(name(b"gyro (\xb0/s)"), "gyro (°/s)");
    }

    #[test]
    fn any_number_of_blanks_is_one_separator() {
        assert_eq!(cut(Separator::Blanks, "  1 \t 2   \"a b\" "), ["1", "2", "a b"]);
        assert_eq!(cut(Separator::Blanks, "   "), Vec::<String>::new());
        assert_eq!(cut(Separator::Byte(b'\t'), "1\t\t2"), ["1", "", "2"]);
    }

    #[test]
    fn stamps_and_names_are_taken_off() {
        let dressed = |separator: Separator, line: &'static str| {
            let dialect = Dialect::new(separator, Point::Dot).dressed(line.as_bytes());
            let names =
                dialect.labels(line.as_bytes()).into_iter().map(|name| name.map_or_else(String::new, self::name));
            (dialect.fields(line.as_bytes()).into_iter().map(name).collect::<Vec<_>>(), names.collect::<Vec<_>>())
        };
        let comma = Separator::Byte(b',');
        assert_eq!(dressed(comma, "12:30:00.123 -> 1.5,-2").0, ["12:30:00.123", "1.5", "-2"]);
        for (separator, line) in [
            (comma, "t:0.5,gz: -1"),
            (Separator::Blanks, "t: 0.5  gz: -1"),
            (Separator::Blanks, "t=0.5 gz=-1"),
            (comma, "{\"t\": 0.5, \"gz\": -1}"),
            (comma, "imu.Sample(t=0.5, gz=-1)"),
            (comma, "Sample { t: 0.5, gz: -1 }"),
        ] {
            assert_eq!(
                dressed(separator, line),
                (vec!["0.5".into(), "-1".into()], vec!["t".into(), "gz".into()]),
                "{line}"
            );
        }
        assert_eq!(dressed(Separator::Blanks, "gz: 1.5 deg/s  a: 3").0, ["1.5", "3"]);
        assert_eq!(dressed(Separator::Blanks, "gz:1.5e-1rad/s T:25.3°C n: 3").0, ["1.5e-1", "25.3", "3"]);
        assert_eq!(dressed(comma, "gz=1.5 deg/s, a=3 of 4, id=5A").0, ["1.5", "3 of 4", "5A"]);
        for (separator, line) in [
            (Separator::Byte(b'|'), "12 ms | gyro z = -1.5 °/s | angle: 3 deg"),
            (Separator::Blanks, "12 ms gz=-1.5 angle= 3"),
            (comma, "12, gz: -1.5, angle: 3"),
        ] {
            assert_eq!(dressed(separator, line).0, ["12", "-1.5", "3"], "{line}");
        }
        assert_eq!(dressed(comma, "[0.5, 1, -2],").0, ["0.5", "1", "-2"]);
        assert_eq!(dressed(comma, "0.10 sec,1.5 deg/s,x").0, ["0.10", "1.5", "x"]);
        assert_eq!(dressed(comma, "$IMU,1.5,3*5A").0, ["$IMU", "1.5", "3"]);
        assert_eq!(dressed(comma, "1.5,3*5A").0, ["1.5", "3*5A"]);
        assert_eq!(dressed(comma, "12:30:00,1.5").1, ["", ""]);
        assert_eq!(dressed(Separator::Blanks, "I (1234) imu: gz=1.5 a=3").0, ["1234", "1.5", "3"]);
        assert_eq!(dressed(comma, "a -> 1,2").0, ["a -> 1", "2"]);
    }
}
