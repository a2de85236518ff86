//! The simulator against its own laws.

use super::*;
use crate::{
    Axis, Row,
    effects::{CATALOGUE, Memory, Signals, Stage},
};

/// A rig without any noise or quantisation.
fn silent() -> SensorSpec {
    SensorSpec {
        noise_density: 0.0,
        bias_random_walk: 0.0,
        quantum: 0.0,
        other_noise: 0.0,
        tilt: 0.0,
        accel_noise: 0.0,
        shaking: 0.0,
        reference: Reference::Encoder(0),
        temperature: Temperature { noise: 0.0, ..SensorSpec::default().temperature },
        supply: Supply { noise: 0.0, ..SensorSpec::default().supply },
        ..SensorSpec::default()
    }
}

fn scenario(sensor: SensorSpec) -> Scenario {
    Scenario { motion: "multisine".parse().unwrap(), seconds: 40.0, sensor, ..Scenario::default() }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    f64::sqrt(sum / n)
}

/// Compensated rate less true rate, by the two parameters of the truth alone.
fn residual(simulated: &Simulated, axis: Axis) -> Vec<f64> {
    let truth = simulated.truth.axes[axis.index()].as_ref().unwrap();
    let rows = simulated.record.rows.iter().zip(&simulated.true_rate);
    rows.map(|(row, rate)| truth.alpha() * row.gyro[axis.index()] + truth.delta() - rate[axis.index()]).collect()
}

#[test]
fn a_silent_sensor_reads_the_true_rate_through_equation_1_and_its_encoder_the_true_angle() {
    for horizontal in [true, false] {
        let simulated = simulate(&scenario(SensorSpec { horizontal, ..silent() }));
        assert!(residual(&simulated, Axis::X).iter().all(|e| e.abs() < 1e-12));
        for (row, angle) in simulated.record.rows.iter().zip(&simulated.true_angle) {
            assert!((row.ref_angle[0] - angle[0]).abs() < 1e-12);
        }
    }
}

#[test]
fn the_integral_of_the_true_rate_is_the_true_angle() {
    let simulated = simulate(&Scenario { rate_hz: 1000.0, ..scenario(silent()) });
    let (rate, angle) = (&simulated.true_rate, &simulated.true_angle);
    for i in 0..3 {
        let mut sum = angle[0][i];
        for (r, a) in rate.windows(3).zip(&angle[2..]).step_by(2) {
            sum += (r[0][i] + 4.0 * r[1][i] + r[2][i]) / 3000.0;
            assert!((sum - a[i]).abs() < 1e-7, "axis {i}: {sum} {}", a[i]);
        }
    }
}

#[test]
fn white_noise_has_its_density_at_any_rate() {
    for rate_hz in [50.0, 400.0] {
        let sensor = SensorSpec { noise_density: 1e-4, alpha: 1.0, ..silent() };
        let simulated = simulate(&Scenario { rate_hz, seconds: 100.0, ..scenario(sensor) });
        let density = rms(residual(&simulated, Axis::X).into_iter()) / (0.5 * rate_hz).sqrt();
        assert!((density / 1e-4 - 1.0).abs() < 0.05, "{density}");
        let walk = simulated.truth.axes[0].as_ref().unwrap().noise.angle_random_walk;
        assert!((walk * 2_f64.sqrt() / 1e-4 - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_bias_walks_as_far_as_its_density_says() {
    let ends = (0..60).map(|seed| {
        let sensor = SensorSpec { bias_random_walk: 1e-3, alpha: 1.0, ..silent() };
        let simulated = simulate(&Scenario { rate_hz: 20.0, seconds: 25.0, seed, ..scenario(sensor) });
        *residual(&simulated, Axis::X).last().unwrap()
    });
    let walked = rms(ends) / (1e-3 * 25_f64.sqrt());
    assert!((0.7..1.4).contains(&walked), "{walked}");
}

#[test]
fn noise_grows_with_rate_where_it_is_told_to() {
    let simulated = simulate(&scenario(SensorSpec { rate_noise: 0.01, ..silent() }));
    let residuals = residual(&simulated, Axis::X);
    let of = |fast: bool| {
        let pairs = residuals.iter().zip(&simulated.true_rate);
        rms(pairs.filter(move |(_, r)| (r[0].abs() > 1.0) == fast).map(|(e, _)| *e))
    };
    assert!(of(true) > 2.5 * of(false));
}

#[test]
fn readings_and_counts_are_whole_steps_spread_evenly_over_the_step() {
    let sensor = SensorSpec { quantum: 0.01, reference: Reference::Encoder(1000), alpha: 1.0, ..silent() };
    let simulated = simulate(&scenario(sensor.clone()));
    for row in &simulated.record.rows {
        for (value, step) in [(row.gyro[0], 0.01), (row.ref_angle[0], sensor.count())] {
            assert!(((value / step).round() * step - value).abs() < 1e-9);
        }
    }
    let error = rms(residual(&simulated, Axis::X).into_iter());
    assert!((error * 12_f64.sqrt() / 0.01 - 1.0).abs() < 0.1, "{error}");
    let angles = simulated.record.rows.iter().zip(&simulated.true_angle);
    let error = rms(angles.map(|(row, angle)| row.ref_angle[0] - angle[0]));
    assert!((error / sensor.reference_std() - 1.0).abs() < 0.1, "{error}");
}

#[test]
fn gravity_turns_with_a_horizontal_shaft_and_the_arm_adds_its_two_accelerations() {
    let sensor = SensorSpec { lever_arm: [0.0, 0.0, 0.05], ..silent() };
    let simulated = simulate(&Scenario { rate_hz: 500.0, ..scenario(sensor) });
    let (rows, rate, angle) = (&simulated.record.rows, &simulated.true_rate, &simulated.true_angle);
    for k in 1..rows.len() - 1 {
        let (omega, theta) = (rate[k][0], angle[k][0]);
        let omega_dot = (rate[k + 1][0] - rate[k - 1][0]) * 250.0;
        let expected = [0.0, GRAVITY * theta.sin() - 0.05 * omega_dot, GRAVITY * theta.cos() - 0.05 * omega * omega];
        for (got, expected) in rows[k].accel.iter().zip(expected) {
            assert!((got - expected).abs() < 2e-3, "row {k}: {got} for {expected}");
        }
    }
}

#[test]
fn an_orientation_reference_turns_with_the_three_true_rates() {
    let sensor = SensorSpec { reference: Reference::Quaternion, ..silent() };
    let simulated = simulate(&Scenario { rate_hz: 500.0, ..scenario(sensor) });
    let attitude = |row: &Row| {
        let [w, x, y, z] = row.ref_quaternion;
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
    };
    for (k, pair) in simulated.record.rows.windows(2).enumerate() {
        let turned = (attitude(&pair[0]).inverse() * attitude(&pair[1])).scaled_axis() * 500.0;
        for i in 0..3 {
            let rate = 0.5 * (simulated.true_rate[k][i] + simulated.true_rate[k + 1][i]);
            assert!((turned[i] - rate).abs() < 5e-3, "row {k} axis {i}: {} for {rate}", turned[i]);
        }
    }
    assert!(simulated.truth.axes.iter().all(Option::is_some));
}

#[test]
fn a_slower_reference_has_a_value_at_every_nth_row_and_a_rate_reference_gives_the_rate() {
    let simulated = simulate(&scenario(SensorSpec { reference_every: 4, ..silent() }));
    for (k, row) in simulated.record.rows.iter().enumerate() {
        assert_eq!(row.ref_angle[0].is_finite(), k % 4 == 0);
    }
    let simulated = simulate(&scenario(SensorSpec { reference: Reference::Rate, ..silent() }));
    for (row, rate) in simulated.record.rows.iter().zip(&simulated.true_rate) {
        assert_eq!(row.ref_rate[0], rate[0]);
    }
}

#[test]
fn a_felt_effect_changes_the_reading_by_exactly_its_error() {
    for effect in CATALOGUE.iter().filter(|e| e.stage() == Stage::Felt) {
        let hidden = Hidden::typical(*effect, Axis::X);
        let clean = simulate(&scenario(silent()));
        let spoilt = simulate(&Scenario { hidden: vec![hidden.clone()], ..scenario(silent()) });
        let mut memory = Memory::default();
        let rows = (0..clean.record.len()).map(|k| {
            let (row, rates) = (&clean.record.rows[k], clean.true_rate[k]);
            let signals = Signals {
                t: row.t_ns as f64 * 1e-9,
                dt: if k == 0 { 0.0 } else { 0.01 },
                axis: 0,
                rates,
                angle: clean.true_angle[k][0],
                accel: row.accel,
                delta_temperature: SensorSpec::default().temperature.at(row.t_ns as f64 * 1e-9) - 25.0,
                delta_supply: row.supply - 3.3,
                ..Signals::default()
            };
            let expected = effect.error(&hidden.values, &signals, &mut memory);
            (expected, (spoilt.record.rows[k].gyro[0] - row.gyro[0]) * SensorSpec::default().alpha)
        });
        let (expected, got): (Vec<f64>, Vec<f64>) = rows.unzip();
        let differences = expected.iter().zip(&got).map(|(e, g)| e - g);
        if ["temperature-rate", "rate-hysteresis"].contains(&effect.card().id) {
            // What remembers sees ten steps a row in the simulator and one here.
            let share = rms(differences) / rms(expected.iter().copied());
            assert!(share < 0.1, "{}: {share}", effect.card().id);
        } else {
            let worst = differences.fold(0.0_f64, |worst, d| worst.max(d.abs()));
            assert!(worst < 1e-12, "{}: {worst}", effect.card().id);
        }
    }
}

#[test]
fn a_reference_effect_changes_the_encoder_and_leaves_the_gyro_alone() {
    for effect in CATALOGUE.iter().filter(|e| e.stage() == Stage::Reference) {
        let hidden = Hidden::typical(*effect, Axis::X);
        let clean = simulate(&scenario(silent()));
        let spoilt = simulate(&Scenario { hidden: vec![hidden.clone()], ..scenario(silent()) });
        let mut memory = Memory::default();
        for (k, (a, b)) in clean.record.rows.iter().zip(&spoilt.record.rows).enumerate() {
            assert_eq!(a.gyro, b.gyro);
            let (t, rates) = (a.t_ns as f64 * 1e-9, clean.true_rate[k]);
            let signals = Signals { t, rates, angle: clean.true_angle[k][0], ..Signals::default() };
            let expected = effect.error(&hidden.values, &signals, &mut memory);
            // Play turns where the shaft does, between two rows, and counts are lost from an instant between them on.
            let is_between = ["encoder-backlash", "lost-counts"].contains(&effect.card().id);
            let tolerance = if is_between { 5e-4 } else { 1e-12 };
            assert!((b.ref_angle[0] - a.ref_angle[0] - expected).abs() < tolerance, "{} row {k}", effect.card().id);
        }
    }
}

#[test]
fn timing_effects_read_the_rate_of_another_time() {
    for (text, valid) in [
        ("delay:d=0.02", (|t| t - 0.02) as fn(f64) -> f64),
        ("clock-skew:s=0.002", |t| t * 1.002),
        ("clock-skew:s=-0.002", |t| t * 0.998),
        ("clock-step:j=0.03,t0=20", |t| if t > 20.0 { t - 0.03 } else { t }),
    ] {
        for motion in ["multisine", "drive", "rate-table"] {
            let motion: Motion = motion.parse().unwrap();
            let hidden = vec![Hidden::parse(text, Axis::X).unwrap()];
            let simulated = simulate(&Scenario { motion, hidden, ..scenario(silent()) });
            let (mut shaft, spec) = (Shaft::new(motion, 1), SensorSpec::default());
            for row in &simulated.record.rows {
                let rate = shaft.at(valid(row.t_ns as f64 * 1e-9)).rate;
                assert!((spec.alpha * row.gyro[0] + spec.delta - rate).abs() < 1e-9, "{text} {motion:?}");
            }
        }
    }
}

#[test]
fn limits_act_on_the_reading_after_its_noise_and_before_its_quantisation() {
    let sensor = SensorSpec { quantum: 0.001, noise_density: 1e-3, ..silent() };
    let hidden = ["saturation:l=1.5", "dead-zone:w=0.1"].map(|text| Hidden::parse(text, Axis::X).unwrap());
    let simulated = simulate(&Scenario { hidden: hidden.to_vec(), ..scenario(sensor) });
    let readings = simulated.record.rows.iter().map(|row| row.gyro[0].abs());
    let (mut zeros, mut rails) = (0, 0);
    for reading in readings {
        assert!(reading == 0.0 || (0.0995..=1.5005).contains(&reading), "{reading}");
        zeros += usize::from(reading == 0.0);
        rails += usize::from(reading > 1.4995);
    }
    assert!(zeros > 50 && rails > 50, "{zeros} {rails}");
}

#[test]
fn a_lag_loses_amplitude_and_comes_late_as_its_time_constant_says() {
    let motion = Motion::Sine { amplitude: 1.0, frequency: 2.0 };
    let hidden = vec![Hidden::parse("lag:tau=0.03", Axis::X).unwrap()];
    let simulated = simulate(&Scenario { motion, hidden, ..scenario(silent()) });
    let w = std::f64::consts::TAU * 2.0;
    let (gain, late) = (1.0 / (1.0 + (w * 0.03_f64).powi(2)).sqrt(), (w * 0.03_f64).atan());
    for (row, error) in simulated.record.rows.iter().zip(residual(&simulated, Axis::X)).skip(100) {
        let t = row.t_ns as f64 * 1e-9;
        let expected = w * (gain * (w * t - late).cos() - (w * t).cos());
        assert!((error - expected).abs() < 1e-3, "{error} for {expected}");
    }
}

#[test]
fn the_same_seed_gives_the_same_log_and_streaming_gives_it_too() {
    let scenario = scenario(SensorSpec::default());
    let [a, b] = [simulate(&scenario), simulate(&scenario)];
    let streamed = Simulator::new(&scenario).take(a.record.len());
    for ((a, b), c) in a.record.rows.iter().zip(&b.record.rows).zip(streamed) {
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
        assert_eq!(format!("{a:?}"), format!("{:?}", c.row));
    }
    let other = simulate(&Scenario { seed: 2, ..scenario });
    assert!(a.record.rows.iter().zip(&other.record.rows).any(|(a, b)| a.gyro != b.gyro));
}

#[test]
fn hiding_an_effect_leaves_every_other_random_number_as_it_was() {
    let clean = simulate(&scenario(SensorSpec::default()));
    let hidden = vec![Hidden::parse("bias-step:j=0.5,t0=20", Axis::X).unwrap()];
    let spoilt = simulate(&Scenario { hidden, ..scenario(SensorSpec::default()) });
    for (a, b) in clean.record.rows.iter().zip(&spoilt.record.rows) {
        assert_eq!(a.gyro[1..], b.gyro[1..]);
        assert_eq!(
            (a.ref_angle[0], a.accel, a.temperature, a.supply),
            (b.ref_angle[0], b.accel, b.temperature, b.supply)
        );
        assert!(a.t_ns > 20_000_000_000 || a.gyro[0] == b.gyro[0]);
    }
}

#[test]
fn an_effect_can_be_switched_on_and_off_while_rows_are_drawn() {
    let mut simulator = Simulator::new(&scenario(silent()));
    let error = |sample: Sample, spec: &SensorSpec| spec.alpha * sample.row.gyro[0] + spec.delta - sample.true_rate[0];
    let spec = silent();
    assert!(simulator.by_ref().take(100).all(|s| error(s, &spec).abs() < 1e-12));
    simulator.hide(Hidden::parse("scale-asymmetry:a=0.1", Axis::X).unwrap());
    assert_eq!(simulator.truth().axes[0].as_ref().unwrap().effect_ids().last(), Some(&"scale-asymmetry"));
    assert!(simulator.by_ref().take(100).any(|s| error(s, &spec) > 0.01));
    simulator.reveal("scale-asymmetry");
    assert!(simulator.by_ref().take(100).all(|s| error(s, &spec).abs() < 1e-12));
}

#[test]
fn the_arm_lies_across_the_shaft_whichever_axis_that_is() {
    assert_eq!(SensorSpec::on(Axis::X), SensorSpec::default());
    for axis in Axis::ALL {
        let sensor = SensorSpec::on(axis);
        assert_eq!((sensor.axis, sensor.lever_arm[axis.index()]), (axis, 0.0));
        assert!((sensor.lever_arm.iter().map(|r| r * r).sum::<f64>().sqrt() - 0.06).abs() < 1e-15);
    }
}

#[test]
fn every_random_sensor_is_another_one() {
    let sensors: Vec<_> = (0..20).map(SensorSpec::random).collect();
    for (k, sensor) in sensors.iter().enumerate() {
        assert_eq!(*sensor, SensorSpec::random(k as u64));
        assert!(sensors[..k].iter().all(|other| other != sensor));
    }
    assert!(sensors.iter().any(|s| s.horizontal) && sensors.iter().any(|s| !s.horizontal));
}
