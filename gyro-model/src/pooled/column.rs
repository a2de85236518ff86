//! What a column of the normal equations is the coefficient of.

use crate::{
    Axis,
    effects::{CATALOGUE, Effect, ParameterCard, Role, Stage, Trait, find},
};
use serde::{Deserialize, Serialize};
use std::{cmp::Ordering, collections::HashMap, sync::LazyLock};

/// One column: a parameter of an effect on an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Which parameter.
    #[serde(flatten)]
    pub key: Key,
    /// Its unit.
    pub unit: String,
    /// Its value where the equations were linearised.
    pub at: f64,
    /// Whether each log has a value of its own: a bias, what belongs to the reference, what happened once.
    #[serde(default, skip_serializing_if = "is_false")]
    pub own: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
const fn is_false(value: &bool) -> bool {
    !*value
}

/// The name of a parameter; the same in every log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// The axis.
    pub axis: Axis,
    /// The effect's id.
    pub effect: String,
    /// The parameter's name; `share` where the column is the whole effect at these shapes.
    pub name: String,
    /// The shapes at which the column was taken; empty where it has none, or where they are columns too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shape: Vec<f64>,
}

impl Eq for Key {}

impl PartialOrd for Key {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Where each effect stands in the catalogue.
static PLACES: LazyLock<HashMap<&str, usize>> =
    LazyLock::new(|| CATALOGUE.iter().enumerate().map(|(place, effect)| (effect.card().id, place)).collect());

impl Ord for Key {
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |key: &Self| PLACES.get(key.effect.as_str()).copied().unwrap_or(usize::MAX);
        let effects = || if self.effect == other.effect { Ordering::Equal } else { place(self).cmp(&place(other)) };
        let shapes = || {
            let each = self.shape.iter().zip(&other.shape).map(|(a, b)| a.total_cmp(b));
            each.fold(self.shape.len().cmp(&other.shape.len()), Ordering::then)
        };
        let names = || (&self.effect, &self.name).cmp(&(&other.effect, &other.name));
        self.axis.cmp(&other.axis).then_with(effects).then_with(names).then_with(shapes)
    }
}

impl Key {
    /// A parameter without a shape.
    #[must_use]
    pub fn new(axis: Axis, effect: &str, name: &str) -> Self {
        Self { axis, effect: effect.to_owned(), name: name.to_owned(), shape: Vec::new() }
    }

    /// Whether it is how large an effect is: nothing at zero. A frequency or a time constant is not.
    #[must_use]
    pub fn is_size(&self) -> bool {
        let Some(effect) = find(&self.effect) else { return false };
        let has_coefficient = effect.parameters(self.axis).iter().any(|card| card.role == Role::Linear);
        let is_size = |card: &ParameterCard| {
            card.role == Role::Linear || !has_coefficient && card.neutral == 0.0 && !effect.is(Trait::Resonance)
        };
        self.name == "share" || self.card().is_some_and(is_size)
    }

    /// Whether the catalogue has this parameter.
    #[must_use]
    pub fn is_known(&self) -> bool {
        find(&self.effect).is_some() && (self.name == "share" || self.card().is_some())
    }

    /// The parameter's card, where the catalogue knows it.
    #[must_use]
    pub fn card(&self) -> Option<&'static ParameterCard> {
        find(&self.effect)?.parameters(self.axis).iter().find(|card| card.name == self.name)
    }
}

/// Whether each log has its own of an effect: its zero, an instant, a line of its spectrum, what belongs to its reference.
#[must_use]
pub fn is_own(effect: &dyn Effect) -> bool {
    let is_zero = effect.stage() == Stage::Calibration && !effect.is(Trait::Gain);
    let is_once = effect.is(Trait::Onset) || effect.is(Trait::Line) || effect.card().id == "bias-drift";
    is_zero || is_once || effect.stage().is_of_reference()
}

/// How a column of an effect that is not in the model is taken.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Taken {
    /// By each coefficient at these shapes.
    Coefficients(Vec<f64>),
    /// By its one size, from none of it to this much: what the log shows of more is in proportion.
    Size(f64),
    /// The whole effect with these values.
    Share(Vec<f64>),
}

/// Shapes that every log is reduced at, so that logs can be added up: time constants of a warm-up, s.
const WARM_UPS: [f64; 4] = [10.0, 30.0, 100.0, 300.0];
/// Frequencies of a mount, Hz, at a damping ratio.
const RESONANCES: [f64; 3] = [10.0, 30.0, 100.0];
const DAMPING: f64 = 0.1;
/// Share of the typical size at which a delay or a lag is differentiated.
const SMALL: f64 = 0.1;

/// How an effect is taken; empty where it has no column that logs could share: limits of the reading are read off, instants and
/// spectral lines are each log's own.
pub(super) fn taken(effect: &dyn Effect, axis: Axis) -> Vec<Taken> {
    let cards = effect.parameters(axis);
    let shapes: Vec<&ParameterCard> = cards.iter().filter(|card| card.role != Role::Linear).collect();
    if effect.stage() == Stage::Reading || effect.is(Trait::Onset) || effect.is(Trait::Line) {
        return Vec::new();
    }
    if shapes.is_empty() {
        return vec![Taken::Coefficients(Vec::new())];
    }
    if effect.is(Trait::Resonance) {
        return RESONANCES.iter().map(|&f| Taken::Share(vec![f, DAMPING])).collect();
    }
    if shapes.len() == cards.len() {
        return match effect.stage() {
            // What a window does goes with its square.
            Stage::Shown => vec![Taken::Share(shapes.iter().map(|card| card.typical).collect())],
            Stage::Timing | Stage::Response => vec![Taken::Size(SMALL * shapes[0].typical)],
            _ => vec![Taken::Size(shapes[0].typical)],
        };
    }
    // From which rate on counts are lost is each log's own.
    if shapes.len() > 1 {
        return Vec::new();
    }
    if shapes.iter().any(|card| card.role == Role::Chosen) {
        return vec![Taken::Coefficients(vec![2.0])];
    }
    WARM_UPS.iter().map(|&tau| Taken::Coefficients(vec![tau])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zero_and_the_reference_are_a_logs_own_and_the_sensors_effects_are_not() {
        let own: Vec<&str> = CATALOGUE.iter().filter(|e| is_own(**e)).map(|e| e.card().id).collect();
        for id in ["bias", "bias-step", "clock-step", "vibration-tone", "encoder-eccentricity", "reference-smoothing"] {
            assert!(own.contains(&id), "{id} in {own:?}");
        }
        for id in ["scale-factor", "delay", "scale-asymmetry", "temperature-bias", "g-sensitivity", "warm-up"] {
            assert!(!own.contains(&id), "{id} in {own:?}");
        }
    }

    #[test]
    fn a_delay_and_a_coefficient_are_sizes_and_a_time_constant_beside_one_is_none() {
        let key = |effect: &str, name: &str| Key::new(Axis::X, effect, name);
        assert!(key("delay", "d").is_size() && key("lag", "tau").is_size() && key("warm-up", "a").is_size());
        assert!(!key("warm-up", "tau").is_size() && !key("mount-resonance", "f").is_size());
    }

    #[test]
    fn every_effect_that_logs_can_share_has_a_column_within_its_bounds() {
        for effect in CATALOGUE.iter().filter(|effect| !is_own(**effect) && effect.stage() != Stage::Reading) {
            let all = taken(*effect, Axis::X);
            assert!(!all.is_empty(), "{}", effect.card().id);
            let cards = effect.parameters(Axis::X);
            for one in all {
                let values = match one {
                    Taken::Coefficients(shape) | Taken::Share(shape) => shape,
                    Taken::Size(size) => vec![size],
                };
                let shapes = cards.iter().filter(|card| card.role != Role::Linear);
                for (value, card) in values.iter().zip(shapes) {
                    assert!(card.bounds.0 <= *value && *value <= card.bounds.1, "{} {value}", effect.card().id);
                }
            }
        }
    }
}
