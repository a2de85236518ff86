//! What a text lacks to be a log.

use std::ops::RangeInclusive;

/// What a text lacks, and what makes a log of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Advice {
    /// What its columns hold, and what that is not enough for.
    pub why: String,
    /// The flags that make a log of it.
    pub flags: Vec<String>,
    /// Whether a second file is needed besides.
    pub needs_file: bool,
    /// Whether the sensor was at rest, which has to be said.
    pub at_rest: bool,
    /// The lines that have to be left out.
    pub left_out: Vec<RangeInclusive<u64>>,
}
