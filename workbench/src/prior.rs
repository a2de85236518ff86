//! A type as it stands in a file, and a model that starts from it: `gyro_model::pooled::prior`.

use crate::{
    fleet::type_file,
    model_file::ModelFile,
    subject::{Start, Subject},
    toml_error::TomlError,
    words::{Task, call},
};
use anyhow::{Context, Result, bail};
use gyro_model::{
    Axis, Model,
    diagnosis::AxisResult,
    effects::find,
    pooled::{
        Key,
        prior::{self, Known, Noticed, OfType},
    },
};
use serde::Deserialize;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// A type.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Its name.
    pub kind: String,
    /// Parameter by parameter.
    pub known: OfType,
}

/// A model that was begun from a type, and what was noticed.
#[derive(Clone, Debug)]
pub struct Begun {
    /// To start from.
    pub start: Start,
    /// In words, axis by axis.
    pub says: Vec<(Axis, String)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    #[serde(rename = "type", default)]
    kinds: BTreeMap<String, Kind>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Kind {
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
        let text = fs::read_to_string(&file).with_context(|| {
            format!("{name}: cannot be read: make it with {}", call(Task::Fleet, &format!("F --export {name}")))
        })?;
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
        let start = prior::seeded(subject.fit(&subject.base())?, &subject.axes, &self.known);
        let (mut model, noticed) =
            prior::settled(&subject.record, &subject.axes, start, &self.known).with_context(|| subject.name.clone())?;
        model.epoch += 1;
        let file = ModelFile { model, ..subject.fitted(Model::default(), Vec::new()) };
        let says = noticed.iter().map(|own| (own.key.axis, self.says(own))).collect();
        Ok(Begun { start: Start { file, own_log: false, given: true, laid: None }, says })
    }

    /// A part of this type before anything was read of it.
    #[must_use]
    pub fn model(&self) -> Model {
        let axes: BTreeSet<Axis> = self.known.keys().map(|key| key.axis).collect();
        prior::seeded(Model::default(), &axes.into_iter().collect::<Vec<_>>(), &self.known)
    }

    /// What is not of the type, in words.
    #[must_use]
    pub fn says(&self, noticed: &Noticed) -> String {
        let Noticed { key, value, std_error, known } = noticed;
        let unit = key.card().map_or("1", |card| card.unit);
        format!(
            "This part is not of its type in {}: {}, and {} has {}. It was not pulled there.",
            key.effect,
            crate::fleet::value(*value, Some(*std_error), unit),
            self.kind,
            crate::fleet::value(known.mean, Some(known.deviation), unit)
        )
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
