//! Judgements and trials as messages and as JSON.

use super::judgement::Judgement;
use gyro_model::{
    detail::Trace,
    diagnosis::{AxisResult, DIAGNOSIS, Diagnosis, ErrorPoint},
    drift, headline,
    learning::Trial,
    words::Voice,
};
use ipc_types::{
    Text,
    diagnosis::{self as message, SUSPECTS, TAUS, TrialState},
    topic::REPORT_BYTES,
};

/// The message, without run, number, trial and last stamp.
#[must_use]
pub fn of(judgement: &Judgement) -> ipc_types::Diagnosis {
    let mut message = ipc_types::Diagnosis {
        epoch: judgement.job.model.epoch,
        search: judgement.job.search,
        from_ns: judgement.span.0,
        to_ns: judgement.span.1,
        compensator_took_ns: judgement.job.took_ns,
        ..ipc_types::Diagnosis::default()
    };
    for axis in &judgement.axes {
        message.axes[axis.axis.index()] = of_axis(axis);
    }
    message
}

/// The whole as JSON; the axes are taken for it.
#[must_use]
pub fn report(judgement: &mut Judgement, name: &str) -> Vec<u8> {
    let mut axes = std::mem::take(&mut judgement.axes);
    headline::fill(&mut axes, Voice::Stream);
    drift::fill(&mut axes);
    let mut whole = Diagnosis::new(DIAGNOSIS, name, axes);
    let report = serde_json::to_vec(&whole).unwrap_or_default();
    if report.len() <= REPORT_BYTES {
        return report;
    }
    // The overlay over time is most of it, and the watchers see the motion itself.
    for detail in whole.axes.iter_mut().filter_map(|a| a.detail.as_mut()) {
        detail.trace = Trace::default();
    }
    serde_json::to_vec(&whole).unwrap_or_default()
}

/// A trial that was decided, at this epoch, in this way.
#[must_use]
pub fn of_trial(effect: &str, axis: u32, trial: Option<&Trial>, epoch: u64, state: TrialState) -> message::Trial {
    let mut out = message::Trial {
        effect: Text::new(effect),
        state: state as u32,
        axis,
        epoch,
        present: f64::NAN,
        other: f64::NAN,
        ..message::Trial::default()
    };
    let of = |axes: &[AxisResult], curve: &mut [message::ErrorPoint; TAUS]| {
        let judged = axes.iter().find(|a| axis as usize == a.axis.index()).or(axes.first());
        judged.map_or(f64::NAN, |a| {
            fill(curve, &a.error_curve);
            number(a.error_over_floor)
        })
    };
    if let Some(trial) = trial {
        out.present = of(&trial.present, &mut out.present_curve);
        out.other = of(&trial.other, &mut out.other_curve);
    }
    out
}

fn number(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// The longest averaging times say most; the shortest go where there is no room.
fn fill(curve: &mut [message::ErrorPoint; TAUS], points: &[ErrorPoint]) {
    let first = points.len().saturating_sub(TAUS);
    for (slot, point) in curve.iter_mut().zip(&points[first..]) {
        *slot = message::ErrorPoint {
            tau: point.tau_s,
            error: number(point.error),
            floor: number(point.floor),
            floor_99: number(point.floor_99),
        };
    }
}

fn of_axis(axis: &AxisResult) -> message::AxisResult {
    let mut out = message::AxisResult {
        present: 1,
        within_floor: u32::from(axis.within_floor == Some(true)),
        verdict: Text::new(&word(axis)),
        error_over_floor: number(axis.error_over_floor),
        ..message::AxisResult::default()
    };
    fill(&mut out.curve, &axis.error_curve);
    for (slot, suspect) in out.suspects.iter_mut().zip(axis.suspects.iter().take(SUSPECTS)) {
        *slot = message::Suspect {
            effect: Text::new(&suspect.effect),
            aliases: Text::new(&suspect.aliases.join(" ")),
            error_fall: number(suspect.error_fall),
            p_value: number(suspect.p_value),
        };
    }
    out
}

/// The verdict as in the JSON.
fn word(axis: &AxisResult) -> String {
    serde_json::to_value(axis.verdict).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
