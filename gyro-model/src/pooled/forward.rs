//! Forward selection over groups of columns: they join one after the other, and what the later ones make needless goes again.

use super::Key;
use crate::{parallel, thresholds as limit};
use std::collections::{BTreeMap, BTreeSet};

/// What a group of columns comes to beside those that have joined.
pub(super) struct Answer {
    /// Gain in ln L.
    pub gain: f64,
    /// Chance of it from noise alone, priced for the search.
    pub p_value: f64,
    /// The gain of each log, or of each part, by its number.
    pub each: BTreeMap<usize, f64>,
    /// The gain with the value that the others have; the gain itself where nothing is held out.
    pub held_out: f64,
}

impl Answer {
    fn is_significant(&self) -> bool {
        self.p_value < limit::SIGNIFICANCE.value
    }

    fn passes(&self) -> bool {
        self.is_significant() && self.held_out > 0.0
    }

    /// Whether two effects cannot be told apart: their gains differ by less than two standard errors over the logs, or by little.
    fn is_like(&self, other: &Self) -> bool {
        let differences: Vec<f64> = self.each.iter().filter_map(|(k, a)| other.each.get(k).map(|b| a - b)).collect();
        let (sum, n) = (differences.iter().sum::<f64>(), differences.len() as f64);
        if n < FEW {
            return sum < APART;
        }
        let variance = differences.iter().map(|d| (d - sum / n).powi(2)).sum::<f64>() / (n - 1.0);
        sum < APART.max(2.0 * (n * variance).sqrt())
    }
}

/// A group of columns that joined.
pub(super) struct Joined {
    /// The columns.
    pub keys: Vec<Key>,
    /// Effects that could not be told from it then, best first.
    pub aliases: Vec<String>,
}

/// Groups that join at most.
const MOST: usize = 8;
/// Aliases that are named of one.
const ALIASES: usize = 3;
/// Gain in ln L that tells two effects apart, however much the logs scatter, and logs below which their scatter is not known.
const APART: f64 = 3.0;
const FEW: f64 = 5.0;

/// The groups of `left` that join those `chosen`, and all that is chosen then. What single logs named comes first: they know its shape,
/// which no linear equation does.
pub(super) fn select(
    mut left: Vec<Vec<Key>>,
    mut chosen: BTreeSet<Key>,
    is_named: impl Fn(&Key) -> bool,
    ask: impl Fn(&[Key], &BTreeSet<Key>) -> Option<Answer> + Sync,
) -> (BTreeSet<Key>, Vec<Joined>) {
    let mut joined: Vec<Joined> = Vec::new();
    let mut named = true;
    while joined.len() < MOST {
        let asked: Vec<&Vec<Key>> = left.iter().filter(|keys| !named || keys.iter().any(&is_named)).collect();
        let answers = parallel::map(&asked, |keys| ask(keys, &chosen));
        let answers: Vec<(&Vec<Key>, Answer)> =
            asked.into_iter().zip(answers).filter_map(|(keys, answer)| Some((keys, answer?))).collect();
        let passing = || answers.iter().filter(|(_, answer)| answer.passes());
        let Some((keys, best)) = passing().max_by(|a, b| a.1.gain.total_cmp(&b.1.gain)) else {
            if named {
                named = false;
                continue;
            }
            break;
        };
        let id = &keys[0].effect;
        let mut alike: Vec<(f64, &String)> = passing()
            .filter(|(other, answer)| other[0].effect != *id && best.is_like(answer))
            .map(|(other, answer)| (answer.gain, &other[0].effect))
            .collect();
        alike.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut aliases: Vec<String> = Vec::new();
        for (_, name) in alike {
            if !aliases.contains(name) && aliases.len() < ALIASES {
                aliases.push(name.clone());
            }
        }
        let found = Joined { keys: (*keys).clone(), aliases };
        chosen.extend(found.keys.iter().cloned());
        left.retain(|other| other[0].effect != found.keys[0].effect);
        joined.push(found);
    }
    let is_needless = |joined: &Joined, chosen: &BTreeSet<Key>| {
        let rest: BTreeSet<Key> = chosen.iter().filter(|key| !joined.keys.contains(key)).cloned().collect();
        ask(&joined.keys, &rest).is_none_or(|answer| !answer.is_significant())
    };
    while let Some(place) = joined.iter().position(|one| is_needless(one, &chosen)) {
        let gone = joined.remove(place);
        chosen.retain(|key| !gone.keys.contains(key));
    }
    (chosen, joined)
}
