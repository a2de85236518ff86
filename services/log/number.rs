//! Numbers as written: values to f64, times to whole nanoseconds without passing through f64.

/// A field of a data row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field {
    /// A finite number.
    Number(f64),
    /// Left empty: no value at this row.
    Empty,
    /// Written as `nan`: no value at this row.
    Nan,
    /// Infinite, or too large for a double.
    Infinite,
    /// Not a number.
    Text,
}

/// Reads a value.
pub fn value(bytes: &[u8]) -> Field {
    let bytes = bytes.trim_ascii();
    if bytes.is_empty() {
        return Field::Empty;
    }
    match std::str::from_utf8(bytes).ok().and_then(|text| text.parse::<f64>().ok()) {
        Some(x) if x.is_finite() => Field::Number(x),
        Some(x) if x.is_nan() => Field::Nan,
        Some(_) => Field::Infinite,
        None => Field::Text,
    }
}

/// A time as written, in whole nanoseconds, the nearest where it has more digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeField {
    /// Nanoseconds on the log's own clock.
    Nanoseconds(i128),
    /// Empty, `nan` or infinite.
    NoTime,
    /// Beyond ±10²⁸ ns.
    OutOfRange,
    /// Not a number.
    Text,
}

/// Reads a time; `exponent` is the power of ten that makes its unit nanoseconds (seconds: 9).
pub fn time(bytes: &[u8], exponent: i32) -> TimeField {
    match value(bytes) {
        Field::Empty | Field::Nan | Field::Infinite => TimeField::NoTime,
        Field::Text => TimeField::Text,
        Field::Number(_) => decimal(bytes.trim_ascii(), exponent).map_or(TimeField::OutOfRange, TimeField::Nanoseconds),
    }
}

/// Largest exponent of a time in nanoseconds: 10²⁸ ns are 3·10¹¹ years.
const MOST_DIGITS: i32 = 28;

/// `[+-]digits[.digits][e[+-]digits]` · 10^exponent, rounded half away from zero. `None` where it exceeds 10²⁸.
fn decimal(bytes: &[u8], exponent: i32) -> Option<i128> {
    let (negative, bytes) = match bytes {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, bytes),
    };
    let (mantissa, written) = match bytes.iter().position(|b| matches!(b, b'e' | b'E')) {
        // A finite double: an exponent that i32 cannot hold belongs to a zero or to a vanishing number.
        Some(e) => (
            &bytes[..e],
            std::str::from_utf8(&bytes[e + 1..])
                .ok()?
                .parse::<i32>()
                .unwrap_or(-100_000_000)
                .clamp(-100_000_000, 100_000_000),
        ),
        None => (bytes, 0),
    };
    let point = mantissa.iter().position(|&b| b == b'.').unwrap_or(mantissa.len());
    // Place of the digit before the point, as a power of ten of nanoseconds.
    let mut power = i32::try_from(point).ok()? - 1 + written + exponent;
    let (mut sum, mut round_up) = (0_i128, false);
    for &digit in mantissa.iter().filter(|&&b| b != b'.') {
        let digit = i128::from(digit - b'0');
        if power >= 0 && digit != 0 {
            if power > MOST_DIGITS {
                return None;
            }
            sum += digit * 10_i128.pow(power.unsigned_abs());
        } else if power == -1 {
            round_up = digit >= 5;
        }
        power -= 1;
    }
    sum += i128::from(round_up);
    Some(if negative { -sum } else { sum })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ns(text: &str, exponent: i32) -> i128 {
        match time(text.as_bytes(), exponent) {
            TimeField::Nanoseconds(ns) => ns,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn an_epoch_time_loses_no_nanosecond_in_any_unit() {
        assert_eq!(ns("1763700000123456789", 0), 1_763_700_000_123_456_789);
        assert_eq!(ns("1763700000.123456789", 9), 1_763_700_000_123_456_789);
        assert_eq!(ns("1763700000123456.789", 3), 1_763_700_000_123_456_789);
        assert_eq!(ns("1.763700000123456789e9", 9), 1_763_700_000_123_456_789);
    }

    #[test]
    fn times_round_to_the_nearest_nanosecond() {
        assert_eq!(ns("0.01", 9), 10_000_000);
        assert_eq!(ns("-0.0000000005", 9), -1);
        assert_eq!(ns("0.00000000049", 9), 0);
        assert_eq!(ns("1e-3", 9), 1_000_000);
        assert_eq!(ns("+.5", 9), 500_000_000);
        assert_eq!(ns("7.", 9), 7_000_000_000);
        assert_eq!(ns("0e99999999999", 9), 0);
    }

    #[test]
    fn what_is_no_time_is_told_apart() {
        assert_eq!(time(b"", 9), TimeField::NoTime);
        assert_eq!(time(b" NaN ", 9), TimeField::NoTime);
        assert_eq!(time(b"1e300", 9), TimeField::OutOfRange);
        assert_eq!(time(b"12:30:00", 9), TimeField::Text);
        assert_eq!(time("9".repeat(1000).as_bytes(), 9), TimeField::NoTime);
    }

    #[test]
    fn values_empty_nan_infinite_and_text_are_told_apart() {
        assert_eq!(value(b" -1.5e-3\t"), Field::Number(-1.5e-3));
        assert_eq!(value(b""), Field::Empty);
        assert_eq!(value(b"nan"), Field::Nan);
        assert_eq!(value(b"-Infinity"), Field::Infinite);
        assert_eq!(value(b"1e999"), Field::Infinite);
        assert_eq!(value(b"0x10"), Field::Text);
        assert_eq!(value(b"\xff\xfe"), Field::Text);
        assert_eq!(value(&b"9".repeat(1_000_000)), Field::Infinite);
    }
}
