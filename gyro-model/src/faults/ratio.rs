//! A ratio between reference and gyro that no gyro's scale factor makes: a gear, the counts of a turn, a wheel base, a
//! full-scale setting.
//!
//! Before an effect is compensated the two may differ by anything: a bias that warms up turns one-sidedly with the shaft, a range
//! that ends cuts the fastest readings off. So it is α that is judged, fitted beside all effects of a model.

use super::thresholds::{NEAR_A_RATIO, SCALE};
use crate::{
    Axis, AxisModel, Record,
    effects::Stage,
    fault::{DataFault, FaultKind},
    order::quantile,
    record::ReferenceKind,
};

/// Share of the fastest readings that a range's end may hold, 1.
const AT_THE_END: f64 = 0.02;
/// Ratios of numbers up to this one are likely those of gears.
const SMALL: u32 = 8;

/// The fault of a log on which α of every one of these models of an axis is beyond what gyros have; `None` where one is not.
///
/// The first model is the one that is told of. Several are given where it is not known which of them is right.
pub(crate) fn fault(record: &Record, axis: Axis, models: &[AxisModel]) -> Option<DataFault> {
    let ratio = models.first()?.alpha();
    let is_far = |model: &AxisModel| {
        let limits_range = model.terms.iter().any(|term| term.effect.stage() == Stage::Reading);
        is_beyond(model.alpha())
            && is_known(model)
            && (model.alpha() < 1.0) == (ratio < 1.0)
            && (limits_range || !is_cut_off(record, axis))
    };
    if !models.iter().all(is_far) {
        return None;
    }
    let (column, suspects) = match record.reference(axis) {
        Some(ReferenceKind::Angle) => {
            (format!("ref_angle_{axis}"), "the gear ratio between shaft and encoder, and its counts per turn")
        }
        Some(ReferenceKind::Rate) => (
            format!("ref_rate_{axis}"),
            "the reference's scale (counts per turn, gear ratio, wheel base or wheel radius)",
        ),
        Some(ReferenceKind::Quaternion) | None => {
            ("the reference orientation".to_owned(), "the gyro's sensitivity before the camera system's scale")
        }
    };
    let says = format!(
        "{column} shows {ratio:.3} times what gyro_{axis} reads{}. No gyro's scale factor is off by {:.0} %: check {suspects}, and \
         the gyro's full-scale setting. α takes this ratio up, and says nothing of the gyro until it is fixed",
        nearest(ratio, std_error_of(models.first()?)),
        100.0 * (ratio - 1.0).abs()
    );
    let count = record.len() as u64;
    Some(DataFault { kind: FaultKind::WrongRatio, axis: Some(axis), count, first_t: Some(0.0), says })
}

/// Whether α of a fitted model is one that no gyro has: gyro and reference are in different units, or a count or gear is wrong.
#[must_use]
pub fn is_wrong(model: &AxisModel) -> bool {
    is_beyond(model.alpha()) && is_known(model)
}

/// Beyond this the fit ran to its end: gyro and reference do not go together, and no ratio is known.
const KNOWN: f64 = 50.0;

/// Whether no gyro has this scale factor.
fn is_beyond(alpha: f64) -> bool {
    (1.0 / KNOWN..=KNOWN).contains(&alpha) && !(1.0 - SCALE..=1.0 / (1.0 - SCALE)).contains(&alpha)
}

/// Standard errors from a scale factor that gyros have to one that is told.
const SURE: f64 = 3.0;

/// Whether the log shows that α is none that gyros have; a model that was not fitted has no standard error, and says what it says.
fn is_known(model: &AxisModel) -> bool {
    let alpha = model.alpha();
    let std_error = std_error_of(model);
    let nearest = alpha.clamp(1.0 - SCALE, 1.0 / (1.0 - SCALE));
    std_error.is_nan() || (alpha - nearest).abs() > SURE * std_error
}

/// The standard error of α; none where it was not fitted.
fn std_error_of(model: &AxisModel) -> f64 {
    model.term("scale-factor").map_or(f64::NAN, |term| term.std_errors.first().copied().unwrap_or(f64::NAN))
}

/// Whether the range's end holds the fastest readings: the ratio is then that of what is cut off.
fn is_cut_off(record: &Record, axis: Axis) -> bool {
    let readings: Vec<f64> =
        record.rows.iter().map(|row| row.gyro[axis.index()].abs()).filter(|g| g.is_finite()).collect();
    let most = readings.iter().fold(0.0, |most, &g| f64::max(most, g));
    most > 0.0 && quantile(readings, 1.0 - AT_THE_END).is_some_and(|fast| fast >= most * (1.0 - 1e-9))
}

/// The ratio that is meant, where it is one of small numbers or one that sensors are known to be off by.
fn nearest(ratio: f64, std_error: f64) -> String {
    let near = |of: f64| (ratio / of).ln().abs();
    let known = [
        (0.875, "the nominal 8.75, 17.5 or 70 m°/s a step over the range in 2¹⁵ steps"),
        (8.0 / 7.0, "the range in 2¹⁵ steps over the nominal 8.75, 17.5 or 70 m°/s a step"),
        (0.9, "degrees over gradians"),
    ];
    let of = |&(p, q): &(u32, u32)| near(f64::from(p) / f64::from(q));
    let gears = (1..=SMALL).flat_map(|p| (1..=SMALL).map(move |q| (p, q)));
    let gears: Vec<(u32, u32)> = gears.filter(|gear| of(gear) < NEAR_A_RATIO).collect();
    // The simplest of those that the log does not tell apart; without one the nearest.
    let simplest = gears.iter().filter(|gear| of(gear) < std_error / ratio).min_by_key(|(p, q)| p + q);
    let nearest = || gears.iter().min_by(|a, b| of(a).total_cmp(&of(b)).then((a.0 + a.1).cmp(&(b.0 + b.1))));
    let gear = simplest.or_else(nearest).map(|(p, q)| format!("{p} : {q}"));
    let sensor =
        known.iter().filter(|(of, _)| near(*of) < 0.5 * NEAR_A_RATIO).map(|(_, says)| (*says).to_owned()).next();
    let likely: Vec<String> = gear.into_iter().chain(sensor).collect();
    if likely.is_empty() { String::new() } else { format!(" (near {})", likely.join(", or ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Row;

    fn said(alphas: &[f64]) -> Option<String> {
        let row = |k: u16| {
            let t = f64::from(k) * 0.01;
            let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
            row.gyro[2] = 2.6 * (1.3 * t).cos() + 1e-3 * (f64::from(k) * 1.7).sin();
            row.ref_angle[2] = alphas[0] * 2.0 * (1.3 * t).sin();
            row
        };
        let record = Record { rows: (0..6000).map(row).collect(), ..Record::default() };
        let model = |alpha: &f64| {
            let mut model = AxisModel::base(Axis::Z);
            model.terms[0].values[0] = *alpha;
            model
        };
        let models: Vec<AxisModel> = alphas.iter().map(model).collect();
        fault(&record, Axis::Z, &models).map(|fault| fault.says)
    }

    #[test]
    fn a_ratio_beyond_any_scale_factor_is_said_with_the_nearest_one() {
        assert_eq!((said(&[1.05]), said(&[0.93])), (None, None));
        assert_eq!(said(&[0.01]), None);
        assert!(said(&[1.26]).unwrap().contains("5 : 4"), "{:?}", said(&[1.26]));
        assert!(said(&[0.667]).unwrap().contains("2 : 3"), "{:?}", said(&[0.667]));
        assert!(said(&[1.167]).unwrap().contains("(near 7 : 6)"), "{:?}", said(&[1.167]));
        assert!(nearest(1.167, 0.04).contains("(near 6 : 5") && nearest(1.45, 0.001).is_empty());
        assert!(said(&[1.19]).unwrap().contains("1.190 times"), "{:?}", said(&[1.19]));
    }

    #[test]
    fn a_ratio_that_the_log_does_not_show_is_not_said() {
        let mut model = AxisModel::base(Axis::Z);
        model.terms[0].values[0] = 0.23;
        let mut known_to = |std_error: f64| {
            model.terms[0].std_errors = vec![std_error];
            is_known(&model)
        };
        assert!(known_to(0.01) && known_to(f64::NAN));
        assert!(!known_to(0.27) && !known_to(f64::INFINITY));
    }

    #[test]
    fn a_ratio_that_an_effect_may_make_is_not_said() {
        assert_eq!((said(&[1.16, 1.01]), said(&[1.16, 0.8])), (None, None));
        assert!(said(&[1.16, 1.17]).is_some());
    }
}
