//! One model fitted to several logs, each with a zero and a reference of its own.
//!
//! Gauss–Newton on the whitened normal equations of all logs: at each turn every log is linearised at the common values, its own
//! parameters are taken out, the rest is summed and solved, and each log's own follow from the common ones,
//!
//! ```text
//! θ_S = (Σ_l A_S|N)⁻¹ Σ_l b_S|N          θ_N = A_NN⁻¹ (b_N − A_NS θ_S)
//! ```

use super::{Equations, Key, Piece, column::is_own, piece::fitted, search::p_differs};
use crate::{Axis, Model, Record, fit::FitError};
use std::collections::{BTreeMap, BTreeSet};

/// One log and the model that it has: common values, and its own.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model of this log.
    pub model: Model,
    /// What it alone says of each common parameter, the others being free: value and standard error.
    pub alone: BTreeMap<Key, (f64, f64)>,
    /// Standard errors of its own parameters, the common ones being known.
    pub own: BTreeMap<Key, f64>,
}

/// What was fitted.
#[derive(Clone, Debug)]
pub struct Joint {
    /// The model: common values with their standard errors; of what is each log's own the weighted mean.
    pub model: Model,
    /// Log by log.
    pub each: Vec<Fitted>,
    /// Chance that logs with one value would differ as much, parameter by parameter.
    pub differs: BTreeMap<Key, f64>,
}

/// Turns at most, and the step in standard errors with which it ends.
const TURNS: usize = 6;
const SMALL: f64 = 0.02;

/// Fits a model to several logs. Each log is given with the model that it starts from, all with the same effects, and its axes. The
/// effects `differing` have a size of their own in each log.
///
/// # Errors
/// A log of too few rows.
pub fn fit(logs: &[(&Record, Model, Vec<Axis>)], differing: &[(Axis, String)]) -> Result<Joint, FitError> {
    let differs = |axis: Axis, id: &str| differing.iter().any(|(own, effect)| *own == axis && effect == id);
    let mut models: Vec<Model> = logs.iter().map(|(_, model, _)| model.clone()).collect();
    let mut pieces: Vec<Vec<Piece>> = Vec::new();
    let mut common = Equations::empty();
    let mut shared: BTreeMap<Key, (f64, f64)> = BTreeMap::new();
    for turn in 0..TURNS {
        pieces = logs
            .iter()
            .zip(&models)
            .map(|((record, _, axes), model)| fitted(record, model, axes))
            .collect::<Result<_, _>>()?;
        let columns = pieces.iter_mut().flatten().flat_map(|piece| &mut piece.columns);
        columns.for_each(|column| column.own |= differs(column.key.axis, &column.key.effect));
        let whole: Vec<Equations> =
            pieces.iter().map(|own| Equations::sum(&own.iter().map(Equations::of).collect::<Vec<_>>())).collect();
        let own: BTreeSet<Key> =
            pieces.iter().flatten().flat_map(|piece| &piece.columns).filter(|c| c.own).map(|c| c.key.clone()).collect();
        let reduced: Vec<Equations> = whole.iter().map(|e| e.without(|key| own.contains(key))).collect();
        common = Equations::sum(&reduced);
        let (values, covariance) = common.solve();
        let told = |k: usize| (values[k], covariance[(k, k)].sqrt());
        let new: BTreeMap<Key, (f64, f64)> =
            common.keys.iter().cloned().enumerate().map(|(k, key)| (key, told(k))).collect();
        let known = |key: &Key| new.get(key).filter(|(_, error)| error.is_finite()).map(|(value, _)| *value);
        let largest = new.iter().filter_map(|(key, (value, error))| {
            let before = models.iter().find_map(|model| get(model, key))?;
            Some((value - before).abs() / error).filter(|step| step.is_finite())
        });
        let largest = largest.fold(0.0, f64::max);
        for (model, equations) in models.iter_mut().zip(&whole) {
            for (key, value) in equations.rest_beside(&known, &|key| own.contains(key)) {
                set(model, &key, value);
            }
            for key in new.keys() {
                if let Some(value) = known(key) {
                    set(model, key, value);
                }
            }
        }
        shared = new;
        if turn > 0 && largest < SMALL {
            break;
        }
    }
    Ok(told(models, &pieces, &common, &shared, &differs))
}

fn told(
    models: Vec<Model>,
    pieces: &[Vec<Piece>],
    common: &Equations,
    shared: &BTreeMap<Key, (f64, f64)>,
    differs_in_each: &dyn Fn(Axis, &str) -> bool,
) -> Joint {
    let inflation = |key: &Key| {
        let of = |piece: &Piece| piece.place(key).map(|place| (piece.inflation[place], piece.entry(place, place)));
        let (sum, all) = pieces.iter().flatten().filter_map(of).fold((0.0, 0.0), |(s, a), (f, w)| (s + f * w, a + w));
        if all > 0.0 { (sum / all).sqrt() } else { 1.0 }
    };
    let inflation_of = |own: &[Piece], key: &Key| {
        own.iter().find_map(|piece| piece.place(key).map(|k| piece.inflation[k])).unwrap_or(1.0)
    };
    let each: Vec<Fitted> = models
        .into_iter()
        .zip(pieces)
        .map(|(mut model, own)| {
            let whole = Equations::sum(&own.iter().map(Equations::of).collect::<Vec<_>>());
            let (mut alone, mut errors) = (BTreeMap::new(), BTreeMap::new());
            for column in own.iter().flat_map(|piece| &piece.columns) {
                let inflation = inflation_of(own, &column.key);
                if column.own {
                    // The common ones are known far better.
                    let given = whole.with(|_, key| !shared.contains_key(key));
                    if let Some(told) = given.told(&column.key) {
                        errors.insert(column.key.clone(), (told.variance * inflation).sqrt());
                    }
                } else if let Some(told) = whole.told(&column.key) {
                    alone.insert(column.key.clone(), (told.value, (told.variance * inflation).sqrt()));
                }
            }
            for piece in own {
                for axis in &piece.axes {
                    if let Some(model) = &mut model.axes[axis.index()] {
                        model.noise = crate::Noise {
                            angle_random_walk: piece.noise.angle_random_walk,
                            bias_random_walk: piece.noise.bias_random_walk,
                            encoder: piece.noise.encoder,
                            unexplained: 0.0,
                        };
                    }
                }
            }
            for (key, error) in &errors {
                set_error(&mut model, key, *error);
            }
            Fitted { model, alone, own: errors }
        })
        .collect();
    let mut differs = BTreeMap::new();
    let mut model = mean_of(&each, differs_in_each);
    for key in &common.keys {
        let readings: Vec<Option<(f64, f64)>> = each.iter().map(|own| own.alone.get(key).copied()).collect();
        differs.insert(key.clone(), p_differs(&readings));
        if let Some((value, error)) = shared.get(key) {
            let error = error * inflation(key);
            set(&mut model, key, *value);
            set_error(&mut model, key, error);
        }
    }
    let mut each = each;
    for own in &mut each {
        for (key, (_, error)) in shared {
            set_error(&mut own.model, key, error * inflation(key));
        }
    }
    Joint { model, each, differs }
}

/// The model of all: own parameters and noise in the mean over the logs.
fn mean_of(each: &[Fitted], differs_in_each: &dyn Fn(Axis, &str) -> bool) -> Model {
    let mut model = each.first().map(|own| own.model.clone()).unwrap_or_default();
    for (index, slot) in model.axes.iter_mut().enumerate() {
        let models = each.iter().filter_map(|own| own.model.axes[index].as_ref());
        let list: Vec<&crate::AxisModel> = models.collect();
        let Some(first) = list.first() else { continue };
        let own = slot.get_or_insert_with(|| (*first).clone());
        // What happened in one log only is no part of the common model.
        own.terms.retain(|term| list.iter().all(|other| other.term(term.effect.card().id).is_some()));
        let square = |of: fn(&crate::Noise) -> f64| {
            (list.iter().map(|m| of(&m.noise).powi(2)).sum::<f64>() / list.len() as f64).sqrt()
        };
        own.noise = crate::Noise {
            angle_random_walk: square(|n| n.angle_random_walk),
            bias_random_walk: square(|n| n.bias_random_walk),
            encoder: square(|n| n.encoder),
            unexplained: square(|n| n.unexplained),
        };
        let each_has_its_own =
            |term: &&mut crate::Term| is_own(term.effect) || differs_in_each(Axis::ALL[index], term.effect.card().id);
        for term in own.terms.iter_mut().filter(each_has_its_own) {
            for k in 0..term.values.len() {
                let of = |m: &&crate::AxisModel| {
                    let term = m.term(term.effect.card().id)?;
                    Some((term.values[k], term.std_errors[k]))
                        .filter(|(v, s)| v.is_finite() && *s > 0.0 && s.is_finite())
                };
                let told: Vec<(f64, f64)> = list.iter().filter_map(of).collect();
                if told.is_empty() {
                    continue;
                }
                let weight: f64 = told.iter().map(|(_, s)| s.powi(-2)).sum();
                let mean = told.iter().map(|(v, s)| v / (s * s)).sum::<f64>() / weight;
                let n = told.len() as f64;
                // From log to log it is another one: how far it lies from their mean is its error.
                let scatter = if told.len() > 1 {
                    (told.iter().map(|(v, _)| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
                } else {
                    0.0
                };
                (term.values[k], term.std_errors[k]) = (mean, scatter.max(weight.powf(-0.5)));
            }
        }
    }
    model
}

/// A parameter's value in a model.
#[must_use]
pub fn get(model: &Model, key: &Key) -> Option<f64> {
    let term = model.axes[key.axis.index()].as_ref()?.term(&key.effect)?;
    let place = term.effect.parameters(key.axis).iter().position(|card| card.name == key.name)?;
    Some(term.values[place])
}

fn place<'m>(model: &'m mut Model, key: &Key) -> Option<(&'m mut crate::Term, usize)> {
    let own = model.axes[key.axis.index()].as_mut()?;
    let term = own.terms.iter_mut().find(|term| term.effect.card().id == key.effect)?;
    let place = term.effect.parameters(key.axis).iter().position(|card| card.name == key.name)?;
    Some((term, place))
}

/// Sets a parameter, within its bounds.
pub fn set(model: &mut Model, key: &Key, value: f64) {
    if let Some((term, k)) = place(model, key)
        && value.is_finite()
    {
        let bounds = term.effect.parameters(key.axis)[k].bounds;
        term.values[k] = value.clamp(bounds.0, bounds.1);
    }
}

/// Sets the standard error of a parameter.
pub fn set_error(model: &mut Model, key: &Key, error: f64) {
    if let Some((term, k)) = place(model, key) {
        term.std_errors[k] = error;
    }
}
