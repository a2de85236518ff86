//! Where samples come from.

use crate::live::{Address, address::AddressError};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use std::{
    fs,
    path::{Path, PathBuf},
    str::FromStr,
};

/// The path that means standard input.
pub(super) const STANDARD_INPUT: &str = "-";

/// See the head.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A simulated vehicle.
    Simulated,
    /// A log that comes while it is read, and only once: standard input (`-`), a pipe.
    Stream(PathBuf),
    /// A log that can be read again.
    Log(PathBuf),
    /// A sensor that goes on by itself: a serial line, the network.
    Live(Address),
}

impl Source {
    /// The log at this path.
    #[must_use]
    pub fn at(path: PathBuf) -> Self {
        let is_file = || fs::metadata(&path).map_or(true, |there| there.is_file() || there.is_dir());
        if path == Path::new(STANDARD_INPUT) || !is_file() { Self::Stream(path) } else { Self::Log(path) }
    }

    /// A source as it is told on a command line, with the DBC file of `--dbc`.
    ///
    /// # Errors
    /// An address that is none.
    pub fn told(text: &str, dbc: Option<&Path>) -> Result<Self, AddressError> {
        match dbc.filter(|_| Address::is_meant(text)) {
            Some(dbc) => Address::of_frames(text, dbc).map(Self::Live),
            None => text.parse(),
        }
    }

    /// Whether what was read of it cannot be read again.
    #[must_use]
    pub fn comes_once(&self) -> bool {
        matches!(self, Self::Stream(_))
    }

    /// Whether it goes on by itself and waits for nobody: each row is given when it comes.
    #[must_use]
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Live(_))
    }
}

impl FromStr for Source {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "sim" => Self::Simulated,
            _ if Address::is_meant(text) => Self::Live(text.parse()?),
            _ if Address::is_misspelt(text) => return Err(AddressError::Scheme(text.to_owned())),
            _ => Self::at(PathBuf::from(text)),
        })
    }
}

impl Serialize for Source {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Simulated => "sim".serialize(serializer),
            Self::Stream(path) | Self::Log(path) => path.serialize(serializer),
            Self::Live(address) => serializer.collect_str(address),
        }
    }
}

impl<'de> Deserialize<'de> for Source {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}
