//! What a running pipeline has found: its diagnosis, the model that runs, whether either may still change.

use crate::{
    agreement::looking,
    dashboard::{judgement, model},
};
use gyro_model::{
    diagnosis::{AxisDiagnosis, Diagnosis},
    headline,
    words::Voice,
};
use ipc_types::{
    Parameters,
    port::{BytesReader, Hub, Reader},
    topic,
    wait::Wait,
};
use serde_json::{Value, json};
use std::fmt::Write as _;
use workbench::report::units;

/// What was found so far.
#[derive(Debug, Default)]
pub struct Found {
    /// The running model.
    pub model: Option<model::ModelView>,
    /// The newest diagnosis.
    pub diagnosis: Option<Diagnosis>,
    /// What is said of each axis as long as its diagnosis may still change.
    pub looking: [Option<String>; 3],
}

/// Keys that are drawn, not read: curves, and the pictures behind a verdict.
const DRAWN: [&str; 3] = ["error_curve", "missing_error_curve", "detail"];

impl Found {
    /// As the interface has it: the axes of a diagnosis without curves.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut axes = self.diagnosis.as_ref().map(|diagnosis| diagnosis.axes.clone()).unwrap_or_default();
        headline::fill(&mut axes, Voice::Stream);
        let axis = |axis: &AxisDiagnosis| {
            let error = headline::said(&axis.error_curve).map(|point| json!(point));
            let mut value = json!(axis);
            without_drawings(&mut value);
            value["error"] = json!(error);
            value["looking"] = json!(self.looking[axis.axis.index()]);
            value
        };
        json!({ "axes": axes.iter().map(axis).collect::<Vec<_>>() })
    }

    /// The verdict, the error and the running model of each axis; what is waited for where there is no verdict yet.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        let page = self.diagnosis.as_ref().map(judgement::page);
        let letters: Vec<&str> = page.iter().flat_map(|page| &page.axes).map(|axis| axis.axis).collect();
        for (view, axis) in page.iter().flat_map(|page| &page.axes).zip(self.diagnosis.iter().flat_map(|d| &d.axes)) {
            let headline = match &self.looking[axis.axis.index()] {
                Some(looking) => format!("{looking} So far: {}", view.headline),
                None => view.headline.clone(),
            };
            let _ = writeln!(out, "axis {}  {headline}", view.axis);
            let mut facts = vec![view.label.clone()];
            if let Some((point, error)) =
                headline::said(&axis.error_curve).and_then(|point| Some((point, point.error?)))
            {
                let floor =
                    point.floor.map_or_else(String::new, |floor| format!(" (floor {} °/s)", units::rate(Some(floor))));
                facts.push(format!("error over {} {} °/s{floor}", units::time(point.tau_s), units::rate(Some(error))));
            }
            facts.extend(view.error_over_floor.map(|ratio| format!("error ÷ noise {}", units::ratio(ratio))));
            let _ = writeln!(out, "        {}", facts.join("; "));
            self.model_of(view.axis, &mut out);
        }
        for axis in self.model.iter().flat_map(|model| &model.axes).filter(|axis| !letters.contains(&axis.axis)) {
            let _ = writeln!(out, "axis {}  no diagnosis yet: the first comes after some seconds of motion", axis.axis);
            self.model_of(axis.axis, &mut out);
        }
        if out.is_empty() {
            out.push_str("no diagnosis yet: the first comes after some seconds of motion\n");
        }
        out
    }

    fn model_of(&self, letter: &str, out: &mut String) {
        let Some(model) = &self.model else { return };
        let shown = model.axes.iter().filter(|axis| axis.axis == letter).flat_map(|axis| &axis.parameters);
        let shown: Vec<String> = shown.map(|p| format!("{}.{} {}", p.effect, p.name, p.shown)).collect();
        if !shown.is_empty() {
            let _ = writeln!(out, "        model of epoch {}: {}", model.epoch, shown.join(", "));
        }
    }
}

fn without_drawings(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|key, _| !DRAWN.contains(&key.as_str()));
            map.values_mut().for_each(without_drawings);
        }
        Value::Array(items) => items.iter_mut().for_each(without_drawings),
        _ => {}
    }
}

/// The ports that tell it.
pub struct Finder {
    parameters: Reader<Parameters>,
    diagnoses: Reader<ipc_types::Diagnosis>,
    reports: BytesReader,
    has_report: bool,
}

impl Finder {
    /// Opens them.
    ///
    /// # Errors
    /// Where the topics are not there.
    pub fn open(hub: &Hub) -> anyhow::Result<Self> {
        Ok(Self {
            parameters: hub.reader(&topic::PARAMETERS, None, Wait::Spin)?,
            diagnoses: hub.reader(&topic::DIAGNOSIS, None, Wait::Spin)?,
            reports: hub.bytes_reader(&topic::REPORT)?,
            has_report: false,
        })
    }

    /// Takes what has come.
    ///
    /// # Errors
    /// Broken plumbing.
    pub fn look(&mut self, found: &mut Found) -> anyhow::Result<()> {
        if let Some(parameters) = self.parameters.newest()? {
            found.model = Some(model::view(&parameters));
        }
        let message = self.diagnoses.newest()?;
        if let Some(message) = &message {
            found.looking = [0, 1, 2].map(|place| looking(message, place));
        }
        if let Some(diagnosis) = self.reports.newest()?.and_then(|bytes| judgement::of_report(&bytes)) {
            self.has_report = true;
            found.diagnosis = Some(diagnosis);
        } else if let Some(message) = message.filter(|_| !self.has_report) {
            found.diagnosis = Some(judgement::of_message(&message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ipc_types::{Text, diagnosis::ErrorPoint};

    #[test]
    fn the_verdict_its_error_and_the_model_are_said_without_curves() {
        let mut message = ipc_types::Diagnosis::default();
        let axis = &mut message.axes[2];
        (axis.present, axis.verdict, axis.error_over_floor) = (1, Text::new("missing-effect"), 9.0);
        axis.suspects[0].effect = Text::new("delay");
        axis.curve[0] = ErrorPoint { tau: 1.0, error: 0.02, floor: 0.01, floor_99: f64::NAN };
        let mut found = Found { diagnosis: Some(judgement::of_message(&message)), ..Found::default() };
        found.looking[2] = Some("Looking for the cause: 12 of 30 s of motion seen.".into());
        let axis = &found.json()["axes"][0];
        assert_eq!((&axis["verdict"], &axis["axis"]), (&json!("missing-effect"), &json!("z")));
        assert_eq!((&axis["error"]["error"], &axis["error"]["tau_s"]), (&json!(0.02), &json!(1.0)));
        assert!(axis.get("error_curve").is_none() && axis["suspects"][0].get("error_curve").is_none(), "{axis}");
        assert!(axis["headline"].as_str().is_some_and(|says| says.contains("delay")), "{axis}");
        assert!(axis["looking"].as_str().is_some_and(|says| says.contains("12 of 30 s")), "{axis}");
        let text = found.text();
        assert!(text.starts_with("axis z  Looking for the cause: 12 of 30 s of motion seen. So far: "), "{text}");
        assert!(
            text.contains("missing effect: delay; error over 1 s 1.15 °/s (floor 0.573 °/s); error ÷ noise 9.0"),
            "{text}"
        );
        assert_eq!(Found::default().json(), json!({ "axes": [] }));
        assert!(Found::default().text().starts_with("no diagnosis yet"));
    }
}
