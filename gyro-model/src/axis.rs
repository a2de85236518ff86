//! A sensor axis.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// One of the three axes of the sensor's body frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis.
    Z,
}

impl Axis {
    /// All axes, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1 or 2: the place of this axis in every array of three.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// `"x"`, `"y"` or `"z"`: the suffix of column names.
    #[must_use]
    pub const fn letter(self) -> &'static str {
        ["x", "y", "z"][self as usize]
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.letter())
    }
}

impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|axis| axis.letter() == text)
            .ok_or_else(|| format!("'{text}' is not an axis: use x, y or z"))
    }
}
