//! The manoeuvre that tells an effect from its aliases, as the cards have it.

use super::{Effect, find};

/// What to do to tell an effect from these aliases.
#[must_use]
pub fn split_by(id: &str, aliases: &[String]) -> String {
    let Some(effect) = find(id) else {
        return "change one of their causes and not the other".into();
    };
    let mut splits: Vec<String> = Vec::new();
    for alias in aliases {
        let other = find(alias).map(Effect::card);
        // Either card may describe the pair.
        let own = effect.card().aliases.iter().find(|a| a.id == alias);
        let pair = own.or_else(|| other.and_then(|card| card.aliases.iter().find(|a| a.id == id)));
        let split = match (pair, other) {
            (Some(pair), _) => pair.split_by.to_owned(),
            (None, Some(card)) => format!("{alias} shows in {}", card.excited_by),
            (None, None) => continue,
        };
        if !splits.contains(&split) {
            splits.push(split);
        }
    }
    if splits.is_empty() { format!("{id} shows in {}", effect.card().excited_by) } else { splits.join("; ") }
}
