//! The simulated vehicle and what it is held against.

use serde::{Deserialize, Serialize};

/// The simulated vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Simulation {
    /// `sine`, `multisine` or `drive`.
    pub motion: String,
    /// Length, s; without end where it is left out.
    pub seconds: Option<f64>,
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// What it is held against.
    pub reference: SimulatedReference,
    /// Which vehicle and sensor.
    pub seed: u64,
    /// How far the temperature goes up and down, K; as the seed draws it where it is left out.
    pub swing: Option<f64>,
    /// Within what time, s; as the seed draws it where it is left out.
    pub swing_period: Option<f64>,
}

/// What a simulated vehicle's gyro is held against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SimulatedReference {
    /// A shaft encoder on one axis.
    #[default]
    Encoder,
    /// An orientation: all three axes turn and are fitted.
    Orientation,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            motion: "drive".to_owned(),
            seconds: None,
            rate_hz: 1000.0,
            reference: SimulatedReference::default(),
            seed: 1,
            swing: None,
            swing_period: None,
        }
    }
}
