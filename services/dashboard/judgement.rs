//! The compensator's diagnosis, ready for the page.

use crate::story;
use gyro_model::{
    Axis,
    diagnosis::{AxisResult, DIAGNOSIS, Diagnosis, Suspect, Verdict},
    finding::Finding,
};
use ipc_types::diagnosis::{self as wire, TrialState};
use serde::Serialize;
pub use workbench::report::stream::{errors, page};

/// The whole diagnosis out of the compensator's report; `None` where it is not one.
#[must_use]
pub fn of_report(bytes: &[u8]) -> Option<Diagnosis> {
    serde_json::from_slice(bytes).ok()
}

/// What the short message holds, for a pipeline that gives no report.
#[must_use]
pub fn of_message(message: &ipc_types::Diagnosis) -> Diagnosis {
    let axes =
        Axis::ALL.into_iter().zip(&message.axes).filter(|(_, a)| a.present == 1).map(|(axis, a)| axis_of(axis, a));
    Diagnosis::new(DIAGNOSIS, "live", axes.collect())
}

fn axis_of(axis: Axis, a: &wire::AxisResult) -> AxisResult {
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    let suspects = a.suspects.iter().filter(|s| !s.effect.as_str().is_empty());
    let verdict = serde_json::from_value(a.verdict.as_str().into()).unwrap_or(Verdict::CannotTell);
    AxisResult {
        error_curve: crate::wire::curve_of(&a.curve),
        error_over_floor: finite(a.error_over_floor),
        within_floor: Some(a.within_floor == 1),
        searched: true,
        suspects: suspects
            .map(|s| Suspect {
                effect: s.effect.as_str().into(),
                aliases: s.aliases.as_str().split_whitespace().map(Into::into).collect(),
                separate_by: String::new(),
                p_value: finite(s.p_value),
                error_fall: finite(s.error_fall),
                log_likelihood_gain: None,
                parameters: Vec::new(),
                error_curve: Vec::new(),
            })
            .collect(),
        ..AxisResult::new(axis, Finding::Bare { verdict })
    }
}

/// The last trial: the model in use beside the other one, on the same samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialView {
    /// What the other model has more.
    pub effect: String,
    /// `x`, `y`, `z`.
    pub axis: &'static str,
    /// `on trial`, `took over`, `given up`.
    pub state: &'static str,
    /// Epoch of the model in use when it was last decided.
    pub epoch: u64,
    /// Error curve of the model in use.
    pub present: TrialCurve,
    /// Error curve of the other.
    pub other: TrialCurve,
    /// What was won, where it took over; else empty.
    pub says: String,
}

/// An error curve in °/s, with the largest error over floor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialCurve {
    /// Largest error over floor.
    pub error_over_floor: Option<f64>,
    /// s.
    pub tau: Vec<f64>,
    /// °/s.
    pub error: Vec<Option<f64>>,
    /// °/s.
    pub floor: Vec<Option<f64>>,
    /// °/s.
    pub floor_99: Vec<Option<f64>>,
}

/// The last trial; `None` where there was none.
#[must_use]
pub fn trial(trial: &wire::Trial) -> Option<TrialView> {
    let state = match trial.state {
        s if s == TrialState::OnTrial as u32 => "on trial",
        s if s == TrialState::TookOver as u32 => "took over",
        s if s == TrialState::GivenUp as u32 => "given up",
        _ => return None,
    };
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    let curve = |points: &[wire::ErrorPoint], over: f64| {
        let points: Vec<&wire::ErrorPoint> = points.iter().filter(|p| p.tau > 0.0).collect();
        let degrees =
            |value: fn(&wire::ErrorPoint) -> f64| points.iter().map(|p| finite(value(p).to_degrees())).collect();
        TrialCurve {
            error_over_floor: finite(over),
            tau: points.iter().map(|p| p.tau).collect(),
            error: degrees(|p| p.error),
            floor: degrees(|p| p.floor),
            floor_99: degrees(|p| p.floor_99),
        }
    };
    Some(TrialView {
        effect: trial.effect.to_string(),
        axis: Axis::ALL.get(trial.axis as usize).map_or("every", |axis| axis.letter()),
        state,
        epoch: trial.epoch,
        present: curve(&trial.present_curve, trial.present),
        other: curve(&trial.other_curve, trial.other),
        says: if trial.state == TrialState::TookOver as u32 { story::won(trial) } else { String::new() },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::finding::Why;
    use ipc_types::Text;

    #[test]
    fn the_short_message_makes_a_page_with_cards() {
        let mut message = ipc_types::Diagnosis::default();
        let axis = &mut message.axes[2];
        (axis.present, axis.verdict, axis.error_over_floor) = (1, Text::new("missing-effect"), 9.0);
        axis.suspects[0].effect = Text::new("delay");
        axis.suspects[0].error_fall = 0.97;
        axis.curve[0] = wire::ErrorPoint { tau: 1.0, error: 0.1, floor: 0.01, floor_99: f64::NAN };
        let diagnosis = of_message(&message);
        let page = page(&diagnosis);
        assert_eq!(page.axes.len(), 1);
        assert_eq!(page.axes[0].label, "missing effect: delay");
        assert!(page.axes[0].headline.starts_with("'delay' is missing from the model."), "{}", page.axes[0].headline);
        assert!(!page.axes[0].suspects[0].card.equation.is_empty());
        let error = errors(&diagnosis, 3.0).next().unwrap();
        assert!((error.error.unwrap() - 0.1f64.to_degrees()).abs() < 1e-12 && error.ratio == Some(9.0));
    }

    #[test]
    fn a_trial_is_shown_with_both_curves_in_degrees_and_none_where_there_was_none() {
        assert_eq!(trial(&wire::Trial::default()), None);
        let mut message = wire::Trial {
            effect: Text::new("delay"),
            axis: 2,
            present: 9.0,
            other: f64::NAN,
            ..wire::Trial::default()
        };
        message.state = TrialState::TookOver as u32;
        message.other_curve[0] = wire::ErrorPoint { tau: 1.0, error: 0.1, floor: 0.01, floor_99: f64::NAN };
        let view = trial(&message).unwrap();
        assert_eq!((view.axis, view.state, view.present.error_over_floor), ("z", "took over", Some(9.0)));
        assert!((view.other.error[0].unwrap() - 0.1f64.to_degrees()).abs() < 1e-12);
        assert_eq!((view.other.floor_99[0], view.other.error_over_floor), (None, None));
        assert!(view.present.tau.is_empty());
        message.present_curve[0] = wire::ErrorPoint { error: 0.5, ..message.other_curve[0] };
        let says = |message: &wire::Trial| trial(message).unwrap().says;
        assert!(says(&message).starts_with("Delay added: 28.6 → 5.73 °/s over 1 s; what is left is 10 times"));
        message.state = TrialState::OnTrial as u32;
        assert!(says(&message).is_empty());
    }

    #[test]
    fn a_stream_is_not_called_a_log() {
        let mut message = ipc_types::Diagnosis::default();
        let axis = &mut message.axes[2];
        (axis.present, axis.verdict) = (1, Text::new("ambiguous"));
        axis.suspects[0] =
            wire::Suspect { effect: Text::new("delay"), aliases: Text::new("lag"), ..wire::Suspect::default() };
        let page = page(&of_message(&message));
        let headline = &page.axes[0].headline;
        assert!(headline.contains("; the motion so far cannot tell which"), "{headline}");
        assert!(!serde_json::to_string(&page.axes[0]).unwrap().to_lowercase().contains("this log"));
    }

    #[test]
    fn a_stream_is_not_sent_to_commands_for_logs() {
        let mut message = ipc_types::Diagnosis::default();
        message.axes[2].present = 1;
        let says = |why| {
            let mut diagnosis = of_message(&message);
            diagnosis.axes[0].find(Finding::CannotTell(why));
            page(&diagnosis).axes.remove(0).says
        };
        let left = says(Why::NotSearched { over_floor: 2.5, small: true });
        let live = "Next: the search that runs beside the stream looks for the effect.";
        assert!(left.ends_with(live) && !left.contains("truerate"), "{left}");
    }

    #[test]
    fn bytes_that_are_no_diagnosis_are_none() {
        assert!(of_report(b"{}").is_none() && of_report(b"\xff").is_none());
    }
}
