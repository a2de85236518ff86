//! The answer in a sentence or two: what the gyro does, with its number, what that makes of error, and what is left once it is taken out.
//!
//! ```text
//! effect's sentence ─┐
//! error at 1 s ──────┼─▶ "Your gyro is 10.05 ± 0.05 ms late. That makes 0.51 °/s of error over 1 s; corrected, 0.035 is left, which is noise."
//! error without it ──┘    at the source: "stamp the reading at the sensor's interrupt …"
//! ```

mod against;
mod left;
mod rotation;
pub mod sides;
#[cfg(test)]
mod tests;
mod together;
mod won;

pub use against::{Beside, Standing, by_which, of_against};
pub use left::{Fall, said};
pub use rotation::Rotation;
pub use together::{Named, Shared, Together};
pub use won::{fall, gain, won};

use crate::{
    Axis,
    diagnosis::{AxisResult, BudgetPoint, ErrorPoint, LadderStep, Limit, LimitedBy, ParameterValue, Suspect, Verdict},
    effects,
    finding::{Excess, Finding, Remark, ZeroMoves},
    measured::{Measured, and},
    units,
    words::{self, Voice},
};
use itertools::Itertools;
use left::{changes_little, corrected, is_noise, left, makes, rest, same_time};

/// The answer, and what to do where it comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Headline {
    /// One to three sentences.
    pub answer: String,
    /// What to do on the vehicle, a sentence without its beginning; empty where nothing is to be done.
    pub at_source: String,
}

/// Of `compare`, `diagnose` and `ladder`.
#[must_use]
pub fn of(axis: &AxisResult, voice: Voice) -> Headline {
    of_beside(axis, &[], voice)
}

/// The same where some causes have been `told`, for several axes share them.
#[must_use]
pub fn of_beside(axis: &AxisResult, told: &[&str], voice: Voice) -> Headline {
    let says = match (axis.steps.first(), axis.steps.last()) {
        (Some(first), Some(last)) => climbed(axis, [first, last], told, voice),
        _ => diagnosed(axis, told, voice),
    };
    of_logs(says, axis)
}

/// With what several logs say of it.
fn of_logs(headline: Headline, axis: &AxisResult) -> Headline {
    let words = [headline.answer.as_str(), axis.of_logs.as_str()];
    let answer = words.into_iter().filter(|words| !words.is_empty()).collect::<Vec<_>>().join(" ");
    Headline { answer, ..headline }
}

fn diagnosed(axis: &AxisResult, told: &[&str], voice: Voice) -> Headline {
    let here = said(&axis.error_curve);
    match (axis.verdict, axis.suspects.first()) {
        (Verdict::MissingEffect, Some(best)) => missing(axis, best, told, voice),
        (Verdict::Ambiguous, Some(_)) => ambiguous(axis, voice),
        (Verdict::MissingEffect | Verdict::Ambiguous, None) => {
            only(format!("An effect is missing: {}.", left(here, axis.error_over_floor, voice)))
        }
        (Verdict::Adequate, _) => only(adequate(here, axis.within_floor, of_recording(axis), voice)),
        (Verdict::Unexplained, _) if other_zero(axis).is_some() => only(other_zero(axis).unwrap_or_default()),
        (Verdict::Unexplained, _) if axis.searched => unexplained(&left(here, axis.error_over_floor, voice), axis),
        (Verdict::Unexplained, _) => {
            only(format!("This model leaves more than noise: {}.", left(here, axis.error_over_floor, voice)))
        }
        (Verdict::CannotTell | Verdict::BadData, _) => only(short(axis.verdict, &words::lead(axis, voice), voice)),
    }
}

/// The effects that a ladder added and kept.
fn added(axis: &AxisResult) -> Vec<&str> {
    let started = axis.steps.iter().filter_map(|step| step.added.as_deref());
    started.filter(|id| axis.effects.iter().any(|e| e == id)).unique().collect()
}

/// Whether what a ladder added and kept is its answer.
#[must_use]
pub fn has_additions(axis: &AxisResult) -> bool {
    !added(axis).is_empty()
}

/// Of `ladder`: what was added is the answer.
fn climbed(axis: &AxisResult, [first, last]: [&LadderStep; 2], told: &[&str], voice: Voice) -> Headline {
    let added = added(axis);
    let here = said(&last.error_curve);
    let is_within = |p: &ErrorPoint| p.error.zip(p.floor_99).is_none_or(|(error, top)| error <= top);
    let within = last.error_curve.iter().all(is_within);
    if matches!(axis.verdict, Verdict::CannotTell | Verdict::BadData) && added.is_empty() {
        return only(short(axis.verdict, &words::lead(axis, voice), voice));
    }
    if let Some(says) = other_zero(axis).filter(|_| added.is_empty()) {
        return only(says);
    }
    if added.is_empty() {
        return match axis.verdict {
            Verdict::Adequate => only(adequate(here, Some(within), of_recording(axis), voice)),
            _ => unexplained(&left(here, last.error_over_floor, voice), axis),
        };
    }
    let own: Vec<&str> = added.iter().copied().filter(|id| !told.contains(id)).collect();
    let clauses: Vec<String> = own.iter().map(|id| clause(axis.axis, id, &axis.parameters)).collect();
    let mut answer = if own.is_empty() { String::new() } else { sentences(&clauses) };
    answer.push_str(&either_sensor(&axis.remarks, &own));
    if let Some((before, after)) = corrected(&first.error_curve, &last.error_curve) {
        let settled = matches!(axis.verdict, Verdict::Adequate | Verdict::Ambiguous);
        let rest = match limit(axis) {
            Some(limit) if !settled || axis.limited_by.is_some_and(LimitedBy::is_of_recording) => {
                format!(". Most of that: {}", limit.what)
            }
            _ => rest(&after, settled || within),
        };
        answer.push_str(&makes(subject(own.len(), added.len() - own.len()), before, after, &rest));
    } else if let Some(before) = said(&first.error_curve) {
        answer.push_str(&changes_little(if added.len() > 1 { "They change" } else { "It changes" }, before, voice));
    }
    if axis.verdict == Verdict::Ambiguous {
        let aliases: Vec<String> = axis.steps.iter().flat_map(|step| step.aliases.iter().map(|id| name(id))).collect();
        answer = format!("{answer} It may also be {}: {} cannot tell.", either(&aliases), voice.log());
    }
    Headline { answer: answer.trim_start().to_owned(), at_source: sources(&own) }
}

/// Of `add` and `remove`: the change is the answer.
#[must_use]
pub fn of_change(
    added: &[String],
    removed: &[String],
    before: Option<&AxisResult>,
    after: &AxisResult,
    voice: Voice,
) -> Headline {
    let changes: Vec<String> = added
        .iter()
        .filter(|id| after.effects.contains(id))
        .map(|id| format!("{} added", name(id)))
        .chain(removed.iter().map(|id| format!("{} removed", name(id))))
        .collect();
    let pair = before.and_then(|b| same_time(&b.error_curve, &after.error_curve));
    let fall = pair.map_or_else(String::new, |(old, new)| {
        format!(
            ": the error over {} goes from {} to {} °/s{}",
            units::time(new.tau_s),
            units::rate(old.error),
            units::rate(new.error),
            if is_noise(&new) { ", which is noise" } else { "" }
        )
    });
    let ids: Vec<&str> = added.iter().map(String::as_str).filter(|id| after.effects.iter().any(|e| e == id)).collect();
    if !ids.is_empty() && !ids.iter().any(|id| is_told(after.axis, id, &after.parameters)) {
        let answer = format!(
            "{} But {} cannot distinguish it from zero.",
            sentence(&format!("{}{fall}", and(&changes))),
            voice.log()
        );
        return only(answer);
    }
    let clauses: Vec<String> = ids.iter().map(|id| clause(after.axis, id, &after.parameters)).collect();
    let says = if clauses.is_empty() { String::new() } else { format!(" {}", sentences(&clauses)) };
    Headline { answer: format!("{}{says}", sentence(&format!("{}{fall}", and(&changes)))), at_source: sources(&ids) }
}

/// Puts the words into results: what they say, and the headlines.
pub fn fill(axes: &mut [AxisResult], voice: Voice) {
    for axis in axes {
        axis.says = words::says(&*axis, voice);
        let headline = of(axis, voice);
        (axis.headline, axis.at_source) = (headline.answer, headline.at_source);
    }
}

/// What an effect does with these parameters, as a clause; its name where a parameter has no value.
#[must_use]
pub fn clause(axis: Axis, id: &str, parameters: &[ParameterValue]) -> String {
    let Some(effect) = effects::find(id) else { return own_clause(id, parameters) };
    let value = |name: &str| {
        let found = parameters.iter().find(|p| p.effect == id && p.name == name)?;
        Some(Measured { value: found.value?, std_error: found.std_error.unwrap_or(f64::NAN) })
    };
    let values: Option<Vec<Measured>> =
        effect.parameters(axis).iter().map(|card| value(card.name).filter(|m| m.value.is_finite())).collect();
    match values {
        Some(values) => effect.says(axis, &values),
        None => format!("'{id}' is missing from the model"),
    }
}

/// Whether a parameter that is nothing without the effect differs from nothing by more than its error, or has none.
fn is_told(axis: Axis, id: &str, parameters: &[ParameterValue]) -> bool {
    let nothing = |p: &ParameterValue| {
        effects::find(id)
            .is_none_or(|e| e.parameters(axis).iter().any(|card| card.name == p.name && card.neutral == 0.0))
    };
    let mut own = parameters.iter().filter(|p| p.effect == id && nothing(p)).peekable();
    own.peek().is_none()
        || own.any(|p| {
            let measured = Measured { value: p.value.unwrap_or(0.0), std_error: p.std_error.unwrap_or(f64::NAN) };
            measured.is_seen()
        })
}

/// A user's own effect, which the catalogue does not know.
fn own_clause(id: &str, parameters: &[ParameterValue]) -> String {
    let own = parameters.iter().filter(|p| p.effect == id);
    let values: Vec<String> = own
        .map(|p| format!("{} = {}", p.name, units::uncertain(p.value, p.std_error, &units::shown(&p.unit, &[p.value]))))
        .collect();
    let with = if values.is_empty() { String::new() } else { format!(", with {}", values.join(", ")) };
    format!("your own effect '{id}' is there{with}")
}

fn missing(axis: &AxisResult, best: &Suspect, told: &[&str], voice: Voice) -> Headline {
    let lacks = axis.lacks();
    let is_told = |suspect: &Suspect| told.contains(&suspect.effect.as_str());
    let own: Vec<&Suspect> = lacks.iter().copied().filter(|suspect| !is_told(suspect)).collect();
    let clauses: Vec<String> = own.iter().map(|s| clause(axis.axis, &s.effect, &s.parameters)).collect();
    let mut answer = sentences(&clauses);
    let ids: Vec<&str> = own.iter().map(|suspect| suspect.effect.as_str()).collect();
    answer.push_str(&either_sensor(&axis.remarks, &ids));
    let (own_count, shared_count) = (own.len(), lacks.len() - own.len());
    if let Some((before, after)) = corrected(&axis.error_curve, axis.corrected_curve()) {
        let subject = subject(own_count, shared_count);
        let rest = match beside_what_is_missing(&axis.budget, after.tau_s) {
            Some(by) if by.is_of_recording() => format!(", most of it {}", by.cause()),
            _ => rest(&after, is_noise(&after)),
        };
        answer.push_str(&makes(subject, before, after, &rest));
    } else if let Some(here) = said(&axis.error_curve) {
        answer.push_str(&changes_little(if lacks.len() > 1 { "They change" } else { "It changes" }, here, voice));
    }
    let is_of_reference = |id: &str| effects::find(id).is_some_and(|effect| effect.stage().is_of_reference());
    if is_of_reference(&best.effect) && lacks.iter().all(|suspect| is_of_reference(&suspect.effect)) {
        answer.push_str(" Your gyro is not the cause.");
    }
    Headline { answer: answer.trim_start().to_owned(), at_source: sources(&ids) }
}

/// That a zero may be the reference's, where one of these effects is of the zero and the reference is a sensor of rates.
fn either_sensor(remarks: &[Remark], ids: &[&str]) -> String {
    let is_named = |effect: &String| ids.contains(&effect.as_str());
    let concerns = |remark: &Remark| matches!(remark, Remark::EitherSensor { effects } if effects.iter().any(is_named));
    if remarks.iter().any(concerns) {
        " Or the zero of the reference does, in the opposite direction: the reference is a rate sensor too, and only the difference of \
         the two is measured. A third sensor, or a rest at that time, tells which."
            .to_owned()
    } else {
        String::new()
    }
}

/// What makes most of the error at this averaging time once what is missing is there.
fn beside_what_is_missing(budget: &[BudgetPoint], tau: f64) -> Option<LimitedBy> {
    let point = budget.iter().find(|point| (point.tau_s / tau - 1.0).abs() < 1e-6)?;
    let parts = LimitedBy::ALL.into_iter().zip(point.parts).filter(|(by, _)| *by != LimitedBy::MissingEffect);
    parts.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, part)| *part > 0.0).map(|(by, _)| by)
}

/// What makes an error: so many causes of the axis' own, and so many that it shares.
const fn subject(own: usize, shared: usize) -> &'static str {
    match (own, shared) {
        (0, 1) => "The cause that the axes share makes",
        (0, _) => "The causes that the axes share make",
        (1, 0) => "That makes",
        (_, 0) => "Together they make",
        _ => "Together with what the axes share, that makes",
    }
}

/// What is sure first, then what the log cannot tell apart.
fn ambiguous(axis: &AxisResult, voice: Voice) -> Headline {
    let known = |id: &str| axis.suspects.iter().find(|s| s.effect == id);
    let lacks = axis.lacks();
    // Of one suspect alone it is the verdict that says so, whoever its aliases are.
    let is_sure = |suspect: &&&Suspect| lacks.len() > 1 && suspect.aliases.is_empty();
    let sure: Vec<String> = lacks.iter().filter(is_sure).map(|s| clause(axis.axis, &s.effect, &s.parameters)).collect();
    let mut answer = sentences(&sure);
    let open: Vec<&Suspect> = lacks.iter().filter(|suspect| !is_sure(suspect)).copied().collect();
    for suspect in &open {
        let mut group = vec![clause(axis.axis, &suspect.effect, &suspect.parameters)];
        group.extend(suspect.aliases.iter().map(|id| match known(id) {
            Some(alias) if alias.parameters.iter().any(is_known) => clause(axis.axis, id, &alias.parameters),
            _ => unsized_clause(id),
        }));
        let either = format!(" Either {}; {} cannot tell which.", group.join(", or "), voice.log());
        answer.push_str(&either);
    }
    let ids: Vec<&str> = lacks.iter().map(|suspect| suspect.effect.as_str()).collect();
    answer.push_str(&either_sensor(&axis.remarks, &ids));
    if let Some((before, after)) = corrected(&axis.error_curve, axis.corrected_curve()) {
        let rest = rest(&after, is_noise(&after));
        answer.push_str(&makes(if lacks.len() > 1 { "Together they make" } else { "It makes" }, before, after, &rest));
    } else if let Some(here) = said(&axis.error_curve) {
        answer.push_str(&changes_little(if lacks.len() > 1 { "They change" } else { "It changes" }, here, voice));
    }
    for suspect in open.iter().filter(|suspect| !suspect.separate_by.is_empty()) {
        answer = format!("{answer} To tell them apart: {}.", suspect.separate_by.trim_end_matches('.'));
    }
    only(answer.trim_start().to_owned())
}

/// No effect explains what is left: what limits the log is the answer where that is known.
fn unexplained(left: &str, axis: &AxisResult) -> Headline {
    match limit(axis) {
        Some(Limit { what, remedy, .. }) => Headline {
            answer: format!("More than noise is left, and no effect explains it: {left}. Most of it: {what}."),
            at_source: first_small(remedy),
        },
        None => only(format!("More than noise is left, and no effect of the catalogue explains it: {left}.")),
    }
}

/// That the zero is another one while the axis moves, where that is what was found.
fn other_zero(axis: &AxisResult) -> Option<String> {
    let Finding::Unexplained(Excess::OtherZero { size, std_error, when }) = axis.finding else { return None };
    let by = Measured { value: size, std_error }.size("rad/s");
    let is = if size > 0.0 { "higher" } else { "lower" };
    Some(match when {
        ZeroMoves::ForAWhile { between: [from, to] } => {
            format!("Your gyro's zero was {by} {is} between {from:.1} and {to:.1} s than before and after.")
        }
        ZeroMoves::Moving => format!(
            "Your gyro's zero is {by} {is} while axis {} moves than while it rests. The log has no accelerometer, so it cannot show \
             whether vibration is the cause.",
            axis.axis
        ),
        ZeroMoves::WithAngle => format!(
            "Your gyro's zero changes by up to {by} with the angle of axis {}, once per turn. The log has no accelerometer, so it cannot \
             show whether gravity is the cause.",
            axis.axis
        ),
    })
}

/// What limits a log, where that is known.
fn limit(axis: &AxisResult) -> Option<&Limit> {
    let is_known = |by: LimitedBy| !matches!(by, LimitedBy::Unattributed | LimitedBy::MissingEffect);
    axis.limit.as_ref().filter(|limit| axis.limited_by.is_some_and(is_known) && !limit.what.is_empty())
}

/// As what stands behind a colon: without its capital letter and its full stop.
fn first_small(text: &str) -> String {
    let text = text.trim_end_matches('.');
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// What limits a log that is no noise, and that another recording would not have.
fn of_recording(axis: &AxisResult) -> Option<&str> {
    limit(axis).filter(|_| axis.limited_by.is_some_and(LimitedBy::is_of_recording)).map(|limit| limit.what.as_str())
}

fn adequate(here: Option<ErrorPoint>, within: Option<bool>, of_recording: Option<&str>, voice: Voice) -> String {
    let Some(point) = here else { return format!("Nothing is missing that {} can show.", voice.log()) };
    let (error, over) = (units::rate(point.error), units::time(point.tau_s));
    if within == Some(false) {
        return format!(
            "No effect is missing: over {over} the error is {error} °/s (white noise alone: {}). The rest comes from a bias that wanders.",
            units::rate(point.floor)
        );
    }
    let rest = of_recording.map_or_else(|| ", which is noise".to_owned(), |what| format!(". Most of that: {what}"));
    format!("Nothing is missing: over {over} the error is {error} °/s{rest}.")
}

/// What to do about these, where they come from; which is for which, where they want different things.
fn sources(ids: &[&str]) -> String {
    let mut all: Vec<(Vec<String>, &str)> = Vec::new();
    for (id, says) in ids.iter().filter_map(|id| Some((id, effects::find(id)?.card().at_source))) {
        match all.iter_mut().find(|(_, known)| *known == says) {
            Some((names, _)) => names.push(name(id)),
            None if !says.is_empty() => all.push((vec![name(id)], says)),
            None => {}
        }
    }
    match all.as_slice() {
        [(_, says)] => (*says).to_owned(),
        all => {
            let each: Vec<String> = all.iter().map(|(names, says)| format!("for {}, {says}", and(names))).collect();
            first_small(&sentences(&each))
        }
    }
}

/// Each clause a sentence.
fn sentences(clauses: &[String]) -> String {
    clauses.iter().map(|clause| sentence(clause)).collect::<Vec<_>>().join(" ")
}

/// Whether a value is larger than its standard error.
fn is_known(parameter: &ParameterValue) -> bool {
    parameter.value.zip(parameter.std_error).is_none_or(|(value, std_error)| value.abs() > std_error)
}

/// An effect of which no size is known.
fn unsized_clause(id: &str) -> String {
    let title = effects::find(id).map_or_else(String::new, |effect| format!(" ({})", effect.card().title));
    format!("{id} is missing{title}")
}

/// An effect's name in a sentence.
fn name(id: &str) -> String {
    id.replace('-', " ")
}

/// `a`, `a or b`.
fn either(list: &[String]) -> String {
    list.join(" or ")
}

fn only(answer: String) -> Headline {
    Headline { answer, at_source: String::new() }
}

/// With a capital letter in front and a full stop behind.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let text: String = letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect());
    if text.ends_with(['.', '?', '!']) { text } else { text + "." }
}

/// What a finding says first, behind a lead.
fn short(verdict: Verdict, first: &str, voice: Voice) -> String {
    let lead = match verdict {
        Verdict::BadData => "The data are at fault".to_owned(),
        _ => format!("{} cannot tell", voice.log_first()),
    };
    let first = first.trim_end_matches('.');
    if first.is_empty() { format!("{lead}.") } else { format!("{lead}: {first}.") }
}
