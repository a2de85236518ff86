//! One value a line, with its name and its time: a long table, annotated CSV and line protocol of InfluxDB, Teleplot.
//!
//! ```text
//! time,measurement,field,value                 time,imu.gyro_z,encoder.angle_deg
//! 0.00,imu,gyro_z,1.5                   →      0.00,1.5,3
//! 0.00,encoder,angle_deg,3
//!
//! >gyro_z:1790000000000:1.5§°/s                imu,host=pi gyro_z=1.5,temp=24.5 1790000000000000000
//! ```
//!
//! Values of one time that stand beside each other are one row. Of a file, the rows are put in the order of time.

use super::Shape;
use crate::{
    json::write_text,
    meaning::{What, understand},
    text::{self, CSV, Dialect, Field, Point, Separator},
    unit,
};
use std::collections::{BTreeMap, HashMap};

/// Lines of its kind that are enough, and their share of all that are not blank.
const FEWEST: usize = 6;
const SHARE: f64 = 0.9;
/// Names at most.
const MOST: usize = 200;
/// Lines of a stream that its names are taken from.
const OF_STREAM: usize = 100;

/// Names of the column that holds the values.
const VALUES: [&str; 5] = ["value", "_value", "val", "reading", "wert"];
/// Names of columns that name a value, the widest first.
const KEYS: [&str; 21] = [
    "_measurement",
    "measurement",
    "device",
    "entity_id",
    "entity",
    "topic",
    "sensor",
    "source",
    "tag",
    "type",
    "kind",
    "name",
    "metric",
    "signal",
    "channel",
    "variable",
    "parameter",
    "key",
    "_field",
    "field",
    "axis",
];

/// How a line is written.
#[derive(Clone, Debug, PartialEq)]
enum Form {
    /// `>name:time:value§unit|flags`
    Teleplot,
    /// `name,tag=a field=value,other=value time`
    Protocol,
    /// A row under a header.
    Table { dialect: Dialect, header: Vec<u8>, time: usize, value: usize, unit: Option<usize>, keys: Vec<usize> },
}

/// A long table.
pub struct Long {
    form: Form,
    names: Vec<String>,
    places: HashMap<String, usize>,
    is_headed: bool,
    /// Lines that wait for the names of a stream to be known.
    first: Vec<Vec<u8>>,
    time: String,
    row: Vec<String>,
    /// Rows of a file, in time.
    rows: Option<BTreeMap<i128, (String, Vec<String>)>>,
}

/// Time, and the values with their names.
struct Reading<'a> {
    time: &'a str,
    values: Vec<(String, &'a str)>,
}

impl Long {
    /// What lines like these are; of a file the rows are sorted.
    pub fn of(lines: &[&[u8]], is_file: bool) -> Option<Self> {
        let form = [Form::Teleplot, Form::Protocol].into_iter().chain(table(lines)).find(|form| is_of(form, lines))?;
        let rows = is_file.then(BTreeMap::new);
        let (names, places, first, row) = (Vec::new(), HashMap::new(), Vec::new(), Vec::new());
        Some(Self { form, names, places, is_headed: false, first, time: String::new(), row, rows })
    }

    /// Puts the values of a line into the row.
    fn take(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let text = String::from_utf8_lossy(line).into_owned();
        let Some(reading) = self.form.read(&text) else { return self.other(line, out) };
        let places: Vec<Option<usize>> = reading.values.iter().map(|(name, _)| self.place(name)).collect();
        let is_full =
            |place: &Option<usize>| place.is_some_and(|place| self.row.get(place).is_some_and(|old| !old.is_empty()));
        if self.rows.is_none() && (reading.time != self.time || places.iter().any(is_full)) {
            self.give(out);
        }
        let row = if let Some(rows) = &mut self.rows {
            let Some(at) = moment(reading.time) else { return };
            &mut rows.entry(at).or_insert_with(|| (reading.time.to_owned(), Vec::new())).1
        } else {
            reading.time.clone_into(&mut self.time);
            &mut self.row
        };
        for (place, (_, value)) in places.into_iter().zip(reading.values) {
            let Some(place) = place else { continue };
            if row.len() <= place {
                row.resize(place + 1, String::new());
            }
            value.clone_into(&mut row[place]);
        }
    }

    /// The column of a name; none is added below a header.
    fn place(&mut self, name: &str) -> Option<usize> {
        if let Some(place) = self.places.get(name) {
            return Some(*place);
        }
        if self.is_headed || self.names.len() == MOST {
            return None;
        }
        self.places.insert(name.to_owned(), self.names.len());
        self.names.push(name.to_owned());
        Some(self.names.len() - 1)
    }

    fn head(&mut self, out: &mut Vec<u8>) {
        let time = if self.form == Form::Teleplot { "timestamp [ms]" } else { "timestamp" };
        out.extend_from_slice(time.as_bytes());
        for name in &self.names {
            out.push(b',');
            write_text(out, name);
        }
        out.push(b'\n');
        self.is_headed = true;
    }

    /// Gives the row of a stream.
    fn give(&mut self, out: &mut Vec<u8>) {
        if !self.time.is_empty() {
            write(&self.time, &self.row, self.names.len(), out);
        }
        self.time.clear();
        self.row.iter_mut().for_each(String::clear);
    }

    fn other(&self, line: &[u8], out: &mut Vec<u8>) {
        let is_own = matches!(&self.form, Form::Table { header, .. } if header == line) || line.starts_with(b"#");
        if !is_own && !line.trim_ascii().is_empty() && self.rows.is_none() {
            out.extend_from_slice(line);
            out.push(b'\n');
        }
    }
}

impl Shape for Long {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let line = line.trim_ascii_end();
        // Another table of the same file may have its columns in another order.
        if let (Form::Table { .. }, Some(form)) = (&self.form, table_of(line)) {
            self.form = form;
            return;
        }
        if self.rows.is_some() || self.is_headed {
            return self.take(line, out);
        }
        // The names of a stream are those of its first lines.
        self.first.push(line.to_vec());
        let text = String::from_utf8_lossy(line).into_owned();
        let named: Vec<String> =
            self.form.read(&text).map(|of| of.values.into_iter().map(|(name, _)| name).collect()).unwrap_or_default();
        for name in named {
            self.place(&name);
        }
        if self.first.len() == OF_STREAM {
            self.end_of_first(out);
        }
    }

    fn end(&mut self, out: &mut Vec<u8>) {
        if let Some(rows) = self.rows.take() {
            self.head(out);
            for (time, row) in rows.values() {
                write(time, row, self.names.len(), out);
            }
            return;
        }
        self.end_of_first(out);
        self.give(out);
    }
}

impl Long {
    fn end_of_first(&mut self, out: &mut Vec<u8>) {
        if !self.is_headed {
            self.head(out);
            for line in std::mem::take(&mut self.first) {
                self.take(&line, out);
            }
        }
    }
}

impl Form {
    /// What stands in a line.
    fn read<'a>(&self, line: &'a str) -> Option<Reading<'a>> {
        match self {
            Self::Teleplot => teleplot(line),
            Self::Protocol => protocol(line),
            Self::Table { dialect, time, value, unit, keys, .. } => {
                let fields = dialect.fields(line.as_bytes());
                let field = |place: usize| fields.get(place).and_then(|field| std::str::from_utf8(field).ok());
                let (time, value) = (field(*time)?, field(*value)?);
                let is_one =
                    moment(time).is_some() && (is_number(value, dialect.point) || is_number(value, Point::Dot));
                let name: Vec<&str> = keys.iter().filter_map(|key| field(*key)).filter(|key| !key.is_empty()).collect();
                let unit = unit.and_then(field).filter(|unit| unit::parse(unit).is_some());
                let name = name.join(".") + &unit.map_or(String::new(), |unit| format!(" [{unit}]"));
                is_one.then(|| Reading { time, values: vec![(name, value)] })
            }
        }
    }
}

fn is_number(text: &str, point: Point) -> bool {
    matches!(text::value(text.as_bytes(), point), Field::Number(_))
}

/// `>name:1790000000000:1.5§°/s|np`
fn teleplot(line: &str) -> Option<Reading<'_>> {
    let rest = line.trim().strip_prefix('>')?;
    let rest = rest.split('|').next().unwrap_or(rest);
    let (rest, unit) = rest.split_once('§').map_or((rest, None), |(rest, unit)| (rest, Some(unit.trim())));
    let (rest, value) = rest.rsplit_once(':')?;
    let (name, time) = rest.rsplit_once(':')?;
    let unit = unit.filter(|unit| unit::parse(unit).is_some()).map_or(String::new(), |unit| format!(" [{unit}]"));
    let is_one = is_number(time, Point::Dot) && is_number(value, Point::Dot) && !name.is_empty();
    is_one.then(|| Reading { time, values: vec![(format!("{name}{unit}"), value)] })
}

/// `imu,host=pi gyro_z=1.5,temp=24i 1790000000000000000`
fn protocol(line: &str) -> Option<Reading<'_>> {
    let (series, rest) = line.trim().split_once(' ')?;
    let (fields, time) = rest.trim().rsplit_once(' ')?;
    let name = series.split(',').next().filter(|name| !name.is_empty() && !name.contains(['=', ':', '"']))?;
    let tags = series.split(',').skip(1);
    let is_time = time.len() >= 9 && time.bytes().all(|b| b.is_ascii_digit());
    if !is_time || !tags.clone().all(|tag| tag.contains('=')) || fields.contains(' ') {
        return None;
    }
    let field = |field: &'_ str| -> Option<(usize, usize)> {
        let at = field.find('=')?;
        let value = field[at + 1..].strip_suffix(['i', 'u']).unwrap_or(&field[at + 1..]);
        is_number(value, Point::Dot).then_some((at, at + 1 + value.len()))
    };
    let values: Vec<(String, &str)> = fields
        .split(',')
        .filter_map(|text| field(text).map(|(at, end)| (format!("{name}.{}", &text[..at]), &text[at + 1..end])))
        .collect();
    (!values.is_empty()).then_some(Reading { time, values })
}

/// The time in a field, ns or what its numbers are: for their order.
fn moment(field: &str) -> Option<i128> {
    let number = |point| match text::time(field.as_bytes(), point, 9) {
        text::TimeField::Nanoseconds(ns) => Some(ns),
        _ => None,
    };
    let written = || text::date_time(field.as_bytes()).or_else(|| text::clock(field.as_bytes()));
    number(Point::Dot).or_else(|| number(Point::Comma)).or_else(written)
}

/// A header that is one of a long table, in any of the first lines.
fn table(lines: &[&[u8]]) -> Option<Form> {
    lines.iter().find_map(|line| table_of(line))
}

fn table_of(line: &[u8]) -> Option<Form> {
    if line.len() > 1000
        || line.starts_with(b"#")
        || !line.to_ascii_lowercase().windows(3).any(|three| three == b"val" || three == b"rea" || three == b"wer")
    {
        return None;
    }
    [b',', b';', b'\t'].into_iter().find_map(|separator| {
        let dialect = Dialect {
            point: if separator == b';' { Point::Comma } else { Point::Dot },
            ..Dialect::new(Separator::Byte(separator), CSV.point)
        };
        let names: Vec<String> = dialect.fields(line).into_iter().map(|name| text::name(name).to_lowercase()).collect();
        let value = names.iter().position(|name| VALUES.contains(&name.as_str()))?;
        let time = (0..names.len()).filter(|&i| !names[i].starts_with("_st"));
        let time = time.into_iter().find(|&i| understand(&names[i], None).is_some_and(|of| of.what == What::Time))?;
        let mut keys: Vec<(usize, usize)> = (0..names.len())
            .filter_map(|i| KEYS.iter().position(|key| *key == names[i]).map(|rank| (rank, i)))
            .collect();
        keys.sort_unstable();
        let keys: Vec<usize> = keys.into_iter().map(|(_, i)| i).collect();
        let unit = names.iter().position(|name| matches!(name.as_str(), "unit" | "units" | "einheit"));
        (!keys.is_empty() && names.len() > 2).then(|| Form::Table {
            dialect,
            header: line.to_vec(),
            time,
            value,
            unit,
            keys,
        })
    })
}

/// Whether lines are of this form: nearly all, and of more than one name or a few.
fn is_of(form: &Form, lines: &[&[u8]]) -> bool {
    let mut form = form.clone();
    let (mut of, mut all, mut is_below) = (0, 0, !matches!(form, Form::Table { .. }));
    let mut points = [0, 0];
    for line in lines.iter().filter(|line| !line.is_empty() && !line.starts_with(b"#")) {
        if let (Form::Table { .. }, Some(found)) = (&form, table_of(line)) {
            (form, is_below) = (found, true);
            continue;
        }
        let Ok(text) = std::str::from_utf8(line) else { continue };
        all += usize::from(is_below);
        of += usize::from(form.read(text).is_some());
        points[usize::from(line.contains(&b'.'))] += 1;
    }
    of >= FEWEST && of as f64 >= SHARE * all as f64
}

fn write(time: &str, row: &[String], count: usize, out: &mut Vec<u8>) {
    // What a decimal comma is in the source is none here; a date has none.
    write_text(out, &time.replace(',', "."));
    for k in 0..count {
        out.push(b',');
        let field = row.get(k).map_or("", String::as_str);
        write_text(out, &field.replace(',', "."));
    }
    out.push(b'\n');
}

#[cfg(test)]
mod tests {
    use super::super::{AsCsv, Shape, of, of_start};
    use std::io::Read;

    fn csv(text: &str) -> String {
        let mut out = String::new();
        AsCsv::new(text.as_bytes(), of_start(text.as_bytes()).expect(text)).read_to_string(&mut out).unwrap();
        out
    }

    fn twelve(line: impl Fn(usize) -> String) -> String {
        (0..12).map(line).collect()
    }

    #[test]
    fn long_tables_become_wide_ones() {
        let rows = twelve(|k| format!("0.0{k:02},imu,gyro_z,{k}.5\n0.0{k:02},enc,deg,3\n"));
        let wide = csv(&format!("time,measurement,field,value\n{rows}"));
        assert!(wide.starts_with("timestamp,imu.gyro_z,enc.deg\n0.000,0.5,3\n0.001,1.5,3\n"), "{wide}");
        let semicolons = twelve(|k| format!("0,0{k:02};gyro;z;{k},5\n"));
        assert!(csv(&format!("timestamp;sensor;axis;value\n{semicolons}")).contains("\n0.001,1.5\n"));
    }

    #[test]
    fn tables_one_below_the_other_are_one() {
        let head = |order: &str| format!("#group,false\n#datatype,string\n{order}\n");
        let gyro = twelve(|k| format!(",,0,2026-05-02T09:14:00.0{k:02}Z,{k}.5,gz,imu\n"));
        let angle = twelve(|k| format!(",,1,{k},2026-05-02T09:14:00.0{k:02}Z,deg,enc\n"));
        let (first, second) = (
            head(",result,table,_time,_value,_field,_measurement"),
            head(",result,table,_value,_time,_field,_measurement"),
        );
        let wide = csv(&format!("{first}{gyro}\n{second}{angle}"));
        assert!(wide.starts_with("timestamp,imu.gz,enc.deg\n2026-05-02T09:14:00.000Z,0.5,0\n"), "{wide}");
        assert_eq!(wide.lines().count(), 13);
    }

    #[test]
    fn teleplot_and_line_protocol_are_long_tables() {
        let lines = twelve(|k| format!(">gz:17900000000{k:02}:{k}.5§°/s\n>enc:17900000000{k:02}:3|g\n"));
        assert!(csv(&lines).starts_with("timestamp [ms],gz [°/s],enc\n1790000000000,0.5,3\n"));
        let lines = twelve(|k| {
            format!("imu,host=a gz={k}.5,n=3i 17900000000000000{k:02}\nenc deg=4 17900000000000000{k:02}\n")
        });
        assert!(csv(&lines).starts_with("timestamp,imu.gz,imu.n,enc.deg\n1790000000000000000,0.5,3,4\n"));
    }

    #[test]
    fn a_stream_is_given_as_it_comes() {
        let line = |k: usize| format!(">{}:{}:{k}", ["gz", "enc"][k % 2], 1000 + k / 2);
        let lines: Vec<String> = (0..120).map(line).collect();
        let mut shape: Box<dyn Shape> = of(lines.iter().take(16).map(String::as_bytes), false).unwrap();
        let mut out = Vec::new();
        for line in &lines {
            shape.line(line.as_bytes(), &mut out);
        }
        assert!(String::from_utf8_lossy(&out).ends_with("1058,116,117\n"));
        shape.end(&mut out);
        let text = String::from_utf8(out).unwrap();
        assert!(
            text.starts_with("timestamp [ms],gz,enc\n1000,0,1\n1001,2,3\n") && text.ends_with("1059,118,119\n"),
            "{text}"
        );
    }

    #[test]
    fn a_table_is_no_long_one() {
        for text in ["t,gyro_z,value\n0,1,2\n1,2,3\n", "t,gz\n0,1\n", "> gz: 1\n", "a=1 b=2 3\n"] {
            let text = text.repeat(9);
            let lines: Vec<&[u8]> = text.lines().map(str::as_bytes).collect();
            assert!(super::Long::of(&lines, true).is_none(), "{text}");
        }
    }
}
