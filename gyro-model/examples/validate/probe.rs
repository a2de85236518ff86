//! An effect whose size is one number, on a log that shows it.

use crate::choice::{is_excited, largest_reading, sized};
use gyro_model::{
    effects::{Role, Stage},
    simulate::{Hidden, Motion, Scenario, SensorSpec},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// One effect on one log, its direction and shapes drawn, its size free.
pub struct Probe {
    /// The log, this effect not in it.
    pub scenario: Scenario,
    drawn: Hidden,
    largest: f64,
}

/// A log of 60 s at 100 Hz that shows the effect; `motion` is turned or replaced where it does not.
pub fn scenario(id: &str, motion: Motion, seed: u64) -> Scenario {
    let fits = |seed: &u64| id != "g-squared-sensitivity" || SensorSpec::random(*seed).horizontal;
    let seed = (0..64).map(|k| seed.wrapping_add(k << 40)).find(fits).unwrap_or(seed);
    let scenario = |motion| Scenario { motion, seed, sensor: SensorSpec::random(seed), ..Scenario::default() };
    let asked = scenario(motion);
    if is_excited(id, &asked) { asked } else { scenario(Motion::Drive { rate: 1.8, hold: 1.2 }) }
}

/// The motion on which the size of an effect is measured: both limits need a reading that rests and one that peaks.
pub fn richest(id: &str) -> Motion {
    match id {
        "dead-zone" | "saturation" => Motion::Drive { rate: 1.2, hold: 2.0 },
        _ => Motion::Multisine { travel: 8.0 },
    }
}

impl Probe {
    /// Direction, sign and shapes go by the scenario's seed.
    pub fn new(id: &str, scenario: Scenario) -> Self {
        let drawn = sized(id, &scenario, &mut ChaCha8Rng::seed_from_u64(scenario.seed ^ 0x5157));
        let largest = if id == "saturation" { largest_reading(&scenario) } else { 0.0 };
        Self { scenario, drawn, largest }
    }

    /// Its id.
    pub fn id(&self) -> &'static str {
        self.drawn.effect.card().id
    }

    /// The unit of its size.
    pub fn unit(&self) -> &'static str {
        match self.id() {
            "mount-resonance" => "s² (1/f²)",
            "saturation" => "share cut off the peak",
            _ => self.drawn.effect.parameters(self.scenario.sensor.axis)[0].unit,
        }
    }

    fn coefficients(&self) -> usize {
        let cards = self.drawn.effect.parameters(self.scenario.sensor.axis);
        cards.iter().take_while(|card| card.role == Role::Linear).count()
    }

    /// The size that was drawn for it. Of coefficients it is the root of the sum of squares, of a delay, a time constant
    /// or a width its magnitude, of a resonance 1/f² (to first order the error goes with it), of a saturation the share
    /// of the largest reading that is cut off.
    pub fn drawn(&self) -> f64 {
        let values = &self.drawn.values;
        match (self.id(), self.coefficients()) {
            ("mount-resonance", _) => values[0].powi(-2),
            ("saturation", _) => 1.0 - values[0] / self.largest,
            (_, 0) => values[0].abs(),
            (_, n) => values[..n].iter().map(|v| v * v).sum::<f64>().sqrt(),
        }
    }

    /// The effect at this size, within its physical bounds.
    pub fn at(&self, size: f64) -> Hidden {
        let (id, n, ratio) = (self.id(), self.coefficients().max(1), size / self.drawn());
        let mut hidden = self.drawn.clone();
        match id {
            "mount-resonance" => hidden.values[0] = size.powf(-0.5),
            "saturation" => hidden.values[0] = self.largest * (1.0 - size.min(0.6)),
            _ => hidden.values[..n].iter_mut().for_each(|v| *v *= ratio),
        }
        let cards = hidden.effect.parameters(self.scenario.sensor.axis);
        for (value, card) in hidden.values.iter_mut().zip(cards) {
            *value = value.clamp(card.bounds.0, card.bounds.1);
        }
        hidden
    }

    /// The log with the effect in it.
    pub fn hide(&self, size: f64) -> Scenario {
        Scenario { hidden: vec![self.at(size)], ..self.scenario.clone() }
    }

    /// Whether readings that the effect has touched say nothing more, so that no standard error belongs to it.
    pub fn is_limit(&self) -> bool {
        self.drawn.effect.stage() == Stage::Reading
    }
}
