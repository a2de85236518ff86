//! Words as they stand in registers, in hexadecimal digits without a sign before them, as the numbers that they mean.
//!
//! ```text
//! 00002152 FE82 F524                 →        column_1,column_2,column_3
//!                                             8530,-382,-2780
//! T=0x00002152 X=0xFE82 Y=0xF524     →        T,X,Y
//!                                             8530,-382,-2780
//! ```
//!
//! Words of 4 and 8 digits are signed, as readings of sensors are; a counter that passes the middle of its range goes on from its other end.

use super::{Shape, write_row};

/// Lines that are enough, and their share of all that are not blank.
const FEWEST: usize = 8;
const SHARE: f64 = 0.95;
/// At least one line in so many has a letter among its digits, or all words have `0x` before them: others are decimal.
const LETTERS: usize = 4;

/// Lines of such words as lines of a CSV.
pub struct Hex {
    /// Digits of each word.
    lengths: Vec<usize>,
    names: Vec<String>,
    is_headed: bool,
}

/// A word, with what stands before it.
struct Word<'a> {
    name: &'a [u8],
    is_marked: bool,
    digits: &'a [u8],
}

/// The parts of a line.
fn parts(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| matches!(b, b' ' | b'\t' | b',' | b';')).map(<[u8]>::trim_ascii).filter(|part| !part.is_empty())
}

/// The words of a line, all with a name or none; `None` where a part is no word.
fn words(line: &[u8]) -> Option<Vec<Word<'_>>> {
    let (mut words, mut before): (Vec<Word>, &[u8]) = (Vec::new(), b"");
    for part in parts(line) {
        let (name, text) = match part.iter().position(|b| matches!(b, b'=' | b':')) {
            Some(at) if part[0].is_ascii_alphabetic() => (&part[..at], &part[at + 1..]),
            Some(_) => return None,
            None => (std::mem::take(&mut before), part),
        };
        if text.is_empty() {
            before = name;
            continue;
        }
        let marked = text.strip_prefix(b"0x").or_else(|| text.strip_prefix(b"0X"));
        let digits = marked.unwrap_or(text);
        if !matches!(digits.len(), 2 | 4 | 6 | 8 | 16) || !digits.iter().all(u8::is_ascii_hexdigit) {
            return None;
        }
        words.push(Word { name, is_marked: marked.is_some(), digits });
    }
    let named = words.iter().filter(|word| !word.name.is_empty()).count();
    (words.len() > 1 && (named == 0 || named == words.len())).then_some(words)
}

fn lengths(words: &[Word]) -> Vec<usize> {
    words.iter().map(|word| word.digits.len()).collect()
}

/// The number that a word means.
fn value(digits: &[u8]) -> Option<i128> {
    let bits = std::str::from_utf8(digits).ok().and_then(|text| u64::from_str_radix(text, 16).ok())?;
    Some(match digits.len() {
        4 => i128::from((bits as u16).cast_signed()),
        8 => i128::from((bits as u32).cast_signed()),
        _ => i128::from(bits),
    })
}

impl Hex {
    /// What lines like these are: words of the same lengths, some with letters.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let filled: Vec<&[u8]> = lines.iter().copied().filter(|line| !line.is_empty()).collect();
        let last = filled.iter().rev().find_map(|line| words(line))?;
        let own = lengths(&last);
        let rows = filled.iter().filter_map(|line| words(line)).filter(|words| lengths(words) == own);
        let (mut of, mut sure) = (0, 0);
        for words in rows {
            of += 1;
            let has_letter = words.iter().any(|word| word.digits.iter().any(u8::is_ascii_alphabetic));
            sure += usize::from(has_letter || words.iter().all(|word| word.is_marked));
        }
        // Bytes alone may be any dump.
        let is_wide = own.iter().filter(|length| **length > 2).count() > 1;
        let is_one = of >= FEWEST && of as f64 > SHARE * filled.len() as f64 && LETTERS * sure > filled.len();
        let text = |name: &[u8]| String::from_utf8_lossy(name).into_owned();
        // The names stand before the words, or in a line above them.
        let above: Vec<&[u8]> =
            filled.iter().find(|line| words(line).is_none()).map_or_else(Vec::new, |line| parts(line).collect());
        let is_name = |part: &&[u8]| part[0].is_ascii_alphabetic() || part[0] == b'_';
        let names = match (&last[0].name, &above) {
            (name, _) if !name.is_empty() => last.iter().map(|word| text(word.name)).collect(),
            (_, above) if above.len() == own.len() && above.iter().all(is_name) => {
                above.iter().map(|name| text(name)).collect()
            }
            _ => (1..=own.len()).map(|k| format!("column_{k}")).collect(),
        };
        (is_one && is_wide).then_some(Self { lengths: own, names, is_headed: false })
    }
}

impl Shape for Hex {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        if !std::mem::replace(&mut self.is_headed, true) {
            write_row(out, &self.names);
        }
        let line = line.trim_ascii();
        if let Some(words) = words(line).filter(|words| lengths(words) == self.lengths) {
            write_row(out, words.iter().map(|word| value(word.digits).map_or_else(String::new, |v| v.to_string())));
        } else if !parts(line).eq(self.names.iter().map(String::as_bytes)) {
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
    fn words_have_the_names_that_stand_before_or_above_them() {
        let read = |lines: Vec<String>| {
            let refs: Vec<&[u8]> = lines.iter().map(String::as_bytes).collect();
            let (mut hex, mut out) = (Hex::of(&refs).unwrap(), Vec::new());
            refs.iter().take(3).for_each(|line| hex.line(line, &mut out));
            String::from_utf8(out).unwrap()
        };
        let before = (0..30_u32).map(|k| format!("T={:08X} X={:04X} E: {:04X}", 0x20E1D + k, 65_526 - k, k));
        assert_eq!(read(before.collect()), "T,X,E\n134685,-10,0\n134686,-11,1\n134687,-12,2\n");
        let marked = (0..30_u32).map(|k| format!("0x{:08x},0x{:04x}", 10 * k, k));
        let above = std::iter::once("t_ms,gz".to_owned()).chain(marked);
        assert_eq!(read(above.collect()), "t_ms,gz\n0,0\n10,1\n");
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
