//! What an error makes of a heading: the angle by which it is off after some time without a reference, E(τ) · τ.
//!
//! Nothing is extrapolated: a time is told only where the error curve covers it, which ends at a tenth of the log. The band is that in which
//! the RMS of so many independent increments as the log holds lies in 95 of 100 logs, by the χ² law (Wilson and Hilferty 1931).

use crate::{
    Axis,
    diagnosis::{AxisResult, Drift, ErrorPoint, Off, Verdict},
    measured::and,
    words::headline::Fall,
};

/// Times without a reference that are told, s.
const TIMES: [f64; 3] = [10.0, 60.0, 600.0];
/// The error curve ends at this share of the log.
const SHARE: f64 = 0.1;
/// Two-sided 95 % of the normal law.
const Z: f64 = 1.96;

/// Puts it into results.
pub fn fill(axes: &mut [AxisResult]) {
    for axis in axes {
        axis.drift = of(axis);
        axis.drift_says = told(axis.axis, &axis.drift);
    }
}

/// It in a sentence; empty where the log is too short to say it.
#[must_use]
pub fn says(axis: &AxisResult) -> String {
    told(axis.axis, &of(axis))
}

/// What a result says of it.
#[must_use]
pub fn of(axis: &AxisResult) -> Vec<Drift> {
    if axis.verdict == Verdict::BadData {
        return Vec::new();
    }
    let (before, after): (&[ErrorPoint], &[ErrorPoint]) = match axis.steps.as_slice() {
        [first, .., last] => (&first.error_curve, &last.error_curve),
        [only] => (&only.error_curve, &[]),
        [] if matches!(axis.verdict, Verdict::MissingEffect | Verdict::Ambiguous) => {
            (&axis.error_curve, axis.corrected_curve())
        }
        [] => (&axis.error_curve, &[]),
    };
    // An effect that takes nothing away is no correction.
    let after = if Fall::of(axis).is_some_and(|fall| fall.before.is_some()) { after } else { &[] };
    let told =
        TIMES.iter().filter_map(|&tau_s| Some(Drift { tau_s, angle: at(before, tau_s)?, corrected: at(after, tau_s) }));
    told.collect()
}

/// E(τ) · τ at a time that a curve covers, on a straight line between the logarithms of its points.
fn at(curve: &[ErrorPoint], tau: f64) -> Option<Off> {
    let known: Vec<(f64, f64)> = (curve.iter())
        .filter_map(|p| Some((p.tau_s, p.error.filter(|error| error.is_finite() && *error > 0.0)?)))
        .collect();
    let end = known.last()?.0;
    // The last point is some rows short of the time that it stands for.
    let tau_in = if tau > end && tau < 1.02 * end { end } else { tau };
    let above = known.iter().position(|p| p.0 >= tau_in)?;
    let (left, right) = (known[above.checked_sub(1)?], known[above]);
    let share = (tau_in / left.0).ln() / (right.0 / left.0).ln();
    let error = (left.1.ln() + share * (right.1 / left.1).ln()).exp();
    let increments = (end / SHARE / tau).max(1.0);
    let chi = |z: f64| (1.0 - 2.0 / (9.0 * increments) + z * (2.0 / (9.0 * increments)).sqrt()).powi(3).max(0.0);
    let angle = error * tau;
    Some(Off { angle, low: angle / chi(Z).sqrt(), high: angle / chi(-Z).sqrt() })
}

fn told(axis: Axis, drift: &[Drift]) -> String {
    if drift.is_empty() {
        return String::new();
    }
    let what = if axis == Axis::Z { "the heading".to_owned() } else { format!("the angle about {axis}") };
    let after: Vec<String> = drift.iter().map(|d| format!("{} after {}", shown(&d.angle), time(d.tau_s))).collect();
    let corrected: Vec<String> = drift.iter().filter_map(|d| d.corrected.as_ref()).map(shown).collect();
    let rest =
        if corrected.len() == drift.len() { format!("; corrected, by {}", and(&corrected)) } else { String::new() };
    format!("Without a reference {what} is off by {}{rest} (RMS, with the band of 95 % of such logs).", and(&after))
}

fn shown(off: &Off) -> String {
    format!("{}° ({} to {})", two(off.angle), two(off.low), two(off.high))
}

/// Degrees, two figures.
fn two(radians: f64) -> String {
    let degrees = radians.to_degrees();
    let decimals = (1.0 - degrees.abs().log10().floor()).clamp(0.0, 5.0);
    format!("{degrees:.0$}", if decimals.is_finite() { decimals as usize } else { 0 })
}

fn time(seconds: f64) -> String {
    if seconds < 60.0 { format!("{seconds:.0} s") } else { format!("{:.0} min", seconds / 60.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finding::Finding;

    /// A constant error of so many °/s up to a tenth of a log.
    fn curve(error: f64, log_s: f64) -> Vec<ErrorPoint> {
        let steps = 30_i32;
        let end = 0.1 * log_s;
        (0..=steps)
            .map(|k| ErrorPoint {
                tau_s: 0.02 * (end / 0.02).powf(f64::from(k) / f64::from(steps)),
                error: Some(error.to_radians()),
                floor: Some(1e-4),
                floor_99: Some(1.3e-4),
            })
            .collect()
    }

    fn axis(log_s: f64) -> AxisResult {
        AxisResult {
            error_curve: curve(0.15, log_s),
            ..AxisResult::new(Axis::Z, Finding::Bare { verdict: Verdict::Unexplained })
        }
    }

    #[test]
    fn a_constant_error_grows_with_the_time_as_far_as_the_log_reaches() {
        for (log_s, times) in [(60.0, 0), (120.0, 1), (700.0, 2), (7000.0, 3)] {
            let drift = of(&axis(log_s));
            assert_eq!(drift.len(), times, "{log_s}");
            for of in &drift {
                assert!((of.angle.angle.to_degrees() / of.tau_s - 0.15).abs() < 1e-9, "{of:?}");
            }
        }
        assert_eq!(told(Axis::Z, &[]), "");
    }

    #[test]
    fn the_band_is_that_of_as_many_increments_as_the_log_holds() {
        let drift = of(&axis(600.0));
        // Ten increments of a minute: the 2.5 and 97.5 % of χ² with ten degrees of freedom are 3.247 and 20.483.
        let minute = drift[1].angle;
        assert!((minute.low / minute.angle - (10.0_f64 / 20.483).sqrt()).abs() < 3e-3, "{minute:?}");
        assert!((minute.high / minute.angle - (10.0_f64 / 3.247).sqrt()).abs() < 1e-2, "{minute:?}");
        let ten = drift[0].angle;
        assert!(ten.high / ten.angle < minute.high / minute.angle, "more increments tell more: {drift:?}");
    }

    #[test]
    fn what_a_correction_leaves_is_said_beside_it() {
        let mut late = axis(700.0);
        late.find(Finding::Bare { verdict: Verdict::MissingEffect });
        late.missing_error_curve = curve(0.006, 700.0);
        late.suspects = vec![crate::diagnosis::Suspect {
            effect: "delay".into(),
            aliases: Vec::new(),
            separate_by: String::new(),
            p_value: None,
            error_fall: None,
            log_likelihood_gain: None,
            parameters: Vec::new(),
            error_curve: Vec::new(),
        }];
        let drift = of(&late);
        let text = told(Axis::Z, &drift);
        assert!(
            text.starts_with("Without a reference the heading is off by 1.5° (1.3 to 1.8) after 10 s and 9.0° ("),
            "{text}"
        );
        assert!(text.contains("; corrected, by 0.060° (") && text.contains("0.36° ("), "{text}");
        assert!(told(Axis::X, &drift).contains("the angle about x"));
    }
}
