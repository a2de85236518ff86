//! What bytes can be, by name.

use std::str::FromStr;

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Lines of comma-separated fields below a header.
    Csv,
    /// Binary frames with a checksum.
    Frames,
    /// Frames of a CAN bus, as `candump` writes them.
    Candump,
    /// MAVLink 1 and 2.
    Mavlink,
}

impl FromStr for Kind {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "csv" => Ok(Self::Csv),
            "frames" => Ok(Self::Frames),
            "candump" => Ok(Self::Candump),
            _ => Err(()),
        }
    }
}
