//! Every number that a decision of the search is held against.
//!
//! J is the held-out mean square error over the floor's, the mean of (E(τ)/F(τ))² over the averaging times: 1 where nothing but
//! noise is left. p is the chance of a gain in ln L from noise alone, corrected for the whole search (Bonferroni).

/// A number that a measure is held against.
#[derive(Clone, Copy, Debug)]
pub struct Threshold {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What it stands for.
    pub says: &'static str,
    /// Where the value comes from.
    pub origin: Origin,
}

/// Where a threshold's value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// It follows from an equation.
    Derived(&'static str),
    /// It is a convention of the field.
    Literature(&'static str),
    /// It was swept on simulated logs by this command.
    Calibrated(&'static str),
    /// It was set by hand on simulated logs, and not swept since.
    ByHand,
}

use Origin::{ByHand, Calibrated, Derived, Literature};

macro_rules! thresholds {
    ($($(#[doc = $says:literal])+ $name:ident = $value:expr, $unit:literal, $origin:expr;)+) => {
        $($(#[doc = $says])+ pub const $name: Threshold = Threshold {
            name: stringify!($name), value: $value, unit: $unit, says: concat!($($says),+), origin: $origin,
        };)+
        /// All of them.
        pub const ALL: &[Threshold] = &[$($name),+];
    };
}

thresholds! {
    /// p that an effect needs.
    SIGNIFICANCE = 2e-3, "1", ByHand;
    /// p at which an effect is plain: needed by what shows once in a log, which a bias that wanders may make too.
    PLAIN = 1e-4, "1", ByHand;
    /// J up to which the error may be noise.
    NOISE = 1.2, "1", ByHand;
    /// J above which the model is wrong enough that the likelihood, which trusts it, says little.
    ROUGH = 1.5, "1", ByHand;
    /// J₁/J₀ that an effect has to bring beside the base model.
    LOWERS = 1.0, "1", Derived("the error has to fall");
    /// J₁/J₀ that an effect has to bring beside other effects, whose forms are right to a small share of what they remove.
    LOWERS_BESIDE_OTHERS = 0.996, "1", ByHand;
    /// J₁/J₀ that is within what J scatters by near the floor.
    SCATTERS = 1.01, "1", ByHand;
    /// Error with an effect over that without it, at any averaging time where it is more than noise.
    GROWS = 1.1, "1", ByHand;
    /// Share of J − 1 that an effect has to remove.
    SHARE = 0.1, "1", ByHand;
    /// Share of J − 1 that makes up for a likelihood which drowns in other missing physics.
    DOMINATES = 0.4, "1", ByHand;
    /// Fall of the error, ln(J₀/J₁) over the blocks, that is no chance.
    FALLS = 4.0, "standard errors", ByHand;
    /// The same for an effect that goes slowly: it differs from its mean in some blocks more than in others.
    FALLS_SLOWLY = 3.0, "standard errors", ByHand;
    /// The same where the likelihood holds on data that were not fitted, too.
    FALLS_TOO = 2.0, "standard errors", Literature("two-sided 95 %");
    /// The same where the whole sensor has the effect and another axis shows it.
    FALLS_ALIKE = 1.0, "standard errors", ByHand;
    /// Gain in ln L on data that were not fitted, that one block alone cannot bring: it has a standard error of one.
    HELD_OUT = 1.2, "standard errors", Derived("one block's gain is one standard error; a fifth more");
    /// The same where an effect is clear throughout the log.
    CLEAR = 4.0, "standard errors", ByHand;
    /// Held-out gain in ln L where nothing holds.
    NOTHING = 0.0, "standard errors", Derived("a gain is positive");
    /// Share of the gain in ln L that has to hold on data that were not fitted.
    HOLDS = 0.25, "1", ByHand;
    /// Gain in ln L that is compared with at most.
    GAIN_COUNTED = 40.0, "1", ByHand;
    /// A coefficient over its typical size, while much is left unexplained.
    OUTSIZED = 20.0, "1", ByHand;
    /// Swings of an effect's error from which on a bias that wanders would have to follow it too often.
    SWINGS = 6.0, "swings", ByHand;
    /// ln J of two effects apart that no optimum is found to.
    ERROR_FOUND_TO = 1e-3, "1", ByHand;
    /// ln L of two effects apart that no optimum is found to.
    GAIN_FOUND_TO = 0.25, "1", ByHand;
    /// The same of two that may be taken for one another: how either is undone between samples makes as much of the noise.
    GAIN_WITHIN_FORM = 2.0, "1", ByHand;
    /// Standard errors that two effects lie apart where a log tells them apart.
    APART = 2.0, "standard errors", Literature("two-sided 95 %");
    /// Kept J of two effects, larger over smaller, where only one leaves rows out.
    KEPT_ALIKE = 1.5, "1", ByHand;
    /// J of two effects, one over the other, that counts as equal.
    CLOSE = 1.03, "1", ByHand;
    /// The same where a plainer effect is preferred.
    CLOSE_IF_PLAINER = 1.1, "1", ByHand;
    /// Share of the held-out gain in ln L that counts as equal.
    GAIN_CLOSE = 0.97, "1", ByHand;
    /// Gain in ln L that one more parameter is worth.
    PARAMETER = 4.0, "1", Literature("Schwarz 1978: ln(n)/2, some thousand readings");
    /// One parameter more, and not two.
    ONE_PARAMETER = 1.5, "parameters", Derived("between one and two");
    /// Squared correlation of what two effects take out, from which on one may be the other.
    SHARED = 0.1, "1", ByHand;
    /// The same from which on what begins at an instant is the plainer effect that is there throughout.
    THE_SAME = 0.95, "1", Derived("1/(1 − R²), the variance inflation factor, is 20: twice what counts as collinear (Marquardt 1970)");
    /// J₁/J₀ that a removed effect may not cost, whatever its significance.
    NEEDED = 0.9, "1", ByHand;
    /// Size of an effect in its own standard errors, all that the model knows of its parameters used, that keeps it (Wald test).
    WALD = 3.0, "standard errors", Derived("of 26 effects that are nothing, noise brings 1.2 beyond two standard errors and 0.07 beyond three");
    /// The same where an error is left without it that is not noise.
    WALD_NEEDED = 2.0, "standard errors", Literature("two-sided 95 %");
    /// J that all suspects together leave, by the score test, beyond which no three of them end in noise.
    OUT_OF_REACH = 4.0, "1", ByHand;
    /// Largest error over floor at one averaging time that is worth a look ahead.
    ABOVE = 1.4, "1", ByHand;
    /// Gain in ln L of each of two effects beside the other that is no chance among all pairs.
    TOGETHER = 15.0, "1", Derived("χ² with one degree of freedom: p = 4e-8, and 1.4e-5 after Bonferroni over 325 pairs");
    /// Share of its own that each of two effects has to show to be tried together.
    OWN_OF_PAIR = 0.01, "1", ByHand;
    /// The same of an effect beside one that it may be taken for.
    OWN_BESIDE_ALIAS = 0.5, "1", ByHand;
    /// An exact refit leaves at least this share of the error that the score test predicts, and gains at most its inverse in ln L.
    GRID = 0.4, "1", Calibrated("make_cases --seed 301, 302, 303 --count 20: the names were those of the full search");
    /// Share of J that the score test has to promise for an exact refit.
    PROMISES = 0.02, "1", ByHand;
    /// Gain in ln L, less its degrees of freedom, that the score test has to promise for an exact refit.
    NOTICEABLE = 3.0, "1", ByHand;
    /// No difference.
    NO_MORE = 0.0, "1", Derived("a difference has a sign");
    /// Share by which what a whole sensor has may differ from axis to axis.
    ALIKE_ON_AXES = 0.3, "1", ByHand;
    /// Standard error of the scale factor, over its value, beyond which a log does not tell it.
    UNEXCITED = 0.03, "1", ByHand;
    /// Cost in ln L of the nearest noise that sensors have, beyond which what is left is no such noise.
    UNUSUAL = 4.0, "1", ByHand;
    /// Gain in ln L of a slow effect that a wandering bias may hide.
    SLOW_HIDDEN = 5.0, "1", ByHand;
    /// Largest error over its floor that a wandering bias is believed to leave.
    WANDER = 3.0, "1", ByHand;
    /// Share of a log that may be left out before the rest is not enough for a verdict.
    SILENT = 0.6, "1", ByHand;
    /// Share of a log left out that is worth a sentence.
    MENTIONED = 0.02, "1", ByHand;
    /// Length of a log, s, that shows little of what adds up slowly.
    BRIEF = 10.0, "s", ByHand;
    /// Readings within which a rate error is forgotten that is no wandering bias.
    FORGOTTEN = 10.0, "readings", ByHand;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many values rest on nothing but trials by hand: this number may only fall.
    #[test]
    fn no_more_thresholds_are_set_by_hand_than_before() {
        let by_hand = ALL.iter().filter(|t| t.origin == ByHand).count();
        assert_eq!(by_hand, 41, "a threshold needs an origin; lower this number where one got it");
    }

    #[test]
    fn each_threshold_says_what_it_is() {
        for threshold in ALL {
            assert!(threshold.says.trim().len() > 10 && threshold.value.is_finite(), "{}", threshold.name);
        }
    }
}
