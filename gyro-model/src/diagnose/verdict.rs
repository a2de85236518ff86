//! What a study comes to, in one word and one or two sentences.

use super::challenger::{Challenger, Incumbent};
use crate::{
    AxisModel,
    budget::Budget,
    diagnosis::Verdict,
    effects::{Card, Effect, Stage, Trait},
    evidence::{
        identify,
        integrate::integral,
        noise::{self, Gls},
        series::{Rest, Series},
        study::Study,
    },
    fit::judged::Judged,
    thresholds as limit,
};

/// A quarter turn, rad.
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;
/// What the log lacks for the base model itself, in words.
#[must_use]
pub fn unexcited(study: &Study, gls: &Gls, series: usize) -> Option<String> {
    let (axis, rest) = (study.bench.problem.series[series].axis, study.bench.problem.series[series].rest);
    let model = study.model.axes[axis.index()].as_ref()?;
    let turn = "turn it to and fro through at least a quarter turn for a minute, at several speeds";
    match rest {
        // What its bias does shows all the same.
        Rest::Whole => return None,
        Rest::OfReference => {
            return Some(format!(
                "the reference of axis {axis} does not turn in this log, so its gyro cannot be judged: {turn}, or leave the \
                 axis out"
            ));
        }
        Rest::None => {}
    }
    for (k, slot) in study.slots.iter().enumerate() {
        if slot.series != series || model.terms[slot.term].effect.stage() != Stage::Calibration {
            continue;
        }
        let effect = model.terms[slot.term].effect;
        let value = model.terms[slot.term].values[slot.parameter];
        let sigma = gls.std_error(k);
        if effect.is(Trait::Gain) && value <= effect.parameters(axis)[slot.parameter].bounds.0 {
            return Some(format!(
                "gyro_{axis} and its reference do not agree, whatever the scale factor: check that both are of this axis and of \
                 the same time, and check their signs"
            ));
        }
        if effect.is(Trait::Gain) && (sigma.is_nan() || sigma > limit::UNEXCITED.value * value.abs()) {
            let share = 100.0 * (sigma / value.abs()).min(10.0);
            let travel = travel(&study.bench.problem.series[series], model);
            return Some(if travel > QUARTER {
                format!(
                    "the scale factor of axis {axis} is known only to {share:.0} %, although the axis turns. Either it turns at one \
                     rate only, where scale factor and bias look alike, or gyro and reference do not agree: {turn}"
                )
            } else {
                format!(
                    "axis {axis} turns through {}° at most in this log, so its scale factor is not known to better than {share:.0} %: \
                     {turn}",
                    degrees(travel)
                )
            });
        }
    }
    None
}

/// How far an axis turns from one end to the other, rad: by its reference where that gives an angle of it, else by its gyro.
fn travel(series: &Series, model: &AxisModel) -> f64 {
    if !series.reference_angle.is_empty() {
        return series.span().travel;
    }
    let rate: Vec<f64> = series.gyro.iter().map(|reading| model.alpha() * reading + model.delta()).collect();
    let angle = integral(&series.t, &rate);
    let (low, high) = angle.iter().fold((0.0_f64, 0.0_f64), |(low, high), &turned| (low.min(turned), high.max(turned)));
    high - low
}

/// What is not known of an axis that does not turn is said, and it is never adequate.
#[must_use]
pub fn at_rest(study: &Study, series: usize, verdict: Verdict, says: String) -> (Verdict, String) {
    let s = &study.bench.problem.series[series];
    if s.rest != Rest::Whole || verdict == Verdict::BadData {
        return (verdict, says);
    }
    let verdict = if verdict == Verdict::Adequate { Verdict::CannotTell } else { verdict };
    let more = format!(
        " Axis {} does not turn in this log: only its bias and its noise are judged, and its scale factor stays as it was. To measure \
         the scale factor, turn the axis to and fro through at least a quarter turn for a minute, at several speeds.",
        s.axis
    );
    (verdict, super::with(says, &more))
}

/// The verdict of a model with its suspects, which were found beside the model `seen`: the same, or fitted to a part.
#[must_use]
pub fn verdict(
    incumbent: &Incumbent,
    seen: &Incumbent,
    suspects: &[&Challenger],
    aliases: &[Vec<String>],
    judged: &Judged,
    series: usize,
) -> (Verdict, String) {
    let best = suspects.iter().position(|r| r.passes(seen));
    // What is missing hides the scale factor, too: excitation is judged with the best suspect in.
    let (study, gls) = best.map_or((&incumbent.study, &incumbent.gls), |k| (&suspects[k].study, &suspects[k].gls));
    let unexcited = unexcited(study, gls, series);
    if let Some(k) = best
        && (unexcited.is_none() || suspects[k].dominates(seen))
    {
        let (verdict, says) = missing(suspects[k].candidate.term.effect.card(), &aliases[k]);
        let more = unexcited.map_or_else(String::new, |says| format!(" Besides, {says}."));
        return (verdict, super::with(says, &more));
    }
    if let Some(says) = unexcited {
        return (Verdict::CannotTell, says);
    }
    rest(incumbent, suspects, judged, series)
}

/// One effect is missing, or one of some that this log cannot tell apart.
fn missing(card: &Card, aliases: &[String]) -> (Verdict, String) {
    if aliases.is_empty() {
        return (Verdict::MissingEffect, format!("{} is missing{}. Add it and look again.", card.id, title(card)));
    }
    let others = aliases.join(" or ");
    let split = split_by(card.id, aliases);
    let says =
        format!("{} or {others} is missing, and this log cannot tell which. To tell them apart: {split}.", card.id);
    (Verdict::Ambiguous, says)
}

/// Effects that are missing together.
pub(super) struct Together {
    /// Their ids, and what each cannot be told from.
    pub effects: Vec<(&'static str, Vec<String>)>,
    /// Largest error over floor with all of them.
    pub after: f64,
}

/// What is said of them.
#[must_use]
pub(super) fn together(found: &Together) -> String {
    let named = |(id, aliases): &(&str, Vec<String>)| match aliases.as_slice() {
        [] => (*id).to_owned(),
        others => format!("{id} (or {})", others.join(" or ")),
    };
    let ids: Vec<String> = found.effects.iter().map(named).collect();
    let lead = match ids.as_slice() {
        [one] => format!("{one} is missing. `truerate ladder` adds it"),
        [list @ .., last] => format!(
            "more than one effect is missing: {} and {last}. `truerate ladder` adds them one by one",
            list.join(", ")
        ),
        [] => return String::new(),
    };
    let splits = found.effects.iter().filter(|(_, aliases)| !aliases.is_empty());
    let apart: Vec<String> = splits.map(|(id, aliases)| split_by(id, aliases)).collect();
    let rest =
        if found.after > limit::WANDER.value { " No effect of the catalogue explains what is then left." } else { "" };
    let apart = if apart.is_empty() { String::new() } else { format!(" To tell them apart: {}.", apart.join("; ")) };
    format!("{lead}.{rest}{apart}")
}

/// What an effect is, where its name does not say so.
fn title(card: &Card) -> String {
    let named = card.id.replace('-', " ");
    if card.title == named { String::new() } else { format!(": {}", card.title) }
}

/// The verdict where no suspect passes.
#[must_use]
pub fn rest(incumbent: &Incumbent, suspects: &[&Challenger], judged: &Judged, series: usize) -> (Verdict, String) {
    let noise = &incumbent.gls.noise;
    let prior = &incumbent.study.bench.prior[series];
    let span = incumbent.study.bench.windows.tau.last().map_or(1.0, |t| 10.0 * t);
    // What is forgotten within some readings is white to whoever looks for longer.
    let (lasting, white) =
        if noise.correlation_time < limit::FORGOTTEN.value * incumbent.study.bench.problem.series[series].span().dt {
            (0.0, noise.angle_random_walk.hypot(noise.walk_of_correlated()))
        } else {
            (noise.correlated, noise.angle_random_walk)
        };
    let walked = noise.bias_random_walk * span.sqrt();
    let is_wander = walked.max(lasting) * span.sqrt() > white;
    if judged.within() {
        let lasts = incumbent.study.bench.problem.series[series].span().duration;
        if lasts < limit::BRIEF.value {
            return (
                Verdict::CannotTell,
                format!(
                    "the error is what noise alone leaves, but {} of data are too short to show slow effects: record a minute or \
                     more, turning to and fro at several speeds",
                    duration(lasts)
                ),
            );
        }
        let silent = incumbent.study.evaluation.silent();
        if silent > limit::SILENT.value {
            return (
                Verdict::CannotTell,
                format!(
                    "in {:.0} % of this log the rate is not known: readings are missing, or lie inside a play or a dead zone, or \
                     beyond the range. In the rest the error is what noise alone leaves. Record a rate that keeps changing, so \
                     that it passes a play or a dead zone quickly, and that stays within the range.",
                    100.0 * silent
                ),
            );
        }
        let left_out = if silent > limit::MENTIONED.value {
            format!(" In {:.0} % of the log the rate is not known; that part is not judged.", 100.0 * silent)
        } else {
            String::new()
        };
        return (
            Verdict::Adequate,
            format!("the error is what noise alone leaves: no effect that this log can show is missing.{left_out}"),
        );
    }
    let largest = noise::of_sensors(prior);
    // Many noises may explain what is left: physics is missing where none of those that sensors have does.
    let noise_alone = identify::cost_of_limits(&incumbent.study, &incumbent.gls, &largest) < limit::UNUSUAL.value;
    let slow = suspects
        .iter()
        .find(|r| is_wander && r.rise > limit::SLOW_HIDDEN.value && r.candidate.term.effect.is(Trait::Slow));
    let likely = suspects.iter().find(|r| r.significant());
    let wanders = if walked >= lasting {
        format!("{} °/s over this log", degrees(walked))
    } else {
        format!("{} °/s over some {}", degrees(lasting), duration(noise.correlation_time))
    };
    let budget = || Budget::of(&incumbent.study, series, judged, noise, &[]);
    let explained = || is_wander && budget().is_wander(judged);
    match (noise_alone, slow, likely) {
        (true, Some(r), _) => (
            Verdict::CannotTell,
            format!(
                "a slow error is left that a wandering bias ({wanders}) and {} explain equally well: record a second cycle (heat \
                 and cool, or restart hot), or a log twice as long",
                r.candidate.term.effect.card().id
            ),
        ),
        (true, None, Some(r)) if !explained() => {
            let card = r.candidate.term.effect.card();
            (
                Verdict::CannotTell,
                format!(
                    "an error is left that may be noise or {}, which removes little of it. To show which, record: {}.",
                    card.id, card.excited_by
                ),
            )
        }
        (true, None, _) if is_wander => (
            Verdict::Adequate,
            format!("what is left is noise: the bias wanders by {wanders}, which only a live reference can follow."),
        ),
        (true, None, _) => (
            Verdict::Adequate,
            format!(
                "what is left is noise: {} °/√s of the gyro and {}° of the reference. No parameter removes it.",
                degrees(white),
                degrees(noise.encoder)
            ),
        ),
        (false, ..) => (
            Verdict::Unexplained,
            "no effect of the catalogue removes it: look at where it fails, check the reference and its mounting, or describe the \
             effect that you suspect as your own (`truerate effects --help`)."
                .to_owned(),
        ),
    }
}

/// A number of rad that is not negative, in degrees to two figures.
fn degrees(radians: f64) -> String {
    let value = radians.to_degrees();
    if value < 1e-9 {
        return "0".to_owned();
    }
    let decimals = (1.0 - value.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}

/// A time, s, to two figures.
fn duration(seconds: f64) -> String {
    let decimals = (1.0 - seconds.max(1e-3).log10().floor()).max(0.0) as usize;
    format!("{seconds:.decimals$} s")
}

/// The manoeuvre that tells an effect from its aliases, as its card has it.
#[must_use]
pub fn split_by(id: &str, aliases: &[String]) -> String {
    let Some(effect) = crate::effects::find(id) else {
        return "change one of their causes and not the other".into();
    };
    let mut splits: Vec<String> = Vec::new();
    for alias in aliases {
        let other = crate::effects::find(alias).map(Effect::card);
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
