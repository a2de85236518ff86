//! A user's own effect: an expression over the log's columns and the model's signals, with named parameters.
//!
//! | name | meaning |
//! | --- | --- |
//! | `rate`, `rate_dot` | compensated rate of the axis under study, rad/s, and its derivative, rad/s² |
//! | `angle` | best known shaft angle, rad |
//! | `t` | time from the log's first row, s |
//! | `gyro_x` `gyro_y` `gyro_z` | compensated rates of the axes (raw where an axis has no model), rad/s |
//! | `accel_x` `accel_y` `accel_z` | specific force, m/s² |
//! | `temp`, `supply` | °C, V |
//! | a free channel's name | that column; between its values, the last one |
//! | `pi` | π, unless something else is called so |
//!
//! The expression is in rad/s and is added to the felt rate. It has to be proportional to at least one parameter, its
//! coefficient, so that it can be absent; the other parameters are shapes. Where it has no finite value it counts as 0.

mod definition;
pub mod expression;
mod function;
mod linearity;
mod parser;

pub use definition::{Definition, DefinitionError, MOST_PARAMETERS, ParameterDefinition};

use super::{Acts, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals, Span, Trait};
use crate::{Axis, measured::Measured, record::FREE_CHANNELS};
use expression::Expression;
use std::{
    borrow::Cow,
    sync::{Mutex, PoisonError},
};

/// A name in an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Variable {
    Parameter(usize),
    Rate,
    RateDot,
    Angle,
    Time,
    Gyro(usize),
    Accel(usize),
    Temperature,
    Supply,
    /// Channel, and where its last value is remembered.
    Free(usize, usize),
}

/// The signals that every log has a place for.
const SIGNALS: [(&str, Variable); 12] = [
    ("rate", Variable::Rate),
    ("rate_dot", Variable::RateDot),
    ("angle", Variable::Angle),
    ("t", Variable::Time),
    ("gyro_x", Variable::Gyro(0)),
    ("gyro_y", Variable::Gyro(1)),
    ("gyro_z", Variable::Gyro(2)),
    ("accel_x", Variable::Accel(0)),
    ("accel_y", Variable::Accel(1)),
    ("accel_z", Variable::Accel(2)),
    ("temp", Variable::Temperature),
    ("supply", Variable::Supply),
];

/// Free channels that one expression may use: each needs a place in the effect's memory.
const MOST_CHANNELS: usize = 7;

/// A user's own effect.
pub struct UserEffect {
    definition: Definition,
    free_names: Vec<String>,
    card: &'static Card,
    parameters: &'static [ParameterCard],
    expression: Expression<Variable>,
}

/// The effects defined so far, kept for the life of the process.
static DEFINED: Mutex<Vec<&'static UserEffect>> = Mutex::new(Vec::new());

/// The effect of this definition, on logs whose free channels are called `free_names` (in the order of
/// [`crate::Record::free_names`]).
///
/// It lives as long as the process; the same definition gives the same effect, so reading a model file again costs
/// nothing.
///
/// # Errors
/// Where the definition makes no effect; [`DefinitionError::Expression`] has the place in the expression.
pub fn define(definition: &Definition, free_names: &[String]) -> Result<&'static dyn Effect, DefinitionError> {
    let mut defined = DEFINED.lock().unwrap_or_else(PoisonError::into_inner);
    let same = |e: &&&UserEffect| e.definition == *definition && e.free_names == free_names;
    if let Some(effect) = defined.iter().find(same) {
        return Ok(*effect);
    }
    let effect: &'static UserEffect = Box::leak(Box::new(UserEffect::new(definition, free_names)?));
    defined.push(effect);
    Ok(effect)
}

/// The definition of a user's own effect, for writing it to a model file; `None` for an effect of the catalogue.
#[must_use]
pub fn definition(effect: &'static dyn Effect) -> Option<Definition> {
    let defined = DEFINED.lock().unwrap_or_else(PoisonError::into_inner);
    defined.iter().rev().find(|user| std::ptr::eq(user.card(), effect.card())).map(|user| user.definition.clone())
}

/// The names in an expression that are neither signals nor one of these parameters: free channels of a log. Empty where it is no
/// expression.
#[must_use]
pub fn channels(regressor: &str, parameters: &[String]) -> Vec<String> {
    let mut channels: Vec<String> = Vec::new();
    let _ = Expression::parse(regressor, |name| {
        let known = name == "pi" || SIGNALS.iter().any(|(signal, _)| *signal == name);
        if !known && !parameters.iter().any(|p| p == name) && !channels.iter().any(|c| c == name) {
            channels.push(name.to_owned());
        }
        Ok(())
    });
    channels
}

/// Share of some rows in which a user's effect of typical size has no finite value; 0 for an effect of the catalogue.
pub fn undefined(effect: &'static dyn Effect, rows: impl Iterator<Item = Signals>) -> f64 {
    let defined = DEFINED.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(&user) = defined.iter().find(|user| std::ptr::eq(user.card(), effect.card())) else { return 0.0 };
    drop(defined);
    let typical: Vec<f64> = user.parameters.iter().map(|card| card.typical).collect();
    let mut memory = Memory::default();
    let (mut without, mut all) = (0.0, 0.0);
    for row in rows {
        without += f64::from(!user.value(&typical, &row, &mut memory).is_finite());
        all += 1.0;
    }
    without / f64::max(all, 1.0)
}

impl UserEffect {
    fn new(definition: &Definition, free_names: &[String]) -> Result<Self, DefinitionError> {
        definition.check()?;
        let mut channels = Vec::new();
        let written = |name: &str| definition.parameters.iter().position(|p| p.name == name);
        let expression = Expression::parse(&definition.regressor, |name| {
            if let Some(parameter) = written(name) {
                return Ok(Variable::Parameter(parameter));
            }
            if let Some((_, signal)) = SIGNALS.iter().find(|(signal, _)| *signal == name) {
                return Ok(*signal);
            }
            let channel = free_names.iter().take(FREE_CHANNELS).position(|free| free == name);
            let channel = channel.ok_or_else(|| known(definition, free_names))?;
            let place = channels.iter().position(|c| *c == channel).unwrap_or(channels.len());
            if place == MOST_CHANNELS {
                return Err(format!("at most {MOST_CHANNELS} free channels fit into one expression"));
            }
            if place == channels.len() {
                channels.push(channel);
            }
            Ok(Variable::Free(channel, place))
        })?;
        let count = definition.parameters.len();
        for (k, parameter) in definition.parameters.iter().enumerate() {
            if !expression.variables().any(|v| v == Variable::Parameter(k)) {
                return Err(DefinitionError::UnusedParameter { name: parameter.name.clone() });
            }
        }
        let linear = linearity::coefficients(&expression.map(Variable::parameter), count);
        if !linear.contains(&true) {
            return Err(DefinitionError::NoCoefficient);
        }
        // Coefficients first, then shapes, as every effect has them.
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&k| !linear[k]);
        let place = |v| match v {
            Variable::Parameter(k) => Variable::Parameter(order.iter().position(|&o| o == k).unwrap_or(k)),
            other => other,
        };
        let cards: Vec<_> = order.iter().map(|&k| parameter_card(&definition.parameters[k], linear[k])).collect();
        Ok(Self {
            card: Box::leak(Box::new(card(definition, &expression))),
            parameters: cards.leak(),
            expression: expression.map(place),
            definition: definition.clone(),
            free_names: free_names.to_vec(),
        })
    }
}

impl Variable {
    fn parameter(self) -> Option<usize> {
        match self {
            Self::Parameter(k) => Some(k),
            _ => None,
        }
    }
}

impl UserEffect {
    /// What the expression comes to, finite or not.
    fn value(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        self.expression.evaluate(|variable| match variable {
            Variable::Parameter(k) => p[k],
            Variable::Rate => s.rate(),
            Variable::RateDot => s.rate_dot,
            Variable::Angle => s.angle,
            Variable::Time => s.t,
            Variable::Gyro(i) => s.rates[i],
            Variable::Accel(i) => s.accel[i],
            Variable::Temperature => s.delta_temperature + 25.0,
            Variable::Supply => s.supply,
            Variable::Free(channel, place) => {
                let last = &mut memory.of::<[f64; Memory::NUMBERS]>()[place];
                if s.free[channel].is_finite() {
                    *last = s.free[channel];
                }
                *last
            }
        })
    }
}

impl Effect for UserEffect {
    fn card(&self) -> &'static Card {
        self.card
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        self.parameters
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        let values =
            self.parameters.iter().zip(p).map(|(card, value)| format!("{} = {}", card.name, value.signed(card.unit)));
        format!("your own effect '{}' is there, with {}", self.card.id, values.collect::<Vec<_>>().join(", "))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        let value = self.expression.in_c(|variable| match variable {
            Variable::Parameter(k) => format!("own_{}", self.parameters[k].name),
            Variable::Rate => "in->rate".to_owned(),
            Variable::RateDot => "in->rate_dot".to_owned(),
            Variable::Angle => "in->angle".to_owned(),
            Variable::Time => "in->t".to_owned(),
            Variable::Gyro(i) => format!("in->rates[{i}]"),
            Variable::Accel(i) => format!("in->accel[{i}]"),
            Variable::Temperature => "(in->delta_temperature + 25.0)".to_owned(),
            Variable::Supply => "in->supply".to_owned(),
            Variable::Free(channel, _) => format!("in->channel[{channel}]"),
        });
        Some(format!("const double value = {value};\nreturn isfinite(value) ? value : 0.0;").into())
    }

    /// Each shape on its own from a tenth to ten times its typical size, the others at theirs.
    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        const FACTORS: [f64; 9] = [1.0, 0.1, 0.18, 0.32, 0.56, 1.8, 3.2, 5.6, 10.0];
        let shapes = self.parameters.iter().filter(|card| card.role == Role::Shape);
        let typical: Vec<f64> = shapes.map(|card| card.typical).collect();
        let mut grid = Vec::new();
        for (k, size) in typical.iter().enumerate() {
            // The typical point itself stands in the grid once.
            for factor in FACTORS.iter().skip(usize::from(k > 0)) {
                let mut point = typical.clone();
                point[k] = size * factor;
                grid.push(point);
            }
        }
        grid
    }
}

impl Felt for UserEffect {
    /// Memory: the last value of each free channel.
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let value = self.value(p, s, memory);
        if value.is_finite() { value } else { 0.0 }
    }
}

/// The names that may stand in an expression.
fn known(definition: &Definition, free_names: &[String]) -> String {
    let list = |names: Vec<&str>| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let parameters = list(definition.parameters.iter().map(|p| p.name.as_str()).collect());
    let signals = list(SIGNALS.iter().map(|(name, _)| *name).collect());
    let free = list(free_names.iter().map(String::as_str).collect());
    format!("parameters are {parameters}; signals are {signals}; free channels of the log are {free}")
}

/// A shape keeps its sign and stays within a factor of a thousand of its typical size.
fn parameter_card(parameter: &ParameterDefinition, linear: bool) -> ParameterCard {
    let typical = parameter.typical;
    let (near, far) = (typical * 1e-3, typical * 1e3);
    let free = (f64::NEG_INFINITY, f64::INFINITY);
    ParameterCard {
        name: parameter.name.clone().leak(),
        unit: parameter.unit.clone().leak(),
        says: if linear { "coefficient of the user's expression" } else { "shape in the user's expression" },
        role: if linear { Role::Linear } else { Role::Shape },
        neutral: if linear { 0.0 } else { typical },
        typical,
        bounds: if linear || typical == 0.0 { free } else { (near.min(far), near.max(far)) },
    }
}

fn card(definition: &Definition, expression: &Expression<Variable>) -> Card {
    let uses = |of: fn(Variable) -> bool| expression.variables().any(of);
    let gyro = |i: usize| (Need::Gyro(Axis::ALL[i]), expression.variables().any(|v| v == Variable::Gyro(i)));
    let needs = [
        gyro(0),
        gyro(1),
        gyro(2),
        (Need::Accelerometer, uses(|v| matches!(v, Variable::Accel(_)))),
        (Need::Temperature, uses(|v| v == Variable::Temperature)),
        (Need::Supply, uses(|v| v == Variable::Supply)),
    ];
    let is_slow_signal = |v| matches!(v, Variable::Time | Variable::Temperature | Variable::Supply);
    let is_parameter = |v| matches!(v, Variable::Parameter(_));
    let is_slow = uses(is_slow_signal) && expression.variables().all(|v| is_slow_signal(v) || is_parameter(v));
    let needs: Vec<Need> = needs.into_iter().filter(|(_, used)| *used).map(|(need, _)| need).collect();
    let sizes: Vec<String> =
        definition.parameters.iter().map(|p| format!("{} = {:e} {}", p.name, p.typical, p.unit)).collect();
    Card {
        id: definition.id.clone().leak(),
        title: "a user's own effect",
        physics: "Defined by an expression in the model file.",
        equation: format!("ω_f = ω + {}", definition.regressor).leak(),
        typical: sizes.join(", ").leak(),
        source: "the model file",
        needs: needs.leak(),
        excited_by: "whatever moves the columns of its expression",
        mended_by: "exactly, where the columns of its expression are measured",
        at_source: "",
        traits: if is_slow { &[Trait::Slow] } else { &[] },
        simpler: &[],
        aliases: &[],
    }
}

#[cfg(test)]
mod tests;
