//! Text whose rows are of several kinds, each named by its first field, as topics: FlySight's `$IMU,…`, a data-flash log as text, or a table
//! that names the sensor in each row.
//!
//! ```text
//! $COL,IMU,time,wx,wy,wz        what the columns of a kind are, and their units, above its rows
//! $UNIT,IMU,s,deg/s,deg/s,deg/s
//! $IMU,4211.500,0.2,-0.4,-71.5
//! $BARO,4211.502,98211.4
//! ```

use super::delimited::{read_time, time_column};
use crate::{
    format::{Field, Format, Note, ROW, Sink, Topic, Unreadable},
    json::write_text,
    meaning::time_unit,
    shape::Shape,
    text::{self, Dialect, Form, Head, HeadError, LineReader, Point, Separator, Skip, is_number, units_row},
    unit::{self, Unit},
};
use std::io::Write as _;

/// Rows of a kind that are enough to believe in it, and the share of all rows that are of such kinds.
const FEWEST: usize = 3;
const SHARE: f64 = 0.8;
/// The kinds of a file at most, and what a kind's name has at most.
const MOST: usize = 100;
const LONGEST_NAME: usize = 24;
/// Bytes that are looked at for kinds and what their columns are.
const LOOKED_AT: usize = 1 << 16;

/// Rows of several kinds.
pub struct Kinds;

impl Kinds {
    /// Whether a text that begins like this is one; what stands after its last line end does not count.
    #[must_use]
    pub fn is_text_of(start: &[u8]) -> bool {
        let whole = start.iter().rposition(|&b| b == b'\n').map_or(&b""[..], |end| &start[..end]);
        let lines: Vec<&[u8]> = whole.split(|&b| b == b'\n').map(<[u8]>::trim_ascii).collect();
        !start.contains(&0) && kinds(&lines).is_some_and(|kinds| kinds.len() > 1)
    }

    /// The same of lines of a stream: their rows as lines of a CSV. One kind alone is one, too, where it has a time.
    #[must_use]
    pub fn of_stream<'a>(lines: impl Iterator<Item = &'a [u8]>) -> Option<Box<dyn Shape>> {
        let lines: Vec<&[u8]> = lines.map(<[u8]>::trim_ascii).collect();
        let kinds = kinds(&lines).filter(|kinds| kinds.iter().any(|kind| kind.time.is_some()))?;
        let is_one = kinds.len() > 1 || kinds[0].is_named;
        is_one.then(|| Box::new(Stream { rows: Rows::of(kinds), is_headed: false }) as Box<dyn Shape>)
    }
}

/// Rows of several kinds, read one by one.
struct Rows {
    kinds: Vec<Kind>,
    /// When the last row was that had a time: one without a time came then.
    last_ns: Option<i64>,
    values: Vec<f64>,
}

/// What a line is.
enum Read {
    /// A row of a kind, and its time.
    Row(usize, Option<i64>),
    /// Of a kind, but not as long as its others.
    OtherLength,
    /// Nothing.
    None,
}

impl Rows {
    fn of(kinds: Vec<Kind>) -> Self {
        Self { kinds, last_ns: None, values: Vec::new() }
    }

    /// Reads a line; the values are those of the fields behind the first.
    fn read(&mut self, row: &[u8], number: u64) -> Read {
        let found = self.kinds.iter().position(|kind| {
            let rest = row.strip_prefix(kind.tag.as_slice());
            rest.is_some_and(|rest| !rest.first().is_some_and(u8::is_ascii_alphanumeric))
        });
        let Some(k) = found else { return Read::None };
        let kind = &self.kinds[k];
        let mut places = Vec::new();
        kind.dialect.split(row, &mut places);
        if places.len() != kind.topic.fields.len() + 1 {
            return Read::OtherLength;
        }
        self.values.clear();
        self.values.extend(places[1..].iter().map(|place| match kind.dialect.value(&row[place.clone()]) {
            text::Field::Number(x) => x,
            _ => f64::NAN,
        }));
        let at = text::TextRow::new(row, &places[1..], number);
        let time = match kind.time {
            Some((column, form)) => read_time(at, column, form, kind.dialect.point),
            None => self.last_ns,
        };
        self.last_ns = time.or(self.last_ns);
        Read::Row(k, time)
    }
}

/// Rows of several kinds as lines of a CSV.
struct Stream {
    rows: Rows,
    is_headed: bool,
}

impl Shape for Stream {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        if !std::mem::replace(&mut self.is_headed, true) {
            out.extend_from_slice(b"t_ns");
            for kind in &self.rows.kinds {
                for field in &kind.topic.fields {
                    out.push(b',');
                    let unit =
                        field.unit.filter(|unit| !unit.symbol.is_empty() && unit::split(&field.name).1.is_none());
                    let unit = unit.map_or(String::new(), |unit| format!(" [{}]", unit.symbol));
                    write_text(out, &(kind.topic.channel(field) + &unit));
                }
            }
            out.push(b'\n');
        }
        match self.rows.read(line, 0) {
            Read::Row(k, Some(time)) => {
                // Into memory nothing fails.
                let _ = write!(out, "{time}");
                for (i, kind) in self.rows.kinds.iter().enumerate() {
                    for (at, _) in kind.topic.fields.iter().enumerate() {
                        let value = self.rows.values.get(at).filter(|value| i == k && value.is_finite());
                        out.push(b',');
                        if let Some(value) = value {
                            let _ = write!(out, "{value}");
                        }
                    }
                }
                out.push(b'\n');
            }
            Read::Row(_, None) => {}
            Read::OtherLength | Read::None => {
                out.extend_from_slice(line);
                out.push(b'\n');
            }
        }
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

/// One kind of row.
struct Kind {
    tag: Vec<u8>,
    dialect: Dialect,
    topic: Topic,
    time: Option<(usize, Form)>,
    /// Whether its columns have names.
    is_named: bool,
}

impl Kind {
    /// Its name, without the sign before it.
    fn name(&self) -> String {
        bare(&self.tag)
    }
}

fn bare(tag: &[u8]) -> String {
    String::from_utf8_lossy(tag).trim_start_matches(['$', '@', '!', '#']).to_owned()
}

/// A line's fields, where the first is the name of a kind.
fn tagged(line: &[u8]) -> Option<(Dialect, Vec<&[u8]>)> {
    [Separator::Byte(b','), Separator::Byte(b';'), Separator::Byte(b'\t'), Separator::Blanks].into_iter().find_map(
        |separator| {
            let dialect = Dialect::new(separator, Point::Dot);
            let fields = dialect.fields(line);
            let tag = fields.first()?;
            let begins = tag.first().is_some_and(|b| b.is_ascii_alphabetic() || matches!(b, b'$' | b'@' | b'!'));
            let is_name = tag.len() <= LONGEST_NAME
                && tag[1.min(tag.len())..].iter().all(|b| b.is_ascii_alphanumeric() || b"_-.".contains(b));
            (fields.len() > 2 && begins && is_name).then_some((dialect, fields))
        },
    )
}

/// Rows of one name and number of fields: these two, how they are written, and their fields.
type Found<'a> = (Vec<u8>, usize, Dialect, Vec<Vec<&'a [u8]>>);

/// The kinds of rows in these lines; `None` where most rows are of none.
fn kinds(lines: &[&[u8]]) -> Option<Vec<Kind>> {
    let mut rows: Vec<Found<'_>> = Vec::new();
    let mut counted = 0;
    for line in lines.iter().filter(|line| !line.is_empty()) {
        let Some((dialect, fields)) = tagged(line) else {
            counted += usize::from(text::is_row(line));
            continue;
        };
        let numbers = fields[1..].iter().filter(|field| is_number(dialect, field)).count();
        if 2 * numbers < fields.len() - 1 {
            continue;
        }
        counted += 1;
        let count = fields.len();
        let found = rows.iter().position(|(tag, of, ..)| tag.as_slice() == fields[0] && *of == count);
        match found {
            Some(place) => rows[place].3.push(fields),
            None if rows.len() < MOST => rows.push((fields[0].to_vec(), count, dialect, vec![fields])),
            None => return None,
        }
    }
    rows.retain(|(.., samples)| samples.len() >= FEWEST);
    let of_kinds: usize = rows.iter().map(|(.., samples)| samples.len()).sum();
    if (of_kinds as f64) < SHARE * counted as f64 {
        return None;
    }
    Some(
        rows.into_iter().map(|(tag, count, dialect, samples)| kind(tag, count - 1, dialect, &samples, lines)).collect(),
    )
}

fn kind(tag: Vec<u8>, count: usize, dialect: Dialect, samples: &[Vec<&[u8]>], lines: &[&[u8]]) -> Kind {
    let name = bare(&tag);
    let is_this = |field: &&[u8]| *field == tag.as_slice() || *field == name.as_bytes();
    let mut names: Option<Vec<String>> = None;
    let mut units: Vec<Option<Unit>> = vec![None; count];
    let defined = lines.iter().filter_map(|line| {
        let fields = dialect.fields(line);
        let of_this = fields.iter().take(5).any(is_this) && fields.len() > count;
        of_this.then(|| fields[fields.len() - count..].to_vec())
    });
    let shared = lines.iter().filter_map(|line| {
        let fields = dialect.fields(line);
        (fields.len() == count + 1 && !is_this(&fields[0])).then(|| fields[1..].to_vec())
    });
    for fields in defined.chain(shared) {
        let text = fields.iter().filter(|field| !field.is_empty() && !is_number(dialect, field)).count();
        if 2 * text <= fields.len() {
            continue;
        }
        if let Some(row) = units_row(&fields) {
            if units.iter().all(Option::is_none) {
                units = row;
            }
        } else if names.is_none() {
            names = Some(fields.into_iter().map(text::name).collect());
        }
    }
    let is_named = names.is_some();
    // Columns without a name are called by their number in the row.
    let names = names.unwrap_or_else(|| (2..=count + 1).map(|k| k.to_string()).collect());
    let first = samples.iter().take(FEWEST).map(|row| row[1..].iter().map(|field| field.to_vec()).collect());
    let mut head = Head::of_columns(names, units, dialect, first.collect());
    // A sentence of a satellite receiver has the time of day of its own clock, hhmmss.
    let is_of_receiver =
        name.len() == 5 && ["GP", "GN", "GL", "GA", "GB"].iter().any(|talker| name.starts_with(talker));
    let time = time_column(&head).filter(|_| is_named).or_else(|| growing(&head, samples)).filter(|_| !is_of_receiver);
    if !is_named {
        call(&mut head.names, time.map(|(column, _)| column), &name);
    }
    let field =
        |(name, unit): (&String, &Option<Unit>)| Field { name: name.clone(), unit: unit.or(unit::split(name).1) };
    let topic = Topic { name, kind: ROW.to_owned(), fields: head.names.iter().zip(&head.units).map(field).collect() };
    Kind { tag, dialect, topic, time, is_named }
}

/// The column without a name that is the time, for it alone grows, from row to row by nearly as much.
fn growing(head: &Head, samples: &[Vec<&[u8]>]) -> Option<(usize, Form)> {
    const EVEN: f64 = 0.9;
    (0..head.names.len()).find_map(|column| {
        let written = |row: &Vec<&[u8]>| row.get(column + 1).and_then(|field| text::form(field));
        if let Some(form) = samples.first().and_then(written) {
            return samples.iter().all(|row| written(row) == Some(form)).then_some((column, form));
        }
        let number = |row: &Vec<&[u8]>| match head.dialect.value(row.get(column + 1)?) {
            text::Field::Number(x) => Some(x),
            _ => None,
        };
        let values: Vec<f64> = samples.iter().map(number).collect::<Option<_>>()?;
        let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.iter().any(|step| *step < 0.0) || steps.is_empty() {
            return None;
        }
        let middle = steps.len() / 2;
        let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let even = steps.iter().filter(|step| (0.5..1.5).contains(&(**step / usual))).count();
        let unit = time_unit(head, column).filter(|_| even as f64 > EVEN * steps.len() as f64)?;
        let exponent = match unit {
            unit::NANOSECONDS => 0,
            unit::MICROSECONDS => 3,
            unit::MILLISECONDS => 6,
            _ => 9,
        };
        Some((column, Form::Number(exponent)))
    })
}

/// Names of columns that have none, where their number or the kind says what they are: three beside a time are axes, one is the value.
fn call(names: &mut [String], time: Option<usize>, kind: &str) {
    let others: Vec<usize> = (0..names.len()).filter(|column| Some(*column) != time).collect();
    if let Some(time) = time {
        "time".clone_into(&mut names[time]);
    }
    let own: &[&str] = match others.len() {
        _ if kind.ends_with("HDT") || kind.ends_with("THS") => &["heading_deg"],
        1 => &["value"],
        3 => &["x", "y", "z"],
        _ => &[],
    };
    for (column, own) in others.into_iter().zip(own) {
        (*own).clone_into(&mut names[column]);
    }
}

impl Format for Kinds {
    fn name(&self) -> &'static str {
        "text with rows of several kinds"
    }

    /// The first bytes are too few to tell.
    fn recognises(&self, _start: &[u8]) -> bool {
        false
    }

    fn read(&self, bytes: &mut dyn std::io::Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut lines = LineReader::new(bytes);
        let mut looked: Vec<Vec<u8>> = Vec::new();
        lines
            .look(|line, _| {
                looked.push(line.trim_ascii().to_vec());
                looked.iter().map(Vec::len).sum::<usize>() < LOOKED_AT
            })
            .map_err(HeadError::Line)?;
        let refs: Vec<&[u8]> = looked.iter().map(Vec::as_slice).collect();
        let mut rows = Rows::of(kinds(&refs).unwrap_or_default());
        let wanted: Vec<bool> = rows.kinds.iter().map(|kind| sink.topic(&kind.topic)).collect();
        let mut others = (0, 0);
        while let Some(line) = lines.next().map_err(HeadError::Line)? {
            let row = lines.bytes(&line);
            let is_other = match rows.read(row, line.number) {
                Read::Row(k, time_ns) => {
                    if let Some(time_ns) = time_ns.filter(|_| wanted[k]) {
                        sink.message(k, time_ns, &rows.values);
                    }
                    false
                }
                Read::OtherLength => true,
                Read::None => !row.trim_ascii().is_empty() && line.number > looked.len() as u64,
            };
            if is_other {
                others = (others.0 + 1, if others.0 == 0 { line.number } else { others.1 });
            }
        }
        if others.0 > 0 {
            sink.note(Note::Skipped { kind: Skip::Text, count: others.0, line: others.1 });
        }
        let has_time = rows.kinds.iter().any(|kind| kind.time.is_some());
        for kind in rows.kinds.iter().filter(|kind| kind.time.is_none()) {
            let why = if has_time { continue } else { "no column of it is a time" };
            sink.note(Note::NotRead { topic: kind.name(), why });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::survey::Survey;
    use std::fmt::Write;

    fn survey(text: &str) -> Survey {
        assert!(Kinds::is_text_of(text.as_bytes()), "{text}");
        let mut survey = Survey::default();
        Kinds.read(&mut text.as_bytes(), &mut survey).unwrap();
        survey
    }

    #[test]
    fn each_kind_of_row_is_a_topic_with_the_columns_that_stand_above_it() {
        let mut text =
            "$FLYS,1\n$COL,IMU,time,wx,wz\n$UNIT,IMU,s,deg/s,deg/s\n$COL,BARO,time,pressure\n$DATA\n".to_owned();
        for k in 0..20 {
            let _ = writeln!(text, "$IMU,{k}.01,1,{k}\n$BARO,{k}.5,98");
        }
        text += "$GNSS,1,2,3\n";
        let found = survey(&text);
        let imu = &found.topics[0];
        assert_eq!((imu.topic.name.as_str(), imu.messages, found.topics.len()), ("IMU", 20, 2));
        assert_eq!(imu.topic.fields[2].unit, Some(unit::DEGREES_PER_SECOND));
        assert_eq!((imu.first_ns, imu.fields[2].high), (10_000_000, 19.0));
        assert_eq!(found.topics[1].topic.channel(&found.topics[1].topic.fields[1]), "BARO.pressure");
    }

    #[test]
    fn a_table_that_names_the_sensor_in_each_row_is_one_of_kinds() {
        let mut text = "sensor,time,x,y,z\n".to_owned();
        for k in 0..9 {
            let _ = writeln!(text, "gyro,{k},1,2,3\naccel,{k},0,0,9.8");
        }
        let found = survey(&text);
        assert_eq!(found.topics[0].topic.channel(&found.topics[0].topic.fields[3]), "gyro.z");
    }

    #[test]
    fn rows_without_names_have_the_column_that_grows_as_time_and_those_without_a_time_that_of_the_row_before() {
        let mut text = String::new();
        for k in 0..20 {
            let _ = writeln!(
                text,
                "$PIMU,0.{:02},1,2,{k}*5A\n$GPGGA,09{k:02}00.00,48.1\n$GNHDT,{k}.5,T\nENC,{},{k}",
                k + 1,
                k * 10 + 500
            );
        }
        let found = survey(&text);
        let channels: Vec<String> =
            found.topics.iter().flat_map(|of| of.topic.fields.iter().map(|field| of.topic.channel(field))).collect();
        for name in ["PIMU.time", "PIMU.z", "GNHDT.heading_deg", "ENC.time", "ENC.value"] {
            assert!(channels.contains(&name.to_owned()), "{name}: {channels:?}");
        }
        let of = |name: &str| found.topics.iter().find(|of| of.topic.name == name).unwrap();
        assert_eq!((of("GNHDT").first_ns, of("GNHDT").messages, of("ENC").first_ns), (10_000_000, 20, 500_000_000));
        let mut stream = Kinds::of_stream(text.lines().map(str::as_bytes)).unwrap();
        let mut out = Vec::new();
        text.lines().take(3).for_each(|line| stream.line(line.as_bytes(), &mut out));
        let out = String::from_utf8(out).unwrap();
        assert!(out.starts_with("t_ns,PIMU.time,PIMU.x,PIMU.y,PIMU.z,"), "{out}");
        assert!(out.lines().nth(1).unwrap().starts_with("10000000,0.01,1,2,0,") && out.ends_with(",0.5,,,\n"), "{out}");
    }

    #[test]
    fn a_plain_table_is_none_of_kinds() {
        for text in ["t,gyro_z\n0,1\n1,2\n2,3\n", "$IMU,1,2,3\n$IMU,2,3,4\n$IMU,3,4,5\n", "", "a\nb\nc\n"] {
            assert!(!Kinds::is_text_of(text.as_bytes()), "{text}");
        }
        let modes = "t,mode,gyro_z\n0,fast,1\n1,slow,2\n2,fast,3\n3,slow,3\n4,fast,3\n5,slow,1\n6,slow,1\n";
        assert!(!Kinds::is_text_of(modes.as_bytes()));
    }
}
