//! Calibrations of programs that drive or navigate with a gyro's messages.
//!
//! - Autoware (`imu_corrector`): rate = reading − `angular_velocity_offset`, axis by axis, in the sensor's axes; `angular_velocity_stddev` goes
//!   into the covariance of its messages.
//! - OpenVINS (`kalibr_imu_chain.yaml`, model `kalibr`): rate = `R_IMUtoGYRO`ᵀ `Tw`⁻¹ (reading − bias), `Tw` lower triangular; the bias is
//!   estimated on the way.

use super::{
    Exported, Options,
    autopilot::{cannot, head},
    comments,
    linear::Linear,
    noise::{densities, number},
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
            "an offset cannot go by the temperature: it is that of the middle of the temperatures of the fit".into(),
        );
    }
    if options.rate.is_none() {
        warnings.push(
            "the standard deviation goes by the rate of the gyro's messages, which is not in a model: give it with --rate HZ".into(),
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

/// T, lower triangular with a positive diagonal, and the rotation R for which S = Rᵀ T⁻¹.
pub(super) fn triangular(matrix: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    // S J = Q U, J the columns in reverse, gives S = (Q J) (J U J), whose second factor is lower triangular.
    let reverse = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    let (turn, upper) = (matrix * reverse).qr().unpack();
    let (turn, lower) = (turn * reverse, reverse * upper * reverse);
    let signs = Matrix3::from_diagonal(&lower.diagonal().map(f64::signum));
    let (turn, lower) = (turn * signs, signs * lower);
    let triangle = lower.try_inverse().unwrap_or_else(Matrix3::identity);
    (triangle.lower_triangle(), turn.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_factors_are_a_triangle_and_a_rotation_and_make_the_matrix() {
        let matrix = Matrix3::new(0.99, -0.012, 0.004, 0.006, 1.008, -0.009, -0.015, 0.003, 0.996);
        let (triangle, turned) = triangular(&matrix);
        let again = turned.transpose() * triangle.try_inverse().unwrap();
        assert!((again - matrix).norm() < 1e-12, "{again}");
        assert!(triangle.upper_triangle() == Matrix3::from_diagonal(&triangle.diagonal()), "{triangle}");
        assert!((turned * turned.transpose() - Matrix3::identity()).norm() < 1e-12 && turned.determinant() > 0.0);
        assert!(triangle.diagonal().iter().all(|d| *d > 0.0));
        // What is triangular already is not turned.
        let (_, turned) = triangular(&Matrix3::new(0.99, 0.0, 0.0, 0.01, 1.0, 0.0, -0.02, 0.03, 1.01));
        assert!((turned - Matrix3::identity()).norm() < 1e-12, "{turned}");
    }
}
