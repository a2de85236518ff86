//! SenML (RFC 8428): one value a record, with names, times, units and values that count from those of a record before.
//!
//! ```text
//! [{"bn":"imu/","bt":1.7e9,"n":"gyro_z","u":"rad/s","v":0.1},      timestamp,name,value,unit
//!  {"n":"ref_angle_z","u":"rad","t":0.01,"v":0.2}]            →    1700000000,gyro_z,0.1,rad/s
//!                                                                  1700000000.01,ref_angle_z,0.2,rad
//! ```

use super::record::Cell;

/// All labels of a record.
const LABELS: [&str; 15] = ["bn", "bt", "bu", "bv", "bs", "bver", "n", "u", "v", "vs", "vb", "vd", "s", "t", "ut"];

/// What records count from.
#[derive(Default)]
pub(super) struct Base {
    /// The name that all begin with, and the first such.
    name: String,
    first: Option<String>,
    time: f64,
    unit: Option<Cell>,
    value: f64,
}

impl Base {
    /// A record as a time, a name, a value and a unit where it is one of SenML; else as it is.
    pub(super) fn resolved(&mut self, cells: Vec<(String, Cell)>) -> Vec<(String, Cell)> {
        let of = |label: &str| cells.iter().find(|(name, _)| name == label).map(|(_, cell)| cell);
        let text = |label: &str| if let Some(Cell::Text(text)) = of(label) { Some(text.clone()) } else { None };
        let number = |label: &str| of(label).and_then(Cell::number);
        let has_value = number("v").is_some() && of("v").is_some_and(|cell| !matches!(cell, Cell::Text(_)));
        let is_base = text("bn").is_some() || number("bt").is_some();
        let is_one = cells.iter().all(|(name, _)| LABELS.contains(&name.as_str()))
            && (has_value && text("n").is_some() || is_base);
        if !is_one {
            return cells;
        }
        if let Some(name) = text("bn") {
            self.first.get_or_insert_with(|| name.clone());
            self.name = name;
        }
        self.time = number("bt").unwrap_or(self.time);
        self.value = number("bv").unwrap_or(self.value);
        self.unit = of("bu").cloned().or(self.unit.take());
        // The name of the device that all values are of says nothing more.
        let begin = if self.first.as_deref() == Some(&self.name) { "" } else { &self.name };
        let name = format!("{begin}{}", text("n").unwrap_or_default());
        let value = if has_value { number("v").map(|value| Cell::Number(self.value + value)) } else { None };
        let named = |name: &str, cell: Option<Cell>| (name.to_owned(), cell.unwrap_or(Cell::Nothing));
        vec![
            named("timestamp", Some(Cell::Number(self.time + number("t").unwrap_or(0.0)))),
            named("name", Some(Cell::Text(name))),
            named("value", value),
            named("unit", of("u").cloned().or_else(|| self.unit.clone())),
        ]
    }
}
