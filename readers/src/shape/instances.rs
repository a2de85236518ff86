//! A table whose rows are those of several sensors in turn, with the sensor's number or name in a column, as a table with columns for each.
//!
//! ```text
//! TimeUS,I,GyrZ                     TimeUS,IMU[0].GyrZ,IMU[1].GyrZ
//! 1000,0,0.5                   →    1000,0.5,
//! 1000,1,0.6                        1000,,0.6
//! ```

use super::{Shape, head_of, write_row};
use crate::{
    meaning::{What, understand},
    text::{Dialect, Head, is_number},
    unit,
};
use std::collections::HashMap;

/// Names of a column that tells sensors of one kind apart.
const NAMES: [&str; 18] = [
    "i",
    "instance",
    "id",
    "idx",
    "index",
    "imu",
    "imuid",
    "imuindex",
    "sensor",
    "sensorid",
    "sensorindex",
    "device",
    "deviceid",
    "dev",
    "node",
    "nodeid",
    "board",
    "mac",
];
/// Rows that are enough, sensors at most, and the share of rows that each of them has at least.
const FEWEST: usize = 16;
const MOST: usize = 8;
const SHARE: f64 = 0.08;
/// So often the sensor changes from row to row.
const TURNS: f64 = 0.4;

/// Rows of several sensors as lines of a CSV.
pub struct Instances {
    dialect: Dialect,
    header: Vec<u8>,
    column: usize,
    count: usize,
    /// Columns of all.
    shared: Vec<usize>,
    /// Those that each sensor has.
    own: Vec<usize>,
    places: HashMap<Vec<u8>, usize>,
    names: Vec<String>,
    is_headed: bool,
}

/// The column of a header that may tell sensors apart.
#[must_use]
pub fn column(head: &Head) -> Option<usize> {
    let plain = |name: &String| name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
    head.line?;
    head.names.iter().position(|name| NAMES.contains(&plain(name).as_str()))
}

impl Instances {
    /// What lines like these are.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let (head, above) = head_of(lines)?;
        let column = column(&head).filter(|_| !head.dialect.stamped && !head.dialect.labelled)?;
        let count = head.names.len();
        let rows: Vec<Vec<&[u8]>> =
            lines[above..].iter().map(|line| head.dialect.fields(line)).filter(|row| row.len() == count).collect();
        let mut found: Vec<(&[u8], usize)> = Vec::new();
        for row in &rows {
            match found.iter().position(|(name, _)| *name == row[column]) {
                Some(place) => found[place].1 += 1,
                None if found.len() < MOST => found.push((row[column], 1)),
                None => return None,
            }
        }
        found.sort_unstable();
        let turns = rows.windows(2).filter(|pair| pair[0][column] != pair[1][column]).count();
        let is_each = found.iter().all(|(_, times)| *times as f64 >= SHARE * rows.len() as f64);
        if rows.len() < FEWEST || found.len() < 2 || !is_each || (turns as f64) < TURNS * rows.len() as f64 {
            return None;
        }
        let is_time = |i: &usize| understand(&head.names[*i], head.units[*i]).is_some_and(|of| of.what == What::Time);
        let (shared, own): (Vec<usize>, Vec<usize>) = (0..count).filter(|i| *i != column).partition(is_time);
        let of_units = |i: usize| {
            let unit = head.units[i].filter(|unit| !unit.symbol.is_empty() && unit::split(&head.names[i]).1.is_none());
            unit.map_or_else(|| head.names[i].clone(), |unit| format!("{} [{}]", head.names[i], unit.symbol))
        };
        let mut names: Vec<String> = shared.iter().map(|&i| of_units(i)).collect();
        for (name, _) in &found {
            let text = String::from_utf8_lossy(name);
            let sensor = if is_number(head.dialect, name) { format!("IMU[{text}]") } else { text.into_owned() };
            names.extend(own.iter().map(|&i| format!("{sensor}.{}", of_units(i))));
        }
        let places = found.into_iter().enumerate().map(|(k, (name, _))| (name.to_vec(), k)).collect();
        let header = head.line.and_then(|line| lines.get(line as usize - 1)).map_or(Vec::new(), |line| line.to_vec());
        Some(Self { dialect: head.dialect, header, column, count, shared, own, places, names, is_headed: false })
    }
}

impl Shape for Instances {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let line = line.trim_ascii_end();
        let row = self.dialect.fields(line);
        let place = row.get(self.column).and_then(|name| self.places.get(*name)).filter(|_| row.len() == self.count);
        let Some(&place) = place else {
            if line != self.header && !line.trim_ascii().is_empty() {
                out.extend_from_slice(line);
                out.push(b'\n');
            }
            return;
        };
        if !std::mem::replace(&mut self.is_headed, true) {
            write_row(out, &self.names);
        }
        let field = |i: &usize| String::from_utf8_lossy(row[*i]).replace(',', ".");
        let shared = self.shared.iter().map(field);
        let empty = |count: usize| std::iter::repeat_n(String::new(), count * self.own.len());
        let own = empty(place).chain(self.own.iter().map(field)).chain(empty(self.places.len() - 1 - place));
        write_row(out, shared.chain(own));
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(row: impl Fn(usize) -> String) -> String {
        "TimeUS,I,GyrZ\n".to_owned() + &(0..40).map(row).collect::<String>()
    }

    #[test]
    fn rows_of_two_sensors_in_turn_have_columns_each() {
        let text = table(|k| format!("{},{},{k}.5\n", 1000 * (k / 2), k % 2));
        let lines: Vec<&[u8]> = text.lines().map(str::as_bytes).collect();
        let mut rows = Instances::of(&lines).unwrap();
        let mut out = Vec::new();
        lines.iter().take(3).for_each(|line| rows.line(line, &mut out));
        assert_eq!(String::from_utf8(out).unwrap(), "TimeUS,IMU[0].GyrZ,IMU[1].GyrZ\n0,0.5,\n0,,1.5\n");
    }

    #[test]
    fn a_column_that_counts_or_stays_tells_no_sensors_apart() {
        for sensor in [|_| 0, |k: usize| k, |k: usize| k / 20] {
            let text = table(|k| format!("{k},{},1\n", sensor(k)));
            assert!(Instances::of(&text.lines().map(str::as_bytes).collect::<Vec<_>>()).is_none(), "{text}");
        }
    }
}
