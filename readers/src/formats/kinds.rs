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
    text::{self, Dialect, Form, Head, HeadError, LineReader, Point, Separator, Skip, is_number, units_row},
    unit::{self, Unit},
};
use std::io::Read;

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
}

/// One kind of row.
struct Kind {
    tag: Vec<u8>,
    dialect: Dialect,
    topic: Topic,
    time: Option<(usize, Form)>,
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
    // Columns without a name are called by their number in the row.
    let names = names.unwrap_or_else(|| (2..=count + 1).map(|k| k.to_string()).collect());
    let samples = samples.iter().take(FEWEST).map(|row| row[1..].iter().map(|field| field.to_vec()).collect());
    let head = Head::of_columns(names, units, dialect, samples.collect());
    let field =
        |(name, unit): (&String, &Option<Unit>)| Field { name: name.clone(), unit: unit.or(unit::split(name).1) };
    let topic = Topic { name, kind: ROW.to_owned(), fields: head.names.iter().zip(&head.units).map(field).collect() };
    Kind { time: time_column(&head), tag, dialect, topic }
}

impl Format for Kinds {
    fn name(&self) -> &'static str {
        "text with rows of several kinds"
    }

    /// The first bytes are too few to tell.
    fn recognises(&self, _start: &[u8]) -> bool {
        false
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut lines = LineReader::new(bytes);
        let mut looked: Vec<Vec<u8>> = Vec::new();
        lines
            .look(|line, _| {
                looked.push(line.trim_ascii().to_vec());
                looked.iter().map(Vec::len).sum::<usize>() < LOOKED_AT
            })
            .map_err(HeadError::Line)?;
        let refs: Vec<&[u8]> = looked.iter().map(Vec::as_slice).collect();
        let kinds = kinds(&refs).unwrap_or_default();
        let wanted: Vec<bool> = kinds.iter().map(|kind| sink.topic(&kind.topic)).collect();
        let (mut places, mut values, mut others) = (Vec::new(), Vec::new(), (0, 0));
        while let Some(line) = lines.next().map_err(HeadError::Line)? {
            let row = lines.bytes(&line);
            let found = kinds.iter().position(|kind| {
                let rest = row.strip_prefix(kind.tag.as_slice());
                rest.is_some_and(|rest| !rest.first().is_some_and(u8::is_ascii_alphanumeric))
            });
            let Some(k) = found.filter(|k| wanted[*k]) else {
                let is_other = found.is_none() && !row.trim_ascii().is_empty() && line.number > looked.len() as u64;
                others = (others.0 + u64::from(is_other), if others.0 == 0 { line.number } else { others.1 });
                continue;
            };
            let kind = &kinds[k];
            kind.dialect.split(row, &mut places);
            if places.len() != kind.topic.fields.len() + 1 {
                others = (others.0 + 1, if others.0 == 0 { line.number } else { others.1 });
                continue;
            }
            values.clear();
            values.extend(places[1..].iter().map(|place| match kind.dialect.value(&row[place.clone()]) {
                text::Field::Number(x) => x,
                _ => f64::NAN,
            }));
            let at = text::TextRow::new(row, &places[1..], line.number);
            let time_ns = kind.time.and_then(|(column, form)| read_time(at, column, form, kind.dialect.point));
            if let Some(time_ns) = time_ns {
                sink.message(k, time_ns, &values);
            }
        }
        if others.0 > 0 {
            sink.note(Note::Skipped { kind: Skip::Text, count: others.0, line: others.1 });
        }
        for kind in kinds.iter().filter(|kind| kind.time.is_none()) {
            sink.note(Note::NotRead { topic: kind.name(), why: "no column of it is a time" });
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
    fn a_plain_table_is_none_of_kinds() {
        for text in ["t,gyro_z\n0,1\n1,2\n2,3\n", "$IMU,1,2,3\n$IMU,2,3,4\n$IMU,3,4,5\n", "", "a\nb\nc\n"] {
            assert!(!Kinds::is_text_of(text.as_bytes()), "{text}");
        }
        let modes = "t,mode,gyro_z\n0,fast,1\n1,slow,2\n2,fast,3\n3,slow,3\n4,fast,3\n5,slow,1\n6,slow,1\n";
        assert!(!Kinds::is_text_of(modes.as_bytes()));
    }
}
