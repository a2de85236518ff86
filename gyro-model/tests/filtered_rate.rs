//! What the filter is worth, on the simulator's three motions with a real sensor's noise, quantisation and encoder.

use gyro_model::{
    Axis,
    estimator::{Estimate, Estimator, Options, flags},
    simulate::{Hidden, Motion, Scenario, Simulated, simulate},
};

/// RMS.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v * v, n + 1.0));
    (sum / n).sqrt()
}

fn simulated(motion: &str, rate_hz: f64, seed: u64) -> Simulated {
    let motion: Motion = motion.parse().unwrap();
    simulate(&Scenario { motion, rate_hz, seed, seconds: 40.0, ..Scenario::default() })
}

/// Every row's estimate beside its true rate and acceleration, after the first ten seconds. The model has the noise that
/// a fit finds: that of the sensor and of its converter.
fn estimates(simulated: &Simulated, rate_hz: f64) -> Vec<(Estimate, f64, f64)> {
    let mut model = simulated.truth.clone();
    let noise = &mut model.axes[0].as_mut().unwrap().noise;
    let quantum = Scenario::default().sensor.quantum;
    noise.angle_random_walk = noise.angle_random_walk.hypot(quantum / (12.0 * rate_hz).sqrt());
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model);
    let all: Vec<Estimate> = simulated.record.rows.iter().map(|row| estimator.step(row)).collect();
    let rates = &simulated.true_rate;
    ((10.0 * rate_hz) as usize..all.len() - 1)
        .map(|k| (all[k], rates[k][0], (rates[k + 1][0] - rates[k - 1][0]) * rate_hz / 2.0))
        .collect()
}

#[test]
fn on_every_motion_the_filtered_rate_is_nearer_to_the_truth_its_lag_known_and_its_standard_deviation_right() {
    for motion in ["sine", "multisine", "drive"] {
        for rate_hz in [100.0, 1000.0] {
            let late = estimates(&simulated(motion, rate_hz, 1), rate_hz);
            let compensated = rms(late.iter().map(|(e, truth, _)| e.axes[0].rate - truth));
            let filtered = rms(late.iter().map(|(e, truth, _)| e.axes[0].rate_filtered - truth));
            // Where nothing can be averaged, what it does not know of the zero is left.
            assert!(filtered < 1.01 * compensated, "{motion} at {rate_hz} Hz: {filtered} of {compensated}");

            let normalised =
                rms(late.iter().map(|(e, truth, _)| (e.axes[0].rate_filtered - truth) / e.axes[0].rate_std));
            // It holds what scale and zero may have changed since, which this sensor's have not.
            assert!((0.8..1.1).contains(&normalised), "{motion} at {rate_hz} Hz: {normalised} standard deviations");

            // ω_f(t) = ω(t − lag): the error's least squares on the true acceleration.
            let squares: f64 = late.iter().map(|(_, _, acceleration)| acceleration * acceleration).sum();
            let lag =
                -late.iter().map(|(e, rate, slope)| (e.axes[0].rate_filtered - rate) * slope).sum::<f64>() / squares;
            let reported = late.iter().map(|(e, _, _)| e.axes[0].lag).sum::<f64>() / late.len() as f64;
            // The filtered error is correlated over some ten rows at most.
            let uncertain = 4.0 * filtered * (10.0 / squares).sqrt();
            assert!(
                (lag - reported).abs() < uncertain + 0.5 * reported,
                "{motion} at {rate_hz} Hz: {reported} s reported, {lag} ± {uncertain} there"
            );
        }
    }
}

#[test]
fn nothing_of_a_simulated_motion_is_taken_for_an_outlier() {
    for motion in ["sine", "multisine", "drive"] {
        let late = estimates(&simulated(motion, 200.0, 2), 200.0);
        let rejected = late.iter().filter(|(e, _, _)| e.axes[0].flags & flags::OUTLIER != 0).count();
        assert_eq!(rejected, 0, "{motion}");
    }
}

#[test]
fn what_was_cut_off_leaves_no_spike_where_a_resonance_is_undone() {
    let hidden = ["mount-resonance:f=8,zeta=0.1", "saturation:l=2.2"];
    let simulated = simulate(&Scenario {
        motion: Motion::Multisine { travel: 8.0 },
        rate_hz: 200.0,
        seconds: 40.0,
        hidden: hidden.iter().map(|h| Hidden::parse(h, Axis::X).unwrap()).collect(),
        ..Scenario::default()
    });
    let late = estimates(&simulated, 200.0);
    let cut_off = late.iter().filter(|(e, _, _)| e.axes[0].flags & flags::LOST != 0).count();
    assert!(cut_off > late.len() / 3, "{cut_off} of {}", late.len());
    let kept = late.iter().filter(|(e, _, _)| e.axes[0].flags & flags::LOST == 0);
    let largest = kept.map(|(e, truth, _)| (e.axes[0].rate - truth).abs()).fold(0.0, f64::max);
    assert!(largest < 0.25, "{largest} rad/s");
}
