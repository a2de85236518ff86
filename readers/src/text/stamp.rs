//! The time that a terminal or a logger puts before each line.
//!
//! ```text
//! 12:30:00.123 -> gz: 1                                    the Arduino IDE
//! I (1234) imu: gz=1                                       ESP-IDF
//! [00:00:12.345,678] <inf> imu: gz=1                       Zephyr
//! [INFO] [1790000000.123456] [imu]: gz=1                   ROS
//! 2026-05-02 09:14:00,123 - imu - INFO - gz=1              Python
//! May 02 09:14:00.123456 host imu[812]: gz=1               systemd
//! ```

use super::{
    moment,
    number::{Field, Point, value},
};
use std::ops::Range;

/// A time before a line.
pub(crate) struct Stamp {
    /// Where it stands.
    pub time: Range<usize>,
    /// Where the line itself begins.
    pub end: usize,
    /// Whether it is a count of milliseconds.
    pub in_ms: bool,
}

/// A stamp stands within so many bytes, and so many words may follow it.
const LONGEST: usize = 100;
const MOST_WORDS: usize = 8;

/// The stamp before a line.
pub(crate) fn stamp(line: &[u8]) -> Option<Stamp> {
    // Almost no row of a table goes further.
    let begins = line.first()?;
    let may = begins.is_ascii_alphabetic()
        || *begins == b'['
        || line.iter().take(LONGEST).any(|&b| b == b':')
            && line.iter().take(LONGEST).any(|b| matches!(b, b' ' | b'\t'));
    if !may {
        return None;
    }
    arrow(line).or_else(|| counted(line)).or_else(|| logged(line))
}

/// `12:30:00.123 -> …`, of which nothing may be left behind the arrow.
fn arrow(line: &[u8]) -> Option<Stamp> {
    const ARROW: &[u8] = b" ->";
    let at = memchr::memmem::find(&line[..line.len().min(LONGEST)], ARROW)?;
    let end = at + ARROW.len();
    let is_apart = line.get(end).is_none_or(|&b| b == b' ');
    moment::form(&line[..at]).filter(|_| is_apart).map(|_| Stamp {
        time: 0..at,
        end: (end + 1).min(line.len()),
        in_ms: false,
    })
}

/// `I (1234) imu: …`, milliseconds since the start.
fn counted(line: &[u8]) -> Option<Stamp> {
    let [b'E' | b'W' | b'I' | b'D' | b'V', b' ', b'(', rest @ ..] = line else { return None };
    let close = rest.iter().take(LONGEST).position(|&b| b == b')')?;
    let time = &rest[..close];
    let in_ms = !time.is_empty() && time.iter().all(u8::is_ascii_digit);
    let is_time = in_ms || moment::form(time).is_some();
    let end = after_words(line, 3 + close + 1);
    is_time.then_some(Stamp { time: 3..3 + close, end, in_ms })
}

/// A time in brackets, or a date or time of day at the beginning, behind which words of the logger may stand.
fn logged(line: &[u8]) -> Option<Stamp> {
    let mut at = skip_blanks(line, 0);
    let (time, end) = loop {
        if at > LONGEST || at >= line.len() {
            return None;
        }
        if line[at] == b'[' {
            let close = at + line[at..].iter().take(LONGEST).position(|&b| b == b']')?;
            let inside = at + 1..close;
            if let Some(time) = time_in(line, inside.clone(), true) {
                break (time, close + 1);
            }
            if line[inside].iter().any(u8::is_ascii_digit) {
                return None;
            }
            at = skip_blanks(line, close + 1);
            continue;
        }
        let word = word(line, at);
        // `May 02 09:14:00.123`, `Sat May 02 …`: the time of day counts.
        if is_day(&line[word.clone()]) {
            at = skip_blanks(line, word.end);
            let next = self::word(line, at);
            if line[next.clone()].len() <= 2 && line[next.clone()].iter().all(u8::is_ascii_digit) {
                at = skip_blanks(line, next.end);
            }
            continue;
        }
        let date = moment::date(&line[word.clone()]).is_some() && !line[word.clone()].contains(&b':');
        let mut last = if date { self::word(line, skip_blanks(line, word.end)) } else { word.clone() };
        if line[last.clone()].ends_with(b":") {
            last.end -= 1;
        }
        let time = time_in(line, word.start..last.end, false)?;
        let next = self::word(line, skip_blanks(line, last.end));
        match half_or_zone(&line[next.clone()]) {
            Some(true) => break (time.start..next.end, next.end),
            // More than a stamp stands between the separators.
            Some(false) => return None,
            None => break (time, last.end),
        }
    };
    let rest = after_words(line, end);
    // Times between blanks that numbers follow are columns of their own.
    let is_apart = line.get(end).is_none_or(|&b| b == b' ' || b == b':') || line[..end].ends_with(b"]");
    let has_other = || line[rest..].iter().any(|b| matches!(b, b'\t' | b',' | b';' | b'|'));
    let is_bracketed = line[..end].ends_with(b"]");
    let is_column =
        rest < line.len() && !is_bracketed && rest == skip_blanks(line, end) && begins_number(&line[rest..]);
    (is_apart && rest < line.len() && (!is_column || has_other())).then_some(Stamp { time, end: rest, in_ms: false })
}

/// The time in a part of a line: a date with its time of day, a time of day, and in brackets a number of seconds too.
fn time_in(line: &[u8], place: Range<usize>, in_brackets: bool) -> Option<Range<usize>> {
    let text = &line[place.clone()];
    let whole = trimmed(line, place.clone());
    if moment::form(&line[whole.clone()]).is_some() {
        return Some(whole);
    }
    if !in_brackets {
        return None;
    }
    if let Field::Number(x) = value(&line[whole.clone()], Point::Dot) {
        // A single number without a broken part is a level or a count of something.
        return (x >= 0.0 && text.contains(&b'.')).then_some(whole);
    }
    // `[Sat May 02 09:14:00.123 2026]`, and Zephyr's `00:00:12.345,678`.
    let mut at = place.start;
    while at < place.end {
        let word = word(&line[..place.end], at);
        if moment::clock(&line[word.clone()]).is_some() {
            return Some(word);
        }
        at = skip_blanks(line, word.end.max(at + 1));
    }
    None
}

/// Where the line begins behind words of a logger: a level, a source, signs between them.
fn after_words(line: &[u8], from: usize) -> usize {
    let mut at = skip_blanks(line, from);
    let (mut end, mut words) = (at, 0);
    while at < line.len() && words < MOST_WORDS {
        let word = word(line, at);
        let text = &line[word.clone()];
        let next = skip_blanks(line, word.end);
        let is_sign = text.iter().all(|b| matches!(b, b'-' | b'>' | b'|' | b':' | b'=')) && text != b"-";
        let is_dash = text == b"-" || text == "–".as_bytes();
        let is_bracketed = matches!(
            (text.first(), text.iter().rposition(|b| matches!(b, b']' | b'>' | b')'))),
            (Some(b'[' | b'<' | b'('), Some(_))
        ) && !text[1..].first().is_some_and(|b| b.is_ascii_digit() || matches!(b, b'-' | b'.'));
        // A word that no number follows; one with a sign of its value in it is a field.
        let is_word = text.first().is_some_and(u8::is_ascii_alphabetic)
            && !text[..text.len() - 1].iter().any(|b| matches!(b, b'=' | b':' | b',' | b';' | b'|'))
            && !text.ends_with(b"=")
            && next < line.len()
            && !begins_number(&line[next..])
            && !matches!(line[next], b'=' | b':');
        if !(is_sign || is_dash || is_bracketed || is_word) {
            break;
        }
        // Words are the logger's only up to a sign that ends them: `host imu[812]:`, `imu - INFO -`.
        at = next;
        words += 1;
        if is_sign || is_dash || is_bracketed || text.ends_with(b":") {
            end = next;
        }
        // A further one names what follows it.
        if text.ends_with(b":") {
            break;
        }
    }
    if words == MOST_WORDS { skip_blanks(line, from) } else { end }
}

/// Whether a word is the half of the day or the zone of the time before it, and nothing else; `None` where it does not begin so.
fn half_or_zone(word: &[u8]) -> Option<bool> {
    let is_digits = |text: &[u8]| text.len() >= 4 && text[..2].iter().chain(&text[3..4]).all(u8::is_ascii_digit);
    let length = match word {
        [b'A' | b'P' | b'a' | b'p', b'M' | b'm', ..] => 2,
        [b'U', b'T', b'C', ..] | [b'G', b'M', b'T', ..] => 3,
        [b'+' | b'-', rest @ ..] if is_digits(rest) => {
            if rest.get(2) == Some(&b':') {
                6
            } else {
                5
            }
        }
        _ => return None,
    };
    match word.get(length) {
        None => Some(true),
        Some(b',' | b';' | b'|') => Some(false),
        Some(_) => None,
    }
}

/// Whether a text begins with a number.
fn begins_number(text: &[u8]) -> bool {
    let text = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
    let text = text.strip_prefix(b".").unwrap_or(text);
    text.first().is_some_and(u8::is_ascii_digit)
}

/// A day of the week or a month, by its first letters.
fn is_day(word: &[u8]) -> bool {
    const DAYS: &str = "sun mon tue wed thu fri sat jan feb mar apr may jun jul aug sep oct nov dec";
    let lower = word.strip_suffix(b",").unwrap_or(word).to_ascii_lowercase();
    DAYS.split(' ').any(|day| day.as_bytes() == lower)
}

fn skip_blanks(line: &[u8], from: usize) -> usize {
    from + line[from.min(line.len())..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count()
}

/// The word at a place, up to the next blank.
fn word(line: &[u8], from: usize) -> Range<usize> {
    let from = from.min(line.len());
    let length = line[from..].iter().position(|b| matches!(b, b' ' | b'\t')).unwrap_or(line.len() - from);
    from..from + length
}

fn trimmed(line: &[u8], place: Range<usize>) -> Range<usize> {
    let text = &line[place.clone()];
    let before = text.iter().take_while(|b| b.is_ascii_whitespace()).count();
    let after = text[before..].iter().rev().take_while(|b| b.is_ascii_whitespace()).count();
    place.start + before..place.end - after
}

#[cfg(test)]
mod tests {
    use super::stamp;

    #[test]
    fn loggers_stamps_and_words_are_told_from_the_line() {
        for (line, time, rest) in [
            ("12:30:00.123 -> gz: 1", "12:30:00.123", "gz: 1"),
            ("I (1234) imu: gz=1.5 a=3", "1234", "gz=1.5 a=3"),
            ("I (09:14:00.123) imu: gz=1.5", "09:14:00.123", "gz=1.5"),
            ("I (1234) IMU: gyro: x=1 y=2", "1234", "gyro: x=1 y=2"),
            ("[00:00:12.345,678] <inf> imu: gz=1.5 dps", "00:00:12.345,678", "gz=1.5 dps"),
            ("[2026-05-02 09:14:00.123] 1.5, 3", "2026-05-02 09:14:00.123", "1.5, 3"),
            ("[Sat May 02 09:14:00.123 2026] gz: 1", "09:14:00.123", "gz: 1"),
            ("[ INFO] [1790000000.123]: gyro z: 1.5", "1790000000.123", "gyro z: 1.5"),
            ("[INFO] [1790000000.123] [imu_node]: gz=1.5", "1790000000.123", "gz=1.5"),
            ("[   12.345678] imu: gz=1", "12.345678", "gz=1"),
            ("2026-05-02 09:14:00,123 - imu - INFO - gz=1", "2026-05-02 09:14:00,123", "gz=1"),
            ("2026-05-02T09:14:00.123Z host imu[8]: gz: 1", "2026-05-02T09:14:00.123Z", "gz: 1"),
            ("May 02 09:14:00.123456 host imu_node[812]: gyro_z: 1 deg/s", "09:14:00.123456", "gyro_z: 1 deg/s"),
            ("2026-05-02 09:14:00.123 62.9\t0.1", "2026-05-02 09:14:00.123", "62.9\t0.1"),
            ("05/02/2026 09:14:00.123 PM gz=1", "05/02/2026 09:14:00.123 PM", "gz=1"),
            ("2026-05-02 09:14:00.12: IMU {GyrX : 1}", "2026-05-02 09:14:00.12", "IMU {GyrX : 1}"),
            ("09:14:00.123 gz=1 a=2", "09:14:00.123", "gz=1 a=2"),
        ] {
            let found = stamp(line.as_bytes()).expect(line);
            assert_eq!((&line[found.time], &line[found.end..]), (time, rest), "{line}");
        }
    }

    #[test]
    fn a_tables_own_times_are_no_stamps() {
        for line in [
            "2026-05-02 09:14:00.123,1.5,3",
            "2026-05-02 09:14:00.123 1.5 3",
            "2026-05-02T09:14:00Z,1,2",
            "05/02/2026 09:14:00.123 AM,1.5,3",
            "2026-05-02 09:14:00.123 +0200,1.5,3",
            "09:14:00.123;1,5;3",
            "09:14:00 1.5 3",
            "time gyro_z: 1",
            "a -> 1,2",
            "[1, 2, 3]",
            "[0.5, 1.5]",
            "1.5 2.5",
            "t: 0.5 gz: 1",
            "gyro: 1",
            "",
        ] {
            assert!(stamp(line.as_bytes()).is_none(), "{line}");
        }
    }
}
