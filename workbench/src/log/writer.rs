//! CSV out: logs, and the rows of `apply`. Numbers in the shortest form that reads back to the same bits.

use crate::output::Output;
use anyhow::{Context, Result, bail};
use flate2::{Compression, write::GzEncoder};
use gyro_model::{Axis, Record, Row};
use std::{
    fmt::{self, Write as _},
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
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
    path: PathBuf,
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

/// The columns of a record that have any value; where it `goes_on`, those too that may have their first value later: a temperature,
/// a supply and free channels may come seldom.
fn columns(record: &Record, goes_on: bool) -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    let mut add = |name: String, may_come: bool, value: Box<dyn Fn(&Row) -> f64>| {
        if may_come || record.rows.iter().any(|row| value(row).is_finite()) {
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
            add(format!("{name}_{axis}"), false, Box::new(move |row| of(row)[axis.index()]));
        }
    }
    for (i, name) in ["ref_qw", "ref_qx", "ref_qy", "ref_qz"].into_iter().enumerate() {
        add(name.to_owned(), false, Box::new(move |row| row.ref_quaternion[i]));
    }
    add("temp".to_owned(), goes_on, Box::new(|row| row.temperature));
    add("supply".to_owned(), goes_on, Box::new(|row| row.supply));
    for (i, name) in record.free_names.iter().enumerate() {
        add(name.clone(), goes_on, Box::new(move |row| row.free[i]));
    }
    columns
}

/// Writes a record as a log; `start_ns` is the first row's own time. Columns without any value are left out.
///
/// # Errors
/// The file cannot be written.
pub fn write_record(path: &Path, record: &Record, start_ns: i128) -> Result<()> {
    let columns = columns(record, false);
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

/// A log that is written while its rows come: what was given is in the file, however this process ends.
pub struct GrowingLog {
    file: BufWriter<File>,
    path: PathBuf,
    columns: Vec<Column>,
    start_ns: i128,
    line: String,
    rows: u64,
}

impl GrowingLog {
    /// Begins an empty file. One that stands there is not written over: what a hand has recorded is not to be had again.
    ///
    /// # Errors
    /// It stands there, or cannot be written; a name that asks for packing, which would keep the last rows back.
    pub fn create(path: &Path) -> Result<Self> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
            bail!(
                "{}: a recording is written row by row, and not packed: choose a name that ends in .csv",
                path.display()
            );
        }
        let why = || {
            let says = if path.exists() {
                "is there already, and a recording is not written over: choose another name"
            } else {
                "cannot be written: check that the folder exists and may be written to"
            };
            format!("{}: {says}", path.display())
        };
        let file = File::create_new(path).with_context(why)?;
        let (file, path) = (BufWriter::with_capacity(1 << 16, file), path.to_owned());
        Ok(Self { file, path, columns: Vec::new(), start_ns: 0, line: String::new(), rows: 0 })
    }

    /// Writes the header, of the columns that these first rows have and of those that may come seldom, and the rows.
    ///
    /// # Errors
    /// The disk is full.
    pub fn begin(&mut self, first: &Record, start_ns: i128) -> Result<()> {
        (self.columns, self.start_ns) = (columns(first, true), start_ns);
        self.line = std::iter::once("t".to_owned())
            .chain(self.columns.iter().map(|(name, _)| escaped(name)))
            .collect::<Vec<_>>()
            .join(",");
        self.write()?;
        first.rows.iter().try_for_each(|row| self.row(row))
    }

    /// Writes the next row.
    ///
    /// # Errors
    /// The disk is full.
    pub fn row(&mut self, row: &Row) -> Result<()> {
        self.line.clear();
        let _ = write!(self.line, "{}", Time(self.start_ns + i128::from(row.t_ns)));
        for (_, of) in &self.columns {
            let _ = write!(self.line, ",{}", Value(of(row)));
        }
        self.rows += 1;
        self.write()
    }

    fn write(&mut self) -> Result<()> {
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).with_context(|| crate::output::failed(&self.path))
    }

    /// Everything given so far goes to the file.
    ///
    /// # Errors
    /// The disk is full.
    pub fn flush(&mut self) -> Result<()> {
        self.file.flush().with_context(|| crate::output::failed(&self.path))
    }

    /// Ends it: on the disk, or away where nothing was recorded.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(mut self) -> Result<()> {
        self.flush()?;
        if self.rows == 0 {
            return std::fs::remove_file(&self.path).with_context(|| crate::output::failed(&self.path));
        }
        self.file.get_ref().sync_all().with_context(|| crate::output::failed(&self.path))
    }
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
    fn a_growing_log_is_there_row_by_row_and_writes_over_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let mut row = Row { t_ns: 0, ..Row::EMPTY };
        (row.gyro[2], row.ref_rate[2]) = (0.5, 0.25);
        let mut log = GrowingLog::create(&path).unwrap();
        assert!(format!("{:#}", GrowingLog::create(&path).err().unwrap()).contains("is there already"));
        log.begin(&Record { rows: vec![row], ..Record::default() }, 2_000_000_000).unwrap();
        row.t_ns = 10_000_000;
        (row.ref_rate[2], row.temperature) = (f64::NAN, 25.5);
        log.row(&row).unwrap();
        log.flush().unwrap();
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            "t,gyro_z,ref_rate_z,temp,supply\n2,0.5,0.25,,\n2.01,0.5,,25.5,\n"
        );
        log.finish().unwrap();
        let none = folder.path().join("none.csv");
        GrowingLog::create(&none).unwrap().finish().unwrap();
        assert!(!none.exists());
    }

    #[test]
    fn values_read_back_to_the_same_bits() {
        for x in [0.1, -0.0, 1e-300, 1.0 / 3.0, 5e17, 42.0, f64::MIN_POSITIVE] {
            assert_eq!(Value(x).to_string().parse::<f64>().unwrap().to_bits(), x.to_bits(), "{x}");
        }
        assert_eq!(Value(f64::NAN).to_string(), "");
    }
}
