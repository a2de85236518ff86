//! Gyro against reference, coarsely: is the unit, the sign or the axis wrong, and does the axis turn at all?

use super::{
    Report,
    channel::wraps_in_degrees,
    motion::{Motion, gyro_rates},
    orientation, quantile,
};
use crate::{Axis, Record, Row, fault::FaultKind, record::ReferenceKind};
use std::f64::consts::TAU;

/// Below this spread of the reference's rate, rad/s, an axis counts as not turned.
const TURNED: f64 = 0.02;

/// The reference angles that there are.
fn angles(record: &Record, axis: Axis) -> Vec<f64> {
    record.rows.iter().map(|r| r.ref_angle[axis.index()]).filter(|a| a.is_finite()).collect()
}

/// Reports wrong units, signs and axes, and axes that are not turned.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    along_reference(record, report);
    other_units(record, report);
}

fn along_reference(record: &Record, report: &mut Report) {
    if let Some(says) = orientation::meant_otherwise(record) {
        report.add(FaultKind::SwappedAxes, record.len() as u64, Some(0.0), says);
        return;
    }
    for axis in Axis::ALL.into_iter().filter(|&a| record.has_gyro(a)) {
        let Some(motion) = Motion::of(record, axis) else { continue };
        let wanted = motion.whole();
        let spread = deviation(&wanted);
        let rows = record.len() as u64;
        let own = gyro_rates(record, axis, &motion);
        let column = reference_column(record, axis);
        let fit = own.as_deref().map_or((0.0, 0.0), |g| regress(g, &wanted));
        let unit = factor(fit.0.abs(), axis, column)
            .filter(|_| !clipped(record, axis))
            .filter(|_| fit.1 > 0.8 && own.as_deref().is_some_and(|g| holds_within_the_range(g, &wanted, fit.0)));
        let turns_of_360 = |more: &str| {
            wraps_in_degrees(&angles(record, axis))
                .then(|| format!("{column} jumps by 360, so it looks like degrees: add _deg to its name{more}"))
        };
        if spread < TURNED && unit.is_none() {
            let says = if own.as_ref().is_some_and(|g| deviation(g) > 10.0 * TURNED) {
                format!("gyro_{axis} turns but {column} does not: check the reference's wiring, axis and unit")
            } else {
                format!("axis {axis} hardly changes its rate: turn it both ways, at several rates")
            };
            report.add_on(axis, FaultKind::NotExcited, rows, None, says);
            continue;
        }
        if fit.1 > 0.8 {
            if fit.0 < 0.0 {
                let says = format!("gyro_{axis} turns against {column}: negate one of them");
                report.add_on(axis, FaultKind::WrongSign, rows, Some(0.0), says);
            }
            if let Some(says) =
                unit.or_else(|| turns_of_360(&format!(", and gyro_{axis} like °/s: name it gyro_{axis}_dps")))
            {
                report.add_on(axis, FaultKind::WrongUnit, rows, Some(0.0), says);
            }
        } else if let Some(says) = turns_of_360("") {
            report.add_on(axis, FaultKind::WrongUnit, rows, Some(0.0), says);
        } else if fit.1 < 0.3
            && let Some((other, slope)) = followed_in(record, axis, &motion)
        {
            let sign = if slope < 0.0 { ", with the other sign" } else { "" };
            let says = format!("{column} follows gyro_{other}{sign}, not gyro_{axis}: rename one of them");
            report.add_on(axis, FaultKind::SwappedAxes, rows, Some(0.0), says);
        }
    }
}

/// The other axis whose gyro the reference of an axis follows, where it does, and its slope.
#[must_use]
pub fn followed(record: &Record, axis: Axis) -> Option<(Axis, f64)> {
    followed_in(record, axis, &Motion::of(record, axis)?)
}

fn followed_in(record: &Record, axis: Axis, motion: &Motion) -> Option<(Axis, f64)> {
    let wanted = motion.whole();
    let others = Axis::ALL.into_iter().filter(|&a| a != axis && record.has_gyro(a));
    let follows = others.filter_map(|a| {
        let (slope, r2) = regress(&gyro_rates(record, a, motion)?, &wanted);
        (r2 > 0.9).then_some((a, slope, r2))
    });
    follows.max_by(|a, b| a.2.total_cmp(&b.2)).map(|(other, slope, _)| (other, slope))
}

fn reference_column(record: &Record, axis: Axis) -> &'static str {
    match record.reference(axis) {
        Some(ReferenceKind::Angle) => ["ref_angle_x", "ref_angle_y", "ref_angle_z"][axis.index()],
        Some(ReferenceKind::Rate) => ["ref_rate_x", "ref_rate_y", "ref_rate_z"][axis.index()],
        Some(ReferenceKind::Quaternion) | None => "the reference orientation",
    }
}

/// What the reference turns for one of the gyro's numbers, and how much of its motion the gyro shows (r²); `None` where an axis lacks one.
#[must_use]
pub fn ratio_to_reference(record: &Record, axis: Axis) -> Option<(f64, f64)> {
    let motion = Motion::of(record, axis)?;
    let own = gyro_rates(record, axis, &motion)?;
    let wanted = motion.whole();
    Some(regress(&own, &wanted))
}

fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// (slope of `y` on `x` with an intercept, r²).
pub(crate) fn regress(x: &[f64], y: &[f64]) -> (f64, f64) {
    let n = x.len().min(y.len()) as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in x.iter().zip(y) {
        xx += (a - mx).powi(2);
        xy += (a - mx) * (b - my);
        yy += (b - my).powi(2);
    }
    if xx > 0.0 && yy > 0.0 { (xy / xx, xy * xy / (xx * yy)) } else { (0.0, 0.0) }
}

/// Whether one reading in twenty stands at the very end of the gyro's range: the slope then says nothing of the unit.
fn clipped(record: &Record, axis: Axis) -> bool {
    let readings = || record.rows.iter().map(|r| r.gyro[axis.index()].abs()).filter(|g| g.is_finite());
    let end = readings().fold(0.0, f64::max);
    let (at, all) = readings().fold((0, 0), |(at, all), g| (at + usize::from(g >= end * (1.0 - 1e-9)), all + 1));
    end > 0.0 && at * 20 >= all
}

/// Whether the slope is the same away from the ends of the gyro's range, where a narrow one would clip it.
fn holds_within_the_range(x: &[f64], y: &[f64], slope: f64) -> bool {
    let ends = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (x, y): (Vec<f64>, Vec<f64>) =
        x.iter().zip(y).filter(|(x, _)| x.abs() < 0.7 * ends).map(|(x, y)| (*x, *y)).unzip();
    let (inner, r2) = regress(&x, &y);
    x.len() >= 5 && r2 > 0.8 && (inner / slope - 1.0).abs() < 0.2
}

/// What a reference that is `ratio` times the gyro's motion suggests.
fn factor(ratio: f64, axis: Axis, column: &str) -> Option<String> {
    const DEGREES: f64 = 180.0 / std::f64::consts::PI;
    const STANDARD_GRAVITY: f64 = 9.806_65;
    let gyro = format!("gyro_{axis}");
    let counts = |a_dps: f64| {
        format!("{gyro} looks like raw counts, {a_dps} to the °/s: divide it by {a_dps} and name it {gyro}_dps")
    };
    let setting_or_gear = "check the sensor's full-scale setting, and the reference's gear ratio and counts per turn";
    // No low-cost gyro's scale is off by more than the tolerance; a full-scale setting has to fit closely, for the scale of
    // a sensor of another kind may be anything.
    let (unit, setting) = (0.15, 0.05);
    let known = [
        (
            1.0 / DEGREES,
            unit,
            format!(
                "{gyro} looks like °/s (name it {gyro}_dps), or {column} like rad or rad/s though its name says degrees"
            ),
        ),
        (
            DEGREES,
            unit,
            format!(
                "{column} looks like degrees (add _deg to an angle's name, _dps to a rate's), or {gyro} like rad/s though its name says _dps"
            ),
        ),
        (1e-3, unit, format!("t looks like milliseconds (name it t_ms), or {gyro} like mrad/s")),
        (1e-6, unit, "t looks like microseconds: name it t_us".to_owned()),
        (1e-9, unit, "t looks like nanoseconds: name it t_ns".to_owned()),
        (1e-3 / DEGREES, unit, format!("{gyro} looks like m°/s: divide it by 1000 and name it {gyro}_dps")),
        (1e3, unit, format!("{gyro} is a thousand times too small: check its unit and that of t")),
        (2.0, setting, format!("{gyro} is half of what {column} shows: {setting_or_gear}")),
        (0.5, setting, format!("{gyro} is twice what {column} shows: {setting_or_gear}")),
        (4.0, setting, format!("{gyro} is a quarter of what {column} shows: {setting_or_gear}")),
        (0.25, setting, format!("{gyro} is four times what {column} shows: {setting_or_gear}")),
        (1.0 / DEGREES / 16.4, setting, counts(16.4)),
        (1.0 / DEGREES / 32.8, unit, counts(32.8)),
        (1.0 / DEGREES / 65.5, unit, counts(65.5)),
        (1.0 / DEGREES / 131.0, unit, counts(131.0)),
        (TAU / 60.0, unit, format!("{gyro} looks like turns a minute: convert it to rad/s")),
        (TAU, unit, format!("{gyro} looks like turns a second: convert it to rad/s")),
        (1.0 / TAU, setting, format!("{column} looks like turns: convert it to rad")),
        (STANDARD_GRAVITY, unit, format!("{column} is 9.81 times what {gyro} shows: check both units")),
    ];
    let off = |of: f64| (ratio / of).ln().abs();
    let nearest = known.iter().filter(|k| off(k.0) < k.1).min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    if let Some((_, _, says)) = nearest {
        return Some(format!("{says} (a factor of {})", number(ratio)));
    }
    (!(1.0 / 3.0..=3.0).contains(&ratio)).then(|| {
        format!(
            "{column} is {} times what {gyro} shows: check both units, gear ratio and counts per turn",
            number(ratio)
        )
    })
}

/// As many digits as say something.
fn number(ratio: f64) -> String {
    if ratio < 1e-3 { format!("{ratio:.2e}") } else { format!("{ratio:.4}") }
}

/// What no such gyro reads, rad/s: 4000 °/s.
pub const FASTEST: f64 = 70.0;

/// From one row of a gyro's log to the next, s: at most, and at least (32 kHz is the fastest that such sensors give).
const SLOWEST: f64 = 1.5;
const QUICKEST: f64 = 25e-6;

/// The unit of times that are too far apart for a gyro's log in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeUnit {
    /// `ms`, `us` or `ns`.
    pub name: &'static str,
    /// How many make a second.
    pub in_a_second: i64,
    /// From row to row, if the times were seconds.
    step: f64,
}

impl TimeUnit {
    /// The fault, in words.
    pub(super) fn says(self) -> String {
        let Self { name, step, .. } = self;
        format!("a row every {step:.0} s, by its times, is too slow for a gyro: if t is in {name}, name it t_{name}")
    }
}

/// The unit of times that are too far apart for a gyro's log in seconds, where they are.
#[must_use]
pub fn time_unit(record: &Record) -> Option<TimeUnit> {
    let steps = record.rows.windows(2).map(|pair| (pair[1].t_ns - pair[0].t_ns) as f64 * 1e-9).collect();
    let step = quantile(steps, 0.5).filter(|step| *step > SLOWEST)?;
    let (name, in_a_second) = match step {
        ..1e3 => ("ms", 1_000),
        1e3..1e6 => ("us", 1_000_000),
        _ => ("ns", 1_000_000_000),
    };
    (!is_of_means(record, step / in_a_second as f64)).then_some(TimeUnit { name, in_a_second, step })
}

/// Whether rows that seem to be `step`, s, apart are means of a sensor at rest over much longer times: in so short a time no sensor heats
/// by so much, and no low-cost gyro is so quiet.
fn is_of_means(record: &Record, step: f64) -> bool {
    let differences = |of: &dyn Fn(&Row) -> f64| -> Vec<f64> {
        record.rows.windows(2).map(|pair| (of(&pair[1]) - of(&pair[0])).abs()).filter(|x| x.is_finite()).collect()
    };
    let heats: f64 = differences(&|row| row.temperature).iter().sum();
    let seconds = record.rows.len() as f64 * step;
    Axis::ALL.into_iter().filter(|&axis| record.has_gyro(axis)).all(|axis| {
        let of = |row: &Row| row.gyro[axis.index()];
        let readings: Vec<f64> = record.rows.iter().map(of).filter(|x| x.is_finite()).collect();
        let Some(middle) = quantile(readings.clone(), 0.5) else { return false };
        let rests = readings.iter().all(|g| (g - middle).abs() < RESTS);
        // Of normal numbers the median difference is 0.954 of the standard deviation.
        let noise = quantile(differences(&of), 0.5).unwrap_or(f64::NAN) / 0.954;
        rests && (heats > HEATS * seconds || noise * step.sqrt() < QUIETEST)
    })
}

/// How far a gyro that rests may read from its middle, rad/s; how fast a sensor heats at most, K/s; and the least N of low-cost gyros,
/// rad/√s (0.001 °/√s).
const RESTS: f64 = 0.05;
const HEATS: f64 = 3.0;
const QUIETEST: f64 = 1.7e-5;

/// Units that show without a reference.
fn other_units(record: &mut Record, report: &mut Report) {
    let rows = record.len() as u64;
    for axis in Axis::ALL {
        let i = axis.index();
        let readings = record.rows.iter().map(|row| row.gyro[i].abs()).filter(|g| g.is_finite()).collect();
        if let Some(fast) = quantile(readings, 0.9).filter(|fast| *fast > FASTEST) {
            let says = format!(
                "gyro_{axis} reads {fast:.0} rad/s or more in a tenth of the rows, faster than any low-cost gyro \
                 can read (4000 °/s are 70 rad/s): if it is in °/s, name it gyro_{axis}_dps, in the header or by `--map`"
            );
            report.add_on(axis, FaultKind::WrongUnit, rows, Some(0.0), says);
        }
    }
    let steps = record.rows.windows(2).map(|pair| (pair[1].t_ns - pair[0].t_ns) as f64 * 1e-9).collect();
    let step = quantile(steps, 0.5);
    if let Some(step) = step.filter(|step| *step > 0.0 && *step < QUICKEST) {
        let says = format!(
            "a row every {:.3} µs, by its times, is faster than any low-cost gyro gives them: name the times by their unit, t for s, t_ms, t_us or t_ns",
            step * 1e6
        );
        report.add(FaultKind::WrongUnit, rows, Some(0.0), says);
    }
    let middle = |of: fn(&Row) -> f64| {
        quantile(record.rows.iter().map(of).filter(|x| x.is_finite()).collect(), 0.5).unwrap_or(f64::NAN)
    };
    let gravity = middle(|r| (r.accel[0].powi(2) + r.accel[1].powi(2) + r.accel[2].powi(2)).sqrt());
    if (0.85..1.15).contains(&gravity) {
        let says = "the accelerometer shows about 1 where gravity is 9.81 m/s²: add _g to its columns' names";
        report.add(FaultKind::WrongUnit, rows, Some(0.0), says.to_owned());
    } else if (850.0..1150.0).contains(&gravity) {
        let says = "the accelerometer shows about 1000 where gravity is 9.81 m/s²: add _mg to its columns' names";
        report.add(FaultKind::WrongUnit, rows, Some(0.0), says.to_owned());
    }
    beside(record, report, "temp", |row| &mut row.temperature, &(200.0, 223.0..400.0, "kelvin? Name it temp_k"));
    beside(
        record,
        report,
        "supply",
        |row| &mut row.supply,
        &(500.0, 1800.0..60_000.0, "millivolts? Name it supply_mv"),
    );
}

/// A column that no effect needs to be there, whose numbers are above all that its unit can have: what is wrong is its unit where another one
/// fits them; else it is not used. `other` is the least number that is too large, those that another unit explains, and that unit.
fn beside(
    record: &mut Record,
    report: &mut Report,
    name: &str,
    of: fn(&mut Row) -> &mut f64,
    (too_large, fits, other): &(f64, std::ops::Range<f64>, &str),
) {
    let known = record.rows.iter_mut().map(|row| *of(row)).filter(|x| x.is_finite()).collect();
    let Some(middle) = quantile(known, 0.5).filter(|middle| middle > too_large) else { return };
    let rows = record.len() as u64;
    if fits.contains(&middle) {
        report.add(FaultKind::WrongUnit, rows, Some(0.0), format!("{name} is about {middle:.0}: {other}"));
    } else {
        record.rows.iter_mut().for_each(|row| *of(row) = f64::NAN);
        let says = format!("{name} is about {middle:.0}, which is in no unit that it can have: it is not used");
        report.add(FaultKind::UnusedColumns, rows, Some(0.0), says);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::turn;

    #[test]
    fn a_turn_about_one_body_axis_is_seen_there_with_its_sign() {
        let about_z = |angle: f64| [(angle / 2.0).cos(), 0.0, 0.0, (angle / 2.0).sin()];
        for step in [0.3, -0.3, 1e-7] {
            let found = turn(about_z(1.0), about_z(1.0 + step));
            assert!((found[2] - step).abs() < 1e-12 && found[0].abs() < 1e-12, "{found:?}");
            // The same attitude written with the other sign.
            let found = turn(about_z(1.0), about_z(1.0 + step).map(|x| -x));
            assert!((found[2] - step).abs() < 1e-12, "{found:?}");
        }
    }

    #[test]
    fn the_papers_scale_of_2_156_is_no_wrong_unit() {
        assert_eq!(factor(2.156, Axis::X, "ref_angle_x"), None);
        assert!(factor(57.0, Axis::X, "ref_angle_x").unwrap().contains("degrees"));
    }
}
