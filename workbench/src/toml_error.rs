//! What is wrong in a TOML file, with line and caret: for model files, settings and column maps alike.

use std::{fmt, ops::Range, path::Path};

/// An error at a place in a TOML file. The first line of its text says it all; the excerpt below shows where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TomlError {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, in characters, from 1.
    pub column: usize,
    /// What is wrong and what to do.
    pub says: String,
    /// The line in question, with a caret below.
    pub excerpt: String,
}

impl TomlError {
    /// An error at the bytes `span` of `text`.
    #[must_use]
    pub fn at(file: &Path, text: &str, span: Range<usize>, says: impl Into<String>) -> Self {
        let start = floor_boundary(text, span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let end = floor_boundary(text, span.end.clamp(start, line_end));
        let line = text[..start].matches('\n').count() + 1;
        let before = text[line_start..start].chars().count();
        // A line of any length is shown by a window around the place.
        let first = before.saturating_sub(60);
        let shown: String = text[line_start..line_end].trim_end_matches('\r').chars().skip(first).take(120).collect();
        let width = text[start..end].chars().count().clamp(1, 60);
        let number = line.to_string();
        let excerpt = format!(
            "{number} | {}\n{} | {}{}",
            shown.replace('\t', " "),
            " ".repeat(number.len()),
            " ".repeat(before - first),
            "^".repeat(width)
        );
        let says = one_line(&says.into());
        Self { file: file.display().to_string(), line, column: before + 1, says, excerpt }
    }

    /// What the TOML parser itself found.
    #[must_use]
    pub fn syntax(file: &Path, text: &str, error: &toml::de::Error) -> Self {
        Self::at(file, text, error.span().unwrap_or(0..0), error.message())
    }
}

impl fmt::Display for TomlError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} line {} column {}: {}\n{}", self.file, self.line, self.column, self.says, self.excerpt)
    }
}

impl std::error::Error for TomlError {}

/// A foreign text made fit for one line of a terminal: no control characters, at most 80 characters.
#[must_use]
pub fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(80).flat_map(char::escape_debug).collect();
    if text.chars().nth(80).is_some() {
        shown.push('…');
    }
    format!("'{}'", shown.replace("\\'", "'").replace("\\\"", "\""))
}

fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; ")
}

fn floor_boundary(text: &str, index: usize) -> usize {
    let index = index.min(text.len());
    (0..=index).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_stands_under_the_place() {
        let error = TomlError::at(Path::new("m.toml"), "a = 1\nbüro = 2\n", 6..11, "unknown key");
        assert_eq!((error.line, error.column), (2, 1));
        assert_eq!(error.to_string(), "m.toml line 2 column 1: unknown key\n2 | büro = 2\n  | ^^^^");
    }

    #[test]
    fn a_place_past_the_end_and_an_endless_line_are_shown_too() {
        assert_eq!(TomlError::at(Path::new("m"), "", 7..9, "x").line, 1);
        let long = "y".repeat(100_000);
        assert!(TomlError::at(Path::new("m"), &long, 50_000..99_000, "x").to_string().len() < 400);
    }

    #[test]
    fn foreign_text_stays_on_one_line() {
        assert_eq!(quoted("a\nb\u{1b}[31m"), "'a\\nb\\u{1b}[31m'");
        assert!(quoted(&"q".repeat(10_000_000)).len() < 100);
    }
}
