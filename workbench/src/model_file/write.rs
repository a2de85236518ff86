//! The text of a model file.

use super::{ModelFile, Provenance, SCHEMA};
use gyro_model::{
    Axis, AxisModel,
    effects::user::{self, Definition, ParameterDefinition},
};
use std::fmt::{self, Write};

/// A double in the shortest form that TOML reads back to the same bits.
struct Number(f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

/// A string in TOML's quotes.
fn quoted(text: &str) -> toml::Value {
    toml::Value::String(text.to_owned())
}

pub fn render(file: &ModelFile) -> String {
    let mut text = format!("schema = \"{SCHEMA}\"\nepoch = {}\n", file.model.epoch);
    // Formatting into a `String` cannot fail.
    let _ = write_all(&mut text, file);
    text
}

fn write_all(text: &mut String, file: &ModelFile) -> fmt::Result {
    let supply = file.model.origin.supply;
    if file.provenance.is_some() || supply.is_some() {
        provenance(text, file.provenance.as_ref(), supply)?;
    }
    for (axis, model) in Axis::ALL.into_iter().zip(&file.model.axes) {
        if let Some(model) = model {
            axis_model(text, axis, model)?;
        }
    }
    let mut written = Vec::new();
    let terms = file.model.axes.iter().flatten().flat_map(|axis| &axis.terms).map(|term| term.effect);
    for effect in file.own_effects.iter().copied().chain(terms) {
        if let Some(own) = user::definition(effect).filter(|own| !written.contains(&own.id)) {
            own_effect(text, &own)?;
            written.push(own.id);
        }
    }
    Ok(())
}

fn own_effect(text: &mut String, own: &Definition) -> fmt::Result {
    writeln!(text, "\n[effect.{}]\nregressor = {}", own.id, quoted(&own.regressor))?;
    let parameter = |p: &ParameterDefinition| {
        format!("{} = {{ unit = {}, typical = {} }}", p.name, quoted(&p.unit), Number(p.typical))
    };
    let parameters: Vec<String> = own.parameters.iter().map(parameter).collect();
    writeln!(text, "parameters = {{ {} }}", parameters.join(", "))
}

fn provenance(text: &mut String, provenance: Option<&Provenance>, supply: Option<f64>) -> fmt::Result {
    writeln!(text, "\n[provenance]")?;
    if let Some(from) = provenance {
        if let Some(log) = &from.log {
            writeln!(text, "log = {}", quoted(log))?;
        }
        if let Some(sha256) = &from.sha256 {
            writeln!(text, "sha256 = {}", quoted(sha256))?;
        }
        if let Some(fitted) = from.fitted {
            writeln!(text, "fitted = {}", fitted.strftime("%Y-%m-%dT%H:%M:%SZ"))?;
        }
        if let Some(samples) = from.samples {
            writeln!(text, "samples = {samples}")?;
        }
        if let Some((low, high)) = from.temperature {
            writeln!(text, "temperature = [{}, {}]", Number(low), Number(high))?;
        }
    }
    if let Some(supply) = supply {
        writeln!(text, "supply = {}", Number(supply))?;
    }
    Ok(())
}

fn axis_model(text: &mut String, axis: Axis, model: &AxisModel) -> fmt::Result {
    let ids: Vec<String> = model.effect_ids().iter().map(|id| quoted(id).to_string()).collect();
    writeln!(text, "\n[axis.{axis}]\neffects = [{}]", ids.join(", "))?;
    let noise = &model.noise;
    write!(
        text,
        "noise = {{ angle_random_walk = {}, bias_random_walk = {}, encoder = {}",
        Number(noise.angle_random_walk),
        Number(noise.bias_random_walk),
        Number(noise.encoder)
    )?;
    if noise.unexplained > 0.0 {
        write!(text, ", unexplained = {}", Number(noise.unexplained))?;
    }
    writeln!(text, " }}")?;
    writeln!(text, "\n[axis.{axis}.parameters]")?;
    for term in &model.terms {
        for (card, value, std_error) in term.parameters(axis) {
            write!(text, "{}.{} = {{ value = {}", term.effect.card().id, card.name, Number(value))?;
            if std_error.is_finite() {
                write!(text, ", std_error = {}", Number(std_error))?;
            }
            writeln!(text, ", unit = {} }}", quoted(card.unit))?;
        }
    }
    Ok(())
}
