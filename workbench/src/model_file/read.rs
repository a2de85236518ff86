//! Understanding a model file, strictly.

use super::{ModelFile, Provenance, SCHEMA};
use crate::{
    toml_error::{TomlError, quoted},
    words::{Task, call},
};
use gyro_model::{
    Axis, AxisModel, Model, Noise, Term,
    effects::{
        self, Effect, ParameterCard, Role, meant,
        user::{self, Definition, DefinitionError, ParameterDefinition},
    },
};
use jiff::Timestamp;
use serde::Deserialize;
use std::{collections::BTreeMap, ops::Range, path::Path};
use toml::Spanned;

#[derive(Deserialize)]
struct SchemaOnly {
    schema: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "schema")]
    _schema: String,
    #[serde(default)]
    epoch: u64,
    provenance: Option<ProvenanceSection>,
    #[serde(default)]
    axis: BTreeMap<Spanned<String>, Spanned<AxisSection>>,
    #[serde(default)]
    effect: BTreeMap<Spanned<String>, EffectSection>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectSection {
    regressor: Spanned<String>,
    parameters: BTreeMap<Spanned<String>, EffectParameter>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectParameter {
    unit: String,
    typical: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProvenanceSection {
    log: Option<String>,
    sha256: Option<String>,
    fitted: Option<Spanned<toml::value::Datetime>>,
    samples: Option<u64>,
    temperature: Option<[f64; 2]>,
    supply: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisSection {
    effects: Vec<Spanned<String>>,
    #[serde(default)]
    noise: NoiseSection,
    #[serde(default)]
    parameters: BTreeMap<Spanned<String>, Spanned<BTreeMap<Spanned<String>, ParameterEntry>>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct NoiseSection {
    angle_random_walk: Option<Spanned<f64>>,
    bias_random_walk: Option<Spanned<f64>>,
    encoder: Option<Spanned<f64>>,
    unexplained: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterEntry {
    value: Spanned<f64>,
    std_error: Option<f64>,
    unit: Option<Spanned<String>>,
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    /// The user's own effects of this file.
    own: Vec<&'static dyn Effect>,
}

pub fn parse(path: &Path, text: &str, free_names: &[String]) -> Result<ModelFile, TomlError> {
    let mut reader = Reader { path, text, own: Vec::new() };
    reader.schema()?;
    let file: File = toml::from_str(text).map_err(|e| TomlError::syntax(path, text, &e))?;
    for (name, section) in &file.effect {
        let effect = reader.own_effect(name, section, free_names)?;
        reader.own.push(effect);
    }
    let mut model = Model { epoch: file.epoch, ..Model::default() };
    for (name, section) in &file.axis {
        let axis: Axis = name.get_ref().parse().map_err(|says: String| reader.error(name.span(), says))?;
        model.axes[axis.index()] = Some(reader.axis(axis, section)?);
    }
    let provenance = file.provenance.map(|section| reader.provenance(section, &mut model)).transpose()?;
    Ok(ModelFile { model, provenance, own_effects: reader.own })
}

impl Reader<'_> {
    fn error(&self, span: Range<usize>, says: impl Into<String>) -> TomlError {
        TomlError::at(self.path, self.text, span, says)
    }

    /// The schema comes first: a newer one may hold anything else.
    fn schema(&self) -> Result<(), TomlError> {
        let head: SchemaOnly = toml::from_str(self.text).map_err(|e| TomlError::syntax(self.path, self.text, &e))?;
        let Some(schema) = head.schema else {
            return Err(self.error(0..0, format!("no schema: a model file begins with schema = \"{SCHEMA}\"")));
        };
        let found = schema.get_ref();
        if found == SCHEMA {
            return Ok(());
        }
        let newer =
            found.strip_prefix("truerate.model/").is_some_and(|version| version.parse::<u32>().is_ok_and(|v| v > 1));
        let what = if newer { "newer than this program knows: use a newer truerate" } else { "not a model file's" };
        Err(self.error(schema.span(), format!("schema {} is {what}; this program reads \"{SCHEMA}\"", quoted(found))))
    }

    /// A user's own effect; a mistake in its expression is shown where it stands.
    fn own_effect(
        &self,
        name: &Spanned<String>,
        section: &EffectSection,
        free_names: &[String],
    ) -> Result<&'static dyn Effect, TomlError> {
        let parameters = section
            .parameters
            .iter()
            .map(|(name, p)| ParameterDefinition {
                name: name.get_ref().clone(),
                unit: p.unit.clone(),
                typical: p.typical,
            })
            .collect();
        let (id, regressor) = (name.get_ref().clone(), section.regressor.get_ref().clone());
        let parameter = |wanted: &String| section.parameters.keys().find(|p| p.get_ref() == wanted).map(Spanned::span);
        user::define(&Definition { id, regressor, parameters }, free_names).map_err(|error| {
            let written = section.regressor.span();
            let span = match &error {
                DefinitionError::BadId { .. } | DefinitionError::TakenId { .. } => Some(name.span()),
                DefinitionError::BadParameter { name }
                | DefinitionError::RepeatedParameter { name }
                | DefinitionError::BadTypical { name }
                | DefinitionError::UnusedParameter { name } => parameter(name),
                DefinitionError::Expression(inside) => {
                    // Where the string stands in the file as it is, without escapes, the very place is known.
                    let whole = self.text.get(written.clone()).unwrap_or_default();
                    whole.find(section.regressor.get_ref().as_str()).map(|start| {
                        let start = written.start + start;
                        start + inside.span.start..start + inside.span.end
                    })
                }
                _ => None,
            };
            self.error(span.unwrap_or(written), error.to_string())
        })
    }

    fn axis(&self, axis: Axis, section: &Spanned<AxisSection>) -> Result<AxisModel, TomlError> {
        let AxisSection { effects: ids, noise, parameters } = section.get_ref();
        let mut terms: Vec<Term> = Vec::with_capacity(ids.len());
        for id in ids {
            let name = id.get_ref();
            let own = self.own.iter().copied().find(|e| e.card().id == name);
            let Some(effect) = own.or_else(|| effects::find(name)) else {
                return Err(self.error(
                    id.span(),
                    format!(
                        "unknown effect {}{}; {} lists them all",
                        quoted(name),
                        meant(name),
                        call(Task::Effects, "")
                    ),
                ));
            };
            if terms.iter().any(|t| t.effect.card().id == name) {
                return Err(self.error(id.span(), format!("effect {} is listed twice: leave one out", quoted(name))));
            }
            terms.push(Term::neutral(effect, axis));
        }
        for (id, values) in parameters {
            let Some(term) = terms.iter_mut().find(|t| t.effect.card().id == id.get_ref()) else {
                return Err(self.error(
                    id.span(),
                    format!(
                        "parameters of {}, which is not among this axis' effects: add it there",
                        quoted(id.get_ref())
                    ),
                ));
            };
            self.term(axis, term, values.get_ref())?;
        }
        for (term, id) in terms.iter().zip(ids) {
            let given = parameters.iter().find(|(name, _)| name.get_ref() == id.get_ref());
            // A form that is chosen may be left out where the usual one is zero.
            let is_needed = |card: &&ParameterCard| card.role != Role::Chosen || card.neutral != 0.0;
            let missing = term
                .effect
                .parameters(axis)
                .iter()
                .filter(is_needed)
                .find(|card| !given.is_some_and(|(_, v)| v.get_ref().keys().any(|k| k.get_ref() == card.name)));
            if let Some(card) = missing {
                return Err(self.error(
                    id.span(),
                    format!(
                        "no value for {0}.{1}: add `{0}.{1} = {{ value = …, unit = \"{2}\" }}` under [axis.{axis}.parameters]",
                        id.get_ref(),
                        card.name,
                        card.unit
                    ),
                ));
            }
        }
        Ok(AxisModel { terms, noise: self.noise(noise)? })
    }

    fn term(
        &self,
        axis: Axis,
        term: &mut Term,
        values: &BTreeMap<Spanned<String>, ParameterEntry>,
    ) -> Result<(), TomlError> {
        let cards = term.effect.parameters(axis);
        for (name, entry) in values {
            let Some(i) = cards.iter().position(|card| card.name == name.get_ref()) else {
                let known: Vec<&str> = cards.iter().map(|c| c.name).collect();
                let says = format!(
                    "unknown parameter {} of {} on axis {axis}; it has {}",
                    quoted(name.get_ref()),
                    term.effect.card().id,
                    known.join(", ")
                );
                return Err(self.error(name.span(), says));
            };
            if let Some(unit) = entry.unit.as_ref().filter(|u| u.get_ref() != cards[i].unit) {
                let says = format!(
                    "unit {} where {} is meant: convert the value",
                    quoted(unit.get_ref()),
                    quoted(cards[i].unit)
                );
                return Err(self.error(unit.span(), says));
            }
            if !entry.value.get_ref().is_finite() {
                return Err(self.error(entry.value.span(), "expected a finite number"));
            }
            let (low, high) = cards[i].bounds;
            if !(low..=high).contains(entry.value.get_ref()) {
                let (name, id, unit) = (cards[i].name, term.effect.card().id, cards[i].unit);
                let range =
                    if high.is_finite() { format!("between {low} and {high}") } else { format!("at or above {low}") };
                let says = format!(
                    "{name} of {id} lies {range}{}",
                    if unit == "1" { String::new() } else { format!(" {unit}") }
                );
                return Err(self.error(entry.value.span(), says));
            }
            term.values[i] = *entry.value.get_ref();
            term.std_errors[i] = entry.std_error.filter(|s| s.is_finite()).unwrap_or(f64::NAN);
        }
        Ok(())
    }

    fn noise(&self, section: &NoiseSection) -> Result<Noise, TomlError> {
        let value = |entry: &Option<Spanned<f64>>| match entry {
            None => Ok(0.0),
            Some(x) if x.get_ref().is_finite() && *x.get_ref() >= 0.0 => Ok(*x.get_ref()),
            Some(x) => Err(self.error(x.span(), "a noise is a finite number, zero or more")),
        };
        Ok(Noise {
            angle_random_walk: value(&section.angle_random_walk)?,
            bias_random_walk: value(&section.bias_random_walk)?,
            encoder: value(&section.encoder)?,
            unexplained: value(&section.unexplained)?,
        })
    }

    fn provenance(&self, section: ProvenanceSection, model: &mut Model) -> Result<Provenance, TomlError> {
        if let Some(supply) = &section.supply {
            if !supply.get_ref().is_finite() {
                return Err(self.error(supply.span(), "expected a finite voltage"));
            }
            model.origin.supply = Some(*supply.get_ref());
        }
        let fitted = match &section.fitted {
            None => None,
            Some(written) => Some(written.get_ref().to_string().parse::<Timestamp>().map_err(|_| {
                self.error(written.span(), "expected a time with its zone, such as 2026-11-20T12:00:00Z")
            })?),
        };
        Ok(Provenance {
            log: section.log,
            sha256: section.sha256,
            fitted,
            samples: section.samples,
            temperature: section.temperature.map(|[low, high]| (low, high)),
        })
    }
}
