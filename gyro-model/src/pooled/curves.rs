//! The error of several logs as one curve: mean squares, each log by how long it is.

use crate::diagnosis::{AxisResult, BudgetPoint, ErrorPoint};

/// One log's curve and how long it is, s.
type Own<'a> = (&'a [ErrorPoint], f64);

/// ln-ln interpolation of one quantity of a curve.
fn read(curve: &[ErrorPoint], tau: f64, of: impl Fn(&ErrorPoint) -> Option<f64>) -> Option<f64> {
    let known: Vec<(f64, f64)> =
        curve.iter().filter_map(|p| Some((p.tau_s.ln(), of(p).filter(|v| *v > 0.0)?.ln()))).collect();
    let (first, last) = (known.first()?, known.last()?);
    let x = tau.ln().clamp(first.0, last.0);
    let end = known.partition_point(|(t, _)| *t < x);
    if end == 0 {
        return Some(first.1.exp());
    }
    let ((t0, y0), (t1, y1)) = (known[end - 1], known[end.min(known.len() - 1)]);
    let share = if t1 > t0 { (x - t0) / (t1 - t0) } else { 0.0 };
    Some((y0 + share * (y1 - y0)).exp())
}

/// The root mean squares over the logs at the averaging times that all of them have.
///
/// ```text
/// E² = Σ w_l E_l²/Σ w_l     F² likewise     U² = F² + √Σ (w_l (U_l² − F_l²))²/Σ w_l
/// ```
#[must_use]
pub fn curve(logs: &[Own]) -> Vec<ErrorPoint> {
    let Some((shortest, _)) = logs.iter().min_by(|a, b| {
        let end = |own: &Own| own.0.last().map_or(0.0, |point| point.tau_s);
        end(a).total_cmp(&end(b))
    }) else {
        return Vec::new();
    };
    let weight: f64 = logs.iter().map(|(_, w)| w).sum();
    let point = |at: &ErrorPoint| {
        let tau = at.tau_s;
        let mean = |of: fn(&ErrorPoint) -> Option<f64>| -> Option<f64> {
            let squares = logs.iter().map(|(curve, w)| Some(w * read(curve, tau, of)?.powi(2)));
            Some((squares.sum::<Option<f64>>()? / weight).sqrt())
        };
        let floor = mean(|p| p.floor);
        let spread = logs.iter().map(|(curve, w)| {
            let (upper, floor) = (read(curve, tau, |p| p.floor_99)?, read(curve, tau, |p| p.floor)?);
            Some((w * (upper.powi(2) - floor.powi(2))).powi(2))
        });
        let floor_99 =
            spread.sum::<Option<f64>>().zip(floor).map(|(sum, floor)| (floor * floor + sum.sqrt() / weight).sqrt());
        ErrorPoint { tau_s: tau, error: mean(|p| p.error), floor, floor_99 }
    };
    shortest.iter().map(point).collect()
}

/// What the mean square error is made of: each log's parts at the nearest averaging time, in the mean, so that they add up to E².
#[must_use]
pub fn budget(logs: &[(&AxisResult, f64)], curve: &[ErrorPoint]) -> Vec<BudgetPoint> {
    let near = |axis: &AxisResult, tau: f64| {
        let apart = |point: &&BudgetPoint| (point.tau_s / tau).ln().abs();
        axis.budget.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).copied()
    };
    let of = |point: &ErrorPoint| {
        let error = point.error?;
        let mut sum = [0.0; crate::diagnosis::PARTS];
        for (axis, weight) in logs {
            let parts = near(axis, point.tau_s)?.parts;
            sum.iter_mut().zip(parts).for_each(|(sum, part)| *sum += weight * part);
        }
        let total: f64 = sum.iter().sum();
        (total > 0.0).then(|| BudgetPoint { tau_s: point.tau_s, parts: sum.map(|part| part * error * error / total) })
    };
    curve.iter().filter_map(of).collect()
}

/// The largest E/F, and whether every error is below the band's upper end.
#[must_use]
pub fn over_floor(curve: &[ErrorPoint]) -> (Option<f64>, bool) {
    let ratios = curve.iter().filter_map(|p| Some(p.error? / p.floor?));
    let within = curve.iter().all(|p| p.error.zip(p.floor_99).is_none_or(|(error, upper)| error <= upper));
    (ratios.reduce(f64::max), within)
}

/// J, the mean of (E/F)².
#[must_use]
pub fn excess(curve: &[ErrorPoint]) -> f64 {
    let each: Vec<f64> = curve.iter().filter_map(|p| Some((p.error? / p.floor?).powi(2))).collect();
    each.iter().sum::<f64>() / each.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(scale: f64, until: i32) -> Vec<ErrorPoint> {
        let point = |k: i32| {
            let tau = 0.1 * 1.5_f64.powi(k);
            ErrorPoint {
                tau_s: tau,
                error: Some(scale / tau.sqrt()),
                floor: Some(1.0 / tau.sqrt()),
                floor_99: Some(1.2 / tau.sqrt()),
            }
        };
        (0..until).map(point).collect()
    }

    #[test]
    fn mean_squares_are_taken_where_all_logs_have_an_error_and_the_band_narrows() {
        let (a, b) = (of(3.0, 12), of(1.0, 9));
        let both = curve(&[(&a, 100.0), (&b, 300.0)]);
        assert_eq!(both.len(), 9);
        for point in &both {
            let wanted = (0.25 * 9.0 + 0.75_f64).sqrt();
            assert!((point.error.unwrap() * point.tau_s.sqrt() - wanted).abs() < 1e-9);
            let upper = point.floor_99.unwrap() * point.tau_s.sqrt();
            assert!(upper > 1.0 && upper < 1.2, "{upper}");
        }
        let alone = curve(&[(&a, 5.0)]);
        assert!((alone[3].floor_99.unwrap() - a[3].floor_99.unwrap()).abs() < 1e-12);
    }
}
