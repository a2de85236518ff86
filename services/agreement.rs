//! Whether a live diagnosis has settled, as its message says it: the compensator counts, and every watcher reads it there.

use ipc_types::{Diagnosis, Text, diagnosis::AxisResult};
use workbench::agreement::{self, is_settled};
pub use workbench::agreement::{AGREE, ENOUGH_NS};

/// What the searches have named, axis by axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Agreement(agreement::Agreement<Text<38>>);

/// Whether a judgement names an effect, alone or beside others that look the same.
#[must_use]
pub fn is_named(axis: &AxisResult) -> bool {
    agreement::is_named(axis.verdict.as_str())
}

/// The effect that a judgement names; empty where it names none.
fn name(axis: &AxisResult) -> Text<38> {
    if is_named(axis) { axis.suspects[0].effect } else { Text::EMPTY }
}

impl Agreement {
    /// Takes the newest judgement, of which several may rest on one search, and writes into it how far the searches agree.
    pub fn take(&mut self, diagnosis: &mut Diagnosis) {
        let agreed = self.0.take(diagnosis.search, diagnosis.axes.each_ref().map(name));
        let seen = seen_ns(diagnosis);
        for (agreed, axis) in agreed.into_iter().zip(&mut diagnosis.axes) {
            axis.agreed = agreed;
            axis.settled = u32::from(is_settled(agreed, seen));
        }
    }
}

/// The motion that a judgement rests on, ns.
#[must_use]
pub fn seen_ns(diagnosis: &Diagnosis) -> i64 {
    diagnosis.to_ns - diagnosis.from_ns
}

/// What to say of an axis in place of its headline as long as that may still change; `None` where it has settled, or where
/// the data themselves are in question.
#[must_use]
pub fn looking(diagnosis: &Diagnosis, place: usize) -> Option<String> {
    let axis = &diagnosis.axes[place];
    if axis.present == 0 || axis.settled == 1 {
        return None;
    }
    agreement::looking(axis.verdict.as_str(), axis.agreed, seen_ns(diagnosis))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(search: u64, seconds: i64, verdict: &str, effect: &str) -> Diagnosis {
        let mut diagnosis = Diagnosis { search, to_ns: 1_000_000_000 * seconds, ..Diagnosis::default() };
        let axis = &mut diagnosis.axes[2];
        (axis.present, axis.verdict) = (1, Text::new(verdict));
        axis.suspects[0].effect = Text::new(effect);
        diagnosis
    }

    /// What is said after each of these: number of the search, seconds of motion, verdict, what is named.
    fn said(all: &[(u64, i64, &str, &str)]) -> Vec<Option<String>> {
        let mut agreement = Agreement::default();
        let take = |&(search, seconds, verdict, effect): &(u64, i64, &str, &str)| {
            let mut diagnosis = judged(search, seconds, verdict, effect);
            agreement.take(&mut diagnosis);
            looking(&diagnosis, 2)
        };
        all.iter().map(take).collect()
    }

    /// Whether each of these has settled, all with a missing effect.
    fn settled(all: &[(u64, i64, &str)]) -> Vec<bool> {
        let all: Vec<_> =
            all.iter().map(|&(search, seconds, effect)| (search, seconds, "missing-effect", effect)).collect();
        said(&all).iter().map(Option::is_none).collect()
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

    #[test]
    fn it_is_said_what_is_waited_for_and_that_nothing_is_missing_settles_too() {
        let says =
            said(&[(1, 12, "adequate", ""), (1, 31, "adequate", ""), (2, 32, "adequate", ""), (0, 33, "adequate", "")]);
        assert_eq!(says[0].as_deref(), Some("Nothing stands out so far: 12 of 30 s of motion seen."));
        assert_eq!(says[1].as_deref(), Some("Nothing stands out so far: one more search will tell."));
        assert_eq!(says[2], None);
        assert_eq!(says[3].as_deref(), Some("Nothing stands out so far: searching."));
        let says = said(&[(1, 29, "unexplained", ""), (2, 40, "bad-data", "")]);
        assert_eq!(
            says[0].as_deref(),
            Some("More than noise is left. Looking for the cause: 29 of 30 s of motion seen.")
        );
        assert_eq!(says[1], None);
    }
}
