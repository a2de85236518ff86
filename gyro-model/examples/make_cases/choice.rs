//! What a case hides: effects at the sizes that low-cost sensors show, on motions that excite them.

use gyro_model::{
    Axis,
    effects::find,
    simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;

/// One log to make.
pub struct Case {
    /// The log.
    pub scenario: Scenario,
}

/// Effects that one log may not tell apart are never hidden together.
const GROUPS: [&[&str]; 5] = [
    &["temperature-bias", "temperature-rate", "warm-up", "bias-drift", "bias-step", "supply-voltage"],
    &["delay", "lag", "mount-resonance", "clock-skew"],
    &["quadratic-nonlinearity", "scale-asymmetry", "g-sensitivity", "g-squared-sensitivity"],
    &["cubic-nonlinearity", "saturation", "dead-zone"],
    &["encoder-eccentricity", "encoder-subdivision"],
];

/// Effects that can be hidden, alone or in pairs.
pub const EFFECTS: [&str; 24] = [
    "cross-axis",
    "quadratic-nonlinearity",
    "cubic-nonlinearity",
    "scale-asymmetry",
    "g-sensitivity",
    "g-squared-sensitivity",
    "temperature-bias",
    "temperature-scale",
    "temperature-rate",
    "warm-up",
    "bias-drift",
    "bias-step",
    "supply-voltage",
    "lag",
    "delay",
    "clock-skew",
    "dead-zone",
    "saturation",
    "rate-hysteresis",
    "mount-resonance",
    "vibration-tone",
    "encoder-eccentricity",
    "encoder-subdivision",
    "encoder-backlash",
];

/// The seed of case `k` of the series `seed`.
pub fn seed_of(seed: u64, k: u64) -> u64 {
    seed.wrapping_mul(100_003).wrapping_add(k)
}

impl Case {
    /// The case of this seed.
    pub fn random(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sensor = SensorSpec::random(seed);
        let rate_hz = [100.0, 100.0, 125.0, 200.0, 250.0, 500.0][random.random_range(0..6)];
        let seconds = random.random_range(60.0_f64..150.0).round();
        let motion = match random.random_range(0..20) {
            0..4 => Motion::Sine { amplitude: random.random_range(1.2..2.8), frequency: random.random_range(0.2..0.5) },
            4..12 => Motion::Multisine { travel: random.random_range(3.5..9.0) },
            _ => Motion::Drive { rate: random.random_range(0.6..1.8), hold: random.random_range(1.2..4.0) },
        };
        let mut scenario = Scenario { motion, seconds, rate_hz, seed, hidden: Vec::new(), sensor };
        let count = [0, 0, 1, 1, 1, 1, 1, 1, 2, 2][random.random_range(0..10)];
        while scenario.hidden.len() < count {
            let id = EFFECTS[random.random_range(0..EFFECTS.len())];
            if scenario.hidden.iter().any(|h| alike(id, h.effect.card().id)) || !is_excited(id, &scenario) {
                continue;
            }
            let hidden = sized(id, &scenario, &mut random);
            scenario.hidden.push(hidden);
        }
        Self { scenario }
    }

    /// Its entry in `truth.json`; parameters that are zero are left out.
    pub fn truth(&self) -> Value {
        let (axis, scenario) = (self.scenario.sensor.axis, &self.scenario);
        let hidden: Map<_, _> = scenario
            .hidden
            .iter()
            .map(|hidden| {
                let cards = hidden.effect.parameters(axis).iter().zip(&hidden.values);
                let values: Map<_, _> =
                    cards.filter(|(_, v)| **v != 0.0).map(|(c, v)| (c.name.to_owned(), json!(v))).collect();
                (hidden.effect.card().id.to_owned(), Value::Object(values))
            })
            .collect();
        let motion = format!("{:?}", scenario.motion);
        json!({ "axis": axis.letter(), "hidden": hidden, "motion": motion, "rate_hz": scenario.rate_hz, "seconds": scenario.seconds })
    }
}

/// Whether the two are one effect, or may not be told apart.
pub fn alike(id: &str, other: &str) -> bool {
    id == other || GROUPS.iter().any(|group| group.contains(&id) && group.contains(&other))
}

/// Whether such a log shows the effect at all.
pub fn is_excited(id: &str, scenario: &Scenario) -> bool {
    let one_sine = matches!(scenario.motion, Motion::Sine { .. });
    match id {
        "mount-resonance" | "lag" | "dead-zone" | "quadratic-nonlinearity" | "cubic-nonlinearity" => !one_sine,
        "g-squared-sensitivity" => scenario.sensor.horizontal,
        "encoder-eccentricity" | "encoder-subdivision" => match scenario.motion {
            Motion::Sine { amplitude, .. } => amplitude > 2.0,
            Motion::Multisine { travel } => travel > 4.0,
            Motion::Drive { .. } | Motion::RateTable { .. } | Motion::Steered => true,
        },
        _ => true,
    }
}

/// The effect at a size that low-cost sensors show.
pub fn sized(id: &str, scenario: &Scenario, random: &mut ChaCha8Rng) -> Hidden {
    let axis = scenario.sensor.axis;
    let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let mut between = |low: f64, high: f64| (random.random_range(low.ln()..high.ln())).exp();
    let values = match id {
        "cross-axis" => {
            // Of the two others only the one after next moves.
            let share = sign * between(0.015, 0.05);
            let others: Vec<usize> = (0..3).filter(|&i| i != axis.index()).collect();
            others.iter().map(|&i| if i == (axis.index() + 2) % 3 { share } else { 0.0 }).collect()
        }
        "quadratic-nonlinearity" => vec![sign * between(1e-3, 4e-3)],
        "cubic-nonlinearity" => vec![sign * between(4e-4, 2e-3)],
        "scale-asymmetry" => vec![sign * between(3e-3, 1e-2)],
        "g-sensitivity" => across(axis, sign * between(3e-4, 1.2e-3), between(0.5, 2.5) > 1.0),
        "g-squared-sensitivity" => across(axis, sign * between(2e-5, 1e-4), between(0.5, 2.5) > 1.0),
        "temperature-bias" => vec![sign * between(4e-4, 2.5e-3), 0.0],
        "temperature-scale" => vec![sign * between(5e-4, 2.5e-3)],
        "temperature-rate" => vec![sign * between(0.03, 0.2)],
        "warm-up" => vec![sign * between(0.01, 0.04), between(5.0, 60.0)],
        "bias-drift" => vec![sign * between(5e-5, 3e-4)],
        "bias-step" => vec![sign * between(5e-3, 3e-2), scenario.seconds * between(0.2, 0.8)],
        "supply-voltage" => vec![sign * between(0.03, 0.15)],
        "lag" => vec![between(4e-3, 2.5e-2)],
        "delay" => vec![between(3e-3, 2.5e-2)],
        "clock-skew" => vec![sign * between(2e-4, 3e-3)],
        "dead-zone" => vec![between(0.02, 0.08)],
        "saturation" => vec![largest_reading(scenario) * between(0.5, 0.85)],
        "rate-hysteresis" => vec![between(0.01, 0.05)],
        "mount-resonance" => vec![between(6.0, 18.0), between(0.04, 0.25)],
        "vibration-tone" => {
            let (a, phase) = (between(5e-3, 3e-2), TAU * between(0.1, 1.1));
            vec![a * phase.sin(), a * phase.cos(), between(3.0, 0.35 * scenario.rate_hz)]
        }
        "encoder-eccentricity" => {
            let (a, phase) = (between(4e-3, 2e-2), TAU * between(0.1, 1.1));
            vec![a * phase.sin(), a * phase.cos()]
        }
        "encoder-subdivision" => {
            let (a, phase) = (between(2e-3, 8e-3), TAU * between(0.1, 1.1));
            vec![a * phase.sin(), a * phase.cos(), between(2.0, 4.99).floor()]
        }
        "encoder-backlash" => vec![between(5e-3, 2e-2)],
        _ => unreachable!("EFFECTS has no {id}"),
    };
    Hidden { effect: find(id).expect("EFFECTS are ids of the catalogue"), values }
}

/// A coefficient for one of the two directions across the shaft.
fn across(axis: Axis, value: f64, first: bool) -> Vec<f64> {
    let direction = (axis.index() + if first { 1 } else { 2 }) % 3;
    (0..3).map(|i| if i == direction { value } else { 0.0 }).collect()
}

/// Largest |reading| of the log without the effect, rad/s.
pub fn largest_reading(scenario: &Scenario) -> f64 {
    let i = scenario.sensor.axis.index();
    simulate(scenario).record.rows.iter().fold(0.0, |largest, row| row.gyro[i].abs().max(largest))
}
