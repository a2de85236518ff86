//! One value as a field of a CSV.

use crate::columns::Kind;
use parquet::data_type::{ByteArray, FixedLenByteArray, Int96};
use std::io::Write as _;

const DAY: i128 = 86_400_000_000_000;

/// A value that is written as what its column holds.
pub trait Cell {
    /// Adds it to a line; nothing where it is no such value.
    fn write(&self, kind: Kind, line: &mut Vec<u8>);
}

impl Cell for bool {
    fn write(&self, _: Kind, line: &mut Vec<u8>) {
        line.push(b'0' + u8::from(*self));
    }
}

impl Cell for i32 {
    fn write(&self, kind: Kind, line: &mut Vec<u8>) {
        let value = if kind == Kind::Unsigned { i128::from(self.cast_unsigned()) } else { i128::from(*self) };
        whole(value, kind, line);
    }
}

impl Cell for i64 {
    fn write(&self, kind: Kind, line: &mut Vec<u8>) {
        let value = if kind == Kind::Unsigned { i128::from(self.cast_unsigned()) } else { i128::from(*self) };
        whole(value, kind, line);
    }
}

impl Cell for Int96 {
    fn write(&self, kind: Kind, line: &mut Vec<u8>) {
        /// The Julian day of 1970.
        const EPOCH: i128 = 2_440_588;
        let [low, high, day] = *self.data() else { return };
        let ns = i128::from(u64::from(high) << 32 | u64::from(low));
        whole((i128::from(day) - EPOCH) * DAY + ns, kind, line);
    }
}

impl Cell for f32 {
    fn write(&self, kind: Kind, line: &mut Vec<u8>) {
        f64::from(*self).write(kind, line);
    }
}

impl Cell for f64 {
    fn write(&self, _: Kind, line: &mut Vec<u8>) {
        let plain = (1e-5..1e16).contains(&self.abs()) || *self == 0.0 || !self.is_finite();
        // Into memory nothing fails.
        let _ = if plain { write!(line, "{self}") } else { write!(line, "{self:e}") };
    }
}

impl Cell for ByteArray {
    fn write(&self, kind: Kind, line: &mut Vec<u8>) {
        bytes(self.data(), kind, line);
    }
}

impl Cell for FixedLenByteArray {
    fn write(&self, kind: Kind, line: &mut Vec<u8>) {
        bytes(self.data(), kind, line);
    }
}

fn bytes(of: &[u8], kind: Kind, line: &mut Vec<u8>) {
    match kind {
        Kind::Text => text(&String::from_utf8_lossy(of), line),
        Kind::Half => {
            if let Ok(two) = of.try_into() {
                half::f16::from_le_bytes(two).to_f64().write(kind, line);
            }
        }
        // Two's complement, the highest byte first.
        Kind::Decimal(_) if (1..=16).contains(&of.len()) => {
            let sign = if of[0] & 0x80 == 0 { 0 } else { -1 };
            whole(of.iter().fold(sign, |value: i128, &b| value << 8 | i128::from(b)), kind, line);
        }
        _ => {}
    }
}

/// Writes a text as one field, in quotation marks where it needs them.
pub fn text(text: &str, line: &mut Vec<u8>) {
    let plain = text.bytes().map(|b| if b < b' ' { b' ' } else { b });
    if !text.contains([',', '"']) {
        line.extend(plain);
        return;
    }
    line.push(b'"');
    for b in plain {
        if b == b'"' {
            line.push(b'"');
        }
        line.push(b);
    }
    line.push(b'"');
}

fn whole(value: i128, kind: Kind, line: &mut Vec<u8>) {
    // Into memory nothing fails.
    let _ = match kind {
        Kind::Decimal(scale) => write!(line, "{value}e{}", -i64::from(scale)),
        Kind::Moment(ns, digits) => {
            let all = value.saturating_mul(ns);
            day(all.div_euclid(DAY), line);
            line.push(b' ');
            clock(all.rem_euclid(DAY), digits, line)
        }
        Kind::Clock(ns, digits) => clock(value.saturating_mul(ns), digits, line),
        Kind::Day => {
            day(value, line);
            Ok(())
        }
        _ => write!(line, "{value}"),
    };
}

/// Writes a time of day, `12:30:00.5`.
fn clock(ns: i128, digits: usize, line: &mut Vec<u8>) -> std::io::Result<()> {
    let (seconds, rest) = (ns.div_euclid(1_000_000_000), ns.rem_euclid(1_000_000_000));
    let part = rest / 10_i128.pow(9 - u32::try_from(digits).unwrap_or(9));
    let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    write!(line, "{hour:02}:{minute:02}:{second:02}.{part:0digits$}")
}

/// Writes a day since 1970, `2026-11-25`, by the calendar of Gregory: years of 400 repeat, each beginning in March.
fn day(number: i128, line: &mut Vec<u8>) {
    const FROM_YEAR_0: i128 = 719_468;
    let number = number + FROM_YEAR_0;
    let (era, of_era) = (number.div_euclid(146_097), number.rem_euclid(146_097));
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march = (5 * of_year + 2) / 153;
    let (day, month) = (of_year - (153 * march + 2) / 5 + 1, if march < 10 { march + 3 } else { march - 9 });
    let year = era * 400 + year_of_era + i128::from(month < 3);
    let _ = write!(line, "{year:04}-{month:02}-{day:02}");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(cell: &impl Cell, kind: Kind) -> String {
        let mut line = Vec::new();
        cell.write(kind, &mut line);
        String::from_utf8(line).unwrap()
    }

    #[test]
    fn numbers_keep_all_their_digits() {
        for value in [0.1, -1e-300, 123_456_789.123_456_7, 1e300, 0.0, f64::MIN_POSITIVE] {
            assert_eq!(written(&value, Kind::Number).parse::<f64>().unwrap(), value);
        }
        assert_eq!(written(&0.1_f32, Kind::Number).parse::<f64>().unwrap(), f64::from(0.1_f32));
        assert_eq!(written(&f64::NAN, Kind::Number), "NaN");
        assert_eq!(written(&-1_i32, Kind::Unsigned), "4294967295");
        assert_eq!(written(&-1_i64, Kind::Unsigned), "18446744073709551615");
        assert_eq!(written(&true, Kind::Number), "1");
        let bytes = |of: &[u8]| ByteArray::from(of.to_vec());
        assert_eq!(written(&bytes(&[0xff, 0x38]), Kind::Decimal(3)), "-200e-3");
        assert_eq!(written(&bytes(&[0x00, 0x3e]), Kind::Half), "1.5");
        assert_eq!(written(&bytes(b"a \"b\", c"), Kind::Text), "\"a \"\"b\"\", c\"");
    }

    #[test]
    fn times_are_dates_of_the_calendar_and_times_of_day() {
        let us = Kind::Moment(1_000, 6);
        assert_eq!(written(&0_i64, us), "1970-01-01 00:00:00.000000");
        assert_eq!(written(&-1_i64, us), "1969-12-31 23:59:59.999999");
        assert_eq!(written(&1_709_210_096_000_005_i64, us), "2024-02-29 12:34:56.000005");
        assert_eq!(written(&951_868_799_999_i64, Kind::Moment(1_000_000, 3)), "2000-02-29 23:59:59.999");
        assert_eq!(written(&19_782_i32, Kind::Day), "2024-02-29");
        assert_eq!(written(&45_296_000_001_i64, Kind::Clock(1_000, 6)), "12:34:56.000001");
        let mut spark = Int96::new();
        spark.set_data(5, 0, 2_440_588 + 19_782);
        assert_eq!(written(&spark, Kind::Moment(1, 9)), "2024-02-29 00:00:00.000000005");
        // No time of any log, but no panic.
        written(&i64::MIN, Kind::Moment(1_000_000, 3));
        written(&i64::MAX, Kind::Clock(1_000_000, 3));
    }
}
