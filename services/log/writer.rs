//! CSV out: logs, and the rows of `apply`. Numbers in the shortest form that reads back to the same bits.

use crate::output::Output;
use anyhow::{Context, Result};
use flate2::{Compression, write::GzEncoder};
use gyro_model::{Axis, Record, Row};
use std::{
    fmt::{self, Write as _},
    io::{self, Write},
    path::Path,
};

/// A time in whole nanoseconds, written in seconds without losing one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Time(pub i128);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let ns = self.0.unsigned_abs();
        let (whole, rest) = (ns / 1_000_000_000, ns % 1_000_000_000);
        if rest == 0 {
            return write!(f, "{sign}{whole}");
        }
        let digits = format!("{rest:09}");
        write!(f, "{sign}{whole}.{}", digits.trim_end_matches('0'))
    }
}

/// A value, or nothing where it is not finite.
struct Value(f64);

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // `{:?}` turns to exponents for the very small and very large; whole numbers need no ".0".
        if !self.0.is_finite() {
            Ok(())
        } else if self.0.fract() == 0.0 && self.0.abs() < 1e15 {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:?}", self.0)
        }
    }
}

/// A CSV file under way, packed where its name ends in `.gz`; in its place only when finished.
pub struct RecordWriter {
    sink: Sink,
    line: String,
    path: std::path::PathBuf,
}

enum Sink {
    Plain(Output),
    Packed(GzEncoder<Output>),
}

/// Begins a CSV file with this header.
///
/// # Errors
/// The file cannot be created.
pub fn create<S: AsRef<str>>(path: &Path, header: &[S]) -> Result<RecordWriter> {
    let output = Output::create(path)?;
    let sink = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
        Sink::Packed(GzEncoder::new(output, Compression::default()))
    } else {
        Sink::Plain(output)
    };
    let mut writer = RecordWriter { sink, line: String::new(), path: path.to_owned() };
    let names: Vec<String> = header.iter().map(|name| escaped(name.as_ref())).collect();
    writer.write_line(&names.join(","))?;
    Ok(writer)
}

/// A name with a comma, quotation mark or line break is quoted.
fn escaped(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

impl RecordWriter {
    /// One row: time in nanoseconds, then the values; what is not finite stays empty.
    ///
    /// # Errors
    /// The disk is full.
    pub fn row(&mut self, time_ns: i128, values: &[f64]) -> Result<()> {
        let mut line = std::mem::take(&mut self.line);
        line.clear();
        let _ = write!(line, "{}", Time(time_ns));
        for &value in values {
            let _ = write!(line, ",{}", Value(value));
        }
        let result = self.write_line(&line);
        self.line = line;
        result
    }

    fn write_line(&mut self, line: &str) -> Result<()> {
        let sink: &mut dyn Write = match &mut self.sink {
            Sink::Plain(output) => output,
            Sink::Packed(output) => output,
        };
        let write = |sink: &mut dyn Write| -> io::Result<()> {
            sink.write_all(line.as_bytes())?;
            sink.write_all(b"\n")
        };
        write(sink).with_context(|| crate::output::failed(&self.path))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// The disk is full, or the folder has changed meanwhile.
    pub fn finish(self) -> Result<()> {
        match self.sink {
            Sink::Plain(output) => output.finish(),
            Sink::Packed(packed) => packed.finish().with_context(|| crate::output::failed(&self.path))?.finish(),
        }
    }
}

/// One column of a record: its name, and its value in a row.
type Column = (String, Box<dyn Fn(&Row) -> f64>);

/// Three columns, one an axis: their name, and their values in a row.
type Triple = (&'static str, fn(&Row) -> &[f64; 3]);

/// Writes a record as a log; `start_ns` is the first row's own time. Columns without any value are left out.
///
/// # Errors
/// The file cannot be written.
pub fn write_record(path: &Path, record: &Record, start_ns: i128) -> Result<()> {
    let mut columns: Vec<Column> = Vec::new();
    let mut add = |name: String, value: Box<dyn Fn(&Row) -> f64>| {
        if record.rows.iter().any(|row| value(row).is_finite()) {
            columns.push((name, value));
        }
    };
    let triples: [Triple; 4] = [
        ("gyro", |r| &r.gyro),
        ("ref_angle", |r| &r.ref_angle),
        ("ref_rate", |r| &r.ref_rate),
        ("accel", |r| &r.accel),
    ];
    for (name, of) in triples {
        for axis in Axis::ALL {
            add(format!("{name}_{axis}"), Box::new(move |row| of(row)[axis.index()]));
        }
    }
    for (i, name) in ["ref_qw", "ref_qx", "ref_qy", "ref_qz"].into_iter().enumerate() {
        add(name.to_owned(), Box::new(move |row| row.ref_quaternion[i]));
    }
    add("temp".to_owned(), Box::new(|row| row.temperature));
    add("supply".to_owned(), Box::new(|row| row.supply));
    for (i, name) in record.free_names.iter().enumerate() {
        add(name.clone(), Box::new(move |row| row.free[i]));
    }
    let header: Vec<&str> = std::iter::once("t").chain(columns.iter().map(|(name, _)| name.as_str())).collect();
    let mut writer = create(path, &header)?;
    let mut values = vec![0.0; columns.len()];
    for row in &record.rows {
        for (value, (_, of)) in values.iter_mut().zip(&columns) {
            *value = of(row);
        }
        writer.row(start_ns + i128::from(row.t_ns), &values)?;
    }
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_keep_every_nanosecond() {
        for (ns, text) in
            [(0, "0"), (10_000_000, "0.01"), (-1, "-0.000000001"), (1_763_700_000_123_456_789, "1763700000.123456789")]
        {
            assert_eq!(Time(ns).to_string(), text);
        }
    }

    #[test]
    fn values_read_back_to_the_same_bits() {
        for x in [0.1, -0.0, 1e-300, 1.0 / 3.0, 5e17, 42.0, f64::MIN_POSITIVE] {
            assert_eq!(Value(x).to_string().parse::<f64>().unwrap().to_bits(), x.to_bits(), "{x}");
        }
        assert_eq!(Value(f64::NAN).to_string(), "");
    }
}
