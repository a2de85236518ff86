//! A ratio between reference and gyro that no gyro's scale factor makes: a gear, the counts of a turn, a wheel base, a
//! full-scale setting.

use super::{
    thresholds::{NEAR_A_RATIO, SCALE},
    witness::Witness,
};
use crate::{Axis, Record, order::quantile, record::ReferenceKind};

/// Share of the fastest readings that a range's end may hold, 1.
const AT_THE_END: f64 = 0.02;
/// Ratios of numbers up to this one are likely those of gears.
const SMALL: u32 = 8;

/// What is said of a reference that shows much more or less than the gyro; `None` where a scale factor may.
///
/// `fit` is the slope of the reference on the gyro and the square of their correlation: of noisy ones it is too small, and at most
/// that over this square.
pub(super) fn says(record: &Record, axis: Axis, column: &str, fit: (f64, f64)) -> Option<String> {
    let witness = Witness::of(record, axis)?;
    let ratio = witness.slope.abs();
    let is_small = ratio < 1.0 - SCALE && fit.0.abs() / fit.1 < 1.0 - SCALE;
    let is_large = ratio > 1.0 / (1.0 - SCALE) && fit.0.abs() > 1.0 / (1.0 - SCALE);
    if !(is_small || is_large) || is_cut_off(record, axis) {
        return None;
    }
    let suspects = match record.reference(axis) {
        Some(ReferenceKind::Angle) => "the gear ratio between shaft and encoder, and its counts per turn",
        Some(ReferenceKind::Rate) => "the reference's scale (counts per turn, gear ratio, wheel base or wheel radius)",
        Some(ReferenceKind::Quaternion) | None => "the gyro's sensitivity before the camera system's scale",
    };
    Some(format!(
        "{column} shows {ratio:.3} times what gyro_{axis} reads{}. No gyro's scale factor is off by {:.0} %: check {suspects}, and \
         the gyro's full-scale setting. α takes this ratio up, and says nothing of the gyro until it is mended",
        nearest(ratio),
        100.0 * (ratio - 1.0).abs()
    ))
}

/// Whether the range's end holds the fastest readings: the ratio is then that of what is cut off.
fn is_cut_off(record: &Record, axis: Axis) -> bool {
    let readings: Vec<f64> =
        record.rows.iter().map(|row| row.gyro[axis.index()].abs()).filter(|g| g.is_finite()).collect();
    let most = readings.iter().fold(0.0, |most, &g| f64::max(most, g));
    most > 0.0 && quantile(readings, 1.0 - AT_THE_END).is_some_and(|fast| fast >= most * (1.0 - 1e-9))
}

/// The ratio that is meant, where it is one of small numbers or one that sensors are known to be off by.
fn nearest(ratio: f64) -> String {
    let near = |of: f64| (ratio / of).ln().abs();
    let known = [
        (0.875, "the nominal 8.75, 17.5 or 70 m°/s a step over the range in 2¹⁵ steps"),
        (8.0 / 7.0, "the range in 2¹⁵ steps over the nominal 8.75, 17.5 or 70 m°/s a step"),
        (0.9, "degrees over gradians"),
    ];
    let gears = (1..=SMALL).flat_map(|p| (1..=SMALL).map(move |q| (p, q)));
    let simple = |&(p, q): &(u32, u32)| near(f64::from(p) / f64::from(q)) < NEAR_A_RATIO;
    let gear = gears.filter(simple).min_by_key(|&(p, q)| p + q).map(|(p, q)| format!("{p} : {q}"));
    let sensor =
        known.iter().filter(|(of, _)| near(*of) < 0.5 * NEAR_A_RATIO).map(|(_, says)| (*says).to_owned()).next();
    let likely: Vec<String> = gear.into_iter().chain(sensor).collect();
    if likely.is_empty() { String::new() } else { format!(" (near {})", likely.join(", or ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Row;

    fn said(ratio: f64) -> Option<String> {
        let row = |k: u16| {
            let t = f64::from(k) * 0.01;
            let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
            row.gyro[2] = 2.6 * (1.3 * t).cos() + 1e-3 * (f64::from(k) * 1.7).sin();
            row.ref_angle[2] = ratio * 2.0 * (1.3 * t).sin();
            row
        };
        says(&Record { rows: (0..6000).map(row).collect(), ..Record::default() }, Axis::Z, "ref_angle_z", (ratio, 1.0))
    }

    #[test]
    fn a_ratio_beyond_any_scale_factor_is_said_with_the_nearest_one() {
        assert_eq!((said(1.05), said(0.93)), (None, None));
        assert!(said(1.26).unwrap().contains("5 : 4"), "{:?}", said(1.26));
        assert!(said(0.667).unwrap().contains("2 : 3"), "{:?}", said(0.667));
        assert!(said(-1.19).unwrap().contains("1.190 times"), "{:?}", said(-1.19));
    }
}
