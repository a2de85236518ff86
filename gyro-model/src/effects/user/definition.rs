//! What a user writes down, and what is wrong with it before the expression is looked at.

use super::{SIGNALS, expression::ExpressionError};
use crate::effects;
use thiserror::Error;

/// Most parameters of one effect.
pub const MOST_PARAMETERS: usize = 8;

/// What a user writes down.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Id: lower-case letters, digits and hyphens.
    pub id: String,
    /// The expression, rad/s.
    pub regressor: String,
    /// Its parameters.
    pub parameters: Vec<ParameterDefinition>,
}

/// One parameter as a user writes it down.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterDefinition {
    /// Name, as in the expression.
    pub name: String,
    /// Unit, for people.
    pub unit: String,
    /// The size to expect: where a search for a shape starts, and what a simulation takes.
    pub typical: f64,
}

/// What is wrong with a definition.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum DefinitionError {
    /// The id has other characters, or none.
    #[error("'{id}' is not an effect's name: lower-case letters, digits and hyphens, a letter first")]
    BadId {
        /// As written.
        id: String,
    },
    /// The catalogue has this id.
    #[error("the catalogue has an effect '{id}' already: choose another name")]
    TakenId {
        /// As written.
        id: String,
    },
    /// Too many parameters.
    #[error("{given} parameters are too many: at most {MOST_PARAMETERS}")]
    TooManyParameters {
        /// How many there are.
        given: usize,
    },
    /// A parameter is not named like one.
    #[error("'{name}' is not a parameter's name: letters, digits and _, a letter first, and none of the signals")]
    BadParameter {
        /// As written.
        name: String,
    },
    /// A parameter is declared twice.
    #[error("parameter '{name}' is declared twice")]
    RepeatedParameter {
        /// As written.
        name: String,
    },
    /// A typical size that is none.
    #[error("parameter '{name}': the typical size must be a finite number other than 0")]
    BadTypical {
        /// As written.
        name: String,
    },
    /// A parameter is not in the expression.
    #[error("parameter '{name}' does not appear in the expression")]
    UnusedParameter {
        /// As written.
        name: String,
    },
    /// Nothing to be proportional to.
    #[error(
        "the expression is proportional to none of its parameters, so the effect could never be absent: multiply it by one"
    )]
    NoCoefficient,
    /// The expression is wrong; the place is in the error.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
}

impl Definition {
    /// What can be seen wrong without looking at the expression.
    pub(super) fn check(&self) -> Result<(), DefinitionError> {
        let id = self.id.clone();
        let named = |name: &str, extra: &str| {
            name.starts_with(|c: char| c.is_ascii_alphabetic())
                && name.chars().all(|c| c.is_ascii_alphanumeric() || extra.contains(c))
        };
        if !named(&id, "-") || id.chars().any(|c| c.is_ascii_uppercase()) {
            return Err(DefinitionError::BadId { id });
        }
        if effects::find(&id).is_some() {
            return Err(DefinitionError::TakenId { id });
        }
        let parameters = &self.parameters;
        if parameters.len() > MOST_PARAMETERS {
            return Err(DefinitionError::TooManyParameters { given: parameters.len() });
        }
        for (k, parameter) in parameters.iter().enumerate() {
            let name = parameter.name.clone();
            if !named(&name, "_") || SIGNALS.iter().any(|(signal, _)| *signal == name) {
                return Err(DefinitionError::BadParameter { name });
            }
            if parameters[..k].iter().any(|other| other.name == name) {
                return Err(DefinitionError::RepeatedParameter { name });
            }
            if !parameter.typical.is_finite() || parameter.typical == 0.0 {
                return Err(DefinitionError::BadTypical { name });
            }
        }
        Ok(())
    }
}
