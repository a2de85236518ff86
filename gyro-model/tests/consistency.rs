//! Whether the filter knows what it knows: from the first row on, the filtered rate lies within three of its standard
//! deviations, over kinds, rates and noises of references, at rest and moving, with a model that is not fitted yet,
//! with the right one, and with one that is wrong and certain of itself.

use gyro_model::{
    Axis, AxisModel, Model, Noise, Row,
    estimator::{Estimate, Estimator, Options, flags},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const DEGREE: f64 = TAU / 360.0;

/// (angle, rate) at a time, rad, rad/s.
type Motion = fn(f64) -> (f64, f64);

fn rest(_: f64) -> (f64, f64) {
    (0.3, 0.0)
}

fn swing(t: f64) -> (f64, f64) {
    let w = TAU * 0.3;
    (1.2 * (w * t).sin(), 1.2 * w * (w * t).cos())
}

/// Faster than a late reference's delay is short.
fn fast(t: f64) -> (f64, f64) {
    let w = TAU * 0.7;
    (0.6 * (w * t).sin(), 0.6 * w * (w * t).cos())
}

/// Rests for five seconds, then turns by smooth steps now and then.
fn errands(t: f64) -> (f64, f64) {
    let (mut angle, mut rate) = (0.0, 0.0);
    for k in 0..12 {
        let x = (t - 6.0 - 4.1 * f64::from(k)) / 0.25;
        let height = if k % 3 == 2 { -1.9 } else { 1.1 };
        angle += height * 0.5 * (1.0 + x.tanh());
        rate += height * 0.5 / 0.25 / x.cosh().powi(2);
    }
    (angle, rate)
}

/// One way round, at two speeds.
fn circle(t: f64) -> (f64, f64) {
    (0.8 * t + 0.3 * (0.4 * t).sin(), 0.8 + 0.12 * (0.4 * t).cos())
}

const MOTIONS: [(&str, Motion); 5] =
    [("rest", rest), ("swing", swing), ("fast", fast), ("errands", errands), ("circle", circle)];

/// How a reference errs.
#[derive(Clone, Copy, Debug)]
struct Reference {
    hz: f64,
    /// Standard deviation, rad (rad/s of a rate).
    noise: f64,
    /// Over what time the noise is correlated, s; 0 for white.
    correlated: f64,
    /// Step of the reading, rad.
    step: f64,
    /// How late the reading is, s.
    late: f64,
    /// Whether every row repeats the last reading.
    held: bool,
    is_rate: bool,
    wrapped: bool,
}

const PLAIN: Reference = Reference {
    hz: 100.0,
    noise: 0.0,
    correlated: 0.0,
    step: 0.0,
    late: 0.0,
    held: false,
    is_rate: false,
    wrapped: false,
};

fn references() -> Vec<(String, Reference)> {
    let mut list = Vec::new();
    for hz in [1.0, 5.0, 10.0, 50.0, 100.0] {
        for counts in [360.0, 4096.0] {
            list.push((format!("encoder {counts} at {hz} Hz"), Reference { hz, step: TAU / counts, ..PLAIN }));
        }
        for degrees in [0.15, 1.0] {
            list.push((format!("heading {degrees}° at {hz} Hz"), Reference { hz, noise: degrees * DEGREE, ..PLAIN }));
        }
        let wrapped = Reference { hz, noise: 0.3 * DEGREE, step: 0.1 * DEGREE, wrapped: true, ..PLAIN };
        list.push((format!("heading in tenths, wrapped, at {hz} Hz"), wrapped));
        list.push((
            format!("heading late by 0.12 s at {hz} Hz"),
            Reference { hz, noise: 0.2 * DEGREE, late: 0.12, ..PLAIN },
        ));
        list.push((format!("rate at {hz} Hz"), Reference { hz, noise: 0.02, is_rate: true, ..PLAIN }));
    }
    for hz in [20.0, 50.0] {
        let pose = Reference { hz, noise: 0.2 * DEGREE, correlated: 0.15, late: 0.03, ..PLAIN };
        list.push((format!("camera at {hz} Hz"), pose));
        list.push((
            format!("smooth heading at {hz} Hz"),
            Reference { hz, noise: 0.5 * DEGREE, correlated: 1.0, ..PLAIN },
        ));
    }
    list.push(("held heading at 5 Hz".into(), Reference { hz: 5.0, noise: 0.2 * DEGREE, held: true, ..PLAIN }));
    list.push(("held encoder at 10 Hz".into(), Reference { hz: 10.0, step: TAU / 4096.0, held: true, ..PLAIN }));
    list.push(("late rate".into(), Reference { hz: 50.0, noise: 0.02, is_rate: true, late: 0.1, ..PLAIN }));
    list.push(("late encoder".into(), Reference { hz: 10.0, step: TAU / 4096.0, late: 0.1, ..PLAIN }));
    list.push(("none".into(), Reference { hz: 1e-9, ..PLAIN }));
    list
}

#[derive(Clone, Copy, Debug)]
struct Gyro {
    hz: f64,
    /// Standard deviation of one reading, rad/s.
    noise: f64,
    bias: f64,
    alpha: f64,
}

const GYROS: [Gyro; 3] = [
    Gyro { hz: 100.0, noise: 1.0e-3, bias: -0.06, alpha: 0.98 },
    Gyro { hz: 50.0, noise: 4.0e-3, bias: 0.02, alpha: 1.04 },
    Gyro { hz: 400.0, noise: 1.5e-3, bias: 0.12, alpha: 1.01 },
];

/// Rows of the z axis.
fn rows(motion: Motion, gyro: Gyro, reference: Reference, seconds: f64, seed: u64) -> Vec<Row> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = move || -> f64 { StandardNormal.sample(&mut random) };
    let (mut wander, mut next, mut held) = (draw(), 0.0, f64::NAN);
    (0..(seconds * gyro.hz) as i64)
        .map(|k| {
            let t_ns = (k as f64 * 1e9 / gyro.hz).round() as i64;
            let t = t_ns as f64 * 1e-9;
            let mut row = Row { t_ns, ..Row::EMPTY };
            let reading = (motion(t).1 - gyro.bias) / gyro.alpha + gyro.noise * draw();
            row.gyro[2] = (reading / 5e-4).round() * 5e-4;
            if t + 1e-9 >= next {
                next += 1.0 / reference.hz;
                let keep =
                    if reference.correlated > 0.0 { (-1.0 / (reference.hz * reference.correlated)).exp() } else { 0.0 };
                wander = keep * wander + (1.0 - keep * keep).sqrt() * draw();
                let (angle, rate) = motion(t - reference.late);
                let value = if reference.is_rate { rate } else { angle } + reference.noise * wander;
                let value =
                    if reference.step > 0.0 { (value / reference.step).round() * reference.step } else { value };
                held = if reference.wrapped { value.rem_euclid(TAU) } else { value };
            } else if !reference.held {
                held = f64::NAN;
            }
            let slot = if reference.is_rate { &mut row.ref_rate } else { &mut row.ref_angle };
            slot[2] = held;
            row
        })
        .collect()
}

fn run(model: Option<&Model>, rows: &[Row]) -> Vec<Estimate> {
    let mut estimator = Estimator::new(Options::default());
    if let Some(model) = model {
        estimator.set_model(model);
    }
    rows.iter().map(|row| estimator.step(row)).collect()
}

/// How a run went.
struct Score {
    /// Share of rows beyond three standard deviations.
    beyond: f64,
    /// The worst error of them, its standard deviation, °/s, and its time, s.
    worst: [f64; 3],
    /// Standard deviation after 8 s, °/s.
    after_8_s: f64,
}

fn score(motion: Motion, estimates: &[Estimate]) -> Score {
    let (mut beyond, mut counted, mut worst, mut after) = (0.0_f64, 0.0_f64, (0.0, 0.0, 0.0), f64::NAN);
    for e in estimates {
        let axis = e.axes[2];
        if !axis.rate_filtered.is_finite() || axis.flags & flags::LOST != 0 {
            continue;
        }
        let t = e.valid_t_ns as f64 * 1e-9;
        let off = (axis.rate_filtered - motion(t).1).abs();
        counted += 1.0;
        if off > 3.0 * axis.rate_std {
            beyond += 1.0;
            if off > worst.0 {
                worst = (off, axis.rate_std, t);
            }
        }
        if t <= 8.0 {
            after = axis.rate_std;
        }
    }
    let worst = [worst.0 / DEGREE, worst.1 / DEGREE, worst.2];
    Score { beyond: beyond / counted.max(1.0), worst, after_8_s: after / DEGREE }
}

/// A fitted base model with standard errors as a fit of a minute has them.
fn fitted(alpha: f64, delta: f64, gyro: Gyro, encoder: f64) -> Model {
    let mut axis = AxisModel::base(Axis::Z);
    axis.terms[0].values[0] = alpha;
    axis.terms[1].values[0] = delta;
    axis.terms[0].std_errors = vec![1e-4];
    axis.terms[1].std_errors = vec![2e-5];
    axis.noise = Noise {
        angle_random_walk: alpha * gyro.noise / gyro.hz.sqrt(),
        bias_random_walk: 1e-6,
        encoder,
        unexplained: 0.0,
    };
    Model { epoch: 1, axes: [None, None, Some(axis)], ..Model::default() }
}

#[test]
fn a_rate_is_never_wrong_and_certain_from_the_first_row_on() {
    let (mut all, mut beyond, mut bad) = (0.0, 0.0, Vec::new());
    for (name, reference) in references() {
        for (motion_name, motion) in MOTIONS {
            for (g, gyro) in GYROS.into_iter().enumerate() {
                let rows = rows(motion, gyro, reference, 30.0, 17 + g as u64);
                let score = score(motion, &run(None, &rows));
                all += 1.0;
                beyond += score.beyond;
                if score.beyond > 0.01 {
                    let [worst, std, t] = score.worst;
                    bad.push(format!("{name}, {motion_name}, gyro {g}: {worst:.2} ± {std:.2} °/s at {t:.1} s"));
                }
                if motion_name == "rest" && reference.hz >= 5.0 {
                    assert!(score.after_8_s < 1.5, "{name}, gyro {g}: ± {} °/s after 8 s at rest", score.after_8_s);
                }
            }
        }
    }
    let mean = beyond / all;
    assert!(mean < 0.002 && bad.len() < 5, "{mean} of all rows beyond 3 σ; of {all} runs:\n{}", bad.join("\n"));
}

/// The share of rows beyond three standard deviations, over the whole run and over its second half, mean over references, motions and
/// gyros, under a fitted model whose scale factor and bias are off by so much.
fn off_by(scale: f64, bias: f64, encoder: f64, only: fn(&Reference) -> bool) -> (f64, f64) {
    let (mut runs, mut whole, mut late) = (0.0, 0.0, 0.0);
    for (_, reference) in references().into_iter().filter(|(_, r)| r.hz >= 1.0 && only(r)) {
        for (_, motion) in MOTIONS {
            for gyro in GYROS {
                let rows = rows(motion, gyro, reference, 40.0, 5);
                let noise =
                    if reference.is_rate { 1e-3 } else { reference.noise.max(reference.step / 12.0_f64.sqrt()) };
                let model = fitted(gyro.alpha * (1.0 + scale), gyro.bias + bias, gyro, encoder * noise);
                let estimates = run(Some(&model), &rows);
                runs += 1.0;
                whole += score(motion, &estimates).beyond;
                late += score(motion, &estimates[estimates.len() / 2..]).beyond;
            }
        }
    }
    (whole / runs, late / runs)
}

#[test]
fn under_the_right_model_the_standard_deviation_holds_on_every_reference() {
    let (whole, late) = off_by(0.0, 0.0, 1.0, |_| true);
    assert!(whole < 0.006 && late < 0.006, "{whole} of all rows, {late} of the second halves beyond 3 σ");
}

#[test]
#[ignore = "long: tests/nightly"]
fn nothing_has_changed_where_nothing_did() {
    let (mut runs, mut noticed) = (0.0, Vec::new());
    for (name, reference) in references() {
        for (motion_name, motion) in MOTIONS {
            for gyro in GYROS {
                let rows = rows(motion, gyro, reference, 60.0, 9);
                let model = fitted(gyro.alpha, gyro.bias, gyro, reference.noise.max(reference.step / 12.0_f64.sqrt()));
                for model in [None, Some(&model)] {
                    runs += 1.0;
                    let is_noticed = |e: &Estimate| e.axes[2].flags & flags::CHANGED != 0;
                    if let Some(e) = run(model, &rows).iter().find(|e| is_noticed(e)) {
                        let t = e.valid_t_ns as f64 * 1e-9;
                        noticed.push(format!("{name}, {motion_name}, model {}: at {t:.1} s", model.is_some()));
                    }
                }
            }
        }
    }
    assert!((noticed.len() as f64) < 0.02 * runs, "{} of {runs} runs:\n{}", noticed.len(), noticed.join("\n"));
}

#[test]
fn a_zero_that_has_moved_since_the_model_was_made_is_known_not_to_be_known() {
    let (whole, late) = off_by(0.0, 0.5 * DEGREE, 1.0, |_| true);
    assert!(whole < 0.006 && late < 0.006, "{whole} of all rows, {late} of the second halves beyond 3 σ");
}

#[test]
fn a_model_that_took_a_late_reference_for_a_scale_error_does_not_spoil_the_rate() {
    let (mut all, mut beyond, mut worst) = (0.0, 0.0, 0.0_f64);
    for (_, reference) in references().into_iter().filter(|(_, r)| r.late >= 0.1 && r.hz >= 10.0) {
        for (_, motion) in MOTIONS {
            for gyro in GYROS {
                for starts_with in [None, Some(fitted(gyro.alpha, gyro.bias, gyro, 1e-3))] {
                    let rows = rows(motion, gyro, reference, 40.0, 5);
                    let mut estimator = Estimator::new(Options::default());
                    if let Some(model) = &starts_with {
                        estimator.set_model(model);
                    }
                    // As least squares find them: α smaller by 1 − cos ωτ.
                    let mut late = fitted(0.9 * gyro.alpha, gyro.bias + 0.005, gyro, 1e-10);
                    late.epoch = 2;
                    late.axes[2].as_mut().unwrap().noise.unexplained = 0.4;
                    let published = 2 * rows.len() / 5;
                    for (k, row) in rows.iter().enumerate() {
                        if k == published {
                            estimator.set_model(&late);
                        }
                        let estimate = estimator.step(row);
                        let axis = estimate.axes[2];
                        if k > published {
                            let off = (axis.rate_filtered - motion(estimate.valid_t_ns as f64 * 1e-9).1).abs();
                            all += 1.0;
                            beyond += f64::from(u8::from(off > 3.0 * axis.rate_std));
                            worst = worst.max(off);
                        }
                    }
                }
            }
        }
    }
    assert!(beyond < 0.01 * all, "{} of the rows beyond 3 σ, off by up to {} °/s", beyond / all, worst / DEGREE);
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_gyro_that_changes_while_it_runs_is_wrong_for_a_moment_and_not_for_long() {
    // A scale shows only while something turns.
    for (name, scale, bias, most) in [("zero", 1.0, 0.05, 0.04), ("scale", 0.93, 0.0, 0.16)] {
        let (mut all, mut beyond, mut worst) = (0.0, 0.0, Vec::new());
        for (reference_name, reference) in references().into_iter().filter(|(_, r)| r.hz >= 10.0 && r.correlated == 0.0)
        {
            for (motion_name, motion) in MOTIONS {
                for gyro in GYROS {
                    let mut rows = rows(motion, gyro, reference, 60.0, 5);
                    let changes = rows.len() / 2;
                    for row in &mut rows[changes..] {
                        row.gyro[2] = row.gyro[2] * scale + bias;
                    }
                    let model = fitted(gyro.alpha, gyro.bias, gyro, reference.noise.max(1e-4));
                    let estimates = run(Some(&model), &rows);
                    // Three seconds later.
                    let later = changes + (3.0 * gyro.hz) as usize;
                    let score = score(motion, &estimates[later..]);
                    all += 1.0;
                    beyond += score.beyond;
                    if score.beyond > 0.1 {
                        let [off, std, t] = score.worst;
                        worst.push(format!(
                            "{reference_name}, {motion_name}: {:.0} %, {off:.2} ± {std:.2} at {t:.1} s",
                            100.0 * score.beyond
                        ));
                    }
                }
            }
        }
        assert!(beyond < most * all, "{name}: {} of the rows beyond 3 σ\n{}", beyond / all, worst.join("\n"));
    }
}

#[test]
fn a_reference_of_ten_hertz_corrects_a_bias_that_the_model_is_wrongly_certain_of() {
    for encoder in [1.0, 1e-3] {
        let (_, late) =
            off_by(0.0, 0.05, encoder, |r| r.hz >= 10.0 && r.noise < 0.01 && r.correlated == 0.0 && !r.is_rate);
        assert!(
            late < 0.1,
            "{late} of the second halves beyond 3 σ, encoder noise believed to {encoder} of what it is"
        );
    }
}

#[test]
fn spikes_of_the_gyro_make_no_noise_of_it() {
    let gyro = GYROS[0];
    let reference = Reference { hz: 100.0, step: TAU / 4096.0, ..PLAIN };
    let mut rows = rows(swing, gyro, reference, 30.0, 3);
    for row in rows.iter_mut().skip(300).step_by(237) {
        row.gyro[2] = -2000.0 * DEGREE;
    }
    let estimates = run(None, &rows);
    let off = estimates[500..].iter().map(|e| (e.axes[2].rate_filtered - swing(e.valid_t_ns as f64 * 1e-9).1).abs());
    let wrong = off.filter(|off| *off > 6.0 * DEGREE).count();
    assert!(wrong < 5, "{wrong} rates off by more than 6 °/s");
}
