//! What a recording is to tell: a parameter, how well, and how far it is.

use crate::{
    Axis, Model,
    effects::{Effect, ParameterCard, Role, Stage, Trait},
};
use serde::Serialize;

/// Times what is wanted that the standard error of what is known may rise to.
const SCATTERS: f64 = 1.5;

/// One parameter that is wanted.
#[derive(Clone, Debug, Serialize)]
pub struct Goal {
    /// The axis.
    pub axis: Axis,
    /// Effect id.
    pub effect: &'static str,
    /// Parameter name.
    pub name: &'static str,
    /// Unit of what follows.
    pub unit: &'static str,
    /// Value, as known now.
    pub value: Option<f64>,
    /// Its standard error now.
    pub std_error: Option<f64>,
    /// The standard error that is wanted.
    pub wanted: f64,
    /// Whether it is reached.
    pub known: bool,
    /// Why it is not waited for any more.
    pub out_of_reach: Option<String>,
    /// The smallest standard error so far that counted as progress, and for how long motion has not made it smaller, s.
    #[serde(skip)]
    pub(super) stalled: (f64, f64),
}

/// How well something is to be known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Precision {
    /// A share of the size that is typical of low-cost sensors.
    OfTypical(f64),
    /// In the parameter's own unit.
    Absolute(f64),
}

/// The parameters by which an effect is known: its coefficients or, where it has none, the shapes that are zero without it.
pub(super) fn sized(effect: &'static dyn Effect, axis: Axis) -> impl Iterator<Item = &'static ParameterCard> {
    let cards = effect.parameters(axis);
    let role = if cards.iter().any(|card| card.role == Role::Linear) { Role::Linear } else { Role::Shape };
    cards.iter().filter(move |card| card.role == role && (role == Role::Linear || card.neutral == 0.0))
}

/// Why no manoeuvre makes an effect known by a standard error; `None` where one may.
#[must_use]
pub fn unguided(effect: &dyn Effect) -> Option<&'static str> {
    if effect.stage() == Stage::Reading {
        Some("it is found in the readings, without a standard error")
    } else if effect.is(Trait::Onset) {
        Some("it happens once, at an unknown time")
    } else if effect.is(Trait::Line) || effect.is(Trait::Resonance) {
        Some("its frequency is not known beforehand")
    } else {
        None
    }
}

impl Goal {
    /// The parameters of one effect on one axis.
    pub(super) fn of(effect: &'static dyn Effect, axis: Axis, precision: Precision) -> Vec<Self> {
        let goal = |card: &'static ParameterCard| Self {
            axis,
            effect: effect.card().id,
            name: card.name,
            unit: card.unit,
            value: None,
            std_error: None,
            wanted: match precision {
                Precision::OfTypical(share) => share * (card.typical - card.neutral).abs(),
                Precision::Absolute(size) => size,
            },
            known: false,
            out_of_reach: None,
            stalled: (f64::INFINITY, 0.0),
        };
        // What has no typical size is wanted in no share of it.
        let is_wanted = |card: &&'static ParameterCard| match precision {
            Precision::OfTypical(_) => card.typical != card.neutral,
            Precision::Absolute(_) => true,
        };
        sized(effect, axis).filter(is_wanted).map(goal).collect()
    }

    /// Whether it is still waited for.
    #[must_use]
    pub fn lacks(&self) -> bool {
        !self.known && self.out_of_reach.is_none()
    }

    /// The share of the information that is there: it grows with the time of a motion, as 1/σ² does.
    #[must_use]
    pub fn gathered(&self) -> f64 {
        self.std_error.map_or(0.0, |error| (self.wanted / error).powi(2)).clamp(0.0, 1.0)
    }

    /// Takes what is known now. What is known may turn out not to be, where more data show that the model lacks something; an error
    /// that scatters a little does not count as that.
    pub(super) fn learn(&mut self, model: &Model) {
        let term = model.axes[self.axis.index()].as_ref().and_then(|own| own.term(self.effect));
        let found = term.and_then(|term| term.parameters(self.axis).find(|(card, ..)| card.name == self.name));
        let Some((_, value, error)) = found else { return };
        self.value = value.is_finite().then_some(value);
        self.std_error = (error.is_finite() && error > 0.0).then_some(error);
        let enough = if self.known { SCATTERS * self.wanted } else { self.wanted };
        self.known = self.std_error.is_some_and(|error| error <= enough);
    }
}
