//! Rows as lines of text, below a header.

use ipc_types::{RateRow, rate::PRESENT};
use std::fmt::Write;

/// The header.
pub const HEADER: &str = "t,rate_x,rate_std_x,rate_y,rate_std_y,rate_z,rate_std_z,flags,epoch\n";

/// Appends a row: seconds, rad/s; an axis without a rate is left empty. The flags are those of the row, and of the axes
/// from bits 8, 16 and 24 on.
pub fn write(row: &RateRow, out: &mut String) {
    let (sign, t) = (if row.valid_ns < 0 { "-" } else { "" }, row.valid_ns.unsigned_abs());
    let _ = write!(out, "{sign}{}.{:09}", t / 1_000_000_000, t % 1_000_000_000);
    let mut flags = u32::from(row.flags);
    for axis in 0..3 {
        flags |= row.axis_flags[axis] << (8 * (axis + 1));
        let _ = match row.axis_flags[axis] & PRESENT {
            0 => write!(out, ",,"),
            _ => write!(out, ",{},{}", row.rate[axis], row.rate_std[axis]),
        };
    }
    let _ = writeln!(out, ",{flags},{}", row.epoch);
}

#[cfg(test)]
mod tests {
    use super::{HEADER, RateRow, write};

    #[test]
    fn a_line_has_a_field_for_every_column() {
        let mut out = String::new();
        let row =
            RateRow { valid_ns: -1_500_000_000, rate: [0.0, 0.0, 0.25], axis_flags: [0, 0, 1], ..RateRow::default() };
        write(&row, &mut out);
        assert_eq!(out, "-1.500000000,,,,,0.25,0,16777216,0\n");
        assert_eq!(out.matches(',').count(), HEADER.matches(',').count());
    }
}
