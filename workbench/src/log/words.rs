//! Raw words of a gyro that nobody says the unit of, where no reference tells it either: the usual sensitivities are proposed.

use super::{header::Layout, lacking::Advice, unit::Channel};
use crate::toml_error::quoted;
use gyro_model::{Axis, Record};
use log_readers::meaning::Pick;
use std::collections::BTreeSet;

/// Numbers that are looked at, at least, and different ones among them.
const FEWEST: usize = 20;
const DIFFERENT: usize = 3;
/// A word of 16 bits, and where its negative half begins when it is printed without its sign.
const WORD: f64 = 65_536.0;
const NEGATIVE: f64 = 32_768.0;
/// Steps for one °/s of the range that most drivers set first: ±250 °/s in a word of 16 bits.
const FIRST: f64 = 131.0;
/// What a sensor at rest may read from its lowest to its highest, °/s.
pub(super) const RESTS: f64 = 10.0;

/// How many steps are one °/s on the usual sensors.
const USUAL: &str = "131 steps are one °/s in the range of ±250 °/s of an MPU or ICM (65.5, 32.8 and 16.4 in those of ±500, ±1000 and ±2000), 114.3 in that \
                     of ±245 of an L3G or LSM (57.1, 28.6 and 14.3), 131.1 in that of ±250 of a BMI (262.1, 65.5, 32.8 and 16.4): the driver says the range";

/// Whether numbers are words: whole, and different.
fn are_words(numbers: impl Iterator<Item = f64>) -> bool {
    let mut different = BTreeSet::new();
    let mut count = 0;
    for number in numbers {
        if number.fract() != 0.0 || number.abs() >= WORD {
            return false;
        }
        count += 1;
        if different.len() < DIFFERENT {
            different.insert(number as i64);
        }
    }
    count >= FEWEST && different.len() >= DIFFERENT
}

/// A column of a text that may be a gyro's.
pub(super) struct Column {
    /// The axis.
    pub axis: Axis,
    /// Its numbers.
    pub numbers: Vec<f64>,
    /// As a map names it.
    pub channel: String,
    /// As people are told of it.
    pub called: String,
}

impl Column {
    fn is_unsigned(&self) -> bool {
        self.numbers.iter().all(|x| *x >= 0.0) && self.numbers.iter().any(|x| *x >= NEGATIVE)
    }

    /// Whether it stays within what a sensor at rest reads.
    fn rests(&self) -> bool {
        let unsigned = self.is_unsigned();
        let signed = self.numbers.iter().map(|&x| if unsigned && x >= NEGATIVE { x - WORD } else { x });
        let (low, high) = signed.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (high - low) / FIRST < RESTS
    }
}

/// The maps that make rates of these columns, and what they rest on; `None` where they are no words.
pub(super) fn advise(columns: &[Column]) -> Option<Advice> {
    if columns.is_empty() || !columns.iter().all(|column| are_words(column.numbers.iter().copied())) {
        return None;
    }
    let at_rest = columns.iter().all(Column::rests);
    let flag = |column: &Column| {
        let pick =
            Pick { factor: FIRST.recip(), ..Pick::new(&format!("gyro_{}_dps", column.axis), &column.channel, None) };
        // Where every word is a negative one, its sign is put back; where only some are, the reader does it.
        let all = column.is_unsigned() && column.numbers.iter().all(|x| *x >= NEGATIVE);
        if all { format!("{pick}-{}", WORD / FIRST) } else { pick.to_string() }
    };
    let names: Vec<&str> = columns.iter().map(|column| column.called.as_str()).collect();
    let unsigned = if columns.iter().any(Column::is_unsigned) {
        " They are printed without their sign: 65535 is −1."
    } else {
        ""
    };
    let next = if at_rest {
        "the sensor was at rest, which needs no reference"
    } else {
        "it moved: a reference of the same motion is needed besides"
    };
    Some(Advice {
        why: format!("{} are raw words of a gyro: {USUAL}.{unsigned} By their numbers {next}", names.join(", ")),
        flags: columns.iter().map(flag).collect(),
        needs_file: !at_rest,
        at_rest,
        ..Advice::default()
    })
}

/// The gyro's columns of a log without a reference, where they are words in no unit.
pub(super) fn of(record: &Record, layout: &Layout) -> Option<String> {
    let has_reference = |axis: Axis| {
        record.rows.iter().any(|row| {
            row.ref_angle[axis.index()].is_finite()
                || row.ref_rate[axis.index()].is_finite()
                || row.ref_quaternion[0].is_finite()
        })
    };
    let axes = layout.gyros();
    let words = |axis: &Axis| {
        let readings = record.rows.iter().map(|row| row.gyro[axis.index()]);
        !has_reference(*axis) && are_words(readings.filter(|x| x.is_finite()))
    };
    if axes.is_empty() || !axes.iter().all(words) {
        return None;
    }
    let name = |axis: &Axis| {
        let column = layout.columns.iter().find(|column| column.channel == Channel::Gyro(*axis));
        column.map_or_else(|| format!("gyro_{axis}"), |column| column.name.clone())
    };
    let channel =
        |name: String| layout.chosen.iter().find(|pick| pick.name == name).map_or(name, |pick| pick.channel.clone());
    Some(axes.iter().map(name).map(channel).map(|name| quoted(&name)).collect::<Vec<_>>().join(", "))
}
