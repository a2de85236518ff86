//! The experiment of the paper behind this project, simulated: its rig, its filter, its compensator.
//!
//! *Parameter Compensation and Noise Reduction of Low-cost Gyroscope* (Saraporn, Pranarak, Srisertpol, Teecha) turns a
//! gyro to and fro by a 0.25 Hz sine about X within ±150° and estimates
//!
//! ```text
//! ω_g = (θ̇ − δ)/α + v_g                                       (1)
//! minimise f(α, δ) = Σᵢ (θ_e(tᵢ) − θ̂_g(tᵢ))²                  (11)(12)
//! ```
//!
//! with the result α = 2.156, δ = −6.658, no unit printed. We read δ in °/s: −δ/α is then a reading at rest of 3.1 °/s,
//! as low-cost gyros have; in rad/s it would be 177 °/s, three quarters of the rig's own peak rate.
//!
//! **The sound way**: θ̂_g = θ_e(t₀) + α∫ω_g dt + δ (t − t₀), the integral of the reading itself. The residual is then a
//! random walk (gyro noise, integrated) and white encoder noise, so that the standard errors are not those of (JᵀJ)⁻¹
//! but of the sandwich (JᵀJ)⁻¹ JᵀΣJ (JᵀJ)⁻¹ with Σ = N² min(tᵢ, tⱼ) + σ_e² (δᵢⱼ + 1).
//!
//! **The printed way**: θ̂_g out of the observer (9). That leaves out its input θ̇, so it follows the angle through a
//! tracker of about the sine's own frequency, and least squares takes the tracker's gain and phase for a scale factor.

use crate::{
    Axis, AxisModel, Model, Noise, Record,
    estimator::{Estimator, Gain, Options as EstimatorOptions},
    nls::{self, Normal},
    observer::{Observer, PAPER_Q, PAPER_S, PRINTED_GAIN, riccati_gain},
    simulate::{Motion, Reference, Scenario, SensorSpec, simulate},
};

/// α as printed.
pub const ALPHA: f64 = 2.156;
/// δ as printed, in the unit that makes sense of it, °/s.
pub const DELTA_DEGREES: f64 = -6.658;
/// Frequency of the rig's sine, Hz.
pub const FREQUENCY: f64 = 0.25;
/// Its amplitude: the servo's limits, rad.
pub const AMPLITUDE: f64 = 150.0 / 180.0 * std::f64::consts::PI;
/// Length of the simulated run, s (fifteen periods).
pub const SECONDS: f64 = 60.0;
/// Rows a second.
pub const RATE_HZ: f64 = 100.0;
/// White noise of the simulated gyro's reading, one-sided, °/s/√Hz: an analogue part of the paper's time.
pub const NOISE_DENSITY_DEGREES: f64 = 0.03;
/// Counts a turn of the simulated encoder.
pub const ENCODER_COUNTS: u32 = 4096;
/// The printed way is judged from here on, s: its observer with the printed gain swings in with a time constant of 8 s.
pub const SETTLED: f64 = 40.0;
/// Where least squares starts: the paper does not say.
pub const START: [f64; 2] = [1.0, 0.0];

/// One instant of the run; rad, rad/s, s.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Time.
    pub t: f64,
    /// Encoder.
    pub encoder_angle: f64,
    /// Its slope over eleven rows.
    pub encoder_rate: f64,
    /// Gyro reading.
    pub gyro: f64,
    /// ∫ reading, from the first encoder angle on.
    pub gyro_angle: f64,
    /// The reading through the Kalman filter, neither scaled nor shifted.
    pub filtered_rate: f64,
    /// Its angle.
    pub filtered_angle: f64,
    /// θ̂_g of the paper's observer with the Riccati gain, and with the printed gain.
    pub observed_angle: [f64; 2],
    /// dθ̂_g/dt of the same.
    pub observed_rate: [f64; 2],
    /// Compensated with the α and δ that were found: rate.
    pub compensated_rate: f64,
    /// The same through the Kalman filter.
    pub compensated_filtered_rate: f64,
    /// ∫ compensated rate, open loop.
    pub compensated_angle: f64,
}

/// One iteration of least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// α.
    pub alpha: f64,
    /// δ, rad/s.
    pub delta: f64,
    /// √(f/n), rad.
    pub rms: f64,
}

/// What least squares found.
#[derive(Clone, Debug)]
pub struct Found {
    /// α.
    pub alpha: f64,
    /// δ, rad/s.
    pub delta: f64,
    /// Standard error of α; `NaN` where the residual is no noise.
    pub alpha_std: f64,
    /// Standard error of δ, rad/s; `NaN` where the residual is no noise.
    pub delta_std: f64,
    /// The way there.
    pub iterations: Vec<Iteration>,
}

/// A gain of the observer and what comes of it.
#[derive(Clone, Debug)]
pub struct PrintedWay {
    /// M of equation (9).
    pub gain: [f64; 2],
    /// Gain of θ̂_g/θ_g at the sine's frequency.
    pub amplitude: f64,
    /// Its phase, rad.
    pub phase: f64,
    /// Least squares of the encoder on θ̂_g.
    pub found: Found,
    /// The same with the encoder through the same observer.
    pub found_both_filtered: Found,
}

/// Everything that the paper reports, reproduced.
#[derive(Clone, Debug)]
pub struct Reproduction {
    /// The run.
    pub points: Vec<Point>,
    /// The sound way.
    pub found: Found,
    /// Identified noise of the compensated rate and the encoder.
    pub noise: Noise,
    /// The printed way, with the Riccati gain and with the printed one.
    pub printed_way: [PrintedWay; 2],
    /// E(10 s), open loop, of the uncompensated reading, rad/s.
    pub error_before: f64,
    /// E(10 s), open loop, of the compensated rate, rad/s.
    pub error_after: f64,
}

/// The rig as a scenario of the simulator.
#[must_use]
pub fn rig(seed: u64) -> Scenario {
    Scenario {
        motion: Motion::Sine { amplitude: AMPLITUDE, frequency: FREQUENCY },
        seconds: SECONDS,
        rate_hz: RATE_HZ,
        seed,
        hidden: Vec::new(),
        sensor: SensorSpec {
            axis: Axis::X,
            alpha: ALPHA,
            delta: DELTA_DEGREES.to_radians(),
            noise_density: NOISE_DENSITY_DEGREES.to_radians(),
            bias_random_walk: 0.0,
            quantum: 0.0,
            reference: Reference::Encoder(ENCODER_COUNTS),
            ..SensorSpec::default()
        },
    }
}

/// Runs the experiment with this draw of the noise.
#[must_use]
pub fn reproduce(seed: u64) -> Reproduction {
    let record = simulate(&rig(seed)).record;
    let t: Vec<f64> = record.rows.iter().map(|row| row.t_ns as f64 * 1e-9).collect();
    let encoder: Vec<f64> = record.rows.iter().map(|row| row.ref_angle[0]).collect();
    let gyro: Vec<f64> = record.rows.iter().map(|row| row.gyro[0]).collect();

    // α = 1, δ = 0: the estimator's open-loop angle is ∫ω_g dt from the first encoder angle on.
    let raw = estimate(&record, START, Noise::default(), Gain::Kalman);
    let gyro_angle: Vec<f64> = raw.iter().map(|e| e.angle).collect();
    let dt = 1.0 / RATE_HZ;
    let noise_of_reading = white_variance(&gyro) * dt;
    let encoder_std = white_variance(&encoder).sqrt();

    let mut found = least_squares(&t, &encoder, &gyro_angle, 0.0);
    let n = found.alpha.abs() * noise_of_reading.sqrt();
    (found.alpha_std, found.delta_std) = standard_errors(&t, &gyro_angle, n, encoder_std);
    let noise = Noise { angle_random_walk: n, bias_random_walk: 0.0, encoder: encoder_std, unexplained: 0.0 };

    let gains = [(Gain::PaperRiccati, riccati_gain(PAPER_Q, PAPER_S)), (Gain::PaperPrinted, PRINTED_GAIN)];
    let observed = gains.map(|(gain, _)| estimate(&record, START, Noise::default(), gain));
    let printed_way = std::array::from_fn(|k| {
        let gain = gains[k].1;
        let angle: Vec<f64> = observed[k].iter().map(|e| e.filtered_angle + encoder[0]).collect();
        let (amplitude, phase) = Observer::response(gain, FREQUENCY);
        let (both_encoder, both_gyro) = (observe(gain, &t, &encoder), observe(gain, &t, &gyro_angle));
        PrintedWay {
            gain,
            amplitude,
            phase,
            found: least_squares(&t, &encoder, &angle, SETTLED),
            found_both_filtered: least_squares(&t, &both_encoder, &both_gyro, 0.0),
        }
    });

    let compensated = estimate(&record, [found.alpha, found.delta], noise, Gain::Kalman);
    let encoder_rate = slope(&t, &encoder);
    let points: Vec<Point> = (0..t.len())
        .map(|k| Point {
            t: t[k],
            encoder_angle: encoder[k],
            encoder_rate: encoder_rate[k],
            gyro: gyro[k],
            gyro_angle: gyro_angle[k],
            filtered_rate: raw[k].filtered_rate,
            filtered_angle: raw[k].filtered_angle,
            observed_angle: [0, 1].map(|m: usize| observed[m][k].filtered_angle + encoder[0]),
            observed_rate: [0, 1].map(|m: usize| observed[m][k].filtered_rate),
            compensated_rate: compensated[k].rate,
            compensated_filtered_rate: compensated[k].filtered_rate,
            compensated_angle: compensated[k].angle,
        })
        .collect();
    let residual =
        |angle: &dyn Fn(&Point) -> f64| -> Vec<f64> { points.iter().map(|p| angle(p) - p.encoder_angle).collect() };
    let error_before = increment_error(&residual(&|p| p.gyro_angle), 10.0);
    let error_after = increment_error(&residual(&|p| p.compensated_angle), 10.0);
    Reproduction { points, found, noise, printed_way, error_before, error_after }
}

/// What the estimator says of one row, in the parts used here.
struct Estimated {
    rate: f64,
    filtered_rate: f64,
    angle: f64,
    filtered_angle: f64,
}

/// The record through the estimator with these parameters; the encoder only sets the angle's zero.
fn estimate(record: &Record, [alpha, delta]: [f64; 2], noise: Noise, gain: Gain) -> Vec<Estimated> {
    let mut axis = AxisModel { noise, ..AxisModel::base(Axis::X) };
    for (term, value) in axis.terms.iter_mut().zip([alpha, delta]) {
        term.values = vec![value];
        term.std_errors = vec![0.0];
    }
    let model = Model { epoch: 1, axes: [Some(axis), None, None], ..Model::default() };
    let mut estimator = Estimator::new(EstimatorOptions { gain, fuse_reference: false, ..EstimatorOptions::default() });
    estimator.set_model(&model);
    record
        .rows
        .iter()
        .map(|row| {
            let e = estimator.step(row).axes[0];
            Estimated { rate: e.rate, filtered_rate: e.rate_filtered, angle: e.angle, filtered_angle: e.angle_fused }
        })
        .collect()
}

/// An angle through the observer.
fn observe(gain: [f64; 2], t: &[f64], angle: &[f64]) -> Vec<f64> {
    let mut observer = Observer::new(gain);
    let mut last = 0.0;
    t.iter()
        .zip(angle)
        .map(|(&t, &angle)| {
            observer.step(angle, t - last);
            last = t;
            observer.angle()
        })
        .collect()
}

/// Minimises (11) over α and δ with θ̂ = θ_e(t₀) + α (θ_g − θ_g(t₀)) + δ (t − t₀), from [`START`], over the
/// rows from a time on.
fn least_squares(t: &[f64], encoder: &[f64], gyro_angle: &[f64], from: f64) -> Found {
    let first = t.partition_point(|&time| time < from);
    let start = encoder[0];
    let columns = columns(t, gyro_angle).map(|column| column[first..].to_vec());
    let encoder = &encoder[first..];
    let evaluate = |p: &[f64], _: bool| {
        let r: Vec<f64> = encoder
            .iter()
            .zip(&columns[0])
            .zip(&columns[1])
            .map(|((e, c), s)| start + p[0] * c + p[1] * s - e)
            .collect();
        let mut normal = Normal::zeros(2);
        normal.add(&r, &[&columns[0], &columns[1]]);
        normal
    };
    let bounds = [(-100.0, 100.0), (-100.0, 100.0)];
    let solution = nls::minimise(&START, &bounds, evaluate, &nls::Options::default());
    let iterations = solution
        .iterations
        .iter()
        .map(|i| Iteration { alpha: i.values[0], delta: i.values[1], rms: (i.cost / encoder.len() as f64).sqrt() })
        .collect();
    Found { alpha: solution.values[0], delta: solution.values[1], alpha_std: f64::NAN, delta_std: f64::NAN, iterations }
}

/// ∂θ̂/∂α and ∂θ̂/∂δ.
fn columns(t: &[f64], gyro_angle: &[f64]) -> [Vec<f64>; 2] {
    [gyro_angle.iter().map(|angle| angle - gyro_angle[0]).collect(), t.iter().map(|time| time - t[0]).collect()]
}

/// Square roots of the diagonal of (JᵀJ)⁻¹ JᵀΣJ (JᵀJ)⁻¹; see the module's head.
fn standard_errors(t: &[f64], gyro_angle: &[f64], n: f64, encoder: f64) -> (f64, f64) {
    use nalgebra::{Matrix2, Vector2};
    let [a, d] = columns(t, gyro_angle);
    let rows = || a.iter().zip(&d).map(|(&a, &d)| Vector2::new(a, d));
    let normal: Matrix2<f64> = rows().map(|j| j * j.transpose()).sum();
    let all: Vector2<f64> = rows().sum();
    // min(tᵢ, tⱼ) = Σ_k Δt over the steps before both: a sum over steps of (Σ_{i ≥ k} Jᵢ)(…)ᵀ.
    let mut walk = Matrix2::zeros();
    let mut after = all;
    for (k, j) in rows().enumerate().take(t.len() - 1) {
        after -= j;
        walk += after * after.transpose() * (t[k + 1] - t[k]);
    }
    let middle = walk * n * n + (normal + all * all.transpose()) * encoder * encoder;
    let Some(inverse) = normal.try_inverse() else { return (f64::NAN, f64::NAN) };
    let covariance = inverse * middle * inverse;
    (covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt())
}

/// Variance of the white part of an evenly sampled smooth signal, from its third differences (Σ of 1, 3, 3, 1 squared
/// is 20).
fn white_variance(signal: &[f64]) -> f64 {
    let squares: f64 = signal.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2)).sum();
    squares / 20.0 / (signal.len() - 3) as f64
}

/// Slope of the line through eleven rows about each.
fn slope(t: &[f64], y: &[f64]) -> Vec<f64> {
    (0..y.len())
        .map(|k| {
            let window = k.saturating_sub(5)..(k + 6).min(y.len());
            let count = window.len() as f64;
            let (mt, my) = window.clone().fold((0.0, 0.0), |(a, b), i| (a + t[i] / count, b + y[i] / count));
            let (sxy, sxx) =
                window.fold((0.0, 0.0), |(xy, xx), i| (xy + (t[i] - mt) * (y[i] - my), xx + (t[i] - mt).powi(2)));
            sxy / sxx
        })
        .collect()
}

/// E(τ) of an angle error sampled at [`RATE_HZ`], rad/s.
fn increment_error(error: &[f64], tau: f64) -> f64 {
    let lag = (tau * RATE_HZ).round() as usize;
    let squares: f64 = error.iter().zip(&error[lag..]).map(|(a, b)| (b - a).powi(2)).sum();
    (squares / (error.len() - lag) as f64).sqrt() / tau
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    #[test]
    fn over_twenty_seeds_both_numbers_are_recovered_and_their_standard_errors_are_right() {
        let mut squares = [0.0; 2];
        for seed in 1..=20 {
            let r = reproduce(seed);
            let z = [
                (r.found.alpha - ALPHA) / r.found.alpha_std,
                (r.found.delta - DELTA_DEGREES.to_radians()) / r.found.delta_std,
            ];
            for (z, sum) in z.iter().zip(&mut squares) {
                assert!(z.abs() < 4.0, "seed {seed}: {z} standard errors away");
                *sum += z * z;
            }
            assert!(r.error_after * 20.0 < r.error_before, "seed {seed}: {} to {}", r.error_before, r.error_after);
        }
        // Two-sided, 99.9 %.
        let law = ChiSquared::new(20.0).unwrap();
        for sum in squares {
            assert!((law.inverse_cdf(5e-4)..law.inverse_cdf(1.0 - 5e-4)).contains(&sum), "{squares:?}");
        }
    }

    #[test]
    fn the_printed_way_takes_the_trackers_gain_and_phase_for_a_scale_factor() {
        let r = reproduce(1);
        for way in &r.printed_way {
            // A sine fitted on itself amplified and turned: α cos φ / gain.
            let expected = ALPHA * way.phase.cos() / way.amplitude;
            assert!((way.found.alpha - expected).abs() < 0.02, "{} {expected}", way.found.alpha);
            assert!((way.found_both_filtered.alpha / ALPHA - 1.0).abs() < 2e-3, "{}", way.found_both_filtered.alpha);
        }
    }

    #[test]
    fn the_riccati_gain_agrees_with_the_printed_one_in_its_first_number_only() {
        let [m1, m2] = riccati_gain(PAPER_Q, PAPER_S);
        assert!((m1 - PRINTED_GAIN[0]).abs() < 5e-4);
        assert!((m2 - PRINTED_GAIN[1]).abs() > 2.0);
    }

    #[test]
    fn least_squares_converges_from_the_stated_start() {
        let found = reproduce(3).found;
        assert_eq!([found.iterations[0].alpha, found.iterations[0].delta], START);
        assert!(found.iterations.windows(2).all(|w| w[1].rms <= w[0].rms));
    }
}
