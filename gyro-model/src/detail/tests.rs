use super::*;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};

/// A log of 120 s at 100 Hz whose rate error is `wrong(t, rate)`, with an encoder's noise.
fn log(wrong: impl Fn(f64, f64) -> f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let (gyro, encoder) = (Normal::new(0.0, 1e-3).unwrap(), Normal::new(0.0, 2e-4).unwrap());
    let t: Vec<f64> = (0..12_000).map(|k| f64::from(k) * 0.01).collect();
    let rate: Vec<f64> = t.iter().map(|t| (1.3 * t).sin() + 0.6 * (0.37 * t).sin()).collect();
    let mut angle = 0.0;
    let error = t
        .iter()
        .zip(&rate)
        .map(|(&t, &w)| {
            angle += 0.01 * (wrong(t, w) + gyro.sample(&mut random));
            angle + encoder.sample(&mut random)
        })
        .collect();
    (t, rate, error)
}

fn pictures(t: &[f64], rate: &[f64], error: &[f64]) -> AxisDetail {
    let channels = [
        Channel { regressor: "time".into(), unit: "s", values: t.to_vec() },
        Channel { regressor: "rate".into(), unit: "rad/s", values: rate.to_vec() },
        Channel { regressor: "temperature".into(), unit: "°C", values: t.iter().map(|t| 20.0 + 0.1 * t).collect() },
    ];
    let noise = Noise { angle_random_walk: 1e-4, bias_random_walk: 0.0, encoder: 2e-4, ..Noise::default() };
    detail(&Input { t, rate, error_angle: error, channels: &channels, noise })
}

#[test]
fn an_error_that_grows_with_rate_is_placed_there_and_said_in_words() {
    let (t, rate, error) = log(|_, w| if w > 0.5 { 0.02 } else { 0.0 });
    let found = fails_where(&pictures(&t, &rate, &error));
    assert_eq!(found[0].regressor, "rate", "{found:?}");
    assert!(found[0].says.starts_with("at rates above"), "{}", found[0].says);
    assert!(found[0].says.contains("high"), "{}", found[0].says);
    assert!((found[0].mean_error.unwrap() - 0.02).abs() < 0.004, "{found:?}");
    assert!((found[0].from.unwrap() - 0.5).abs() < 0.25, "{found:?}");
}

#[test]
fn a_free_column_is_a_regime_unless_it_only_counts() {
    let (t, rate, error) = log(|t, _| if (0.9 * t).sin() > 0.3 { 0.02 } else { 0.0 });
    let mut rows = vec![crate::Row::EMPTY; t.len()];
    for (k, row) in rows.iter_mut().enumerate() {
        row.t_ns = (t[k] * 1e9) as i64;
        // Every tenth row alone has the current.
        let current = if k % 10 == 0 { 5.0 + (0.9 * t[k]).sin() } else { f64::NAN };
        (row.free[0], row.free[1]) = (k as f64, current);
    }
    let record = crate::Record { rows, free_names: vec!["counter".into(), "current".into()], ..Default::default() };
    let list = channels(&record, crate::Axis::X, [&rate, &[], &[]], &[]);
    let names: Vec<&str> = list.iter().map(|c| c.regressor.as_str()).collect();
    assert_eq!(names, ["time", "rate", "direction", "rate-change", "current"]);
    let noise = Noise { angle_random_walk: 1e-4, bias_random_walk: 0.0, encoder: 2e-4, ..Noise::default() };
    let found = fails_where(&detail(&Input { t: &t, rate: &rate, error_angle: &error, channels: &list, noise }));
    assert_eq!(found[0].regressor, "current", "{found:?}");
    assert!(found[0].says.starts_with("where current is above 5."), "{}", found[0].says);
}

#[test]
fn noise_alone_fails_nowhere() {
    let (t, rate, error) = log(|_, _| 0.0);
    let found = fails_where(&pictures(&t, &rate, &error));
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn the_spectrum_of_noise_lies_on_its_floor() {
    let (t, rate, error) = log(|_, _| 0.0);
    let spectrum = pictures(&t, &rate, &error).spectrum;
    let squares: Vec<f64> = spectrum
        .error
        .iter()
        .zip(&spectrum.floor)
        .filter_map(|(e, f)| Some((e.as_ref()? / f.as_ref()?).powi(2)))
        .collect();
    assert!(squares.len() > 500);
    let ratio = mean(&squares);
    assert!((0.85..1.15).contains(&ratio), "{ratio}");
}

#[test]
fn a_line_in_the_spectrum_is_named_as_a_frequency() {
    let (t, rate, error) = log(|t, _| 0.01 * (std::f64::consts::TAU * 7.0 * t).sin());
    let found = fails_where(&pictures(&t, &rate, &error));
    let band = found.iter().find(|f| f.regressor == "frequency").expect("a band");
    assert!(band.from.unwrap() <= 7.0 && 7.0 <= band.to.unwrap(), "{band:?}");
}

#[test]
fn a_white_residual_stays_in_its_band_and_a_slow_error_is_hidden_by_a_bias_state() {
    let (t, rate, error) = log(|_, _| 0.0);
    let clean = pictures(&t, &rate, &error);
    let outside = clean.whiteness.autocorrelation.iter().filter(|c| c.abs() > clean.whiteness.band_99).count();
    assert!(outside <= 4, "{outside} of 40 lags");
    let wider = |whiteness: &Whiteness| whiteness.motion_band_99 / whiteness.band_99;
    assert!((1.0..1.15).contains(&wider(&clean.whiteness)), "{}", wider(&clean.whiteness));
    let (t, rate, error) = log(|t, _| 0.02 * (0.05 * t).sin());
    let slow = pictures(&t, &rate, &error);
    assert!(slow.hidden_by_bias.unwrap() > 0.5);
    // No white residual, and a motion that remembers as well.
    assert!(wider(&slow.whiteness) > 1.3, "{}", wider(&slow.whiteness));
    assert!(clean.hidden_by_bias.unwrap() < 0.2);
}

#[test]
fn the_heat_map_of_noise_lies_on_its_floor() {
    let (t, rate, error) = log(|_, _| 0.0);
    for map in &pictures(&t, &rate, &error).heat_maps {
        for row in &map.rms {
            for (cell, floor) in row.iter().zip(&map.floor).take(5) {
                if let (Some(cell), Some(floor)) = (cell, floor) {
                    assert!((0.6..1.6).contains(&(cell / floor)), "{}: {cell} against {floor}", map.regressor);
                }
            }
        }
    }
}

#[test]
fn a_log_without_reference_has_no_pictures() {
    let t = [0.0, 0.01, 0.02];
    let nan = [f64::NAN; 3];
    let input = Input { t: &t, rate: &t, error_angle: &nan, channels: &[], noise: Noise::default() };
    assert!(detail(&input).trace.t.is_empty());
}

#[test]
fn model_less_measured_is_the_residual_in_the_overlay() {
    let (t, rate, error) = log(|_, w| 0.1 * w);
    let trace = pictures(&t, &rate, &error).trace;
    assert!(trace.t.len() > 1000);
    for k in 0..trace.t.len() {
        let (Some(model), Some(measured), Some(residual)) = (trace.model[k], trace.measured[k], trace.residual[k])
        else {
            continue;
        };
        assert!((model - measured - residual).abs() < 1e-4);
    }
}

#[test]
fn what_happens_while_the_rate_falls_is_said_so() {
    let (t, rate, error) = log(|t, _| if (1.3 * t).cos() < 0.0 { 0.01 } else { 0.0 });
    let change: Vec<f64> = t.iter().map(|t| 1.3 * (1.3 * t).cos() + 0.222 * (0.37 * t).cos()).collect();
    let channels = [Channel { regressor: "rate-change".into(), unit: "rad/s²", values: change }];
    let noise = Noise { angle_random_walk: 1e-4, bias_random_walk: 0.0, encoder: 2e-4, ..Noise::default() };
    let found = fails_where(&detail(&Input { t: &t, rate: &rate, error_angle: &error, channels: &channels, noise }));
    assert!(found[0].says.starts_with("while the rate falls"), "{}", found[0].says);
    assert!(found[0].says.contains("high"), "{}", found[0].says);
}

/// A sensor that hangs at half time: its readings stand still, and another channel stands at its largest value.
#[test]
fn all_rows_belong_to_a_regime_and_what_stands_still_has_no_standard_error() {
    let (t, rate, noisy) = log(|_, _| 0.0);
    let half = t.len() / 2;
    let error: Vec<f64> = (0..t.len())
        .map(|k| if k < half { noisy[k] + 0.01 * t[k] } else { noisy[half] + 0.01 * t[half] - 0.01 * (t[k] - t[half]) })
        .collect();
    let level = (0..t.len()).map(|k| if k < half { 9.8 + 0.05 * (0.3 * t[k]).sin() } else { 9.904_74 }).collect();
    let channels = [
        Channel { regressor: "time".into(), unit: "s", values: t.clone() },
        Channel { regressor: "acceleration-x".into(), unit: "m/s²", values: level },
    ];
    let noise = Noise { angle_random_walk: 1e-4, bias_random_walk: 0.0, encoder: 2e-4, ..Noise::default() };
    let detail = detail(&Input { t: &t, rate: &rate, error_angle: &error, channels: &channels, noise });
    for regime in &detail.regimes {
        let inside: usize = regime.bins.iter().map(|bin| bin.samples).sum();
        assert!(inside as f64 > 0.9 * t.len() as f64, "{}: {inside} of {} rows", regime.regressor, t.len());
    }
    for fails in fails_where(&detail) {
        assert!(!fails.says.contains("throughout") && !fails.says.contains("e−"), "{}", fails.says);
    }
}
