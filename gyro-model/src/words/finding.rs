//! What was found, in words.

use super::{
    Argument, Piece,
    Role::{Lead, Limit, More, Name, Nothing, Split, Step},
    Subject, Voice,
    figures::{degrees, seconds},
};
use crate::{
    effects::{self, split_by},
    fault::DataFault,
    finding::{Adequate, Excess, Finding, NamedEffect, Wander, Why, ZeroMoves},
    thresholds as limit, units,
};

/// What measures a scale factor.
const TURN: &str = "turn it to and fro through at least a quarter turn for a minute, at several speeds";

/// The pieces of a finding, in order.
#[must_use]
pub fn pieces(subject: &Subject, voice: Voice) -> Vec<Piece> {
    match subject.finding {
        Finding::Missing { effects, over_floor } | Finding::Ambiguous { effects, over_floor, added: false } => {
            match (effects.as_slice(), over_floor) {
                ([one], None) => alone(one, voice),
                (all, over_floor) => together(all, over_floor.unwrap_or(0.0), voice),
            }
        }
        Finding::Ambiguous { effects, added: true, .. } => vec![Piece::new(More, added(effects, voice), "")],
        Finding::Adequate(noise) => adequate(noise, subject, voice),
        Finding::CannotTell(why) => cannot_tell(why, subject, voice),
        Finding::Unexplained(excess) => unexplained(excess, voice),
        Finding::BadData { .. } => fault_of(subject).map_or_else(Vec::new, |fault| lead_and_more(&fault.says, ". ")),
        Finding::Stopped { over_floor } => vec![
            Piece::new(
                Lead,
                "the search was stopped before its end, and effects may be missing that it had not reached",
                ". ",
            ),
            Piece::new(More, format!("By then the error is up to {over_floor:.1} times what noise leaves"), "."),
        ],
        Finding::Bare { .. } => Vec::new(),
    }
}

/// The fault that a finding is about.
fn fault_of<'a>(subject: &Subject<'a>) -> Option<&'a DataFault> {
    let Finding::BadData { fault, axis, count } = subject.finding else { return None };
    subject.faults.iter().find(|own| (own.kind, own.axis, own.count) == (*fault, *axis, *count))
}

/// What a fault says has its answer up to here, and then what to do.
fn lead_and_more(says: &str, end: &'static str) -> Vec<Piece> {
    match says.split_once(end) {
        Some((lead, more)) => vec![Piece::new(Lead, lead, end), Piece::new(More, more, "")],
        None => vec![Piece::new(Lead, says, "")],
    }
}

/// One effect, after the first round of the search.
fn alone(named: &NamedEffect, voice: Voice) -> Vec<Piece> {
    let id = &named.effect;
    if named.aliases.is_empty() {
        return vec![
            Piece::new(Name, format!("{id} is missing{}", title(id)), ". "),
            Piece::new(Step, "Add it and look again", "."),
        ];
    }
    let (others, log) = (named.aliases.join(" or "), voice.log());
    vec![
        Piece::new(Name, format!("{id} or {others} is missing, and {log} cannot tell which"), ". "),
        Piece::new(Split, format!("To tell them apart: {}", split_by(id, &named.aliases)), "."),
    ]
}

/// What an effect is, where its name does not say so.
fn title(id: &str) -> String {
    let title = effects::find(id).map_or("", |effect| effect.card().title);
    if title.is_empty() || title == id.replace('-', " ") { String::new() } else { format!(": {title}") }
}

/// Effects that are missing together, and the largest error over floor with all of them.
fn together(effects: &[NamedEffect], over_floor: f64, voice: Voice) -> Vec<Piece> {
    let named = |named: &NamedEffect| match named.aliases.as_slice() {
        [] => named.effect.clone(),
        others => format!("{} (or {})", named.effect, others.join(" or ")),
    };
    let ids: Vec<String> = effects.iter().map(named).collect();
    let lead = match ids.as_slice() {
        [one] => format!("{one} is missing"),
        [list @ .., last] => format!("more than one effect is missing: {} and {last}", list.join(", ")),
        [] => return Vec::new(),
    };
    let mut pieces = vec![Piece::new(Name, lead, ". "), Piece::new(Step, voice.adding(ids.len() > 1), ".")];
    if over_floor > limit::WANDER.value {
        pieces.push(Piece::new(More, " No effect of the catalogue explains what is then left", "."));
    }
    let doubtful: Vec<&NamedEffect> = effects.iter().filter(|named| !named.aliases.is_empty()).collect();
    if !doubtful.is_empty() {
        // The headline says it of the first one.
        let role = if doubtful.len() == 1 && !effects[0].aliases.is_empty() { Split } else { More };
        let splits: Vec<String> = doubtful.iter().map(|named| split_by(&named.effect, &named.aliases)).collect();
        pieces.push(Piece::new(role, format!(" To tell them apart: {}", splits.join("; ")), "."));
    }
    pieces
}

/// What a ladder added and could not tell from others.
fn added(effects: &[NamedEffect], voice: Voice) -> String {
    let one = |NamedEffect { effect, aliases }: &NamedEffect| {
        let (others, split) = (aliases.join(" or from "), split_by(effect, aliases));
        format!("{} cannot tell {effect} from {others}. To tell them apart: {split}", voice.log())
    };
    effects.iter().map(one).collect::<Vec<_>>().join("; ")
}

fn adequate(noise: &Adequate, subject: &Subject, voice: Voice) -> Vec<Piece> {
    let log = voice.log();
    match noise {
        Adequate::WithinFloor { silent } => {
            let mut pieces = vec![
                Piece::new(Nothing, "the error is what noise alone leaves", ": "),
                Piece::new(Nothing, format!("no effect that {log} can show is missing"), "."),
            ];
            if *silent > limit::MENTIONED.value {
                let share = 100.0 * silent;
                let left_out = format!(" In {share:.0} % of the log the rate is not known; that part is not judged");
                pieces.push(Piece::new(More, left_out, "."));
            }
            pieces
        }
        Adequate::Wanders(wander) => vec![
            Piece::new(More, "what is left is noise", ": "),
            Piece::new(
                More,
                format!("the bias wanders by {}, which only a live reference can follow", wanders(wander, voice)),
                ".",
            ),
        ],
        Adequate::WhiteNoise { gyro, reference } => vec![
            Piece::new(More, "what is left is noise", ": "),
            Piece::new(
                More,
                format!("{} °/√s of the gyro and {}° of the reference", degrees(*gyro), degrees(*reference)),
                ". ",
            ),
            Piece::new(More, "No parameter removes it", "."),
        ],
        Adequate::Limited => vec![
            Piece::new(More, format!("no effect that {log} can show is missing"), "."),
            what_limits(subject, voice),
        ],
    }
}

fn what_limits(subject: &Subject, voice: Voice) -> Piece {
    Piece::new(Limit, format!(" What limits {}: {}", voice.log(), subject.limited_says), "")
}

fn wanders(wander: &Wander, voice: Voice) -> String {
    let size = degrees(wander.size);
    match wander.within_s {
        None => format!("{size} °/s over {}", voice.log()),
        Some(time) => format!("{size} °/s over some {}", seconds(time)),
    }
}

/// An answer, and what stands behind it.
fn two(lead: String, end: &'static str, more: impl Into<String>, last: &'static str) -> Vec<Piece> {
    vec![Piece::new(Lead, lead, end), Piece::new(More, more, last)]
}

/// What the motion does not show.
fn unexcited(why: &Why, subject: &Subject, voice: Voice) -> Vec<Piece> {
    let (axis, log) = (subject.axis, voice.log());
    match why {
        Why::NotExcited { travel, uncertainty } => two(
            format!(
                "axis {axis} turns through {}° at most in {log}, so its scale factor is not known to better than {:.0} %",
                degrees(*travel),
                100.0 * uncertainty
            ),
            ": ",
            TURN,
            "",
        ),
        Why::OneRate { uncertainty } => two(
            format!(
                "the scale factor of axis {axis} is known only to {:.0} %, although the axis turns",
                100.0 * uncertainty
            ),
            ". ",
            format!(
                "Either it turns at one rate only, where scale factor and bias look the same, or gyro and reference do not agree: {TURN}"
            ),
            "",
        ),
        Why::Disagrees => two(
            format!("gyro_{axis} and its reference do not agree, whatever the scale factor"),
            ": ",
            "check that both are of this axis and of the same time, and check their signs",
            "",
        ),
        _ => two(
            format!("the reference of axis {axis} does not turn in {log}, so its gyro cannot be judged"),
            ": ",
            format!("{TURN}, or leave the axis out"),
            "",
        ),
    }
}

fn cannot_tell(why: &Why, subject: &Subject, voice: Voice) -> Vec<Piece> {
    let log = voice.log();
    match why {
        Why::ReferenceAtRest | Why::Disagrees | Why::NotExcited { .. } | Why::OneRate { .. } => {
            unexcited(why, subject, voice)
        }
        Why::AtRest { noise } => {
            let own = adequate(noise, subject, voice).into_iter().enumerate();
            let role = |k, role| {
                if k == 0 {
                    Lead
                } else if role == Nothing {
                    More
                } else {
                    role
                }
            };
            own.map(|(k, piece)| Piece { role: role(k, piece.role), ..piece }).collect()
        }
        Why::TooShort { seconds: length } => two(
            format!(
                "the error is what noise alone leaves, but {} of data are too short to show slow effects",
                seconds(*length)
            ),
            ": ",
            "record a minute or more, turning to and fro at several speeds",
            "",
        ),
        Why::Silent { share } => two(
            format!("in {:.0} % of {log} the rate is not known", 100.0 * share),
            ": ",
            "readings are missing, or lie inside a play or a dead zone, or beyond the range. In the rest the error is what noise alone \
             leaves. Record a rate that keeps changing, so that it passes a play or a dead zone quickly, and that stays within the range",
            ".",
        ),
        Why::SlowOrWander { effect, wander } => two(
            format!(
                "a slow error is left that a wandering bias ({}) and {effect} explain equally well",
                wanders(wander, voice)
            ),
            ": ",
            "record a second cycle (heat and cool, or restart hot), or a log twice as long",
            "",
        ),
        Why::NoiseOrEffect { effect } => two(
            format!("an error is left that may be noise or {effect}, which removes little of it"),
            ". ",
            format!("To show which, record: {}", effects::find(effect).map_or("", |effect| effect.card().excited_by)),
            ".",
        ),
        Why::NoneStandsOut { over_white, unattributed } => two(
            format!(
                "the error is up to {over_white:.1} times what white noise leaves, and {:.0} % of the error² has no known cause",
                100.0 * unattributed
            ),
            ". ",
            "No effect of the catalogue stands out: the cause may be a wandering bias, or an effect that is not in the catalogue. Record \
             a second log, and one at rest",
            ".",
        ),
        Why::NotSearched { over_floor, small } => two(
            format!("what is left may be a wandering bias or a {} effect", if *small { "small" } else { "slow" }),
            ": ",
            looked_for(*over_floor, voice),
            ".",
        ),
        Why::Hidden { known } => vec![
            Piece::new(
                Lead,
                format!(
                    "{:.0} % of the error² has a known cause, and the error is too large to show smaller effects of the gyro",
                    100.0 * known
                ),
                ".",
            ),
            what_limits(subject, voice),
        ],
        Why::Dependent => dependent(subject, voice),
    }
}

/// The error over floor, and who looks for its cause.
fn looked_for(over_floor: f64, voice: Voice) -> String {
    let (over, searcher) = (units::ratio(over_floor), voice.searcher());
    format!("the error is up to {over} times the floor. Next: {searcher} looks for the effect")
}

/// A reference that is none, and how to insist on it.
fn dependent(subject: &Subject, voice: Voice) -> Vec<Piece> {
    let concerns =
        |fault: &&DataFault| fault.kind == crate::fault::FaultKind::DependentReference && fault.concerns(subject.axis);
    let Some(fault) = subject.faults.iter().find(concerns) else { return Vec::new() };
    // Who made the reference of a whole log was told by its file, which says how to insist.
    let insists = match (fault.axis, voice) {
        (None, _) | (_, Voice::Stream) => String::new(),
        _ => format!("; {} judges it all the same", Argument::Dependent.name(voice)),
    };
    let ends = [". ", ": "].into_iter().filter_map(|end| Some((fault.says.find(end)?, end)));
    let mut pieces = lead_and_more(&fault.says, ends.min().map_or(". ", |(_, end)| end));
    if let Some(last) = pieces.last_mut() {
        last.text.push_str(&insists);
    }
    pieces
}

fn unexplained(excess: &Excess, voice: Voice) -> Vec<Piece> {
    match excess {
        Excess::NoEffect { over_floor, unattributed } => {
            let help = match voice {
                Voice::Log => " (`truerate effects --help`)",
                Voice::Stream | Voice::Library | Voice::Page => "",
            };
            let text = format!(
                "the error is up to {over_floor:.1} times what noise leaves, {:.0} % of the error² has no known cause, and no effect of \
                 the catalogue removes it: look at where it fails, check the reference and its mounting, or describe the effect that you \
                 suspect as your own{help}",
                100.0 * unattributed
            );
            vec![Piece::new(More, text, ".")]
        }
        Excess::OtherZero { when: ZeroMoves::ForAWhile { .. }, .. } => {
            let text = "a driver that measures its zero at rest may have taken slow turning for rest: switch its own calibration off, or let it \
                        calibrate only where the vehicle is known to rest. Or the supply sagged: log its voltage"
                .to_owned();
            vec![Piece::new(More, text, ".")]
        }
        Excess::OtherZero { when: ZeroMoves::WithAngle, .. } => {
            let text = "where the shaft is not upright, gravity may shift the zero: it acts on another side of the sensor at each angle. \
                        Log the accelerometer: g-sensitivity can then be tested. Or set the shaft upright and see whether this goes away"
                .to_owned();
            vec![Piece::new(More, text, ".")]
        }
        Excess::OtherZero { when: ZeroMoves::Moving, .. } => {
            let text = "vibration of the motors may shift the zero, or their current may change the sensor's supply. Log the accelerometer \
                        and the supply voltage: g-squared-sensitivity and supply-voltage can then be tested"
                .to_owned();
            vec![Piece::new(More, text, ".")]
        }
        Excess::NotSearched => {
            let text = format!("more than noise is left: {} looks for the effect that is missing", voice.searcher());
            vec![Piece::new(Nothing, text, ".")]
        }
        Excess::NoWander { over_floor } => {
            vec![
                Piece::new(
                    Nothing,
                    format!("this is not noise: the error is up to {} times the floor", units::ratio(*over_floor)),
                    ". ",
                ),
                Piece::new(More, format!("Next: {} looks for the effect", voice.searcher()), "."),
            ]
        }
    }
}
