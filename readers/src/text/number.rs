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

/// The sign between whole and broken part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Point {
    /// `1.5`
    #[default]
    Dot,
    /// `1,5`
    Comma,
}

impl Point {
    fn byte(self) -> u8 {
        match self {
            Self::Dot => b'.',
            Self::Comma => b',',
        }
    }
}

/// A decimal of at most 19 digits: ±mantissa · 10^exponent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Decimal {
    negative: bool,
    mantissa: u64,
    exponent: i32,
}

/// More digits than these do not surely fit 64 bits.
const FITTING_DIGITS: i32 = 19;

impl Decimal {
    /// `[+-]digits[.digits][e[+-]digits]` and nothing else; `None` for anything that is longer or another thing.
    fn read(bytes: &[u8], point: Point) -> Option<Self> {
        let (negative, bytes) = match bytes {
            [b'-', rest @ ..] => (true, rest),
            [b'+', rest @ ..] => (false, rest),
            _ => (false, bytes),
        };
        let (mut mantissa, mut digits, mut broken, mut i) = (0_u64, 0_i32, None, 0);
        while i < bytes.len() {
            let digit = bytes[i].wrapping_sub(b'0');
            if digit < 10 {
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
                digits = digits.saturating_add(1);
            } else if bytes[i] == point.byte() && broken.is_none() {
                broken = Some(digits);
            } else {
                break;
            }
            i += 1;
        }
        if digits == 0 || digits > FITTING_DIGITS {
            return None;
        }
        let mut exponent = broken.map_or(0, |whole: i32| whole - digits);
        if i < bytes.len() {
            let (b'e' | b'E') = bytes[i] else { return None };
            let (sign, written) = match &bytes[i + 1..] {
                [b'-', rest @ ..] => (-1, rest),
                [b'+', rest @ ..] | rest => (1, rest),
            };
            if written.is_empty() || written.len() > 4 || !written.iter().all(u8::is_ascii_digit) {
                return None;
            }
            exponent += sign * written.iter().fold(0, |sum, digit| sum * 10 + i32::from(digit - b'0'));
        }
        Some(Self { negative, mantissa, exponent })
    }

    /// As a double, where one multiplication or division of exact numbers gives the nearest.
    fn exact(self) -> Option<f64> {
        if self.mantissa > 1 << 53 {
            return None;
        }
        let power = |exponent: i32| POWERS.get(exponent.unsigned_abs() as usize);
        let whole = self.mantissa as f64;
        let size = if self.exponent < 0 { whole / power(self.exponent)? } else { whole * power(self.exponent)? };
        Some(if self.negative { -size } else { size })
    }

    /// In units of 10^-`exponent` of its own, rounded half away from zero; `None` where that has more than 18 digits.
    fn scaled(self, exponent: i32) -> Option<i128> {
        let shift = self.exponent.checked_add(exponent)?;
        let whole = i128::from(self.mantissa);
        let size = match shift {
            0..=9 => whole * 10_i128.pow(shift.unsigned_abs()),
            -18..0 => {
                let divisor = 10_u64.pow(shift.unsigned_abs());
                i128::from(self.mantissa / divisor + u64::from(self.mantissa % divisor >= divisor / 2))
            }
            _ => return None,
        };
        Some(if self.negative { -size } else { size })
    }
}

/// Powers of ten that are exact as doubles.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Reads a value.
#[must_use]
pub fn value(bytes: &[u8], point: Point) -> Field {
    let bytes = bytes.trim_ascii();
    if bytes.is_empty() {
        return Field::Empty;
    }
    if let Some(x) = Decimal::read(bytes, point).and_then(Decimal::exact) {
        return Field::Number(x);
    }
    let parsed = match point {
        Point::Dot => std::str::from_utf8(bytes).ok().and_then(|text| text.parse::<f64>().ok()),
        Point::Comma if bytes.contains(&b'.') => None,
        Point::Comma => std::str::from_utf8(bytes).ok().and_then(|text| text.replace(',', ".").parse::<f64>().ok()),
    };
    match parsed {
        Some(x) if x.is_finite() => Field::Number(x),
        Some(x) if x.is_nan() => Field::Nan,
        Some(_) => Field::Infinite,
        None => unusual(bytes, point),
    }
}

/// What programs write where there is no value.
const NO_VALUE: [&str; 16] = [
    "na",
    "n/a",
    "#n/a",
    "<na>",
    "nat",
    "null",
    "none",
    "nil",
    "missing",
    "\\n",
    "?",
    "-",
    "--",
    "nan(ind)",
    "-nan(ind)",
    "1.#qnan",
];

/// A number written as numbers seldom are: a long minus sign, groups of three digits, or a word for no value.
fn unusual(bytes: &[u8], point: Point) -> Field {
    const LONGEST: usize = 40;
    let Some(text) = std::str::from_utf8(bytes).ok().filter(|text| text.len() <= LONGEST) else { return Field::Text };
    let lower = text.to_ascii_lowercase();
    if NO_VALUE.contains(&lower.as_str()) || lower.contains("#ind") || lower.starts_with("-1.#qnan") {
        return Field::Nan;
    }
    if lower.contains("1.#inf") {
        return Field::Infinite;
    }
    // A word as it stands in a register.
    if let Some(digits) = lower.strip_prefix("0x") {
        let word = u64::from_str_radix(digits, 16).ok().filter(|_| !digits.starts_with('+'));
        return word.map_or(Field::Text, |word| Field::Number(word as f64));
    }
    if let Some(rest) = text.strip_prefix('−') {
        return match value(rest.as_bytes(), point) {
            Field::Number(x) => Field::Number(-x),
            _ => Field::Text,
        };
    }
    ungrouped(text, point).map_or(Field::Text, |plain| value(plain.as_bytes(), point))
}

/// A number without the signs between groups of three digits: `12,345.6`, `12.345,6`, `12 345,6`, `12'345.6`.
fn ungrouped(text: &str, point: Point) -> Option<String> {
    const ANYWHERE: [char; 5] = [' ', '\u{a0}', '\u{202f}', '\'', '’'];
    let own = if point == Point::Dot { ',' } else { '.' };
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    let (whole, broken) = digits.split_once(char::from(point.byte())).map_or((digits, None), |(w, b)| (w, Some(b)));
    let sign = whole.chars().find(|c| *c == own || ANYWHERE.contains(c))?;
    let mut groups = whole.split(sign);
    let first = groups.next().filter(|first| (1..=3).contains(&first.len()) && !first.starts_with('0'))?;
    let all = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    // `1.234` amid decimal commas may be a decimal point.
    let is_clear = sign != '.' || broken.is_some() || whole.matches(sign).count() > 1;
    (is_clear && all(first) && groups.all(|group| group.len() == 3 && all(group))).then(|| text.replace(sign, ""))
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
    /// Not a time.
    Text,
}

/// Reads a time that is a number; `exponent` is the power of ten that makes its unit nanoseconds (seconds: 9).
#[must_use]
pub fn time(bytes: &[u8], point: Point, exponent: i32) -> TimeField {
    let bytes = bytes.trim_ascii();
    if let Some(ns) = Decimal::read(bytes, point).and_then(|decimal| decimal.scaled(exponent)) {
        return TimeField::Nanoseconds(ns);
    }
    match value(bytes, point) {
        Field::Empty | Field::Nan | Field::Infinite => TimeField::NoTime,
        Field::Text => TimeField::Text,
        Field::Number(_) => {
            let plain = std::str::from_utf8(bytes).ok().and_then(|text| ungrouped(text, point));
            let bytes = plain.as_ref().map_or(bytes, String::as_bytes);
            decimal(bytes, point, exponent).map_or(TimeField::OutOfRange, TimeField::Nanoseconds)
        }
    }
}

/// The power of ten of the last digit that is written, such as −3 for `12.345` and 4 for `1.73234e+09`.
#[must_use]
pub fn last_digit(bytes: &[u8], point: Point) -> Option<i32> {
    Decimal::read(bytes.trim_ascii(), point).map(|decimal| decimal.exponent)
}

/// Largest exponent of a time in nanoseconds: 10²⁸ ns are 3·10¹¹ years.
const MOST_DIGITS: i32 = 28;

/// A number of any length · 10^exponent, rounded half away from zero. `None` where it exceeds 10²⁸.
fn decimal(bytes: &[u8], point: Point, exponent: i32) -> Option<i128> {
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
    let whole = mantissa.iter().position(|&b| b == point.byte()).unwrap_or(mantissa.len());
    // Place of the digit before the point, as a power of ten of nanoseconds.
    let mut power = i32::try_from(whole).ok()? - 1 + written + exponent;
    let (mut sum, mut round_up) = (0_i128, false);
    for &digit in mantissa.iter().filter(|&&b| b != point.byte()) {
        let digit = i128::from(digit.checked_sub(b'0')?);
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
    use proptest::prelude::*;

    fn ns(text: &str, exponent: i32) -> i128 {
        match time(text.as_bytes(), Point::Dot, exponent) {
            TimeField::Nanoseconds(ns) => ns,
            other => panic!("{text}: {other:?}"),
        }
    }

    fn read(bytes: &[u8]) -> Field {
        value(bytes, Point::Dot)
    }

    #[test]
    fn an_epoch_time_loses_no_nanosecond_in_any_unit() {
        assert_eq!(ns("1763700000123456789", 0), 1_763_700_000_123_456_789);
        assert_eq!(ns("1763700000.123456789", 9), 1_763_700_000_123_456_789);
        assert_eq!(ns("1763700000123456.789", 3), 1_763_700_000_123_456_789);
        assert_eq!(ns("1.763700000123456789e9", 9), 1_763_700_000_123_456_789);
        assert_eq!(ns("001763700000.1234567890000", 9), 1_763_700_000_123_456_789);
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
        let time = |bytes: &[u8]| time(bytes, Point::Dot, 9);
        assert_eq!(time(b""), TimeField::NoTime);
        assert_eq!(time(b" NaN "), TimeField::NoTime);
        assert_eq!(time(b"1e300"), TimeField::OutOfRange);
        assert_eq!(time(b"12:30:00"), TimeField::Text);
        assert_eq!(time("9".repeat(1000).as_bytes()), TimeField::NoTime);
    }

    #[test]
    fn values_empty_nan_infinite_and_text_are_told_apart() {
        assert_eq!(read(b" -1.5e-3\t"), Field::Number(-1.5e-3));
        assert_eq!(read(b""), Field::Empty);
        assert_eq!(read(b"nan"), Field::Nan);
        assert_eq!(read(b"-Infinity"), Field::Infinite);
        assert_eq!(read(b"1e999"), Field::Infinite);
        assert_eq!(read(b"0xFFa3"), Field::Number(65_443.0));
        for text in
            [&b"0x"[..], b"0x1g", b"\xff\xfe", b".", b"1.2.3", b"1e", b"1e5x", b"1 2", b"1,23", b"0,123", b"1,2345"]
        {
            assert_eq!(read(text), Field::Text, "{text:?}");
        }
        assert_eq!(read(&b"9".repeat(1_000_000)), Field::Infinite);
    }

    #[test]
    fn numbers_and_gaps_as_some_programs_write_them() {
        assert_eq!(read("−1.5".as_bytes()), Field::Number(-1.5));
        assert_eq!(read(b"-12,345.5"), Field::Number(-12_345.5));
        assert_eq!(time(b"1,234,567", Point::Dot, 3), TimeField::Nanoseconds(1_234_567_000));
        for text in ["-1.003,18", "-1\u{a0}003,18", "-1\u{202f}003,18", "-1 003,18", "-1'003,18"] {
            assert_eq!(value(text.as_bytes(), Point::Comma), Field::Number(-1003.18), "{text}");
        }
        assert_eq!(value(b"1.003", Point::Comma), Field::Text, "a decimal point amid decimal commas");
        for text in ["NA", "n/a", "#N/A", "null", "None", "-", "--", "-nan(ind)", "1.#QNAN", "-1.#IND", "?"] {
            assert_eq!(read(text.as_bytes()), Field::Nan, "{text}");
        }
        assert_eq!(read(b"1.#INF"), Field::Infinite);
    }

    #[test]
    fn a_decimal_comma_is_read_where_it_is_one() {
        assert_eq!(value(b"-1,25", Point::Comma), Field::Number(-1.25));
        assert_eq!(value(b"-1,25", Point::Dot), Field::Text);
        assert_eq!(value(b"1.25", Point::Comma), Field::Text);
        assert_eq!(value(b"1,2345678901234567890123", Point::Comma), Field::Number(1.234_567_890_123_456_8));
        assert_eq!(time(b"1763700000,123456789", Point::Comma, 9), TimeField::Nanoseconds(1_763_700_000_123_456_789));
    }

    #[test]
    fn the_last_digit_tells_how_fine_a_time_is_written() {
        assert_eq!(last_digit(b"12.345", Point::Dot), Some(-3));
        assert_eq!(last_digit(b"1.73234e+09", Point::Dot), Some(4));
        assert_eq!(last_digit(b"x", Point::Dot), None);
    }

    proptest! {
        #[test]
        fn every_double_is_read_to_the_bit(bits: u64) {
            let x = f64::from_bits(bits);
            prop_assume!(x.is_finite());
            for text in [format!("{x:?}"), format!("{x}"), format!("{x:e}"), format!("{x:.6}"), format!("{x:.3e}")] {
                let Field::Number(found) = read(text.as_bytes()) else { return Err(TestCaseError::fail(text)) };
                prop_assert_eq!(found.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{}", text);
            }
        }

        #[test]
        fn short_and_long_way_agree_on_times(whole in -99_999_999_999_i64..99_999_999_999, broken in "[0-9]{0,12}", exponent in 0_i32..10) {
            let text = format!("{whole}.{broken}");
            let long = decimal(text.as_bytes(), Point::Dot, exponent);
            prop_assert_eq!(Some(ns(&text, exponent)), long, "{}", text);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
            for point in [Point::Dot, Point::Comma] {
                let _ = (value(&bytes, point), time(&bytes, point, 9), last_digit(&bytes, point));
            }
        }
    }
}
