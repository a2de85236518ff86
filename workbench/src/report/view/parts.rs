//! What an axis is shown with, part by part, in human units.

use gyro_model::diagnosis::FloorFrom;
use serde::Serialize;

/// Why one effect was named or was not.
#[derive(Clone, Debug, Serialize)]
pub struct ExplainedView {
    /// Effect id.
    pub effect: String,
    /// Why, in a sentence.
    pub says: String,
    /// `passes every test`, `refused by: share, held-out`, …
    pub outcome: String,
    /// Each test of it.
    pub tests: Vec<TestView>,
}

/// One test of one suspect.
#[derive(Clone, Debug, Serialize)]
pub struct TestView {
    /// `pass`, `fail`, `–` where it is not asked.
    pub mark: &'static str,
    /// Its name.
    pub name: String,
    /// What it asks.
    pub asks: String,
    /// The numbers that decided it.
    pub numbers: String,
}

/// What limits a log, and what its error is made of.
#[derive(Clone, Debug, Serialize)]
pub struct LimitView {
    /// What stands before it: `what limits this log`.
    pub head: String,
    /// `reference noise`, …
    pub by: &'static str,
    /// In one sentence, with the remedy.
    pub says: String,
    /// `measured`, `assumed` or `unknown`: where the floor's noise is known from.
    pub floor_from: FloorFrom,
    /// Averaging time, s.
    pub tau: Vec<f64>,
    /// The parts that make a hundredth somewhere, largest over all first; what none explains last.
    pub parts: Vec<PartView>,
    /// Whose error it is, frequency by frequency, °/s/√Hz.
    pub frequency: Vec<f64>,
    /// The error.
    pub error: Vec<Option<f64>>,
    /// What the gyro shows in all.
    pub gyro: Vec<Option<f64>>,
    /// The error that only the reference shows.
    pub of_reference: Vec<Option<f64>>,
    /// The error that only the gyro shows.
    pub of_gyro: Vec<Option<f64>>,
}

/// One part of an error.
#[derive(Clone, Debug, Serialize)]
pub struct PartView {
    /// `reference noise`, …
    pub name: &'static str,
    /// Its share of the error² of each averaging time, %.
    pub share: Vec<f64>,
}

/// An error curve, °/s over s.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// What it belongs to: `model`, `with delay`, `before`, …
    pub label: String,
    /// Averaging time, s.
    pub tau: Vec<f64>,
    /// Held-out error.
    pub error: Vec<Option<f64>>,
    /// Floor.
    pub floor: Vec<Option<f64>>,
    /// Upper end of the floor's 99 % band.
    pub floor_99: Vec<Option<f64>>,
}

/// A parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterView {
    /// Effect id.
    pub effect: String,
    /// Name as in model files.
    pub name: String,
    /// What it is.
    pub says: String,
    /// `12.10 ± 0.12 ms`.
    pub shown: String,
    /// Whether the log shows it.
    #[serde(skip)]
    pub is_seen: bool,
    /// What is usual of its effect on low-cost sensors, where that is not said yet.
    pub typical: String,
}

impl ParameterView {
    /// `d = 12.10 ± 0.12 ms`.
    #[must_use]
    pub fn equation(&self) -> String {
        let is = if self.is_seen { " =" } else { ":" };
        format!("{}{is} {}", self.name, self.shown)
    }
}

/// What the catalogue says of an effect.
#[derive(Clone, Debug, Serialize)]
pub struct CardView {
    /// Effect id.
    pub id: String,
    /// What it is, half a line.
    pub title: String,
    /// What happens physically.
    pub physics: String,
    /// Equation.
    pub equation: String,
    /// Typical size, in words.
    pub typical: String,
    /// What shows it.
    pub excited_by: String,
    /// What compensation can do about it.
    pub mended_by: String,
    /// Where this is from.
    pub source: String,
}

/// A suspect.
#[derive(Clone, Debug, Serialize)]
pub struct SuspectView {
    /// Effect id.
    pub effect: String,
    /// Its card.
    pub card: CardView,
    /// `removes 98 % of the excess`, or a dash.
    pub removes: String,
    /// The same as a number from 0 to 1, for a bar.
    pub share: Option<f64>,
    /// Significance in words.
    pub significance: String,
    /// Of the first: `2 981 to 1 (lag)`, how much likelier it is than the next; empty of the others.
    pub odds: String,
    /// Its parameters after a refit.
    pub parameters: Vec<ParameterView>,
    /// What it cannot be told from on this log.
    pub aliases: Vec<AliasView>,
    /// The manoeuvre that would.
    pub separate_by: String,
}

/// An alias on this log.
#[derive(Clone, Debug, Serialize)]
pub struct AliasView {
    /// Effect id.
    pub id: String,
    /// What it is, half a line.
    pub title: String,
    /// When the two look alike.
    pub when: String,
    /// What splits the two.
    pub split_by: String,
}

/// One step of a ladder.
#[derive(Clone, Debug, Serialize)]
pub struct StepView {
    /// `start`, `+ delay`, `− lag`.
    pub label: String,
    /// Largest error/floor after the step.
    pub ratio: Option<f64>,
    /// Error at about 1 s, °/s.
    pub error_1s: Option<f64>,
    /// What the step has won: `2.49 → 0.0382 °/s at 1 s`; empty where the error does not fall.
    pub won: String,
    /// Aliases on this log.
    pub aliases: Vec<String>,
}
