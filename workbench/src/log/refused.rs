//! What to do about a file that was refused. What is advised was tried on the file before anybody is told of it.

use super::{
    Maps, Options, Reader,
    advice::{advise, is_of_time, motionless},
    attitude,
    error::{LogError, Problem, listed},
    input::Input,
    lacking::Advice,
    made_time::{self, FASTEST},
    reader::Torn,
    sample::{FEWEST, LOOKED_AT, Sample},
    whole,
};
use crate::files;
use gyro_model::{Axis, Row};
use std::{ops::RangeInclusive, path::Path};

/// A file of more bytes is tried by its first rows alone.
const LARGE: u64 = 64 << 20;

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
        Problem::NoHeader { .. }
            | Problem::Missing { .. }
            | Problem::NoReference { .. }
            | Problem::Words { .. }
            | Problem::TimeRange(_)
    );
    if !is_known || path == Path::new("-") || !options.advises {
        return None;
    }
    let input = Input::open(path).ok()?;
    let mut maps = Maps::load(options).ok()?;
    let is_text = input.is_text();
    let sample = if is_text { Sample::of_table(input)? } else { Sample::of_messages(input, &maps)? };
    let still = motionless(&sample, &maps);
    maps.without_numbers.clone_from(&still);
    let mut advice = advise(&sample, &maps, options.needs_reference && options.reference.is_none());
    // The time of messages is known.
    advice.flags.retain(|flag| is_text || !is_of_time(flag));
    if !still.is_empty() {
        let (shows, it) = if still.len() == 1 { ("shows", "it") } else { ("show", "they") };
        let more = if advice.why.is_empty() { String::new() } else { format!("; {}", advice.why) };
        advice.why =
            format!("{} {shows} no motion while the gyro turns: {it} cannot be a reference{more}", listed(&still));
    }
    (!advice.why.is_empty()).then_some(advice)
}

/// The advice as it was tried on the file; `None` where it makes no log of it.
fn tried(path: &Path, options: &Options, advice: Advice) -> Option<Advice> {
    if is_log(path, options, &advice.flags) {
        return Some(advice);
    }
    // A second file may need a name, too.
    if options.reference.is_some() {
        return [advice.clone(), in_degrees(advice)].into_iter().find_map(|advice| {
            let mut tried = Options { advises: false, ..options.clone() };
            tried.map.extend(advice.flags.iter().cloned());
            let more = whole::read(path, &tried).err().and_then(|error| error.advice.clone())?;
            let advice = Advice {
                why: format!("{}; {}", advice.why, more.why),
                flags: advice.flags.into_iter().chain(more.flags).collect(),
                ..advice
            };
            is_log(path, options, &advice.flags).then_some(advice)
        });
    }
    // What is at rest needs no reference.
    if advice.at_rest {
        let rest = Options { needs_reference: false, ..options.clone() };
        return is_log(path, &rest, &advice.flags).then_some(advice);
    }
    // With them only the reference is missing still.
    let alone = Options { needs_reference: false, ..options.clone() };
    (options.needs_reference && is_log(path, &alone, &advice.flags)).then(|| Advice {
        why: format!("{}; no reference is in it: give the file that has one in place of REFERENCE.csv", advice.why),
        needs_file: true,
        ..advice
    })
}

/// The same with the gyro in °/s where nobody says its unit: without a reference beside it the rows don't say it either.
fn in_degrees(advice: Advice) -> Advice {
    let flags = advice.flags.into_iter().map(|flag| {
        let bare =
            flag.split_once('=').filter(|(name, _)| Axis::ALL.iter().any(|axis| *name == format!("gyro_{axis}")));
        bare.map(|(name, channel)| format!("{name}_dps={channel}")).unwrap_or(flag)
    });
    Advice { flags: flags.collect(), ..advice }
}

/// What makes a reference of a second file that was refused: its time, and an orientation or an angle in it.
pub fn of_second(path: &Path, options: &Options, error: &LogError) -> Option<Advice> {
    let second = options.reference.as_ref().filter(|second| error.log == second.display().to_string())?;
    let is_known =
        matches!(error.problem, Problem::NoHeader { .. } | Problem::Missing { .. } | Problem::NoReferenceIn { .. });
    if !is_known || !options.advises || path == Path::new("-") {
        return None;
    }
    let sample = Sample::of_table(Input::open(second).ok().filter(Input::is_text)?)?;
    let is_timed = matches!(error.problem, Problem::NoReferenceIn { .. });
    let time = made_time::time(&sample, &[]).filter(|_| !is_timed);
    let used: Vec<usize> = time.iter().filter_map(|time| time.column).collect();
    let flags: Vec<String> = time.iter().map(|time| format!("ref:{}", time.pick)).collect();
    let with = |more: &[String]| {
        let map = options.map.iter().chain(&flags).chain(more).cloned().collect();
        Options { map, advises: false, ..options.clone() }
    };
    let says = |more: &str| time.iter().map(|time| time.says.as_str()).chain([more]).collect::<Vec<_>>().join("; ");
    let readings = attitude::readings(&sample, &used).into_iter().filter_map(|reading| {
        let picks: Vec<String> = reading.picks.iter().map(ToString::to_string).collect();
        let (record, ..) = whole::read(path, &with(&picks)).ok()?;
        attitude::held(&record, &record.fitted_axes()).map(|held| (held, picks, reading.says))
    });
    if let Some((held, picks, of)) = readings.max_by(|a, b| a.0.sum.total_cmp(&b.0.sum)) {
        let why = says(&format!("{of} turns as gyro_{} does (r² {:.3})", held.axis, held.r2));
        return Some(Advice { why, flags: flags.iter().cloned().chain(picks).collect(), ..Advice::default() });
    }
    // With its time known the file may tell more.
    let more = time.as_ref().and_then(|_| whole::read(path, &with(&[])).err()?.advice.clone())?;
    Some(Advice { why: says(&more.why), flags: flags.iter().cloned().chain(more.flags).collect(), ..Advice::default() })
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
