//! Delimited text: whatever separates its fields, and whatever stands above them.

mod encoding;
mod escapes;
mod fields;
mod head;
mod lines;
mod moment;
mod number;
mod skipped;
mod stamp;
mod table;
#[cfg(test)]
mod tests;

pub use encoding::{decoded, marked, unmarked};
pub use escapes::{Plain, Unescaped, has_escapes};
pub use fields::{CSV, Dialect, Separator, name};
pub use head::{Finder, Head, HeadError};
pub use lines::{LONGEST_LINE, LineError};
pub use moment::{Form, clock, date, date_time, digits, form, last_digit_of_clock};
pub use number::{Field, Point, TimeField, last_digit, time, value};
pub use skipped::{Skip, Skipped};
pub use table::{Sieve, Sifted, Table, TextRow};
pub(crate) use {
    head::{is_number, is_row, units_row},
    lines::Lines as LineReader,
    stamp::stamp,
};
