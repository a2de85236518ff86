//! Units that neither a name nor the file says: a unit is taken where gyro and reference agree in it.

use super::{
    gravity::Gravity,
    header::{Column, Layout},
    pending::Pending,
    row::place,
    unit::Channel,
};
use gyro_model::{Axis, Record, Row, faults, units};
use log_readers::{meaning::Pick, unit::STANDARD_GRAVITY};
use std::f64::consts::{PI, TAU};

/// Rows that are looked at, and at least.
pub const LOOKED_AT: usize = 100_000;
const FEWEST: usize = 100;
/// How much of the reference's motion the gyro has to show, as r².
const FOLLOWS: f64 = 0.8;
/// A low-cost gyro's scale factor is within this of 1; neighbouring sensitivities lie nearer than that, the nearest one is meant.
const SCALE: f64 = 0.2;
const NEAREST: f64 = 0.06;
/// Pairs of counts that are told of beside the likeliest, and how much less likely they may be.
const MOST_OTHERS: usize = 4;
const ALIKE: f64 = 0.04;
const ROUNDED: f64 = 2e-3;
/// Faster than a low-cost gyro reads, rad/s, and what hands and vehicles seldom reach.
const FASTEST: f64 = 70.0;
const FAST: f64 = 12.0;
/// Raw counts of a turning gyro go further than this.
const COUNTS: f64 = 300.0;

/// Steps of a gyro's word for one °/s: those of the ranges of ±250 to ±2000 °/s (MPU, ICM), of 8.75 to 70 m°/s a step (L3G, LSM), the whole
/// word over the range (BMI), and decimal and binary fractions.
const SENSITIVITIES: [f64; 16] = [
    131.0, 65.5, 32.8, 16.4, 114.286, 57.143, 28.571, 14.286, 262.144, 131.072, 65.536, 32.768, 16.384, 16.0, 10.0,
    100.0,
];
/// Counts of an encoder for one turn.
const COUNTS_PER_TURN: [f64; 20] = [
    4096.0, 1024.0, 2048.0, 8192.0, 16_384.0, 32_768.0, 65_536.0, 512.0, 4000.0, 1000.0, 2000.0, 8000.0, 10_000.0,
    20_000.0, 1440.0, 2400.0, 1200.0, 1600.0, 3600.0, 800.0,
];
/// How many of the first sensitivities are those of an MPU.
const OF_MPU: usize = 4;

/// What a number of one channel is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// In SI units.
    pub factor: f64,
    /// The name's suffix.
    pub suffix: &'static str,
    /// The channel's numbers for one of that.
    pub divisor: f64,
}

impl Unit {
    /// Nothing to convert.
    pub const SI: Self = Self { factor: 1.0, suffix: "", divisor: 1.0 };

    /// Of an accelerometer that shows so many for one g.
    fn gravity(steps: f64) -> Self {
        let (suffix, divisor) = if steps == 1000.0 { ("_mg", 1.0) } else { ("_g", steps) };
        Self { factor: STANDARD_GRAVITY / steps, suffix, divisor }
    }

    fn degrees(suffix: &'static str, divisor: f64) -> Self {
        Self { factor: PI / 180.0 / divisor, suffix, divisor }
    }

    /// A reference in turns.
    const TURNS: Self = Self { factor: TAU, suffix: "_deg", divisor: 1.0 / 360.0 };

    /// Whether it is so many numbers for one °/s or one degree.
    pub fn is_counts(self) -> bool {
        self.divisor > 1.0
    }

    /// How many counts of an encoder are one turn; `None` where it is no count.
    fn counts_per_turn(self) -> Option<f64> {
        (self.suffix == "_deg" && self.is_counts()).then_some((360.0 * self.divisor).round())
    }

    /// How many steps of a gyro's word are one °/s; `None` where it is no word.
    fn steps(self) -> Option<f64> {
        (self.suffix == "_dps" && SENSITIVITIES.contains(&self.divisor)).then_some(self.divisor)
    }
}

/// The units in which a gyro and its reference agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// That of the gyro.
    pub gyro: Unit,
    /// That of the reference.
    pub reference: Unit,
    /// Others that agree as well, the likeliest first.
    pub others: Vec<(Unit, Unit)>,
    /// Whether an encoder's whole numbers are taken as degrees.
    pub whole_degrees: bool,
}

/// What is to be told of a gyro and its reference, and what is known of them beside their numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Open {
    /// Whether nobody says the gyro's unit.
    pub gyro: bool,
    /// What nobody says the unit of that is the reference.
    pub reference: Unsaid,
    /// Whether the gyro is an MPU, by its names or by what its accelerometer shows.
    pub mpu: bool,
}

/// A reference in a unit that nobody says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Unsaid {
    /// Its unit is said, or it has none.
    #[default]
    Nothing,
    /// An angle.
    Angle,
    /// One that is called a count of an encoder.
    Counts,
    /// A rate.
    Rate,
}

impl Unsaid {
    /// Of the column with this name.
    pub fn of(name: &str, is_rate: bool) -> Self {
        match is_rate {
            true => Self::Rate,
            false if is_called_counts(name) => Self::Counts,
            false => Self::Angle,
        }
    }

    fn is_angle(self) -> bool {
        matches!(self, Self::Angle | Self::Counts)
    }
}

/// Whether a column is called a count of an encoder.
fn is_called_counts(name: &str) -> bool {
    let plain = name.to_lowercase();
    ["enc", "count", "cnt", "tick", "pulse", "steps"].iter().any(|word| plain.contains(word))
}

/// Whether a gyro's column is called as libraries of the MPU call its raw words.
pub fn is_called_mpu(name: &str) -> bool {
    let plain: String = name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    ["gyx", "gyy", "gyz"].contains(&plain.as_str()) || plain.contains("mpu") || plain.contains("raw")
}

impl Told {
    /// What is not sure of counts, in words: nobody says them, and others fit as well.
    pub fn unsure(&self) -> Option<String> {
        let shown = |(gyro, reference): &(Unit, Unit)| {
            let steps = gyro.steps().filter(|_| self.gyro.steps().is_some());
            let steps = steps.map(|steps| format!("{steps} steps a °/s"));
            let counts = reference.counts_per_turn().filter(|_| self.reference.counts_per_turn().is_some());
            let counts = counts.map(|counts| format!("{} counts a turn", units::thousands(counts as u64)));
            steps.into_iter().chain(counts).collect::<Vec<_>>().join(" with ")
        };
        if self.whole_degrees {
            let steps = self.gyro.steps().map_or(String::new(), |steps| format!(" with {steps} steps a °/s"));
            return Some(format!(
                "its whole numbers are taken as degrees{steps}; how many counts of an encoder are one turn is not in the file: if they are \
                 counts, say it by a factor of 360/COUNTS"
            ));
        }
        let own = shown(&(self.gyro, self.reference));
        let mut others: Vec<String> =
            self.others.iter().map(shown).filter(|other| !other.is_empty() && *other != own).collect();
        others.dedup();
        if own.is_empty() {
            return None;
        }
        if others.is_empty() {
            return self.reference.counts_per_turn().is_some().then(|| format!("{own} fit"));
        }
        let fit = if others.len() == 1 { "fits" } else { "fit" };
        Some(format!(
            "{own} are taken, {} {fit} as well: take what the data sheets say, for rate and scale factor depend on it",
            others.join(" or ")
        ))
    }
}

/// The factors that make the columns of a layout SI units whose unit nobody said; empty where all is said, or the rows do not tell.
pub fn factors(layout: &mut Layout, rows: &[Row]) -> Vec<(Channel, f64)> {
    let mut factors = of_accelerometer(layout, rows);
    factors.extend(of_turning(layout, rows));
    factors
}

/// Those of an accelerometer. One whose unit cannot be known is left out: it is no reason to refuse the gyro.
fn of_accelerometer(layout: &mut Layout, rows: &[Row]) -> Vec<(Channel, f64)> {
    let unsaid = |i: &usize| {
        let column = &layout.columns[*i];
        let is_unsaid = layout.chosen.iter().any(|pick| pick.name == column.name && !pick.is_unit_said);
        matches!(column.channel, Channel::Accel(_)) && is_unsaid
    };
    let places: Vec<usize> = (0..layout.columns.len()).filter(unsaid).collect();
    if places.is_empty() {
        return Vec::new();
    }
    match Gravity::of(rows) {
        Gravity::Metres => places.into_iter().filter_map(|place| adopt(layout, place, Unit::SI)).collect(),
        Gravity::Steps(steps) => {
            places.into_iter().filter_map(|place| adopt(layout, place, Unit::gravity(steps))).collect()
        }
        Gravity::Unknown => places.into_iter().map(|place| (layout.leave_out(place), f64::NAN)).collect(),
    }
}

/// Those of gyros and references.
fn of_turning(layout: &mut Layout, rows: &[Row]) -> Vec<(Channel, f64)> {
    let unsaid = |column: &Column| {
        let axis = column.channel.axis()?;
        (layout.chosen.iter().any(|pick| pick.name == column.name && !pick.is_unit_said)).then_some(axis)
    };
    let axes: Vec<Axis> = layout.columns.iter().filter_map(unsaid).collect();
    if axes.is_empty() || rows.len() < FEWEST {
        return Vec::new();
    }
    let start = rows[0].t_ns;
    let rows = rows.iter().take(LOOKED_AT).map(|row| Row { t_ns: row.t_ns - start, ..*row }).collect();
    let record = Record { rows, ..Record::default() };
    let is_of_mpu = |pick: &Pick| pick.name.starts_with("gyro_") && is_called_mpu(&pick.channel);
    let mpu = Gravity::of(&record.rows).is_of_mpu() || layout.chosen.iter().any(is_of_mpu);
    let mut factors = Vec::new();
    let column = |layout: &Layout, channel: Channel| layout.columns.iter().position(|column| column.channel == channel);
    let mut gyro_unit = None;
    for axis in Axis::ALL.into_iter().filter(|axis| axes.contains(axis)) {
        let gyro = column(layout, Channel::Gyro(axis));
        let (angle, rate) = (column(layout, Channel::RefAngle(axis)), column(layout, Channel::RefRate(axis)));
        let is_unsaid = |layout: &Layout, place: Option<usize>| {
            place.is_some_and(|place| {
                layout.chosen.iter().any(|pick| pick.name == layout.columns[place].name && !pick.is_unit_said)
            })
        };
        let (of_gyro, of_angle, of_rate) = (is_unsaid(layout, gyro), is_unsaid(layout, angle), is_unsaid(layout, rate));
        let channel = |place: usize| {
            let name = &layout.columns[place].name;
            layout.chosen.iter().find(|pick| pick.name == *name).map_or(name.as_str(), |pick| pick.channel.as_str())
        };
        let reference = match angle.filter(|_| of_angle).or(rate.filter(|_| of_rate)) {
            Some(place) => Unsaid::of(channel(place), !of_angle),
            None => Unsaid::Nothing,
        };
        let open = Open { gyro: of_gyro, reference, mpu };
        let Some(found) = told(&record, axis, open) else { continue };
        let of_reference = found.reference;
        for (place, is_meant, unit) in
            [(gyro, of_gyro, found.gyro), (angle, of_angle, of_reference), (rate, of_rate, of_reference)]
        {
            if let Some(place) = place.filter(|_| is_meant) {
                factors.extend(adopt(layout, place, unit));
            }
        }
        layout.unsure = layout.unsure.take().or_else(|| found.unsure());
        gyro_unit = gyro_unit.or(Some(found.gyro).filter(|_| of_gyro));
    }
    // One sensor has one unit.
    if let Some(unit) = gyro_unit {
        for axis in Axis::ALL {
            let gyro = column(layout, Channel::Gyro(axis));
            if let Some(place) =
                gyro.filter(|place| factors.iter().all(|(done, _)| *done != layout.columns[*place].channel))
                && layout.chosen.iter().any(|pick| pick.name == layout.columns[place].name && !pick.is_unit_said)
            {
                factors.extend(adopt(layout, place, unit));
            }
        }
    }
    factors
}

/// Finds the units that nobody said, where these rows tell them, and puts them into the rows.
pub fn find_units(layout: &mut Layout, rows: &mut [Row]) {
    find_words(layout, rows);
    let factors = factors(layout, rows);
    for row in rows {
        convert(row, &factors);
    }
}

/// Gives the words of a gyro their sign that were printed without it, 65 535 for −1: from now on, and in these rows.
fn find_words(layout: &mut Layout, rows: &mut [Row]) {
    const WORD: f64 = 65_536.0;
    let unsaid = |name: &str| layout.chosen.iter().any(|pick| pick.name == name && !pick.is_unit_said);
    let of_gyro = |column: &Column| matches!(column.channel, Channel::Gyro(_)) && unsaid(&column.name);
    let places: Vec<usize> = (0..layout.columns.len()).filter(|&i| of_gyro(&layout.columns[i])).collect();
    let axes: Vec<usize> = places.iter().filter_map(|&i| layout.columns[i].channel.axis()).map(Axis::index).collect();
    let readings = || rows.iter().flat_map(|row| axes.iter().map(|&i| row.gyro[i])).filter(|x| x.is_finite());
    let is_known = places.iter().any(|&i| layout.columns[i].is_word);
    let is_word = |x: f64| x.fract() == 0.0 && (0.0..WORD).contains(&x);
    let are_words = || readings().all(is_word) && readings().any(|x| x >= WORD / 2.0);
    if !(is_known || are_words()) {
        return;
    }
    for place in places {
        layout.columns[place].is_word = true;
    }
    for row in rows {
        for &i in axes.iter().filter(|&&i| row.gyro[i] >= WORD / 2.0).collect::<Vec<_>>() {
            row.gyro[i] -= WORD;
        }
    }
}

/// Puts the factors of columns into a row that was read without them.
pub fn convert(row: &mut Row, factors: &[(Channel, f64)]) {
    for &(channel, factor) in factors {
        if let Some(value) = place(row, &mut [f64::NAN; 9], channel) {
            *value *= factor;
        }
    }
}

/// Takes a unit for a column.
fn adopt(layout: &mut Layout, place: usize, unit: Unit) -> Option<(Channel, f64)> {
    let column = &mut layout.columns[place];
    let pick: &mut Pick = layout.chosen.iter_mut().find(|pick| pick.name == column.name)?;
    pick.is_unit_said = true;
    if unit == Unit::SI {
        return None;
    }
    pick.name.push_str(unit.suffix);
    pick.factor /= unit.divisor;
    column.name.clone_from(&pick.name);
    column.conversion.scale *= unit.factor;
    column.conversion.offset *= unit.factor;
    Some((column.channel, unit.factor))
}

/// The units in which the gyro of an axis and its reference agree.
pub fn told(record: &Record, axis: Axis, open: Open) -> Option<Told> {
    let i = axis.index();
    let signed = signed(record, i);
    let record = signed.as_ref().unwrap_or(record);
    let readings = |of: fn(&Row) -> [f64; 3]| -> Vec<f64> {
        record.rows.iter().map(|row| of(row)[i]).filter(|x| x.is_finite()).collect()
    };
    let gyro = readings(|row| row.gyro);
    let whole = |values: &[f64]| values.iter().all(|x| x.fract() == 0.0);
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut gyro_units = vec![Unit::SI];
    if open.gyro {
        gyro_units.extend([Unit::degrees("_dps", 1.0), Unit::degrees("_dps", 1000.0)]);
        if whole(&gyro) && largest(&gyro) > COUNTS {
            gyro_units.extend(SENSITIVITIES.map(|steps| Unit::degrees("_dps", steps)));
        }
    }
    let angle = readings(|row| row.ref_angle);
    let mut reference_units = vec![Unit::SI];
    if open.reference.is_angle() {
        reference_units.extend([Unit::degrees("_deg", 1.0), Unit::TURNS]);
        if whole(&angle) {
            reference_units.extend(COUNTS_PER_TURN.map(|counts| Unit::degrees("_deg", counts / 360.0)));
        }
    } else if open.reference == Unsaid::Rate {
        reference_units.push(Unit::degrees("_dps", 1.0));
    }
    // Whole numbers that are called an encoder's count are one, beside a gyro of which nobody says the unit either.
    let is_whole = open.reference == Unsaid::Counts && whole(&angle);
    let are_counts = is_whole && gyro_units.len() > SENSITIVITIES.len();
    let mut fitting: Vec<(f64, Unit, Unit)> = Vec::new();
    for reference in reference_units {
        let mut scaled = record.clone();
        for row in &mut scaled.rows {
            row.ref_angle[i] *= reference.factor;
            row.ref_rate[i] *= if open.reference.is_angle() { 1.0 } else { reference.factor };
        }
        let Some((ratio, r2)) = faults::ratio_to_reference(&scaled, axis).filter(|found| found.1 > FOLLOWS) else {
            continue;
        };
        for unit in &gyro_units {
            let off = (ratio.abs() / unit.factor).ln().abs();
            let fast = quantile(&gyro) * unit.factor;
            let is_counted = unit.is_counts() || reference.is_counts();
            if off > if is_counted { NEAREST } else { SCALE } || fast > FASTEST {
                continue;
            }
            // Where two pairs agree alike: the one whose readings a hand or a vehicle makes; counts only where nothing else fits.
            let wraps = wraps(&angle, reference.factor);
            let unlikely = f64::from(u8::from(fast > FAST))
                + f64::from(u8::from(unit.is_counts()))
                + 2.0 * f64::from(u8::from(open.reference.is_angle() && !wraps))
                + f64::from(u8::from(reference.is_counts() && !wraps))
                + 0.5 * f64::from(u8::from(reference == Unit::TURNS || are_counts && !reference.is_counts()));
            let near = if is_counted { unusual(*unit, reference, off, open.mpu) } else { off };
            fitting.push((unlikely + near + (1.0 - r2), *unit, reference));
        }
    }
    // Of those that differ by nothing the first: SI units before others.
    let least = fitting.iter().map(|(cost, ..)| *cost).fold(f64::INFINITY, f64::min);
    let &(_, gyro, reference) = fitting.iter().find(|(cost, ..)| *cost < least + 1e-3)?;
    fitting.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_alike = |(cost, unit, other): &&(f64, Unit, Unit)| {
        let is_kind = unit.is_counts() == gyro.is_counts() && other.is_counts() == reference.is_counts();
        // Sensitivities of one range, as makers round it, are one.
        let is_same = (unit.divisor / gyro.divisor - 1.0).abs() < ROUNDED && other.divisor == reference.divisor;
        *cost < least + ALIKE && is_kind && !is_same
    };
    // First those of the same sensor.
    let mut others: Vec<(Unit, Unit)> =
        fitting[1..].iter().filter(is_alike).map(|(_, unit, other)| (*unit, *other)).collect();
    others.sort_by_key(|(unit, _)| unit.divisor != gyro.divisor);
    others.truncate(MOST_OTHERS);
    let whole_degrees = is_whole && reference == Unit::degrees("_deg", 1.0);
    Some(Told { gyro, reference, others, whole_degrees })
}

/// How unusual counts are, from 0 on: a scale factor that far from 1, and numbers that few sensors have.
fn unusual(gyro: Unit, reference: Unit, off: f64, mpu: bool) -> f64 {
    const USUAL_SCALE: f64 = 0.015;
    /// An MPU has no sensitivity of another sensor.
    const OTHER: f64 = 10.0;
    let place = |of: &[f64], number: Option<f64>| {
        number.and_then(|number| of.iter().position(|known| *known == number)).unwrap_or_default() as f64
    };
    let (steps, counts) = (place(&SENSITIVITIES, gyro.steps()), place(&COUNTS_PER_TURN, reference.counts_per_turn()));
    let other = if mpu && steps >= OF_MPU as f64 { OTHER } else { 0.0 };
    0.01 * (0.5 * (off / USUAL_SCALE).powi(2) + 0.05 * steps + 0.3 * counts + other)
}

/// The same where the words of a gyro were printed without their sign, 65 535 for −1; the readings themselves are mended as those of a
/// range that is passed.
fn signed(record: &Record, axis: usize) -> Option<Record> {
    const WORD: f64 = 65_536.0;
    let readings = || record.rows.iter().map(|row| row.gyro[axis]).filter(|x| x.is_finite());
    let is_word = |x: f64| x.fract() == 0.0 && (0.0..WORD).contains(&x);
    if !readings().all(is_word) || !readings().any(|x| x >= WORD / 2.0) {
        return None;
    }
    let mut signed = record.clone();
    for reading in signed.rows.iter_mut().map(|row| &mut row.gyro[axis]).filter(|x| **x >= WORD / 2.0) {
        *reading -= WORD;
    }
    Some(signed)
}

/// How much of the motion about z a reference in this unit shows, as r², and whether it turns the other way.
pub fn follows(record: &Record, angle: Unit) -> Option<(f64, bool)> {
    let mut scaled = signed(record, 2).unwrap_or_else(|| record.clone());
    for row in &mut scaled.rows {
        row.ref_angle[2] *= angle.factor;
    }
    faults::ratio_to_reference(&scaled, Axis::Z).map(|(ratio, r2)| (r2, ratio < 0.0))
}

/// What nine tenths of the readings are below.
fn quantile(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let place = sizes.len() * 9 / 10;
    *sizes.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Whether an angle fits this unit: it jumps by a whole turn, or by nothing that a turn could be.
fn wraps(angle: &[f64], factor: f64) -> bool {
    let jumps: Vec<f64> = angle.windows(2).map(|pair| (pair[1] - pair[0]).abs() * factor).collect();
    let largest = jumps.iter().copied().fold(0.0, f64::max);
    largest < 0.5 || (0.9 * TAU..=1.001 * TAU).contains(&largest)
}

/// Rows with their times.
pub(super) fn timed(rows: &[Pending]) -> Vec<Row> {
    let first = rows.first().map_or(0, |row| row.time);
    let t_ns = |row: &Pending| i64::try_from(row.time - first).unwrap_or(i64::MAX);
    rows.iter().take(LOOKED_AT).map(|row| Row { t_ns: t_ns(row), ..row.row }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gyro of 131 counts a °/s beside an angle in degrees.
    fn counted(word: impl Fn(f64) -> f64) -> Record {
        let row = |k: i64| {
            let t = k as f64 * 0.01;
            let mut row = Row { t_ns: k * 10_000_000, ..Row::EMPTY };
            row.gyro[2] = word((131.0 * (115.0 * (1.3 * t).cos() + 0.6)).round());
            row.ref_angle[2] = 115.0 / 1.3 * (1.3 * t).sin();
            row
        };
        Record { rows: (0..3000).map(row).collect(), ..Record::default() }
    }

    const OPEN: Open = Open { gyro: true, reference: Unsaid::Angle, mpu: false };

    #[test]
    fn an_mpu_has_its_own_sensitivities_and_an_encoder_counts() {
        for (steps, turn) in [(131.0, 2400.0), (65.5, 1600.0), (131.0, 1440.0)] {
            let mut record = counted(|x| x);
            for row in &mut record.rows {
                row.gyro[2] = (row.gyro[2] * 0.98 * steps / 131.0).round();
                row.ref_angle[2] = (row.ref_angle[2] * turn / 360.0).floor();
            }
            let open = Open { reference: Unsaid::Counts, mpu: true, ..OPEN };
            let told = told(&record, Axis::Z, open).unwrap();
            assert_eq!((told.gyro.steps(), told.reference.counts_per_turn()), (Some(steps), Some(turn)));
        }
    }

    #[test]
    fn an_angle_in_turns_is_known_where_nothing_else_fits() {
        let mut record = counted(|x| x / 131.0);
        for row in &mut record.rows {
            row.ref_angle[2] /= 360.0;
        }
        let told = told(&record, Axis::Z, OPEN).unwrap();
        assert_eq!((told.gyro.suffix, told.reference), ("_dps", Unit::TURNS));
    }

    #[test]
    fn words_without_their_sign_are_counts_of_the_same_sensitivity() {
        for word in [|x: f64| x, |x: f64| x.rem_euclid(65_536.0)] {
            let told = told(&counted(word), Axis::Z, OPEN).unwrap();
            assert_eq!((told.gyro.divisor, told.gyro.suffix, told.reference.suffix), (131.0, "_dps", "_deg"));
        }
    }

    #[test]
    fn counts_of_both_are_the_usual_ones_and_the_others_that_fit_are_told() {
        for (steps, turn) in [(65.5, 4096.0), (16.4, 4096.0), (131.0, 4096.0), (32.8, 4096.0)] {
            let mut record = counted(|x| x);
            for row in &mut record.rows {
                row.gyro[2] = (row.gyro[2] * 1.012 * steps / 131.0).round();
                row.ref_angle[2] = (row.ref_angle[2] * turn / 360.0).floor();
            }
            let told = told(&record, Axis::Z, OPEN).unwrap();
            assert_eq!((told.gyro.steps(), told.reference.counts_per_turn()), (Some(steps), Some(turn)));
            let says = told.unsure().unwrap();
            let turn = units::thousands(4096);
            assert!(says.contains(&format!("{steps} steps a °/s with {turn} counts a turn are taken")), "{says}");
            assert!(says.contains("fit as well"), "{says}");
        }
    }
}
