//! Labels, titles and short remarks of reports and pages.

use super::Voice;
use crate::{
    Axis,
    diagnosis::{LimitedBy, Verdict},
    units,
};

/// A verdict in words: `missing effect: delay`, `adequate`, …
#[must_use]
pub fn label(
    verdict: Verdict,
    suspect: Option<&str>,
    aliases: &[String],
    limit: Option<LimitedBy>,
    voice: Voice,
) -> String {
    match (verdict, suspect) {
        (Verdict::Adequate, _) if limit.is_some_and(LimitedBy::is_of_recording) => {
            format!("adequate, no effect is missing that {} can show", voice.log())
        }
        (Verdict::Adequate, _) => "adequate, what is left is noise".into(),
        (Verdict::MissingEffect, Some(effect)) => format!("missing effect: {effect}"),
        (Verdict::MissingEffect, None) => "an effect is missing".into(),
        (Verdict::Ambiguous, Some(effect)) => {
            let group: Vec<&str> = std::iter::once(effect).chain(aliases.iter().map(String::as_str)).collect();
            format!("ambiguous: {}", group.join(" or "))
        }
        (Verdict::Ambiguous, None) => "ambiguous: several effects fit equally well".into(),
        (Verdict::Unexplained, _) => "unexplained: more than noise is left, and no known effect removes it".into(),
        (Verdict::CannotTell, _) => format!("cannot tell: {} does not decide it", voice.log()),
        (Verdict::BadData, _) => "bad data".into(),
    }
}

/// What is said beside a scale factor that no gyro has.
#[must_use]
pub fn wrong_ratio(axis: Axis, alpha: f64) -> String {
    format!(
        "axis {axis}: no gyro's scale factor is off by {:.0} %: check the units of gyro and reference, the encoder's counts per turn, a \
         gear ratio, and the gyro's full-scale setting",
        100.0 * (alpha - 1.0).abs()
    )
}

/// What is said of an excess where nobody looked for its cause.
pub const NOT_SEARCHED: &str = "the model leaves more than noise";

/// A verdict in a cell of a table.
#[must_use]
pub fn brief(verdict: Verdict, searched: bool, several: bool, group: &[&str]) -> String {
    match verdict {
        Verdict::Adequate => "adequate".into(),
        Verdict::MissingEffect if several => "missing effects".into(),
        Verdict::MissingEffect if group.is_empty() => "an effect is missing".into(),
        Verdict::MissingEffect => "missing effect".into(),
        // Which they are says more than that they are several.
        Verdict::Ambiguous if group.is_empty() => "several effects fit equally well".into(),
        Verdict::Ambiguous => group.join(" or "),
        Verdict::Unexplained if !searched => NOT_SEARCHED.into(),
        Verdict::Unexplained => "unexplained".into(),
        Verdict::CannotTell => "cannot tell".into(),
        Verdict::BadData => "bad data".into(),
    }
}

/// What is said of a parameter that the log does not show, in place of its value.
#[must_use]
pub fn unseen(voice: Voice) -> String {
    format!("not seen on {}", voice.log())
}

/// What is said of effects that fit alike.
#[must_use]
pub fn cannot_be_told(from: &[&str]) -> String {
    format!("not distinguished from {}", from.join(", "))
}

/// What is said of an axis that needs nothing more.
pub const NOTHING: &str = "nothing is missing";

/// The title of a search.
pub const WHICH: &str = "Which physics is missing";

/// The title of a ladder.
pub const LADDER: &str = "The ladder: adding what is missing";

/// The label of an error curve with all effects that are named.
pub const WITH_ALL: &str = "with all that is missing";

/// The head of a list of suspects, where each is missing and where one of them is.
#[must_use]
pub const fn suspects(several: bool) -> &'static str {
    if several {
        "what is missing: sizes fitted together, and what each removes alone"
    } else {
        "suspects, likeliest first, and what each removes alone"
    }
}

/// What is said of a noise in which more than noise stands.
#[must_use]
pub const fn of_noise(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::MissingEffect | Verdict::Ambiguous | Verdict::Unexplained => " (too high while an effect is missing)",
        _ => "",
    }
}

/// Why a model with this effect cannot be made.
#[must_use]
pub fn no_shape(id: &str, axis: Axis, voice: Voice) -> String {
    format!("nothing in {} shows '{id}' on axis {axis}: there is no shape of it to add", voice.log())
}

/// What logs of several parts come to, where nothing is found.
pub const NOTHING_TOGETHER: &str =
    "Nothing is missing that these logs show together, and no part is other than its type.";

/// What is said of so many rows without a reading of an axis, the first of them at a time in s.
#[must_use]
pub fn unmeasured(axis: Axis, rows: u64, first: f64) -> String {
    let (rows, have, their) = match rows {
        1 => ("1 row".to_owned(), "has", "its"),
        rows => (format!("{} rows", units::thousands(rows)), "have", "their"),
    };
    format!(
        "{rows} {have} no reading of gyro_{axis} (first at {first:.2} s): {their} rate_{axis} is empty; angle_{axis} goes on by the \
         rate before"
    )
}

/// What is said of a log at other temperatures than those that a model was fitted at, °C: by so many kelvin it is hotter or colder.
#[must_use]
pub fn at_other_temperature(beyond: f64, word: &str, here: (f64, f64), fitted: (f64, f64), voice: Voice) -> String {
    format!(
        "{} is up to {beyond:.0} K {word} than the model's: it was recorded at {:.1} to {:.1} °C, and the model was fitted at {:.1} to \
         {:.1} °C.",
        voice.log_first(),
        here.0,
        here.1,
        fitted.0,
        fitted.1
    )
}
