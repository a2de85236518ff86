//! The compensator's diagnosis, ready for the page.

use super::scene::ErrorAt;
use crate::report::{Command, Context, Terminal, view::Page};
use gyro_model::{
    Axis,
    diagnosis::{AxisDiagnosis, Diagnosis, ErrorPoint, NoiseValue, Suspect, Verdict},
};
use ipc_types::diagnosis as wire;

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
    Diagnosis { schema: "truerate.diagnosis/1".into(), log: "live".into(), axes: axes.collect() }
}

fn axis_of(axis: Axis, a: &wire::AxisDiagnosis) -> AxisDiagnosis {
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    let suspects = a.suspects.iter().filter(|s| !s.effect.as_str().is_empty());
    AxisDiagnosis {
        axis,
        verdict: serde_json::from_value(a.verdict.as_str().into()).unwrap_or(Verdict::CannotTell),
        says: String::new(),
        effects: Vec::new(),
        parameters: Vec::new(),
        noise: NoiseValue::default(),
        error_curve: a
            .curve
            .iter()
            .filter(|p| p.tau > 0.0)
            .map(|p| ErrorPoint {
                tau_s: p.tau,
                error: finite(p.error),
                floor: finite(p.floor),
                floor_99: finite(p.floor_99),
            })
            .collect(),
        error_over_floor: finite(a.error_over_floor),
        within_floor: Some(a.within_floor == 1),
        floor_source: String::new(),
        fails_where: Vec::new(),
        searched: true,
        suspects: suspects
            .map(|s| Suspect {
                effect: s.effect.as_str().into(),
                aliases: s.aliases.as_str().split_whitespace().map(Into::into).collect(),
                separate_by: String::new(),
                p_value: finite(s.p_value),
                error_fall: finite(s.error_fall),
                parameters: Vec::new(),
                error_curve: Vec::new(),
            })
            .collect(),
        data_faults: Vec::new(),
        detail: None,
    }
}

/// As the page shows it: words, human units, cards.
#[must_use]
pub fn page(diagnosis: &Diagnosis) -> Page {
    let context = Context {
        command: Command::Diagnose,
        log: "live".into(),
        model: None,
        output: None,
        flags: Vec::new(),
        terminal: Terminal::PLAIN,
    };
    let mut page = Page::of_diagnosis(diagnosis, &context);
    for axis in &mut page.axes {
        axis.detail = None;
    }
    page
}

/// The figures for the chart over time.
pub fn errors(diagnosis: &Diagnosis, t: f64) -> impl Iterator<Item = ErrorAt> + '_ {
    diagnosis.axes.iter().map(move |axis| {
        let near_1s = axis.error_curve.iter().min_by(|a, b| a.tau_s.ln().abs().total_cmp(&b.tau_s.ln().abs()));
        let degrees = |v: Option<f64>| v.filter(|v| v.is_finite()).map(f64::to_degrees);
        ErrorAt {
            t,
            axis: axis.axis.letter(),
            ratio: axis.error_over_floor.filter(|r| r.is_finite()),
            error: degrees(near_1s.and_then(|p| p.error)),
            floor: degrees(near_1s.and_then(|p| p.floor)),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
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
        assert_eq!(page.axes[0].headline, "missing effect: delay");
        assert!(!page.axes[0].suspects[0].card.equation.is_empty());
        let error = errors(&diagnosis, 3.0).next().unwrap();
        assert!((error.error.unwrap() - 0.1f64.to_degrees()).abs() < 1e-12 && error.ratio == Some(9.0));
    }

    #[test]
    fn bytes_that_are_no_diagnosis_are_none() {
        assert!(of_report(b"{}").is_none() && of_report(b"\xff").is_none());
    }
}
