//! Logs whose truth is known: a moving shaft, a low-cost sensor, any set of hidden effects.
//!
//! The motion is solved in closed form, filters and play run at ten steps a row, and every source of noise has a random
//! stream of its own, so the same scenario gives the same numbers for ever.
//!
//! ```
//! use gyro_model::{Axis, simulate::{Hidden, Scenario, simulate}};
//!
//! let late = Hidden::parse("delay:d=0.012", Axis::X).unwrap();
//! let simulated = simulate(&Scenario { seconds: 10.0, hidden: vec![late], ..Scenario::default() });
//! assert_eq!(simulated.record.len(), 1000);
//! assert_eq!(simulated.truth.axes[0].as_ref().unwrap().effect_ids(), ["scale-factor", "bias", "delay"]);
//! ```

mod body;
mod hidden;
mod injection;
mod motion;
mod noise;
mod random;
mod sensor;
mod set_up;
mod simulator;
#[cfg(test)]
mod tests;

pub use body::GRAVITY;
pub use hidden::{Hidden, HiddenError, hidden};
pub use injection::Injection;
pub use motion::{Instant, Line, Motion, Shaft};
pub use random::RandomCauses;
pub use sensor::{Reference, SensorSpec, Supply, Temperature};
pub use set_up::{Coloured, SetUp};
pub use simulator::{Sample, Simulator};

use crate::{Model, Record};

/// What is simulated.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// How the axis under test moves.
    pub motion: Motion,
    /// Length, s.
    pub seconds: f64,
    /// Rows a second.
    pub rate_hz: f64,
    /// Of everything random.
    pub seed: u64,
    /// The effects that spoil the reading.
    pub hidden: Vec<Hidden>,
    /// The rig.
    pub sensor: SensorSpec,
}

impl Scenario {
    /// The rows that it has: at least one, at most 5·10⁷, which are 11 GB.
    ///
    /// # Errors
    /// Fewer or more, in words.
    pub fn rows(&self) -> Result<usize, String> {
        let rows = (self.seconds * self.rate_hz).round();
        if (1.0..=MOST_ROWS).contains(&rows) {
            return Ok(rows as usize);
        }
        Err(format!("{} s at {} Hz are {rows:e} rows: choose 1 to {MOST_ROWS:e}", self.seconds, self.rate_hz))
    }
}

/// More rows than this are refused rather than swapped to disk: at 220 bytes each, 11 GB.
const MOST_ROWS: f64 = 5e7;

impl Default for Scenario {
    fn default() -> Self {
        Self {
            motion: Motion::default(),
            seconds: 60.0,
            rate_hz: 100.0,
            seed: 1,
            hidden: Vec::new(),
            sensor: SensorSpec::default(),
        }
    }
}

/// A simulated log and the truth behind it.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// The log.
    pub record: Record,
    /// The model that describes the sensor exactly.
    pub truth: Model,
    /// ω at every row, rad/s.
    pub true_rate: Vec<[f64; 3]>,
    /// Its integral, rad.
    pub true_angle: Vec<[f64; 3]>,
}

/// The scenario's log.
#[must_use]
pub fn simulate(scenario: &Scenario) -> Simulated {
    let mut simulator = Simulator::new(scenario);
    let rows = (scenario.seconds * scenario.rate_hz).round() as usize;
    let mut simulated = Simulated {
        record: Record { rows: Vec::with_capacity(rows), ..Record::default() },
        truth: simulator.truth(),
        true_rate: Vec::with_capacity(rows),
        true_angle: Vec::with_capacity(rows),
    };
    for sample in simulator.by_ref().take(rows) {
        simulated.record.rows.push(sample.row);
        simulated.true_rate.push(sample.true_rate);
        simulated.true_angle.push(sample.true_angle);
    }
    simulated
}
