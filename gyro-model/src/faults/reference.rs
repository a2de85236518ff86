//! Gyro against reference, coarsely: is the unit, the sign or the axis wrong, and does the axis turn at all?

use super::{Report, channel::unwrap, orientation, quantile};
use crate::{Axis, Record, fault::FaultKind, record::ReferenceKind};
use std::f64::consts::TAU;

/// Increments are compared over pieces of this length, s: long against any delay, short against a log.
const PIECE: f64 = 0.5;

/// Below this spread of the reference's rate, rad/s, an axis counts as not turned.
const TURNED: f64 = 0.02;

/// The reference's angle about one axis, continuous; for a quaternion the integral of the body rate.
pub(super) struct Motion {
    t: Vec<f64>,
    angle: Vec<f64>,
    /// RMS of the rate over [`PIECE`], rad/s.
    pub(super) rate_rms: f64,
}

impl Motion {
    /// `None` where the axis has no reference.
    pub(super) fn of(record: &Record, axis: Axis) -> Option<Self> {
        let i = axis.index();
        let (mut t, mut angle) = (Vec::new(), Vec::new());
        match record.reference(axis)? {
            ReferenceKind::Angle => {
                for row in record.rows.iter().filter(|r| r.ref_angle[i].is_finite()) {
                    t.push(row.t_ns as f64 * 1e-9);
                    angle.push(row.ref_angle[i]);
                }
                let whole = if wraps_in_degrees(&angle) { 360.0 } else { TAU };
                unwrap(&mut angle, whole);
            }
            ReferenceKind::Rate => {
                let mut sum = 0.0;
                for row in record.rows.iter().filter(|r| r.ref_rate[i].is_finite()) {
                    let now = row.t_ns as f64 * 1e-9;
                    sum += t.last().map_or(0.0, |before| now - before) * row.ref_rate[i];
                    t.push(now);
                    angle.push(sum);
                }
            }
            ReferenceKind::Quaternion => (t, angle) = turned(record, i, |q| q),
        }
        Self::along(t, angle)
    }

    /// That of an orientation whose four numbers `reading` puts in order.
    pub(super) fn of_orientation(record: &Record, axis: Axis, reading: fn([f64; 4]) -> [f64; 4]) -> Option<Self> {
        let (t, angle) = turned(record, axis.index(), reading);
        Self::along(t, angle)
    }

    fn along(t: Vec<f64>, angle: Vec<f64>) -> Option<Self> {
        let mut motion = Self { t, angle, rate_rms: 0.0 };
        let (&from, &to) = (motion.t.first()?, motion.t.last()?);
        let rates = motion.rates(from, to, motion.piece());
        motion.rate_rms = (rates.iter().map(|x| x * x).sum::<f64>() / rates.len().max(1) as f64).sqrt();
        Some(motion)
    }

    /// Its mean rates over pieces of the whole log.
    pub(super) fn whole(&self) -> Vec<f64> {
        let (from, to) = (self.t[0], self.t[self.t.len() - 1]);
        self.rates(from, to, self.piece())
    }

    /// The length of the pieces over which increments are compared: [`PIECE`], and at least twenty samples.
    fn piece(&self) -> f64 {
        let span = self.t.last().zip(self.t.first()).map_or(0.0, |(to, from)| to - from);
        PIECE.max(20.0 * span / self.t.len().max(1) as f64)
    }

    /// Angle at `t`, linear between samples, held at the ends.
    pub(super) fn at(&self, t: f64) -> f64 {
        let k = self.t.partition_point(|&x| x <= t);
        if k == 0 {
            return self.angle[0];
        }
        if k == self.t.len() {
            return self.angle[k - 1];
        }
        let share = (t - self.t[k - 1]) / (self.t[k] - self.t[k - 1]);
        self.angle[k - 1] + share * (self.angle[k] - self.angle[k - 1])
    }

    /// Mean rates over pieces of this length from `from` to `to`.
    pub(super) fn rates(&self, from: f64, to: f64, piece: f64) -> Vec<f64> {
        // A clock that jumps years ahead must not make years of pieces.
        let pieces = (((to - from) / piece) as usize).clamp(1, 4 * self.t.len().max(1));
        let edge = |k: usize| from + (to - from) * k as f64 / pieces as f64;
        let length = (to - from).max(1e-9) / pieces as f64;
        (0..pieces).map(|k| (self.at(edge(k + 1)) - self.at(edge(k))) / length).collect()
    }
}

/// Times, and the integral of an orientation's body rate about one axis.
fn turned(record: &Record, i: usize, reading: fn([f64; 4]) -> [f64; 4]) -> (Vec<f64>, Vec<f64>) {
    let (mut sum, mut before): (f64, Option<[f64; 4]>) = (0.0, None);
    let known = record.rows.iter().filter(|r| r.ref_quaternion[0].is_finite());
    known
        .map(|row| {
            let q = reading(row.ref_quaternion);
            sum += before.replace(q).map_or(0.0, |p| turn(p, q)[i]);
            (row.t_ns as f64 * 1e-9, sum)
        })
        .unzip()
}

/// Rotation from attitude `p` to `q` (both body to world), in body axes, rad.
pub(super) fn turn(p: [f64; 4], q: [f64; 4]) -> [f64; 3] {
    let w = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3];
    let v = [
        p[0] * q[1] - p[1] * q[0] - p[2] * q[3] + p[3] * q[2],
        p[0] * q[2] + p[1] * q[3] - p[2] * q[0] - p[3] * q[1],
        p[0] * q[3] - p[1] * q[2] + p[2] * q[1] - p[3] * q[0],
    ];
    let sine = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let scale = if sine < 1e-12 { 2.0 } else { 2.0 * sine.atan2(w.abs()) / sine };
    v.map(|x| x * scale * w.signum())
}

/// The reference angles that there are.
fn angles(record: &Record, axis: Axis) -> Vec<f64> {
    record.rows.iter().map(|r| r.ref_angle[axis.index()]).filter(|a| a.is_finite()).collect()
}

/// Whether an angle jumps by a full turn of 360.
pub(super) fn wraps_in_degrees(angle: &[f64]) -> bool {
    let span = angle.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    span.1 - span.0 <= 361.0 && angle.windows(2).any(|pair| (300.0..=361.0).contains(&(pair[1] - pair[0]).abs()))
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
        let (Some(&from), Some(&to)) = (motion.t.first(), motion.t.last()) else { continue };
        let wanted = motion.rates(from, to, motion.piece());
        let spread = deviation(&wanted);
        let rows = record.len() as u64;
        let own = gyro_rates(record, axis, &motion);
        let column = reference_column(record, axis);
        let fit = own.as_deref().map_or((0.0, 0.0), |g| regress(g, &wanted));
        // Times in another unit make every rate of the reference too small, whatever the gyro's unit is.
        let unit = factor(fit.0.abs() / time_unit(record).map_or(1.0, |(_, seconds)| seconds), axis, column)
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
                let says = format!(
                    "gyro_{axis} turns against {column}: negate one of them, such as with `--map NAME=-1*NAME`"
                );
                report.add_on(axis, FaultKind::WrongSign, rows, Some(0.0), says);
            }
            if let Some(says) =
                unit.or_else(|| turns_of_360(&format!(", and gyro_{axis} like °/s: name it gyro_{axis}_dps")))
            {
                report.add_on(axis, FaultKind::WrongUnit, rows, Some(0.0), says);
            }
        } else if let Some(says) = turns_of_360("") {
            report.add_on(axis, FaultKind::WrongUnit, rows, Some(0.0), says);
        } else if fit.1 < 0.3 {
            let others = Axis::ALL.into_iter().filter(|&a| a != axis && record.has_gyro(a));
            let follows = others.filter_map(|a| {
                let (slope, r2) = regress(&gyro_rates(record, a, &motion)?, &wanted);
                (r2 > 0.9).then_some((a, slope, r2))
            });
            if let Some((other, slope, _)) = follows.max_by(|a, b| a.2.total_cmp(&b.2)) {
                let sign = if slope < 0.0 { ", with the other sign" } else { "" };
                let says = format!("{column} follows gyro_{other}{sign}, not gyro_{axis}: rename one of them");
                report.add_on(axis, FaultKind::SwappedAxes, rows, Some(0.0), says);
            }
        }
    }
}

fn reference_column(record: &Record, axis: Axis) -> &'static str {
    match record.reference(axis) {
        Some(ReferenceKind::Angle) => ["ref_angle_x", "ref_angle_y", "ref_angle_z"][axis.index()],
        Some(ReferenceKind::Rate) => ["ref_rate_x", "ref_rate_y", "ref_rate_z"][axis.index()],
        Some(ReferenceKind::Quaternion) | None => "the reference orientation",
    }
}

/// Mean gyro readings over the pieces of the reference.
pub(super) fn gyro_rates(record: &Record, axis: Axis, motion: &Motion) -> Option<Vec<f64>> {
    let (mut t, mut angle, mut sum) = (Vec::new(), Vec::new(), 0.0);
    for row in record.rows.iter().filter(|r| r.gyro[axis.index()].is_finite()) {
        let now = row.t_ns as f64 * 1e-9;
        sum += t.last().map_or(0.0, |before| now - before) * row.gyro[axis.index()];
        t.push(now);
        angle.push(sum);
    }
    t.first()?;
    let gyro = Motion { t, angle, rate_rms: 0.0 };
    Some(gyro.rates(*motion.t.first()?, *motion.t.last()?, motion.piece()))
}

/// What the reference turns for one of the gyro's numbers, and how much of its motion the gyro shows (r²); `None` where an axis lacks one.
#[must_use]
pub fn ratio_to_reference(record: &Record, axis: Axis) -> Option<(f64, f64)> {
    let motion = Motion::of(record, axis)?;
    let own = gyro_rates(record, axis, &motion)?;
    let wanted = motion.rates(*motion.t.first()?, *motion.t.last()?, motion.piece());
    Some(regress(&own, &wanted))
}

fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// (slope of `y` on `x` with an intercept, r²).
pub(super) fn regress(x: &[f64], y: &[f64]) -> (f64, f64) {
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
const FASTEST: f64 = 70.0;

/// From one row of a gyro's log to the next, s: at most, and at least (32 kHz is the fastest that such sensors give).
const SLOWEST: f64 = 1.5;
const QUICKEST: f64 = 25e-6;

/// The unit of times that are too far apart for a gyro's log in seconds, and its seconds.
fn time_unit(record: &Record) -> Option<(&'static str, f64)> {
    let steps = record.rows.windows(2).map(|pair| (pair[1].t_ns - pair[0].t_ns) as f64 * 1e-9).collect();
    quantile(steps, 0.5).filter(|step| *step > SLOWEST).map(|step| match step {
        ..1e3 => ("ms", 1e-3),
        1e3..1e6 => ("us", 1e-6),
        _ => ("ns", 1e-9),
    })
}

/// Units that show without a reference.
fn other_units(record: &Record, report: &mut Report) {
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
    if let Some((unit, _)) = time_unit(record)
        && let Some(step) = step
    {
        let says = format!(
            "a row every {step:.0} s, by its times, is none of a gyro's logs: if t is in {unit}, name it t_{unit}"
        );
        report.add(FaultKind::WrongUnit, rows, Some(0.0), says);
    }
    let middle = |of: fn(&crate::Row) -> f64| {
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
    let temperature = middle(|r| r.temperature);
    if temperature > 200.0 {
        report.add(
            FaultKind::WrongUnit,
            rows,
            Some(0.0),
            format!("temp is about {temperature:.0}: kelvin? Name it temp_k"),
        );
    }
    let supply = middle(|r| r.supply);
    if supply > 500.0 {
        report.add(
            FaultKind::WrongUnit,
            rows,
            Some(0.0),
            format!("supply is about {supply:.0}: millivolts? Name it supply_mv"),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
