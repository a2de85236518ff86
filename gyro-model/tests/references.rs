//! References that are not what a shaft encoder is: slow ones, some that are made of the gyro itself, orientations, and
//! limits that make an encoder's counts say more than they should.

use gyro_model::{
    Axis, Model, Record, Row,
    diagnose::{self, Options},
    diagnosis::Verdict,
    faults,
    fit::fit,
    simulate::{Hidden, Motion, Reference, Scenario, SensorSpec, simulate},
    words::Voice,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 100.0;

/// A log of one gyro, row by row: rate read and angle of the reference.
fn log(rows: usize, row: impl FnMut(f64) -> (f64, f64)) -> Record {
    log_at(RATE_HZ, rows, row)
}

/// The same with so many rows a second.
fn log_at(rate_hz: f64, rows: usize, mut row: impl FnMut(f64) -> (f64, f64)) -> Record {
    let rows = (0..rows).map(|k| {
        let t = k as f64 / rate_hz;
        let (rate, angle) = row(t);
        let mut row = Row { t_ns: (t * 1e9).round() as i64, ..Row::EMPTY };
        (row.gyro[2], row.ref_angle[2]) = (rate, angle);
        row
    });
    Record { rows: rows.collect(), ..Record::default() }
}

/// A fused heading: the gyro's own noise stands in it, what is fast reads 5 % large, and it wanders a little. Nothing at
/// the averaging times that the floor is made for says that α is not 1.
#[test]
fn a_reference_that_is_made_of_the_gyro_leads_no_fit_astray() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (mut angle, mut wander, mut before) = (0.0, 0.0, None);
    let record = log(9000, |t| {
        let line = |size: f64, f: f64, phase: f64| size * (TAU * f * t + phase).sin();
        let slow = line(0.3, 0.03, 0.0) + line(0.2, 0.071, 1.0);
        let fast = line(0.01, 0.9, 0.0) + line(0.01, 2.3, 2.0);
        let noise = 1e-3 * normal();
        wander += 1e-5 / RATE_HZ.sqrt() * normal();
        let fused = slow + 1.05 * fast + noise + wander;
        angle += before.replace(fused).map_or(0.0, |before: f64| 0.5 * (before + fused) / RATE_HZ);
        (slow + fast + noise, angle)
    });
    let model = fit(&record, &Model::base_for(&record), &[Axis::Z]).unwrap();
    let alpha = model.axes[2].as_ref().unwrap().alpha();
    assert!((alpha - 1.0).abs() < 1e-3, "α = {alpha}");
}

/// A reference of 2.5 Hz holds motion up to its own fastest differences; beside the gyro it shows its noise.
#[test]
fn a_reference_that_comes_seldom_does_not_count_its_motion_as_noise() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut row = 0;
    let record = log(12_000, |t| {
        let lines = [(0.6, 0.21), (0.5, 0.47), (0.4, 0.9)];
        let rate: f64 = lines.iter().map(|(size, f)| size * (TAU * f * t).sin()).sum();
        let angle: f64 = lines.iter().map(|(size, f)| -size / (TAU * f) * (TAU * f * t).cos()).sum();
        row += 1;
        (rate + 1e-3 * normal(), if row % 40 == 0 { angle + 1e-4 * normal() } else { f64::NAN })
    });
    let options = Options { own_log: true, ..Options::default() };
    let over = |alpha: f64| {
        let mut model = fit(&record, &Model::base_for(&record), &[Axis::Z]).unwrap();
        for term in &mut model.axes[2].as_mut().unwrap().terms {
            if term.effect.card().id == "scale-factor" {
                term.values[0] *= alpha;
            }
        }
        let options = Options { own_log: alpha == 1.0, ..options };
        diagnose::compare(&record, &model, &[Axis::Z], &options).unwrap()[0].error_over_floor.unwrap()
    };
    let (right, wrong) = (over(1.0), over(1.01));
    assert!((0.7..1.4).contains(&right), "the true model lies at {right} times the floor");
    assert!(wrong > 3.0, "a scale that is wrong by 1 % lies at {wrong} times the floor");
}

/// One lateness of a whole sensor shows on each axis by as much as that axis turns; one axis is besides mounted askew, and
/// while that is missing a lag looks like the better name.
#[test]
#[ignore = "long: tests/nightly"]
fn what_a_whole_sensor_has_is_found_on_each_axis_of_an_orientation() {
    let sensor = SensorSpec { reference: Reference::Quaternion, ..SensorSpec::default() };
    let hidden = ["delay:d=0.008", "cross-axis"].map(|text| Hidden::parse(text, Axis::X).unwrap()).to_vec();
    let motion = Motion::Multisine { travel: 4.0 };
    let record = simulate(&Scenario { motion, seconds: 60.0, seed: 6, hidden, sensor, ..Scenario::default() }).record;
    let (model, _) = diagnose::ladder(&record, &Model::base_for(&record), &Axis::ALL, &Options::default()).unwrap();
    for axis in Axis::ALL {
        let own = model.axes[axis.index()].as_ref().unwrap();
        let mut ids = own.effect_ids();
        ids.sort_unstable();
        let askew = ["bias", "cross-axis", "delay", "scale-factor"];
        let expected = askew.iter().filter(|id| **id != "cross-axis" || axis == Axis::X);
        let expected: Vec<&str> = expected.copied().collect();
        assert_eq!(ids, expected, "axis {axis}");
        let delay = own.term("delay").unwrap().values[0];
        assert!((delay - 0.008).abs() < 4e-4, "axis {axis}: {delay} s");
    }
}

/// Looked for on one axis alone, a lateness would leave in its error what the others read late.
#[test]
fn a_suspect_of_a_whole_sensor_is_fitted_on_every_axis_of_an_orientation() {
    let sensor = SensorSpec { reference: Reference::Quaternion, ..SensorSpec::default() };
    let hidden = vec![Hidden::parse("delay:d=0.004", Axis::X).unwrap()];
    let motion = Motion::Multisine { travel: 4.0 };
    let record = simulate(&Scenario { motion, seconds: 60.0, seed: 6, hidden, sensor, ..Scenario::default() }).record;
    let axes = diagnose::diagnose(&record, &Model::base_for(&record), &Axis::ALL, &Options::default()).unwrap();
    for axis in axes {
        let first = &axis.suspects[0];
        assert_eq!(first.effect, "delay", "axis {}: {}", axis.axis, axis.in_words(Voice::Log));
        assert!(first.error_fall.unwrap() > 0.95, "axis {}: {:?}", axis.axis, first.error_fall);
    }
}

/// How far a shaft turned inside a dead zone an encoder knows to whole counts only: each passage costs as much, and the
/// floor has it.
/// A sensor that is turned by 2° about z feels on x what y turns, and on y what x turns; what one axis alone takes out, the other leaves.
#[test]
fn a_sensor_that_is_turned_is_found_on_all_axes_at_once() {
    let sensor = SensorSpec { reference: Reference::Quaternion, ..SensorSpec::default() };
    let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
    let mut record = simulate(&Scenario { motion, sensor, seed: 3, seconds: 60.0, ..Scenario::default() }).record;
    let (sin, cos) = 2_f64.to_radians().sin_cos();
    for row in &mut record.rows {
        let [x, y, z] = row.gyro;
        row.gyro = [cos * x + sin * y, cos * y - sin * x, z];
    }
    let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), &Axis::ALL, &Options::default()).unwrap();
    for ladder in &ladders[..2] {
        assert_eq!(
            ladder.effects,
            ["scale-factor", "bias", "cross-axis"],
            "{}: {}",
            ladder.axis,
            ladder.in_words(Voice::Log)
        );
    }
    for ladder in &ladders {
        assert_eq!(ladder.verdict, Verdict::Adequate, "{}: {}", ladder.axis, ladder.in_words(Voice::Log));
    }
}

/// A clock that is set back or ahead between two samples of a grid: how far to a permille, when to a sample, on all axes alike.
#[test]
#[ignore = "long: tests/nightly"]
fn a_clock_that_is_set_is_found_to_a_sample() {
    for (reference, hidden, step) in [
        (Reference::Encoder(4096), "clock-step:j=-0.1,t0=41.234", -0.1),
        (Reference::Quaternion, "clock-step:j=0.05,t0=41.234", 0.05),
    ] {
        let sensor = SensorSpec { reference, ..SensorSpec::default() };
        let hidden = vec![Hidden::parse(hidden, Axis::X).unwrap()];
        let scenario = Scenario { sensor, hidden, seed: 3, seconds: 60.0, ..Scenario::default() };
        let record = simulate(&scenario).record;
        let axes: &[Axis] = if reference == Reference::Quaternion { &Axis::ALL } else { &[Axis::X] };
        let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), axes, &Options::default()).unwrap();
        for ladder in ladders {
            assert_eq!(
                ladder.effects,
                ["scale-factor", "bias", "clock-step"],
                "{}: {}",
                ladder.axis,
                ladder.in_words(Voice::Log)
            );
            let value = |name: &str| ladder.parameters.iter().find(|p| p.name == name).and_then(|p| p.value).unwrap();
            assert!((value("j") / step - 1.0).abs() < 1e-3, "{}: {}", ladder.axis, value("j"));
            assert!((value("t0") - 41.234).abs() < 0.015, "{}: {}", ladder.axis, value("t0"));
            let t0 = ladder.parameters.iter().find(|p| p.name == "t0").unwrap();
            let off = (value("t0") - 41.234).abs() / t0.std_error.unwrap();
            assert!(off < 4.0, "{}: {off} standard errors", ladder.axis);
        }
    }
}

/// A camera system's curve through its frames: a Gaussian window, on all axes alike, and nothing else.
#[test]
#[ignore = "long: tests/nightly"]
fn a_reference_that_is_smoothed_is_found_with_its_window() {
    for reference in [Reference::Rate, Reference::Quaternion] {
        let sensor = SensorSpec { reference, ..SensorSpec::default() };
        let hidden = vec![Hidden::parse("reference-smoothing:w=0.015", Axis::X).unwrap()];
        let motion = Motion::Multisine { travel: 5.0 };
        let record =
            simulate(&Scenario { motion, sensor, hidden, seed: 2, seconds: 60.0, ..Scenario::default() }).record;
        let axes: &[Axis] = if reference == Reference::Quaternion { &Axis::ALL } else { &[Axis::X] };
        let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), axes, &Options::default()).unwrap();
        for ladder in ladders {
            let own = ["scale-factor", "bias", "reference-smoothing"];
            assert_eq!(ladder.effects, own, "{}: {}", ladder.axis, ladder.in_words(Voice::Log));
            let w = ladder.parameters.iter().find(|p| p.name == "w").and_then(|p| p.value).unwrap();
            assert!((w - 0.015).abs() < 3e-4, "{}: {w}", ladder.axis);
        }
    }
}

/// What a smoothed reference shows is computed from the model's own motion, noise and all: so is the floor.
#[test]
#[ignore = "long: tests/nightly"]
fn the_floor_beside_a_smoothed_reference_is_the_error() {
    let motions = [Motion::Multisine { travel: 5.0 }, Motion::Drive { rate: 2.3, hold: 1.1 }];
    for (motion, seed) in motions.into_iter().zip(1..) {
        let sensor = SensorSpec { reference: Reference::Encoder(0), ..SensorSpec::default() };
        let hidden = vec![Hidden::parse("reference-smoothing:w=0.035", Axis::X).unwrap()];
        let record = simulate(&Scenario { motion, sensor, hidden, seed, seconds: 60.0, ..Scenario::default() }).record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        let [ladder] = ladders.as_slice() else { panic!("one axis") };
        assert_eq!(ladder.effects, ["scale-factor", "bias", "reference-smoothing"], "{}", ladder.in_words(Voice::Log));
        let curve = &ladder.steps.last().unwrap().error_curve;
        // Over longer times so few increments stand in a minute that chance alone makes them more than that.
        for point in curve.iter().filter(|point| (0.035..0.3).contains(&point.tau_s)) {
            let over = point.error.unwrap() / point.floor.unwrap();
            assert!((0.87..1.15).contains(&over), "{motion:?}: {over} of the floor at {} s", point.tau_s);
        }
    }
}

/// A clock that was set where the log begins is a delay.
#[test]
fn a_delay_is_no_clock_that_was_set_where_the_log_begins() {
    let hidden = vec![Hidden::parse("delay:d=0.004", Axis::X).unwrap()];
    let record = simulate(&Scenario { hidden, seed: 4, seconds: 60.0, ..Scenario::default() }).record;
    let found =
        diagnose::diagnose(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap().remove(0);
    let named =
        |id: &str| found.suspects.iter().any(|own| own.effect == id || own.aliases.iter().any(|alias| alias == id));
    assert!(named("delay") && !named("clock-step"), "{}: {:?}", found.in_words(Voice::Log), found.suspects);
}

/// The inverse of a resonance is a notch: near half the sampling rate it takes noise out at all frequencies.
#[test]
fn less_noise_is_no_resonance() {
    let sensor = SensorSpec { reference: Reference::Quaternion, ..SensorSpec::default() };
    let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
    let scenario = Scenario { motion, sensor, seed: 4, rate_hz: 250.0, seconds: 60.0, ..Scenario::default() };
    let record = simulate(&scenario).record;
    for found in diagnose::diagnose(&record, &Model::base_for(&record), &Axis::ALL, &Options::default()).unwrap() {
        assert_eq!(found.verdict, Verdict::Adequate, "{}: {}", found.axis, found.in_words(Voice::Log));
    }
}

#[test]
fn the_floor_has_what_each_passage_of_a_dead_zone_costs() {
    for seed in 1..=3 {
        let hidden = vec![Hidden::parse("dead-zone:w=0.0385", Axis::X).unwrap()];
        let motion = Motion::Multisine { travel: 5.0 };
        let record = simulate(&Scenario { motion, seed, hidden, ..Scenario::default() }).record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(ladders[0].effects, ["scale-factor", "bias", "dead-zone"], "seed {seed}");
        let over = ladders[0].steps.last().and_then(|step| step.error_over_floor).unwrap();
        assert!(over < 1.35, "seed {seed}: {over} times the floor");
    }
}

/// What an encoder's steps make of a motion that repeats itself exactly depends on where it counts from.
#[test]
#[ignore = "long: tests/nightly"]
fn the_floor_of_a_motion_that_repeats_itself_is_that_of_where_the_encoder_counts_from() {
    let step = TAU / 1024.0;
    for (seed, zero) in [(1, 0.0), (2, 0.2), (3, 0.35), (4, 0.5)] {
        let motion = Motion::Sine { amplitude: 1.1, frequency: 0.5 };
        let sensor = SensorSpec { reference: Reference::Encoder(1024), reference_noise: 0.0, ..SensorSpec::default() };
        let mut simulated = simulate(&Scenario { motion, seed, sensor, ..Scenario::default() });
        for (row, angle) in simulated.record.rows.iter_mut().zip(&simulated.true_angle) {
            row.ref_angle[0] = (angle[0] / step + zero).round() * step;
        }
        let record = simulated.record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(ladders[0].effects, ["scale-factor", "bias"], "zero at {zero}");
        let curve = &ladders[0].steps.last().unwrap().error_curve;
        for point in curve {
            let times = |least: Option<f64>| point.error.unwrap() / least.unwrap();
            let (over, of_band) = (times(point.floor), times(point.floor_99));
            assert!(over < 1.25 && of_band < 1.0, "zero at {zero}: {over} at {} s, {of_band} of the band", point.tau_s);
        }
    }
}

/// An encoder, or a gyro, whose last reading a recorder writes again until the next one comes.
#[test]
fn readings_that_stand_in_several_rows_are_no_physics() {
    for (gyro, every) in [(false, 5), (true, 4)] {
        let motion = Motion::Multisine { travel: 6.0 };
        let mut record = simulate(&Scenario { motion, seconds: 60.0, rate_hz: 200.0, ..Scenario::default() }).record;
        record.rows.retain(|row| row.ref_angle[0].is_finite());
        for k in (1..record.len()).filter(|k| k % every != 0) {
            let before = record.rows[k - 1];
            let row = &mut record.rows[k];
            if gyro {
                row.gyro = before.gyro;
            } else {
                row.ref_angle = before.ref_angle;
            }
        }
        let report = faults::check(&mut record, &[]);
        assert!(report.faults.iter().any(|f| f.kind.name() == "held-samples"), "{:?}", report.faults);
        let start = Model::base_for(&record);
        let (_, ladders) = diagnose::ladder(&record, &start, &[Axis::X], &Options::default()).unwrap();
        assert_eq!(ladders[0].verdict, Verdict::Adequate, "{}", ladders[0].in_words(Voice::Log));
        assert_eq!(ladders[0].effects, ["scale-factor", "bias"]);
    }
}

#[test]
fn a_reference_of_another_motion_is_not_called_a_scale_factor() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let record = log(6000, |t| {
        let rate = 1.5 * (1.3 * t).cos() + 0.5 * (5.1 * t).cos() + 2e-3 * normal();
        (rate, -0.8 * (1.9 * t).sin() - 0.2 * (1.3 * t).sin())
    });
    let axes = diagnose::diagnose(&record, &Model::base_for(&record), &[Axis::Z], &Options::default()).unwrap();
    assert_eq!(axes[0].verdict, Verdict::CannotTell, "{}", axes[0].in_words(Voice::Log));
    assert!(
        axes[0].in_words(Voice::Log).contains("do not agree, whatever the scale factor"),
        "{}",
        axes[0].in_words(Voice::Log)
    );
}

/// More readings than the noise is first looked for on, of noise that goes on from row to row.
#[test]
#[ignore = "long: tests/nightly"]
fn nothing_is_missing_in_a_clean_log_against_a_rate() {
    for (seed, motion) in [(1, "multisine"), (2, "sine")] {
        let motion: Motion = motion.parse().unwrap();
        let sensor = SensorSpec { reference: Reference::Rate, reference_noise: 5e-4, ..SensorSpec::random(seed) };
        let axis = sensor.axis;
        let record =
            simulate(&Scenario { motion, sensor, seed, seconds: 75.0, rate_hz: 400.0, ..Scenario::default() }).record;
        let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), &[axis], &Options::default()).unwrap();
        assert_eq!(ladders[0].effects, ["scale-factor", "bias"], "seed {seed}: {}", ladders[0].in_words(Voice::Log));
    }
}

/// Slowly passed counts are read where the shaft was: taken for their centres they made this lag a delay.
#[test]
fn a_lag_against_a_coarse_encoder_is_not_called_a_delay() {
    let hidden = vec![Hidden::parse("lag:tau=0.003", Axis::X).unwrap()];
    let sensor = SensorSpec { reference: Reference::Encoder(2048), ..SensorSpec::default() };
    let motion = "multisine".parse().unwrap();
    let scenario = Scenario { motion, sensor, hidden, seconds: 80.0, rate_hz: 500.0, ..Scenario::default() };
    let record = simulate(&scenario).record;
    let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
    assert_eq!(ladders[0].effects, ["scale-factor", "bias", "lag"], "{}", ladders[0].in_words(Voice::Log));
}

/// A camera's poses come at their own times, between the gyro's rows.
#[test]
fn a_lag_against_a_reference_with_times_of_its_own_is_not_called_a_delay() {
    let hidden = vec![Hidden::parse("lag:tau=0.02", Axis::X).unwrap()];
    let motion = Motion::Multisine { travel: 5.0 };
    let scenario = Scenario { hidden, motion, seed: 5, seconds: 60.0, rate_hz: 1000.0, ..Scenario::default() };
    let (mut record, mut next) = (simulate(&scenario).record, 0.0);
    let own = |row: &Row| Row { ref_angle: [f64::NAN; 3], ..*row };
    let shown = |row: &Row| Row { t_ns: row.t_ns, ref_angle: row.ref_angle, ..Row::EMPTY };
    let rows = record.rows.iter().enumerate().filter_map(|(k, row)| match (row.t_ns as f64 * 1e-9, k % 5) {
        (_, 0) => Some(own(row)),
        (t, _) if t >= next => {
            next += 0.0104;
            Some(shown(row))
        }
        _ => None,
    });
    record.rows = rows.collect();
    let found = diagnose::diagnose(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
    let best = &found[0].suspects[0];
    let tau = best.parameters.iter().find(|p| p.effect == "lag").and_then(|p| p.value);
    assert!(best.effect == "lag" && (tau.unwrap() - 0.02).abs() < 2e-4, "{}: {best:?}", found[0].in_words(Voice::Log));
}

/// A magnetic encoder flickers by more than its step: what is left is as much as that makes, and nothing is missing.
#[test]
fn an_encoder_that_varies_by_more_than_its_step_hides_nothing() {
    for (seed, motion) in [(1, "multisine"), (2, "drive"), (3, "sine")] {
        let step = TAU / 4096.0;
        let sensor = SensorSpec {
            reference: Reference::Encoder(4096),
            reference_noise: 0.7 * step,
            axis: Axis::X,
            ..SensorSpec::random(seed)
        };
        let motion = motion.parse().unwrap();
        let record = simulate(&Scenario { motion, sensor, seed, rate_hz: 200.0, ..Scenario::default() }).record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(ladders[0].verdict, Verdict::Adequate, "seed {seed}: {}", ladders[0].in_words(Voice::Log));
        let over = ladders[0].steps.last().and_then(|step| step.error_over_floor).unwrap();
        assert!((0.8..1.4).contains(&over), "seed {seed}: {over} times the floor");
    }
}

/// An encoder that trembles by a fifth of its count: the floor knows, and what is weak beside it is found.
#[test]
#[ignore = "long: tests/nightly"]
fn an_encoder_that_varies_by_less_than_its_step_hides_nothing() {
    for (seed, motion) in [(4, "multisine"), (6, "drive"), (7, "sine")] {
        let sensor = SensorSpec {
            reference: Reference::Encoder(2048),
            reference_noise: 0.2 * TAU / 2048.0,
            axis: Axis::X,
            ..SensorSpec::random(seed)
        };
        let hidden = vec![Hidden::parse("cubic-nonlinearity:k3=0.0002", Axis::X).unwrap()];
        let motion = motion.parse().unwrap();
        let scenario = Scenario { motion, sensor, seed, rate_hz: 250.0, seconds: 100.0, hidden };
        let record = simulate(&scenario).record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(
            ladders[0].effects,
            ["scale-factor", "bias", "cubic-nonlinearity"],
            "{}",
            ladders[0].in_words(Voice::Log)
        );
        let short = ladders[0].steps.last().unwrap().error_curve.iter().take(8);
        let over = short.map(|p| p.error.unwrap() / p.floor.unwrap()).sum::<f64>() / 8.0;
        assert!((0.95..1.05).contains(&over), "seed {seed}: {over} times the floor");
    }
}

/// A gear turns round between the readings, which are a tenth of a radian per second apart there.
#[test]
fn a_gears_play_is_as_wide_as_where_the_shaft_turned_round() {
    let seeds = 1..=4;
    let count = seeds.clone().count() as f64;
    let off = |seed: u64| {
        let hidden = vec![Hidden::parse("encoder-backlash:b=0.0105", Axis::X).unwrap()];
        let sensor = SensorSpec { axis: Axis::X, reference: Reference::Encoder(8192), ..SensorSpec::random(seed) };
        let motion = Motion::Multisine { travel: 8.6 };
        let record = simulate(&Scenario { motion, sensor, seed, seconds: 96.0, hidden, ..Scenario::default() }).record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(
            ladders[0].effects,
            ["scale-factor", "bias", "encoder-backlash"],
            "seed {seed}: {}",
            ladders[0].in_words(Voice::Log)
        );
        ladders[0].parameters.iter().find(|p| p.name == "b").and_then(|p| p.value).unwrap() - 0.0105
    };
    let mean = seeds.map(off).sum::<f64>() / count;
    assert!(mean.abs() < 1.5e-5, "{mean} rad off");
}

/// While a shaft rests its gyro's noise walks, and no play takes that up.
#[test]
fn a_shaft_that_stops_between_turns_has_no_play() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (step, mut angle, mut before) = (TAU / 65_536.0, 0.3, None);
    // Turns of a second, to and fro by other amounts, with two seconds of rest after each.
    let sizes = [0.8, -1.1, 1.7, -0.6, -0.9, 1.3, 0.5, -1.9, 0.7, -0.4];
    let record = log(11_000, |t| {
        let (turn, within) = ((t / 3.0).floor() as usize, t.rem_euclid(3.0));
        let rate: f64 = if within < 1.0 { sizes[turn % sizes.len()] * (1.0 - (TAU * within).cos()) } else { 0.0 };
        angle += before.replace(rate).map_or(0.0, |before: f64| 0.5 * (before + rate) / RATE_HZ);
        (rate + 2.5e-3 * normal(), ((angle + 2e-5 * normal()) / step).round() * step)
    });
    let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), &[Axis::Z], &Options::default()).unwrap();
    assert_eq!(ladders[0].effects, ["scale-factor", "bias"], "{}", ladders[0].in_words(Voice::Log));
}

/// A stepper whose cogs shake its shaft faster than the log is sampled, and never let it rest: gyro and encoder, which see
/// that 12 ms apart, differ by much that is no noise of the encoder. What is missing is the delay, and no list of effects.
#[test]
fn a_shaking_that_is_seen_late_is_no_noise_of_the_encoder() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (late, step, cogs, shake) = (0.012, TAU / 4096.0, 80.0, 2e-3);
    let lines = [(2.0, 0.05, 0.0), (1.5, 0.13, 1.0), (1.2, 0.31, 2.0)];
    let shaft = |t: f64| -> (f64, f64) {
        let rate: f64 = lines.iter().map(|(size, f, phase)| size * (TAU * f * t + phase).sin()).sum();
        let angle: f64 = lines.iter().map(|(size, f, phase)| -size / (TAU * f) * (TAU * f * t + phase).cos()).sum();
        (rate * (1.0 + cogs * shake * (cogs * angle).cos()), angle + shake * (cogs * angle).sin())
    };
    let record = log(12_000, |t| {
        let read = 0.98 * shaft(t - late).0 + 0.01 + 1e-3 * normal();
        (read, (shaft(t).1 / step).round() * step)
    });
    let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), &[Axis::Z], &Options::default()).unwrap();
    assert_eq!(ladders[0].effects, ["scale-factor", "bias", "delay"], "{}", ladders[0].in_words(Voice::Log));
    let over: Vec<f64> = ladders[0].steps.iter().filter_map(|step| step.error_over_floor).collect();
    assert!(over[0] > 20.0 && (1.0..2.5).contains(&over[1]), "{over:?} times the floor");
}

/// Where a sine's peaks are cut off, the encoder's steps still repeat from one period to the next: what that makes is no error
/// of the encoder.
#[test]
fn steps_that_repeat_between_peaks_that_are_cut_off_are_no_effect() {
    for (seed, limit, counts) in [(1, 3.7, 8192), (2, 3.9, 4096), (3, 3.8, 8192)] {
        let hidden = vec![Hidden::parse(&format!("saturation:l={limit}"), Axis::X).unwrap()];
        let sensor = SensorSpec {
            reference: Reference::Encoder(counts),
            noise_density: 4e-5,
            axis: Axis::X,
            ..SensorSpec::default()
        };
        let scenario = Scenario { sensor, hidden, seed, ..Scenario::default() };
        let record = simulate(&scenario).record;
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(
            ladders[0].effects,
            ["scale-factor", "bias", "saturation"],
            "seed {seed}: {}",
            ladders[0].in_words(Voice::Log)
        );
    }
}

/// Beside an exact angle the gyro's noise is in the derivatives as much as in the residual. The scale factor does not come out too small for
/// that, and what a filter takes out of the noise is no effect.
#[test]
#[ignore = "long: tests/nightly"]
fn noise_beside_an_exact_reference_moves_no_scale_and_is_no_effect() {
    let mut errors = Vec::new();
    for seed in 0..4 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let lines: [(f64, f64, f64); 6] = std::array::from_fn(|_| {
            (random.random_range(0.1..0.6), random.random_range(0.3..9.0), random.random_range(0.0..TAU))
        });
        let record = log_at(200.0, 24_000, |t| {
            let noise: f64 = StandardNormal.sample(&mut random);
            let rate: f64 = lines.iter().map(|(size, omega, phase)| size * (omega * t + phase).sin()).sum();
            let angle: f64 = lines.iter().map(|(size, omega, phase)| -size / omega * (omega * t + phase).cos()).sum();
            ((rate - 0.01) / 0.98 + 5e-3 * noise, (angle / 1.7e-6).round() * 1.7e-6)
        });
        let start = Model::base_for(&record);
        let model = fit(&record, &start, &[Axis::Z]).unwrap();
        let scale = &model.axes[2].as_ref().unwrap().terms[0];
        errors.push((scale.values[0] - 0.98) / scale.std_errors[0]);
        let found = diagnose::diagnose(&record, &start, &[Axis::Z], &Options::default()).unwrap().remove(0);
        assert_eq!(found.verdict, Verdict::Adequate, "{seed}: {}", found.in_words(Voice::Log));
    }
    assert!(errors.iter().sum::<f64>().abs() < 6.0, "standard errors: {errors:?}");
}

/// A minute of a heading, printed to a hundredth of a degree, shows its noise beside the gyro.
#[test]
fn a_short_heading_is_not_believed_to_its_last_digit() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut row = 0;
    let record = log(6_000, |t| {
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let rate = 0.3 * (0.4 * t).sin() + 0.2 * (0.9 * t + 1.0).sin();
        let angle = 0.75 * (1.0 - (0.4 * t).cos()) - 0.2 / 0.9 * (0.9 * t + 1.0).cos();
        let digit = 0.01_f64.to_radians();
        row += 1;
        let heading =
            if row % 10 == 1 { ((angle + 10.0 * digit * normal()) / digit).round() * digit } else { f64::NAN };
        ((rate - 0.01) / 0.98 + 1e-3 * normal(), heading)
    });
    let start = Model::base_for(&record);
    let found = diagnose::diagnose(&record, &start, &[Axis::Z], &Options::default()).unwrap().remove(0);
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.in_words(Voice::Log));
    let noise = found.noise.encoder.unwrap();
    assert!((1e-3..3e-3).contains(&noise), "{noise} rad");
}

/// A gyro that is read at every second row beside a rate that is measured at each: its noise between two readings is no physics.
#[test]
fn a_gyro_read_at_every_second_row_beside_a_rate_lacks_nothing() {
    for seed in 1..=3 {
        let sensor = SensorSpec { reference: Reference::Rate, reference_every: 1, ..SensorSpec::random(seed) };
        let scenario =
            Scenario { motion: "drive".parse().unwrap(), seed, seconds: 90.0, sensor, ..Scenario::default() };
        let mut record = simulate(&scenario).record;
        for k in (1..record.len()).step_by(2) {
            record.rows[k].gyro = record.rows[k - 1].gyro;
        }
        let faults = faults::check(&mut record, &[]).faults;
        let held: Vec<&str> =
            faults.iter().map(|fault| fault.kind.name()).filter(|name| *name == "held-samples").collect();
        assert_eq!(held.len(), 1, "{seed}: {faults:?}");
        let options = Options { faults: &faults, ..Options::default() };
        let (_, ladders) =
            diagnose::ladder(&record, &Model::base_for(&record), &[scenario.sensor.axis], &options).unwrap();
        assert_eq!(ladders[0].effects, ["scale-factor", "bias"], "{seed}: {}", ladders[0].in_words(Voice::Log));
    }
}

/// An accelerometer that shows but noise along an axis tells next to nothing of the gyro's sensitivity along it: the standard error says
/// so, as that of a least-squares fit of the rates does.
#[test]
fn the_standard_error_of_a_column_of_noise_is_that_of_least_squares() {
    let mut squares = Vec::new();
    for seed in 1..=6 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (true_g, accel_noise, noise) = (5e-5, 0.02, 3.5e-3);
        let rows = (0..6000).map(|k| {
            let t = f64::from(k) / RATE_HZ;
            let rate = 1.2 * (TAU * 0.31 * t).sin() + 0.7 * (TAU * 0.83 * t + 1.0).sin();
            let mut row = Row { t_ns: (t * 1e9).round() as i64, ..Row::EMPTY };
            row.accel = [9.8 * (0.4 * t).cos(), 9.8 * (0.4 * t).sin(), 0.0].map(|a| a + accel_noise * normal());
            row.gyro[2] = (rate + true_g * row.accel[2] + 0.01) / 0.99 + noise * normal();
            row.ref_rate[2] = rate + 3e-4 * normal();
            row
        });
        let record = Record { rows: rows.collect(), ..Record::default() };
        let mut model = Model::base_for(&record);
        let effect = gyro_model::effects::find("g-sensitivity").unwrap();
        model.axes[2].as_mut().unwrap().terms.push(gyro_model::Term::neutral(effect, Axis::Z));
        let fitted = fit(&record, &model, &[Axis::Z]).unwrap();
        let term = fitted.axes[2].as_ref().unwrap().term("g-sensitivity").unwrap();
        let expected = noise / (accel_noise * 6000_f64.sqrt());
        let error = term.std_errors[2];
        assert!((0.6..2.0).contains(&(error / expected)), "{seed}: {error} for {expected}");
        squares.push(((term.values[2] - true_g) / error).powi(2));
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(rms < 2.0, "{rms}");
}
