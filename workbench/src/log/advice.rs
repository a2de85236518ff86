//! What to do about a text that lacks something: what its columns hold by their numbers, and the maps that make a log of it. A map is
//! tried on the file before anybody is told of it.

use super::{
    Maps, Options, Reader,
    error::{LogError, Problem},
    input::Input,
    lacking::Advice,
    names::{Names, time_form},
    reader::Torn,
    timer::Timer,
    unit::{self, Channel, Name},
    unsaid::{self, Unit},
    whole, words,
};
use crate::{files, toml_error::quoted};
use gyro_model::{Axis, Record, Row, units};
use log_readers::{
    can,
    format::{Note, ROW, Sink, Topic},
    meaning::{AXES, Pick, Proposal, stated_rate, unit_said},
    text::{self, Dialect, Form, Head, Table},
    unit::Quantity,
};
use std::{io::Cursor, ops::RangeInclusive, path::Path};

/// Rows that are looked at, and how many are enough.
const LOOKED_AT: usize = 20_000;
const FEWEST: usize = 20;
/// The step of a gyro's log, s: at most, at least, and the usual one.
const SLOWEST: f64 = 0.13;
const FASTEST: f64 = 1e-4;
const USUAL: f64 = 0.01;
/// Columns that are held against each other, at most.
const MOST: usize = 12;
/// A table with more columns is looked at by nobody.
const WIDEST: usize = 1000;
/// A file of more bytes is tried by its first rows alone.
const LARGE: u64 = 64 << 20;
/// How much of the angle's motion a rate has to show, as r².
const FOLLOWS: f64 = 0.9;

/// Columns of a text as numbers.
pub struct Sample {
    head: Head,
    columns: Vec<Vec<f64>>,
    texts: Vec<Option<String>>,
    /// Whether a column is dates or times of day: it holds their seconds.
    moments: Vec<bool>,
}

impl Sample {
    /// Of these rows below a head.
    pub fn of<'a>(head: &Head, rows: impl Iterator<Item = &'a [u8]>) -> Self {
        let count = head.names.len();
        let (columns, texts, moments) = (vec![Vec::new(); count], vec![None; count], vec![false; count]);
        let mut sample = Self { head: head.clone(), columns, texts, moments };
        for row in rows {
            sample.take(head.dialect, &head.dialect.fields(row));
        }
        sample
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

    /// Whether a column holds text: more than a few garbled numbers.
    fn is_text(&self, column: usize) -> bool {
        let numbers = self.columns[column].iter().filter(|x| x.is_finite()).count();
        self.texts[column].is_some() && 10 * numbers < 9 * self.rows()
    }

    fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// These columns, as those of a gyro.
    fn gyro_columns(&self, columns: &[(Axis, usize)]) -> Vec<words::Column> {
        let of = |&(axis, column): &(Axis, usize)| words::Column {
            axis,
            numbers: self.columns[column].iter().copied().filter(|x| x.is_finite()).collect(),
            channel: self.channel(column),
            called: self.called(column),
        };
        columns.iter().map(of).collect()
    }

    /// The channel of a column as `--map` takes it.
    fn channel(&self, column: usize) -> String {
        if self.head.line.is_none() { (column + 1).to_string() } else { self.head.names[column].clone() }
    }

    fn called(&self, column: usize) -> String {
        if self.head.line.is_none() { format!("column {}", column + 1) } else { quoted(&self.head.names[column]) }
    }

    fn pick(&self, name: &str, column: usize, divisor: f64) -> Pick {
        Pick { factor: divisor.recip(), ..Pick::new(name, &self.channel(column), None) }
    }

    /// The middle step of a column that only grows.
    fn step(&self, column: usize) -> Option<f64> {
        let values: Vec<f64> = self.columns[column].iter().copied().filter(|x| x.is_finite()).collect();
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
    fn since_first(&self, column: usize, scale: f64) -> Vec<f64> {
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

    fn varies(&self, column: usize) -> bool {
        let finite = || self.columns[column].iter().copied().filter(|x| x.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high > low
    }
}

/// What is known of the columns already.
#[derive(Default)]
struct Used {
    time: bool,
    gyros: Vec<(Axis, usize)>,
    references: bool,
    columns: Vec<usize>,
}

impl Used {
    fn of(renamed: &[String], displaced: &[bool]) -> Self {
        let mut used = Self::default();
        for (i, name) in renamed.iter().enumerate().filter(|(i, _)| !displaced[*i]) {
            let Name::Known(channel, _) = unit::name(name) else { continue };
            used.columns.push(i);
            used.time |= channel == Channel::Time;
            used.references |= channel.is_reference();
            if let Channel::Gyro(axis) = channel {
                used.gyros.push((axis, i));
            }
        }
        used
    }
}

/// What would make a log of these columns; `wants_reference` where none comes from elsewhere.
pub fn advise(sample: &Sample, maps: &Maps, wants_reference: bool) -> Advice {
    let Ok(mut names) = Names::of(&sample.head.names, maps) else { return Advice::default() };
    let proposal = names.propose(&sample.head);
    let mut used = Used::of(&names.renamed, &names.displaced);
    let mut nothing_turns = false;
    let (mut flags, mut holds, mut lacks): (Vec<Pick>, Vec<String>, Vec<&str>) = (Vec::new(), Vec::new(), Vec::new());
    if !used.time {
        match time(sample, &used) {
            Some((pick, column, says)) => {
                used.columns.push(column);
                flags.push(pick);
                holds.push(says);
            }
            None => lacks.push("time"),
        }
    }
    let column_of = |pick: &Pick| (0..sample.columns.len()).find(|&i| sample.channel(i) == pick.channel);
    let times = match flags.first() {
        Some(pick) => column_of(pick).map(|column| sample.since_first(column, pick.factor * scale_of(&pick.name))),
        None => known_time(sample, &names),
    };
    let times = times.as_deref();
    let tags: Vec<&str> = sample.texts.iter().flatten().map(String::as_str).collect();
    let angles = tags.iter().any(|tag| ["ypr", "rpy", "euler"].iter().any(|word| tag.to_lowercase().contains(word)));
    if used.gyros.is_empty() {
        let found = if angles { None } else { gyro(sample, &used, &proposal, times) };
        match found {
            Some((picks, says)) => {
                let gyros = gyros_of(&picks, sample);
                let has_reference = picks.iter().any(|pick| pick.name.starts_with("ref_"));
                flags.extend(picks);
                holds.push(says);
                used.columns.extend(gyros.iter().map(|(_, column)| *column));
                let found =
                    if wants_reference && !has_reference { reference(sample, &used, &gyros, times) } else { None };
                if let Some((picks, says)) = found {
                    flags.extend(picks);
                    holds.push(says);
                }
            }
            None => lacks.push("rate of a gyro"),
        }
    } else if wants_reference && !used.references {
        let found = reference(sample, &used, &used.gyros, times);
        let offered: Vec<Pick> =
            proposal.offered.iter().filter(|pick| pick.name.starts_with("ref_")).cloned().collect();
        match (found, offered.first()) {
            (Some((picks, says)), _) => {
                flags.extend(picks);
                holds.push(says);
            }
            (None, Some(first)) => {
                let more = if offered.len() > 1 { " …" } else { "" };
                holds.push(format!(
                    "{}{more} may be a reference, if something else than this gyro measured it (most drivers compute an \
                     orientation from the gyro)",
                    quoted(&first.channel)
                ));
                flags.extend(offered);
            }
            (None, None) => nothing_turns = true,
        }
    }
    let mut why = holds.join("; ");
    if !lacks.is_empty() {
        let end = if why.is_empty() { "" } else { "; " };
        why = format!("{why}{end}{}", lacking(&lacks, angles));
        flags.clear();
    }
    // Units that no reference tells.
    if flags.iter().all(|pick| !pick.name.starts_with("ref_")) && lacks.is_empty() {
        let unsaid: Vec<Pick> = flags.iter().filter(|pick| pick.name.len() == "gyro_x".len()).cloned().collect();
        let columns: Vec<(Axis, usize)> = used.gyros.clone().into_iter().chain(gyros_of(&unsaid, sample)).collect();
        if let Some(words) = words::advise(&sample.gyro_columns(&columns)) {
            let others = flags.iter().filter(|pick| !pick.name.starts_with("gyro_")).map(ToString::to_string);
            let why = [why, words.why].into_iter().filter(|why| !why.is_empty()).collect::<Vec<_>>().join("; ");
            return Advice { why, flags: others.chain(words.flags).collect(), ..words };
        }
    }
    if nothing_turns && lacks.is_empty() {
        let nothing = "nothing else in it turns as the gyro does";
        let still = still(sample, &names, &used.gyros);
        let says = match still {
            Some(spread) => format!(
                "{nothing}; the readings stay within {}°/s of each other, as those of a sensor at rest: if it did not turn, no reference \
                 is needed",
                units::round(spread.to_degrees())
            ),
            None => format!("{nothing}: give the file that has a reference"),
        };
        let why = if why.is_empty() { says } else { format!("{why}; {says}") };
        let flags = flags.iter().map(ToString::to_string).collect();
        return Advice { why, flags, needs_file: still.is_none(), at_rest: still.is_some(), ..Advice::default() };
    }
    Advice { why, flags: flags.iter().map(ToString::to_string).collect(), ..Advice::default() }
}

/// What is not in a text that a log needs; `angles` where only those of an attitude are in it.
fn lacking(lacks: &[&str], angles: bool) -> String {
    let but = if angles { ", only angles," } else { "" };
    let neither = match lacks {
        [one] => format!("no {one} is in it"),
        _ => format!("neither a time nor the rate of a gyro{but} is in it"),
    };
    let time = if lacks.contains(&"time") { " (no column keeps growing)" } else { "" };
    format!("{neither}{time}: print both in each row, such as t_ms,gyro_x,gyro_y,gyro_z and a reference")
}

/// The times of the rows by the column that is the time already, s from the first.
fn known_time(sample: &Sample, names: &Names) -> Option<Vec<f64>> {
    (0..sample.columns.len()).find_map(|column| {
        let Name::Known(Channel::Time, own) = unit::name(&names.renamed[column]) else { return None };
        let conversion = names.conversion(column, Channel::Time, own, &sample.head);
        let seconds = match time_form(&sample.head, column, conversion) {
            Form::Number(exponent) => sample.since_first(column, conversion.scale * 10_f64.powi(exponent - 9)),
            Form::Parts(fine) => {
                let whole = sample.since_first(column, 1.0);
                whole.iter().zip(&sample.columns[fine]).map(|(whole, ns)| whole + ns * 1e-9).collect()
            }
            Form::DateAndClock(other) => {
                let clock = if sample.moments[column] { column } else { other };
                sample.since_first(clock, 1.0)
            }
            _ => sample.since_first(column, 1.0),
        };
        Some(seconds)
    })
}

/// What the readings of these gyros stay within, rad/s, where it is so little that the sensor may have been at rest.
fn still(sample: &Sample, names: &Names, gyros: &[(Axis, usize)]) -> Option<f64> {
    let spread = |&(_, column): &(Axis, usize)| {
        let Name::Known(channel, own) = unit::name(&names.renamed[column]) else { return f64::INFINITY };
        let scale = names.conversion(column, channel, own, &sample.head).scale;
        let mut readings: Vec<f64> = sample.columns[column].iter().copied().filter(|x| x.is_finite()).collect();
        readings.sort_by(f64::total_cmp);
        let few = readings.len() / FEW;
        readings
            .get(few)
            .zip(readings.get(readings.len().saturating_sub(few + 1)))
            .map_or(f64::INFINITY, |(low, high)| (scale * (high - low)).abs())
    };
    Some(gyros.iter().map(spread).fold(0.0, f64::max)).filter(|spread| *spread < words::RESTS.to_radians())
}

/// One in so many readings at either end is not looked at.
const FEW: usize = 500;

/// The gyro's columns among these.
fn gyros_of(picks: &[Pick], sample: &Sample) -> Vec<(Axis, usize)> {
    let of = |pick: &Pick| {
        let axis = Axis::ALL.into_iter().find(|axis| pick.name.starts_with(&format!("gyro_{axis}")))?;
        Some((axis, (0..sample.columns.len()).find(|&i| sample.channel(i) == pick.channel)?))
    };
    picks.iter().filter_map(of).collect()
}

/// Seconds for one of a time's suffix.
fn scale_of(name: &str) -> f64 {
    match name {
        "t_ms" => 1e-3,
        "t_us" => 1e-6,
        "t_ns" => 1e-9,
        _ => 1.0,
    }
}

/// The column that is a time, in the unit that makes a gyro's log of it.
fn time(sample: &Sample, used: &Used) -> Option<(Pick, usize, String)> {
    let free = (0..sample.columns.len()).filter(|i| !used.columns.contains(i));
    let growing: Vec<(usize, f64)> = free.filter_map(|i| sample.step(i).map(|step| (i, step))).collect();
    let counts = |&(i, step): &(usize, f64)| {
        step == 1.0
            && sample.columns[i].windows(2).filter(|pair| pair[1] - pair[0] == 1.0).count() * 10 > sample.rows() * 9
    };
    let mut best: Option<(f64, usize, &str, f64)> = None;
    for &(column, step) in growing.iter().filter(|of| !counts(of)) {
        for name in ["t", "t_ms", "t_us", "t_ns"] {
            let seconds = step * scale_of(name);
            let now = sample.columns[column].first().copied().unwrap_or_default() * scale_of(name);
            let is_epoch = (9e8..4.2e9).contains(&now);
            let cost = (seconds / USUAL).ln().abs() - if is_epoch { 10.0 } else { 0.0 };
            if (FASTEST..SLOWEST).contains(&seconds) && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, column, name, seconds));
            }
        }
    }
    if let Some((_, column, name, seconds)) = best {
        let says = format!("{} only grows: a time, a row every {}", sample.called(column), duration(seconds));
        return Some((sample.pick(name, column, 1.0), column, says));
    }
    let rate = stated_rate(&sample.head)?;
    let &(column, _) = growing.iter().find(|of| counts(of))?;
    let says = format!("{} counts rows, {rate} of them a second as the text above says", sample.called(column));
    Some((sample.pick("t", column, rate), column, says))
}

fn duration(seconds: f64) -> String {
    if seconds < 1e-3 { format!("{:.3} ms", seconds * 1e3) } else { format!("{:.4} ms", seconds * 1e3) }
        .replace(".0000 ", " ")
        .replace(".000 ", " ")
}

/// Rows of which one column is a gyro's rate about z and another one its angle.
fn record(sample: &Sample, rate: &Turning, angle: &Turning, times: Option<&[f64]>) -> Record {
    let at = |k: usize| times.map_or(k as f64 * USUAL, |times| times[k]);
    let rows = (0..sample.rows()).map(|k| {
        let mut row = Row { t_ns: (at(k) * 1e9) as i64, ..Row::EMPTY };
        row.gyro[2] = rate.factor * sample.columns[rate.column][k];
        *(if angle.is_rate { &mut row.ref_rate[2] } else { &mut row.ref_angle[2] }) =
            angle.factor * sample.columns[angle.column][k];
        row
    });
    let mut rows: Vec<Row> = rows.filter(at_all).collect();
    drop_jumps(&mut rows);
    rows.sort_by_key(|row| row.t_ns);
    Record { rows, ..Record::default() }
}

/// Leaves out single rows whose time lies far from those of their neighbours: a digit of it is wrong.
fn drop_jumps(rows: &mut Vec<Row>) {
    const FAR: i64 = 10;
    let times: Vec<i64> = rows.iter().map(|row| row.t_ns).collect();
    let jumps = |k: usize| {
        let Some(&[before, own, after]) = times.get(k.wrapping_sub(1)..k + 2).and_then(|three| three.first_chunk())
        else {
            return false;
        };
        after > before && own.saturating_sub(before).saturating_abs() > FAR.saturating_mul(after - before)
    };
    let mut place = 0;
    rows.retain(|_| {
        place += 1;
        !jumps(place - 1)
    });
}

/// Whether a row has a gyro's reading or a reference.
fn at_all(row: &Row) -> bool {
    row.gyro[2].is_finite() || row.ref_angle[2].is_finite() || row.ref_rate[2].is_finite()
}

/// A column as a rate or an angle, with the unit that its name or its file says.
struct Turning {
    column: usize,
    is_rate: bool,
    said: Option<log_readers::unit::Unit>,
    /// SI units for one of its numbers, where the unit is said.
    factor: f64,
}

impl Turning {
    fn of(sample: &Sample, column: usize) -> Self {
        let head = &sample.head;
        let said = unit_said(&head.names[column], head.units[column]);
        let said = said.filter(|unit| matches!(unit.quantity, Quantity::Rate | Quantity::Angle));
        let is_rate = said.is_some_and(|unit| unit.quantity == Quantity::Rate);
        let channel = if is_rate { Channel::RefRate(Axis::Z) } else { Channel::RefAngle(Axis::Z) };
        let factor = said.and_then(|unit| unit::converted(channel, unit)).map_or(1.0, |conversion| conversion.scale);
        Self { column, is_rate, said, factor }
    }

    /// As a pick, in the unit that is said, else in the one that was found.
    fn pick(&self, base: &str, sample: &Sample, found: Unit) -> Pick {
        self.pick_as(base, self.column, sample, found)
    }

    /// The same for a column beside it.
    fn pick_as(&self, base: &str, column: usize, sample: &Sample, found: Unit) -> Pick {
        match self.said {
            Some(unit) => Pick::new(base, &sample.channel(column), Some(unit)),
            None => sample.pick(&format!("{base}{}", found.suffix), column, found.divisor),
        }
    }
}

/// The units in which a rate and what it is held against agree, and how well they do, as r².
fn agree(sample: &Sample, rate: &Turning, other: &Turning, times: Option<&[f64]>) -> Option<Agreed> {
    let record = record(sample, rate, other, times);
    let is_open = other.said.is_none();
    let told =
        unsaid::told(&record, Axis::Z, rate.said.is_none(), is_open && !other.is_rate, is_open && other.is_rate)?;
    let (r2, is_other_way) = unsaid::follows(&record, told.reference).filter(|(r2, _)| *r2 > FOLLOWS)?;
    Some(Agreed { gyro: told.gyro, reference: told.reference, unsure: told.unsure(), r2, is_other_way })
}

/// How a rate and what it is held against agree.
struct Agreed {
    gyro: Unit,
    reference: Unit,
    /// What is not sure of counts.
    unsure: Option<String>,
    r2: f64,
    is_other_way: bool,
}

impl Agreed {
    /// The pick of a reference with its sign, and the words for it.
    fn signed(&self, pick: Pick) -> (Pick, &'static str) {
        if self.is_other_way {
            let factor = -pick.factor;
            (Pick { factor, ..pick }, ", counted the other way")
        } else {
            (pick, "")
        }
    }

    /// What is not sure, after what was said.
    fn unsure(&self) -> String {
        self.unsure.as_ref().map_or(String::new(), |says| format!("; {says}"))
    }
}

/// Columns that may be a gyro's, and its reference where one of the others is the integral of one.
fn gyro(sample: &Sample, used: &Used, proposal: &Proposal, times: Option<&[f64]>) -> Option<(Vec<Pick>, String)> {
    let offered: Vec<Pick> = proposal.offered.iter().filter(|pick| pick.name.starts_with("gyro_")).cloned().collect();
    if !offered.is_empty() {
        let says = offered.iter().map(|pick| quoted(&pick.channel)).collect::<Vec<_>>().join(", ");
        return Some((offered, format!("{says} may be the gyro's axes")));
    }
    let free: Vec<usize> = (0..sample.columns.len())
        .filter(|i| !used.columns.contains(i) && !sample.is_text(*i) && sample.step(*i).is_none())
        .collect();
    let moving: Vec<usize> = free.iter().copied().filter(|&i| sample.varies(i)).collect();
    if moving.len() <= MOST && times.is_some() {
        let pairs = moving.iter().flat_map(|&a| moving.iter().map(move |&b| (a, b))).filter(|(a, b)| a != b);
        let followed = pairs.filter_map(|(a, b)| {
            let (a, b) = (Turning::of(sample, a), Turning::of(sample, b));
            // An angle is no rate, and two rates do not tell which is the gyro's.
            let fits = (a.said.is_none() || a.is_rate) && !b.is_rate;
            fits.then(|| agree(sample, &a, &b, times)).flatten().map(|agreed| (agreed, a, b))
        });
        if let Some((agreed, a, b)) = followed.max_by(|x, y| x.0.r2.total_cmp(&y.0.r2)) {
            let (reference, way) = agreed.signed(b.pick("ref_angle_z", sample, agreed.reference));
            let picks = vec![a.pick("gyro_z", sample, agreed.gyro), reference];
            let (rate, angle) = (sample.called(a.column), sample.called(b.column));
            let counts = agreed.unsure();
            return Some((picks, format!("{rate} is the rate at which {angle} turns{way}{counts}")));
        }
    }
    // Three beside each other are one sensor's axes; gravity tells an accelerometer's.
    let mut triples: Vec<usize> = (free.windows(3).enumerate())
        .filter(|(k, three)| k % 3 == 0 && three[2] == three[0] + 2)
        .map(|(_, three)| three[0])
        .collect();
    triples.retain(|&first| !is_gravity(sample, first));
    if let Some(&first) = triples.first() {
        let picks = (0..3).map(|k| sample.pick(&format!("gyro_{}", AXES[k]), first + k, 1.0)).collect();
        let says = format!("{} to {} may be the gyro's axes", sample.called(first), sample.called(first + 2));
        return Some((picks, says));
    }
    let [only] = moving.as_slice() else { return None };
    // Two sensors of a phone's attitude are no rate.
    Some((vec![sample.pick("gyro_z", *only, 1.0)], format!("{} may be the gyro", sample.called(*only))))
}

/// Whether three columns have the length of gravity most of the time, in whatever unit.
fn is_gravity(sample: &Sample, first: usize) -> bool {
    let lengths: Vec<f64> = (0..sample.rows())
        .map(|k| (0..3).map(|i| sample.columns[first + i][k].powi(2)).sum::<f64>().sqrt())
        .filter(|x| x.is_finite())
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
    let near = lengths.iter().filter(|x| (0.7..1.3).contains(&(*x / mean))).count();
    mean > 0.0 && 10 * near > 9 * lengths.len()
}

/// An unused column that turns as the rate of one of the gyros has it; with the gyros in their own unit, where it is not the one that
/// their names mean.
fn reference(
    sample: &Sample,
    used: &Used,
    gyros: &[(Axis, usize)],
    times: Option<&[f64]>,
) -> Option<(Vec<Pick>, String)> {
    let free = (0..sample.columns.len()).filter(|i| !used.columns.contains(i) && sample.varies(*i));
    let free: Vec<usize> = free.take(MOST).collect();
    let pairs = gyros.iter().flat_map(|gyro| free.iter().map(move |column| (gyro, *column)));
    pairs.into_iter().find_map(|(&(axis, gyro), column)| {
        let (own, other) = (Turning::of(sample, gyro), Turning::of(sample, column));
        let agreed = agree(sample, &own, &other, times)?;
        let base = if other.is_rate { "ref_rate" } else { "ref_angle" };
        let (pick, way) = agreed.signed(other.pick(&format!("{base}_{axis}"), sample, agreed.reference));
        let counts = agreed.unsure();
        let is_meant = sample.head.names[gyro] != format!("gyro_{axis}") || agreed.gyro.factor == 1.0;
        let mut picks = vec![pick];
        let mut unit = String::new();
        if !is_meant {
            let of_sensor = gyros.iter().filter(|(axis, column)| sample.head.names[*column] == format!("gyro_{axis}"));
            picks.extend(of_sensor.map(|(axis, column)| own.pick_as(&format!("gyro_{axis}"), *column, sample, agreed.gyro)));
            unit = format!(", if that is not in rad/s, as its name means, but in the unit of `{}`", picks[1].name);
        }
        let says = format!(
            "{} turns as gyro_{axis} does{way} (r² {:.3}){unit}: a reference, if something else than this gyro measured it{counts}",
            sample.called(column),
            agreed.r2,
        );
        Some((picks, says))
    })
}

/// Why a file is refused, and what to do about it. Rows that cannot be read come first, and what makes a log of the others with them.
pub fn of_file(path: &Path, options: &Options, error: LogError) -> (LogError, Option<Advice>) {
    let Some(advice) = proposed(path, options, &error) else { return (error, None) };
    let claims_nothing = advice.flags.is_empty() && !advice.at_rest;
    if claims_nothing {
        return (error, Some(advice));
    }
    if let Some(advice) = tried(path, options, advice.clone()) {
        return (error, Some(advice));
    }
    let Some(left_out) = in_the_way(path, options, &advice.flags) else { return (error, None) };
    let LeftOut { why, says, lines } = left_out;
    let others = Options { left_out: lines.clone(), ..options.clone() };
    let Some(advice) = tried(path, &others, advice).filter(|_| Input::open(path).is_ok_and(|of| of.is_as_stored()))
    else {
        return (why, None);
    };
    (why, Some(Advice { why: format!("{}; {says}", advice.why), left_out: lines, ..advice }))
}

/// Lines without which a file would be a log.
struct LeftOut {
    /// Why they are in the way, as a refusal.
    why: LogError,
    /// How many they are, and where.
    says: String,
    lines: Vec<RangeInclusive<u64>>,
}

/// What is in the way of these flags: rows that cannot be read, or the shorter one of two recordings.
fn in_the_way(path: &Path, options: &Options, flags: &[String]) -> Option<LeftOut> {
    let mut tried = Options { advises: false, needs_reference: false, reference: None, ..options.clone() };
    tried.map.extend(flags.iter().cloned());
    let mut reader = Reader::open(path, &tried).ok()?;
    reader.torn = Some(Torn::default());
    while reader.next_row().ok()?.is_some() {}
    let Torn { first, mut lines } = reader.torn.take()?;
    let count = lines.iter().map(|of| of.end() - of.start() + 1).sum::<u64>();
    // Of a file that is mostly torn nothing is sure.
    if 10 * count > reader.rows_read() {
        return None;
    }
    let mut says = match lines.first() {
        Some(first) if count == 1 => format!("one row cannot be read, at line {}: leave it out", first.start()),
        Some(first) => format!("{count} rows cannot be read, the first at line {}: leave them out", first.start()),
        None => String::new(),
    };
    let Some(line) = reader.starts_again() else {
        return first.map(|why| LeftOut { why, says, lines });
    };
    let header = reader.header_line().unwrap_or_default();
    let is_second_longer = 2 * line.saturating_sub(header) < reader.rows_read();
    let (shorter, which) =
        if is_second_longer { (header + 1..=line - 1, "first") } else { (line..=u64::MAX, "second") };
    lines.retain(|of| !shorter.contains(of.start()));
    lines.push(shorter);
    says = [says, format!("the {which} recording is shorter: leave it out")]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join("; ");
    let why = LogError::new(reader.log(), None, None, Problem::StartsAgain { line });
    Some(LeftOut { why: first.unwrap_or(why), says, lines })
}

/// What may make a log of a file that was refused; `None` where there is nothing to say.
fn proposed(path: &Path, options: &Options, error: &LogError) -> Option<Advice> {
    let is_known = matches!(
        error.problem,
        Problem::NoHeader { .. } | Problem::Missing { .. } | Problem::NoReference { .. } | Problem::Words { .. }
    );
    if !is_known || path == Path::new("-") || !options.advises {
        return None;
    }
    let input = Input::open(path).ok()?;
    let maps = Maps::load(options).ok()?;
    let is_text = input.is_text();
    let sample = if is_text { of_table(input)? } else { of_messages(input, &maps)? };
    let mut advice = advise(&sample, &maps, options.needs_reference && options.reference.is_none());
    // The time of messages is known.
    advice.flags.retain(|flag| is_text || !flag.starts_with("t="));
    (!advice.why.is_empty()).then_some(advice)
}

/// The advice as it was tried on the file; `None` where it makes no log of it.
fn tried(path: &Path, options: &Options, advice: Advice) -> Option<Advice> {
    if is_log(path, options, &advice.flags) {
        return Some(advice);
    }
    // A second file may need a name, too.
    if options.reference.is_some() {
        let mut tried = Options { advises: false, ..options.clone() };
        tried.map.extend(advice.flags.iter().cloned());
        let more = whole::read(path, &tried).err().and_then(|error| error.advice.clone())?;
        let advice = Advice {
            why: format!("{}; {}", advice.why, more.why),
            flags: advice.flags.into_iter().chain(more.flags).collect(),
            ..advice
        };
        return is_log(path, options, &advice.flags).then_some(advice);
    }
    // What is at rest needs no reference.
    if advice.at_rest {
        let rest = Options { needs_reference: false, ..options.clone() };
        return is_log(path, &rest, &advice.flags).then_some(advice);
    }
    // With them only the reference is missing still.
    let alone = Options { needs_reference: false, ..options.clone() };
    (options.needs_reference && is_log(path, &alone, &advice.flags)).then(|| Advice {
        why: format!("{}; no reference is in it: give the file that has one", advice.why),
        needs_file: true,
        ..advice
    })
}

/// What may be the reference among the frames of these lines, whose signals the maps' DBC file names.
#[must_use]
pub fn advise_frames(lines: &[u8], maps: &Maps) -> Option<Advice> {
    let input = Input::of(Box::new(Cursor::new(lines.to_vec())), false).ok()?;
    let mut advice = advise(&of_messages(input, maps)?, maps, true);
    // The time of messages is known.
    advice.flags.retain(|flag| !flag.starts_with("t="));
    (!advice.why.is_empty()).then_some(advice)
}

/// The first rows of a table.
fn of_table(input: Input) -> Option<Sample> {
    let mut table = Table::open(input, &|_| false).ok()?;
    let (head, dialect) = (table.head().clone(), table.dialect());
    if head.names.len() > WIDEST {
        return None;
    }
    let mut sample = Sample::of(&head, std::iter::empty());
    for _ in 0..LOOKED_AT {
        let Ok(Some(row)) = table.next_row() else { break };
        let fields: Vec<&[u8]> = row.fields().collect();
        sample.take(dialect, &fields);
    }
    Some(sample)
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

fn of_messages(mut input: Input, maps: &Maps) -> Option<Sample> {
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
    Some(Sample { head, columns, texts: vec![None; count], moments: vec![false; count] })
}

/// Whether a file is text with a table.
pub fn is_text(path: &Path) -> bool {
    path != Path::new("-") && Input::open(path).is_ok_and(|input| input.is_text())
}

/// Whether a file is a gyro's log with these flags.
pub fn is_log(path: &Path, options: &Options, flags: &[String]) -> bool {
    let mut tried = Options { advises: false, ..options.clone() };
    tried.map.extend(flags.iter().cloned());
    let is_large = files::size(path).map_or(true, |size| size > LARGE);
    let rows: Vec<Row> = if is_large {
        let Ok(reader) = Reader::open(path, &tried) else { return false };
        reader.map_while(Result::ok).take(LOOKED_AT).collect()
    } else {
        let Ok((record, _, provenance)) = whole::read(path, &tried) else { return false };
        let year_2100 = 4_102_444_800_i128 * 1_000_000_000;
        if provenance.start_ns > year_2100 {
            return false;
        }
        record.rows
    };
    let times: Vec<i64> =
        (rows.iter()).filter(|row| row.gyro.iter().any(|x| x.is_finite())).map(|row| row.t_ns).collect();
    let mut steps: Vec<i64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.len() < FEWEST {
        return false;
    }
    let middle = steps.len() / 2;
    let step = *steps.select_nth_unstable(middle).1 as f64 / 1e9;
    (FASTEST * 0.5..2.0).contains(&step)
}
