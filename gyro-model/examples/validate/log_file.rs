//! Reads a recorded log: the plain SI columns of the interface, CSV or `.gz`.

use flate2::read::GzDecoder;
use gyro_model::{Axis, Record, Row};
use std::{error::Error, fs::File, io::Read, path::Path};

/// The rows of a file; columns that are not of the interface are left out.
pub fn read(path: &Path) -> Result<Record, Box<dyn Error>> {
    let file = File::open(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let gz = path.extension().is_some_and(|extension| extension == "gz");
    let source: Box<dyn Read> = if gz { Box::new(GzDecoder::new(file)) } else { Box::new(file) };
    let mut reader = csv::Reader::from_reader(source);
    let columns: Vec<Option<Column>> = reader.headers()?.iter().map(Column::named).collect();
    let mut record = Record::default();
    let mut first = None;
    for line in reader.records() {
        let mut row = Row::EMPTY;
        for (column, text) in columns.iter().zip(&line?) {
            let value: f64 = if text.is_empty() { f64::NAN } else { text.trim().parse()? };
            match column {
                Some(Column::Time) => row.t_ns = ((value - *first.get_or_insert(value)) * 1e9).round() as i64,
                Some(column) => column.write(&mut row, value),
                None => {}
            }
        }
        // Faults of the data are another matter: here a row that does not come later is left out.
        if record.rows.last().is_none_or(|last| last.t_ns < row.t_ns) {
            record.rows.push(row);
        }
    }
    Ok(record)
}

#[derive(Clone, Copy)]
enum Column {
    Time,
    Gyro(usize),
    Angle(usize),
    Rate(usize),
    Quaternion(usize),
    Accel(usize),
    Temperature,
    Supply,
}

impl Column {
    fn named(name: &str) -> Option<Self> {
        match name {
            "t" => Some(Self::Time),
            "temp" => Some(Self::Temperature),
            "supply" => Some(Self::Supply),
            _ => {
                let quaternion = ["ref_qw", "ref_qx", "ref_qy", "ref_qz"].iter().position(|q| *q == name);
                let on_axis = || {
                    let (kind, letter) = name.rsplit_once('_')?;
                    let i = letter.parse::<Axis>().ok()?.index();
                    match kind {
                        "gyro" => Some(Self::Gyro(i)),
                        "ref_angle" => Some(Self::Angle(i)),
                        "ref_rate" => Some(Self::Rate(i)),
                        "accel" => Some(Self::Accel(i)),
                        _ => None,
                    }
                };
                quaternion.map(Self::Quaternion).or_else(on_axis)
            }
        }
    }

    fn write(self, row: &mut Row, value: f64) {
        match self {
            Self::Time => {}
            Self::Gyro(i) => row.gyro[i] = value,
            Self::Angle(i) => row.ref_angle[i] = value,
            Self::Rate(i) => row.ref_rate[i] = value,
            Self::Quaternion(i) => row.ref_quaternion[i] = value,
            Self::Accel(i) => row.accel[i] = value,
            Self::Temperature => row.temperature = value,
            Self::Supply => row.supply = value,
        }
    }
}
