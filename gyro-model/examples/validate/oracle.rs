//! Who knows the effect, its direction, its shapes and the noise: how large must it be for three standard errors?
//!
//! The Cramér–Rao bound of the size s beside the unknown scale factor and bias: g = ∂r/∂ln s of the residual angle,
//! whitened with the true noise, less what ∂r/∂α and ∂r/∂δ explain of it, has the norm s/σ_s. The derivatives are
//! central differences on the log without its noise; the noise is the simulator's own: angle random walk (with the
//! quantisation of the gyro), bias random walk, and one error of the encoder for each while that it shows the same count.

use crate::probe::Probe;
use gyro_model::{
    Axis, Model,
    evidence::{
        problem::Problem,
        whiten::{NoiseModel, Rows, Whitener},
    },
    simulate::{Reference, Scenario, SensorSpec, Simulated, simulate},
};

/// Standard errors that an effect must stand out by.
const SIGMA: f64 = 3.0;

/// The size at which the oracle has three standard errors; `None` for limits of the reading, where nothing is linear.
pub fn size(probe: &Probe) -> Option<f64> {
    if probe.is_limit() {
        return None;
    }
    let axis = probe.scenario.sensor.axis;
    let noisy = simulate(&probe.hide(probe.drawn()));
    let rows = readings(&Problem::new(&noisy.record, &[axis], &noisy.truth)?);
    let mut size = probe.drawn();
    for _ in 0..6 {
        let factor = SIGMA / sigmas(probe, size, &rows)?;
        size *= factor.clamp(0.02, 50.0);
        if (0.97..1.03).contains(&factor) {
            break;
        }
    }
    Some(size)
}

/// s/σ_s at this size.
fn sigmas(probe: &Probe, size: f64, rows: &Rows) -> Option<f64> {
    const STEP: f64 = 0.05;
    let axis = probe.scenario.sensor.axis;
    let Simulated { record, truth, .. } = simulate(&quiet(&probe.hide(size)));
    let problem = Problem::new(&record, &[axis], &truth)?;
    let mut warm = problem.cold();
    for _ in 0..3 {
        warm = problem.warm(&problem.evaluate(&truth, &warm), &warm);
    }
    let whitener = Whitener::new(&noise(&probe.scenario), rows);
    let at = |change: &dyn Fn(&mut Model)| {
        let mut model = truth.clone();
        change(&mut model);
        problem.evaluate(&model, &warm).residual.swap_remove(0)
    };
    let slope = |change: &dyn Fn(&mut Model, f64), step: f64| {
        let [more, less] = [step, -step].map(|step| at(&|model| change(model, step)));
        let raw: Vec<f64> = more.iter().zip(&less).map(|(a, b)| (a - b) / (2.0 * step)).collect();
        whitener.apply(&raw)
    };
    let nuisance = [0, 1].map(|term| slope(&|model, step| value(model, axis, term)[0] += step, 1e-4));
    let resized = |model: &mut Model, step: f64| *value(model, axis, 2) = probe.at(size * (1.0 + step)).values;
    Some(distance(&slope(&resized, STEP), &nuisance))
}

/// Where the encoder of the noisy log says something of its own.
fn readings(problem: &Problem) -> Rows {
    let readings = &problem.series[0].readings;
    Rows {
        index: readings.iter().map(|reading| reading.row).collect(),
        t: readings.iter().map(|reading| problem.times()[reading.row]).collect(),
        spread: readings.iter().map(|reading| reading.spread).collect(),
        turned: vec![0.0; readings.len()],
        lost: vec![false; readings.len()],
        rows: problem.times().len(),
    }
}

fn value(model: &mut Model, axis: Axis, term: usize) -> &mut Vec<f64> {
    // The simulator's truth has scale factor, bias and the one hidden effect.
    &mut model.axes[axis.index()].get_or_insert_default().terms[term].values
}

/// |g| less its projection on the two nuisance columns (Gram and Schmidt).
fn distance(g: &[f64], nuisance: &[Vec<f64>; 2]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let less = |a: &[f64], b: &[f64]| -> Vec<f64> {
        let share = dot(a, b) / dot(b, b);
        a.iter().zip(b).map(|(x, y)| x - share * y).collect()
    };
    let second = less(&nuisance[1], &nuisance[0]);
    let rest = less(&less(g, &nuisance[0]), &second);
    dot(&rest, &rest).sqrt()
}

/// What the simulator adds to this log, in rates after compensation.
fn noise(scenario: &Scenario) -> NoiseModel {
    let sensor = &scenario.sensor;
    let white = sensor.noise_density / 2_f64.sqrt();
    let steps = sensor.quantum / (12.0 * scenario.rate_hz).sqrt();
    NoiseModel {
        angle_random_walk: sensor.alpha * white.hypot(steps),
        bias_random_walk: sensor.alpha * sensor.bias_random_walk,
        encoder: sensor.reference_std(),
        correlated: 0.0,
        correlation_time: 1.0,
        rate_random_walk: 0.0,
    }
}

/// The same log without noise and quantisation.
fn quiet(scenario: &Scenario) -> Scenario {
    let sensor = scenario.sensor.clone();
    let mut quiet = SensorSpec {
        noise_density: 0.0,
        bias_random_walk: 0.0,
        quantum: 0.0,
        other_noise: 0.0,
        accel_noise: 0.0,
        reference: Reference::Encoder(0),
        reference_noise: 0.0,
        ..sensor
    };
    quiet.temperature.noise = 0.0;
    quiet.supply.noise = 0.0;
    Scenario { sensor: quiet, ..scenario.clone() }
}
