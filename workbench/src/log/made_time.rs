//! The time of a text: the column that is one, in its unit, or what one is made of.

use super::{
    map::ROW_NUMBER,
    names::{Names, seconds, time_form},
    sample::{FEWEST, Sample},
    unit::{self, Channel, Conversion, Name},
};
use gyro_model::units;
use log_readers::{
    meaning::{Pick, stated_rate, unit_said},
    text::Form,
    unit::Quantity,
};

/// The step of a gyro's log, s: at most, at least, and the usual one.
const SLOWEST: f64 = 0.13;
pub(super) const FASTEST: f64 = 1e-4;
pub(super) const USUAL: f64 = 0.01;
/// From row to row in a gyro's log whose time is `t` in seconds, at most, s.
const ABSURD: f64 = 1.5;

/// The times of the rows by the column that is the time already, s from the first.
pub(super) fn known(sample: &Sample, names: &Names) -> Option<Vec<f64>> {
    (0..sample.columns.len()).find_map(|column| {
        let Name::Known(Channel::Time, own) = unit::name(&names.renamed[column]) else { return None };
        let conversion = names.conversion(column, Channel::Time, own, &sample.head);
        let seconds = match time_form(&sample.head, column, conversion) {
            Form::Number(exponent) => sample.since_first(column, conversion.scale * 10_f64.powi(exponent - 9)),
            Form::Parts(fine, exponent) => {
                let whole = sample.since_first(column, 1.0);
                whole
                    .iter()
                    .zip(&sample.columns[fine])
                    .map(|(whole, rest)| whole + rest * 10_f64.powi(exponent - 9))
                    .collect()
            }
            Form::Digits => {
                let seconds = |hhmmss: f64| {
                    let (hours, minutes) = ((hhmmss / 1e4).floor(), (hhmmss / 100.0).floor() % 100.0);
                    3600.0 * hours + 60.0 * minutes + hhmmss % 100.0
                };
                sample.columns[column].iter().map(|&hhmmss| seconds(hhmmss)).collect()
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

/// A column `t` whose steps are none of seconds: the format means seconds by it, other programs ms or µs.
pub(super) fn absurd(sample: &Sample, names: &Names) -> Option<usize> {
    let column = (0..sample.columns.len()).find(|&i| {
        let Name::Known(Channel::Time, own) = unit::name(&names.renamed[i]) else { return false };
        let is_bare = names.renamed[i] == sample.head.names[i] && !names.displaced[i];
        is_bare && names.conversion(i, Channel::Time, own, &sample.head) == Conversion::NONE
    })?;
    sample.step(column).filter(|step| *step > ABSURD && !sample.moments[column]).map(|_| column)
}

/// A time that is made of what is there.
pub(super) struct Made {
    pub pick: Pick,
    pub column: Option<usize>,
    pub says: String,
    /// Of the rows.
    pub seconds: Vec<f64>,
    /// Whether its rate is an example.
    pub is_example: bool,
}

impl Made {
    /// Of a column that is one in the unit of the pick.
    fn of(sample: &Sample, column: usize, pick: Pick, says: String) -> Self {
        let seconds = sample.since_first(column, pick.factor * seconds(&pick.name).unwrap_or(1.0));
        Self { pick, column: Some(column), says, seconds, is_example: false }
    }
}

/// Names of a time's steps.
const STEP_NAMES: [&str; 10] =
    ["dt", "deltat", "deltatime", "timedelta", "dtime", "timestep", "timediff", "interval", "period", "looptime"];

/// A column that holds the time from row to row, by its name and its numbers.
pub(super) fn steps(sample: &Sample, used: &[usize]) -> Option<Made> {
    sample.head.line?;
    let mut free = (0..sample.columns.len()).filter(|i| !used.contains(i));
    free.find_map(|column| {
        let header = &sample.head.names[column];
        let said = unit_said(header, sample.head.units[column]).filter(|unit| unit.quantity == Quantity::Time);
        let plain: String = header.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
        let ending = said.map_or("", |unit| unit.symbol);
        let is_named = STEP_NAMES.contains(&plain.as_str())
            || plain.strip_suffix(ending).is_some_and(|plain| STEP_NAMES.contains(&plain));
        let mut values: Vec<f64> = sample.columns[column].iter().copied().filter(|x| x.is_finite()).collect();
        if !is_named || values.len() < FEWEST || values.iter().any(|x| *x < 0.0) {
            return None;
        }
        let middle = values.len() / 2;
        let usual = *values.select_nth_unstable_by(middle, f64::total_cmp).1;
        let of = |name: &&str| usual * seconds(name).unwrap_or(1.0);
        let off = |name: &&str| (of(name) / USUAL).ln().abs();
        let likely = ["t", "t_ms", "t_us", "t_ns"].into_iter().filter(|name| (FASTEST..SLOWEST).contains(&of(name)));
        let name = match said {
            Some(unit) => format!("t{}", unit.suffix),
            None => likely.min_by(|a, b| off(a).total_cmp(&off(b)))?.to_owned(),
        };
        let factor = said.map_or(1.0, |unit| unit.factor);
        let unit = factor * seconds(&name)?;
        let times = sample.columns[column].iter().scan(0.0, |sum, step| {
            *sum += if step.is_finite() { step * unit } else { 0.0 };
            Some(*sum)
        });
        let called = sample.called(column);
        Some(Made {
            pick: Pick { factor, ..Pick::new(&name, &format!("sum({header})"), None) },
            column: Some(column),
            says: format!("{called} is the time from row to row, {} for the most part", duration(usual * unit)),
            seconds: times.collect(),
            is_example: false,
        })
    })
}

/// Whether a column that grows by so much counts the rows.
fn counts(sample: &Sample, column: usize, step: f64) -> bool {
    step == 1.0
        && sample.columns[column].windows(2).filter(|pair| pair[1] - pair[0] == 1.0).count() * 10 > sample.rows() * 9
}

/// The time by the rows' numbers, where no column is one: `step`, s, from row to row is an example.
pub(super) fn counted(sample: &Sample, used: &[usize], step: f64) -> Made {
    let mut free = (0..sample.columns.len()).filter(|i| !used.contains(i));
    let counter = free.find(|&i| sample.step(i).is_some_and(|step| counts(sample, i, step)));
    let stated = stated_rate(&sample.head);
    let step = stated.map_or(step, f64::recip);
    let channel = counter.map_or_else(|| ROW_NUMBER.to_owned(), |column| sample.channel(column));
    let seconds = match counter {
        Some(column) => sample.since_first(column, step),
        None => (0..sample.rows()).map(|k| k as f64 * step).collect(),
    };
    let says = match (stated, counter) {
        (Some(rate), Some(column)) => {
            format!("{} counts rows, {rate} of them a second as the text above says", sample.called(column))
        }
        (Some(rate), None) => format!("no time is in it, but {rate} rows a second, as the text above says"),
        (None, counter) => {
            let has = counter.map_or_else(
                || "`row` is the number of the row".to_owned(),
                |column| format!("{} counts rows", sample.called(column)),
            );
            format!(
                "no time is in it ({has}): {step} s from row to row, {} rows a second, is an example. Put the step of your program in \
                 its place, for rates and scale factor depend on it",
                units::round(step.recip())
            )
        }
    };
    let pick = Pick { factor: step, ..Pick::new("t", &channel, None) };
    Made { pick, column: counter, says, seconds, is_example: stated.is_none() }
}

/// Counters of a sensor's own ticks, by their names, and the tick, s. Source: the data sheets of Bosch's BMI160, BMI270 and BMI323,
/// SENSORTIME.
const TICKS: [(&str, f64); 1] = [("sensortime", 39.0625e-6)];

/// A column that counts the ticks of a sensor.
fn ticks(sample: &Sample, growing: &[(usize, f64)]) -> Option<Made> {
    let plain = |column: usize| -> String {
        sample.head.names[column].to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect()
    };
    growing.iter().find_map(|&(column, step)| {
        let &(_, tick) = TICKS.iter().find(|(name, _)| plain(column).ends_with(name))?;
        let is_counter = sample.columns[column].iter().all(|x| x.fract() == 0.0);
        let seconds = step * tick;
        if !is_counter || !(FASTEST..SLOWEST).contains(&seconds) {
            return None;
        }
        let called = sample.called(column);
        let says = format!("{called} counts ticks of {} µs: a row every {}", tick * 1e6, duration(seconds));
        Some(Made::of(sample, column, sample.pick("t_us", column, (tick * 1e6).recip()), says))
    })
}

/// The column that is a time, in the unit that makes a gyro's log of it.
pub(super) fn time(sample: &Sample, used: &[usize]) -> Option<Made> {
    let free = (0..sample.columns.len()).filter(|i| !used.contains(i));
    let growing: Vec<(usize, f64)> = free.filter_map(|i| sample.step(i).map(|step| (i, step))).collect();
    if let Some(made) = ticks(sample, &growing) {
        return Some(made);
    }
    let mut best: Option<(f64, usize, &str, f64)> = None;
    for &(column, step) in growing.iter().filter(|(column, step)| !counts(sample, *column, *step)) {
        for name in ["t", "t_ms", "t_us", "t_ns"] {
            let unit = seconds(name).unwrap_or(1.0);
            let seconds = step * unit;
            let now = sample.columns[column].first().copied().unwrap_or_default() * unit;
            let is_epoch = (9e8..4.2e9).contains(&now);
            let cost = (seconds / USUAL).ln().abs() - if is_epoch { 10.0 } else { 0.0 };
            if (FASTEST..SLOWEST).contains(&seconds) && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, column, name, seconds));
            }
        }
    }
    let (_, column, name, seconds) = best?;
    let says = format!("{} only grows: a time, a row every {}", sample.called(column), duration(seconds));
    Some(Made::of(sample, column, sample.pick(name, column, 1.0), says))
}

fn duration(seconds: f64) -> String {
    if seconds < 1e-3 { format!("{:.3} ms", seconds * 1e3) } else { format!("{:.4} ms", seconds * 1e3) }
        .replace(".0000 ", " ")
        .replace(".000 ", " ")
}
