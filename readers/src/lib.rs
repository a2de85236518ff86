//! Logs of gyros in the formats that people have: bytes in, typed channels of timed values out. No file, clock or process:
//! whoever has bytes can read them, a browser too.
//!
//! | module | noun |
//! | --- | --- |
//! | [`mod@format`] | what all formats have in common: topics, messages, notes |
//! | [`formats`] | one format a file, one static list |
//! | [`can`] | CAN: frames as lines, and what a DBC file says of their bits |
//! | `bytes` | bytes taken in order, lengths never trusted |
//! | [`json`] | records of JSON as the CSV that they mean |
//! | [`packed`] | bytes that were packed with zstd |
//! | [`shape`] | text whose lines are no rows of a table, as the CSV that they mean: blocks, long tables, documents |
//! | [`survey`] | what a file holds, channel by channel |
//! | [`meaning`] | what names and units say, and a map to the names of our logs |
//! | [`text`] | delimited text, row by row |
//! | [`mod@unit`] | units as people write them |

mod bytes;
pub mod can;
pub mod format;
pub mod formats;
pub mod json;
pub mod meaning;
pub mod packed;
pub mod shape;
pub mod survey;
pub mod text;
pub mod unit;
