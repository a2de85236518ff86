//! Noise for programs that estimate with it: Kalibr's `imu.yaml`, and parameters of ROS 2.
//!
//! Kalibr's model `scale-misalignment` (`IccSensors.py`): reading = M (C ω) + A a + bias, M lower triangular, C = `C_gyro_i` a rotation from
//! the axes of the IMU to those of the gyro, ω the rate in the axes of the IMU.
//!
//! N, the angle random walk in rad/√s, is the noise density in (rad/s)/√Hz: one reading of a gyro at f Hz has variance N² f.

use super::{
    Exported, Options, comments,
    linear::{Linear, triangular},
};
use crate::{
    model_file::ModelFile,
    words::{Task, call},
};
use gyro_model::{Axis, Noise};
use nalgebra::Matrix3;
use std::fmt::Write;

/// Of the white noise, rad/s/√s per rad/√s: a walk below it shows in no log.
const UNSEEN: f64 = 1e-6;

/// `imu.yaml`. Kalibr takes one gyro noise for all axes: the largest.
pub fn kalibr(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    let mut text = comments(
        "#",
        [
            format!("{heading}."),
            "Kalibr wants every line below; one that begins with # has to be filled in.".to_owned(),
        ],
    );
    let mut warnings = Vec::new();
    text += &densities(file, options, "", &mut warnings);
    let linear = Linear::of(file);
    warnings.extend(kalibrated(&linear));
    text += &matrices(&linear);
    Exported { text, warnings }
}

/// The lines of noise that Kalibr and those who read its files want, each behind the indent.
pub(super) fn densities(file: &ModelFile, options: &Options, indent: &str, warnings: &mut Vec<String>) -> String {
    warnings.push(
        "a gyro's model says nothing of the accelerometer: fill in accelerometer_noise_density and accelerometer_random_walk".to_owned(),
    );
    let mut text = String::new();
    let _ =
        writeln!(text, "{indent}#accelerometer_noise_density: # m/s^2/sqrt(Hz), from an Allan plot or the data sheet");
    let _ = writeln!(text, "{indent}#accelerometer_random_walk:   # m/s^3/sqrt(Hz)");
    let mut line = |key: &str, value: Option<f64>, unit: &str, missing: &str| {
        if let Some(value) = value.filter(|v| *v > 0.0) {
            let _ = writeln!(text, "{indent}{key}: {} # {unit}", number(value));
        } else {
            warnings.push(missing.to_owned());
            let _ = writeln!(text, "{indent}#{key}: # {unit}; {missing}");
        }
    };
    line(
        "gyroscope_noise_density",
        largest(file, |n| n.angle_random_walk),
        "rad/s/sqrt(Hz)",
        &format!("the model has no gyro noise: fit it on a log with {}", call(Task::Fit, "")),
    );
    line(
        "gyroscope_random_walk",
        walk(file),
        "rad/s^2/sqrt(Hz)",
        "the model's log showed no wandering of the bias: take gyroscope_random_walk from an Allan plot of an hour at rest",
    );
    line(
        "update_rate",
        options.rate,
        "Hz",
        "the rate of the gyro's messages is not in a model: give it with --rate HZ",
    );
    let _ = writeln!(text, "{indent}rostopic: {}", quoted(&options.topic));
    text
}

/// The random walk of the bias, the largest of all axes; `None` where the fit saw none, of which it leaves next to nothing, not zero.
pub(super) fn walk(file: &ModelFile) -> Option<f64> {
    let white = largest(file, |noise| noise.angle_random_walk);
    largest(file, |noise| noise.bias_random_walk).filter(|walk| *walk > UNSEEN * white.unwrap_or(0.0))
}

/// M and C of Kalibr's model `scale-misalignment`, as it writes them itself.
fn matrices(linear: &Linear) -> String {
    let (triangle, turned) = triangular(&linear.matrix);
    let mut text = comments(
        "#",
        [
            "Of Kalibr's model scale-misalignment: reading = M * (C_gyro_i * rate) + A * acceleration + bias.".to_owned(),
            "rate: in the axes of the IMU, rad/s. C_gyro_i: from the axes of the IMU to those of the gyro. M: lower triangular.".to_owned(),
            "Rows are the gyro's x, y, z; columns those that they come from. So rate = transpose(C_gyro_i) * inverse(M) * (reading - bias)."
                .to_owned(),
            "A and the accelerometer's M say that nothing is known of them.".to_owned(),
        ],
    );
    text.push_str("model: scale-misalignment\ngyroscopes:\n");
    for (name, matrix) in [("M", triangle), ("A", Matrix3::zeros()), ("C_gyro_i", turned)] {
        text += &rows(name, &matrix);
    }
    text.push_str("accelerometers:\n");
    text + &rows("M", &Matrix3::identity())
}

/// A matrix as YAML.
fn rows(name: &str, matrix: &Matrix3<f64>) -> String {
    // What rounding leaves of a zero is one.
    let value = |value: f64| number(if value.abs() < 1e-12 { 0.0 } else { value });
    let row = |row: usize| (0..3).map(|column| value(matrix[(row, column)])).collect::<Vec<_>>().join(", ");
    format!("  {name}:\n  - [{}]\n  - [{}]\n  - [{}]\n", row(0), row(1), row(2))
}

/// Kalibr holds noise, scale and coupling; what else the model knows has to be taken out of the messages before.
fn kalibrated(linear: &Linear) -> Option<String> {
    let letters: Vec<&str> = linear.axes.iter().map(|a| a.letter()).collect();
    let says = format!(
        "a calibration with imu.yaml's noise estimates the bias again, and its matrices hold scale and coupling alone: take the other effects of axis \
         {} out of the messages first (`--to c`, or {})",
        letters.join(", "),
        call(Task::Run, "--out")
    );
    (!linear.axes.is_empty()).then_some(says)
}

/// Parameters of ROS 2.
pub fn ros(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    let linear = Linear::of(file);
    let mut warnings = linear.warnings("a matrix and an offset");
    if linear.goes_by_temperature() {
        warnings.push(
            "an offset cannot depend on the temperature: it is that of the middle of the temperatures of the fit"
                .into(),
        );
    }
    let noises =
        Axis::ALL.map(|axis| file.model.axes[axis.index()].as_ref().map(|model| model.noise.angle_random_walk));
    if options.rate.is_none() {
        warnings.push(
            "the covariance depends on the rate of the gyro's messages, which is not in a model: give it with --rate HZ"
                .into(),
        );
    }
    let held = warnings.iter().map(|says| format!("NOT HELD: {says}."));
    let mut text = comments("#", [format!("{heading}.")].into_iter().chain(held));
    if let Some(rate) = options.rate {
        // A diagonal; -1 in its first place would say that there is no value, so an axis without one counts as very noisy.
        let variance = |i: usize| noises[i].map_or(1e6, |n| n * n * rate);
        let diagonal = |k: usize| if k.is_multiple_of(4) { number(variance(k / 4)) } else { "0.0".into() };
        let values: Vec<String> = (0..9).map(diagonal).collect();
        text.push_str("# Of ros2_control's imu_sensor_broadcaster; the first line is the name that the controller has with you. (rad/s)^2\n");
        text.push_str("imu_sensor_broadcaster:\n  ros__parameters:\n");
        let _ = writeln!(text, "    static_covariance_angular_velocity: [{}]", values.join(", "));
    }
    let range = file.provenance.as_ref().and_then(|p| p.temperature);
    let temperature = range.map_or(25.0, |(low, high)| 0.5 * (low + high));
    let matrix: Vec<String> = (0..9).map(|k| number(linear.matrix[(k / 3, k % 3)])).collect();
    let offset: Vec<String> = (0..3).map(|i| number(linear.at_rest(i, temperature))).collect();
    text.push_str("# For the node that makes the messages: rate = matrix (reading - offset), row by row; rad/s\n");
    text.push_str("/**:\n  ros__parameters:\n    gyro_calibration:\n");
    let _ = writeln!(text, "      matrix: [{}]\n      offset: [{}]", matrix.join(", "), offset.join(", "));
    Exported { text, warnings }
}

pub(super) fn largest(file: &ModelFile, of: impl Fn(&Noise) -> f64) -> Option<f64> {
    file.model.axes.iter().flatten().map(|model| of(&model.noise)).max_by(f64::total_cmp)
}

/// A float to every YAML parser: with a point, and with the sign of its exponent.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:.6e}");
    match text.split_once('e') {
        Some((digits, exponent)) if !exponent.starts_with('-') => format!("{digits}e+{exponent}"),
        _ => text,
    }
}

fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "''"))
}
