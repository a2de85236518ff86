//! What repeats and what does not, in sentences.

use super::shared::OtherScale;
use gyro_model::{
    Axis,
    diagnosis::{AxisResult, Diagnosis, ParameterValue, Repeats},
    effects::{Stage, are_aliases, find},
    headline,
    measured::{Measured, and},
    pooled::{
        joint::Joint,
        search::{DIFFERS, Repeated, Whose, p_differs},
    },
};
use std::{collections::BTreeMap, fmt::Write as _};

/// Every effect that all logs show together, and every one that single logs name; `answers` have said what they name.
pub(super) fn repeats(
    names: &[String],
    alone: &[Diagnosis],
    repeated: &[Repeated],
    joint: &Joint,
    answers: &[AxisResult],
) -> Vec<Repeats> {
    let mut all: Vec<Repeats> = repeated.iter().map(|r| of_pool(names, r, joint)).collect();
    // What single logs name besides.
    let mut single: BTreeMap<(Axis, String), Vec<usize>> = BTreeMap::new();
    for (k, log) in alone.iter().enumerate() {
        for axis in log.axes.iter().filter(|axis| axis.finding.names()) {
            for suspect in &axis.suspects[..axis.suspects.len().min(axis.missing.len().max(1))] {
                let is_said = repeated.iter().any(|r| {
                    r.axis == axis.axis
                        && (r.effect == suspect.effect
                            || are_aliases(&r.effect, &suspect.effect)
                            || r.aliases.contains(&suspect.effect)
                            || suspect.aliases.contains(&r.effect))
                });
                if !is_said {
                    single.entry((axis.axis, suspect.effect.clone())).or_default().push(k);
                }
            }
        }
    }
    let is_said = |axis: Axis, effect: &str| {
        let own = answers.iter().find(|own| own.axis == axis && own.finding.names());
        own.and_then(|own| own.suspects.first()).is_some_and(|first| first.effect == effect)
    };
    // What the answer has just named comes first.
    let (first, rest): (Vec<_>, Vec<_>) = single.into_iter().partition(|((axis, effect), _)| is_said(*axis, effect));
    for (list, said) in [(first, true), (rest, false)] {
        all.extend(list.into_iter().map(|((axis, effect), logs)| of_logs(names, alone, axis, effect, &logs, said)));
    }
    all
}

fn of_pool(names: &[String], r: &Repeated, joint: &Joint) -> Repeats {
    let (shown, could) = r.shown_in();
    let of = |list: &[usize]| list.iter().map(|&k| names[k].clone()).collect::<Vec<_>>();
    let n = names.len();
    let having = joint.each.iter().filter(|own| own.alone.keys().any(|key| key.axis == r.axis)).count();
    let clause = clause(r, joint);
    let (of_whom, says) = match r.whose {
        _ if having < 2 => ("unknown", format!("Only one log has axis {}: whether it repeats is not known.", r.axis)),
        Whose::SetUp => (
            "set-up",
            format!(
                "{clause} in the mean of the logs, but not equal in all of them ({}): that is the set-up's, not the sensor's.",
                in_logs(&shown, names)
            ),
        ),
        Whose::Sensor if shown.len() == having => ("sensor", format!("It is so {}.", in_all(having, n))),
        Whose::Sensor if shown.is_empty() => {
            ("sensor", format!("{clause}: no log shows it alone, {} together do.", all_of(having)))
        }
        Whose::Sensor => {
            let rest = could.len() - shown.len();
            let cannot = having.saturating_sub(could.len());
            let mut says = format!("{} of {} logs show it alone", count(shown.len()), count(having));
            if rest > 0 {
                let _ = write!(says, ", {} more agree{}", count(rest), if rest == 1 { "s" } else { "" });
            }
            if cannot > 0 {
                let _ = write!(says, ", {} cannot", count(cannot));
            }
            ("sensor", capital(&format!("{says}.")))
        }
    };
    let says = if r.differs() { format!("{says} {}", sizes(names, r)) } else { says };
    Repeats {
        axis: r.axis,
        effect: r.effect.clone(),
        of: of_whom.to_owned(),
        shown_in: of(&shown),
        could_show: of(&could),
        p_differs: Some(r.p_differs).filter(|p| p.is_finite()),
        says,
    }
}

/// Logs of which each one's size is said.
const EACH: usize = 4;

/// The size that an effect has in each log, or from which to which it goes.
fn sizes(names: &[String], r: &Repeated) -> String {
    let principal = r.parameters.iter().max_by(|a, b| (a.1 / a.2).abs().total_cmp(&(b.1 / b.2).abs()));
    let unit = principal.and_then(|(key, ..)| key.card()).map_or("1", |card| card.unit);
    let told = (0..r.each.len()).filter_map(|k| r.each[k].map(|(value, error)| (&names[k], value, error)));
    let each = by_log(told.collect(), unit);
    format!("Its size is not the same in each: {each}. What it depends on changed between them.")
}

/// Values of logs, with their standard errors: `1.00 ± 0.01 ms in a.csv and 2.00 ± 0.01 ms in b.csv`; plain numbers where no unit is given.
fn by_log(mut told: Vec<(&String, f64, f64)>, unit: &str) -> String {
    let one = |(name, value, error): &(&String, f64, f64)| {
        let measured = Measured { value: *value, std_error: *error };
        let says = if unit.is_empty() { measured.plain() } else { measured.signed(unit) };
        format!("{says} in {name}")
    };
    if told.len() <= EACH {
        return and(&told.iter().map(one).collect::<Vec<_>>());
    }
    told.sort_by(|a, b| a.1.total_cmp(&b.1));
    format!("from {} to {}", one(&told[0]), one(&told[told.len() - 1]))
}

fn of_logs(
    names: &[String],
    alone: &[Diagnosis],
    axis: Axis,
    effect: String,
    logs: &[usize],
    is_said: bool,
) -> Repeats {
    let of_log = |k: &usize| {
        let own = alone[*k].axes.iter().find(|own| own.axis == axis)?;
        own.suspects.iter().find(|s| s.effect == effect).map(|suspect| suspect.parameters.as_slice())
    };
    let parameters = logs.first().and_then(of_log).unwrap_or_default();
    let clause = capital(&headline::clause(axis, &effect, parameters));
    let values = logs.iter().filter_map(|k| {
        let first = of_log(k)?.first()?;
        Some((&names[*k], first.value?, first.std_error.unwrap_or(f64::NAN)))
    });
    let values: Vec<(&String, f64, f64)> = values.collect();
    let readings: Vec<Option<(f64, f64)>> = values.iter().map(|(_, value, error)| Some((*value, *error))).collect();
    let is_one_size = values.len() > 1 && p_differs(&readings) > DIFFERS;
    let each = by_log(values, parameters.first().map_or("1", |first| &first.unit));
    let of = |list: &[usize]| list.iter().map(|&k| names[k].clone()).collect::<Vec<_>>();
    let having: Vec<usize> = (0..names.len()).filter(|&k| alone[k].axes.iter().any(|own| own.axis == axis)).collect();
    let (of_one, of_each) = ("it is of that set-up, not of the sensor", "it is of those set-ups, not of the sensor");
    let is_of_reference = find(&effect).is_some_and(|effect| matches!(effect.stage(), Stage::Reference | Stage::Shown));
    let (of_whom, says) = match (having.len(), logs.len(), is_said) {
        (has, shows, _) if has > 1 && shows == has && is_one_size => {
            let whose = if is_of_reference { ": it belongs to the reference, which they share" } else { "" };
            let (of, all) = (if is_of_reference { "set-up" } else { "sensor" }, in_all(has, names.len()));
            let by = if is_said { "By log".to_owned() } else { format!("{}, by log", capital(&effect)) };
            (of, format!("{by}: {each}. It has the same size {all}{whose}."))
        }
        (0 | 1, ..) => (
            "unknown",
            format!("No log but {} has axis {axis}: whether it repeats is not known.", of(&having).join(", ")),
        ),
        (_, 1, true) => ("set-up", format!("It is so only {}: {of_one}.", in_logs(logs, names))),
        (_, 1, false) => ("set-up", format!("Only {}: {clause}. It does not repeat: {of_one}.", in_logs(logs, names))),
        (_, _, true) => ("set-up", format!("By log: {each}. It does not repeat: {of_each}.")),
        (_, _, false) => ("set-up", format!("{}, by log: {each}. It does not repeat: {of_each}.", capital(&effect))),
    };
    Repeats { axis, effect, of: of_whom.to_owned(), shown_in: of(logs), could_show: of(&having), p_differs: None, says }
}

/// What is said of scale factors that differ.
pub(super) fn scales(names: &[String], other: &OtherScale) -> Repeats {
    let told = names.iter().zip(&other.each);
    let told: Vec<_> = told.filter_map(|(name, own)| own.map(|(value, error)| (name, value, error))).collect();
    let logs: Vec<String> = told.iter().map(|(name, ..)| (*name).clone()).collect();
    let says = format!(
        "The scale factor is not the same in each: {}. They are of several sensors, or their references have other ratios, or what it depends \
         on (the temperature, the supply) changed between them. Each log is judged with its own.",
        by_log(told, "")
    );
    Repeats {
        axis: other.key.axis,
        effect: other.key.effect.clone(),
        of: "unknown".to_owned(),
        shown_in: logs.clone(),
        could_show: logs,
        p_differs: Some(other.p_differs),
        says,
    }
}

/// `in both logs`, or `in both logs that have the axis` where others have not.
fn in_all(having: usize, logs: usize) -> String {
    let all = all_of(having);
    if having == logs { format!("in {all}") } else { format!("in {all} that have the axis") }
}

fn clause(r: &Repeated, joint: &Joint) -> String {
    let own = joint.model.axes[r.axis.index()].as_ref().and_then(|own| own.term(&r.effect));
    let of_term = own.map(|term| {
        let told = term.parameters(r.axis);
        told.map(|(card, value, error)| value_of(&r.effect, card.name, value, error)).collect::<Vec<_>>()
    });
    let parameters = of_term.unwrap_or_else(|| {
        r.parameters.iter().map(|(key, value, error)| value_of(&r.effect, &key.name, *value, *error)).collect()
    });
    let title =
        || find(&r.effect).map_or_else(|| r.effect.clone(), |effect| format!("{}: {}", r.effect, effect.card().title));
    let clause = headline::clause(r.axis, &r.effect, &parameters);
    if clause.contains("is missing from the model") { title() } else { capital(&clause) }
}

fn value_of(effect: &str, name: &str, value: f64, error: f64) -> ParameterValue {
    ParameterValue {
        effect: effect.to_owned(),
        name: name.to_owned(),
        value: Some(value),
        std_error: Some(error),
        unit: String::new(),
        typical: None,
    }
}

/// `in a.csv`, `in a.csv and c.csv`, `in 7 logs`.
fn in_logs(list: &[usize], names: &[String]) -> String {
    match list {
        [] => "in none alone".to_owned(),
        [one] => format!("in {}", names[*one]),
        [one, two] => format!("in {} and {}", names[*one], names[*two]),
        more => format!("in {} of {} logs", more.len(), names.len()),
    }
}

/// `both logs`, `all three logs`.
fn all_of(n: usize) -> String {
    if n == 2 { "both logs".to_owned() } else { format!("all {} logs", count(n)) }
}

fn count(n: usize) -> String {
    let words = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];
    words.get(n).map_or_else(|| n.to_string(), |word| (*word).to_owned())
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// What is said of an axis in which nothing was named.
pub(super) fn over_all(logs: usize) -> String {
    format!("So it is over {}.", all_of(logs))
}
