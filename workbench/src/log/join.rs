//! A reference from a second file: its rows beside the log's own, a row a message, nothing interpolated.

use super::{
    LogError,
    error::{Problem, listed},
    header::{Column, Layout},
    lacking::Advice,
    pending::Pending,
    reader::Reader,
    unit::{self, Channel, Name},
    unsaid::{self, Open, Unsaid, timed},
};
use crate::{toml_error::quoted, words::typed};
use gyro_model::{
    Axis, Model, Record, Row,
    align::align,
    effects::find,
    fault::{DataFault, FaultKind},
    faults, fit,
    model::Term,
};
use log_readers::{
    meaning::{Pick, epoch_unit, unit_said},
    unit::Quantity,
};
use std::{ops::IndexMut, path::Path};

/// Correlation of the motions that is enough to believe that it is one.
const ALIKE: f64 = 0.5;
/// The offset that is nearest to none is the one where it is nearly as likely as the best.
const AS_LIKELY: f64 = 0.8;
/// On one clock a gyro or reference is late by no more, ns.
const LATEST_NS: i128 = 150_000_000;

/// A log whose reference is another one's, from the file `second`.
pub fn with_reference(mut log: Reader, mut other: Reader, second: &Path) -> Result<Reader, LogError> {
    let from_gyro = !has_reference(other.layout());
    let name = second.display().to_string();
    let refuse = |problem| LogError::new(&name, None, None, problem);
    if from_gyro && other.layout().gyros().is_empty() {
        let offered = &other.layout().offered;
        let likely = typed(offered);
        let named = attitude_of(offered).or_else(|| {
            offered.first().map(|pick| Advice {
                why: format!(
                    "{} may be the reference: its name does not say which axis turned, or what it is",
                    quoted(&pick.channel)
                ),
                flags: offered.iter().map(ToString::to_string).collect(),
                ..Advice::default()
            })
        });
        let error = refuse(Problem::NoReferenceIn { has: listed(&other.layout().free_names), likely });
        let advice = turning(&mut log, &mut other)?.or(named);
        return Err(error.advised(advice, true));
    }
    let (mut own, mut rows) = (log.drain()?, other.drain()?);
    for row in &mut rows {
        row.row = reference_only(&row.row, from_gyro);
    }
    for row in &mut own {
        row.row = Row { ref_angle: NONE, ref_rate: NONE, ref_quaternion: [f64::NAN; 4], ..row.row };
    }
    let mut layout = together(log.layout(), other.layout(), from_gyro);
    match [&own, &rows].map(|of| is_since_1970(of)) {
        [false, true] => take_epoch(&mut own, &mut layout),
        [true, false] => take_epoch(&mut rows, &mut other.layout().clone()),
        _ => {}
    }
    let shift = shift(&own, &rows).map_err(|likeness| refuse(Problem::NotAligned(likeness)))?;
    for row in &mut rows {
        row.time += shift;
    }
    let factors = unsaid::factors(&mut layout, &timed(&merged(&own, &rows)));
    for row in own.iter_mut().chain(&mut rows) {
        unsaid::convert(&mut row.row, &factors);
    }
    let fine = if shift == 0 { 0 } else { residual(&merged(&own, &rows)) };
    for row in &mut rows {
        row.time += fine;
    }
    let faults = vec![DataFault {
        kind: FaultKind::OtherClock,
        axis: None,
        count: rows.len() as u64,
        first_t: None,
        says: format!(
            "the reference's clock is {:.4} s {} the log's, found from the motion in both: set to it, so a delay between the two cannot \
             be found",
            (shift + fine).abs() as f64 / 1e9,
            if shift + fine < 0 { "ahead of" } else { "behind" },
        ),
    }];
    let faults = if shift == 0 { Vec::new() } else { faults };
    log.go_on(merged(&own, &rows), layout, faults);
    Ok(log)
}

/// Three angles, one about each axis, as one orientation: roll, pitch and yaw of a pose are no turns of three shafts.
fn attitude_of(offered: &[Pick]) -> Option<Advice> {
    let [roll, pitch, yaw] = offered else { return None };
    let suffix = roll.name.strip_prefix("ref_angle_x")?;
    let is_other =
        |pick: &Pick, axis: &str| pick.name == format!("ref_angle_{axis}{suffix}") && pick.factor == roll.factor;
    (is_other(pitch, "y") && is_other(yaw, "z")).then(|| {
        let channels = [roll, pitch, yaw].map(|pick| pick.channel.as_str()).join(",");
        let pick = Pick { factor: roll.factor, ..Pick::new(&format!("ref_rpy{suffix}"), &channels, None) };
        Advice {
            why: format!("{} may be an orientation, the reference: roll, pitch and yaw", quoted(&channels)),
            flags: vec![pick.to_string()],
            ..Advice::default()
        }
    })
}

/// Whether times count from 1970.
fn is_since_1970(rows: &[Pending]) -> bool {
    const SECOND: i128 = 1_000_000_000;
    rows.first().is_some_and(|row| (1_000_000_000 * SECOND..5_000_000_000 * SECOND).contains(&row.time))
}

/// Takes the time since 1970 that a file holds beside the one that was taken: the other file has no other.
fn take_epoch(rows: &mut [Pending], layout: &mut Layout) {
    let values = |place: usize| rows.iter().map(move |row| row.row.free[place]);
    let found = (0..layout.free_names.len()).find_map(|place| {
        let unit = epoch_unit(values(place).next()?).filter(|unit| *unit != log_readers::unit::SECONDS)?;
        let grown = rows.windows(2).filter(|pair| pair[1].row.free[place] > pair[0].row.free[place]).count();
        (values(place).all(f64::is_finite) && 10 * grown >= 9 * (rows.len() - 1)).then_some((place, unit))
    });
    let Some((place, unit)) = found else { return };
    let to_ns = unit::converted(Channel::Time, unit).map_or(1, |of| 10_i128.pow(of.exponent.unsigned_abs()));
    for row in rows.iter_mut() {
        row.time = (row.row.free[place] * 1e3) as i128 * to_ns / 1000;
    }
    rows.sort_by_key(|row| row.time);
    layout.chosen.retain(|pick| !matches!(unit::name(&pick.name), Name::Known(Channel::Time, _)));
    layout.chosen.insert(0, Pick::new("t", &layout.free_names[place], Some(unit)));
}

/// The column of the second file that turns as a gyro of the log has it.
fn turning(log: &mut Reader, other: &mut Reader) -> Result<Option<Advice>, LogError> {
    /// Columns that are looked at.
    const MOST: usize = 12;
    const FOLLOWS: f64 = 0.9;
    let (own, rows) = (log.drain()?, other.drain()?);
    let unsaid = log.layout().chosen.iter().any(|pick| pick.name.starts_with("gyro_") && !pick.is_unit_said);
    let axes = log.layout().gyros();
    let mut best: Option<(f64, Advice)> = None;
    let varies = |place: &usize| {
        let values = || rows.iter().map(|row| row.row.free[*place]).filter(|x| x.is_finite());
        values().next().is_some_and(|first| values().any(|x| x != first))
    };
    let names = other.layout().free_names.iter().enumerate();
    for (place, name) in names.filter(|(place, _)| varies(place)).take(MOST) {
        let said = unit_said(name, None).filter(|unit| matches!(unit.quantity, Quantity::Rate | Quantity::Angle));
        let is_rate = said.is_some_and(|unit| unit.quantity == Quantity::Rate);
        for &axis in &axes {
            let channel = if is_rate { Channel::RefRate(axis) } else { Channel::RefAngle(axis) };
            let factor = said.and_then(|unit| unit::converted(channel, unit)).map_or(1.0, |of| of.scale);
            let mut reference = rows.clone();
            for row in &mut reference {
                let mut only = Row { t_ns: row.row.t_ns, ..Row::EMPTY };
                let value = factor * row.row.free[place];
                *(if is_rate { &mut only.ref_rate } else { &mut only.ref_angle }).index_mut(axis.index()) = value;
                row.row = only;
            }
            reference.retain(|row| is_reference_row(&row.row));
            let shift = if said.is_none() { shift(&own, &small(&reference, axis)) } else { shift(&own, &reference) };
            let Ok(shift) = shift else { continue };
            for row in &mut reference {
                row.time += shift;
            }
            let mut record = Record { rows: timed(&merged(&own, &reference)), ..Record::default() };
            let is_open = said.is_none();
            let reference = if is_open { Unsaid::of(name, is_rate) } else { Unsaid::Nothing };
            let open = Open { gyro: unsaid, reference, mpu: false };
            let told = unsaid::told(&record, axis, open);
            let Some(told) = told else { continue };
            let (unit, unsure) = (told.reference, told.unsure().map_or(String::new(), |says| format!("; {says}")));
            for row in &mut record.rows {
                row.ref_angle[axis.index()] *= unit.factor;
            }
            let Some((ratio, r2)) = faults::ratio_to_reference(&record, axis).filter(|found| found.1 > FOLLOWS) else {
                continue;
            };
            if best.as_ref().is_some_and(|(most, _)| *most >= r2) {
                continue;
            }
            let base = format!("{}_{axis}", if is_rate { "ref_rate" } else { "ref_angle" });
            let pick = match said {
                Some(said) => Pick::new(&base, name, Some(said)),
                None => {
                    Pick { factor: unit.divisor.recip(), ..Pick::new(&format!("{base}{}", unit.suffix), name, None) }
                }
            };
            let (pick, way) = if ratio < 0.0 {
                (Pick { factor: -pick.factor, ..pick }, ", counted the other way")
            } else {
                (pick, "")
            };
            let why = format!(
                "{} turns as gyro_{axis} does{way} (r² {r2:.3}): a reference, if something else than this gyro measured it{unsure}",
                quoted(name)
            );
            best = Some((r2, Advice { why, flags: vec![pick.to_string()], ..Advice::default() }));
        }
    }
    Ok(best.map(|(_, advice)| advice))
}

/// Angles of an unknown unit about one axis, counts of an encoder perhaps, in so small a one that no step is taken for a turn; where they
/// wrap, they go on past it.
fn small(rows: &[Pending], axis: Axis) -> Vec<Pending> {
    const SMALL: f64 = 1e-3;
    let mut rows = rows.to_vec();
    let angles = || rows.iter().map(|row| row.row.ref_angle[axis.index()]).filter(|angle| angle.is_finite());
    let (low, high) = angles().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let turn = high - low + if angles().all(|angle| angle.fract() == 0.0) { 1.0 } else { 0.0 };
    let (mut before, mut turns) = (f64::NAN, 0.0);
    for row in &mut rows {
        let angle = &mut row.row.ref_angle[axis.index()];
        let step = *angle - before;
        if step.abs() > 0.5 * turn {
            turns -= turn * step.signum();
        }
        before = if angle.is_finite() { *angle } else { before };
        *angle = SMALL * (*angle + turns) / turn;
    }
    rows
}

/// What is left of the offset between two clocks after the motions were laid over each other, ns: the delay that a fit finds. Between
/// two clocks that were never compared it is no property of the gyro.
fn residual(rows: &[Pending]) -> i128 {
    const LONGEST: f64 = 0.1;
    let record = Record { rows: timed(rows), ..Record::default() };
    let axes = record.fitted_axes();
    let mut model = Model::base_for(&record);
    let Some(delay) = find("delay") else { return 0 };
    for axis in &axes {
        if let Some(of) = &mut model.axes[axis.index()] {
            of.terms.push(Term::neutral(delay, *axis));
        }
    }
    let Ok(model) = fit::fit(&record, &model, &axes) else { return 0 };
    let (mut sum, mut weights) = (0.0, 0.0);
    for term in model.axes.iter().flatten().filter_map(|axis| axis.term("delay")) {
        let (value, error) = (term.values[0], term.std_errors[0]);
        if value.abs() < LONGEST && error > 0.0 && error.is_finite() {
            sum += value / error.powi(2);
            weights += error.powi(-2);
        }
    }
    // A gyro that is late is not so against a reference that is set back by as much.
    if weights > 0.0 { (sum / weights * 1e9) as i128 } else { 0 }
}

/// The rows of both in time, within the log's own span; a reference of the very time of a row is that row's.
fn merged(own: &[Pending], reference: &[Pending]) -> Vec<Pending> {
    let (first, last) = (own.first().map_or(0, |row| row.time), own.last().map_or(0, |row| row.time));
    let mut all: Vec<Pending> = own.to_vec();
    all.extend(reference.iter().filter(|row| (first..=last).contains(&row.time)).cloned());
    all.sort_by_key(|row| row.time);
    let mut merged: Vec<Pending> = Vec::with_capacity(own.len());
    for next in all {
        match merged.last_mut() {
            Some(before)
                if before.time == next.time && is_reference_row(&next.row) && !is_reference_row(&before.row) =>
            {
                let of = next.row;
                before.row = Row {
                    ref_angle: of.ref_angle,
                    ref_rate: of.ref_rate,
                    ref_quaternion: of.ref_quaternion,
                    ..before.row
                };
            }
            _ => merged.push(next),
        }
    }
    merged
}

const NONE: [f64; 3] = [f64::NAN; 3];

fn has_reference(layout: &Layout) -> bool {
    layout.columns.iter().any(|column| column.channel.is_reference())
}

/// What a row holds of a reference: a second gyro's readings are one.
fn reference_only(row: &Row, from_gyro: bool) -> Row {
    let ref_rate = if from_gyro { row.gyro } else { row.ref_rate };
    Row { t_ns: row.t_ns, ref_angle: row.ref_angle, ref_rate, ref_quaternion: row.ref_quaternion, ..Row::EMPTY }
}

fn is_reference_row(row: &Row) -> bool {
    row.gyro.iter().all(|x| x.is_nan())
        && (row.ref_quaternion[0].is_finite() || row.ref_angle.iter().chain(&row.ref_rate).any(|x| x.is_finite()))
}

/// What the reference's times have to be given to be the log's, ns; where that is not to be told, how alike the motions are.
fn shift(own: &[Pending], reference: &[Pending]) -> Result<i128, f64> {
    let start = own.first().map_or(0, |row| row.time);
    let origin = reference.first().map_or(0, |row| row.time);
    let rows = |of: &[Pending], from: i128| -> Vec<Row> {
        let t_ns = |row: &Pending| i64::try_from(row.time - from).unwrap_or(i64::MAX / 2);
        of.iter().map(|row| Row { t_ns: t_ns(row), ..row.row }).collect()
    };
    let apart = origin - start;
    let Some(found) = align(&rows(own, start), &rows(reference, origin), i64::try_from(apart).unwrap_or(i64::MAX))
    else {
        // Too short or too still to tell: as it is, where they overlap at all.
        let overlap =
            reference.last().is_some_and(|row| row.time > start) && own.last().is_some_and(|row| row.time > origin);
        return if overlap { Ok(0) } else { Err(0.0) };
    };
    // Both were counted from their own first rows here.
    let near = i128::from(found.near_ns) - apart;
    if overlapping(own, reference) && found.likeness_near >= AS_LIKELY * found.likeness {
        return Ok(if near.abs() <= LATEST_NS { 0 } else { near });
    }
    let total = i128::from(found.offset_ns) - apart;
    if found.likeness < ALIKE { Err(found.likeness) } else { Ok(total) }
}

fn overlapping(own: &[Pending], reference: &[Pending]) -> bool {
    match (own.first(), own.last(), reference.first(), reference.last()) {
        (Some(a), Some(b), Some(c), Some(d)) => c.time < b.time && a.time < d.time,
        _ => false,
    }
}

/// A second gyro's name as that of a reference.
fn as_reference(name: &str) -> String {
    name.replacen("gyro_", "ref_rate_", 1)
}

/// The layout of both.
fn together(own: &Layout, other: &Layout, from_gyro: bool) -> Layout {
    let mut layout = own.clone();
    layout.columns.retain(|column| !column.channel.is_reference());
    layout.columns.extend(other.columns.iter().filter_map(|column| {
        let channel = match column.channel {
            Channel::Gyro(axis) if from_gyro => Channel::RefRate(axis),
            channel if channel.is_reference() => channel,
            _ => return None,
        };
        let name = if from_gyro { as_reference(&column.name) } else { column.name.clone() };
        Some(Column { name, channel, ..column.clone() })
    }));
    let refs =
        other.chosen.iter().filter(|pick| pick.name.starts_with("ref_") || from_gyro && pick.name.starts_with("gyro_"));
    layout.chosen.retain(|pick| !pick.name.starts_with("ref_"));
    layout.chosen.extend(refs.map(|pick| {
        let name = if from_gyro { as_reference(&pick.name) } else { pick.name.clone() };
        Pick { name, ..pick.clone() }
    }));
    layout.dependent.clone_from(&other.dependent);
    layout
}
