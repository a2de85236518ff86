//! An effect that is hidden in a simulated reading, and how to say it: `ID[:NAME=VALUE,…]`.

use super::RandomCauses;
use crate::{
    Axis, Term,
    effects::{self, Effect, ParameterCard, Role},
};
use thiserror::Error;

/// An effect with its parameters.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Values in the order of `effect.parameters(axis)`.
    pub values: Vec<f64>,
}

/// What is wrong with `ID[:NAME=VALUE,…]`.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum HiddenError {
    /// No such effect.
    #[error("no effect '{id}'{}: the catalogue lists them all", effects::meant(.id))]
    NoSuchEffect {
        /// As written.
        id: String,
    },
    /// The effect has no such parameter on this axis.
    #[error("{id} has no parameter '{name}' on axis {axis}: it has {has}")]
    NoSuchParameter {
        /// The effect.
        id: &'static str,
        /// As written.
        name: String,
        /// The axis.
        axis: Axis,
        /// What there is.
        has: String,
    },
    /// Not `NAME=VALUE`, or the value is no number.
    #[error("'{text}' is not NAME=VALUE with a number in SI units")]
    NotAnAssignment {
        /// As written.
        text: String,
    },
    /// Outside the physical bounds.
    #[error("{id}: {name} = {value} lies outside {low} … {high} {unit}")]
    OutOfBounds {
        /// The effect.
        id: &'static str,
        /// The parameter.
        name: &'static str,
        /// As written.
        value: String,
        /// Lower bound.
        low: String,
        /// Upper bound.
        high: String,
        /// Unit of all three.
        unit: &'static str,
    },
}

impl Hidden {
    /// The effect at its typical size.
    #[must_use]
    pub fn typical(effect: &'static dyn Effect, axis: Axis) -> Self {
        Self { effect, values: effect.parameters(axis).iter().map(|card| card.typical).collect() }
    }

    /// Reads `ID[:NAME=VALUE,…]`, SI units; what is left out takes its typical size.
    ///
    /// # Errors
    /// Where the effect or a parameter is unknown, a value is no number or lies outside its bounds.
    pub fn parse(text: &str, axis: Axis) -> Result<Self, HiddenError> {
        let (id, assignments) = text.split_once(':').unwrap_or((text, ""));
        let id = id.trim();
        let effect = effects::find(id).ok_or_else(|| HiddenError::NoSuchEffect { id: id.to_owned() })?;
        let mut hidden = Self::typical(effect, axis);
        for assignment in assignments.split(',').map(str::trim).filter(|a| !a.is_empty()) {
            hidden.assign(assignment, axis)?;
        }
        Ok(hidden)
    }

    fn assign(&mut self, text: &str, axis: Axis) -> Result<(), HiddenError> {
        let not_an_assignment = || HiddenError::NotAnAssignment { text: text.to_owned() };
        let (name, value) = text.split_once('=').ok_or_else(not_an_assignment)?;
        let (name, value): (_, f64) = (name.trim(), value.trim().parse().map_err(|_| not_an_assignment())?);
        let (id, cards) = (self.effect.card().id, self.effect.parameters(axis));
        let Some(place) = cards.iter().position(|card| card.name == name) else {
            let has = cards.iter().map(|card| card.name).collect::<Vec<_>>().join(", ");
            return Err(HiddenError::NoSuchParameter { id, name: name.to_owned(), axis, has });
        };
        let card = &cards[place];
        let (low, high) = card.bounds;
        if !value.is_finite() || value < low || value > high {
            let [value, low, high] = [value, low, high].map(|v| v.to_string());
            return Err(HiddenError::OutOfBounds { id, name: card.name, value, low, high, unit: card.unit });
        }
        self.values[place] = value;
        Ok(())
    }

    /// So many times as large: its coefficients, or, where it has none, how far its shapes lie from those that change nothing.
    /// Nothing leaves its bounds.
    #[must_use]
    pub fn scaled(&self, times: f64, axis: Axis) -> Self {
        let cards = self.effect.parameters(axis);
        let has_coefficients = cards.iter().any(|card| card.role == Role::Linear);
        let scaled = |(card, value): (&ParameterCard, &f64)| {
            if has_coefficients != (card.role == Role::Linear) || !card.neutral.is_finite() {
                return *value;
            }
            (card.neutral + times * (value - card.neutral)).clamp(card.bounds.0, card.bounds.1)
        };
        Self { effect: self.effect, values: cards.iter().zip(&self.values).map(scaled).collect() }
    }

    /// As `parse` reads it.
    #[must_use]
    pub fn text(&self, axis: Axis) -> String {
        let cards = self.effect.parameters(axis).iter().zip(&self.values);
        let values: Vec<String> = cards.map(|(card, value)| format!("{}={value}", card.name)).collect();
        format!("{}:{}", self.effect.card().id, values.join(","))
    }

    /// As a term of the true model.
    #[must_use]
    pub fn term(&self) -> Term {
        Term { effect: self.effect, std_errors: vec![0.0; self.values.len()], values: self.values.clone() }
    }
}

/// The effects and the random causes of these texts, `ID[:NAME=VALUE,…]` each.
///
/// # Errors
/// The first text that names neither, or a value that is wrong.
pub fn hidden(texts: &[String], axis: Axis) -> Result<(Vec<Hidden>, RandomCauses), String> {
    let (mut effects, mut random) = (Vec::new(), RandomCauses::default());
    for text in texts {
        match random.take(text) {
            Some(taken) => taken?,
            None => effects.push(Hidden::parse(text, axis).map_err(|wrong| wrong.to_string())?),
        }
    }
    Ok((effects, random))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_taken_as_written_and_the_rest_is_typical() {
        let hidden = Hidden::parse("warm-up:tau=12.5", Axis::X).unwrap();
        assert_eq!(hidden.effect.card().id, "warm-up");
        assert_eq!(hidden.values, [0.01, 12.5]);
        assert_eq!(Hidden::parse("delay", Axis::Z).unwrap().values, [0.01]);
        assert_eq!(Hidden::parse("cross-axis: m_x = 0.03, m_y=-0.01", Axis::Z).unwrap().values, [0.03, -0.01]);
    }

    #[test]
    fn a_larger_one_has_larger_coefficients_or_shapes_and_can_be_said() {
        let tone = Hidden::parse("vibration-tone", Axis::Z).unwrap().scaled(4.0, Axis::Z);
        assert_eq!(tone.values, [0.04, 0.0, 11.0]);
        assert_eq!(Hidden::parse("clock-step:t0=12", Axis::Z).unwrap().scaled(2.0, Axis::Z).values, [0.04, 12.0]);
        let late = Hidden::parse("delay", Axis::Z).unwrap();
        assert_eq!((late.scaled(3.0, Axis::Z).values, late.scaled(1e3, Axis::Z).values), (vec![0.03], vec![0.5]));
        for effect in effects::CATALOGUE {
            let larger = Hidden::typical(*effect, Axis::X).scaled(2.0, Axis::X);
            assert_eq!(Hidden::parse(&larger.text(Axis::X), Axis::X).unwrap().values, larger.values);
        }
    }

    #[test]
    fn mistakes_are_named() {
        let says = |text| Hidden::parse(text, Axis::X).unwrap_err().to_string();
        assert!(says("dely").contains("no effect 'dely'"));
        assert_eq!(says("cross-axis:m_x=1"), "cross-axis has no parameter 'm_x' on axis x: it has m_y, m_z");
        assert!(says("delay:d").contains("'d' is not NAME=VALUE"));
        assert!(says("delay:d=fast").contains("not NAME=VALUE"));
        assert_eq!(says("delay:d=7"), "delay: d = 7 lies outside -0.5 … 0.5 s");
        assert!(says("delay:d=nan").contains("outside"));
    }
}
