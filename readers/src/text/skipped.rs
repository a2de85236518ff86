//! Lines of a text that are no rows of its table: counted and located.

use std::{collections::BTreeMap, fmt};

/// What a line is that is no row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Skip {
    /// Text above the header.
    Above,
    /// The units of the columns.
    Units,
    /// The header once more.
    HeaderAgain,
    /// A remark among the rows.
    Remark,
    /// Text among the rows.
    Text,
    /// The last row, which breaks off.
    Torn,
}

impl fmt::Display for Skip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Above => "text above the header",
            Self::Units => "the units of the columns",
            Self::HeaderAgain => "the header once more",
            Self::Remark => "remarks",
            Self::Text => "text",
            Self::Torn => "a last row that breaks off",
        })
    }
}

/// How many lines of each kind there are, and where the first stands.
#[derive(Clone, Debug, Default)]
pub struct Skipped(BTreeMap<Skip, (u64, u64)>);

impl Skipped {
    /// One more.
    pub fn add(&mut self, kind: Skip, line: u64) {
        self.0.entry(kind).or_insert((0, line)).0 += 1;
    }

    /// Kinds met so far.
    #[must_use]
    pub fn kinds(&self) -> usize {
        self.0.len()
    }

    /// Kind, number and first line of each kind.
    pub fn iter(&self) -> impl Iterator<Item = (Skip, u64, u64)> {
        self.0.iter().map(|(&kind, &(count, line))| (kind, count, line))
    }
}
