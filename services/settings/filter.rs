//! How kalman filters.

use gyro_model::estimator;
use serde::{Deserialize, Serialize};

/// See the head.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Filter {
    /// Which gain.
    pub gain: Gain,
}

/// The gains that can be chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gain {
    /// The Kalman filter's own.
    #[default]
    Kalman,
    /// The paper's observer with the stationary gain of its equation (8).
    PaperRiccati,
    /// The paper's observer with the gain that it prints.
    PaperPrinted,
}

impl Filter {
    /// The estimator's options.
    #[must_use]
    pub fn options(self) -> estimator::Options {
        let gain = match self.gain {
            Gain::Kalman => estimator::Gain::Kalman,
            Gain::PaperRiccati => estimator::Gain::PaperRiccati,
            Gain::PaperPrinted => estimator::Gain::PaperPrinted,
        };
        estimator::Options { gain, ..estimator::Options::default() }
    }
}
