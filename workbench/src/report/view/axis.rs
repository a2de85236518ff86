//! The parts of an axis in human units and words.

use super::{AliasView, CardView, Curve, LimitView, ParameterView, PartView, StepView, SuspectView};
use crate::report::units::{self, Shown};
use gyro_model::{
    Axis,
    diagnosis::{
        AxisResult, DataFault, ErrorPoint, FaultKind, FrequencyShare, LimitedBy, NoiseValue, ParameterValue, Suspect,
        Verdict,
    },
    effects, headline,
    words::{Voice, labels},
};

/// With a full stop behind and a capital letter in front, but for a column's name.
pub(super) fn sentence(text: &str) -> String {
    let stop = if text.is_empty() || text.ends_with(['.', '?', '!']) { "" } else { "." };
    let text = format!("{text}{stop}");
    if text.split(' ').next().is_some_and(|word| word == "t" || word.contains('_')) {
        return text;
    }
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The colour of a verdict.
pub(super) const fn tone(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "good",
        Verdict::MissingEffect | Verdict::Unexplained => "warn",
        Verdict::BadData => "bad",
        Verdict::Ambiguous | Verdict::CannotTell => "unknown",
    }
}

/// An error curve in °/s.
pub(super) fn curve(label: &str, points: &[ErrorPoint]) -> Curve {
    let degrees = |v: Option<f64>| v.filter(|v| v.is_finite()).map(f64::to_degrees);
    Curve {
        label: label.into(),
        tau: points.iter().map(|p| p.tau_s).collect(),
        error: points.iter().map(|p| degrees(p.error)).collect(),
        floor: points.iter().map(|p| degrees(p.floor)).collect(),
        floor_99: points.iter().map(|p| degrees(p.floor_99)).collect(),
    }
}

/// What limits a log; where an effect is missing, adding it is what to do, and no other remedy is told.
pub(super) fn limit(axis: &AxisResult, voice: Voice) -> Option<LimitView> {
    let AxisResult { budget, error_by_frequency: frequencies, random, .. } = axis;
    let by = axis.limited_by.filter(|_| !budget.is_empty())?;
    let share = |part: LimitedBy| budget.iter().map(|point| 100.0 * point.share(part)).collect();
    let mut parts: Vec<(LimitedBy, PartView)> = (LimitedBy::ALL.into_iter())
        .map(|part| (part, PartView { name: part.words(), share: share(part) }))
        .filter(|(_, view)| view.share.iter().any(|share| *share >= 1.0))
        .collect();
    let sum = |view: &PartView| view.share.iter().sum::<f64>();
    let is_last = |part: LimitedBy| part == LimitedBy::Unattributed;
    parts.sort_by(|a, b| is_last(a.0).cmp(&is_last(b.0)).then(sum(&b.1).total_cmp(&sum(&a.1))));
    let density = |of: &dyn Fn(&FrequencyShare) -> Option<f64>| -> Vec<Option<f64>> {
        frequencies.iter().map(|f| of(f).filter(|d| *d > 0.0).map(|d| d.sqrt().to_degrees())).collect()
    };
    // What is missing is to be added first.
    let is_named = matches!(axis.verdict, Verdict::MissingEffect | Verdict::Ambiguous);
    let head = if is_named { "the error's largest part".to_owned() } else { format!("what limits {}", voice.log()) };
    let says = match &axis.limit {
        Some(limit) if is_named => limit.named() + ".",
        _ => axis.limited_says.clone(),
    };
    let besides = random.iter().filter(|found| found.cause != by).map(|found| sentence(&found.says));
    let says = std::iter::once(sentence(&says)).chain(besides).collect::<Vec<_>>().join(" ");
    Some(LimitView {
        head,
        by: by.words(),
        says,
        floor_from: axis.floor_from,
        tau: budget.iter().map(|point| point.tau_s).collect(),
        parts: parts.into_iter().map(|(_, view)| view).collect(),
        frequency: frequencies.iter().map(|f| 0.5 * (f.from_hz + f.to_hz)).collect(),
        error: density(&|f| Some(f.error)),
        gyro: density(&|f| Some(f.gyro)),
        of_reference: density(&|f| f.of_reference),
        of_gyro: density(&|f| f.of_gyro),
    })
}

/// A step of the ladder, after one with the error curve `before`.
pub(super) fn falling(
    label: String,
    before: Option<&[ErrorPoint]>,
    points: &[ErrorPoint],
    ratio: Option<f64>,
    aliases: &[String],
) -> StepView {
    let near_1s = points.iter().min_by(|a, b| a.tau_s.ln().abs().total_cmp(&b.tau_s.ln().abs()));
    StepView {
        label,
        ratio: ratio.filter(|r| r.is_finite()),
        won: before.and_then(|before| headline::fall(before, points)).unwrap_or_default(),
        error_1s: near_1s.and_then(|p| p.error).map(f64::to_degrees),
        aliases: aliases.to_vec(),
    }
}

/// Parameters with what is usual of their effect; with `rest`, a bias is said as what the gyro reads at rest.
pub(super) fn parameters(axis: Axis, values: &[ParameterValue], rest: bool, voice: Voice) -> Vec<ParameterView> {
    let mut views: Vec<ParameterView> = values.iter().map(|p| parameter(axis, p, values, voice)).collect();
    let find = |effect: &str| values.iter().find(|p| p.effect == effect).and_then(|p| p.value);
    if let (true, Some(delta), Some(view)) = (rest, find("bias"), views.iter_mut().find(|view| view.effect == "bias")) {
        let reads =
            units::uncertain(Some(-delta / find("scale-factor").unwrap_or(1.0)), None, &units::shown("rad/s", &[]));
        view.says = format!("the gyro reads {reads} at rest");
        view.typical = String::new();
    }
    // What is usual of an effect is said once.
    let mut told: Vec<String> = Vec::new();
    for view in &mut views {
        if told.contains(&view.effect) {
            view.typical = String::new();
        } else {
            told.push(view.effect.clone());
        }
    }
    views
}

/// One of `all`: those of one effect and one unit are shown alike.
fn parameter(axis: Axis, p: &ParameterValue, all: &[ParameterValue], voice: Voice) -> ParameterView {
    let card_of =
        |p: &ParameterValue| effects::find(&p.effect)?.parameters(axis).iter().find(|card| card.name == p.name);
    let card = card_of(p);
    // Numbers that are no shares of anything.
    let is_plain = |p: &ParameterValue| {
        let is_named =
            matches!((p.effect.as_str(), p.name.as_str()), ("scale-factor", "alpha") | ("mount-resonance", "zeta"));
        is_named || p.unit == "1" && card_of(p).is_some_and(|card| card.role == effects::Role::Chosen)
    };
    let unit = if is_plain(p) {
        Shown { factor: 1.0, unit: String::new() }
    } else {
        // An instant is no size.
        let is_instant = |p: &ParameterValue| p.name == "t0";
        let is_like = |other: &&ParameterValue| {
            other.effect == p.effect && is_instant(other) == is_instant(p) && !is_plain(other)
        };
        let like = all.iter().filter(|other| other.unit == p.unit).filter(is_like);
        let sizes: Vec<Option<f64>> = like.flat_map(|other| [other.value, other.std_error]).collect();
        units::shown(&p.unit, &sizes)
    };
    ParameterView {
        effect: p.effect.clone(),
        name: p.name.clone(),
        says: card.map_or("", |card| card.says).into(),
        is_seen: !is_unseen(p),
        shown: if is_unseen(p) {
            labels::unseen(voice)
        } else if card.is_some_and(|card| is_at_limit(p, card.bounds)) {
            // How far beyond it the fit would have gone no standard error says.
            format!("{}, {AT_LIMIT}", units::uncertain(p.value, None, &unit))
        } else {
            units::uncertain(p.value, p.std_error, &unit)
        },
        typical: effects::find(&p.effect).map_or("", |effect| effect.card().typical).into(),
    }
}

/// Whether a log says so little of a parameter that it might be many times as large as it typically is.
fn is_unseen(p: &ParameterValue) -> bool {
    let (Some(value), Some(error), Some(typical)) = (p.value, p.std_error, p.typical) else { return false };
    typical != 0.0 && error > BEYOND_TYPICAL * typical.abs() && value.abs() < 2.0 * error
}

/// Whether a parameter stands at the end of what is physical.
fn is_at_limit(p: &ParameterValue, bounds: (f64, f64)) -> bool {
    let near = |bound: f64| {
        p.value.is_some_and(|v| bound != 0.0 && bound.is_finite() && (v - bound).abs() <= 1e-6 * bound.abs())
    };
    p.std_error.is_some() && (near(bounds.0) || near(bounds.1))
}

/// Times its typical size.
const BEYOND_TYPICAL: f64 = 3.0;
/// What is said of one that a fit presses against its bound.
const AT_LIMIT: &str = "at its limit";

/// Noise in data-sheet units, what is too little for any gyro left out. Where more than noise is left, that stands in it.
pub(super) fn noise(noise: &NoiseValue, verdict: Verdict) -> String {
    let part = |name: &str, value: Option<f64>, unit: &str, least: f64| {
        let value = value.filter(|v| v.is_finite() && *v > least)?;
        Some(format!("{name} {}{unit}", units::number(value.to_degrees())))
    };
    let parts = [
        part("angle random walk", noise.angle_random_walk, "\u{a0}°/√s", NEGLIGIBLE),
        part("random walk of the bias", noise.bias_random_walk, "\u{a0}°/s/√s", NEGLIGIBLE),
        part("encoder", noise.encoder, "°", NEGLIGIBLE_ANGLE),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let more = labels::of_noise(verdict);
    if parts.is_empty() { String::new() } else { format!("Noise{more}: {}", parts.join(", ")) }
}

/// Noise below which there is none, in SI units: of the quietest gyros the bias walks by as much.
const NEGLIGIBLE: f64 = 1e-9;
/// The same of an angle, rad: an encoder of 25 bits has steps of twice as much.
const NEGLIGIBLE_ANGLE: f64 = 1e-7;

/// What the catalogue says; a user's own effect has its id alone.
pub(super) fn card(id: &str) -> CardView {
    let Some(effect) = effects::find(id) else {
        let own = "an effect of your own, from the model file".to_string();
        let no = String::new;
        return CardView {
            id: id.into(),
            title: own,
            physics: no(),
            equation: no(),
            typical: no(),
            excited_by: no(),
            mended_by: no(),
            source: no(),
        };
    };
    let card = effect.card();
    CardView {
        id: card.id.into(),
        title: card.title.into(),
        physics: card.physics.into(),
        equation: card.equation.into(),
        typical: card.typical.into(),
        excited_by: card.excited_by.into(),
        mended_by: card.mended_by.into(),
        source: card.source.into(),
    }
}

/// The suspects, the first with its odds against the next. Where `several` are missing together, none is odds against another, and
/// what each gains alone says little.
pub(super) fn suspects(axis: Axis, all: &[Suspect], several: bool, voice: Voice) -> Vec<SuspectView> {
    let mut views: Vec<SuspectView> = all.iter().map(|s| suspect(axis, s, voice)).collect();
    if several {
        for view in &mut views {
            view.significance.clear();
        }
    } else if let ([first, second, ..], Some(view)) = (all, views.first_mut()) {
        view.odds = odds(first, second).unwrap_or_default();
    }
    views
}

/// Odds beyond which nobody doubts, ln.
const CERTAIN: f64 = 13.8;

/// How much likelier one suspect is than another: the ratio of their likelihoods, a factor of e charged for each parameter more.
fn odds(first: &Suspect, second: &Suspect) -> Option<String> {
    let parameters = |s: &Suspect| s.parameters.iter().filter(|p| p.effect == s.effect).count() as f64;
    let worth = |s: &Suspect| s.log_likelihood_gain.map(|gain| gain - parameters(s));
    let apart = worth(first)? - worth(second)?;
    let ratio = if apart > CERTAIN {
        "more than a million to 1".to_owned()
    } else if apart > 0.0 {
        let times = apart.exp();
        format!("{} to 1", if times < 10.0 { units::round(times) } else { units::thousands(times.round() as u64) })
    } else {
        "none, by likelihood alone".to_owned()
    };
    Some(format!("{ratio} ({})", second.effect))
}

/// A suspect with its card and aliases.
fn suspect(axis: Axis, s: &Suspect, voice: Voice) -> SuspectView {
    let share = s.error_fall.filter(|f| f.is_finite());
    let pairs = effects::find(&s.effect).map_or(&[][..], |e| e.card().aliases);
    let aliases: Vec<AliasView> = s
        .aliases
        .iter()
        .map(|id| {
            // Either card may describe the pair.
            let other = effects::find(id).map_or(&[][..], |e| e.card().aliases);
            let pair = pairs.iter().find(|a| a.id == id).or_else(|| other.iter().find(|a| a.id == s.effect));
            AliasView {
                id: id.clone(),
                title: effects::find(id).map_or("", |e| e.card().title).into(),
                when: pair.map_or("", |a| a.when).into(),
                split_by: pair.map_or("", |a| a.split_by).into(),
            }
        })
        .collect();
    SuspectView {
        effect: s.effect.clone(),
        card: card(&s.effect),
        removes: share.map_or_else(|| "–".into(), |share| units::percent(share.clamp(0.0, 1.0))),
        share: share.map(|f| f.clamp(0.0, 1.0)),
        significance: s.p_value.filter(|p| p.is_finite()).map_or_else(String::new, |p| {
            if p < 1e-6 { "p < 10⁻⁶".into() } else { format!("p = {}", units::number(p)) }
        }),
        odds: String::new(),
        parameters: parameters(
            axis,
            &s.parameters.iter().filter(|p| p.effect == s.effect && p.value.is_some()).cloned().collect::<Vec<_>>(),
            false,
            voice,
        ),
        aliases,
        separate_by: s.separate_by.clone(),
    }
}

/// `outliers (12 times, first at 3.40 s): …`; the count is left out where the words begin with it, or where it counts all rows.
#[must_use]
pub fn fault(fault: &DataFault) -> String {
    let at = fault.first_t.filter(|t| t.is_finite()).map_or_else(String::new, |t| format!(", first at {t:.2} s"));
    let says_count = fault.says.starts_with(&format!("{} ", fault.count));
    let count = if fault.count > 1 && !says_count && fault.kind != FaultKind::NotExcited {
        format!(" ({} times{at})", fault.count)
    } else if at.is_empty() {
        String::new()
    } else {
        format!(" ({})", &at[2..])
    };
    format!("{}{count}: {}", fault.kind, fault.says)
}
