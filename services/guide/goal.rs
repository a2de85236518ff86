//! A goal of the recording in words.

use gyro_model::{guide::Goal, units};

/// Name, what is known, what is wanted.
pub(super) fn shown(goal: &Goal) -> (String, String, String) {
    let unit = units::shown(goal.unit, &[goal.value, Some(goal.wanted)]);
    let wanted = format!("± {}{}", units::round(goal.wanted * unit.factor), unit.unit);
    let known = goal.value.filter(|_| goal.std_error.is_some());
    let name = if goal.effect.len() + goal.name.len() < 22 {
        format!("{} {}", goal.effect, goal.name)
    } else {
        goal.effect.to_owned()
    };
    (name, known.map_or_else(|| "–".to_owned(), |value| units::uncertain(Some(value), goal.std_error, &unit)), wanted)
}
