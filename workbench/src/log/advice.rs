//! What to do about a text that lacks something: what its columns hold by their numbers, and the maps that make a log of it. A map is
//! tried on the file before anybody is told of it.

use super::{
    Maps, Options,
    error::{LogError, Problem},
    input::Input,
    lacking::Advice,
    names::Names,
    unit::{self, Channel, Name},
    unsaid::{self, Unit},
    whole, words,
};
use crate::{files, toml_error::quoted};
use gyro_model::{Axis, Record, Row, units};
use log_readers::{
    meaning::{AXES, Pick, Proposal, stated_rate},
    text::{self, Dialect, Head, Table},
};
use std::path::Path;

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
    let step = match flags.first() {
        Some(pick) => column_of(pick).map(|column| (column, pick.factor * scale_of(&pick.name))),
        None => known_time(sample, &names),
    };
    let tags: Vec<&str> = sample.texts.iter().flatten().map(String::as_str).collect();
    let angles = tags.iter().any(|tag| ["ypr", "rpy", "euler"].iter().any(|word| tag.to_lowercase().contains(word)));
    if used.gyros.is_empty() {
        let found = if angles { None } else { gyro(sample, &used, &proposal, step) };
        match found {
            Some((picks, says)) => {
                let gyros = gyros_of(&picks, sample);
                let has_reference = picks.iter().any(|pick| pick.name.starts_with("ref_"));
                flags.extend(picks);
                holds.push(says);
                used.columns.extend(gyros.iter().map(|(_, column)| *column));
                let found =
                    if wants_reference && !has_reference { reference(sample, &used, &gyros, step) } else { None };
                if let Some((pick, says)) = found {
                    flags.push(pick);
                    holds.push(says);
                }
            }
            None => lacks.push("rate of a gyro"),
        }
    } else if wants_reference && !used.references {
        let found = reference(sample, &used, &used.gyros, step);
        let offered: Vec<Pick> =
            proposal.offered.iter().filter(|pick| pick.name.starts_with("ref_")).cloned().collect();
        match (found, offered.first()) {
            (Some((pick, says)), _) => {
                flags.push(pick);
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
        let but = if angles { ", only angles," } else { "" };
        let neither = match lacks.as_slice() {
            [one] => format!("no {one} is in it"),
            _ => format!("neither a time nor the rate of a gyro{but} is in it"),
        };
        let time = if lacks.contains(&"time") { " (no column only grows)" } else { "" };
        let end = if why.is_empty() { "" } else { "; " };
        why = format!(
            "{why}{end}{neither}{time}: print both in each row, such as t_ms,gyro_x,gyro_y,gyro_z and a reference"
        );
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
        let nothing = "nothing else in it turns as the gyro has it";
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
        return Advice { why, flags, needs_file: still.is_none(), at_rest: still.is_some() };
    }
    Advice { why, flags: flags.iter().map(ToString::to_string).collect(), ..Advice::default() }
}

/// The column that is the time already, and its scale to seconds.
fn known_time(sample: &Sample, names: &Names) -> Option<(usize, f64)> {
    (0..sample.columns.len()).find_map(|column| {
        let Name::Known(Channel::Time, own) = unit::name(&names.renamed[column]) else { return None };
        let scale = names.conversion(column, Channel::Time, own, &sample.head).scale;
        Some((column, if sample.moments[column] { 1.0 } else { scale }))
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
fn record(sample: &Sample, rate: usize, angle: usize, time: Option<(usize, f64)>) -> Record {
    let at = |k: usize| {
        time.map_or(k as f64 * USUAL, |(column, scale)| {
            // Differences of a large count are exact, its product with a unit is not.
            (sample.columns[column][k] - sample.columns[column][0]) * scale
        })
    };
    let rows = (0..sample.rows()).map(|k| {
        let mut row = Row { t_ns: (at(k) * 1e9) as i64, ..Row::EMPTY };
        (row.gyro[2], row.ref_angle[2]) = (sample.columns[rate][k], sample.columns[angle][k]);
        row
    });
    Record { rows: rows.collect(), ..Record::default() }
}

/// Columns that may be a gyro's, and its reference where one of the others is the integral of one.
fn gyro(sample: &Sample, used: &Used, proposal: &Proposal, time: Option<(usize, f64)>) -> Option<(Vec<Pick>, String)> {
    let offered: Vec<Pick> = proposal.offered.iter().filter(|pick| pick.name.starts_with("gyro_")).cloned().collect();
    if !offered.is_empty() {
        let says = offered.iter().map(|pick| quoted(&pick.channel)).collect::<Vec<_>>().join(", ");
        return Some((offered, format!("{says} may be the gyro's axes")));
    }
    let free: Vec<usize> = (0..sample.columns.len())
        .filter(|i| !used.columns.contains(i) && sample.texts[*i].is_none() && sample.step(*i).is_none())
        .collect();
    let moving: Vec<usize> = free.iter().copied().filter(|&i| sample.varies(i)).collect();
    if moving.len() <= MOST && time.is_some() {
        let pairs = moving.iter().flat_map(|&a| moving.iter().map(move |&b| (a, b))).filter(|(a, b)| a != b);
        let followed = pairs.filter_map(|(a, b)| {
            let record = record(sample, a, b, time);
            let (gyro, reference) = unsaid::told(&record, Axis::Z, true, true, false)?;
            let r2 = unsaid::follows(&record, reference)?;
            (r2 > FOLLOWS).then_some((r2, a, b, gyro, reference))
        });
        if let Some((_, a, b, gyro, reference)) = followed.max_by(|x, y| x.0.total_cmp(&y.0)) {
            let picks = vec![named("gyro_z", sample, a, gyro), named("ref_angle_z", sample, b, reference)];
            let says =
                format!("{} is the rate at which {} turns{}", sample.called(a), sample.called(b), counts(reference));
            return Some((picks, says));
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

fn named(base: &str, sample: &Sample, column: usize, unit: Unit) -> Pick {
    sample.pick(&format!("{base}{}", unit.suffix), column, unit.divisor)
}

/// Which counts per turn were taken for an angle, and which fit as well.
fn counts(reference: Unit) -> String {
    let Some((own, others)) = reference.counts_per_turn() else { return String::new() };
    let shown = |counts: &f64| units::thousands(*counts as u64);
    match others.iter().map(shown).collect::<Vec<_>>().join(" and ") {
        none if none.is_empty() => format!("; {} counts a turn fit", shown(&own)),
        others => format!(
            "; {} counts a turn are taken, {others} fit as well: take what the encoder's data sheet says, for the scale factor \
             depends on it",
            shown(&own)
        ),
    }
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

/// An unused column that turns as the rate of one of the gyros has it.
fn reference(
    sample: &Sample,
    used: &Used,
    gyros: &[(Axis, usize)],
    time: Option<(usize, f64)>,
) -> Option<(Pick, String)> {
    let free = (0..sample.columns.len()).filter(|i| !used.columns.contains(i) && sample.varies(*i));
    let free: Vec<usize> = free.take(MOST).collect();
    let pairs = gyros.iter().flat_map(|gyro| free.iter().map(move |column| (gyro, *column)));
    pairs.into_iter().find_map(|(&(axis, gyro), column)| {
        let record = record(sample, gyro, column, time);
        let (_, reference) = unsaid::told(&record, Axis::Z, true, true, false)?;
        let r2 = unsaid::follows(&record, reference).filter(|r2| *r2 > FOLLOWS)?;
        let pick = named(&format!("ref_angle_{axis}"), sample, column, reference);
        let says = format!(
            "{} turns as gyro_{axis} has it (r² {r2:.3}): a reference, if something else than this gyro measured it{}",
            sample.called(column),
            counts(reference)
        );
        Some((pick, says))
    })
}

/// What to do about a file that was refused; `None` where there is nothing to say.
pub fn of_file(path: &Path, options: &Options, error: &LogError) -> Option<Advice> {
    let is_known = matches!(
        error.problem,
        Problem::NoHeader { .. } | Problem::Missing { .. } | Problem::NoReference { .. } | Problem::Words { .. }
    );
    if !is_known || path == Path::new("-") || !options.advises {
        return None;
    }
    let input = Input::open(path).ok().filter(Input::is_text)?;
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
    let maps = Maps::load(options).ok()?;
    let wants = options.needs_reference && options.reference.is_none();
    let advice = advise(&sample, &maps, wants);
    if advice.why.is_empty() {
        return None;
    }
    let claims_nothing = advice.flags.is_empty() && !advice.at_rest;
    if claims_nothing || is_log(path, options, &advice.flags) {
        return Some(advice);
    }
    // What is at rest needs no reference.
    if advice.at_rest {
        let rest = Options { needs_reference: false, ..options.clone() };
        return is_log(path, &rest, &advice.flags).then_some(advice);
    }
    // With them only the reference is missing still.
    let alone = Options { needs_reference: false, ..options.clone() };
    (wants && is_log(path, &alone, &advice.flags)).then(|| Advice {
        why: format!("{}; no reference is in it: give the file that has one", advice.why),
        needs_file: true,
        ..advice
    })
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
        let Ok(reader) = super::Reader::open(path, &tried) else { return false };
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
