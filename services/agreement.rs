//! Whether a live diagnosis has settled: enough motion was seen, and searches in a row name the same.

use ipc_types::{Diagnosis, Text, diagnosis::AxisDiagnosis};

/// A name counts when so many searches in a row give it.
pub const AGREE: usize = 2;
/// Motion before a name counts, ns. In the first seconds of a drive a lag is taken for a delay and a clock that runs apart
/// for one that was set; effects that settle or drift take longest to be told apart.
pub const ENOUGH_NS: i64 = 30_000_000_000;

/// What the searches have named, axis by axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Agreement {
    search: u64,
    named: [Named; 3],
}

#[derive(Clone, Copy, Debug)]
struct Named {
    effect: Text<38>,
    searches: usize,
}

impl Default for Named {
    fn default() -> Self {
        Self { effect: Text::EMPTY, searches: 0 }
    }
}

/// The effect that a judgement names, or looks like others; empty where it names none.
fn name(axis: &AxisDiagnosis) -> Text<38> {
    let named = matches!(axis.verdict.as_str(), "missing-effect" | "ambiguous");
    if named { axis.suspects[0].effect } else { Text::EMPTY }
}

impl Agreement {
    /// Takes the newest judgement; several may rest on one search.
    pub fn take(&mut self, diagnosis: &Diagnosis) {
        if diagnosis.search == 0 {
            // Nobody has searched with this model yet.
            *self = Self::default();
        } else if diagnosis.search != self.search {
            self.search = diagnosis.search;
            for (named, axis) in self.named.iter_mut().zip(&diagnosis.axes) {
                let effect = name(axis);
                let searches = if effect == named.effect { named.searches + 1 } else { 1 };
                *named = Named { effect, searches };
            }
        }
    }

    /// Whether what this judgement names on an axis has settled.
    #[must_use]
    pub fn is_settled(&self, diagnosis: &Diagnosis, place: usize) -> bool {
        let named = &self.named[place];
        named.searches >= AGREE && name(&diagnosis.axes[place]) == named.effect && seen_ns(diagnosis) >= ENOUGH_NS
    }
}

/// The motion that a judgement rests on, ns.
#[must_use]
pub fn seen_ns(diagnosis: &Diagnosis) -> i64 {
    diagnosis.to_ns - diagnosis.from_ns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(search: u64, seconds: i64, effect: &str) -> Diagnosis {
        let mut diagnosis = Diagnosis { search, to_ns: 1_000_000_000 * seconds, ..Diagnosis::default() };
        diagnosis.axes[2].verdict = Text::new("missing-effect");
        diagnosis.axes[2].suspects[0].effect = Text::new(effect);
        diagnosis
    }

    /// Whether each of these has settled: number of the search, seconds of motion, what is named.
    fn settled(all: &[(u64, i64, &str)]) -> Vec<bool> {
        let mut agreement = Agreement::default();
        let take = |&(search, seconds, effect): &(u64, i64, &str)| {
            let diagnosis = judged(search, seconds, effect);
            agreement.take(&diagnosis);
            agreement.is_settled(&diagnosis, 2)
        };
        all.iter().map(take).collect()
    }

    #[test]
    fn a_name_settles_with_two_searches_over_enough_motion() {
        let all = [(1, 40, "lag"), (2, 41, "delay"), (2, 42, "delay"), (3, 43, "delay")];
        assert_eq!(settled(&all), [false, false, false, true]);
        assert_eq!(settled(&[(1, 3, "lag"), (2, 4, "lag")]), [false, false]);
    }

    #[test]
    fn a_model_that_nobody_has_searched_with_begins_anew() {
        assert_eq!(
            settled(&[(1, 40, "lag"), (2, 41, "lag"), (0, 42, ""), (3, 43, "lag")]),
            [false, true, false, false]
        );
    }
}
