//! Calibrations of programs that drive or navigate with a gyro's messages.
//!
//! - Autoware (`imu_corrector`): rate = reading − `angular_velocity_offset`, axis by axis, in the sensor's axes; `angular_velocity_stddev` goes
//!   into the covariance of its messages.
//! - OpenVINS (`kalibr_imu_chain.yaml`, model `kalibr`): rate = `R_IMUtoGYRO`ᵀ `Tw`⁻¹ (reading − bias), `Tw` lower triangular; the bias is
//!   estimated on the way.
//! - VINS-Mono, VINS-Fusion: `gyr_n` and `gyr_w` are standard deviations of one reading (`integration_base.h` multiplies both by the step):
//!   gyr_n = N √f, gyr_w = K √f, N the angle random walk, K the random walk of the bias, f the rate of the messages.

use super::{
    Exported, Options,
    autopilot::{cannot, head},
    comments,
    linear::{Linear, triangular},
    noise::{densities, largest, number, walk},
};
use crate::model_file::ModelFile;
use nalgebra::Matrix3;
use std::fmt::Write;

/// `imu_corrector.param.yaml`.
pub fn autoware(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    let linear = Linear::of(file);
    let mut warnings = cannot(&linear, "Autoware's imu_corrector");
    if linear.goes_by_temperature() {
        warnings.push(
            "an offset cannot depend on the temperature: it is that of the middle of the temperatures of the fit"
                .into(),
        );
    }
    if options.rate.is_none() {
        warnings.push(
            "the standard deviation depends on the rate of the gyro's messages, which is not in a model: give it with --rate HZ".into(),
        );
    }
    let note = "imu_corrector subtracts the offset from each axis, in the axes of the sensor, before it turns them to base_link; rad/s.";
    let mut text = head("#", heading, &warnings, &[note]);
    text.push_str("/**:\n  ros__parameters:\n");
    let range = file.provenance.as_ref().and_then(|p| p.temperature);
    let temperature = range.map_or(25.0, |(low, high)| 0.5 * (low + high));
    for &axis in &linear.axes {
        let _ =
            writeln!(text, "    angular_velocity_offset_{axis}: {}", number(linear.at_rest(axis.index(), temperature)));
    }
    for &axis in &linear.axes {
        let noise = file.model.axes[axis.index()].as_ref().map(|model| model.noise.angle_random_walk);
        if let (Some(rate), Some(noise)) = (options.rate, noise.filter(|noise| *noise > 0.0)) {
            let _ = writeln!(text, "    angular_velocity_stddev_{axis}{axis}: {}", number(noise * rate.sqrt()));
        }
    }
    Exported { text, warnings }
}

/// `kalibr_imu_chain.yaml`.
pub fn openvins(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    let linear = Linear::of(file);
    let mut warnings = linear.warnings("a matrix");
    let noises = densities(file, options, "  ", &mut warnings);
    let held = warnings.iter().map(|says| format!("NOT HELD: {says}."));
    let notes = [
        format!("{heading}."),
        "OpenVINS wants every line of noise; one that begins with # has to be filled in.".to_owned(),
        "rate = transpose(R_IMUtoGYRO) inverse(Tw) (reading - bias); OpenVINS estimates the bias itself.".to_owned(),
    ];
    let mut text = "%YAML:1.0\n".to_owned() + &comments("#", notes.into_iter().chain(held));
    text.push_str("imu0:\n  T_i_b:\n    - [1.0, 0.0, 0.0, 0.0]\n    - [0.0, 1.0, 0.0, 0.0]\n    - [0.0, 0.0, 1.0, 0.0]\n    - [0.0, 0.0, 0.0, 1.0]\n");
    text += &noises;
    text.push_str("  time_offset: 0.0\n  model: \"kalibr\"\n");
    let (triangle, turned) = triangular(&linear.matrix);
    let zero = Matrix3::zeros();
    let one = Matrix3::identity();
    for (name, matrix) in
        [("Tw", &triangle), ("R_IMUtoGYRO", &turned), ("Ta", &one), ("R_IMUtoACC", &one), ("Tg", &zero)]
    {
        let _ = writeln!(text, "  {name}:");
        for row in 0..3 {
            let row: Vec<String> = (0..3).map(|column| number(matrix[(row, column)])).collect();
            let _ = writeln!(text, "    - [{}]", row.join(", "));
        }
    }
    Exported { text, warnings }
}

/// The lines of noise in the configuration of VINS-Mono and VINS-Fusion.
pub fn vins(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    let linear = Linear::of(file);
    let mut warnings = linear.warnings("VINS's configuration");
    warnings.push("a gyro's model says nothing of the accelerometer: fill in acc_n and acc_w".to_owned());
    if options.rate.is_none() {
        warnings.push(
            "gyr_n and gyr_w depend on the rate of the gyro's messages, which is not in a model: give it with --rate HZ".into(),
        );
    }
    if walk(file).is_none() {
        let missing =
            "the model's log showed no wandering of the bias: take gyr_w from an Allan plot of an hour at rest";
        warnings.push(missing.to_owned());
    }
    let note = "Discrete, as VINS wants them: standard deviations of one reading. It has no matrix, and estimates the bias itself.";
    let mut text = head("#", heading, &warnings, &[note]);
    text.push_str("#acc_n:   # m/s^2\n#acc_w:   # m/s^2\n");
    let white = largest(file, |noise| noise.angle_random_walk);
    for (key, density) in [("gyr_n", white), ("gyr_w", walk(file))] {
        let _ = match options.rate.zip(density.filter(|density| *density > 0.0)) {
            Some((rate, density)) => writeln!(text, "{key}: {} # rad/s, at {rate} Hz", number(density * rate.sqrt())),
            None => writeln!(text, "#{key}:   # rad/s"),
        };
    }
    Exported { text, warnings }
}
