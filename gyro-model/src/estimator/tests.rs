use super::*;
use crate::{
    Axis, AxisModel, Noise, Term,
    effects::{
        Memory, ReferenceAngle, Signals, delay::DELAY, encoder_backlash::ENCODER_BACKLASH, find,
        temperature_bias::TEMPERATURE_BIAS,
    },
};
use itertools::Itertools;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// White gyro noise and encoder noise of the tests: rad/√s, rad.
const N: f64 = 9e-5;
const ENCODER: f64 = 4e-4;

/// Standard normal numbers.
struct Normal(ChaCha8Rng);

impl Normal {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn draw(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

/// A motion about one axis: (angle, rate) at a time, rad, rad/s.
type Motion = fn(f64) -> (f64, f64);

fn sine(t: f64) -> (f64, f64) {
    let w = TAU * 0.25;
    (2.618 * (w * t).sin(), 2.618 * w * (w * t).cos())
}

fn multisine(t: f64) -> (f64, f64) {
    [(1.0, 0.31), (0.4, 0.83), (0.1, 2.3), (0.03, 4.9)].iter().fold((0.0, 0.0), |(angle, rate), &(a, f)| {
        let w = TAU * f;
        (angle + a * (w * t + f).sin(), rate + a * w * (w * t + f).cos())
    })
}

/// Stops and turns with rounded corners.
fn drive(t: f64) -> (f64, f64) {
    let (mut angle, mut rate) = (0.0, 0.0);
    for k in 0..60 {
        let (start, height) = (1.7 + 2.9 * f64::from(k), if k % 2 == 0 { 1.3 } else { -1.1 });
        // A turn: the angle rises by a smooth step of 0.4 s.
        let x = (t - start) / 0.1;
        angle += height * 0.5 * (1.0 + x.tanh());
        rate += height * 0.5 / 0.1 / x.cosh().powi(2);
    }
    (angle, rate)
}

/// A fitted base model of the z axis with this noise.
fn model(alpha: f64, delta: f64) -> Model {
    let mut axis = AxisModel::base(Axis::Z);
    axis.terms[0].values[0] = alpha;
    axis.terms[1].values[0] = delta;
    for term in &mut axis.terms {
        term.std_errors = vec![0.0];
    }
    axis.noise = Noise { angle_random_walk: N, bias_random_walk: 0.0, encoder: ENCODER, ..Noise::default() };
    Model { epoch: 1, axes: [None, None, Some(axis)], ..Model::default() }
}

/// Rows of the z axis: gyro reading (ω − δ)/α + noise taken `delay` late, encoder with noise.
fn rows(motion: Motion, rate_hz: i64, seconds: i64, (alpha, delta, delay): (f64, f64, f64), seed: u64) -> Vec<Row> {
    let mut normal = Normal::new(seed);
    let sigma = N * (rate_hz as f64).sqrt();
    (0..rate_hz * seconds)
        .map(|k| {
            let t_ns = k * 1_000_000_000 / rate_hz;
            let t = t_ns as f64 * 1e-9;
            let mut row = Row { t_ns, ..Row::EMPTY };
            row.gyro[2] = (motion(t - delay).1 + sigma * normal.draw() - delta) / alpha;
            row.ref_angle[2] = motion(t).0 + ENCODER * normal.draw();
            row
        })
        .collect()
}

fn without_reference(rows: &[Row]) -> Vec<Row> {
    rows.iter().map(|row| Row { ref_angle: [f64::NAN; 3], ..*row }).collect()
}

/// RMS of what is left after the first second.
fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = errors.fold((0.0, 0.0), |(sum, n), e| (sum + e * e, n + 1.0));
    (sum / n).sqrt()
}

fn run(options: Options, model: &Model, rows: &[Row]) -> Vec<Estimate> {
    let mut estimator = Estimator::new(options);
    estimator.set_model(model);
    rows.iter().map(|row| estimator.step(row)).collect()
}

fn true_rate(motion: Motion, estimate: &Estimate) -> f64 {
    motion(estimate.valid_t_ns as f64 * 1e-9).1
}

/// Where a χ² of `n` degrees of freedom lies with a probability of 1 − 10⁻⁴.
fn chi_square_band(n: usize) -> std::ops::Range<f64> {
    let law = ChiSquared::new(n as f64).unwrap();
    law.inverse_cdf(0.5e-4)..law.inverse_cdf(1.0 - 0.5e-4)
}

#[test]
fn the_filtered_rate_is_closer_to_the_truth_than_the_compensated_one_and_its_standard_deviation_is_right() {
    for (name, motion, rate_hz) in [
        ("sine", sine as Motion, 100),
        ("sine", sine, 1000),
        ("multisine", multisine, 200),
        ("multisine", multisine, 1000),
        ("drive", drive, 200),
        ("drive", drive, 1000),
    ] {
        for reference in [true, false] {
            let rows = rows(motion, rate_hz, 60, (1.1, -0.2, 0.0), 7);
            let rows = if reference { rows } else { without_reference(&rows) };
            let estimates = run(Options::default(), &model(1.1, -0.2), &rows);
            let late = &estimates[40 * rate_hz as usize..];
            let rate = rms(late.iter().map(|e| e.axes[2].rate - true_rate(motion, e)));
            let filtered = rms(late.iter().map(|e| e.axes[2].rate_filtered - true_rate(motion, e)));
            let normalised =
                rms(late.iter().map(|e| (e.axes[2].rate_filtered - true_rate(motion, e)) / e.axes[2].rate_std));
            assert!(filtered < rate, "{name} at {rate_hz} Hz: {filtered} of {rate}");
            // Without a reference nothing says that the zero is still the model's.
            let least = if reference { 0.85 } else { 0.0 };
            assert!((least..1.15).contains(&normalised), "{name} at {rate_hz} Hz, {reference}: {normalised}");
        }
    }
}

#[test]
fn the_lag_that_is_reported_is_the_lag_that_is_there() {
    for (motion, rate_hz) in [(multisine as Motion, 1000), (sine, 1000), (drive, 200)] {
        let rows = without_reference(&rows(motion, rate_hz, 20, (1.0, 0.0, 0.0), 3));
        let estimates = run(Options::default(), &model(1.0, 0.0), &rows);
        let late = &estimates[rate_hz as usize..];
        // ω_f(t) = ω(t) − lag · a(t): least squares of the error on the true acceleration.
        let (mut sum, mut squares, mut lag) = (0.0, 0.0, 0.0);
        for e in late {
            let t = e.valid_t_ns as f64 * 1e-9;
            let acceleration = (motion(t + 1e-4).1 - motion(t - 1e-4).1) / 2e-4;
            sum -= (e.axes[2].rate_filtered - motion(t).1) * acceleration;
            squares += acceleration * acceleration;
            lag += e.axes[2].lag / late.len() as f64;
        }
        let sigma = rms(late.iter().map(|e| e.axes[2].rate_std)) * 4.0 / squares.sqrt();
        let measured = sum / squares;
        assert!((measured - lag).abs() < sigma + 0.5 * lag, "{lag} reported, {measured} ± {sigma} there");
    }
}

#[test]
fn innovations_of_white_noise_follow_the_chi_square_law() {
    // A motion that the filter's own law makes, gyro and encoder noise white and not quantised.
    let (rate_hz, jerk, n) = (100, 40.0_f64, 12_000);
    let dt = 1.0 / f64::from(rate_hz);
    let mut normal = Normal::new(11);
    let (mut angle, mut rate, mut acceleration) = (0.0, 0.0, 0.0);
    let rows: Vec<Row> = (0..n)
        .map(|k| {
            let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
            row.gyro[2] = rate + N / dt.sqrt() * normal.draw();
            row.ref_angle[2] = angle + ENCODER * normal.draw();
            // White jerk, exactly: θ, ω, a of one step from three independent numbers (Cholesky of Q).
            let (a, b, c) = (normal.draw(), normal.draw(), normal.draw());
            let q = jerk.sqrt();
            let da = q * dt.sqrt() * a;
            let dw = q * dt.powf(1.5) * (0.5 * a + b / 12.0_f64.sqrt());
            let dq = q * dt.powf(2.5) * (a / 6.0 + b / (4.0 * 3.0_f64.sqrt()) + c / (12.0 * 5.0_f64.sqrt()));
            angle += dt * rate + 0.5 * dt * dt * acceleration + dq;
            rate += dt * acceleration + dw;
            acceleration += da;
            row
        })
        .collect();
    let options = Options { jerk: Jerk::Fixed(jerk), ..Options::default() };
    let mut model = model(1.0, 0.0);
    let punctual = Term { effect: &DELAY, values: vec![0.0], std_errors: vec![0.0] };
    model.axes[2].as_mut().unwrap().terms.push(punctual);
    let estimates = run(options, &model, &rows);
    let gyro: Vec<f64> = estimates[100..].iter().map(|e| e.axes[2].nis).collect();
    let sum: f64 = gyro.iter().sum();
    assert!(chi_square_band(gyro.len()).contains(&sum), "{sum} for {}", gyro.len());
    // The shape too: counts between the quartiles of χ²(1), a χ² of three degrees of freedom.
    let law = ChiSquared::new(1.0).unwrap();
    let mut counts = [0.0; 4];
    for v in &gyro {
        counts[((law.cdf(*v) * 4.0) as usize).min(3)] += 1.0;
    }
    let expected = gyro.len() as f64 / 4.0;
    let distance: f64 = counts.iter().map(|c| (c - expected).powi(2) / expected).sum();
    assert!(distance < ChiSquared::new(3.0).unwrap().inverse_cdf(1.0 - 1e-4), "{counts:?}");
    never_sure_of_too_much(&estimates[100..]);
}

/// A reference's noise is bounded from above until its readings show how much they have.
fn never_sure_of_too_much(estimates: &[Estimate]) {
    let axes = estimates.iter().map(|e| e.axes[2]).filter(|axis| axis.reference_innovation.is_finite());
    let nis: Vec<f64> = axes.map(|axis| (axis.reference_innovation / axis.reference_innovation_std).powi(2)).collect();
    let sum: f64 = nis.iter().sum();
    assert!(!nis.is_empty() && sum < chi_square_band(nis.len()).end, "{sum} for {}", nis.len());
}

#[test]
fn with_an_identified_jerk_the_innovations_keep_their_size() {
    let rows = rows(sine, 1000, 20, (1.0, 0.0, 0.0), 5);
    let estimates = run(Options::default(), &model(1.0, 0.0), &rows);
    let mean = estimates[1000..].iter().map(|e| e.axes[2].nis).sum::<f64>() / 19_000.0;
    assert!((0.9..1.1).contains(&mean), "{mean}");
}

#[test]
fn beside_a_late_reference_an_estimate_keeps_the_gyros_time() {
    let late = 0.0123;
    let rows = rows(sine, 200, 20, (1.1, -0.2, -late), 9);
    let mut model = model(1.1, -0.2);
    let axis = model.axes[2].as_mut().unwrap();
    axis.terms.push(Term { effect: &DELAY, values: vec![-late], std_errors: vec![0.0] });
    let estimates = run(Options::default(), &model, &rows);
    for (e, row) in estimates.iter().zip(&rows) {
        assert_eq!((e.valid_t_ns, e.reference_t_ns), (row.t_ns, row.t_ns + 12_300_000));
    }
    // The gyro reads at t what the reference says 12.3 ms later.
    let truth = |e: &Estimate| sine(e.valid_t_ns as f64 * 1e-9 + late);
    let known = &estimates[200..];
    assert!(rms(known.iter().map(|e| e.axes[2].rate - truth(e).1)) < 1.2 * N * 200.0_f64.sqrt());
    assert!(rms(known.iter().map(|e| e.axes[2].angle_fused - truth(e).0)) < ENCODER);
}

#[test]
fn a_late_gyro_is_restamped_and_its_reference_waits() {
    let delay = 0.0123;
    let rows = rows(sine, 200, 60, (1.1, -0.2, delay), 9);
    let mut model = model(1.1, -0.2);
    let axis = model.axes[2].as_mut().unwrap();
    axis.terms.push(Term { effect: &DELAY, values: vec![delay], std_errors: vec![0.0] });
    let estimates = run(Options::default(), &model, &rows);
    for (e, row) in estimates.iter().zip(&rows) {
        assert_eq!(e.valid_t_ns, row.t_ns - 12_300_000);
    }
    let late = &estimates[200..];
    let truth = |e: &Estimate| sine(e.valid_t_ns as f64 * 1e-9);
    assert!(rms(late.iter().map(|e| e.axes[2].rate - truth(e).1)) < 1.2 * N * 200.0_f64.sqrt());
    assert!(rms(late.iter().map(|e| e.axes[2].angle_fused - truth(e).0)) < ENCODER);
    never_sure_of_too_much(late);
}

#[test]
fn the_open_loop_angle_starts_at_the_first_reference_and_never_sees_another() {
    let all = rows(multisine, 200, 10, (1.0, 0.0, 0.0), 2);
    let once: Vec<Row> =
        all.iter().enumerate().map(|(k, r)| if k == 300 { *r } else { without_reference(&[*r])[0] }).collect();
    let a = run(Options::default(), &model(1.0, 0.0), &once);
    assert!(a[299].axes[2].angle.is_nan());
    assert_eq!(a[300].axes[2].angle, once[300].ref_angle[2]);
    for e in &a[300..] {
        let seconds = (e.valid_t_ns - once[300].t_ns) as f64 * 1e-9;
        let drift = e.axes[2].angle - multisine(e.valid_t_ns as f64 * 1e-9).0;
        // Encoder noise of the start, angle random walk since: 5 standard deviations.
        assert!(drift.abs() < 5.0 * (ENCODER.powi(2) + N * N * seconds).sqrt() + 1e-4, "{drift} after {seconds} s");
    }
    let mut more = once.clone();
    more[900].ref_angle[2] = 0.5;
    let b = run(Options::default(), &model(1.0, 0.0), &more);
    for (a, b) in a.iter().zip(&b) {
        assert_eq!(a.axes[2].angle.to_bits(), b.axes[2].angle.to_bits());
    }
}

#[test]
fn an_encoder_is_not_believed_while_the_shaft_turns_in_its_clearance() {
    let (b, rate_hz, drift) = (0.02, 200, 1e-3);
    let mut memory = Memory::default();
    let mut rows = rows(drive, rate_hz, 60, (1.0, 0.0, 0.0), 5);
    for row in &mut rows {
        let angle = drive(row.t_ns as f64 * 1e-9).0;
        row.ref_angle[2] += ENCODER_BACKLASH.error(&[b], &Signals { angle, ..Signals::default() }, &mut memory);
        // What no model knows of yet, and the filter finds out by the encoder.
        row.gyro[2] += drift;
    }
    let mut model = model(1.0, 0.0);
    let mut play = Term::neutral(&ENCODER_BACKLASH, Axis::Z);
    play.values[0] = b;
    let axis = model.axes[2].as_mut().unwrap();
    axis.terms.push(play);
    axis.noise.bias_random_walk = 1e-4;
    let estimates = run(Options::default(), &model, &rows);
    let late = &estimates[10 * rate_hz as usize..];
    let off = rms(late.iter().map(|e| e.axes[2].angle_fused - drive(e.valid_t_ns as f64 * 1e-9).0));
    assert!(off < 2.0 * ENCODER, "{off}");
}

#[test]
fn a_wrapped_encoder_and_one_that_counts_on_give_the_same_estimates() {
    let turning: Motion = |t| (3.0 * t, 3.0);
    let through = rows(turning, 100, 20, (1.0, 0.0, 0.0), 2);
    let wrapped: Vec<Row> = through
        .iter()
        .map(|r| Row {
            ref_angle: r.ref_angle.map(|a| (a + std::f64::consts::PI).rem_euclid(TAU) - std::f64::consts::PI),
            ..*r
        })
        .collect();
    let (a, b) =
        (run(Options::default(), &model(1.0, 0.0), &through), run(Options::default(), &model(1.0, 0.0), &wrapped));
    for (a, b) in a.iter().zip(&b) {
        let apart = (a.axes[2].angle_fused - b.axes[2].angle_fused).abs();
        assert!(apart < 5e-9, "{apart} at {} ns", a.valid_t_ns);
    }
}

#[test]
fn a_step_of_the_signal_does_not_lock_the_filter_out_and_a_spike_does_not_get_in() {
    let mut rows = rows(|t| if t < 90.0 { (0.0, 0.0) } else { (5.0 * (t - 90.0), 5.0) }, 100, 120, (1.0, 0.0, 0.0), 4);
    rows[7000].gyro[2] += 20.0;
    let estimates = run(Options::default(), &model(1.0, 0.0), &rows);
    assert!(estimates[7000].axes[2].flags & flags::OUTLIER != 0);
    assert!(estimates[7000].axes[2].rate_filtered.abs() < 0.01);
    for e in &estimates[9005..] {
        let off = (e.axes[2].rate_filtered - 5.0).abs();
        assert!(off < 3.0 * e.axes[2].rate_std && e.axes[2].rate_std < 0.06, "{off} ± {}", e.axes[2].rate_std);
    }
}

/// A swing so slow that its acceleration hardly shows in the readings.
fn swing(t: f64) -> (f64, f64) {
    let w = TAU * 0.02;
    (0.5 / w * (1.0 - (w * t).cos()), 0.5 * (w * t).sin())
}

/// A reference without error, which pins the rate down, is away for a while: the first angle after it is not where it was expected.
#[test]
fn a_sharp_reference_that_was_away_does_not_lock_the_filter_out() {
    for away_ms in [0_u32, 20, 100, 300, 450, 700, 1500] {
        let mut model = model(1.0, 0.0);
        model.axes[2].as_mut().unwrap().noise =
            Noise { angle_random_walk: 7.6e-6, bias_random_walk: 1e-18, encoder: 2e-8, ..Noise::default() };
        let mut normal = Normal::new(u64::from(away_ms));
        let all: Vec<Row> = (0..40_000_i64)
            .filter(|k| !(12_000..12_000 + i64::from(away_ms)).contains(k))
            .map(|k| {
                let (angle, rate) = swing(k as f64 * 1e-3);
                let mut row = Row { t_ns: k * 1_000_000, ..Row::EMPTY };
                row.gyro[2] = rate + 4e-3 * ((k as f64 * 0.618_033_988_75).fract() - 0.5);
                row.ref_angle[2] = angle + 1e-9 * normal.draw();
                row
            })
            .collect();
        let estimates = run(Options::default(), &model, &all);
        for (k, e) in estimates.iter().enumerate().skip(3000) {
            let off = (e.axes[2].rate_filtered - true_rate(swing, e)).abs();
            assert!(off < 6e-3, "{away_ms} ms away, {k}: off by {off}, {:?}", e.axes[2]);
        }
    }
}

/// A model that is wrong and certain of itself: the reference tells the bias all the same.
#[test]
fn a_reference_corrects_a_bias_that_the_model_is_wrongly_certain_of() {
    let with_angle = rows(multisine, 100, 30, (1.0, 0.05, 0.0), 5);
    let with_rate: Vec<Row> = with_angle
        .iter()
        .map(|row| {
            let mut row = Row { ref_angle: [f64::NAN; 3], ..*row };
            row.ref_rate[2] = multisine(row.t_ns as f64 * 1e-9).1;
            row
        })
        .collect();
    let mut sharp = model(1.0, 0.0);
    sharp.axes[2].as_mut().unwrap().noise.encoder = 1e-7;
    for (name, model, rows) in [("angle", &sharp, &with_angle), ("rate", &model(1.0, 0.0), &with_rate)] {
        let mut rows = rows.clone();
        if name == "angle" {
            for row in &mut rows {
                row.ref_angle[2] = multisine(row.t_ns as f64 * 1e-9).0;
            }
        }
        let estimates = run(Options::default(), model, &rows);
        let off = rms(estimates[500..].iter().map(|e| e.axes[2].rate_filtered - true_rate(multisine, e)));
        assert!(off < 2e-3, "{name}: off by {off}");
    }
}

#[test]
fn an_orientation_serves_three_axes() {
    use nalgebra::{UnitQuaternion, Vector3};
    let (rate_hz, bias) = (250.0, [0.02, -0.03, 0.01]);
    let mut normal = Normal::new(8);
    let mut attitude = UnitQuaternion::identity();
    let omega = |t: f64| Vector3::new(3.0 * (2.1 * t).sin(), 2.0 * (3.3 * t).cos(), 4.0 * (1.3 * t + 1.0).sin());
    let mut rows = Vec::new();
    for k in 0..(rate_hz as i64 * 40) {
        let t = k as f64 / rate_hz;
        let mut row = Row { t_ns: (t * 1e9).round() as i64, ..Row::EMPTY };
        for (i, bias) in bias.iter().enumerate() {
            row.gyro[i] = omega(t)[i] + bias + N * f64::sqrt(rate_hz) * normal.draw();
        }
        let noise = Vector3::from_fn(|_, _| ENCODER * normal.draw());
        let q = attitude * UnitQuaternion::from_scaled_axis(noise);
        row.ref_quaternion = [q.w, q.i, q.j, q.k];
        rows.push(row);
        for s in 0..20 {
            let middle = t + (f64::from(s) + 0.5) / (20.0 * rate_hz);
            attitude *= UnitQuaternion::from_scaled_axis(omega(middle) / (20.0 * rate_hz));
        }
    }
    let mut model = model(1.0, 0.0);
    let axis = model.axes[2].clone().unwrap();
    model.axes = std::array::from_fn(|_| {
        let mut axis = axis.clone();
        axis.terms[1].std_errors = vec![0.05];
        axis.terms.push(Term { effect: &DELAY, values: vec![0.0], std_errors: vec![0.0] });
        Some(axis)
    });
    let estimates = run(Options::default(), &model, &rows);
    let last = estimates.last().unwrap();
    for (i, bias) in bias.iter().enumerate() {
        assert!((last.axes[i].bias - bias).abs() < 1e-3, "axis {i}: {} for {bias}", last.axes[i].bias);
        let late = &estimates[5000..];
        let nis: f64 =
            late.iter().map(|e| (e.axes[i].reference_innovation / e.axes[i].reference_innovation_std).powi(2)).sum();
        assert!((0.9..1.1).contains(&(nis / late.len() as f64)), "axis {i}: {}", nis / late.len() as f64);
        let worst = late.iter().map(|e| e.axes[i].rate_filtered - omega(e.valid_t_ns as f64 * 1e-9)[i]);
        assert!(rms(worst) < N * f64::sqrt(rate_hz));
    }
}

#[test]
fn another_model_makes_no_bump_but_its_own_step() {
    let rows = rows(sine, 200, 20, (1.1, -0.2, 0.0), 6);
    let rows = without_reference(&rows);
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model(1.0, 0.0));
    let mut last = Estimate { valid_t_ns: 0, reference_t_ns: 0, epoch: 0, axes: [AxisEstimate::ABSENT; 3] };
    for row in &rows[..2000] {
        last = estimator.step(row);
    }
    assert_eq!(last.epoch, 1);
    estimator.set_model(&Model { epoch: 2, ..model(1.1, -0.2) });
    for row in &rows[2000..] {
        let e = estimator.step(row);
        assert_eq!(e.epoch, 2);
        let error = e.axes[2].rate_filtered - true_rate(sine, &e);
        assert!(error.abs() < 6.0 * e.axes[2].rate_std.max(1e-3), "{error} at {}", e.valid_t_ns);
    }
}

#[test]
fn the_same_model_again_makes_no_bump_at_all() {
    let rows = rows(drive, 200, 20, (1.1, -0.2, 0.0), 6);
    let mut model = model(1.1, -0.2);
    let play = find("rate-hysteresis").unwrap();
    model.axes[2].as_mut().unwrap().terms.push(Term { effect: play, values: vec![0.01], std_errors: vec![0.0] });
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model);
    for row in &rows {
        let angles = estimator.angles();
        let steps = estimator.compensation.set_model(&model, angles);
        assert!(steps.iter().all(|step| step.abs() < 1e-12), "{steps:?} at {}", row.t_ns);
        estimator.step(row);
    }
}

#[test]
fn what_effects_remember_is_restored_to_them_though_the_model_has_changed() {
    let rows = rows(drive, 200, 20, (1.1, -0.2, 0.0), 6);
    let with = |ids: &[(&str, f64)]| {
        let mut model = model(1.1, -0.2);
        let term =
            |&(id, size): &(&str, f64)| Term { effect: find(id).unwrap(), values: vec![size], std_errors: vec![0.0] };
        model.axes[2].as_mut().unwrap().terms.extend(ids.iter().map(term));
        model
    };
    let (old, new) = (with(&[("rate-hysteresis", 0.1)]), with(&[("lag", 1e-5), ("rate-hysteresis", 0.1)]));
    let mut running = Estimator::new(Options::default());
    running.set_model(&old);
    for row in &rows[..2050] {
        running.step(row);
    }
    let mut restored = Estimator::new(Options::default());
    restored.set_model(&new);
    restored.restore(&running.save());
    running.set_model(&new);
    for row in &rows[2050..2060] {
        let (a, b) = (running.step(row).axes[2].rate, restored.step(row).axes[2].rate);
        assert!((a - b).abs() < 5e-3, "{a} and {b}");
    }
}

#[test]
fn one_corrupt_reading_of_an_encoder_that_wraps_does_not_end_its_unwrapping() {
    let mut rows = rows(|t| (t + 1.0, 1.0), 100, 60, (1.0, 0.0, 0.0), 6);
    for row in &mut rows {
        row.ref_angle[2] = row.ref_angle[2].rem_euclid(TAU);
    }
    rows[1500].ref_angle[2] = 40.0;
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model(1.0, 0.0));
    for row in &rows {
        let t = row.t_ns as f64 * 1e-9;
        let off = estimator.step(row).axes[2].angle_fused - (t + 1.0);
        assert!(off.abs() < 0.1, "{off} at {t}");
    }
}

#[test]
fn an_encoder_that_counts_its_turns_may_be_away_for_some() {
    let mut rows = rows(|t| (t, 1.0), 100, 60, (1.0, 0.0, 0.0), 6);
    rows.drain(2000..4000);
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model(1.0, 0.0));
    let last = rows.iter().map(|row| estimator.step(row).axes[2].angle_fused).last();
    assert!((last.unwrap() - 59.99).abs() < 0.1, "{last:?}");
}

#[test]
fn a_delay_of_one_axis_does_not_turn_another() {
    let mut rows = rows(drive, 200, 20, (1.0, 0.0, 0.0), 6);
    let mut normal = Normal::new(3);
    for row in &mut rows {
        (row.gyro[0], row.ref_angle[0]) = (1.0, row.t_ns as f64 * 1e-9 + ENCODER * normal.draw());
    }
    let mut model = model(1.0, 0.0);
    model.axes[0] = model.axes[2].clone();
    let mut late = model.clone();
    late.axes[2].as_mut().unwrap().terms.push(Term { effect: &DELAY, values: vec![0.1], std_errors: vec![0.0] });
    let mut estimator = Estimator::new(Options { fuse_reference: false, ..Options::default() });
    estimator.set_model(&model);
    let mut off = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        if k == 2000 {
            estimator.set_model(&late);
        }
        let estimate = estimator.step(row);
        let truth = estimate.valid_t_ns as f64 * 1e-9;
        off.push([estimate.axes[0].angle - truth, estimate.axes[0].angle_fused - truth]);
    }
    for (before, after) in off[1990].iter().zip(&off[2100]) {
        assert!((before - after).abs() < 2e-3, "{before} before, {after} after");
    }
}

#[test]
fn a_new_delay_moves_the_time_of_validity_but_not_the_angle() {
    let rows = rows(sine, 200, 20, (1.0, 0.0, 0.05), 6);
    let mut late = model(1.0, 0.0);
    late.epoch = 2;
    late.axes[2].as_mut().unwrap().terms.push(Term { effect: &DELAY, values: vec![0.05], std_errors: vec![0.0] });
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model(1.0, 0.0));
    let mut before = None;
    for row in &rows[..2000] {
        before = Some(estimator.step(row));
    }
    estimator.set_model(&late);
    let (before, after) = (before.unwrap(), estimator.step(&rows[2000]));
    assert_eq!(after.valid_t_ns, rows[2000].t_ns - 50_000_000);
    let moved = after.axes[2].angle - before.axes[2].angle;
    assert!((moved - after.axes[2].rate * 0.005).abs() < 1e-3, "{moved}");
    for row in &rows[2001..] {
        let e = estimator.step(row);
        if e.valid_t_ns > 10_500_000_000 {
            let truth = sine(e.valid_t_ns as f64 * 1e-9);
            assert!((e.axes[2].angle_fused - truth.0).abs() < 6.0 * ENCODER);
        }
    }
}

#[test]
fn a_restored_estimator_goes_on_where_the_saved_one_was() {
    let mut model = model(1.1, -0.2);
    model.axes[2].as_mut().unwrap().terms.push(Term::neutral(&TEMPERATURE_BIAS, Axis::Z));
    let rows = rows(multisine, 200, 20, (1.1, -0.2, 0.0), 6);
    let mut first = Estimator::new(Options::default());
    first.set_model(&model);
    for row in &rows[..2000] {
        first.step(row);
    }
    let mut second = Estimator::new(Options::default());
    second.set_model(&model);
    second.restore(&first.save());
    for row in &rows[2000..] {
        let (a, b) = (first.step(row).axes[2], second.step(row).axes[2]);
        assert!((a.rate_filtered - b.rate_filtered).abs() < 1e-6, "{} {}", a.rate_filtered, b.rate_filtered);
        assert!((a.angle - b.angle).abs() < 1e-5, "{} {}", a.angle, b.angle);
        assert!((a.angle_fused - b.angle_fused).abs() < 1e-5);
    }
}

#[test]
fn the_first_estimate_knows_no_more_than_its_reading_says() {
    let model = model(0.98, 0.02);
    let rows = rows(multisine, 100, 2, (0.98, 0.02, 0.0), 3);
    let first = run(Options::default(), &model, &rows)[0].axes[2];
    assert!(first.rate_std >= N / f64::sqrt(0.01), "{}", first.rate_std);
    // At rest in a dead zone a reading of zero says nothing.
    let mut dead = model.clone();
    let zone = find("dead-zone").unwrap();
    let term = Term { effect: zone, values: vec![0.03], std_errors: vec![0.0] };
    dead.axes[2].as_mut().unwrap().terms.push(term);
    let rest: Vec<Row> = rows.iter().map(|row| Row { gyro: [f64::NAN, f64::NAN, 0.0], ..*row }).collect();
    let estimates = run(Options::default(), &dead, &rest);
    assert!(estimates.iter().all(|e| e.axes[2].rate_std > 0.03), "{:?}", estimates[0].axes[2]);
}

#[test]
fn without_new_readings_the_uncertainty_grows() {
    let rows = rows(sine, 200, 5, (1.0, 0.0, 0.0), 6);
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model(1.0, 0.0));
    for row in &rows {
        estimator.step(row);
    }
    let t = rows.last().unwrap().t_ns;
    let stds: Vec<f64> =
        [1, 10, 100, 2000].iter().map(|ms| estimator.coast(t + ms * 1_000_000).axes[2].rate_std).collect();
    assert!(stds.windows(2).all(|w| w[1] > w[0]), "{stds:?}");
}

#[test]
fn the_papers_gains_give_the_papers_filter() {
    for (gain, m) in [(Gain::PaperRiccati, Gain::PaperRiccati.observer()), (Gain::PaperPrinted, Some([-2.132, 0.2373]))]
    {
        assert_eq!(gain.observer(), m);
        let rows = rows(sine, 100, 60, (1.0, 0.0, 0.0), 6);
        let estimates = run(Options { gain, ..Options::default() }, &model(1.0, 0.0), &rows);
        let amplitude = estimates[4000..].iter().map(|e| e.axes[2].angle_fused.abs()).fold(0.0, f64::max);
        let expected = 2.618 * observer::Observer::response(m.unwrap(), 0.25).0;
        assert!((amplitude / expected - 1.0).abs() < 0.05, "{amplitude} {expected}");
    }
}

/// Anything that may stand in a row.
fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0_f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => any::<f64>(),
    ]
}

proptest! {
    #[test]
    fn no_state_becomes_non_finite_whatever_is_read(
        values in prop::collection::vec((prop::collection::vec(anything(), 18), -5_i64..400), 1..120),
        huge in any::<i64>(),
        swap in 0_usize..120,
    ) {
        let mut estimator = Estimator::new(Options::default());
        estimator.set_model(&model(1.1, -0.2));
        let mut t_ns = 0_i64;
        for (k, (v, step)) in values.iter().enumerate() {
            t_ns += step * 100_000;
            if k == swap {
                let mut other = model(0.5, 0.3);
                other.axes[2].as_mut().unwrap().terms.push(Term { effect: &DELAY, values: vec![0.1], std_errors: vec![0.0] });
                estimator.set_model(&other);
            }
            let row = Row {
                t_ns: if k == 100 { huge } else { t_ns },
                gyro: [v[0], v[1], v[2]],
                ref_angle: [v[3], v[4], v[5]],
                ref_rate: [v[6], v[7], v[8]],
                ref_quaternion: [v[9], v[10], v[11], v[12]],
                accel: [v[13], v[14], v[15]],
                temperature: v[16],
                supply: v[17],
                ..Row::EMPTY
            };
            estimator.step(&row);
        }
        // A good row afterwards gives a good estimate.
        let last = estimator.t_ns.saturating_add(10_000_000);
        prop_assume!(last < i64::MAX);
        let mut estimate = estimator.last;
        for k in 0..400 {
            let row = Row { t_ns: last.saturating_add(k * 10_000_000), gyro: [0.1; 3], ..Row::EMPTY };
            estimate = estimator.step(&row);
        }
        for axis in estimate.axes {
            prop_assert!(axis.rate.is_finite() && axis.rate_filtered.is_finite() && axis.rate_std.is_finite());
            prop_assert!(axis.rate_std >= 0.0);
        }
    }
}

/// A filter that makes up for a wrong model by its bias goes on under the right one, which came while the process was dead.
#[test]
fn a_snapshot_of_another_model_goes_on_without_a_bump() {
    let model = |delta: f64, epoch: u64| {
        let mut axis = AxisModel::base(Axis::Z);
        (axis.terms[1].values[0], axis.terms[1].std_errors[0]) = (delta, 0.02);
        axis.terms[0].std_errors[0] = 1e-4;
        axis.noise.encoder = 1e-5;
        let mut model = Model { epoch, ..Model::default() };
        model.axes[Axis::Z.index()] = Some(axis);
        model
    };
    let rate = |ms: i64| 0.5 * (0.1256 * ms as f64 * 1e-3).sin();
    let row = |ms: i64| {
        let mut row = Row { t_ns: ms * 1_000_000, ..Row::EMPTY };
        (row.gyro[2], row.ref_angle[2]) = (rate(ms) - 0.05, -0.5 / 0.1256 * (0.1256 * ms as f64 * 1e-3).cos());
        row
    };
    let mut before = Estimator::new(Options::default());
    before.set_model(&model(-0.03, 1));
    for ms in 0..8000 {
        before.step(&row(ms));
    }
    let worst = |epoch: u64, delta: f64| {
        let mut after = Estimator::new(Options::default());
        after.set_model(&model(delta, epoch));
        after.restore(&before.save());
        let off = (8050..8060).map(|ms| (after.step(&row(ms)).axes[2].rate_filtered - rate(ms)).abs());
        off.fold(0.0, f64::max)
    };
    assert!(worst(1, -0.03) < 2e-3, "{}", worst(1, -0.03));
    assert!(worst(2, 0.05) < 2e-3, "{}", worst(2, 0.05));
}

#[test]
fn the_first_reading_after_a_hole_counts() {
    let slow: Motion = |t| (4.0 * (1.0 - (0.125 * t).cos()), 0.5 * (0.125 * t).sin());
    for (ms, seed) in [25, 100, 370, 490].into_iter().cartesian_product(0..8) {
        let mut rows = rows(slow, 1000, 4, (1.0, 0.0, 0.0), seed);
        // The vehicle turned meanwhile, more sharply than such a motion does.
        rows.iter_mut().skip(3000).for_each(|row| row.gyro[2] += 0.4);
        let slow = |t: f64| (slow(t).0, slow(t).1 + if t < 3.0 { 0.0 } else { 0.4 });
        rows.drain(3000..3000 + ms);
        let estimates = run(Options { fuse_reference: false, ..Options::default() }, &model(1.0, 0.0), &rows);
        for estimate in &estimates[3000..3010] {
            let off = (estimate.axes[2].rate_filtered - slow(estimate.valid_t_ns as f64 * 1e-9).1).abs();
            assert!(off < 0.02, "{ms} ms, seed {seed}: {off} {:?}", estimate.axes[2]);
        }
    }
}
