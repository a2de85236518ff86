//! An error that another attempt would only repeat: the supervisor ends the run, and does not start again.

use std::fmt;

/// Wraps such an error.
#[derive(Debug)]
pub struct Hopeless(anyhow::Error);

impl Hopeless {
    /// Marks an error.
    pub fn from_error(error: impl Into<anyhow::Error>) -> anyhow::Error {
        anyhow::Error::new(Self(error.into()))
    }
}

impl fmt::Display for Hopeless {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#}", self.0)
    }
}

impl std::error::Error for Hopeless {}
