//! Whether the diagnosis of a stream has settled: enough motion was seen, and searches in a row say the same.

/// A name counts when so many searches in a row give it.
pub const AGREE: u32 = 2;
/// Motion before a name counts, ns. In the first seconds of a drive a lag is taken for a delay and a clock that runs apart
/// for one that was set; effects that settle or drift take longest to be told apart.
pub const ENOUGH_NS: i64 = 30_000_000_000;

/// What the searches have named, axis by axis; no name is the default one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Agreement<Name> {
    search: u64,
    named: [Named<Name>; 3],
}

#[derive(Clone, Copy, Debug, Default)]
struct Named<Name> {
    effect: Name,
    searches: u32,
}

impl<Name: Copy + Default + PartialEq> Agreement<Name> {
    /// Takes what the newest judgement names, of which several may rest on one search; how many searches in a row have said so.
    /// Search 0 is none yet.
    pub fn take(&mut self, search: u64, names: [Name; 3]) -> [u32; 3] {
        if search == 0 {
            // Nobody has searched with this model yet.
            *self = Self::default();
        } else if search != self.search {
            self.search = search;
            for (named, effect) in self.named.iter_mut().zip(names) {
                let searches = if effect == named.effect { named.searches.saturating_add(1) } else { 1 };
                *named = Named { effect, searches };
            }
        }
        std::array::from_fn(|i| if names[i] == self.named[i].effect { self.named[i].searches } else { 0 })
    }
}

/// Whether a verdict names an effect, alone or beside others that look the same.
#[must_use]
pub fn is_named(verdict: &str) -> bool {
    matches!(verdict, "missing-effect" | "ambiguous")
}

/// Whether what so many searches in a row have said, over so much motion, is to be believed.
#[must_use]
pub fn is_settled(agreed: u32, seen_ns: i64) -> bool {
    seen_ns >= ENOUGH_NS && agreed >= AGREE
}

/// What to say of an axis in place of its headline as long as that may still change; `None` where it has settled, or where
/// the data themselves are in question.
#[must_use]
pub fn looking(verdict: &str, agreed: u32, seen_ns: i64) -> Option<String> {
    let stands = match verdict {
        "missing-effect" | "ambiguous" | "unexplained" => "More than noise is left. Looking for the cause",
        "adequate" => "Nothing stands out so far",
        _ => return None,
    };
    if is_settled(agreed, seen_ns) {
        return None;
    }
    let seconds = |ns: i64| ns / 1_000_000_000;
    Some(if seen_ns < ENOUGH_NS {
        format!("{stands}: {} of {} s of motion seen.", seconds(seen_ns), seconds(ENOUGH_NS))
    } else if agreed + 1 >= AGREE {
        format!("{stands}: one more search will tell.")
    } else {
        format!("{stands}: searching.")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_are_counted_not_judgements_and_another_name_counts_anew() {
        let mut agreement = Agreement::default();
        let mut agreed = |search, name| agreement.take(search, ["", "", name])[2];
        assert_eq!([agreed(1, "lag"), agreed(2, "delay"), agreed(2, "delay"), agreed(3, "delay")], [1, 1, 1, 2]);
        // A judgement between two searches that says otherwise, and a model that nobody has searched with.
        assert_eq!([agreed(3, "lag"), agreed(3, "delay"), agreed(0, ""), agreed(4, "delay")], [0, 2, 0, 1]);
    }

    #[test]
    fn it_is_said_what_is_waited_for() {
        let says = |verdict, agreed, seconds: i64| looking(verdict, agreed, seconds * 1_000_000_000);
        assert_eq!(
            says("unexplained", 2, 29).as_deref(),
            Some("More than noise is left. Looking for the cause: 29 of 30 s of motion seen.")
        );
        assert_eq!(says("adequate", 1, 31).as_deref(), Some("Nothing stands out so far: one more search will tell."));
        assert_eq!(says("missing-effect", 2, 30), None);
        assert_eq!(says("bad-data", 0, 40), None);
    }
}
