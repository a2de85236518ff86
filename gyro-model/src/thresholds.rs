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
    /// A very small p: needed by an effect that shows only once in a log, because a wandering bias can look like it.
    PLAIN = 1e-4, "1", ByHand;
    /// J up to which the error may be noise.
    NOISE = 1.2, "1", ByHand;
    /// J above which the model is too wrong for the likelihood to be trusted.
    ROUGH = 1.5, "1", ByHand;
    /// J₁/J₀ below which an effect lowers the error, beside the base model alone.
    LOWERS = 1.0, "1", Derived("the error has to fall");
    /// The same beside other effects: their equations are exact only to a small share of what they remove.
    LOWERS_BESIDE_OTHERS = 0.996, "1", ByHand;
    /// J₁/J₀ that J may reach by chance near the floor.
    SCATTERS = 1.01, "1", ByHand;
    /// Error with an effect over that without it, at any averaging time where it is more than noise.
    GROWS = 1.1, "1", ByHand;
    /// Share of J − 1 that an effect has to remove.
    SHARE = 0.1, "1", ByHand;
    /// Share of J − 1 with which an effect dominates the error; other missing effects may then hide its gain in ln L.
    DOMINATES = 0.4, "1", ByHand;
    /// Fall of the error, ln(J₀/J₁) over the blocks, that chance does not bring.
    FALLS = 4.0, "standard errors", ByHand;
    /// The same for a slow effect, which shows more in some blocks than in others.
    FALLS_SLOWLY = 3.0, "standard errors", ByHand;
    /// The same where the likelihood improves on held-out data too.
    FALLS_TOO = 2.0, "standard errors", Literature("two-sided 95 %");
    /// The same where the whole sensor has the effect and another axis shows it.
    FALLS_ALIKE = 1.0, "standard errors", ByHand;
    /// Held-out gain in ln L that one block alone cannot bring: the gain of one block is one standard error.
    HELD_OUT = 1.2, "standard errors", Derived("one block's gain is one standard error; a fifth more");
    /// The same where an effect is clear throughout the log.
    CLEAR = 4.0, "standard errors", ByHand;
    /// Held-out gain in ln L of an effect that does not hold.
    NOTHING = 0.0, "standard errors", Derived("a gain is positive");
    /// Share of the gain in ln L that has to hold on held-out data.
    HOLDS = 0.25, "1", ByHand;
    /// Largest gain in ln L that this share is taken of.
    GAIN_COUNTED = 40.0, "1", ByHand;
    /// A coefficient over its typical size, while much error is unexplained.
    OUTSIZED = 20.0, "1", ByHand;
    /// Standard error of a parameter over its own size, from which on the log does not show the parameter.
    KNOWN = 1.0, "1", Derived("a value within one standard error of nothing may be nothing");
    /// Standard error of an instant, over the length of the log, from which on the log does not show when something began.
    INSTANT = 0.1, "1", Derived("the instant lies in one part of the log of ten");
    /// Swings of an effect's error that a wandering bias would not follow by chance.
    SWINGS = 6.0, "swings", ByHand;
    /// Difference in ln J to which an optimum is found.
    ERROR_FOUND_TO = 1e-3, "1", ByHand;
    /// Difference in ln L to which an optimum is found.
    GAIN_FOUND_TO = 0.25, "1", ByHand;
    /// The same of two aliases: how each is compensated between samples changes the noise by as much.
    GAIN_WITHIN_FORM = 2.0, "1", ByHand;
    /// Difference of two effects that tells them apart.
    APART = 2.0, "standard errors", Literature("two-sided 95 %");
    /// Larger over smaller J of two effects on the rows that they keep, where only one leaves rows out.
    KEPT_ALIKE = 1.5, "1", ByHand;
    /// Ratio of J of two effects that counts as equal.
    CLOSE = 1.03, "1", ByHand;
    /// The same where a plainer effect is preferred.
    CLOSE_IF_PLAINER = 1.1, "1", ByHand;
    /// Share of the held-out gain in ln L that counts as equal.
    GAIN_CLOSE = 0.97, "1", ByHand;
    /// Gain in ln L that one more parameter is worth.
    PARAMETER = 4.0, "1", Literature("Schwarz 1978: ln(n)/2, some thousand readings");
    /// One parameter more, and not two.
    ONE_PARAMETER = 1.5, "parameters", Derived("between one and two");
    /// Squared correlation of what two effects remove, above which they may be aliases.
    SHARED = 0.1, "1", ByHand;
    /// The same above which an effect that begins at an instant is replaced by the one that is there all the time.
    THE_SAME = 0.95, "1", Derived("1/(1 − R²), the variance inflation factor, is 20: twice what counts as collinear (Marquardt 1970)");
    /// J with an effect over J without it below which it stays, whatever its significance.
    NEEDED = 0.9, "1", ByHand;
    /// Size of an effect in its standard errors that keeps it, by all of its parameters together (Wald test).
    WALD = 4.0, "standard errors", Derived("p = 6e-5, and 0.002 after Bonferroni over 28 effects");
    /// The same where more than noise is left without it.
    WALD_NEEDED = 2.0, "standard errors", Literature("two-sided 95 %");
    /// J that all suspects together leave by the score test, above which no three of them can reduce the error to noise.
    OUT_OF_REACH = 4.0, "1", ByHand;
    /// Largest error over floor at one averaging time that starts a look-ahead.
    ABOVE = 1.4, "1", ByHand;
    /// Gain in ln L of each of two effects beside the other that chance does not bring among all pairs.
    TOGETHER = 15.0, "1", Derived("χ² with one degree of freedom: p = 4e-8, and 1.6e-5 after Bonferroni over 378 pairs");
    /// Share of each of two effects that the other does not span, needed to try them together.
    OWN_OF_PAIR = 0.01, "1", ByHand;
    /// The same for two aliases.
    OWN_BESIDE_ALIAS = 0.5, "1", ByHand;
    /// An exact refit leaves at least this share of the error that the score test predicts, and gains at most its inverse in ln L.
    GRID = 0.4, "1", Calibrated("make_cases --seed 301, 302, 303 --count 20: the names were those of the full search");
    /// Share of J that the score test has to predict for an exact refit.
    PROMISES = 0.02, "1", ByHand;
    /// Gain in ln L, less its degrees of freedom, that the score test has to predict for an exact refit.
    NOTICEABLE = 3.0, "1", ByHand;
    /// No difference.
    NO_MORE = 0.0, "1", Derived("a difference has a sign");
    /// Share by which an effect of the whole sensor may differ from axis to axis.
    ALIKE_ON_AXES = 0.3, "1", ByHand;
    /// Standard error of the scale factor, over its value, above which the log does not show it.
    UNEXCITED = 0.03, "1", ByHand;
    /// Loss in ln L with the nearest noise that sensors have, above which what is left is not such noise.
    UNUSUAL = 4.0, "1", ByHand;
    /// Gain in ln L of a slow effect that a wandering bias may hide.
    SLOW_HIDDEN = 5.0, "1", ByHand;
    /// Largest error over its floor that may be called a wandering bias.
    WANDER = 3.0, "1", ByHand;
    /// Share of the error² that may have no known cause where the rest is explained.
    EXPLAINED = 0.2, "1", ByHand;
    /// Share of the judged steps that an effect may mark as unknown.
    LEAVES_OUT = 0.966, "1", Derived("29 of the 30 blocks that a log is cut into: less than one is left to judge it by");
    /// Share of a log that may be left out before the rest is not enough for a verdict.
    SILENT = 0.6, "1", ByHand;
    /// Share of a log left out that is reported.
    MENTIONED = 0.02, "1", ByHand;
    /// Length of a log, s, that is too short to show slow effects.
    BRIEF = 10.0, "s", ByHand;
    /// Correlation time of a rate error, in readings, up to which it counts as white noise.
    FORGOTTEN = 10.0, "readings", ByHand;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many values rest on nothing but trials by hand: this number may only fall.
    #[test]
    fn no_more_thresholds_are_set_by_hand_than_before() {
        let by_hand = ALL.iter().filter(|t| t.origin == ByHand).count();
        assert_eq!(by_hand, 42, "a threshold needs an origin; lower this number where one got it");
    }

    #[test]
    fn each_threshold_says_what_it_is() {
        for threshold in ALL {
            assert!(threshold.says.trim().len() > 10 && threshold.value.is_finite(), "{}", threshold.name);
        }
    }
}
