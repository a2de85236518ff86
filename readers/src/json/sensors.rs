//! Records of a list that name their sensor, one sensor after the other, as phones export them, as the table that they mean.
//!
//! ```text
//! [{"sensor": "Gyroscope", "time": 1, "z": 0.5},            time,Gyroscope.z,qz
//!  {"sensor": "Gyroscope", "time": 2, "z": 0.6},      →     1,0.5,0
//!  {"sensor": "Orientation", "time": 1, "qz": 0}]           2,0.6,
//! ```
//!
//! Values of one time are one row, and the rows are put in the order of time.

use super::{Part, Records, record::Cell};
use crate::{
    meaning::{What, understand},
    text::{Point, TimeField, time},
};
use std::{
    collections::{BTreeMap, HashMap, HashSet},
    io::{self, Read},
};

/// Names under which a record has its sensor.
const KEYS: [&str; 4] = ["sensor", "sensorType", "sensor_type", "sensorName"];
/// Bytes that are asked for at once.
const PIECE: usize = 1 << 16;

/// Whether a text that begins like this is a list of records of which the first names its sensor before anything else.
#[must_use]
pub fn is_of_sensors(start: &[u8]) -> bool {
    let inside = start.trim_ascii_start().strip_prefix(b"[").map(<[u8]>::trim_ascii_start);
    let first = inside.and_then(|text| text.strip_prefix(b"{")).map(<[u8]>::trim_ascii_start);
    first.is_some_and(|first| KEYS.iter().any(|key| first.starts_with(format!("\"{key}\"").as_bytes())))
}

/// What has come of the sensors.
#[derive(Default)]
struct Sensors {
    /// The columns: sensor and name of each; times belong to all.
    columns: Vec<(String, String)>,
    places: HashMap<(String, String), usize>,
    rows: BTreeMap<i128, Vec<(usize, Cell)>>,
}

impl Sensors {
    fn take(&mut self, cells: Vec<(String, Cell)>) {
        let is_sensor = |name: &str| KEYS.contains(&name);
        let sensor = cells.iter().find_map(|(name, cell)| match cell {
            Cell::Text(sensor) if is_sensor(name) => Some(sensor.clone()),
            _ => None,
        });
        let is_time = |name: &str| understand(name, None).is_some_and(|of| of.what == What::Time);
        let at = cells.iter().filter(|(name, _)| is_time(name)).find_map(|(_, cell)| moment(cell));
        // What has no time says something of the recording.
        let (Some(sensor), Some(at)) = (sensor, at) else { return };
        let row = self.rows.entry(at).or_default();
        for (name, cell) in cells.into_iter().filter(|(name, _)| !is_sensor(name)) {
            let column = (if is_time(&name) { String::new() } else { sensor.clone() }, name);
            let place = *self.places.entry(column.clone()).or_insert_with(|| {
                self.columns.push(column);
                self.columns.len() - 1
            });
            row.push((place, cell));
        }
    }

    fn write(self) -> Vec<u8> {
        let mut names: HashMap<&str, HashSet<&str>> = HashMap::new();
        for (sensor, name) in &self.columns {
            names.entry(name).or_default().insert(sensor);
        }
        // A letter says nothing without its sensor.
        let full = |(sensor, name): &(String, String)| {
            let is_clear = sensor.is_empty() || name.len() > 1 && names[name.as_str()].len() == 1;
            if is_clear { name.clone() } else { format!("{sensor}.{name}") }
        };
        let mut out = Vec::new();
        for (k, column) in self.columns.iter().enumerate() {
            if k > 0 {
                out.push(b',');
            }
            Cell::Text(full(column)).write(&mut out);
        }
        out.push(b'\n');
        for row in self.rows.values() {
            let mut cells = vec![None; self.columns.len()];
            for (place, cell) in row {
                cells[*place] = Some(cell);
            }
            for (k, cell) in cells.into_iter().enumerate() {
                if k > 0 {
                    out.push(b',');
                }
                if let Some(cell) = cell {
                    cell.write(&mut out);
                }
            }
            out.push(b'\n');
        }
        out
    }
}

/// A time, in parts that are fine enough for any unit.
fn moment(cell: &Cell) -> Option<i128> {
    let mut written = Vec::new();
    cell.write(&mut written);
    match time(&written, Point::Dot, 9) {
        TimeField::Nanoseconds(parts) => Some(parts),
        _ => None,
    }
}

/// The records of a source as a CSV; what is whole before a damage is given.
///
/// # Errors
/// The source fails.
pub fn table_of_sensors(source: &mut dyn Read) -> io::Result<Vec<u8>> {
    let (mut records, mut sensors, mut piece) = (Records::default(), Sensors::default(), vec![0; PIECE]);
    loop {
        let count = source.read(&mut piece)?;
        records.feed(&piece[..count]);
        while let Some(part) = records.next_part(false) {
            if let Part::Record(_, cells) = part {
                sensors.take(cells);
            }
        }
        if count == 0 {
            return Ok(sensors.write());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_one_after_the_other_are_columns_of_one_table() {
        let json = br#"[{"sensor": "Metadata", "version": "3"}, {"sensor": "Gyroscope", "time": "1709377384122999808", "z": "0.5"},
            {"sensor": "Gyroscope", "time": "1709377384132615424", "z": "0.6"},
            {"sensor": "Orientation", "time": "1709377384122999808", "qz": 0.1}]"#;
        assert!(is_of_sensors(&json[..40]) && !is_of_sensors(br#"[{"t": 1, "sensor": 2}]"#));
        let text = String::from_utf8(table_of_sensors(&mut &json[..]).unwrap()).unwrap();
        assert_eq!(text, "time,Gyroscope.z,qz\n1709377384122999808,0.5,0.1\n1709377384132615424,0.6,\n");
        let whole_before_damage = String::from_utf8(table_of_sensors(&mut &json[..150]).unwrap()).unwrap();
        assert_eq!(whole_before_damage.lines().count(), 2);
    }
}
