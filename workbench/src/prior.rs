//! A type as it stands in a file, and a model that starts from it: `gyro_model::pooled::prior`.

use crate::{
    fleet::type_file,
    model_file::ModelFile,
    subject::{Start, Subject},
    toml_error::TomlError,
    words::{self, Task, call},
};
use anyhow::{Context, Error, Result, bail};
use gyro_model::{
    Axis, Model,
    diagnosis::AxisResult,
    effects::find,
    pooled::{
        Key,
        prior::{self, Known, Noticed, OfType},
    },
    words::{Voice, shell_word},
};
use serde::Deserialize;
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt, fs,
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

/// What a type file is for.
const TYPE_FILE: &str =
    "a type file holds what parts of one type have in common; it is made of the evidence of such parts";
/// How the schemas of other files begin.
const MODEL: &str = "truerate.model/";
const EVIDENCE: &str = "truerate.evidence/";

/// A type that cannot be used: what was found, why that is not enough, and what to do.
#[derive(Debug)]
struct Refusal {
    found: String,
    why: String,
    next: Next,
}

/// What to do.
#[derive(Debug)]
enum Next {
    /// Write this type file of a fleet.
    Export(String),
    /// The same of this fleet.
    Fleet(PathBuf),
    /// Give another prior.
    Prior(String),
    /// Give it as a model.
    Model(PathBuf),
    /// Give none.
    Without,
    /// One of these, in the command that was given.
    Again(String),
}

impl Refusal {
    /// With the command that was given, in which the prior was written so.
    fn of(self, prior: &Path) -> Self {
        let flag = match &self.next {
            Next::Prior(other) => format!("--prior {}", shell_word(other)),
            Next::Model(file) => format!("--model {}", shell_word(&file.display().to_string())),
            Next::Without => String::new(),
            _ => return self,
        };
        let is_given = |word: &str| std::path::absolute(word).ok() == std::path::absolute(prior).ok();
        let (mut words, mut is_there) = (Vec::new(), false);
        let mut given = words::command().iter().peekable();
        while let Some(word) = given.next() {
            let is_next = word == "--prior" && given.peek().is_some_and(|next| is_given(next));
            if is_next || word.strip_prefix("--prior=").is_some_and(is_given) {
                if is_next {
                    given.next();
                }
                is_there = true;
                words.push(flag.clone());
            } else {
                words.push(shell_word(word));
            }
        }
        words.retain(|word| !word.is_empty());
        let command = if is_there { words.join(" ") } else { format!("fit LOG {flag}").trim_end().to_owned() };
        Self { next: Next::Again(format!("truerate {command}")), ..self }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.found, self.why)?;
        let library = matches!(words::voice(), Voice::Library | Voice::Page);
        match &self.next {
            Next::Export(name) if library => write!(f, ": {}", call(Task::Fleet, &format!("F --export {name}"))),
            Next::Fleet(_) if library => write!(f, ": {}", call(Task::Fleet, "F --export type.toml")),
            _ if library => Ok(()),
            Next::Export(name) => write!(f, "\ntruerate fleet F --export {}", shell_word(name)),
            Next::Fleet(file) => {
                write!(f, "\ntruerate fleet {} --export type.toml", shell_word(&file.display().to_string()))
            }
            Next::Again(command) => write!(f, "\n{command}"),
            Next::Prior(other) => write!(f, "\ntruerate fit LOG --prior {}", shell_word(other)),
            Next::Model(file) => write!(f, "\ntruerate fit LOG --model {}", shell_word(&file.display().to_string())),
            Next::Without => write!(f, "\ntruerate fit LOG"),
        }
    }
}

impl std::error::Error for Refusal {}

/// The name of a type file that can be written beside what was given in its place: its own where there is no such file.
fn free_name(file: &Path) -> String {
    if file.exists() { "type.toml".to_owned() } else { file.display().to_string() }
}

#[derive(Deserialize)]
struct Head {
    schema: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "schema")]
    _schema: String,
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
        let text = fs::read(&file).map_err(|error| Refusal {
            found: format!("{name}: cannot be read ({error})"),
            why: TYPE_FILE.to_owned(),
            next: Next::Export(free_name(&file)),
        })?;
        let text = String::from_utf8_lossy(&text);
        Self::parse(&file, &text, wanted.as_deref()).map_err(|error| again(error, path))
    }

    /// Understands its text.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(file: &Path, text: &str, wanted: Option<&str>) -> Result<Self> {
        let name = file.display();
        let head: Option<Head> = toml::from_str(text).ok();
        let refuse =
            |found: String, why: &str, next| Refusal { found: format!("{name}: {found}"), why: why.to_owned(), next };
        match head {
            Some(Head { schema: Some(schema) }) if schema == type_file::SCHEMA => {}
            Some(Head { schema: Some(schema) }) if schema.starts_with(MODEL) => {
                let next = Next::Model(file.to_owned());
                bail!(refuse(
                    "is a model file, not a type file".to_owned(),
                    "a model of one part is given as a model: the fit starts from it",
                    next
                ));
            }
            Some(Head { schema: Some(schema) }) => {
                let found = format!("has the schema '{schema}', and this program knows '{}'", type_file::SCHEMA);
                bail!(refuse(
                    found,
                    "another edition of the program wrote it: write it again with this one",
                    Next::Export(free_name(file))
                ));
            }
            // A slip in it is told with its line.
            _ if text.contains(type_file::SCHEMA) => {}
            _ if text.contains(EVIDENCE) => {
                let found = "is evidence of logs, not a type file".to_owned();
                bail!(refuse(found, TYPE_FILE, Next::Fleet(file.to_owned())));
            }
            _ => bail!(refuse("is not a type file".to_owned(), TYPE_FILE, Next::Export(free_name(file)))),
        }
        let mut parsed: File = toml::from_str(text).map_err(|error| TomlError::syntax(file, text, &error))?;
        let names: Vec<String> = parsed.kinds.keys().cloned().collect();
        let kind = match (wanted, &names[..]) {
            (Some(kind), _) => kind.to_owned(),
            (None, [one]) => one.clone(),
            (None, []) => bail!(refuse(
                "holds no type".to_owned(),
                "its fleet had no type whose parts were known well",
                Next::Without
            )),
            (None, [first, ..]) => {
                let next = Next::Prior(format!("{name}:{first}"));
                bail!(refuse(
                    format!("holds the types {}", names.join(", ")),
                    "a part is of one of them: name it behind the file",
                    next
                ));
            }
        };
        let Some(own) = parsed.kinds.remove(&kind) else {
            let near = names.iter().min_by_key(|own| strsim::levenshtein(&own.to_lowercase(), &kind.to_lowercase()));
            let next = near.map_or(Next::Without, |near| Next::Prior(format!("{name}:{near}")));
            let found = format!("holds no type '{kind}', only {}", names.join(", "));
            bail!(refuse(found, "a prior of another type would be worse than none: name the type of this part", next));
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
            let letters =
                |axes: &mut dyn Iterator<Item = &Axis>| axes.map(|axis| axis.letter()).collect::<Vec<_>>().join(", ");
            let (own, known) = (letters(&mut subject.axes.iter()), letters(&mut axes.iter()));
            bail!(Refusal {
                found: format!("{}: the type {} says nothing of axis {own}, only of {known}", subject.name, self.kind),
                why: "nothing of the type could be used: fit without it, or take the type from parts that were recorded on these axes".to_owned(),
                next: Next::Without,
            });
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

    /// How this gyro differs from its type, in words.
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

/// An error of a prior with the command that was given, in which the prior was written so.
#[must_use]
pub fn again(error: Error, prior: &Path) -> Error {
    match error.downcast::<Refusal>() {
        Ok(refusal) => refusal.of(prior).into(),
        Err(error) => error,
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
