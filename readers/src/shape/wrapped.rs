//! Rows of numbers with something around them: the address of the sender before each line, brackets around the values of one sensor.
//!
//! ```text
//! 0.01 [ 0.18 -0.70  0.79] 1.5                 0.01,0.18,-0.70,0.79,1.5
//! 10 Matrix([[0.18], [-0.70], [0.79]]) 3   →   10,0.18,-0.70,0.79,3
//! 192.168.4.2:4210 -> 10,0.18,1.5              10,0.18,1.5
//! ```

use super::{Shape, write_row};
use crate::text::{CSV, is_number, is_row, stamp};

/// Rows that are enough, their share of the lines, and fields of each at least.
const FEWEST: usize = 8;
const SHARE: f64 = 0.8;
const FEWEST_FIELDS: usize = 2;
/// What stands between a sender and what it sent.
const ARROW: &str = "->";

/// Rows of numbers as lines of a CSV.
pub enum Wrapped {
    /// Behind this sender.
    Sent(String),
    /// With brackets around some of so many values.
    Bracketed(usize),
}

impl Wrapped {
    /// What lines like these are.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let lines: Vec<&str> = lines.iter().filter_map(|line| std::str::from_utf8(line).ok()).collect();
        let sender = lines.iter().find_map(|line| Some(Self::Sent(sent(line)?.0.to_owned())));
        let bracketed = lines.iter().find_map(|line| Some(Self::Bracketed(values(line)?.len())));
        let is_one = |of: &Self| {
            let is_row = |line: &&&str| of.row(line).is_some_and(|row| row.len() > 1 || sent(line).is_some());
            let count = lines.iter().filter(is_row).count();
            count >= FEWEST && count as f64 >= SHARE * lines.iter().filter(|line| !line.is_empty()).count() as f64
        };
        sender.into_iter().chain(bracketed).find(is_one)
    }

    /// The fields of a line that is a row; of what a sender sent, all in one, a header too.
    fn row<'a>(&self, line: &'a str) -> Option<Vec<&'a str>> {
        match self {
            Self::Sent(sender) => {
                let (_, rest) = line.split_once(ARROW).filter(|(of, _)| of.trim() == sender)?;
                Some(vec![rest.trim()])
            }
            Self::Bracketed(count) => values(line).filter(|values| values.len() == *count),
        }
    }
}

impl Shape for Wrapped {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let text = String::from_utf8_lossy(line);
        match self.row(text.trim_end()) {
            Some(row) if matches!(self, Self::Bracketed(_)) => write_row(out, row),
            Some(row) => {
                out.extend_from_slice(row[0].as_bytes());
                out.push(b'\n');
            }
            None if text.trim().is_empty() => {}
            None => {
                out.extend_from_slice(line);
                out.push(b'\n');
            }
        }
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

/// A sender, which is no time, and the row that it sent.
fn sent(line: &str) -> Option<(&str, &str)> {
    let (sender, rest) = line.split_once(ARROW)?;
    (stamp(line.as_bytes()).is_none() && !sender.trim().is_empty() && is_row(rest.trim().as_bytes()))
        .then(|| (sender.trim(), rest.trim()))
}

/// The numbers of a line, some of them in brackets behind which others follow or before which they stand, and nothing else; a word right
/// before a bracket is the name of a type.
fn values(line: &str) -> Option<Vec<&str>> {
    let line = line.trim();
    let is_bracket = |c: char| matches!(c, '[' | ']' | '(' | ')');
    // Brackets around the whole line are known to a table, and commas beside semicolons may be decimal ones.
    let is_inside = line.starts_with(['[', '(']) && line.matches(is_bracket).count() == 2;
    let may_be_decimal = line.contains(',') && line.contains(';');
    if !line.contains(is_bracket) || is_inside || may_be_decimal || stamp(line.as_bytes()).is_some() {
        return None;
    }
    let mut values = Vec::new();
    let mut rest = line;
    loop {
        rest = rest.trim_start_matches(|c: char| c.is_whitespace() || matches!(c, ',' | ';') || is_bracket(c));
        if rest.is_empty() {
            break;
        }
        let end = rest.find(|c: char| c.is_whitespace() || matches!(c, ',' | ';') || is_bracket(c));
        let (value, after) = rest.split_at(end.unwrap_or(rest.len()));
        let is_type = value.starts_with(char::is_alphabetic) && after.starts_with(['(', '[']);
        if !is_type {
            values.push(value);
        }
        rest = after;
    }
    let are_numbers = values.iter().all(|value| is_number(CSV, value.as_bytes()));
    (are_numbers && values.len() >= FEWEST_FIELDS).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(line: &str) -> Option<String> {
        let lines: Vec<String> = (0..12).map(|k| line.replace('@', &format!("{k}.5"))).collect();
        let lines: Vec<&[u8]> = lines.iter().map(String::as_bytes).collect();
        let mut of = Wrapped::of(&lines)?;
        let mut out = Vec::new();
        of.line(lines[1], &mut out);
        String::from_utf8(out).ok()
    }

    #[test]
    fn senders_and_brackets_are_taken_off() {
        for (line, row) in [
            ("@ [ 0.18 -0.70  @] 3", "1.5,0.18,-0.70,1.5,3\n"),
            ("@ Matrix([[0.18], [-0.70], [@]]) 3", "1.5,0.18,-0.70,1.5,3\n"),
            ("@, array([1, 2, @]), 3", "1.5,1,2,1.5,3\n"),
            ("@ (1, 2, @) nan", "1.5,1,2,1.5,nan\n"),
            ("192.168.4.2:4210 -> @,0.18,3", "1.5,0.18,3\n"),
            ("COM3-> @ 0.18", "1.5 0.18\n"),
        ] {
            assert_eq!(csv(line).as_deref(), Some(row), "{line}");
        }
    }

    #[test]
    fn stamps_and_sentences_are_left_alone() {
        for line in ["12:03:04.1 -> @,1", "[00:00:01.5] 1,@", "gyro [@] deg", "[@,1,2]", "@;(1,5;2,5)", "@,1,2", ""] {
            assert_eq!(csv(line), None, "{line}");
        }
    }
}
