//! An orientation among columns whose names do not say it: four numbers of length 1, or three angles, that turn as the gyro does.

use super::{
    row::{of_angles, of_matrix},
    sample::Sample,
    unsaid::{self, Open, Unit},
};
use gyro_model::{Axis, Record, Row, faults};
use log_readers::{
    meaning::{PARTS, Pick, defined, unit_said},
    unit::Quantity,
};

/// How much of the reference's motion the axis that shows it best has to show, and an axis whose sign counts, as r².
const FOLLOWS: f64 = 0.9;
const SIGNED: f64 = 0.5;
/// One in so many rows may have another length.
const FEW: usize = 20;

/// A way to read columns as an orientation.
pub(super) struct Reading {
    /// The maps.
    pub picks: Vec<Pick>,
    /// In words.
    pub says: String,
    /// Of the rows.
    orientation: Vec<[f64; 4]>,
}

/// How an orientation turns with the gyros beside it.
pub(super) struct Held {
    /// The axis that shows it best.
    pub axis: Axis,
    /// How well that is.
    pub r2: f64,
    /// How well the axes show it together.
    pub sum: f64,
}

/// How the orientation of a record turns with its gyros; `None` where it does not, or turns the other way.
pub(super) fn held(record: &Record, axes: &[Axis]) -> Option<Held> {
    let of = |axis: &Axis| faults::ratio_to_reference(record, *axis).map(|(ratio, r2)| (*axis, ratio, r2));
    let of_axes: Vec<(Axis, f64, f64)> = axes.iter().filter_map(of).collect();
    let &(axis, _, r2) = of_axes.iter().max_by(|a, b| a.2.total_cmp(&b.2)).filter(|best| best.2 > FOLLOWS)?;
    let turns_the_same_way = of_axes.iter().all(|(_, ratio, r2)| *ratio > 0.0 || *r2 < SIGNED);
    turns_the_same_way.then(|| Held { axis, r2, sum: of_axes.iter().map(|(_, _, r2)| r2).sum() })
}

/// The ways to read columns that are not used as an orientation.
pub(super) fn readings(sample: &Sample, used: &[usize]) -> Vec<Reading> {
    let is_free = |column: usize| !used.contains(&column);
    let fours = (0..sample.columns.len().saturating_sub(3))
        .filter(|&first| (first..first + 4).all(is_free) && is_of_length_one(sample, first));
    let mut readings: Vec<Reading> = fours.flat_map(|first| quaternions(sample, first)).collect();
    readings.extend(angles(sample, used));
    let nines = (0..sample.columns.len().saturating_sub(8))
        .filter(|&first| (first..first + 9).all(is_free) && is_rotation(sample, first));
    readings.extend(nines.flat_map(|first| [matrix(sample, first, false), matrix(sample, first, true)]));
    readings
}

/// The columns that are an orientation which turns as these gyros do, with the maps that make it the reference.
pub(super) fn of(
    sample: &Sample,
    used: &[usize],
    gyros: &[(Axis, usize)],
    times: Option<&[f64]>,
) -> Option<(Vec<Pick>, String)> {
    let times = times?;
    let axes: Vec<Axis> = gyros.iter().map(|(axis, _)| *axis).collect();
    let held = readings(sample, used).into_iter().filter_map(|reading| {
        let rows = (0..sample.rows()).map(|k| {
            let mut row = Row { t_ns: (times[k] * 1e9) as i64, ref_quaternion: reading.orientation[k], ..Row::EMPTY };
            for (axis, column) in gyros {
                row.gyro[axis.index()] = sample.columns[*column][k];
            }
            row
        });
        let record = Record { rows: rows.collect(), ..Record::default() };
        let held = held(&record, &axes)?;
        let unit = unsaid::told(&record, held.axis, Open { gyro: true, ..Open::default() })?.gyro;
        Some((held, unit, reading))
    });
    let (Held { axis, r2, .. }, unit, reading) = held.max_by(|a, b| a.0.sum.total_cmp(&b.0.sum))?;
    let mut picks = reading.picks;
    picks.extend(in_its_unit(sample, gyros, unit));
    let says = format!(
        "{} turns as gyro_{axis} does (r² {r2:.3}): a reference, if something else than this gyro measured it (most drivers compute an \
         orientation from the gyro)",
        reading.says
    );
    Some((picks, says))
}

/// Maps of gyros whose own names mean rad/s, where they are in another unit.
fn in_its_unit(sample: &Sample, gyros: &[(Axis, usize)], unit: Unit) -> Vec<Pick> {
    let is_meant = |axis: &Axis, column: usize| sample.head.names[column] == format!("gyro_{axis}");
    if unit.factor == 1.0 {
        return Vec::new();
    }
    (gyros.iter().filter(|(axis, column)| is_meant(axis, *column)))
        .map(|(axis, column)| sample.pick(&format!("gyro_{axis}{}", unit.suffix), *column, unit.divisor))
        .collect()
}

/// Whether four neighbouring columns change and have the length 1.
fn is_of_length_one(sample: &Sample, first: usize) -> bool {
    let length = |k: usize| (first..first + 4).map(|i| sample.columns[i][k].powi(2)).sum::<f64>().sqrt();
    let lengths: Vec<f64> = (0..sample.rows()).map(length).filter(|x| x.is_finite()).collect();
    let others = lengths.iter().filter(|length| !(0.98..1.02).contains(*length)).count();
    !lengths.is_empty() && FEW * others <= lengths.len() && (first..first + 4).any(|i| sample.varies(i))
}

/// The ways to read four columns: the real part first or last, body to world or world to body.
fn quaternions(sample: &Sample, first: usize) -> Vec<Reading> {
    let reading = |order: [usize; 4], is_inverse: bool| {
        let sign = if is_inverse { -1.0 } else { 1.0 };
        let signs = [1.0, sign, sign, sign];
        let pick = |part: usize| Pick {
            factor: signs[part],
            ..sample.pick(&format!("ref_q{}", PARTS[part]), first + order[part], 1.0)
        };
        let value = |k: usize| std::array::from_fn(|part| signs[part] * sample.columns[first + order[part]][k]);
        let parts = if order[0] == 0 { "w, x, y, z" } else { "x, y, z, w" };
        let way = if is_inverse { ", world to body" } else { "" };
        let says =
            format!("the orientation in {} to {} ({parts}{way})", sample.called(first), sample.called(first + 3));
        Reading { picks: (0..4).map(pick).collect(), says, orientation: (0..sample.rows()).map(value).collect() }
    };
    let letters: Vec<Option<char>> = (first..first + 4)
        .map(|i| sample.head.names[i].to_lowercase().chars().rfind(|c| c.is_alphanumeric()))
        .collect();
    let is_named = |parts: [char; 4]| letters.iter().zip(parts).all(|(letter, part)| *letter == Some(part));
    let orders: &[[usize; 4]] = match () {
        () if is_named(['w', 'x', 'y', 'z']) => &[[0, 1, 2, 3]],
        () if is_named(['x', 'y', 'z', 'w']) => &[[3, 0, 1, 2]],
        () => &[[0, 1, 2, 3], [3, 0, 1, 2]],
    };
    orders.iter().copied().flat_map(|order| [reading(order, false), reading(order, true)]).collect()
}

/// Whether nine neighbouring columns change and are a rotation matrix.
fn is_rotation(sample: &Sample, first: usize) -> bool {
    let is_one = |k: usize| of_matrix(std::array::from_fn(|i| sample.columns[first + i][k])) != [0.0; 4];
    let is_whole = |k: &usize| (first..first + 9).all(|i| sample.columns[i][*k].is_finite());
    let whole: Vec<usize> = (0..sample.rows()).filter(is_whole).collect();
    let others = whole.iter().filter(|k| !is_one(**k)).count();
    !whole.is_empty() && FEW * others <= whole.len() && (first..first + 9).any(|i| sample.varies(i))
}

/// A way to read nine columns: body to world, or the other way, which is the same column by column.
fn matrix(sample: &Sample, first: usize, is_inverse: bool) -> Reading {
    let place = |i: usize| first + if is_inverse { 3 * (i % 3) + i / 3 } else { i };
    let channels: Vec<String> = (0..9).map(|i| sample.channel(place(i))).collect();
    let way = if is_inverse { ", world to body" } else { "" };
    let of_row = |k: usize| of_matrix(std::array::from_fn(|i| sample.columns[place(i)][k]));
    Reading {
        picks: vec![Pick::new("ref_r", &channels.join(","), None)],
        says: format!("the rotation matrix in {} to {}{way}", sample.called(first), sample.called(first + 8)),
        orientation: (0..sample.rows()).map(of_row).collect(),
    }
}

/// Roll, pitch and yaw by their names, in the unit that is said or in either.
fn angles(sample: &Sample, used: &[usize]) -> Vec<Reading> {
    let column = |names: &[&str]| {
        (0..sample.columns.len()).find(|&i| {
            let name = sample.head.names[i].to_lowercase();
            !used.contains(&i) && names.iter().any(|of| name.contains(of))
        })
    };
    let places = [column(&["roll"]), column(&["pitch"]), column(&["yaw", "heading", "azimuth"])];
    let [Some(roll), Some(pitch), Some(yaw)] = places else { return Vec::new() };
    if !sample.varies(roll) && !sample.varies(pitch) {
        return Vec::new();
    }
    let head = &sample.head;
    let said = unit_said(&head.names[yaw], head.units[yaw]).or_else(|| defined(head, yaw));
    let said = said.filter(|unit| unit.quantity == Quantity::Angle);
    let units = [("_deg", 1_f64.to_radians()), ("", 1.0)];
    let fits = |suffix: &str| said.is_none_or(|unit| unit.suffix == suffix && unit.factor == 1.0);
    let columns = [roll, pitch, yaw];
    let channels = columns.map(|i| sample.channel(i));
    let called = columns.map(|i| sample.called(i));
    (units.into_iter().filter(|(suffix, _)| fits(suffix)))
        .map(|(suffix, factor)| Reading {
            picks: vec![Pick::new(&format!("ref_rpy{suffix}"), &channels.join(","), None)],
            says: format!("the orientation of roll, pitch and yaw in {}", called.join(", ")),
            orientation: (0..sample.rows())
                .map(|k| {
                    of_angles(
                        [f64::NAN, sample.columns[roll][k], sample.columns[pitch][k], sample.columns[yaw][k]]
                            .map(|x| x * factor),
                    )
                })
                .collect(),
        })
        .collect()
}
