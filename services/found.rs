//! What a running pipeline has found: its diagnosis, the model that runs, whether either may still change.

use crate::{
    agreement::looking,
    clock::now_ns,
    dashboard::{judgement, model},
    story,
};
use gyro_model::{
    Axis,
    diagnosis::{AxisResult, Diagnosis, Verdict},
    headline,
    words::Voice,
};
use ipc_types::{
    Parameters,
    diagnosis::{Trial, TrialState},
    port::{BytesReader, Hub, Reader},
    topic,
    wait::Wait,
};
use serde_json::{Value, json};
use std::fmt::Write as _;
use workbench::report::{units, view::AxisView};

/// What was found so far.
#[derive(Debug, Default)]
pub struct Found {
    /// The running model.
    pub model: Option<model::ModelView>,
    /// The newest diagnosis.
    pub diagnosis: Option<Diagnosis>,
    /// What is said of each axis as long as its diagnosis may still change.
    pub looking: [Option<String>; 3],
    /// The last trial of an effect.
    pub trial: Option<Trial>,
}

/// What is said of an axis: what was won by the last change first, as long as nothing more is to be done.
#[derive(Debug, PartialEq, Eq)]
pub struct Said {
    /// In one line.
    pub first: String,
    /// What stands below it.
    pub then: Option<String>,
    /// Whether the first line says what was won.
    pub is_won: bool,
}

/// Keys that are drawn, not read: curves, and the pictures behind a verdict.
const DRAWN: [&str; 3] = ["error_curve", "missing_error_curve", "detail"];

impl Found {
    /// What is said of an axis.
    #[must_use]
    pub fn said(&self, view: &AxisView) -> Said {
        let Some(place) = "xyz".find(view.axis) else { return Said::usual(view.headline.clone()) };
        let looking = self.looking[place].as_ref();
        let usual = looking.map_or_else(|| view.headline.clone(), |says| format!("{says} So far: {}", view.headline));
        let named = matches!(view.verdict, Verdict::MissingEffect | Verdict::Ambiguous)
            .then(|| view.suspects.first().map(|suspect| suspect.effect.as_str()))
            .flatten();
        // A judgement may still be of the model before the change.
        let is_old = named.is_some_and(|id| self.has(place, id));
        let is_more = named.is_some() && !is_old && looking.is_none();
        match self.won(place).filter(|_| !is_more) {
            Some(first) => Said { first, then: (!is_old).then_some(usual), is_won: true },
            None => Said::usual(usual),
        }
    }

    /// What the last effect that took over has won on an axis, as long as the model has it.
    fn won(&self, place: usize) -> Option<String> {
        let is_on = |trial: &&Trial| trial.axis as usize == place || trial.axis as usize >= Axis::ALL.len();
        let took_over = |trial: &&Trial| trial.state == TrialState::TookOver as u32;
        let trial = self.trial.as_ref().filter(took_over).filter(is_on)?;
        self.has(place, trial.effect.as_str()).then(|| story::won(trial))
    }

    /// Whether the running model has an effect on an axis.
    fn has(&self, place: usize, id: &str) -> bool {
        let axes = self.model.iter().flat_map(|model| &model.axes);
        axes.filter(|axis| "xyz".find(axis.axis) == Some(place)).any(|axis| axis.effects.iter().any(|own| own == id))
    }

    /// As the interface has it: the axes of a diagnosis without curves.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut axes = self.diagnosis.as_ref().map(|diagnosis| diagnosis.axes.clone()).unwrap_or_default();
        headline::fill(&mut axes, Voice::Stream);
        let axis = |axis: &AxisResult| {
            let error = headline::said(&axis.error_curve).map(|point| json!(point));
            let mut value = json!(axis);
            without_drawings(&mut value);
            value["error"] = json!(error);
            value["looking"] = json!(self.looking[axis.axis.index()]);
            value["won"] = json!(self.won(axis.axis.index()));
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
            let said = self.said(view);
            let _ = writeln!(out, "axis {}  {}", view.axis, said.first);
            if let Some(then) = said.then {
                let _ = writeln!(out, "        {then}");
            }
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

impl Said {
    fn usual(first: String) -> Self {
        Self { first, then: None, is_won: false }
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
    /// When all of them were open, ns.
    opened_ns: u64,
    has_caught_up: bool,
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
            opened_ns: now_ns(),
            has_caught_up: false,
        })
    }

    /// Whether all that was given before these ports were open has been taken: the compensator gives its parameters ten times a
    /// second, and the last diagnosis to every new reader before them.
    #[must_use]
    pub fn has_caught_up(&self) -> bool {
        self.has_caught_up
    }

    /// Takes what has come.
    ///
    /// # Errors
    /// Broken plumbing.
    pub fn look(&mut self, found: &mut Found) -> anyhow::Result<()> {
        if let Some(parameters) = self.parameters.newest()? {
            self.has_caught_up |= parameters.compensator_gave_ns >= self.opened_ns;
            found.model = Some(model::view(&parameters));
        }
        let message = self.diagnoses.newest()?;
        if let Some(message) = &message {
            found.looking = [0, 1, 2].map(|place| looking(message, place));
            found.trial = Some(message.trial);
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
        // The effect was added: what it has won comes first, and the judgement before it is not repeated.
        let mut trial =
            Trial { effect: Text::new("delay"), axis: 2, state: TrialState::TookOver as u32, ..Trial::default() };
        trial.present_curve[0] = ErrorPoint { tau: 1.0, error: 0.02, floor: 0.01, floor_99: 0.012 };
        trial.other_curve[0] = ErrorPoint { error: 0.011, ..trial.present_curve[0] };
        let of = |effects: &[&str]| {
            let effects = effects.iter().map(|id| (*id).to_owned()).collect();
            let axes = vec![model::AxisView { axis: "z", effects, parameters: Vec::new() }];
            Some(model::ModelView { epoch: 2, paused: false, samples: 100, axes })
        };
        (found.trial, found.looking[2]) = (Some(trial), None);
        found.model = of(&["scale-factor", "bias", "delay"]);
        let won = "Delay added: 1.15 → 0.630 °/s over 1 s; what is left is noise.";
        assert!(found.text().starts_with(&format!("axis z  {won}\n        missing effect")), "{}", found.text());
        assert_eq!(found.json()["axes"][0]["won"], won);
        // Something else is missing, or it was taken back: that comes first.
        message.axes[2].suspects[0].effect = Text::new("lag");
        found.diagnosis = Some(judgement::of_message(&message));
        assert!(found.text().starts_with("axis z  'lag' is missing"), "{}", found.text());
        (found.model, found.diagnosis) = (of(&["scale-factor", "bias"]), None);
        assert!(found.json()["axes"].as_array().is_some_and(Vec::is_empty) && found.won(2).is_none());
        assert_eq!(Found::default().json(), json!({ "axes": [] }));
        assert!(Found::default().text().starts_with("no diagnosis yet"));
    }
}
