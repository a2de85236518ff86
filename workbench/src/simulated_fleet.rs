//! A simulated fleet: types, parts and logs with spreads between them, from one TOML file.
//!
//! ```toml
//! seed = 1
//! axis = "x"
//! motion = "multisine"
//! seconds = 60.0
//! rate = 100.0
//!
//! [type.BMI160]
//! parts = 8
//! logs = 2                    # of each part
//! first_day = "2026-01-05"
//! days = 7                    # from one log of a part to the next
//! scale = { mean = 1.003, parts = 0.0012 }                  # α
//! bias = { mean = 0.0, parts = 0.017, logs = 0.002 }        # δ, rad/s
//! mount = { mean = 0.0, parts = 0.01, logs = 0.003 }        # turned about each axis, rad
//! cross = { mean = 0.0, parts = 0.002 }                     # share of each other's rate that two axes feel alike
//! effects = [{ effect = "scale-asymmetry", parameter = "a", mean = 4e-5, parts = 1e-5 }]
//! bad = [{ part = 3, effect = "scale-asymmetry", parameter = "a", value = 7e-4, from_log = 1 }]
//! ```
//!
//! With `reference = "orientation"` and `reference_noise` (rad) all three axes turn and are referenced. `parts` of a parameter is the standard deviation between parts, `logs` that between the logs of a part.

use crate::{
    toml_error::TomlError,
    words::{Task, call},
};
use anyhow::{Context, Result, bail};
use gyro_model::{
    Axis, Record,
    effects::find,
    simulate::{Hidden, Motion, Reference, Scenario, SensorSpec, SetUp},
};
use jiff::{ToSpan, civil::Date, tz::TimeZone};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::{collections::BTreeMap, fs, path::Path};

/// What the file says.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Of everything random.
    #[serde(default = "one")]
    pub seed: u64,
    /// The axis on the shaft.
    #[serde(default = "x")]
    pub axis: Axis,
    /// How it moves.
    #[serde(default = "multisine")]
    pub motion: String,
    /// Length of a log, s.
    #[serde(default = "minute")]
    pub seconds: f64,
    /// Rows a second.
    #[serde(default = "hundred")]
    pub rate: f64,
    /// What measures the truth.
    #[serde(default)]
    pub reference: Measured,
    /// Its noise, rad or rad/s.
    #[serde(default)]
    pub reference_noise: f64,
    /// The types.
    #[serde(rename = "type")]
    pub kinds: BTreeMap<String, Kind>,
}

/// What measures the truth of a simulated log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Measured {
    /// A shaft encoder on one axis.
    #[default]
    Encoder,
    /// A rate of that axis.
    Rate,
    /// The orientation of the whole sensor.
    Orientation,
}

const fn one() -> u64 {
    1
}
const fn x() -> Axis {
    Axis::X
}
fn multisine() -> String {
    "multisine".to_owned()
}
const fn minute() -> f64 {
    60.0
}
const fn hundred() -> f64 {
    100.0
}

/// A type.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kind {
    /// Parts.
    pub parts: u32,
    /// Logs of each.
    #[serde(default = "single")]
    pub logs: u32,
    /// The day of each part's first log.
    #[serde(default = "first")]
    pub first_day: Date,
    /// Days from one log of a part to the next.
    #[serde(default = "week")]
    pub days: i64,
    /// α.
    #[serde(default)]
    pub scale: Option<Spread>,
    /// δ, rad/s.
    #[serde(default)]
    pub bias: Option<Spread>,
    /// By how much the sensor is turned on its mount about each axis, rad.
    #[serde(default)]
    pub mount: Option<Spread>,
    /// Share of each other's rate that two axes of the chip feel alike.
    #[serde(default)]
    pub cross: Option<Spread>,
    /// Effects that every part has.
    #[serde(default)]
    pub effects: Vec<OfKind>,
    /// What single parts have instead.
    #[serde(default)]
    pub bad: Vec<Bad>,
}

const fn single() -> u32 {
    1
}
const fn first() -> Date {
    jiff::civil::date(2026, 1, 5)
}
const fn week() -> i64 {
    7
}

/// A mean and how parts and logs scatter about it.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// Standard deviation between parts.
    #[serde(default)]
    pub parts: f64,
    /// Standard deviation between the logs of a part.
    #[serde(default)]
    pub logs: f64,
}

/// An effect of a type.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OfKind {
    /// Its id.
    pub effect: String,
    /// The parameter that scatters; the others have their typical size.
    pub parameter: String,
    /// The mean.
    pub mean: f64,
    /// Standard deviation between parts.
    #[serde(default)]
    pub parts: f64,
    /// Standard deviation between the logs of a part.
    #[serde(default)]
    pub logs: f64,
}

/// A part that is not of its type.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bad {
    /// Its number, from 1.
    pub part: u32,
    /// The effect.
    pub effect: String,
    /// The parameter.
    pub parameter: String,
    /// What it has.
    pub value: f64,
    /// From this log on, from 1.
    #[serde(default = "single")]
    pub from_log: u32,
}

/// One log of it.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Its file's name.
    pub file: String,
    /// The type.
    pub kind: String,
    /// The part.
    pub part: u32,
    /// When it is recorded.
    pub day: Date,
    /// Its rig and what is hidden in it.
    pub scenario: Scenario,
    /// What each axis feels of each rate.
    pub felt: [[f64; 3]; 3],
}

impl Planned {
    /// Midnight of its day, ns since 1970.
    #[must_use]
    pub fn start_ns(&self) -> i128 {
        self.day.to_zoned(TimeZone::UTC).map_or(0, |start| start.timestamp().as_nanosecond())
    }

    /// The log.
    ///
    /// # Errors
    /// A scenario of too few or too many rows.
    pub fn simulate(&self) -> Result<Record> {
        let rows = self.scenario.rows().map_err(|wrong| anyhow::anyhow!(wrong))?;
        let (mut record, _) = SetUp::default().simulate(&self.scenario, rows, |_| ());
        if self.felt != SQUARE {
            for row in &mut record.rows {
                let rates = row.gyro;
                row.gyro = self.felt.map(|shares| (0..3).map(|k| shares[k] * rates[k]).sum());
            }
        }
        Ok(record)
    }
}

/// A sensor that stands square to its mount, with axes square to each other.
const SQUARE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A standard normal number that belongs to these words alone.
fn normal(seed: u64, words: &str) -> f64 {
    let digest = Sha256::digest(format!("{seed} {words}").as_bytes());
    let uniform = |from: usize| {
        let bits = u64::from_le_bytes(std::array::from_fn(|k| digest[from + k]));
        ((bits >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    // Box and Muller.
    (-2.0 * uniform(0).ln()).sqrt() * (std::f64::consts::TAU * uniform(8)).cos()
}

impl Plan {
    /// Reads the file.
    ///
    /// # Errors
    /// What is wrong, with line and caret.
    pub fn load(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = fs::read_to_string(path).with_context(|| format!("{name}: cannot be read: check the path"))?;
        let plan: Self = toml::from_str(&text).map_err(|error| TomlError::syntax(path, &text, &error))?;
        if plan.kinds.is_empty() {
            bail!("{name}: has no [type.NAME]");
        }
        Ok(plan)
    }

    /// Every log, in order.
    ///
    /// # Errors
    /// An effect, a parameter or a motion that is not known, or a value out of its bounds.
    pub fn logs(&self) -> Result<Vec<Planned>> {
        let motion: Motion = self.motion.parse().map_err(|wrong: String| anyhow::anyhow!(wrong))?;
        let mut all = Vec::new();
        for (kind, own) in &self.kinds {
            for part in 1..=own.parts {
                for log in 1..=own.logs {
                    let words = format!("{kind} {part} {log}");
                    let digest = Sha256::digest(format!("{} {words}", self.seed).as_bytes());
                    let scenario = Scenario {
                        motion,
                        seconds: self.seconds,
                        rate_hz: self.rate,
                        seed: u64::from_le_bytes(std::array::from_fn(|k| digest[k])),
                        hidden: self.hidden(kind, own, part, log)?,
                        sensor: self.sensor(kind, own, part, log),
                    };
                    let felt = self.felt(kind, own, part, log);
                    scenario.rows().map_err(|wrong| anyhow::anyhow!(wrong))?;
                    let day = own.first_day.checked_add((own.days * i64::from(log - 1)).days())?;
                    let file = format!("{kind}-{part:03}-{log:02}.csv.gz");
                    all.push(Planned { file, kind: kind.clone(), part, day, scenario, felt });
                }
            }
        }
        Ok(all)
    }

    fn drawn(&self, spread: Spread, what: &str, kind: &str, part: u32, log: u32) -> f64 {
        spread.mean
            + spread.parts * normal(self.seed, &format!("{kind} {part} {what}"))
            + spread.logs * normal(self.seed, &format!("{kind} {part} {log} {what}"))
    }

    fn sensor(&self, kind: &str, own: &Kind, part: u32, log: u32) -> SensorSpec {
        let mut sensor = SensorSpec::on(self.axis);
        sensor.reference_noise = self.reference_noise;
        sensor.reference = match self.reference {
            Measured::Encoder => sensor.reference,
            Measured::Rate => Reference::Rate,
            Measured::Orientation => Reference::Quaternion,
        };
        if let Some(spread) = own.scale {
            sensor.alpha = self.drawn(spread, "scale", kind, part, log);
        }
        if let Some(spread) = own.bias {
            sensor.delta = self.drawn(spread, "bias", kind, part, log);
        }
        sensor
    }

    /// ω − φ × ω of a small turn φ, and what axes feel alike.
    fn felt(&self, kind: &str, own: &Kind, part: u32, log: u32) -> [[f64; 3]; 3] {
        let mut felt = SQUARE;
        for j in 0..3 {
            let (i, k) = ((j + 1) % 3, (j + 2) % 3);
            let drawn = |spread: Option<Spread>, what: &str| {
                spread.map_or(0.0, |spread| self.drawn(spread, &format!("{what} {j}"), kind, part, log))
            };
            let (turned, alike) = (drawn(own.mount, "mount"), drawn(own.cross, "cross"));
            felt[i][k] += turned + alike;
            felt[k][i] += alike - turned;
        }
        felt
    }

    fn hidden(&self, kind: &str, own: &Kind, part: u32, log: u32) -> Result<Vec<Hidden>> {
        let mut all: Vec<Hidden> = Vec::new();
        let mut set = |id: &str, parameter: &str, value: f64| -> Result<()> {
            let Some(effect) = find(id) else {
                bail!("no effect '{id}'{}; {} lists them all", gyro_model::effects::meant(id), call(Task::Effects, ""))
            };
            let cards = effect.parameters(self.axis);
            let Some(place) = cards.iter().position(|card| card.name == parameter) else {
                bail!("{id} has no parameter '{parameter}' on axis {}", self.axis)
            };
            let (low, high) = cards[place].bounds;
            if !(low..=high).contains(&value) {
                bail!("{id}: {parameter} = {value} lies outside {low} … {high} {}", cards[place].unit);
            }
            let at = all.iter().position(|hidden| hidden.effect.card().id == id).unwrap_or_else(|| {
                all.push(Hidden::typical(effect, self.axis));
                all.len() - 1
            });
            all[at].values[place] = value;
            Ok(())
        };
        for of in &own.effects {
            let spread = Spread { mean: of.mean, parts: of.parts, logs: of.logs };
            let value = self.drawn(spread, &format!("{}.{}", of.effect, of.parameter), kind, part, log);
            set(&of.effect, &of.parameter, value)?;
        }
        for bad in own.bad.iter().filter(|bad| bad.part == part && log >= bad.from_log) {
            set(&bad.effect, &bad.parameter, bad.value)?;
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_a_fleet_are_normal_and_belong_to_their_words() {
        let all: Vec<f64> = (0..4000).map(|k| normal(3, &k.to_string())).collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        assert!(mean.abs() < 0.06 && (variance - 1.0).abs() < 0.1, "{mean} {variance}");
        assert!(normal(3, "a") == normal(3, "a") && normal(3, "a") != normal(4, "a"));
    }

    #[test]
    fn a_bad_part_has_its_value_from_its_log_on() {
        let text = "[type.A]\nparts = 3\nlogs = 4\neffects = [{ effect = \"delay\", parameter = \"d\", mean = 0.01 }]\n\
                    bad = [{ part = 2, effect = \"delay\", parameter = \"d\", value = 0.05, from_log = 3 }]\n";
        let logs = toml::from_str::<Plan>(text).unwrap().logs().unwrap();
        assert_eq!(logs.len(), 12);
        let late: Vec<&str> =
            logs.iter().filter(|log| log.scenario.hidden[0].values[0] > 0.04).map(|log| log.file.as_str()).collect();
        assert_eq!(late, ["A-002-03.csv.gz", "A-002-04.csv.gz"]);
        assert_eq!(logs[5].day.to_string(), "2026-01-12");
        assert!(toml::from_str::<Plan>("[type.A]\nparts = 1\nlog = 2\n").is_err());
        let unknown = toml::from_str::<Plan>(&text.replace("delay", "dely")).unwrap().logs().unwrap_err();
        assert!(unknown.to_string().contains("did you mean 'delay'"), "{unknown}");
    }
}
