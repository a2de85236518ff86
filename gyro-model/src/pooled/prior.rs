//! What is known of a part before it is measured: its type. A fit starts from there.
//!
//! ```text
//! (A + P) θ = b + P μ        P⁻¹ = spread of the parts² + spread of the logs² + standard error of the mean²
//! ```
//!
//! A parameter that the log has otherwise (by more than [`FAR`] standard deviations of both together) is noticed and not pulled.

use super::{Equations, Key, joint, piece::beside_noise};
use crate::{Axis, AxisModel, Model, Record, Term, effects::find, fit::FitError};
use std::collections::{BTreeMap, BTreeSet};

/// What a type says of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Its mean.
    pub mean: f64,
    /// Standard deviation of a new part about it.
    pub deviation: f64,
}

/// What a type says, parameter by parameter.
pub type OfType = BTreeMap<Key, Known>;

/// A parameter that is not of the type.
#[derive(Clone, Debug, PartialEq)]
pub struct Noticed {
    /// Which.
    pub key: Key,
    /// What the log says of it.
    pub value: f64,
    /// Standard error of that.
    pub std_error: f64,
    /// What the type has.
    pub known: Known,
}

/// Standard deviations beyond which a part is not of its type: one parameter in five thousand by chance.
pub const FAR: f64 = 3.7;
/// Turns of the fit.
const TURNS: usize = 3;

/// A model with the effects of the type on these axes, at its means, known as well as a new part is.
#[must_use]
pub fn seeded(mut model: Model, axes: &[Axis], kind: &OfType) -> Model {
    for axis in axes {
        let own = model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(*axis));
        for key in kind.keys().filter(|key| key.axis == *axis) {
            if let Some(effect) = find(&key.effect).filter(|_| own.term(&key.effect).is_none()) {
                own.terms.push(Term::neutral(effect, *axis));
            }
        }
    }
    for (key, known) in kind.iter().filter(|(key, _)| axes.contains(&key.axis)) {
        joint::set(&mut model, key, known.mean);
        joint::set_error(&mut model, key, known.deviation);
    }
    model
}

/// A model whose other parameters stand near their optimum, fitted to a log of a new part beside what its type says, and what is not
/// of the type. Effects of the type that the model does not have stay out.
///
/// # Errors
/// A log of too few rows.
pub fn settled(
    record: &Record,
    axes: &[Axis],
    mut model: Model,
    kind: &OfType,
) -> Result<(Model, Vec<Noticed>), FitError> {
    for (key, known) in kind {
        joint::set(&mut model, key, known.mean);
    }
    let (mut dropped, mut noticed) = (BTreeSet::new(), Vec::new());
    for _ in 0..TURNS {
        let (own, inflation) = equations(record, &model, axes)?;
        // One that is far off would pull the others with it: it goes first.
        let far = |key: &Key| {
            let known = *kind.get(key)?;
            let told = with_type(&own, kind, |other| other != key && !dropped.contains(other)).told(key)?;
            let std_error = (told.variance * inflation.get(key).copied().unwrap_or(1.0)).sqrt();
            let apart = (told.value - known.mean).abs() / std_error.hypot(known.deviation);
            Some((apart, Noticed { key: key.clone(), value: told.value, std_error, known }))
        };
        let asked = kind.keys().filter(|key| own.keys.contains(key) && !dropped.contains(*key));
        let worst = asked.filter_map(far).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, found)) = worst.filter(|(apart, _)| *apart > FAR) {
            dropped.insert(found.key.clone());
            noticed.push(found);
        }
        let all = with_type(&own, kind, |key| !dropped.contains(key));
        let (values, covariance) = all.solve();
        for (k, key) in all.keys.iter().enumerate() {
            joint::set(&mut model, key, values[k]);
            joint::set_error(&mut model, key, covariance[(k, k)].sqrt());
        }
    }
    Ok((model, noticed))
}

/// The log's equations of a model's parameters, and the inflation of each.
fn equations(record: &Record, model: &Model, axes: &[Axis]) -> Result<(Equations, BTreeMap<Key, f64>), FitError> {
    let pieces = beside_noise(record, model, axes, 1)?;
    let columns = pieces.iter().flat_map(|piece| piece.columns.iter().zip(&piece.inflation));
    let inflation = columns.map(|(column, own)| (column.key.clone(), *own)).collect();
    Ok((Equations::sum(&pieces.iter().map(Equations::of).collect::<Vec<_>>()), inflation))
}

/// Equations with what the type says of these parameters.
fn with_type(own: &Equations, kind: &OfType, is_used: impl Fn(&Key) -> bool) -> Equations {
    let mut all = own.clone();
    for (k, key) in own.keys.iter().enumerate().filter(|(_, key)| is_used(key)) {
        if let Some(known) = kind.get(key) {
            let precision = known.deviation.powi(-2);
            all.matrix[(k, k)] += precision;
            all.right[k] += precision * known.mean;
        }
    }
    all
}
