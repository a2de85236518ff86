//! What the axes of one sensor have in common, said once: causes of one size, and the rotation that their cross-axis terms are.

use super::{added, clause, rotation, rotation::Rotation, sentence};
use crate::{
    Axis,
    diagnosis::{AxisResult, ParameterValue, Verdict},
    effects,
    measured::{Measured, and},
};
use serde::Serialize;

/// Standard errors that a parameter of one axis may be from that of another and still be the same.
const SAME_ERRORS: f64 = 3.0;
/// Or this share of it: standard errors know nothing of what the model lacks.
const SAME_SHARE: f64 = 0.03;

/// The effects that are named on one axis, with their values.
#[derive(Clone, Debug)]
pub struct Named<'a> {
    /// The axis.
    pub axis: Axis,
    /// Effect ids.
    pub effects: Vec<&'a str>,
    /// All parameters of the axis.
    pub parameters: Vec<&'a ParameterValue>,
}

impl<'a> Named<'a> {
    /// What was added and stayed.
    #[must_use]
    pub fn by_change(added: &'a [String], after: &'a AxisResult) -> Self {
        let effects = added.iter().filter(|id| after.effects.contains(id)).map(String::as_str).collect();
        Self { axis: after.axis, effects, parameters: after.parameters.iter().collect() }
    }

    /// What a ladder added; what a diagnosis says is missing.
    #[must_use]
    pub fn of(axis: &'a AxisResult) -> Self {
        if !axis.steps.is_empty() {
            return Self { axis: axis.axis, effects: added(axis), parameters: axis.parameters.iter().collect() };
        }
        let effects: Vec<&str> = match axis.verdict {
            Verdict::MissingEffect if !axis.missing.is_empty() => axis.missing.iter().map(String::as_str).collect(),
            Verdict::MissingEffect => axis.suspects.iter().take(1).map(|s| s.effect.as_str()).collect(),
            _ => Vec::new(),
        };
        let of_suspects = axis.suspects.iter().filter(|s| effects.contains(&s.effect.as_str()));
        let parameters = of_suspects.flat_map(|s| s.parameters.iter().filter(|p| p.effect == s.effect)).collect();
        Self { axis: axis.axis, effects, parameters }
    }
}

/// A cause of one size on several axes.
#[derive(Clone, Debug, Serialize)]
pub struct Shared {
    /// Effect id.
    pub effect: String,
    /// The axes.
    pub axes: Vec<Axis>,
    /// Its mean parameters.
    pub parameters: Vec<ParameterValue>,
    /// In a sentence: `Your gyro is 4.05 ± 0.03 ms late, on all three axes.`
    pub says: String,
    /// What to do where it comes from; empty where nothing is to be done.
    pub at_source: String,
}

/// What several axes have in common.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Together {
    /// Causes that they share.
    pub shared: Vec<Shared>,
    /// How the sensor is turned, where its cross-axis terms say so.
    pub rotation: Option<Rotation>,
}

impl Together {
    /// Of the axes of one log; nothing where there is one alone.
    #[must_use]
    pub fn of(axes: &[Named]) -> Self {
        let mut ids: Vec<&str> = Vec::new();
        for id in axes.iter().flat_map(|axis| &axis.effects) {
            if !ids.contains(id) {
                ids.push(id);
            }
        }
        let mut together = Self::default();
        for id in ids {
            let having: Vec<&Named> = axes.iter().filter(|axis| axis.effects.contains(&id)).collect();
            if id == rotation::EFFECT {
                let Some(found) = Rotation::of(axes) else { continue };
                together.shared.push(Shared {
                    effect: id.to_owned(),
                    axes: Axis::ALL.to_vec(),
                    parameters: Vec::new(),
                    says: sentence(&found.says()),
                    at_source: found.to_use(),
                });
                together.rotation = Some(found);
            } else if having.len() > 1
                && let Some(mean) = alike(id, &having)
            {
                let which = if having.len() == Axis::ALL.len() {
                    "all three axes".to_owned()
                } else {
                    let letters: Vec<String> = having.iter().map(|axis| axis.axis.to_string()).collect();
                    format!("axes {}", and(&letters))
                };
                together.shared.push(Shared {
                    effect: id.to_owned(),
                    axes: having.iter().map(|axis| axis.axis).collect(),
                    says: sentence(&format!("{}, on {which}", clause(having[0].axis, id, &mean))),
                    parameters: mean,
                    at_source: effects::find(id).map_or("", |effect| effect.card().at_source).to_owned(),
                });
            }
        }
        together
    }

    /// What of this axis has been told.
    #[must_use]
    pub fn told(&self, axis: Axis) -> Vec<&str> {
        self.shared.iter().filter(|s| s.axes.contains(&axis)).map(|s| s.effect.as_str()).collect()
    }
}

/// The mean parameters of an effect where those of all these axes are one within their errors.
fn alike(id: &str, axes: &[&Named]) -> Option<Vec<ParameterValue>> {
    let own = |axis: &Named| axis.parameters.iter().copied().filter(|p| p.effect == id).cloned().collect::<Vec<_>>();
    let all: Vec<Vec<ParameterValue>> = axes.iter().map(|axis| own(axis)).collect();
    let first = &all[0];
    if first.is_empty() || all.iter().any(|other| other.len() != first.len()) {
        return None;
    }
    let mean = |first: &ParameterValue| -> Option<ParameterValue> {
        let values: Vec<Measured> = all
            .iter()
            .map(|axis| {
                let same = axis.iter().find(|p| p.name == first.name)?;
                Some(Measured { value: same.value?, std_error: same.std_error? })
            })
            .collect::<Option<_>>()?;
        let weight = |m: &Measured| m.std_error.max(1e-300).powi(-2);
        let weights: f64 = values.iter().map(weight).sum();
        let mean = values.iter().map(|m| weight(m) * m.value).sum::<f64>() / weights;
        let is_same = |m: &Measured| {
            let off = (m.value - mean).abs();
            off <= (SAME_ERRORS * m.std_error).max(SAME_SHARE * mean.abs())
        };
        // As far as they scatter the mean is no better known.
        let count = values.len() as f64;
        let scatter = values.iter().map(|m| (m.value - mean).powi(2)).sum::<f64>() / (count * (count - 1.0));
        let std_error = weights.recip().max(scatter).sqrt();
        (mean.is_finite() && values.iter().all(is_same)).then(|| ParameterValue {
            value: Some(mean),
            std_error: Some(std_error),
            ..first.clone()
        })
    };
    first.iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delay(value: f64) -> ParameterValue {
        ParameterValue {
            effect: "delay".into(),
            name: "d".into(),
            value: Some(value),
            std_error: Some(2e-5),
            unit: "s".into(),
            typical: Some(0.01),
        }
    }

    fn told(values: &[f64]) -> Together {
        let parameters: Vec<ParameterValue> = values.iter().map(|value| delay(*value)).collect();
        let named = |(axis, p)| Named { axis, effects: vec!["delay"], parameters: vec![p] };
        Together::of(&Axis::ALL.into_iter().zip(&parameters).map(named).collect::<Vec<_>>())
    }

    #[test]
    fn a_delay_of_all_axes_is_told_once() {
        let shared = told(&[4.05e-3, 4.06e-3, 4.04e-3]).shared;
        assert_eq!(shared.len(), 1);
        assert_eq!(shared[0].says, "Your gyro is 4.050 ± 0.012 ms late, on all three axes.");
        assert!(shared[0].at_source.contains("interrupt"));
        assert!(told(&[4.05e-3, 4.06e-3]).shared[0].says.ends_with("on axes x and y."));
    }

    #[test]
    fn delays_that_differ_are_each_axis_own() {
        assert!(told(&[4.05e-3, 4.06e-3, 5.0e-3]).shared.is_empty());
        assert!(told(&[4.05e-3]).shared.is_empty());
    }
}
