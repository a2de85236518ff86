//! A column map: a TOML file that renames foreign headers.
//!
//! ```toml
//! "time (s)"     = "t"
//! "IMU gz (°/s)" = "gyro_z_dps"
//! ref_angle_z    = "encoder"          # either way round; a foreign name stands on one side
//! ```

use super::{
    error::{Problem, listed},
    unit,
};
use crate::{
    files,
    toml_error::{TomlError, quoted},
};
use std::{
    collections::HashMap,
    ops::Range,
    path::{Path, PathBuf},
};
use toml::{Spanned, de::DeTable};

/// The renamings, and where each stands in the file.
pub struct ColumnMap {
    file: PathBuf,
    text: String,
    entries: Vec<Entry>,
}

struct Entry {
    key: String,
    value: String,
    span: Range<usize>,
}

impl ColumnMap {
    /// Reads a column map.
    ///
    /// # Errors
    /// A file that cannot be read, or is no map.
    pub fn load(file: &Path) -> Result<Self, Problem> {
        let text = files::read_to_string(file)
            .map_err(|cause| Problem::MapFile { file: file.display().to_string(), cause })?;
        let table = DeTable::parse(&text).map_err(|e| Problem::Map(TomlError::syntax(file, &text, &e)))?;
        let mut entries = Vec::new();
        collect(table.get_ref(), &mut entries).map_err(|span| {
            Problem::Map(TomlError::at(file, &text, span, "expected a column's name, such as \"gyro_z_dps\""))
        })?;
        Ok(Self { file: file.to_owned(), text, entries })
    }

    /// The headers with their names renamed.
    ///
    /// # Errors
    /// A name that no header has.
    pub fn rename(&self, headers: &[String]) -> Result<Vec<String>, Problem> {
        let places: HashMap<&str, usize> = headers.iter().enumerate().map(|(i, h)| (h.as_str(), i)).collect();
        let mut renamed = headers.to_vec();
        for entry in &self.entries {
            // Foreign name on the left as a rule; on the right where only that reading makes sense.
            let ours_left = matches!(unit::name(&entry.key), unit::Name::Known(..));
            let turned = ours_left
                && places.contains_key(entry.value.as_str())
                && !(places.contains_key(entry.key.as_str())
                    && matches!(unit::name(&entry.value), unit::Name::Known(..)));
            let (foreign, ours) = if turned { (&entry.value, &entry.key) } else { (&entry.key, &entry.value) };
            let Some(&place) = places.get(foreign.as_str()) else {
                let says = format!("the log has no column {}; it has {}", quoted(foreign), listed(headers));
                return Err(Problem::Map(TomlError::at(&self.file, &self.text, entry.span.clone(), says)));
            };
            renamed[place].clone_from(ours);
        }
        Ok(renamed)
    }
}

/// Entries at the top, or in a `[columns]` table.
fn collect(table: &DeTable<'_>, entries: &mut Vec<Entry>) -> Result<(), Range<usize>> {
    for (key, value) in table {
        if let Some(name) = value.get_ref().as_str() {
            entries.push(Entry {
                key: key.get_ref().to_string(),
                value: name.to_owned(),
                span: key.span().start..value.span().end,
            });
        } else if let ("columns", Some(inner)) = (key.get_ref().as_ref(), value.get_ref().as_table()) {
            collect(inner, entries)?;
        } else {
            return Err(Spanned::span(value));
        }
    }
    Ok(())
}
