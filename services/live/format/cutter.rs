//! Bytes as they come, cut into lines.

/// What is kept of a line until its end has come.
#[derive(Debug, Default)]
pub struct Cutter {
    line: Vec<u8>,
    /// The rest of a line that was too long, or begun before we came, is passed over.
    skips: bool,
}

/// What a cutter finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut<'a> {
    /// A line, without its end.
    Line(&'a [u8]),
    /// The beginning of a line that grows longer than it may; the rest of it is passed over.
    TooLong(&'a [u8]),
    /// The end of such a line.
    Passed,
}

impl Cutter {
    /// Takes bytes; a line may have `longest` of them.
    pub fn take(&mut self, bytes: &[u8], longest: usize, mut found: impl FnMut(Cut<'_>)) {
        for piece in bytes.split_inclusive(|&b| b == b'\n') {
            let (text, ends) = piece.strip_suffix(b"\n").map_or((piece, false), |text| (text, true));
            if self.line.len() + text.len() > longest && !self.skips {
                self.line.extend_from_slice(&text[..longest.saturating_sub(self.line.len())]);
                found(Cut::TooLong(&self.line));
                self.skips = true;
            }
            if self.skips {
                self.line.clear();
            } else {
                self.line.extend_from_slice(text);
            }
            if ends {
                self.end(&mut found);
            }
        }
    }

    /// Nothing more of the line that has begun will come.
    pub fn cut(&mut self, mut found: impl FnMut(Cut<'_>)) {
        if !self.line.is_empty() || self.skips {
            self.end(&mut found);
        }
    }

    fn end(&mut self, found: &mut impl FnMut(Cut<'_>)) {
        found(if std::mem::take(&mut self.skips) { Cut::Passed } else { Cut::Line(&self.line) });
        self.line.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::{Cut, Cutter};

    #[test]
    fn lines_are_whole_however_their_bytes_come_and_a_long_one_is_told_once() {
        let text = b"one\n\ntwo two two\nlast";
        for size in 1..text.len() {
            let (mut cutter, mut found) = (Cutter::default(), Vec::new());
            let mut take = |cut: Cut<'_>| {
                found.push(match cut {
                    Cut::Line(line) => String::from_utf8_lossy(line).into_owned(),
                    Cut::TooLong(begins) => format!("too long: {}", String::from_utf8_lossy(begins)),
                    Cut::Passed => "passed".to_owned(),
                });
            };
            for bytes in text.chunks(size) {
                cutter.take(bytes, 8, &mut take);
            }
            cutter.cut(&mut take);
            assert_eq!(found, ["one", "", "too long: two two ", "passed", "last"], "by {size}");
        }
    }
}
