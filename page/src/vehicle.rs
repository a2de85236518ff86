//! A vehicle that drives in the page: the simulator, the Kalman filter on its stream, and both beside what only a simulation knows.

use crate::rows;
use anyhow::{Context, Result, anyhow};
use gyro_model::{
    Row,
    estimator::{Estimator, Options},
    simulate::{Hidden, Simulator},
};
use serde_json::{Value, json};
use std::{collections::VecDeque, path::Path};
use workbench::{files, model_file, motion::Motion, vehicle};

/// What the rows of the stream are passed on as.
pub const ROWS: &str = "rows";
/// Steps of [`Motion`] in a second.
const SECOND: usize = 20;
/// Seconds that the true error is the root mean square of.
const TRUE_OVER: usize = 5;

/// See the module's head.
pub struct Vehicle {
    simulator: Simulator,
    rate_hz: f64,
    /// Rows that are due but for a part of one.
    due: f64,
    estimator: Estimator,
    measured: Motion,
    truth: Motion,
    /// Difference of model and true rate in the steps of the present second, °/s.
    second: Vec<f64>,
    /// Its mean over each of the last seconds.
    means: VecDeque<f64>,
}

impl Vehicle {
    /// The vehicle of this seed, with `hide` in its gyro, or with what the seed hides. An effect without a size gets one that nobody
    /// overlooks.
    pub fn new(hide: Option<&str>, seed: u64) -> Result<(Self, Value)> {
        let mut scenario = vehicle::scenario(seed)?;
        let axis = scenario.sensor.axis;
        let hide = hide.unwrap_or_else(|| vehicle::hidden(seed));
        let is_sized = vehicle::HIDDEN.iter().all(|usual| *usual != hide) && hide.contains(':');
        let hidden = if is_sized { hide.to_owned() } else { vehicle::sized(hide, &scenario)? };
        scenario.hidden = vec![Hidden::parse(&hidden, axis).map_err(|error| anyhow!("{error}"))?];
        let told = json!({ "axis": axis.letter(), "hidden": hidden, "rate_hz": scenario.rate_hz });
        let this = Self {
            simulator: Simulator::new(&scenario),
            rate_hz: scenario.rate_hz,
            due: 0.0,
            estimator: Estimator::new(Options::default()),
            measured: Motion::default(),
            truth: Motion::default(),
            second: Vec::new(),
            means: VecDeque::new(),
        };
        Ok((this, told))
    }

    /// Drives so many seconds: steps of measured and computed rate, and the true error. The rows are then there to be taken.
    pub fn drive(&mut self, seconds: f64) -> Value {
        self.due += seconds * self.rate_hz;
        let count = self.due.floor();
        self.due -= count;
        let (mut bytes, mut steps, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        let mut last = None;
        let axis = self.simulator.sensor().axis.index();
        for _ in 0..count as u64 {
            let sample = self.simulator.step();
            rows::write(&sample.row, &mut bytes);
            let estimate = self.estimator.step(&sample.row);
            self.measured.row(&sample.row);
            self.measured.estimate(&estimate);
            let mut truth = Row { t_ns: sample.row.t_ns, ..Row::EMPTY };
            truth.ref_angle[axis] = sample.true_angle[axis];
            self.truth.row(&truth);
            self.truth.estimate(&estimate);
            steps.extend(self.measured.steps());
            for step in self.truth.steps() {
                let own = &step.axes[axis];
                self.second.extend(own.model.zip(own.measured).map(|(model, truth)| model - truth));
                if self.second.len() == SECOND {
                    errors.extend(self.true_error().map(|error| json!({ "t": step.t, "error": error })));
                }
            }
            last = Some((sample.row.t_ns, estimate.axes[axis]));
        }
        files::put(Path::new(ROWS), bytes);
        let shown = |value: f64| Some(value).filter(|value| value.is_finite()).map(f64::to_degrees);
        json!({
            "t": last.map(|(t_ns, _)| t_ns as f64 * 1e-9),
            "steps": steps,
            "true": errors,
            "filter": last.map(|(_, own)| json!({ "rate": shown(own.rate_filtered), "std": shown(own.rate_std) })),
        })
    }

    /// Root mean square of the rate's error over 1 s, of the last seconds; °/s.
    fn true_error(&mut self) -> Option<f64> {
        let mean = self.second.iter().sum::<f64>() / SECOND as f64;
        self.second.clear();
        self.means.push_back(mean);
        if self.means.len() > TRUE_OVER {
            self.means.pop_front();
        }
        (self.means.len() == TRUE_OVER)
            .then(|| (self.means.iter().map(|mean| mean * mean).sum::<f64>() / TRUE_OVER as f64).sqrt())
    }

    /// Compensates with another model from now on.
    pub fn take_model(&mut self, text: &str) -> Result<Value> {
        let file = model_file::parse(Path::new("model.toml"), text, &[]).context("the model that was learned")?;
        self.estimator.set_model(&file.model);
        Ok(json!(file.model.epoch))
    }
}
