//! What a change of the model has won: the sentence that comes first after it.

use super::{
    left::{FLOOR, corrected, is_noise, rest, said},
    name, sentence,
};
use crate::{diagnosis::ErrorPoint, units};

/// `Delay added: 0.699 → 0.0723 °/s over 1 s; what is left is noise.` Both curves are of the same rows.
#[must_use]
pub fn won(effect: &str, before: &[ErrorPoint], after: &[ErrorPoint]) -> String {
    let added = format!("{} added", name(effect));
    if let Some(gain) = gain(before, after) {
        return sentence(&format!("{added}: {gain}"));
    }
    let Some(here) = said(after) else { return sentence(&added) };
    sentence(&format!(
        "{added}; it changes the error little: {} °/s over {}{}",
        units::rate(here.error),
        units::time(here.tau_s),
        rest(&here, is_noise(&here))
    ))
}

/// `0.699 → 0.0723 °/s at 1 s`; `None` where the error falls nowhere.
#[must_use]
pub fn fall(before: &[ErrorPoint], after: &[ErrorPoint]) -> Option<String> {
    corrected(before, after).map(|pair| told(pair, "at"))
}

/// `0.699 → 0.0723 °/s over 1 s; what is left is noise`; `None` where the error falls nowhere.
#[must_use]
pub fn gain(before: &[ErrorPoint], after: &[ErrorPoint]) -> Option<String> {
    let (before, after) = corrected(before, after)?;
    let fall = told((before, after), "over");
    let rest = match after.error.zip(after.floor).filter(|(_, floor)| *floor > 0.0) {
        _ if is_noise(&after) => "; what is left is noise".to_owned(),
        Some((error, floor)) => format!("; what is left is {} times {FLOOR}", units::ratio(error / floor)),
        None => String::new(),
    };
    Some(fall + &rest)
}

fn told((before, after): (ErrorPoint, ErrorPoint), over: &str) -> String {
    format!("{} → {} °/s {over} {}", units::rate(before.error), units::rate(after.error), units::time(after.tau_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(errors: [f64; 3]) -> Vec<ErrorPoint> {
        let point = |(tau_s, error): (f64, f64)| ErrorPoint {
            tau_s,
            error: Some(error.to_radians()),
            floor: Some(0.07_f64.to_radians()),
            floor_99: Some(0.08_f64.to_radians()),
        };
        [0.1, 1.0, 10.0].into_iter().zip(errors).map(point).collect()
    }

    #[test]
    fn what_was_won_is_told_with_what_is_left() {
        let before = curve([0.9, 0.699, 0.2]);
        assert_eq!(
            won("delay", &before, &curve([0.07, 0.0723, 0.05])),
            "Delay added: 0.699 → 0.0723 °/s over 1 s; what is left is noise."
        );
        assert_eq!(
            won("warm-up", &before, &curve([0.7, 0.35, 0.05])),
            "Warm up added: 0.699 → 0.350 °/s over 1 s; what is left is 5.0 times what noise and the set-up alone make."
        );
    }

    #[test]
    fn a_change_that_wins_nothing_says_so() {
        let same = curve([0.9, 0.699, 0.2]);
        let says = won("delay", &same, &same);
        assert!(says.starts_with("Delay added; it changes the error little: 0.699 °/s over 1 s"), "{says}");
        assert_eq!(won("delay", &[], &[]), "Delay added.");
    }
}
