//! What is known of a part before it is measured: its type. A fit starts from there.
//!
//! ```text
//! (A + P) θ = b + P μ        P⁻¹ = spread of the parts² + spread of the logs² + standard error of the mean²
//! ```
//!
//! A parameter that the log has otherwise (by more than [`FAR`] standard deviations of both together) is said and not pulled.

use crate::{
    fleet::type_file,
    model_file::ModelFile,
    subject::{Start, Subject},
    toml_error::TomlError,
};
use anyhow::{Context, Result, bail};
use gyro_model::{
    Axis, AxisModel, Model, Term,
    diagnosis::AxisResult,
    effects::find,
    pooled::{self, Equations, Key, joint},
};
use serde::Deserialize;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// What a type says of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Its mean.
    pub mean: f64,
    /// Standard deviation of a new part about it.
    pub deviation: f64,
}

/// A type.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Its name.
    pub kind: String,
    /// Parameter by parameter.
    pub known: BTreeMap<Key, Known>,
}

/// A model that was begun from a type, and what was noticed.
#[derive(Clone, Debug)]
pub struct Begun {
    /// To start from.
    pub start: Start,
    /// In words, axis by axis.
    pub says: Vec<(Axis, String)>,
}

/// Standard deviations beyond which a part is not of its type: one parameter in five thousand by chance.
pub const FAR: f64 = 3.7;
/// Turns of the fit.
const TURNS: usize = 3;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    #[serde(rename = "type", default)]
    kinds: BTreeMap<String, OfType>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OfType {
    axis: BTreeMap<Axis, BTreeMap<String, BTreeMap<String, Entry>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    mean: f64,
    std_error: f64,
    #[serde(default)]
    spread: f64,
    #[serde(default)]
    spread_of_logs: f64,
    #[serde(rename = "parts")]
    _parts: u64,
    #[serde(rename = "unit")]
    _unit: String,
}

impl Prior {
    /// Reads a type file: `FILE`, or `FILE:TYPE` where it holds several.
    ///
    /// # Errors
    /// It cannot be read, is none, or holds several types or none of that name.
    pub fn load(path: &Path) -> Result<Self> {
        let whole = path.display().to_string();
        let (file, wanted) = match whole.rsplit_once(':') {
            Some((file, kind)) if !path.exists() => (PathBuf::from(file), Some(kind.to_owned())),
            _ => (path.to_owned(), None),
        };
        let name = file.display().to_string();
        let text = fs::read_to_string(&file)
            .with_context(|| format!("{name}: cannot be read: make it with `truerate fleet F --export {name}`"))?;
        Self::parse(&file, &text, wanted.as_deref())
    }

    /// Understands its text.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(file: &Path, text: &str, wanted: Option<&str>) -> Result<Self> {
        let name = file.display();
        let mut parsed: File = toml::from_str(text).map_err(|error| TomlError::syntax(file, text, &error))?;
        if parsed.schema != type_file::SCHEMA {
            bail!("{name}: has the schema '{}', and this program knows '{}'", parsed.schema, type_file::SCHEMA);
        }
        let names: Vec<String> = parsed.kinds.keys().cloned().collect();
        let kind = match (wanted, &names[..]) {
            (Some(kind), _) => kind.to_owned(),
            (None, [one]) => one.clone(),
            (None, []) => bail!("{name}: holds no type"),
            (None, _) => bail!("{name}: holds the types {}: give one of them as {name}:TYPE", names.join(", ")),
        };
        let Some(own) = parsed.kinds.remove(&kind) else {
            bail!("{name}: holds no type '{kind}', only {}", names.join(", "))
        };
        let mut known = BTreeMap::new();
        for (axis, effects) in own.axis {
            for (id, parameters) in effects {
                let Some(effect) = find(&id) else { bail!("{name}: no effect '{id}' in the catalogue") };
                for (parameter, entry) in parameters {
                    if !effect.parameters(axis).iter().any(|card| card.name == parameter) {
                        bail!("{name}: '{id}' has no parameter '{parameter}' on axis {axis}");
                    }
                    let deviation = entry.spread.hypot(entry.spread_of_logs).hypot(entry.std_error);
                    if !(entry.mean.is_finite() && deviation.is_finite() && deviation > 0.0) {
                        bail!("{name}: {id}.{parameter} of axis {axis} has no finite mean and spread");
                    }
                    known.insert(Key::new(axis, &id, &parameter), Known { mean: entry.mean, deviation });
                }
            }
        }
        Ok(Self { kind, known })
    }

    /// A model of this type, fitted to a log of a new part.
    ///
    /// # Errors
    /// A log that cannot be fitted, or an axis that the type says nothing of.
    pub fn begin(&self, subject: &Subject) -> Result<Begun> {
        let axes: BTreeSet<Axis> = self.known.keys().map(|key| key.axis).collect();
        if !subject.axes.iter().any(|axis| axes.contains(axis)) {
            let letters: Vec<&str> = axes.iter().map(|axis| axis.letter()).collect();
            bail!("{}: the type {} says nothing of its axes, only of {}", subject.name, self.kind, letters.join(", "));
        }
        let mut model = subject.fit(&subject.base())?;
        for axis in &subject.axes {
            let own = model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(*axis));
            for (key, known) in self.known.iter().filter(|(key, _)| key.axis == *axis) {
                let Some(effect) = find(&key.effect) else { continue };
                let place = effect.parameters(*axis).iter().position(|card| card.name == key.name);
                if own.term(&key.effect).is_none() {
                    own.terms.push(Term::neutral(effect, *axis));
                }
                let term = own.terms.iter_mut().find(|term| term.effect.card().id == key.effect);
                if let (Some(term), Some(place)) = (term, place) {
                    term.values[place] = known.mean;
                }
            }
        }
        let (mut dropped, mut says) = (BTreeSet::new(), Vec::new());
        for _ in 0..TURNS {
            let own = Self::equations(subject, &model)?;
            // One that is far off would pull the others with it: it goes first.
            let far = |key: &Key| {
                let known = self.known.get(key)?;
                let others = with_prior(&own.0, &self.known, |other| other != key && !dropped.contains(other));
                let told = others.told(key)?;
                let variance = told.variance * own.1.get(key).copied().unwrap_or(1.0);
                let apart = (told.value - known.mean).abs() / variance.sqrt().hypot(known.deviation);
                Some((apart, key.clone(), told.value, variance.sqrt(), *known))
            };
            let keys: Vec<Key> =
                self.known.keys().filter(|key| own.0.keys.contains(key) && !dropped.contains(*key)).cloned().collect();
            let worst = keys.iter().filter_map(far).max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, key, value, error, known)) = worst.filter(|(apart, ..)| *apart > FAR) {
                says.push((key.axis, told(&self.kind, &key, (value, error), known)));
                dropped.insert(key);
            }
            let all = with_prior(&own.0, &self.known, |key| !dropped.contains(key));
            let (values, covariance) = all.solve();
            for (k, key) in all.keys.iter().enumerate() {
                joint::set(&mut model, key, values[k]);
                joint::set_error(&mut model, key, covariance[(k, k)].sqrt());
            }
        }
        model.epoch += 1;
        let file = ModelFile { model, ..subject.fitted(Model::default(), Vec::new()) };
        Ok(Begun { start: Start { file, own_log: false, given: true }, says })
    }

    /// The log's equations of a model's parameters, and the inflation of each.
    fn equations(subject: &Subject, model: &Model) -> Result<(Equations, BTreeMap<Key, f64>)> {
        let pieces = pooled::pieces(&subject.record, model, &subject.axes, 1).with_context(|| subject.name.clone())?;
        let mut inflation = BTreeMap::new();
        let mut all = Vec::new();
        for piece in &pieces {
            let stands = |key: &Key| joint::get(model, key).is_some() && key.shape.is_empty();
            for (column, own) in piece.columns.iter().zip(&piece.inflation).filter(|(column, _)| stands(&column.key)) {
                inflation.insert(column.key.clone(), *own);
            }
            all.push(Equations::of(piece).with(stands));
        }
        Ok((Equations::sum(&all), inflation))
    }
}

/// Adds to each axis what was noticed beside its answer.
pub fn say_beside(axes: &mut [AxisResult], says: &[(Axis, String)]) {
    for (axis, text) in says {
        for own in axes.iter_mut().filter(|own| own.axis == *axis) {
            if !own.of_logs.is_empty() {
                own.of_logs.push(' ');
            }
            own.of_logs.push_str(text);
        }
    }
}

/// Equations with what the type says of these parameters.
fn with_prior(own: &Equations, known: &BTreeMap<Key, Known>, is_used: impl Fn(&Key) -> bool) -> Equations {
    let mut all = own.clone();
    for (k, key) in own.keys.iter().enumerate().filter(|(_, key)| is_used(key)) {
        if let Some(known) = known.get(key) {
            let precision = known.deviation.powi(-2);
            all.matrix[(k, k)] += precision;
            all.right[k] += precision * known.mean;
        }
    }
    all
}

fn told(kind: &str, key: &Key, (value, error): (f64, f64), known: Known) -> String {
    let unit = key.card().map_or("1", |card| card.unit);
    format!(
        "This part is not of its type in {}: {}, and {kind} has {}. It was not pulled there.",
        key.effect,
        crate::fleet::value(value, Some(error), unit),
        crate::fleet::value(known.mean, Some(known.deviation), unit)
    )
}
