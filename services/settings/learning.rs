//! How the compensator learns.

use serde::{Deserialize, Serialize};

/// See the head.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Learning {
    /// The sliding window, s.
    pub window: f64,
    /// Between two solutions, s.
    pub period: f64,
    /// Between two diagnoses of a live stream at least, s; 0 for none.
    pub diagnosis: f64,
    /// The share of one core that solving, and judging, may take while the stream runs.
    pub duty: f64,
    /// Raw rows kept; the oldest go first.
    pub rows: usize,
}

impl Default for Learning {
    fn default() -> Self {
        Self { window: 60.0, period: 0.4, diagnosis: 1.0, duty: 0.3, rows: 1_800_000 }
    }
}
