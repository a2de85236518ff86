//! Frames as lines of text: `candump -l`, what `candump` shows on a screen, and Vector ASC.

use super::{EXTENDED, LONGEST_FRAME};
use crate::text;

/// A frame with data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// When, ns on the writer's own clock; `None` where the line has no time.
    pub time_ns: Option<i64>,
    /// The interface or channel.
    pub bus: &'a [u8],
    /// The identifier, [`EXTENDED`] included.
    pub id: u32,
    data: [u8; LONGEST_FRAME],
    length: usize,
}

impl Frame<'_> {
    /// The bytes.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data[..self.length]
    }
}

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "a box would be an allocation a frame")]
pub enum Line<'a> {
    /// A frame with data.
    Frame(Frame<'a>),
    /// What is right but carries no values: a request, an error frame, a head, a blank line.
    Other,
    /// None of it.
    Broken,
}

/// Who writes such lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writer {
    /// `candump`, to a file or to a screen.
    Candump,
    /// Vector's CANalyzer and whoever writes its ASC.
    Asc,
}

impl Writer {
    /// Who wrote a file that begins like this.
    #[must_use]
    pub fn of(start: &[u8]) -> Option<Self> {
        let line = start.split(|&b| b == b'\n').find(|line| !line.trim_ascii().is_empty())?.trim_ascii();
        let mut words = words(line);
        match (words.next()?, words.next()?) {
            (b"date", day) if [&b"Mon"[..], b"Tue", b"Wed", b"Thu", b"Fri", b"Sat", b"Sun"].contains(&day) => {
                Some(Self::Asc)
            }
            (b"base", b"hex" | b"dec") => Some(Self::Asc),
            _ => is_candump(line).then_some(Self::Candump),
        }
    }
}

/// Whether a line, cut perhaps, is one of `candump`.
fn is_candump(line: &[u8]) -> bool {
    if let Some(rest) = line.strip_prefix(b"(") {
        let Some(end) = rest.iter().position(|&b| b == b')') else { return false };
        return stamp(&rest[..end]).is_some()
            && words(&rest[end + 1..]).next().is_some_and(|bus| bus[0].is_ascii_alphabetic());
    }
    matches!(candump(line), Line::Frame(_))
}

/// Lines one after the other.
#[derive(Clone, Debug)]
pub struct Lines {
    writer: Writer,
    decimal: bool,
    /// Of times that count from the frame before.
    since: Option<i64>,
}

impl Lines {
    /// Of this writer.
    #[must_use]
    pub fn new(writer: Writer) -> Self {
        Self { writer, decimal: false, since: None }
    }

    /// What the next line is.
    pub fn next<'a>(&mut self, line: &'a [u8]) -> Line<'a> {
        let line = line.trim_ascii();
        if line.is_empty() {
            return Line::Other;
        }
        match self.writer {
            Writer::Candump => candump(line),
            Writer::Asc => self.asc(line),
        }
    }

    fn asc<'a>(&mut self, line: &'a [u8]) -> Line<'a> {
        let mut parts = words(line);
        let Some(first) = parts.next() else { return Line::Other };
        let Some(time) = stamp(first) else {
            if first == b"base" {
                let all: Vec<&[u8]> = parts.collect();
                self.decimal = all.first() == Some(&&b"dec"[..]);
                self.since = all.ends_with(&[b"timestamps", b"relative"]).then_some(0);
            }
            // Heads and remarks begin with a word.
            return if first[0].is_ascii_alphabetic() || first.starts_with(b"//") { Line::Other } else { Line::Broken };
        };
        let time = match &mut self.since {
            Some(since) => {
                *since = since.saturating_add(time);
                *since
            }
            None => time,
        };
        asc_frame(time, parts, self.decimal)
    }
}

/// The frame behind the time of a line of ASC; events of other kinds have no values.
fn asc_frame<'a>(time: i64, mut parts: impl Iterator<Item = &'a [u8]>, decimal: bool) -> Line<'a> {
    let Some(mut bus) = parts.next() else { return Line::Broken };
    let fd = bus == b"CANFD";
    if fd {
        let Some(channel) = parts.next() else { return Line::Broken };
        bus = channel;
        parts.next();
    }
    if !bus.iter().all(u8::is_ascii_digit) {
        return Line::Other;
    }
    let Some(id) = parts.next().and_then(|word| asc_id(word, decimal)) else { return Line::Other };
    let length = if fd {
        // A name may stand before the two flags; the length code and the length follow them.
        let Some(next) = parts.next() else { return Line::Broken };
        let flags = if matches!(next, b"0" | b"1") { 2 } else { 3 };
        parts.nth(flags)
    } else {
        parts.next();
        match parts.next() {
            Some(b"d") => {}
            Some(b"r") => return Line::Other,
            _ => return Line::Broken,
        }
        parts.next()
    };
    // A length code above 8 has no longer data than CAN FD's, which is written after it.
    let Some(length) = length.and_then(|word| number(word, 10)) else { return Line::Broken };
    frame(Some(time), bus, id, length as usize, parts, if decimal && !fd { 10 } else { 16 })
}

fn asc_id(word: &[u8], decimal: bool) -> Option<u32> {
    let radix = if decimal { 10 } else { 16 };
    match word.strip_suffix(b"x") {
        Some(id) => number(id, radix).filter(|id| *id < 1 << 29).map(|id| id | EXTENDED),
        None => number(word, radix).filter(|id| *id < 1 << 11),
    }
}

/// A line of `candump`.
fn candump(line: &[u8]) -> Line<'_> {
    let (time_ns, rest) = match line.strip_prefix(b"(") {
        Some(rest) => {
            let Some(end) = rest.iter().position(|&b| b == b')') else { return Line::Broken };
            let Some(time) = stamp(&rest[..end]) else { return Line::Broken };
            (Some(time), &rest[end + 1..])
        }
        None => (None, line),
    };
    let mut parts = words(rest);
    let (Some(bus), Some(second)) = (parts.next(), parts.next()) else { return Line::Broken };
    if let Some(at) = second.iter().position(|&b| b == b'#') {
        return compact(time_ns, bus, &second[..at], &second[at + 1..]);
    }
    // On a screen, with the direction and flags before the identifier where they were asked for.
    let mut id = second;
    let length = loop {
        let Some(word) = parts.next() else { return Line::Broken };
        match word.strip_prefix(b"[").and_then(|word| word.strip_suffix(b"]")) {
            Some(length) => break number(length, 10),
            None => id = word,
        }
    };
    let Some((id, length)) = candump_id(id).zip(length) else { return Line::Broken };
    let mut parts = parts.peekable();
    match id {
        Id::Frame(id) if parts.peek() != Some(&&b"remote"[..]) => frame(time_ns, bus, id, length as usize, parts, 16),
        _ => Line::Other,
    }
}

/// `044#2A366C2BBA`, `12345678##1AABB` (CAN FD: a digit of flags first), `044#R` (a request).
fn compact<'a>(time_ns: Option<i64>, bus: &'a [u8], id: &[u8], data: &[u8]) -> Line<'a> {
    let Some(id) = candump_id(id) else { return Line::Broken };
    let data = match data.split_first() {
        Some((b'R', _)) => return Line::Other,
        Some((b'#', [_, data @ ..])) => data,
        Some((b'#', [])) => return Line::Broken,
        _ => data,
    };
    // Frames of classic CAN may name a length code above 8.
    let data = data.split(|&b| b == b'_').next().unwrap_or_default();
    if data.len() % 2 != 0 {
        return Line::Broken;
    }
    let Id::Frame(id) = id else { return Line::Other };
    frame(time_ns, bus, id, data.len() / 2, data.chunks(2), 16)
}

/// An identifier as `candump` writes it.
enum Id {
    /// Of a frame, [`EXTENDED`] included.
    Frame(u32),
    /// Of what tells of an error.
    Error,
}

fn candump_id(word: &[u8]) -> Option<Id> {
    const ERROR: u32 = 1 << 29;
    match (word.len(), number(word, 16)?) {
        (3, id) if id < 1 << 11 => Some(Id::Frame(id)),
        (8, id) if id < ERROR => Some(Id::Frame(id | EXTENDED)),
        (8, id) if id & ERROR != 0 => Some(Id::Error),
        _ => None,
    }
}

fn frame<'a, 'b>(
    time_ns: Option<i64>,
    bus: &'a [u8],
    id: u32,
    length: usize,
    mut bytes: impl Iterator<Item = &'b [u8]>,
    radix: u32,
) -> Line<'a> {
    let mut data = [0; LONGEST_FRAME];
    let Some(places) = data.get_mut(..length) else { return Line::Broken };
    for place in places {
        let byte = bytes.next().filter(|word| radix == 10 || word.len() == 2).and_then(|word| number(word, radix));
        let Some(byte) = byte.and_then(|byte| u8::try_from(byte).ok()) else { return Line::Broken };
        *place = byte;
    }
    Line::Frame(Frame { time_ns, bus, id, data, length })
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

fn number(word: &[u8], radix: u32) -> Option<u32> {
    let plain = !word.is_empty() && word.iter().all(u8::is_ascii_hexdigit);
    plain.then(|| std::str::from_utf8(word).ok().and_then(|word| u32::from_str_radix(word, radix).ok())).flatten()
}

/// A time in seconds, or a date with a time, ns.
fn stamp(word: &[u8]) -> Option<i64> {
    let digits = |part: &[u8]| !part.is_empty() && part.iter().all(u8::is_ascii_digit);
    let (whole, fraction) = match word.iter().position(|&b| b == b'.') {
        Some(at) => (&word[..at], &word[at + 1..]),
        None => (word, &b"0"[..]),
    };
    if !digits(whole) || !digits(fraction) {
        let is_date = word.len() > 10 && word[4] == b'-';
        return is_date.then(|| text::date_time(word)).flatten().and_then(|ns| i64::try_from(ns).ok());
    }
    let seconds = whole.iter().try_fold(0_i64, |n, b| n.checked_mul(10)?.checked_add(i64::from(b - b'0')))?;
    let ns = fraction.iter().chain(b"000000000").take(9).fold(0_i64, |n, b| 10 * n + i64::from(b - b'0'));
    seconds.checked_mul(1_000_000_000)?.checked_add(ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(writer: Writer, text: &str) -> Option<(Option<i64>, String, u32, Vec<u8>)> {
        match Lines::new(writer).next(text.as_bytes()) {
            Line::Frame(of) => {
                Some((of.time_ns, String::from_utf8_lossy(of.bus).into_owned(), of.id, of.data().to_vec()))
            }
            _ => None,
        }
    }

    #[test]
    fn every_form_of_candump_is_one_frame() {
        let time = 1_436_509_052_249_713_000;
        let data = vec![0x2a, 0x36, 0x6c, 0x2b, 0xba];
        for text in [
            "(1436509052.249713) vcan0 044#2A366C2BBA",
            "(1436509052.249713) vcan0 044#2A366C2BBA R",
            " (1436509052.249713)  vcan0  044   [5]  2A 36 6C 2B BA",
            " (1436509052.249713)  vcan0  RX - -  044   [5]  2A 36 6C 2B BA   '*6l+.'",
            " (1436509052.249713)  vcan0  044  [05]  2A 36 6C 2B BA",
            "(1436509052.249713) vcan0 044##12A366C2BBA\r",
            " (2015-07-10 06:17:32.249713)  vcan0  044   [5]  2A 36 6C 2B BA",
        ] {
            let wanted = (Some(time), "vcan0".to_owned(), 0x44, data.clone());
            assert_eq!(read(Writer::Candump, text), Some(wanted), "{text}");
            assert_eq!(Writer::of(&text.as_bytes()[..text.len().min(64)]), Some(Writer::Candump), "{text}");
        }
        let extended = read(Writer::Candump, "(1.5) can1 18FEF1D5#").unwrap();
        assert_eq!((extended.0, extended.2, extended.3.len()), (Some(1_500_000_000), 0x18fe_f1d5 | EXTENDED, 0));
        assert_eq!(read(Writer::Candump, "  vcan0  044   [1]  2A").unwrap().0, None);
    }

    #[test]
    fn a_vector_log_has_the_same_frames() {
        let mut lines = Lines::new(Writer::Asc);
        assert_eq!(lines.next(b"base hex  timestamps relative"), Line::Other);
        assert_eq!(lines.next(b"// version 8.1.0"), Line::Other);
        let text = b"   0.010000 1  18FEF1D5x       Rx   d 2 0A FF  Length = 0 BitCount = 0";
        for time in [10_000_000, 20_000_000] {
            let Line::Frame(of) = lines.next(text) else { panic!("no frame") };
            assert_eq!((of.time_ns, of.id, of.data()), (Some(time), 0x18fe_f1d5 | EXTENDED, &[0x0a, 0xff][..]));
        }
        assert_eq!(lines.next(b"   0.010000 1  ErrorFrame"), Line::Other);
        assert_eq!(lines.next(b"   0.010000 1  123 Rx d 2 0A"), Line::Broken);
        for fd in ["0 0 2 2", "Name 1 0 2 2"] {
            let text = format!("0.5 CANFD 1 Rx 123 {fd} 01 02 130000 130 200040 0 0 0 0 0");
            assert_eq!(read(Writer::Asc, &text), Some((Some(500_000_000), "1".to_owned(), 0x123, vec![1, 2])), "{fd}");
        }
        let mut decimal = Lines::new(Writer::Asc);
        decimal.next(b"base dec  timestamps absolute");
        let Line::Frame(of) = decimal.next(b"1.0 1 291 Rx d 2 10 255") else { panic!("no frame") };
        assert_eq!((of.id, of.data()), (0x123, &[10, 255][..]));
    }

    #[test]
    fn what_is_no_frame_is_told_from_what_is_broken() {
        for text in [
            "(1.0) vcan0 044#R",
            "(1.0) vcan0 044#R8",
            "(1.0) vcan0 20000088#0000000000000000",
            "(1.0)  can0  044   [0]  remote request",
            "",
        ] {
            assert_eq!(Lines::new(Writer::Candump).next(text.as_bytes()), Line::Other, "{text}");
        }
        for text in [
            "(1.0) vcan0 044#2A3",
            "(1.0) vcan0 0044#2A",
            "(1.0) vcan0",
            "(x) vcan0 044#2A",
            "(1.0)  can0  044   [3]  2A 36",
            "t,gyro_z",
        ] {
            assert_eq!(Lines::new(Writer::Candump).next(text.as_bytes()), Line::Broken, "{text}");
        }
        for text in ["t,gyro_z,ref_angle_z\n", "date time,gx\n", "(t) gyro\n", "0.0 1 2 3\n", "base\n", ""] {
            assert_eq!(Writer::of(text.as_bytes()), None, "{text}");
        }
    }
}
