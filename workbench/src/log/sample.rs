//! Columns of a text, or of messages, as numbers: what advice is given by.

use super::{Maps, gravity::Gravity, input::Input, timer::Timer, words};
use crate::toml_error::quoted;
use gyro_model::{Axis, Row};
use log_readers::{
    can,
    format::{Note, ROW, Sink, Topic},
    meaning::Pick,
    text::{self, Dialect, Head, Table},
};
use std::cell::OnceCell;

/// Rows that are looked at.
pub(super) const LOOKED_AT: usize = 20_000;
/// A table with more columns is looked at by nobody.
const WIDEST: usize = 1000;
/// Rows that are enough.
pub(super) const FEWEST: usize = 20;
const ENOUGH: usize = 1000;

/// Columns of a text as numbers.
pub struct Sample {
    pub(super) head: Head,
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) texts: Vec<Option<String>>,
    /// Whether a column is dates or times of day: it holds their seconds.
    pub(super) moments: Vec<bool>,
    /// Whether three columns are the accelerometer of an MPU, once it was asked for.
    pub(super) mpu: OnceCell<bool>,
}

impl Sample {
    /// Of these rows below a head.
    pub fn of<'a>(head: &Head, rows: impl Iterator<Item = &'a [u8]>) -> Self {
        let count = head.names.len();
        let (columns, texts, moments) = (vec![Vec::new(); count], vec![None; count], vec![false; count]);
        let mut sample = Self { head: head.clone(), columns, texts, moments, mpu: OnceCell::new() };
        for row in rows {
            sample.take(head.dialect, &head.dialect.fields(row));
        }
        sample
    }

    /// The first rows of a table.
    pub(super) fn of_table(input: Input) -> Option<Self> {
        let mut table = Table::open(input, &|_| false).ok()?;
        let (head, dialect) = (table.head().clone(), table.dialect());
        if head.names.len() > WIDEST {
            return None;
        }
        let mut sample = Self::of(&head, std::iter::empty());
        for _ in 0..LOOKED_AT {
            let Ok(Some(row)) = table.next_row() else { break };
            let fields: Vec<&[u8]> = row.fields().collect();
            sample.take(dialect, &fields);
        }
        Some(sample)
    }

    /// Of messages whose names are those of their writer.
    pub(super) fn of_messages(mut input: Input, maps: &Maps) -> Option<Self> {
        let mut gathered = Gathered::default();
        input.read_all(maps.database.as_ref(), &mut gathered).ok()?;
        let Gathered { names, units, topics, is_known, mut rows } = gathered;
        if is_known || names.is_empty() || names.len() > WIDEST {
            return None;
        }
        rows.sort_by_key(|row| row.0);
        let first = rows.first()?.0;
        let mut columns = vec![Vec::with_capacity(rows.len()); names.len() + 1];
        for (time, topic, values) in rows {
            columns[0].push((time - first) as f64 * 1e-9);
            for (k, column) in columns[1..].iter_mut().enumerate() {
                let value = k.checked_sub(topics[topic]).and_then(|k| values.get(k));
                column.push(value.copied().unwrap_or(f64::NAN));
            }
        }
        let count = columns.len();
        let names = std::iter::once("t".to_owned()).chain(names).collect();
        let units = std::iter::once(None).chain(units).collect();
        let head = Head::of_columns(names, units, text::CSV, Vec::new());
        Some(Self { head, columns, texts: vec![None; count], moments: vec![false; count], mpu: OnceCell::new() })
    }

    fn take(&mut self, dialect: Dialect, fields: &[&[u8]]) {
        if fields.len() != self.columns.len() {
            return;
        }
        for (i, field) in fields.iter().enumerate() {
            let value = match dialect.value(field) {
                text::Field::Number(x) => x,
                text::Field::Text => {
                    if let Some(ns) = text::clock(field).or_else(|| text::date_time(field)) {
                        self.moments[i] = true;
                        ns as f64 * 1e-9
                    } else {
                        self.texts[i].get_or_insert_with(|| String::from_utf8_lossy(field).into_owned());
                        f64::NAN
                    }
                }
                _ => f64::NAN,
            };
            self.columns[i].push(value);
        }
    }

    /// Whether three neighbouring columns show gravity as the accelerometer of an MPU does.
    pub(super) fn is_of_mpu(&self) -> bool {
        *self.mpu.get_or_init(|| {
            let accel = |first: usize, k: usize| std::array::from_fn(|i| self.columns[first + i][k]);
            let rows = |first: usize| -> Vec<Row> {
                (0..self.rows().min(ENOUGH)).map(|k| Row { accel: accel(first, k), ..Row::EMPTY }).collect()
            };
            (0..self.columns.len().saturating_sub(2)).any(|first| Gravity::of(&rows(first)).is_of_mpu())
        })
    }

    /// Whether a column holds text: more than a few garbled numbers.
    pub(super) fn is_text(&self, column: usize) -> bool {
        let numbers = self.columns[column].iter().filter(|x| x.is_finite()).count();
        self.texts[column].is_some() && 10 * numbers < 9 * self.rows()
    }

    pub(super) fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// These columns, as those of a gyro.
    pub(super) fn gyro_columns(&self, columns: &[(Axis, usize)]) -> Vec<words::Column> {
        let of = |&(axis, column): &(Axis, usize)| words::Column {
            axis,
            numbers: self.columns[column].iter().copied().filter(|x| x.is_finite()).collect(),
            channel: self.channel(column),
            called: self.called(column),
        };
        columns.iter().map(of).collect()
    }

    /// The channel of a column as `--map` takes it.
    pub(super) fn channel(&self, column: usize) -> String {
        if self.head.line.is_none() { (column + 1).to_string() } else { self.head.names[column].clone() }
    }

    pub(super) fn called(&self, column: usize) -> String {
        if self.head.line.is_none() { format!("column {}", column + 1) } else { quoted(&self.head.names[column]) }
    }

    pub(super) fn pick(&self, name: &str, column: usize, divisor: f64) -> Pick {
        Pick { factor: divisor.recip(), ..Pick::new(name, &self.channel(column), None) }
    }

    /// The middle step of a column that only grows, past the overflows of a timer.
    pub(super) fn step(&self, column: usize) -> Option<f64> {
        let values: Vec<f64> = self.since_first(column, 1.0).into_iter().filter(|x| x.is_finite()).collect();
        let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let back = steps.iter().filter(|step| **step < 0.0).count();
        steps.retain(|step| *step > 0.0);
        if steps.is_empty()
            || values.len() < FEWEST.min(self.rows())
            || 50 * back > values.len()
            || 3 * steps.len() < values.len()
        {
            return None;
        }
        let middle = steps.len() / 2;
        let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        // A clock ticks evenly for the most part; an angle that grows does not.
        let even = steps.iter().filter(|step| (0.5..1.5).contains(&(**step / usual))).count();
        (10 * even >= 7 * steps.len()).then_some(usual)
    }

    /// A column from its first value on, times a scale: differences of a large count are exact, its product with a unit is not.
    pub(super) fn since_first(&self, column: usize, scale: f64) -> Vec<f64> {
        let values = &self.columns[column];
        let first = values.iter().copied().find(|x| x.is_finite()).unwrap_or_default();
        let (mut counter, mut overflows) = (Timer::default(), 0.0);
        let past_overflows = |x: &f64| {
            if x.is_finite() {
                let written = (x * 1e6).round() as i128;
                overflows = (counter.follow(written, 6, false).0 - written) as f64 * 1e-6;
            }
            (x - first + overflows) * scale
        };
        values.iter().map(past_overflows).collect()
    }

    /// How many numbers a column holds.
    pub(super) fn values(&self, column: usize) -> usize {
        self.columns[column].iter().filter(|x| x.is_finite()).count()
    }

    pub(super) fn varies(&self, column: usize) -> bool {
        let finite = || self.columns[column].iter().copied().filter(|x| x.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high > low
    }
}

/// Messages whose names are those of their writer, as the rows of a table.
#[derive(Default)]
struct Gathered {
    names: Vec<String>,
    units: Vec<Option<log_readers::unit::Unit>>,
    /// Where the fields of each topic begin among the names.
    topics: Vec<usize>,
    is_known: bool,
    rows: Vec<(i64, usize, Vec<f64>)>,
}

impl Sink for Gathered {
    fn topic(&mut self, topic: &Topic) -> bool {
        self.is_known |= ![can::KIND, ROW].contains(&topic.kind.as_str());
        self.topics.push(self.names.len());
        for field in &topic.fields {
            self.names.push(topic.channel(field));
            self.units.push(field.unit);
        }
        true
    }

    fn message(&mut self, topic: usize, time_ns: i64, values: &[f64]) {
        if self.rows.len() < LOOKED_AT && !self.is_known {
            self.rows.push((time_ns, topic, values.to_vec()));
        }
    }

    fn note(&mut self, _note: Note) {}
}
