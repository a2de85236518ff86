//! Where a text's table begins: separator, decimal sign, names, units, and what stands above them.

use super::{
    fields::{self, CSV, Dialect, Separator},
    lines::{LineError, Lines},
    moment,
    number::{Field, Point},
    skipped::{Skip, Skipped},
    stamp::stamp,
};
use crate::unit::{self, Unit};
use std::{collections::HashSet, io::Read};

/// Bytes and lines that may stand above a table.
const LOOK_BYTES: usize = 1 << 17;
const LOOK_LINES: usize = 2000;
/// Data rows that are looked at before the first is given.
const SAMPLES: usize = 3;
/// Rows of names above a header that are looked at.
const MOST_NAME_ROWS: usize = 6;

/// What was found.
#[derive(Clone, Debug)]
pub struct Head {
    /// The columns' names; `column_1` … where there is no header.
    pub names: Vec<String>,
    /// The units that stand in a row of their own, column by column.
    pub units: Vec<Option<Unit>>,
    /// The header's line; `None` where there is none.
    pub line: Option<u64>,
    /// How the rows are written.
    pub dialect: Dialect,
    /// The first few rows.
    pub samples: Vec<Vec<Vec<u8>>>,
    /// What stands above the header as a key and a value.
    pub keys: Vec<(String, String)>,
    /// The header as it stands there.
    pub(super) raw: Vec<u8>,
}

impl Head {
    /// Of names between commas that stand in one line, nothing else being known. Numbers alone are no header, but a row.
    #[must_use]
    pub fn of_names(names: &[&[u8]]) -> Self {
        let bare: Vec<String> =
            names.iter().map(|name| String::from_utf8_lossy(name.trim_ascii()).into_owned()).collect();
        let is_row = bare.iter().all(|name| name.is_empty() || name.parse::<f64>().is_ok());
        Self {
            names: bare,
            units: vec![None; names.len()],
            line: (!is_row).then_some(1),
            dialect: CSV,
            samples: if is_row { vec![names.iter().map(|name| name.to_vec()).collect()] } else { Vec::new() },
            keys: Vec::new(),
            raw: Vec::new(),
        }
    }

    /// Whether a column holds times of day in one number, `091420.10`. Seconds since the start may look like it, padded with zeros perhaps: so
    /// it is one only where every time begins with a zero and an hour from 1 to 9, or where the rows hold the position of a satellite
    /// receiver.
    #[must_use]
    pub fn is_clock_in_digits(&self, column: usize) -> bool {
        let fields = || self.samples.iter().filter_map(|row| row.get(column));
        let is_clock = fields().next().is_some() && fields().all(|field| moment::digits(field).is_some());
        let has = |names: &[&str]| self.names.iter().any(|name| names.contains(&name.to_lowercase().as_str()));
        let is_led = || fields().all(|field| matches!(field.trim_ascii(), [b'0', b'1'..=b'9', ..]));
        let is_of_receiver = || has(&["lat", "latitude"]) && has(&["lon", "long", "longitude"]);
        let is_time = || matches!(self.names[column].to_lowercase().as_str(), "time" | "utc" | "utc time" | "utc_time");
        is_clock && (is_led() || is_time() && is_of_receiver())
    }

    /// The column that has the rest of a time whose whole seconds are in this one, `stamp.sec` and `stamp.nanosec`, `sec` and `msec`; and the
    /// power of ten that makes its unit nanoseconds.
    #[must_use]
    pub fn finer(&self, column: usize) -> Option<(usize, i32)> {
        const UNITS: [(&[&str], i32); 3] = [
            (&["nsecs", "nsec", "nanosec", "nanosecs", "nanoseconds"], 0),
            (&["usecs", "usec", "microsec", "microsecs", "microseconds"], 3),
            (&["msecs", "msec", "millisec", "millisecs", "milliseconds", "ms"], 6),
        ];
        let lower = |name: &String| name.trim().to_lowercase();
        let own = lower(&self.names[column]);
        let before = ["secs", "sec", "seconds"].iter().find_map(|end| own.strip_suffix(end))?;
        let (fine, exponent) = (self.names.iter().enumerate()).find_map(|(i, name)| {
            let name = lower(name);
            let end = name.strip_prefix(before)?;
            UNITS.iter().find(|(ends, _)| ends.contains(&end)).map(|(_, exponent)| (i, *exponent))
        })?;
        let values = |column: usize| {
            let field = move |row: &Vec<Vec<u8>>| match super::value(row.get(column)?, self.dialect.point) {
                Field::Number(x) => Some(x),
                _ => None,
            };
            self.samples.iter().filter_map(field).collect::<Vec<f64>>()
        };
        let (whole, rest) = (values(column), values(fine));
        let is_rest = |x: &f64| (0.0..10_f64.powi(9 - exponent)).contains(x) && x.fract() == 0.0;
        let are_parts = whole.iter().all(|x| x.fract() == 0.0) && rest.iter().all(is_rest);
        let varies = |values: &[f64]| values.iter().any(|x| *x != values[0]);
        // Seconds that go on while the rest stays as it is are whole times.
        let is_time = varies(&rest) || !varies(&whole);
        (fine != column && are_parts && is_time).then_some((fine, exponent))
    }

    /// Of columns that are known, and their first rows.
    #[must_use]
    pub fn of_columns(
        names: Vec<String>,
        units: Vec<Option<Unit>>,
        dialect: Dialect,
        samples: Vec<Vec<Vec<u8>>>,
    ) -> Self {
        Self { names, units, line: Some(1), dialect, samples, keys: Vec::new(), raw: Vec::new() }
    }

    /// Of a line of names alone, written in this way.
    #[must_use]
    pub fn of_line(line: &[u8], dialect: Dialect) -> Self {
        Self { dialect, raw: line.to_vec(), ..Self::of_names(&dialect.fields(line)) }
    }

    /// Of names that were given, for rows of which this is the first; `None` where it is no row of as many fields.
    #[must_use]
    pub fn given(names: &[String], row: &[u8]) -> Option<Self> {
        let dialect = row_of(row).filter(|dialect| dialect.fields(row).len() == names.len())?;
        Some(Self {
            names: names.to_vec(),
            units: vec![None; names.len()],
            line: Some(0),
            dialect,
            samples: vec![dialect.fields(row).into_iter().map(<[u8]>::to_vec).collect()],
            keys: Vec::new(),
            raw: Vec::new(),
        })
    }

    /// The value that stands above the header under one of these keys, in small letters without blanks and signs.
    #[must_use]
    pub fn key(&self, any: &[&str]) -> Option<&str> {
        let plain = |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
        self.keys.iter().find(|(key, _)| any.contains(&plain(key).as_str())).map(|(_, value)| value.as_str())
    }
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum HeadError {
    /// The lines cannot be read.
    #[error("{0}")]
    Line(#[from] LineError),
    /// No line that is more than blank or a remark.
    #[error("is empty")]
    Empty,
    /// Commas separate the fields and the decimals too.
    #[error("line {line}: {found} fields under {names} names: decimal commas in a text that commas separate")]
    DecimalCommas {
        /// The first row.
        line: u64,
        /// Its fields.
        found: usize,
        /// The names.
        names: usize,
    },
}

struct Looked {
    bytes: Vec<u8>,
    number: u64,
}

impl Looked {
    /// Whether nothing stands in it, or nothing but a stamp.
    fn is_blank(&self) -> bool {
        let text = self.bytes.trim_ascii();
        text.is_empty() || text.ends_with(b"->") && stamp(text).is_some_and(|stamp| stamp.end == text.len())
    }

    /// Without the sign of a remark, and whether it had one.
    fn bare(&self) -> (&[u8], bool) {
        let text = self.bytes.trim_ascii();
        remark(text).map_or((text, false), |rest| (rest, true))
    }

    fn names(&self, dialect: Dialect) -> Vec<String> {
        dialect.fields(self.bare().0).into_iter().map(fields::name).collect()
    }
}

/// What follows the sign of a remark.
pub(super) fn remark(text: &[u8]) -> Option<&[u8]> {
    text.strip_prefix(b"#").or_else(|| text.strip_prefix(b"%")).or_else(|| text.strip_prefix(b"//"))
}

/// A spreadsheet's `sep=,`, between quotation marks or not.
fn is_separator_line(text: &[u8]) -> bool {
    let text = text.strip_prefix(b"\"").map_or(text, |rest| rest.strip_suffix(b"\"").unwrap_or(rest));
    text.len() <= 6 && text.get(..4).is_some_and(|first| first.eq_ignore_ascii_case(b"sep="))
}

/// Finds the table in lines that come one by one, whoever reads them: a file or a stream.
#[derive(Default)]
pub struct Finder {
    looked: Vec<Looked>,
    bytes: usize,
    known: Option<usize>,
    data: Option<(usize, Dialect)>,
}

impl Finder {
    /// Takes the next line; whether more are wanted. `knows` says of names that no further look is needed.
    pub fn take(&mut self, bytes: &[u8], number: u64, knows: &dyn Fn(&[String]) -> bool) -> bool {
        self.bytes += bytes.len();
        self.looked.push(Looked { bytes: bytes.to_vec(), number });
        let line = &self.looked[self.looked.len() - 1];
        if line.is_blank() {
            return true;
        }
        if self.known.is_none() && self.data.is_none() && knows(&line.names(CSV)) {
            self.known = Some(self.looked.len() - 1);
            // The next line may hold units.
            return true;
        }
        if self.known.is_some() {
            return false;
        }
        // The three rows that are alike are the samples.
        self.data = first_row(&self.looked);
        self.data.is_none() && self.bytes < LOOK_BYTES && self.looked.len() < LOOK_LINES
    }

    /// The lines taken so far, with their numbers.
    #[must_use]
    pub fn lines(&self) -> impl ExactSizeIterator<Item = (&[u8], u64)> {
        self.looked.iter().map(|line| (line.bytes.as_slice(), line.number))
    }

    /// What the lines so far are the beginning of, and how many of them stand above the first row.
    ///
    /// # Errors
    /// They are no table.
    pub fn finish(&self, skipped: &mut Skipped) -> Result<(Head, usize), HeadError> {
        let looked = &self.looked;
        if let Some(header) = self.known {
            return Ok(begin(looked, header, CSV, skipped));
        }
        let Some((first, dialect)) = self.data.or_else(|| only_row(looked)) else {
            let header = looked
                .iter()
                .position(|line| !line.is_blank() && !line.bare().1 && !is_separator_line(line.bytes.trim_ascii()));
            let header = header.ok_or(HeadError::Empty)?;
            let dialect = Dialect::new(most_fields(&looked[header].bytes), Point::Dot);
            return Ok(begin(looked, header, dialect, skipped));
        };
        let found = dialect.fields(&looked[first].bytes).len();
        if dialect.labelled {
            return Ok(named_in_the_rows(looked, first, dialect, skipped));
        }
        match header_above(looked, first, dialect, found) {
            Above::Header(header) => Ok(begin(looked, header, dialect, skipped)),
            Above::DecimalCommas(names) => Err(HeadError::DecimalCommas { line: looked[first].number, found, names }),
            Above::Nothing => {
                note_above(&looked[..first], skipped);
                let samples = samples(&looked[first..], dialect);
                let message = echoed(&dialect.fields(&looked[first].bytes));
                let line = message.is_some().then_some(looked[first].number);
                let names = message.unwrap_or_else(|| (1..=found).map(|i| format!("column_{i}")).collect());
                let head = Head {
                    names,
                    units: vec![None; found],
                    line,
                    dialect,
                    samples,
                    keys: keys(&looked[..first]),
                    raw: Vec::new(),
                };
                Ok((head, first))
            }
        }
    }
}

/// Finds the table and passes by what stands above its first row.
pub(super) fn find<R: Read>(
    lines: &mut Lines<R>,
    knows: &dyn Fn(&[String]) -> bool,
    skipped: &mut Skipped,
) -> Result<Head, HeadError> {
    let mut finder = Finder::default();
    lines.look(|bytes, number| finder.take(bytes, number, knows))?;
    let (head, above) = finder.finish(skipped)?;
    lines.skip(above)?;
    Ok(head)
}

/// Takes the names that stand before the fields of the first row.
fn named_in_the_rows(looked: &[Looked], first: usize, dialect: Dialect, skipped: &mut Skipped) -> (Head, usize) {
    note_above(&looked[..first], skipped);
    let row = &looked[first];
    let names: Vec<String> = dialect
        .labels(&row.bytes)
        .into_iter()
        .map(|name| name.map_or_else(|| STAMP.to_owned(), fields::name))
        .collect();
    let mut units = dialect.units(&row.bytes);
    units.resize(names.len(), None);
    let head = Head {
        units,
        names,
        line: Some(row.number),
        dialect,
        samples: samples(&looked[first..], dialect),
        keys: keys(&looked[..first]),
        raw: Vec::new(),
    };
    (head, first)
}

/// The names of a row of a message with a header as `ros2 topic echo --csv` prints it, which writes none: the stamp in seconds and
/// nanoseconds, the frame, and what the number of fields tells; else they are numbered.
fn echoed(fields: &[&[u8]]) -> Option<Vec<String>> {
    let count = |field: &[u8]| std::str::from_utf8(field).ok().and_then(|text| text.parse::<u64>().ok());
    let axes = |of: &str, axes: &str| -> Vec<String> { axes.chars().map(|axis| format!("{of}.{axis}")).collect() };
    let spread = |of: &str| -> Vec<String> { (0..9).map(|k| format!("{of}_covariance[{k}]")).collect() };
    let stamp = count(fields.first()?).is_some_and(|sec| sec < 1 << 32)
        && count(fields.get(1)?).is_some_and(|ns| ns < 1_000_000_000);
    if !stamp || fields.len() < 4 || is_number(CSV, fields[2]) {
        return None;
    }
    let parts = match fields.len() {
        6 => axes("vector", "xyz"),
        7 if fields[3..].iter().all(|field| is_number(CSV, field)) => axes("quaternion", "xyzw"),
        10 => [axes("pose.position", "xyz"), axes("pose.orientation", "xyzw")].concat(),
        40 => [
            axes("orientation", "xyzw"),
            spread("orientation"),
            axes("angular_velocity", "xyz"),
            spread("angular_velocity"),
            axes("linear_acceleration", "xyz"),
            spread("linear_acceleration"),
        ]
        .concat(),
        count => (4..=count).map(|k| format!("column_{k}")).collect(),
    };
    let header = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"].map(str::to_owned);
    Some([header.to_vec(), parts].concat())
}

/// What the stamp before each line is called.
const STAMP: &str = "time";

/// Makes names that stand there twice differ by what stands above them: a motion capture system names a rotation's X and a
/// position's X so.
fn tell_apart(names: &mut Vec<String>, above: &[Looked], dialect: Dialect) {
    let distinct = |names: &[String]| names.iter().collect::<HashSet<_>>().len();
    for line in above.iter().rev().filter(|line| !line.is_blank()).take(MOST_NAME_ROWS) {
        if distinct(names) == names.len() {
            return;
        }
        let over = line.names(dialect);
        if over.len() != names.len() {
            return;
        }
        let joined: Vec<String> =
            over.iter().zip(&*names).map(|(over, name)| format!("{over} {name}").trim().to_owned()).collect();
        if distinct(&joined) > distinct(names) {
            *names = joined;
        }
    }
}

/// Takes this line for the header, and one of units below it.
fn begin(looked: &[Looked], header: usize, dialect: Dialect, skipped: &mut Skipped) -> (Head, usize) {
    note_above(&looked[..header], skipped);
    let mut names = looked[header].names(dialect);
    tell_apart(&mut names, &looked[..header], dialect);
    if let Some(first) = names.first_mut().filter(|first| dialect.stamped && moment::form(first.as_bytes()).is_some()) {
        STAMP.clone_into(first);
    }
    let mut after = header + 1;
    let rulers = looked[after..].iter().take_while(|line| line.is_blank() || is_ruler(&line.bytes)).count();
    if looked[after..after + rulers].iter().any(|line| !line.is_blank()) {
        after += rulers;
    }
    let below = looked[after..].iter().position(|line| !line.is_blank()).map(|i| i + after);
    let mut units = vec![None; names.len()];
    if let Some(place) = below
        && let Some(row) = units_row(&dialect.fields(looked[place].bare().0))
    {
        skipped.add(Skip::Units, looked[place].number);
        units = row;
        after = place + 1;
    } else if let Some(place) = below.filter(|_| dialect.united) {
        units = dialect.units(&looked[place].bytes);
    }
    let samples = samples(&looked[after..], dialect);
    // A separator at the end of the header, or a column of remarks, and none at the end of the rows.
    let may_lack = |name: &String| name.is_empty() || dialect.separator == Separator::Byte(b'\t');
    if names.last().is_some_and(may_lack) && samples.first().is_some_and(|row| row.len() + 1 == names.len()) {
        names.pop();
    }
    for (i, name) in names.iter_mut().enumerate().filter(|(_, name)| name.is_empty()) {
        *name = format!("column_{}", i + 1);
    }
    units.resize(names.len(), None);
    let line = Some(looked[header].number);
    let keys = keys(&looked[..header]);
    (Head { names, units, line, dialect, samples, keys, raw: looked[header].bytes.clone() }, after)
}

/// What Vicon captures, as it stands above the rate.
const CAPTURED: [&[u8]; 5] = [b"Segments", b"Trajectories", b"Joints", b"Model Outputs", b"Devices"];

/// What stands above a header as a key and a value: `gscale,0.001`, `# Config: data_rate = 500.0 Hz, gyro_range = 250 dps`.
fn keys(above: &[Looked]) -> Vec<(String, String)> {
    let mut keys = Vec::new();
    // Vicon's rate stands alone below what was captured.
    for pair in above.windows(2).filter(|pair| CAPTURED.contains(&pair[0].bytes.trim_ascii())) {
        keys.push(("rate".to_owned(), fields::name(&pair[1].bytes)));
    }
    for line in above.iter().filter(|line| !line.is_blank()) {
        let text = fields::name(line.bare().0);
        let text = text.trim_matches('"');
        let (mut alone, mut pairs) = (true, Vec::new());
        for part in text.split([',', ';', '\t']) {
            // `Config: data_rate = 500`: the last sign parts them.
            let cut = part.rfind('=').or_else(|| part.find(": ")).or_else(|| part.strip_suffix(':').map(str::len));
            if let Some(at) = cut {
                let key = part[..at].rsplit(": ").next().unwrap_or_default();
                pairs.push((key.to_owned(), part[at + 1..].to_owned()));
                alone = false;
            }
        }
        if alone || pairs.iter().all(|(_, value)| value.trim().is_empty()) {
            let parts = text.split_once([',', ';', '\t']).or_else(|| text.split_once(':'));
            pairs = parts.map(|(key, value)| (key.to_owned(), value.to_owned())).into_iter().collect();
        }
        let trimmed = |text: &str| text.trim().trim_matches(|c| matches!(c, '"' | ':' | '=')).trim().to_owned();
        let pairs = pairs.iter().map(|(key, value)| (trimmed(key), trimmed(value)));
        keys.extend(pairs.filter(|(key, value)| !key.is_empty() && !value.is_empty()));
    }
    keys
}

fn samples(looked: &[Looked], dialect: Dialect) -> Vec<Vec<Vec<u8>>> {
    let rows = looked.iter().filter(|line| !line.is_blank() && !line.bare().1);
    rows.take(SAMPLES).map(|line| dialect.fields(&line.bytes).into_iter().map(<[u8]>::to_vec).collect()).collect()
}

/// Counts the lines of text above a header; remarks are no fault there.
fn note_above(above: &[Looked], skipped: &mut Skipped) {
    for line in above {
        if !line.is_blank() && !line.bare().1 && !is_separator_line(line.bytes.trim_ascii()) {
            skipped.add(Skip::Above, line.number);
        }
    }
}

/// The first of the last three lines, where they are rows alike: one or two lines of numbers may be part of a preamble.
fn first_row(looked: &[Looked]) -> Option<(usize, Dialect)> {
    alike(looked, 3)
}

/// The first row of a text that has no more than two.
fn only_row(looked: &[Looked]) -> Option<(usize, Dialect)> {
    alike(looked, 2).or_else(|| alike(looked, 1))
}

/// The first of the last so many lines, where all are rows of one kind.
fn alike(looked: &[Looked], count: usize) -> Option<(usize, Dialect)> {
    let mut rows: Vec<(usize, &Looked)> =
        looked.iter().enumerate().rev().filter(|(_, line)| !line.is_blank()).take(count).collect();
    rows.reverse();
    let &(place, first) = rows.first().filter(|_| rows.len() == count)?;
    let found = row_of(&first.bytes)?;
    let dialects: Vec<Dialect> = rows.iter().map(|(_, line)| row_of(&line.bytes)).collect::<Option<_>>()?;
    // One row may hold a decimal comma where the other has a whole number.
    let comma = dialects.iter().any(|dialect| dialect.point == Point::Comma);
    let dialect = Dialect { point: if comma { Point::Comma } else { Point::Dot }, ..found };
    if dialects.iter().any(|other| Dialect { point: dialect.point, ..*other } != dialect) {
        return None;
    }
    let lengths: Vec<usize> = rows.iter().map(|(_, line)| dialect.fields(&line.bytes).len()).collect();
    let even = lengths.iter().all(|length| *length == lengths[0]);
    // Decimal commas between commas make rows of many lengths, all longer than the header.
    let above = looked[..place].iter().rev().find(|line| !line.is_blank()).map(|line| line.names(dialect).len());
    let longer =
        dialect.separator == Separator::Byte(b',') && above.is_some_and(|above| lengths.iter().all(|n| *n > above));
    let same_kinds = rows.iter().all(|(_, line)| kinds_agree(dialect, &first.bytes, &line.bytes));
    (even && same_kinds || longer).then_some((place, dialect))
}

/// Whether each field of one row is of the kind of the other's: a number, a time or a text. What is empty may be any.
fn kinds_agree(dialect: Dialect, a: &[u8], b: &[u8]) -> bool {
    let kind = |field: &[u8]| match dialect.value(field) {
        Field::Empty | Field::Nan | Field::Infinite => None,
        Field::Number(_) => Some(0),
        Field::Text if moment::form(field).is_some() => Some(1),
        Field::Text if moment::date(field).is_some() => Some(2),
        Field::Text => Some(3),
    };
    let pairs = dialect.fields(a).into_iter().zip(dialect.fields(b));
    pairs.into_iter().all(|(a, b)| kind(a).zip(kind(b)).is_none_or(|(a, b)| a == b))
}

/// Whether a line holds numbers for the most part.
pub(crate) fn is_row(line: &[u8]) -> bool {
    row_of(line).is_some()
}

/// How a line is written that holds numbers for the most part.
fn row_of(line: &[u8]) -> Option<Dialect> {
    if remark(line.trim_ascii()).is_some() {
        return None;
    }
    [Separator::Byte(b';'), Separator::Byte(b'\t'), Separator::Byte(b','), Separator::Byte(b'|'), Separator::Blanks]
        .into_iter()
        .find_map(|separator| {
            let points: &[Point] = if separator == Separator::Byte(b',') && !line.contains(&b'"') {
                &[Point::Dot]
            } else {
                &[Point::Dot, Point::Comma]
            };
            let counts = points.iter().map(|&point| {
                let dialect = Dialect::new(separator, point).dressed(line);
                (dialect, counted(dialect, line))
            });
            let (dialect, (numbers, filled, fields)) = counts.reduce(|a, b| if b.1.0 > a.1.0 { b } else { a })?;
            // `gyro z: 1.5 angle: 3` is a sentence.
            let is_sign = |field: &[u8]| matches!(field.last(), Some(b':' | b'='));
            let is_sentence =
                separator == Separator::Blanks && !dialect.labelled && dialect.fields(line).into_iter().any(is_sign);
            (!is_sentence && fields >= 2 && numbers >= 2 && 2 * numbers >= filled).then_some(dialect)
        })
}

/// Fields of a line that are numbers or times, that are not empty, and all.
fn counted(dialect: Dialect, line: &[u8]) -> (usize, usize, usize) {
    let fields = dialect.fields(line);
    let numbers = fields.iter().filter(|field| is_number(dialect, field)).count();
    (numbers, fields.iter().filter(|field| !field.is_empty()).count(), fields.len())
}

/// Whether a field is a number or a time.
pub(crate) fn is_number(dialect: Dialect, field: &[u8]) -> bool {
    match dialect.value(field) {
        Field::Number(_) | Field::Infinite => true,
        // Other words for no value may be names.
        Field::Nan => field.to_ascii_lowercase().ends_with(b"nan"),
        Field::Empty => false,
        Field::Text => moment::form(field).is_some() || moment::date(field).is_some(),
    }
}

/// The units of a row that holds nothing else.
pub(crate) fn units_row(fields: &[&[u8]]) -> Option<Vec<Option<Unit>>> {
    let mut row = Vec::with_capacity(fields.len());
    for field in fields {
        let text = String::from_utf8_lossy(field);
        let text = text.trim().trim_matches(|c| "[](){}".contains(c));
        let unit = unit::parse(text);
        if unit.is_none() && !text.is_empty() {
            return None;
        }
        row.push(unit);
    }
    row.iter().any(Option::is_some).then_some(row)
}

/// Whether a line is drawn below a header: `|-----|-----|`, `----- -----`.
pub(super) fn is_ruler(line: &[u8]) -> bool {
    let text = line.trim_ascii();
    text.len() > 2 && text.iter().all(|b| b"-=+|: \t,;".contains(b)) && text.iter().any(|b| b"-=".contains(b))
}

/// Whether the first rows have the same words in the same places: names of the values behind them.
fn has_words(looked: &[Looked], first: usize, dialect: Dialect) -> bool {
    let rows: Vec<Vec<&[u8]>> =
        looked[first..].iter().filter(|line| !line.is_blank()).map(|line| dialect.fields(&line.bytes)).collect();
    let is_word = |k: usize| {
        let word = rows[0][k];
        !is_number(dialect, word) && rows.iter().all(|row| row.get(k) == Some(&word))
    };
    (0..rows.first().map_or(0, Vec::len)).any(is_word)
}

/// Whether a field is drawn and not written: `***`, `====`.
fn is_ornament(field: &[u8]) -> bool {
    field.len() > 1 && field.iter().all(u8::is_ascii_punctuation)
}

enum Above {
    Header(usize),
    DecimalCommas(usize),
    Nothing,
}

/// The header that stands over the first row.
fn header_above(looked: &[Looked], first: usize, dialect: Dialect, found: usize) -> Above {
    let (mut nearest, mut short, mut units) = (true, Above::Nothing, None);
    let above = looked[..first].iter().enumerate().rev();
    for (i, line) in above.filter(|(_, line)| !line.is_blank() && !is_ruler(&line.bytes)) {
        let fields = dialect.fields(line.bare().0);
        let mut names = fields.iter().filter(|field| !field.is_empty() && !is_number(dialect, field)).count();
        // Beside a number, a word for no value is none of a name.
        if fields.iter().any(|field| matches!(dialect.value(field), Field::Number(_))) {
            names = fields.iter().filter(|field| dialect.value(field) == Field::Text).count();
        }
        // A banner that has as many words as a row has fields is no header of it.
        let is_banner = fields.iter().any(|field| is_ornament(field))
            || dialect.separator == Separator::Blanks
                && dialect.stamped
                && !dialect.dressed(&line.bytes).stamped
                && has_words(looked, first, dialect);
        let is_names = 2 * names > fields.len() && names >= 2 && !is_banner;
        // A last column that is empty, or of remarks that few rows have.
        let remarks = nearest && dialect.separator == Separator::Byte(b'\t');
        let trailing = fields.len() == found + 1 && fields.last().is_some_and(|field| field.is_empty() || remarks);
        let row_trails = fields.len() + 1 == found
            && dialect.fields(&looked[first].bytes).last().is_some_and(|field| field.is_empty());
        if is_names && (fields.len() == found || trailing || row_trails) {
            if units_row(&fields).is_none() {
                return Above::Header(i);
            }
            units.get_or_insert(i);
        } else if nearest && is_names && dialect.separator == Separator::Byte(b',') {
            let twice = fields.len() < found && found <= 2 * fields.len();
            short = if twice { Above::DecimalCommas(fields.len()) } else { Above::Header(i) };
        }
        nearest = false;
    }
    // `T,G,A` are names where nothing else is.
    units.map_or(short, Above::Header)
}

/// The separator that cuts a header into the most fields.
fn most_fields(line: &[u8]) -> Separator {
    let candidates = [
        Separator::Byte(b','),
        Separator::Byte(b';'),
        Separator::Byte(b'\t'),
        Separator::Byte(b'|'),
        Separator::Blanks,
    ];
    let count = |separator| Dialect::new(separator, Point::Dot).fields(line).len();
    let sure = candidates[..4].iter().copied().max_by_key(|&s| count(s)).filter(|&s| count(s) > 1);
    sure.unwrap_or(if count(Separator::Blanks) > 2 { Separator::Blanks } else { Separator::Byte(b',') })
}
