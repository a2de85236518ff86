//! Words as they stand in registers, in hexadecimal digits without a sign before them, as the numbers that they mean.
//!
//! ```text
//! 00002152 FE82 F524        →        column_1,column_2,column_3
//!                                    8530,-382,-2780
//! ```
//!
//! Words of 4 and 8 digits are signed, as readings of sensors are; a counter that passes the middle of its range goes on from its other end.

use super::{Shape, write_row};

/// Lines that are enough, and their share of all that are not blank.
const FEWEST: usize = 8;
const SHARE: f64 = 0.95;
/// At least one line in so many has a letter among its digits: others are decimal.
const LETTERS: usize = 4;

/// Lines of such words as lines of a CSV.
pub struct Hex {
    /// Digits of each word.
    lengths: Vec<usize>,
    is_headed: bool,
}

/// The words of a line; `None` where one is none.
fn words(line: &[u8]) -> Option<Vec<&[u8]>> {
    let parts = line.split(|b| matches!(b, b' ' | b'\t' | b',' | b';')).filter(|word| !word.is_empty());
    let words: Vec<&[u8]> = parts.collect();
    let is_word = |word: &&[u8]| matches!(word.len(), 2 | 4 | 6 | 8 | 16) && word.iter().all(u8::is_ascii_hexdigit);
    (words.len() > 1 && words.iter().all(is_word)).then_some(words)
}

fn lengths(words: &[&[u8]]) -> Vec<usize> {
    words.iter().map(|word| word.len()).collect()
}

/// The number that a word means.
fn value(word: &[u8]) -> Option<i128> {
    let bits = std::str::from_utf8(word).ok().and_then(|text| u64::from_str_radix(text, 16).ok())?;
    Some(match word.len() {
        4 => i128::from((bits as u16).cast_signed()),
        8 => i128::from((bits as u32).cast_signed()),
        _ => i128::from(bits),
    })
}

impl Hex {
    /// What lines like these are: words of the same lengths, some with letters.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let filled: Vec<&[u8]> = lines.iter().copied().filter(|line| !line.is_empty()).collect();
        let own = lengths(&filled.iter().rev().find_map(|line| words(line))?);
        let of = filled.iter().filter(|line| words(line).is_some_and(|words| lengths(&words) == own)).count();
        let lettered = filled.iter().filter(|line| line.iter().any(u8::is_ascii_alphabetic)).count();
        // Bytes alone may be any dump.
        let is_wide = own.iter().filter(|length| **length > 2).count() > 1;
        let is_one = of >= FEWEST && of as f64 > SHARE * filled.len() as f64 && LETTERS * lettered > filled.len();
        (is_one && is_wide).then_some(Self { lengths: own, is_headed: false })
    }
}

impl Shape for Hex {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        if !std::mem::replace(&mut self.is_headed, true) {
            write_row(out, (1..=self.lengths.len()).map(|k| format!("column_{k}")));
        }
        let line = line.trim_ascii();
        if let Some(words) = words(line).filter(|words| lengths(words) == self.lengths) {
            write_row(out, words.into_iter().map(|word| value(word).map_or_else(String::new, |v| v.to_string())));
        } else {
            out.extend_from_slice(line);
            out.push(b'\n');
        }
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_the_numbers_that_they_mean() {
        let lines: Vec<String> =
            (0..20_u32).map(|k| format!("{:08X} {:04X} {:04x}", 10 * k, 65_526 - k, 3 * k)).collect();
        let refs: Vec<&[u8]> = lines.iter().map(String::as_bytes).collect();
        let mut hex = Hex::of(&refs).unwrap();
        let mut out = Vec::new();
        refs.iter().take(2).for_each(|line| hex.line(line, &mut out));
        assert_eq!(String::from_utf8(out).unwrap(), "column_1,column_2,column_3\n0,-10,0\n10,-11,3\n");
    }

    #[test]
    fn decimal_numbers_and_dumps_are_none() {
        let decimal: Vec<String> = (0..20).map(|k| format!("{:04} {:04}", 1000 + k, 2000 + k)).collect();
        let dump: Vec<String> = (0..20).map(|k| format!("{k:02X} ab cd ef")).collect();
        for lines in [decimal, dump] {
            assert!(Hex::of(&lines.iter().map(String::as_bytes).collect::<Vec<_>>()).is_none(), "{lines:?}");
        }
    }
}
