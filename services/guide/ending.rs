//! What a guided recording came to: verdicts, what is lacking, and what to run next.

use super::{Settings, goal};
use gyro_model::{
    diagnosis::{AxisResult, Verdict},
    guide::{Goal, Guide, Trouble},
    headline,
    words::Voice,
};
use serde::Serialize;

/// See the module's head.
#[derive(Clone, Debug, Serialize)]
pub struct Ending {
    /// Whether all that was asked can be told.
    pub complete: bool,
    /// Whether it was stopped from outside.
    pub interrupted: bool,
    /// The log; `None` where nothing was recorded.
    pub log: Option<String>,
    /// Its length, s, and its rows.
    pub seconds: f64,
    /// Rows.
    pub rows: u64,
    /// What a search of the log says, axis by axis.
    pub verdicts: Vec<Told>,
    /// What was wanted, as it is known.
    pub parameters: Vec<Goal>,
    /// What kept it from being known, whatever the hand did.
    pub troubles: Vec<Trouble>,
    /// What is not known as well as was wanted.
    pub lacking: Vec<String>,
    /// Whether the question was what is missing, whatever that is.
    #[serde(skip)]
    pub course: bool,
    /// The command to run next.
    pub next: Option<String>,
}

/// What is said of an axis.
#[derive(Clone, Debug, Serialize)]
pub struct Told {
    /// The axis.
    pub axis: gyro_model::Axis,
    /// The verdict.
    pub verdict: Verdict,
    /// In a sentence.
    pub headline: String,
    /// What was named.
    pub effects: Vec<String>,
    /// How what looks alike is told apart; empty where nothing does.
    pub separate_by: String,
}

impl Ending {
    pub(super) fn new(guide: Option<&Guide>, settings: &Settings, interrupted: bool) -> Self {
        let log = settings.log.display().to_string();
        let Some(guide) = guide else {
            return Self {
                complete: false,
                interrupted,
                log: None,
                seconds: 0.0,
                rows: 0,
                verdicts: Vec::new(),
                parameters: Vec::new(),
                troubles: Vec::new(),
                lacking: vec!["everything: no row came".to_owned()],
                course: false,
                next: None,
            };
        };
        let state = guide.state();
        let mut axes = guide.axes().to_vec();
        headline::fill(&mut axes, Voice::Log);
        let verdicts: Vec<Told> = axes.iter().map(told).collect();
        let course = settings.effects.is_none();
        let lacking = state.goals.iter().filter(|goal| !goal.known).map(lack).collect();
        let next = next(&verdicts, settings, &log);
        Self {
            complete: guide.is_complete(),
            interrupted,
            log: Some(log),
            seconds: state.seconds,
            rows: state.rows,
            verdicts,
            parameters: state.goals,
            troubles: state.troubles,
            lacking,
            course,
            next: Some(next),
        }
    }
}

fn told(axis: &AxisResult) -> Told {
    let best = axis.in_question().filter(|_| matches!(axis.verdict, Verdict::MissingEffect | Verdict::Ambiguous));
    let named = best.map_or_else(Vec::new, |best| {
        std::iter::once(best.effect.clone()).chain(best.aliases.iter().cloned()).collect::<Vec<_>>()
    });
    let alike = best.filter(|_| axis.verdict == Verdict::Ambiguous);
    Told {
        axis: axis.axis,
        verdict: axis.verdict,
        headline: axis.headline.clone(),
        effects: named,
        separate_by: alike.map_or_else(String::new, |best| best.separate_by.clone()),
    }
}

/// What a goal lacks, in words.
fn lack(goal: &Goal) -> String {
    let (name, now, wanted) = goal::shown(goal);
    let have = format!("axis {}: {name} is {now}, {wanted} was wanted", goal.axis);
    goal.out_of_reach.as_ref().map_or_else(|| have.clone(), |why| format!("{have}; {why}"))
}

/// The command that goes on from here.
fn next(verdicts: &[Told], settings: &Settings, log: &str) -> String {
    let is = |wanted: Verdict| verdicts.iter().any(|told| told.verdict == wanted);
    let axis = match settings.axes.as_slice() {
        [axis] => format!(" --axis {axis}"),
        _ => String::new(),
    };
    match &settings.effects {
        _ if verdicts.is_empty() || is(Verdict::BadData) => format!("truerate diagnose {log}{axis}"),
        Some(effects) => {
            let ids = effects.iter().map(|effect| effect.card().id);
            let ids: Vec<&str> = ids.filter(|id| !["scale-factor", "bias"].contains(id)).collect();
            if ids.is_empty() {
                format!("truerate fit {log}{axis} -o model.toml")
            } else {
                format!("truerate add {log} {}{axis} -o model.toml", ids.join(" "))
            }
        }
        None if is(Verdict::MissingEffect) || is(Verdict::Ambiguous) || is(Verdict::Unexplained) => {
            format!("truerate ladder {log}{axis} -o model.toml")
        }
        None if is(Verdict::CannotTell) => format!("truerate diagnose {log}{axis}"),
        None => format!("truerate fit {log}{axis} -o model.toml"),
    }
}
