//! Dates and times of day as text, to nanoseconds.

const SECOND: i128 = 1_000_000_000;
const DAY: i128 = 86_400 * SECOND;

/// How the time of a text is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As a number, whose unit this power of ten makes nanoseconds.
    Number(i32),
    /// Date and time of day, `2016-05-23 21:46:21.5`, with a zone or without.
    DateTime,
    /// The day stands before the month: `23.05.2016 21:46:21`.
    DayFirst,
    /// Time of day or duration, `21:46:21.5`; midnight is passed.
    Clock,
    /// Time of day in one number, `214621.5`, as NMEA 0183 has it; midnight is passed.
    Digits,
    /// Whole seconds in this column, the rest in that of this number, in a unit that this power of ten makes nanoseconds.
    Parts(usize, i32),
    /// The date in this column, the time of day in that of this number.
    DateAndClock(usize),
}

/// The form that a field has, where it is no number.
#[must_use]
pub fn form(field: &[u8]) -> Option<Form> {
    if clock(field).is_some() {
        return Some(Form::Clock);
    }
    let (_, day_first) = date(field)?;
    (date_time(field).is_some()).then_some(if day_first { Form::DayFirst } else { Form::DateTime })
}

/// `h:m:s`, `m:s` with a broken part, as nanoseconds; a colon may stand before the milliseconds, `12:03:04:123`.
#[must_use]
pub fn clock(field: &[u8]) -> Option<i128> {
    let text = field.trim_ascii();
    let (text, afternoon) = match text {
        [rest @ .., b' ', b'P' | b'p', b'M' | b'm'] => (rest, Some(true)),
        [rest @ .., b' ', b'A' | b'a', b'M' | b'm'] => (rest, Some(false)),
        _ => (text, None),
    };
    let (days, text) = days_before(text).unwrap_or((0, text));
    let mut parts = text.split(|&b| b == b':');
    let (first, second, third) = (parts.next()?, parts.next()?, parts.next());
    let fourth = parts.next();
    if parts.next().is_some() {
        return None;
    }
    let (hours, minutes, seconds) = match third {
        Some(third) => (whole(first, 6)?, whole(second, 2)?, third),
        None => (0, whole(first, 4)?, second),
    };
    let seconds = match fourth {
        Some(fine) => whole(seconds, 2)? * SECOND + colon_part(fine)?,
        None => broken(seconds)?,
    };
    if seconds >= 61 * SECOND || third.is_some() && minutes > 59 {
        return None;
    }
    let hours = match afternoon {
        Some(after) => hours % 12 + if after { 12 } else { 0 },
        None => hours,
    };
    Some(days * DAY + (hours * 3600 + minutes * 60) * SECOND + seconds)
}

/// `hhmmss.s` in one number, as nanoseconds.
#[must_use]
pub fn digits(field: &[u8]) -> Option<i128> {
    let text = field.trim_ascii();
    let (hours, minutes, seconds) = (text.get(..2)?, text.get(2..4)?, text.get(4..)?);
    let is_whole = text.get(..6)?.iter().all(u8::is_ascii_digit) && text.get(6).is_none_or(|&b| b == b'.');
    let (hours, minutes, seconds) = (whole(hours, 2)?, whole(minutes, 2)?, broken(seconds)?);
    let is_clock = is_whole && hours < 24 && minutes < 60 && seconds < 61 * SECOND;
    is_clock.then_some((hours * 3600 + minutes * 60) * SECOND + seconds)
}

/// Milliseconds, microseconds or nanoseconds that follow a colon. Two digits would be the frames of a film.
fn colon_part(digits: &[u8]) -> Option<i128> {
    let ns = match digits.len() {
        3 => 1_000_000,
        6 => 1000,
        9 => 1,
        _ => return None,
    };
    Some(whole(digits, 9)? * ns)
}

/// The power of ten of a second of the last digit that a time of day is written with.
#[must_use]
pub fn last_digit_of_clock(field: &[u8]) -> i32 {
    let mut parts = field.rsplit(|&b| b == b':');
    let seconds = parts.next().unwrap_or_default();
    if parts.count() == 3 {
        return -i32::try_from(seconds.iter().take_while(|b| b.is_ascii_digit()).count()).unwrap_or(0);
    }
    let broken = seconds.iter().position(|b| matches!(b, b'.' | b',')).map_or(&b""[..], |at| &seconds[at + 1..]);
    broken.iter().take_while(|b| b.is_ascii_digit()).fold(0, |power, _| power - 1)
}

/// The days of a duration, `2 days 01:02:03`, and what follows them.
fn days_before(text: &[u8]) -> Option<(i128, &[u8])> {
    let (count, rest) = text.split_at_checked(text.iter().position(|&b| b == b' ')?)?;
    let rest = rest.trim_ascii_start();
    let rest = rest.strip_prefix(b"days").or_else(|| rest.strip_prefix(b"day"))?;
    Some((whole(count, 6)?, rest.strip_prefix(b",").unwrap_or(rest).trim_ascii_start()))
}

/// Date and time of day, as nanoseconds from 1970; the zone is taken off.
#[must_use]
pub fn date_time(field: &[u8]) -> Option<i128> {
    let text = field.trim_ascii();
    let (day, _) = date(text)?;
    let at = text.iter().position(|&b| matches!(b, b'T' | b't' | b' ' | b'_'))?;
    let rest = text[at + 1..].trim_ascii();
    let (rest, zone) = zone(rest)?;
    Some(day * DAY + clock(rest)? - zone)
}

/// The day from 1970 that a text begins with, and whether the day stands before the month.
#[must_use]
pub fn date(field: &[u8]) -> Option<(i128, bool)> {
    let text = field.trim_ascii();
    let text = &text[..text.iter().position(|&b| matches!(b, b'T' | b't' | b' ' | b'_')).unwrap_or(text.len())];
    let mut parts = text.split(|b| matches!(b, b'-' | b'/' | b'.'));
    let (a, b, c) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() {
        return None;
    }
    let (year, month, day, day_first) = if let Some(month) = named_month(b) {
        (whole(c, 4)?, month, whole(a, 2)?, true)
    } else if a.len() == 4 {
        (whole(a, 4)?, whole(b, 2)?, whole(c, 2)?, false)
    } else if c.len() == 4 && text.contains(&b'.') {
        (whole(c, 4)?, whole(b, 2)?, whole(a, 2)?, true)
    } else if c.len() == 4 {
        // 05/23/2016 and 23/05/2016: within one log the day hardly changes, and what is no month is the day.
        let (a, b) = (whole(a, 2)?, whole(b, 2)?);
        if a > 12 { (whole(c, 4)?, b, a, true) } else { (whole(c, 4)?, a, b, false) }
    } else {
        return None;
    };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    Some((days(year, month, day), day_first))
}

/// `Mar`, as in `12-Mar-2020`.
fn named_month(text: &[u8]) -> Option<i128> {
    const MONTHS: &[u8; 36] = b"janfebmaraprmayjunjulaugsepoctnovdec";
    let text = text.to_ascii_lowercase();
    let place = MONTHS.chunks(3).position(|month| month == text)?;
    Some(place as i128 + 1)
}

/// Days from 1970-01-01 in the Gregorian calendar, years counted from March.
fn days(year: i128, month: i128, day: i128) -> i128 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    365 * year + leap + (153 * month + 2) / 5 + day - 1 - 719_468
}

/// A time of day without its zone, and how far the zone is ahead.
fn zone(text: &[u8]) -> Option<(&[u8], i128)> {
    if let [rest @ .., b'Z' | b'z'] = text {
        return Some((rest.trim_ascii(), 0));
    }
    if let Some(rest) = text.strip_suffix(b" UTC").or_else(|| text.strip_suffix(b" GMT")) {
        return Some((rest.trim_ascii(), 0));
    }
    let Some(at) = text.iter().rposition(|&b| matches!(b, b'+' | b'-')) else { return Some((text, 0)) };
    let sign = if text[at] == b'-' { -1 } else { 1 };
    let digits: Vec<u8> = text[at + 1..].iter().copied().filter(|&b| b != b':').collect();
    let (hours, minutes) = match digits.len() {
        2 => (whole(&digits, 2)?, 0),
        4 => (whole(&digits[..2], 2)?, whole(&digits[2..], 2)?),
        _ => return None,
    };
    Some((text[..at].trim_ascii(), sign * (hours * 3600 + minutes * 60) * SECOND))
}

/// A whole number of at most so many digits.
fn whole(digits: &[u8], most: usize) -> Option<i128> {
    let digits = digits.trim_ascii();
    (!digits.is_empty() && digits.len() <= most && digits.iter().all(u8::is_ascii_digit))
        .then(|| digits.iter().fold(0, |sum, digit| sum * 10 + i128::from(digit - b'0')))
}

/// Seconds with a broken part after a point or a comma, as nanoseconds, the nearest.
fn broken(text: &[u8]) -> Option<i128> {
    let at = text.iter().position(|b| matches!(b, b'.' | b',')).unwrap_or(text.len());
    let seconds = whole(&text[..at], 2)?;
    let mut digits = text.get(at + 1..).unwrap_or_default().to_vec();
    // Zephyr parts milliseconds and microseconds: `12.345,678`.
    if text.get(at) == Some(&b'.') && digits.len() == 7 && digits[3] == b',' {
        digits.remove(3);
    }
    if !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let digit = |i: usize| digits.get(i).map_or(0, |d| i128::from(d - b'0'));
    let ns = (0..9).fold(0, |sum, i| sum * 10 + digit(i)) + i128::from(digit(9) >= 5);
    Some(seconds * SECOND + ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_moment_in_many_spellings() {
        let wanted = 1_464_039_981_250_000_000;
        for text in [
            "2016-05-23 21:46:21.25",
            "2016-05-23T21:46:21.250Z",
            "2016/05/23 21:46:21,25",
            "23.05.2016 21:46:21.25",
            "05/23/2016 09:46:21.25 PM",
            "23/05/2016 21:46:21.25",
            "23-May-2016 21:46:21.250",
            "2016-05-23T23:46:21.250+02:00",
            "2016-05-23T14:46:21.250-0700",
            "2016-05-23 21:46:21:250",
            "05/23/2016 09:46:21:250000 PM",
        ] {
            assert_eq!(date_time(text.as_bytes()), Some(wanted), "{text}");
        }
        assert_eq!(date_time(b"1970-01-01 00:00:00"), Some(0));
        assert_eq!(date_time(b"2000-02-29 12:00:00"), Some(951_825_600 * SECOND));
    }

    #[test]
    fn times_of_day_and_durations() {
        assert_eq!(clock(b"01:02:03.000000001"), Some(3_723_000_000_001));
        assert_eq!(clock(b"1:02.5"), Some(62_500_000_000));
        assert_eq!(clock(b"1 days 00:00:02.5"), Some(DAY + 2_500_000_000));
        assert_eq!((clock(b"0:00:02:005"), last_digit_of_clock(b"0:00:02:005")), (Some(2_005_000_000), -3));
        assert_eq!(form(b"21:46:21"), Some(Form::Clock));
        assert_eq!((digits(b"091420.10"), digits(b"214621")), (Some(33_260_100_000_000), Some(78_381_000_000_000)));
        for text in ["", "91420.1", "246021", "216021", "2146211", "21462a", "-91420.1"] {
            assert_eq!(digits(text.as_bytes()), None, "{text}");
        }
        assert_eq!((last_digit_of_clock(b"1:02"), last_digit_of_clock(b"2016-05-23 1:02:03,125 PM")), (0, -3));
        assert_eq!(form(b"2016-05-23 21:46:21"), Some(Form::DateTime));
        for text in [
            "",
            ":",
            "1:2:3:4",
            "1:2:3.5:004",
            "12:61:00",
            "2016-05-23",
            "-1:2",
            "12:30:99",
            "a:b:c",
            "1.5",
            "2016-13-01 00:00:00",
        ] {
            assert_eq!(form(text.as_bytes()), None, "{text}");
        }
    }
}
