//! JSON: the interface's keys, SI units, `null` where there is no value.
//!
//! The overlay over time stays out: it is the log again, and `truerate apply` gives it in full.

use super::{Against, BothSides, Change};
use gyro_model::{
    diagnosis::{AxisResult, Diagnosis},
    drift,
    headline::{self, Beside, Headline, Named, Together, sides::Sides},
    words::Voice,
};
use serde::Serialize;

/// A result, and what its axes have in common.
#[derive(Serialize)]
struct WithTogether<T: Serialize> {
    #[serde(flatten)]
    result: T,
    #[serde(flatten)]
    together: Together,
}

/// `compare`, `diagnose`, `ladder`.
pub(super) fn diagnosis(diagnosis: &Diagnosis, voice: Voice) -> String {
    let together = Together::of(&diagnosis.axes.iter().map(Named::of).collect::<Vec<_>>());
    line(&WithTogether { result: Diagnosis { axes: spoken(&diagnosis.axes, voice), ..diagnosis.clone() }, together })
}

/// `add`, `remove`: the new model's diagnosis, with `added`, `removed` and the axes `before`.
pub(super) fn change(change: &Change, voice: Voice) -> String {
    #[derive(Serialize)]
    struct Json<'a> {
        #[serde(flatten)]
        after: Diagnosis,
        added: &'a [String],
        removed: &'a [String],
        before: Vec<AxisResult>,
        #[serde(flatten)]
        together: Together,
    }
    let mut axes = spoken(&change.after.axes, voice);
    for axis in &mut axes {
        let before = change.before.axes.iter().find(|b| b.axis == axis.axis);
        let Headline { answer, at_source } = headline::of_change(change.added, change.removed, before, axis, voice);
        (axis.headline, axis.at_source) = (answer, at_source);
    }
    line(&Json {
        after: Diagnosis { axes, ..change.after.clone() },
        added: change.added,
        removed: change.removed,
        before: spoken(&change.before.axes, voice),
        together: Together::of(
            &change.after.axes.iter().map(|axis| Named::by_change(change.added, axis)).collect::<Vec<_>>(),
        ),
    })
}

/// `compare --against`: the model's diagnosis, with the other's under `against`, and how it stands on each axis.
pub(super) fn against(against: &Against, voice: Voice) -> String {
    #[derive(Serialize)]
    struct Other<'a> {
        model: &'a str,
        axes: Vec<AxisResult>,
    }
    #[derive(Serialize)]
    struct Json<'a> {
        #[serde(flatten)]
        diagnosis: Diagnosis,
        model: &'a str,
        against: Other<'a>,
        beside: Vec<Beside>,
        #[serde(flatten)]
        together: Together,
    }
    let mut axes = spoken(&against.diagnosis.axes, voice);
    let (mut beside, mut named) = (Vec::new(), Vec::new());
    for (axis, spoken) in against.diagnosis.axes.iter().zip(&mut axes) {
        let Some(other) = against.other.axes.iter().find(|other| other.axis == axis.axis) else { continue };
        let names = (against.model, against.other_model);
        let Headline { answer, at_source } = headline::of_against(names, axis, other, &[]);
        (spoken.headline, spoken.at_source) = (answer, at_source);
        beside.extend(Beside::of(axis, other));
        named.push(headline::by_which(axis, other));
    }
    line(&Json {
        diagnosis: Diagnosis { axes, ..against.diagnosis.clone() },
        model: against.model,
        against: Other { model: against.other_model, axes: spoken(&against.other.axes, voice) },
        beside,
        together: Together::of(&named),
    })
}

pub(super) fn sides(both: &BothSides, voice: Voice) -> String {
    #[derive(Serialize)]
    struct Json<'a> {
        schema: &'static str,
        logs: &'a [String; 2],
        axes: &'a [Sides],
        each: Vec<Vec<AxisResult>>,
    }
    let each = both.diagnoses.iter().map(|own| spoken(&own.axes, voice)).collect();
    line(&Json { schema: "truerate.side-by-side/1", logs: &both.names, axes: &both.sides, each })
}

/// With their headlines, and without the overlay.
fn spoken(axes: &[AxisResult], voice: Voice) -> Vec<AxisResult> {
    let mut axes = axes.to_vec();
    headline::fill(&mut axes, voice);
    drift::fill(&mut axes);
    for detail in axes.iter_mut().filter_map(|a| a.detail.as_mut()) {
        detail.trace = gyro_model::detail::Trace::default();
    }
    axes
}

/// serde writes a number that is not finite as `null`; these types hold nothing else that could fail.
fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_else(|error| format!("{{\"error\":\"{error}\"}}")) + "\n"
}
