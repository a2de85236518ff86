//! What the page asks for.

use crate::{
    desk::{Desk, Edit, Reading},
    learner::Learner,
    vehicle::Vehicle,
};
use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::{Value, json};
use workbench::log::LogError;

/// A request. Models are the text of a model file; without one the base model is meant.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
enum Request {
    /// What a file holds.
    Look { log: String, dbc: Option<String> },
    /// Reads a log, which all further requests mean.
    Read(Reading),
    /// How large the error of a model is.
    Compare { model: Option<String> },
    /// Which effect it is missing.
    Diagnose { model: Option<String> },
    /// Adds what is missing until nothing is.
    Ladder { model: Option<String> },
    /// Adds an effect, or removes it.
    Change { model: Option<String>, edits: Vec<Edit> },
    /// The last result: `json`, `text` or `html`.
    Report { form: String },
    /// A model where it is used.
    Export { model: String, name: String, to: String },
    /// The effects that can be added.
    Effects,
    /// Makes a log whose truth is known.
    Simulate { log: String, hide: Vec<String>, seconds: f64, rate: f64, seed: u64 },
    /// Puts a vehicle on the road, with this or what its seed hides in its gyro.
    Vehicle { hide: Option<String>, seed: u64 },
    /// Drives it so many seconds.
    Drive { seconds: f64 },
    /// Compensates its readings with another model from now on.
    UseModel { model: String },
    /// Begins to learn about an axis in which this is hidden.
    Learner { axis: String, hidden: String },
    /// Learns from the rows that have come, and searches for what is missing where that is wanted.
    Learn { search: bool },
    /// Tries an effect, and takes it where it is better.
    Add { effect: String },
    /// Takes an effect out.
    Remove { effect: String },
}

/// What one worker holds: a log on its desk, a vehicle, or what learns beside one.
#[derive(Default)]
pub struct Held {
    desk: Desk,
    vehicle: Option<Vehicle>,
    learner: Option<Learner>,
}

impl Held {
    fn vehicle(&mut self) -> Result<&mut Vehicle> {
        self.vehicle.as_mut().context("there is no vehicle")
    }

    fn learner(&mut self) -> Result<&mut Learner> {
        self.learner.as_mut().context("nobody learns yet")
    }
}

/// Its answer, `{"ok": …}` or `{"error": "…"}`; of a log that lacks something, with the map that makes one of it.
pub fn answer(held: &mut Held, text: &[u8]) -> Vec<u8> {
    let answer = match serve(held, text) {
        Ok(value) => json!({ "ok": value }),
        Err(error) => {
            let advice = error.downcast_ref::<LogError>().and_then(|refused| refused.advice.as_ref());
            let advice = advice.map(|advice| json!({ "map": advice.flags, "needs_file": advice.needs_file }));
            json!({ "error": format!("{error:#}"), "advice": advice })
        }
    };
    answer.to_string().into_bytes()
}

fn serve(held: &mut Held, text: &[u8]) -> Result<Value> {
    let desk = &mut held.desk;
    match serde_json::from_slice(text).context("the request")? {
        Request::Look { log, dbc } => Desk::look(&log, dbc.as_deref()),
        Request::Read(reading) => desk.read(reading),
        Request::Compare { model } => desk.compare(model.as_deref()),
        Request::Diagnose { model } => desk.diagnose(model.as_deref()),
        Request::Ladder { model } => desk.ladder(model.as_deref()),
        Request::Change { model, edits } => desk.change(model.as_deref(), &edits),
        Request::Report { form } => desk.report(&form),
        Request::Export { model, name, to } => desk.export(&model, &name, &to),
        Request::Effects => Ok(Desk::effects()),
        Request::Simulate { log, hide, seconds, rate, seed } => Desk::simulate(&log, &hide, seconds, rate, seed),
        Request::Vehicle { hide, seed } => {
            let (vehicle, told) = Vehicle::new(hide.as_deref(), seed)?;
            held.vehicle = Some(vehicle);
            Ok(told)
        }
        Request::Drive { seconds } => Ok(held.vehicle()?.drive(seconds)),
        Request::UseModel { model } => held.vehicle()?.take_model(&model),
        Request::Learner { axis, hidden } => {
            held.learner = Some(Learner::new(&axis, &hidden)?);
            Ok(Value::Null)
        }
        Request::Learn { search } => held.learner()?.learn(search),
        Request::Add { effect } => held.learner()?.add(&effect),
        Request::Remove { effect } => held.learner()?.remove(&effect),
    }
}
