//! Two models on the same samples: which is better, by how much, and by which effect.

use super::{
    Headline, Named, clause,
    left::{is_noise, said},
    sentences, sources,
};
use crate::{
    Axis,
    diagnosis::{AxisResult, ErrorPoint},
    units,
    words::Voice,
};
use serde::Serialize;

/// How a model stands beside another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// Its error is lower.
    Better,
    /// Its error is higher.
    Worse,
    /// Their errors differ by no more than noise makes them differ.
    Same,
}

/// One axis of two models, where it is best said.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Beside {
    /// The axis.
    pub axis: Axis,
    /// Averaging time, s: that of 1 s, or where they differ most if they do not differ there.
    pub tau_s: f64,
    /// Error of the model, rad/s.
    pub error: f64,
    /// Error of the other one, rad/s.
    pub other_error: f64,
    /// Floor, rad/s.
    pub floor: Option<f64>,
    /// Whether the model's error is noise.
    pub is_noise: bool,
    /// How the model stands.
    pub standing: Standing,
}

impl Beside {
    /// Of one axis; `None` where one of the two has no error.
    #[must_use]
    pub fn of(axis: &AxisResult, other: &AxisResult) -> Option<Self> {
        let at = |p: &ErrorPoint| {
            let same = |q: &&ErrorPoint| (q.tau_s / p.tau_s - 1.0).abs() < 1e-6;
            let other_error = other.error_curve.iter().find(same)?.error?;
            Some((*p, p.error?, other_error))
        };
        let pairs: Vec<_> = axis.error_curve.iter().filter_map(at).collect();
        // The band of noise, above the floor, is what such errors are known by.
        let band = |p: &ErrorPoint| p.floor_99.zip(p.floor).map_or(0.0, |(top, floor)| (top - floor).max(0.0));
        let differ = |pair: &&(ErrorPoint, f64, f64)| (pair.1 - pair.2).abs() > band(&pair.0);
        let usual = said(&axis.error_curve).and_then(|p| pairs.iter().find(|pair| pair.0.tau_s == p.tau_s));
        let most = || {
            let apart = |pair: &(ErrorPoint, f64, f64)| (pair.1 / pair.2).ln().abs();
            pairs.iter().filter(differ).max_by(|a, b| apart(a).total_cmp(&apart(b)))
        };
        let found = usual.filter(differ).or_else(most).or(usual).or(pairs.first())?;
        let (point, error, other_error) = *found;
        let standing = match () {
            () if !differ(&found) => Standing::Same,
            () if error < other_error => Standing::Better,
            () => Standing::Worse,
        };
        let (tau_s, floor) = (point.tau_s, point.floor);
        Some(Self { axis: axis.axis, tau_s, error, other_error, floor, is_noise: is_noise(&point), standing })
    }
}

/// The effects by which the better of two models is better, with their values in it.
#[must_use]
pub fn by_which<'a>(axis: &'a AxisResult, other: &'a AxisResult) -> Named<'a> {
    let standing = Beside::of(axis, other).map(|beside| beside.standing);
    let (better, worse) = if standing == Some(Standing::Worse) { (other, axis) } else { (axis, other) };
    let differs = standing.is_some_and(|standing| standing != Standing::Same);
    let own = better.effects.iter().filter(|id| differs && !worse.effects.contains(id)).map(String::as_str);
    Named { axis: axis.axis, effects: own.collect(), parameters: better.parameters.iter().collect() }
}

/// Of `compare --against`: which model is better, where some causes have been `told`, for several axes share them.
#[must_use]
pub fn of_against(names: (&str, &str), axis: &AxisResult, other: &AxisResult, told: &[&str]) -> Headline {
    let Some(beside) = Beside::of(axis, other) else { return super::of(axis, Voice::Log) };
    let (name, other_name) = names;
    let over = units::time(beside.tau_s);
    let (error, other_error) = (units::rate(Some(beside.error)), units::rate(Some(beside.other_error)));
    let noise = if beside.is_noise { ", which is noise" } else { "" };
    let change = format!("the error over {over} goes from {other_error} to {error} °/s{noise}");
    let mut answer = match beside.standing {
        Standing::Better => format!("With {name} in place of {other_name} {change}: it is better."),
        Standing::Worse => format!("With {name} in place of {other_name} {change}: it is worse."),
        Standing::Same => format!(
            "Between {name} and {other_name} there is no difference beyond noise: the error over {over} is {error} and {other_error} °/s{noise}."
        ),
    };
    let named = by_which(axis, other);
    let own: Vec<&str> = named.effects.iter().copied().filter(|id| !told.contains(id)).collect();
    let parameters: Vec<_> = named.parameters.iter().copied().cloned().collect();
    let clauses: Vec<String> = own.iter().map(|id| clause(axis.axis, id, &parameters)).collect();
    if !clauses.is_empty() {
        answer = format!("{answer} {}", sentences(&clauses));
    }
    Headline { answer, at_source: sources(&own) }
}
