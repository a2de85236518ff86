//! Understanding a model file, strictly.

use super::{ModelFile, Provenance, SCHEMA};
use crate::{
    commands::effects::meant,
    toml_error::{TomlError, quoted},
};
use gyro_model::{
    Axis, AxisModel, Model, Noise, Term,
    effects::{
        self, Effect,
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
                DefinitionError::TooManyParameters { .. } | DefinitionError::NoCoefficient => None,
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
                    format!("unknown effect {}{}; `truerate effects` lists them all", quoted(name), meant(name)),
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
            let missing = term
                .effect
                .parameters(axis)
                .iter()
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
                return Err(self.error(entry.value.span(), "a finite number is wanted"));
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
        })
    }

    fn provenance(&self, section: ProvenanceSection, model: &mut Model) -> Result<Provenance, TomlError> {
        if let Some(supply) = &section.supply {
            if !supply.get_ref().is_finite() {
                return Err(self.error(supply.span(), "a finite voltage is wanted"));
            }
            model.origin.supply = Some(*supply.get_ref());
        }
        let fitted = match &section.fitted {
            None => None,
            Some(written) => Some(written.get_ref().to_string().parse::<Timestamp>().map_err(|_| {
                self.error(written.span(), "a time with its zone is wanted, such as 2026-11-20T12:00:00Z")
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::render;
    use proptest::prelude::*;

    const EXAMPLE: &str = r#"schema = "truerate.model/1"
epoch = 3

[provenance]
log = "yaw.csv.gz"
sha256 = "ab"
fitted = 2026-11-20T12:00:00Z
samples = 19973
temperature = [24.1, 33.0]

[axis.z]
effects = ["scale-factor", "bias", "delay"]
noise = { angle_random_walk = 7.1e-5, bias_random_walk = 0.0, encoder = 4.5e-4 }

[axis.z.parameters]
scale-factor.alpha = { value = 0.9939, std_error = 1.0e-5, unit = "1" }
bias.delta         = { value = 8.6e-4, std_error = 2.0e-6, unit = "rad/s" }
delay.d            = { value = 0.0121, std_error = 2.0e-5, unit = "s" }
"#;

    const OWN: &str = r#"
[effect.cable-twist]
regressor = "k * sin(angle) * temp"
parameters = { k = { unit = "rad/s/K", typical = 1e-4 } }
"#;

    fn parsed(text: &str) -> Result<ModelFile, TomlError> {
        parse(Path::new("m.toml"), text, &["load".to_owned()])
    }

    fn refused(from: &str, to: &str) -> TomlError {
        assert!(EXAMPLE.contains(from), "{from}");
        parsed(&EXAMPLE.replacen(from, to, 1)).expect_err(to)
    }

    #[test]
    fn the_documented_example_is_read_whole() {
        let file = parsed(EXAMPLE).unwrap();
        let z = file.model.axes[2].as_ref().unwrap();
        assert_eq!(z.effect_ids(), ["scale-factor", "bias", "delay"]);
        assert_eq!((z.alpha(), z.delta(), z.terms[2].values[0]), (0.9939, 8.6e-4, 0.0121));
        assert_eq!(z.noise.encoder, 4.5e-4);
        assert_eq!(file.model.epoch, 3);
        let provenance = file.provenance.unwrap();
        assert_eq!(provenance.temperature, Some((24.1, 33.0)));
        assert_eq!(provenance.fitted.unwrap().to_string(), "2026-11-20T12:00:00Z");
    }

    #[test]
    fn what_is_written_is_read_back_the_same() {
        let file = parsed(EXAMPLE).unwrap();
        let text = render(&file);
        let again = parsed(&text).unwrap();
        assert_eq!(render(&again), text);
        assert_eq!(again.provenance, file.provenance);
    }

    #[test]
    fn a_newer_schema_is_named_before_anything_else_in_the_file() {
        let text = EXAMPLE.replace("model/1", "model/2").replace("epoch", "era");
        let error = parsed(&text).unwrap_err();
        assert_eq!((error.line, error.column), (1, 10));
        assert!(error.says.contains("truerate.model/2") && error.says.contains("newer"), "{error}");
    }

    #[test]
    fn mistakes_are_named_where_they_stand() {
        for (from, to, line, says) in [
            ("\"delay\"", "\"dely\"", 12, "did you mean 'delay'"),
            ("delay.d  ", "delay.e  ", 18, "unknown parameter 'e'"),
            ("delay.d  ", "lag.tau  ", 18, "not among this axis' effects"),
            ("epoch", "era", 2, "era"),
            ("encoder =", "encode =", 13, "encode"),
            ("unit = \"s\"", "unit = \"ms\"", 18, "unit 'ms'"),
            ("value = 0.0121", "value = \"late\"", 18, "late"),
            ("value = 0.0121", "value = nan", 18, "finite"),
            ("encoder = 4.5e-4", "encoder = -1.0", 13, "zero or more"),
            ("\"bias\", ", "\"bias\", \"bias\", ", 12, "twice"),
            ("bias.delta ", "# ", 12, "no value for bias.delta"),
            ("samples = 19973", "samples = -3", 8, "-3"),
            ("fitted = 2026-11-20T12:00:00Z", "fitted = 2026-11-20", 7, "zone"),
            ("[axis.z.parameters]", "[axis.z.parameters", 15, ""),
        ] {
            let error = refused(from, to);
            assert_eq!(error.line, line, "{error}");
            assert!(error.says.contains(says), "{error}");
            assert!(error.to_string().contains('^'), "{error}");
            assert_eq!(error.to_string().lines().count(), 3, "{error}");
        }
    }

    #[test]
    fn an_axis_that_does_not_exist_is_named() {
        let error = parsed(&EXAMPLE.replace("axis.z", "axis.w")).unwrap_err();
        assert_eq!((error.line, error.column), (11, 7), "{error}");
        assert!(error.says.contains("'w' is not an axis"), "{error}");
    }

    #[test]
    fn a_users_own_effect_is_like_any_other_and_written_again() {
        let text = EXAMPLE.replace("\"delay\"", "\"cable-twist\"").replace(
            "delay.d            = { value = 0.0121, std_error = 2.0e-5, unit = \"s\" }",
            "cable-twist.k = { value = 2e-4, unit = \"rad/s/K\" }",
        ) + OWN;
        let file = parsed(&text).unwrap();
        let z = file.model.axes[2].as_ref().unwrap();
        assert_eq!(z.effect_ids(), ["scale-factor", "bias", "cable-twist"]);
        let again = render(&file);
        assert!(again.contains("regressor = \"k * sin(angle) * temp\""), "{again}");
        assert_eq!(render(&parsed(&again).unwrap()), again);
    }

    #[test]
    fn an_own_effect_that_no_axis_has_yet_is_kept_for_adding() {
        let file = parsed(&format!("{EXAMPLE}{OWN}")).unwrap();
        assert_eq!(file.own_effects[0].card().id, "cable-twist");
        assert!(render(&file).contains("[effect.cable-twist]"));
    }

    #[test]
    fn a_wrong_expression_is_shown_with_a_caret_under_the_mistake() {
        let whole = format!("{EXAMPLE}{OWN}");
        for (from, to, shown) in [
            ("sin(angle)", "sin(angel)", "angel"),
            ("* temp", "* (temp", "(temp"),
            ("cable-twist]", "delay]", "delay"),
            ("\"k * sin", "\"3 * sin", "k"),
            ("typical = 1e-4", "typical = inf", "k"),
            ("regressor", "regresor", "regresor"),
        ] {
            let text = whole.replacen(from, to, 1);
            let error = parsed(&text).unwrap_err();
            let (line, caret) = (error.excerpt.lines().next().unwrap(), error.excerpt.lines().nth(1).unwrap());
            assert!(line[caret.find('^').unwrap()..].starts_with(shown), "{error}");
        }
    }

    #[test]
    fn a_file_without_schema_or_of_another_kind_is_refused() {
        assert!(parsed("").unwrap_err().says.contains("begins with schema"));
        assert!(parsed("schema = \"other/1\"").unwrap_err().says.contains("not a model file's"));
        assert!(parsed("schema = 3").is_err());
    }

    proptest! {
        #[test]
        fn any_value_survives_to_the_last_bit(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO, error in proptest::num::f64::POSITIVE) {
            let mut file = parsed(EXAMPLE).unwrap();
            let term = &mut file.model.axes[2].as_mut().unwrap().terms[2];
            term.values[0] = value;
            term.std_errors[0] = error;
            let again = parsed(&render(&file)).unwrap();
            let term = &again.model.axes[2].as_ref().unwrap().terms[2];
            prop_assert_eq!(term.values[0].to_bits(), value.to_bits());
            prop_assert_eq!(term.std_errors[0].is_finite(), error.is_finite());
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in "\\PC*", cut in 0usize..700, junk in "[\\x00-\\x7f]{0,8}") {
            let _ = parsed(&text);
            let cut = cut.min(EXAMPLE.len());
            let _ = parsed(&format!("{}{junk}{}", &EXAMPLE[..cut], &EXAMPLE[cut..]));
            let _ = parsed(&EXAMPLE[..cut]);
        }
    }
}
