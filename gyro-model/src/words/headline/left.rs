//! How much an error is, and what is left of it, in words.

use crate::{
    diagnosis::{AxisResult, ErrorPoint, Verdict},
    units,
    words::Voice,
};

/// Averaging time at which errors are said, s.
const SAID_AT: f64 = 1.0;
/// Error before over after from which on it is said to fall: three figures show it.
const FALLS: f64 = 1.005;
/// A curve that ends earlier, by this factor, is said at its end.
const NEAR: f64 = 1.5;

/// ` That makes 0.51 °/s of error over 1 s; corrected, 0.035 is left, which is noise.`
pub(super) fn makes(subject: &str, before: ErrorPoint, after: ErrorPoint, rest: &str) -> String {
    format!(
        " {subject} {} °/s of error over {}; corrected, {} is left{rest}.",
        units::rate(before.error),
        units::time(before.tau_s),
        units::rate(after.error)
    )
}

/// ` It changes this log's error little: 0.0362 °/s over 1 s, which is noise.`
pub(super) fn changes_little(subject: &str, here: ErrorPoint, voice: Voice) -> String {
    let rest = rest(&here, is_noise(&here));
    format!(
        " {subject} {} error little: {} °/s over {}{rest}.",
        voice.of_log(),
        units::rate(here.error),
        units::time(here.tau_s)
    )
}

/// What is said of an error that is left, behind its number.
pub(super) fn rest(after: &ErrorPoint, is_noise: bool) -> String {
    match after.error.zip(after.floor).filter(|(_, floor)| *floor > 0.0) {
        _ if is_noise => ", which is noise".to_owned(),
        Some((error, floor)) => format!(", {} times {FLOOR}", units::ratio(error / floor)),
        None => String::new(),
    }
}

/// What makes the floor.
pub(super) const FLOOR: &str = "what noise and the set-up alone make";

/// `0.51 °/s of error over 1 s, up to 14 times what noise and the set-up alone make`.
pub(super) fn left(here: Option<ErrorPoint>, ratio: Option<f64>, voice: Voice) -> String {
    let over = ratio.filter(|r| r.is_finite()).map(|r| format!("up to {} times {FLOOR}", units::ratio(r)));
    let error = here.map(|p| format!("{} °/s of error over {}", units::rate(p.error), units::time(p.tau_s)));
    let parts: Vec<String> = error.into_iter().chain(over).collect();
    if parts.is_empty() { format!("how much, {} does not say", voice.log()) } else { parts.join(", ") }
}

/// The point of a curve at which errors are said: 1 s, or its end where it ends before.
#[must_use]
pub fn said(curve: &[ErrorPoint]) -> Option<ErrorPoint> {
    let known = || curve.iter().filter(|p| p.error.is_some_and(f64::is_finite));
    let far = |p: &ErrorPoint| (p.tau_s / SAID_AT).ln().abs();
    let near = known().min_by(|a, b| far(a).total_cmp(&far(b)))?;
    Some(if far(near) < NEAR.ln() { *near } else { *known().next_back()? })
}

/// Where the second curve is best said, and the same time of the first: 1 s, or where most falls if nothing does there.
pub(super) fn same_time(before: &[ErrorPoint], after: &[ErrorPoint]) -> Option<(ErrorPoint, ErrorPoint)> {
    let at = |tau: f64| after.iter().copied().find(|p| (p.tau_s / tau - 1.0).abs() < 1e-6 && p.error.is_some());
    let usual = said(before).and_then(|p| at(p.tau_s).map(|q| (p, q)));
    let fall = |(p, q): &(ErrorPoint, ErrorPoint)| p.error.zip(q.error).map_or(0.0, |(p, q)| p / q);
    match usual {
        Some(pair) if !is_noise(&pair.0) => Some(pair),
        _ => {
            let pairs = before.iter().filter_map(|p| at(p.tau_s).map(|q| (*p, q))).filter(|(p, _)| !is_noise(p));
            pairs.max_by(|a, b| fall(a).total_cmp(&fall(b))).or(usual)
        }
    }
}

/// Where it is best said what a correction takes away: as [`same_time`], but where the error falls if it does not at 1 s; `None` where
/// it falls nowhere.
pub(super) fn corrected(before: &[ErrorPoint], after: &[ErrorPoint]) -> Option<(ErrorPoint, ErrorPoint)> {
    let fall = |(p, q): &(ErrorPoint, ErrorPoint)| p.error.zip(q.error).map_or(0.0, |(p, q)| p / q);
    let usual = same_time(before, after)?;
    if fall(&usual) > FALLS {
        return Some(usual);
    }
    let at = |tau: f64| after.iter().copied().find(|p| (p.tau_s / tau - 1.0).abs() < 1e-6 && p.error.is_some());
    let pairs = before.iter().filter(|p| !is_noise(p)).filter_map(|p| at(p.tau_s).map(|q| (*p, q)));
    pairs.filter(|pair| fall(pair) > FALLS).max_by(|a, b| fall(a).total_cmp(&fall(b)))
}

pub(super) fn is_noise(p: &ErrorPoint) -> bool {
    p.error.zip(p.floor_99).is_some_and(|(error, top)| error <= top)
}

/// What an error is before and after.
#[derive(Clone, Copy, Debug)]
pub struct Fall {
    /// Before; `None` where nothing was changed.
    pub before: Option<ErrorPoint>,
    /// After.
    pub after: ErrorPoint,
    /// Whether what is left is noise.
    pub is_noise: bool,
}

impl Fall {
    /// From where a ladder started to where it ended; of a diagnosis, what adding what is missing would make of the error.
    #[must_use]
    pub fn of(axis: &AxisResult) -> Option<Self> {
        let named = matches!(axis.verdict, Verdict::MissingEffect | Verdict::Ambiguous);
        let (here, pair) = match axis.steps.as_slice() {
            [first, .., last] => (&last.error_curve, corrected(&first.error_curve, &last.error_curve)),
            [only] => (&only.error_curve, None),
            [] if named => (&axis.error_curve, corrected(&axis.error_curve, axis.corrected_curve())),
            [] => (&axis.error_curve, None),
        };
        let (before, after) = match pair {
            Some((before, after)) => (Some(before), after),
            None => (None, said(here)?),
        };
        Some(Self { before, after, is_noise: axis.verdict == Verdict::Adequate || is_noise(&after) })
    }

    /// What a change made of the error.
    #[must_use]
    pub fn of_change(before: Option<&AxisResult>, after: &AxisResult) -> Option<Self> {
        let pair = before.and_then(|before| same_time(&before.error_curve, &after.error_curve));
        let (before, after_point) = match pair {
            Some((before, after)) => (Some(before), after),
            None => (None, said(&after.error_curve)?),
        };
        let is_noise = after.verdict == Verdict::Adequate || is_noise(&after_point);
        Some(Self { before, after: after_point, is_noise })
    }
}
