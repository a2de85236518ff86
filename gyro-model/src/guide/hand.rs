//! A hand, simulated: it makes the manoeuvre that it is told, late, not quite as fast, and with the others' axes trembling; and
//! mends what it is told to mend.

use super::{Correction, Manoeuvre};
use crate::{
    Axis, Row,
    simulate::{Motion, Reference, Sample, Scenario, Simulator},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// From an order to the first motion, s.
const REACTION: (f64, f64) = (0.3, 0.9);
/// How fast it is at first, of what is wanted.
const SPEED: (f64, f64) = (0.5, 1.1);
/// Share of the rate by which other axes, and the rate itself, tremble.
const TREMBLE: f64 = 0.05;
/// Makes its random numbers others than the sensor's.
const STREAM: u64 = 0x6861_6e64;
/// Between two targets, s.
const STEERS: f64 = 0.02;

/// A hand with a sensor in it.
#[derive(Clone, Debug)]
pub struct Hand {
    simulator: Simulator,
    free: bool,
    rate_hz: f64,
    rows: u64,
    order: Option<Manoeuvre>,
    begins: f64,
    speed: f64,
    steered: f64,
    random: ChaCha8Rng,
}

impl Hand {
    /// Holds the scenario's sensor still.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let mut scenario = scenario.clone();
        scenario.motion = Motion::Steered;
        (scenario.sensor.other_rate, scenario.sensor.wobble) = (0.0, scenario.sensor.wobble.min(2e-3));
        Self {
            simulator: Simulator::new(&scenario),
            free: scenario.sensor.reference == Reference::Quaternion,
            rate_hz: scenario.rate_hz,
            rows: 0,
            order: None,
            begins: 0.0,
            speed: 1.0,
            steered: f64::NEG_INFINITY,
            random: ChaCha8Rng::seed_from_u64(scenario.seed ^ STREAM),
        }
    }

    /// Hears what to do now.
    pub fn hear(&mut self, order: Option<Manoeuvre>) {
        if order == self.order {
            return;
        }
        self.order = order;
        self.begins = self.time() + self.random.random_range(REACTION.0..REACTION.1);
        self.speed = self.random.random_range(SPEED.0..SPEED.1);
    }

    /// Hears what is wrong with what it does.
    pub fn mend(&mut self, correction: Correction) {
        match correction {
            Correction::Faster => self.speed *= 1.15,
            Correction::Slower => self.speed *= 0.85,
            Correction::Further | Correction::Move | Correction::OtherAxis | Correction::Still => {}
        }
    }

    fn time(&self) -> f64 {
        self.rows as f64 / self.rate_hz
    }

    /// The next row.
    pub fn step(&mut self) -> Sample {
        let t = self.time();
        if t >= self.steered + STEERS {
            self.steered = t;
            self.steer(t);
        }
        self.rows += 1;
        self.simulator.step()
    }

    /// The simulated sensor.
    #[must_use]
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    fn steer(&mut self, t: f64) {
        // Its time runs with its speed, so that a slow hand goes as far.
        let wanted = self
            .order
            .filter(|_| t >= self.begins)
            .map_or(0.0, |order| self.speed * order.rate_at(self.speed * (t - self.begins)));
        let axis = self.order.map_or(Axis::X, |order| order.axis);
        for own in Axis::ALL {
            let tremble = TREMBLE * wanted * self.random.random_range(-1.0..1.0);
            if own == axis {
                self.simulator.steer(own, wanted + tremble);
            } else if self.free {
                self.simulator.steer(own, tremble);
            }
        }
    }
}

impl Iterator for Hand {
    type Item = Row;

    fn next(&mut self) -> Option<Row> {
        Some(self.step().row)
    }
}
