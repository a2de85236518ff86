//! Type files: what is known of a type before a part of it is measured.
//!
//! ```toml
//! schema = "truerate.type/1"
//!
//! [type."BMI160-250dps".axis.z]
//! scale-factor.alpha = { mean = 1.003, std_error = 2e-4, spread = 1e-3, spread_of_logs = 1e-4, parts = 40, unit = "1" }
//! ```

use super::Fleet;
use std::{collections::BTreeMap, fmt::Write as _};

/// What stands at the head of a file.
pub const SCHEMA: &str = "truerate.type/1";

/// The text of the file. Parameters that were taken at a shape have no place in a model and are left out.
#[must_use]
pub fn render(fleet: &Fleet) -> String {
    let mut text = format!("schema = \"{SCHEMA}\"\n");
    let mut places: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    for row in fleet.types.iter().filter(|row| row.shape.is_empty()) {
        let Some(std_error) = row.std_error else { continue };
        let mut line = format!("{}.{} = {{ mean = {:e}, std_error = {std_error:e}", row.effect, row.name, row.mean);
        for (name, value) in [("spread", row.spread), ("spread_of_logs", row.spread_of_logs)] {
            if let Some(value) = value {
                let _ = write!(line, ", {name} = {value:e}");
            }
        }
        let _ = write!(line, ", parts = {}, unit = \"{}\" }}", row.parts, row.unit);
        places.entry((row.kind.clone(), row.axis.to_string())).or_default().push(line);
    }
    for ((kind, axis), lines) in places {
        let kind = toml::Value::String(kind);
        let _ = write!(text, "\n[type.{kind}.axis.{axis}]\n{}\n", lines.join("\n"));
    }
    text
}
