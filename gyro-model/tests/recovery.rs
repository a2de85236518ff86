//! Simulator against fit: started from the nearest point of an effect's grid, a model of the right structure gives the
//! hidden parameters back, within its own standard errors.

use gyro_model::{
    Axis, AxisModel, Model, Record, Term,
    diagnose::{Options, compare, ladder},
    diagnosis::Verdict,
    effects::{CATALOGUE, Effect, Role, Span, Stage},
    evidence::study::{Bench, Study},
    fit::fit,
    simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
    words::Voice,
};

fn scenario(hidden: Vec<Hidden>, seed: u64) -> Scenario {
    let sensor = SensorSpec { bias_random_walk: 0.0, ..SensorSpec::default() };
    Scenario { motion: Motion::Multisine { travel: 8.0 }, seconds: 80.0, seed, hidden, sensor, ..Scenario::default() }
}

fn span(record: &Record) -> Span {
    let readings = || record.rows.iter().map(|row| row.gyro[0].abs());
    Span {
        start: 0.0,
        duration: record.duration(),
        dt: 0.01,
        reference_dt: 0.01,
        reading_min: readings().filter(|&r| r > 0.0).fold(f64::INFINITY, f64::min),
        reading_max: readings().fold(0.0, f64::max),
        travel: 8.0,
    }
}

/// The truth's structure at α = 1, coefficients of zero, and the shapes of the grid that lie nearest.
fn start(truth: &AxisModel, span: &Span) -> Model {
    let mut start = truth.clone();
    for term in &mut start.terms {
        let cards = term.effect.parameters(Axis::X);
        let shapes = cards.iter().take_while(|card| card.role == Role::Linear).count();
        for (value, card) in term.values.iter_mut().zip(cards).take(shapes) {
            *value = card.neutral;
        }
        let hidden = term.values[shapes..].to_vec();
        let apart = |(p, h): (&f64, &f64)| if p == h { 0.0 } else { (p / h).ln().abs() };
        let distance = |point: &[f64]| point.iter().zip(&hidden).map(apart).sum::<f64>();
        let grid = term.effect.grid(span);
        match grid.iter().filter(|p| distance(p).is_finite()).min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            Some(nearest) => term.values[shapes..].copy_from_slice(nearest),
            None => assert_eq!(shapes, cards.len(), "{} has shapes and no grid", term.effect.card().id),
        }
    }
    Model { axes: [Some(start), None, None], ..Model::default() }
}

fn comes_back(effect: &'static dyn Effect) {
    let id = effect.card().id;
    let simulated = simulate(&scenario(vec![Hidden::typical(effect, Axis::X)], 5));
    let truth = simulated.truth.axes[0].as_ref().unwrap();
    let mut start = start(truth, &span(&simulated.record));
    start.origin = simulated.truth.origin;
    let fitted = fit(&simulated.record, &start, &[Axis::X]).unwrap();
    let fitted = fitted.axes[0].as_ref().unwrap();
    for (hidden, found) in truth.terms.iter().zip(&fitted.terms) {
        for ((card, hidden, _), (_, found, std_error)) in hidden.parameters(Axis::X).zip(found.parameters(Axis::X)) {
            let off = (found - hidden).abs();
            let near = found == hidden || off < 5.0 * std_error || off < 0.04 * hidden.abs();
            assert!(near, "{id}: {} is {hidden} and comes back as {found} ± {std_error}", card.name);
        }
    }
}

#[test]
fn every_felt_effect_comes_back_as_it_was_hidden() {
    // A tone is as narrow as the log is long: the diagnosis seeks it in the spectrum, there is no grid to start from.
    let on_a_grid = |e: &&&dyn Effect| e.stage() == Stage::Felt && e.card().id != "vibration-tone";
    CATALOGUE.iter().filter(on_a_grid).for_each(|effect| comes_back(*effect));
}

#[test]
fn every_effect_of_time_filter_range_or_reference_comes_back_as_it_was_hidden() {
    let elsewhere = |e: &&&dyn Effect| !matches!(e.stage(), Stage::Felt | Stage::Calibration);
    CATALOGUE.iter().filter(elsewhere).for_each(|effect| comes_back(*effect));
}

/// Σ over sensors' noise of (error / standard error)² for α and δ, with a bias that walks so much, rad/s/√s.
fn scatter(logs: u64, walk: f64) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for seed in 0..logs {
        let mut scenario = scenario(Vec::new(), 100 + seed);
        scenario.sensor.bias_random_walk = walk;
        let simulated = simulate(&scenario);
        let model = fit(&simulated.record, &Model::base_for(&simulated.record), &[Axis::X]).unwrap();
        let [truth, fitted] = [&simulated.truth, &model].map(|m| m.axes[0].as_ref().unwrap());
        for (sum, (truth, fitted)) in squares.iter_mut().zip(truth.terms.iter().zip(&fitted.terms)) {
            *sum += ((fitted.values[0] - truth.values[0]) / fitted.std_errors[0]).powi(2);
        }
    }
    squares
}

#[test]
#[ignore = "long: tests/nightly"]
fn standard_errors_are_as_large_as_the_scatter_over_sensors_noise() {
    const LOGS: u64 = 16;
    for walk in [0.0, 1e-6, 1e-5, 1e-4] {
        for (sum, name) in scatter(LOGS, walk).iter().zip(["alpha", "delta"]) {
            eprintln!("{name}: {sum} for {LOGS} logs with a walk of {walk}");
            // χ² of 16 degrees of freedom: 0.1 % lies below 3.9, 0.1 % above 39; quantisation makes it no Gaussian.
            assert!((3.0..48.0).contains(sum), "{name}: {sum} for {LOGS} logs with a walk of {walk}");
        }
    }
}

#[test]
fn a_fit_ends_at_one_place_wherever_it_starts() {
    let scenario = Scenario {
        motion: Motion::Drive { rate: 1.2, hold: 2.0 },
        seconds: 400.0,
        seed: 12,
        sensor: SensorSpec::default(),
        hidden: vec![Hidden::parse("delay:d=0.012", Axis::X).unwrap()],
        ..Scenario::default()
    };
    let simulated = simulate(&scenario);
    let from = |start: &AxisModel| {
        let start = Model { axes: [Some(start.clone()), None, None], ..Model::default() };
        fit(&simulated.record, &start, &[Axis::X]).unwrap().axes[0].clone().unwrap()
    };
    let first = from(simulated.truth.axes[0].as_ref().unwrap());
    for sigmas in [-2.5, -0.5, 1.5] {
        let mut start = first.clone();
        for term in &mut start.terms {
            for (value, std_error) in term.values.iter_mut().zip(&term.std_errors) {
                *value += sigmas * std_error;
            }
        }
        for (one, other) in first.terms.iter().zip(&from(&start).terms) {
            for ((card, one, std_error), (_, other, _)) in one.parameters(Axis::X).zip(other.parameters(Axis::X)) {
                let apart = (one - other).abs() / std_error;
                assert!(apart < 0.02, "{} ends {apart} of its standard errors away from {sigmas}", card.name);
            }
        }
    }
}

/// Its inverse is found by substitution, which comes nearer by a third of the way left each time.
#[test]
fn a_nonlinearity_that_bends_the_fastest_turns_by_a_tenth_is_fitted_to_the_end() {
    let hidden = Hidden::parse("cubic-nonlinearity:k3=-0.0016", Axis::X).unwrap();
    let simulated = simulate(&scenario(vec![hidden], 5));
    let start = start(simulated.truth.axes[0].as_ref().unwrap(), &span(&simulated.record));
    let fitted = fit(&simulated.record, &start, &[Axis::X]).unwrap();
    let bench = Bench::new(&simulated.record, &[Axis::X], &fitted).unwrap();
    let over_floor = Study::held(&bench, &fitted).over_floor_as_is();
    assert!(over_floor < 1.5, "{over_floor}");
}

/// Most of what a rate table shows is held rates. Each stands where it came to, at the end of the play, and is not left out.
#[test]
fn a_play_is_fitted_and_compared_on_held_rates() {
    let hidden = vec![Hidden::parse("rate-hysteresis:h=0.004", Axis::X).unwrap()];
    let simulated = simulate(&Scenario { motion: Motion::RateTable { rate: 2.0, hold: 4.0 }, ..scenario(hidden, 3) });
    let start = start(simulated.truth.axes[0].as_ref().unwrap(), &span(&simulated.record));
    let fitted = fit(&simulated.record, &start, &[Axis::X]).unwrap();
    let (_, h, std_error) = fitted.axes[0].as_ref().unwrap().terms[2].parameters(Axis::X).next().unwrap();
    assert!((h - 0.004).abs() < 3.0 * std_error && std_error < 2e-4, "{h} ± {std_error}");
    let found = compare(&simulated.record, &fitted, &[Axis::X], &Options::default()).unwrap();
    assert_eq!(found[0].verdict, Verdict::Adequate, "{}", found[0].in_words(Voice::Log));
    assert!(!found[0].in_words(Voice::Log).contains("not known"), "{}", found[0].in_words(Voice::Log));
}

/// A light damping makes more of the noise far above the resonance than a heavy one: that is no reason to find it heavier.
#[test]
fn a_damping_is_not_what_makes_least_of_the_noise() {
    for seed in [1, 2, 3] {
        let hidden = vec![Hidden::parse("mount-resonance:f=8.986,zeta=0.0453", Axis::X).unwrap()];
        let scenario = Scenario { rate_hz: 400.0, ..scenario(hidden, seed) };
        let simulated = simulate(&scenario);
        let fitted = fit(&simulated.record, &simulated.truth, &[Axis::X]).unwrap();
        let term = fitted.axes[0].as_ref().unwrap().term("mount-resonance").unwrap();
        let off = (term.values[1] - 0.0453) / term.std_errors[1];
        assert!(off.abs() < 4.0, "seed {seed}: damping {} ± {}, {off:.1} σ off", term.values[1], term.std_errors[1]);
    }
}

/// Where the motion is as quick as the mount swings, its inverse has to be right to a part in a thousand.
#[test]
fn a_mount_that_swings_amid_the_motion_is_found_where_it_does() {
    for (f, zeta) in [(3.02, 0.2), (5.38, 0.055)] {
        let off: Vec<f64> = (1..=4)
            .map(|seed| {
                let hidden = vec![Hidden::parse(&format!("mount-resonance:f={f},zeta={zeta}"), Axis::X).unwrap()];
                let simulated = simulate(&scenario(hidden, seed));
                let fitted = fit(&simulated.record, &simulated.truth, &[Axis::X]).unwrap();
                let term = fitted.axes[0].as_ref().unwrap().term("mount-resonance").unwrap();
                (term.values[0] - f) / term.std_errors[0]
            })
            .collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        assert!(mean.abs() < 2.0, "{f} Hz: {off:.1?} σ off");
    }
}

/// A thousandth of a hertz turns a tone's phase by ten degrees in a minute: its frequency is fitted with its amplitudes.
#[test]
fn a_tone_comes_back_with_its_frequency_and_all_standard_errors() {
    for seed in 1..=6 {
        let hidden = vec![Hidden::parse("vibration-tone:a_sin=-0.002,a_cos=0.006,f=5.39", Axis::X).unwrap()];
        let simulated = simulate(&scenario(hidden, seed));
        let truth = simulated.truth.axes[0].as_ref().unwrap().term("vibration-tone").unwrap();
        let (fitted, _) =
            ladder(&simulated.record, &Model::base_for(&simulated.record), &[Axis::X], &Options::default()).unwrap();
        let found = fitted.axes[0].as_ref().unwrap().term("vibration-tone").expect("the tone is found");
        for ((card, value, error), hidden) in found.parameters(Axis::X).zip(&truth.values) {
            let off = (value - hidden) / error;
            assert!(off.abs() < 4.0, "seed {seed}: {} {value} ± {error} for {hidden}", card.name);
        }
    }
}

/// What comes in for a noise that is not known yet goes again by this measure.
#[test]
fn what_is_hidden_is_told_from_nothing_and_what_is_not_is_not() {
    let size = |hidden: &[&str], fitted: &str, seed| {
        let hidden = hidden.iter().map(|text| Hidden::parse(text, Axis::X).unwrap()).collect();
        let simulated = simulate(&scenario(hidden, seed));
        let mut model = Model { axes: [Some(AxisModel::base(Axis::X)), None, None], ..Model::default() };
        let effect = *CATALOGUE.iter().find(|effect| effect.card().id == fitted).unwrap();
        model.axes[0].as_mut().unwrap().terms.push(Term::neutral(effect, Axis::X));
        let bench = Bench::new(&simulated.record, &[Axis::X], &model).unwrap();
        let (mut study, gls) = Study::fit(&bench, &model, None).refine();
        study.stamp(&gls);
        study.size_in_errors(&gls, 0, fitted).unwrap()
    };
    let hidden = ["delay:d=0.0002", "g-sensitivity:g_x=0,g_y=0.0001,g_z=0"];
    for (text, id) in hidden.into_iter().zip(["delay", "g-sensitivity"]) {
        let sizes: Vec<f64> = (1..=5).map(|seed| size(&[text], id, seed)).collect();
        assert!(sizes.iter().all(|size| *size > 5.0), "{id}: {sizes:?}");
        let sizes: Vec<f64> = (1..=5).map(|seed| size(&[], id, seed)).collect();
        assert!(sizes.iter().sum::<f64>() < 2.0 * sizes.len() as f64, "no {id}: {sizes:?}");
    }
}

/// A sensor whose noise is smaller than half a step of its converter reads a rate that is held off by the same at every sample,
/// another at each rate: that is rounding, no physics of the sensor.
#[test]
#[ignore = "long: tests/nightly"]
fn what_rounding_leaves_of_held_rates_is_no_physics_and_hides_none() {
    let found = |hidden: &[&str], seed| {
        let hidden = hidden.iter().map(|text| Hidden::parse(text, Axis::X).unwrap()).collect();
        let mut scenario =
            Scenario { motion: Motion::RateTable { rate: 2.0, hold: 4.0 }, seconds: 100.0, ..scenario(hidden, seed) };
        scenario.sensor.noise_density = 0.15 * scenario.sensor.quantum / f64::sqrt(0.5 * scenario.rate_hz);
        let record = simulate(&scenario).record;
        let (_, ladders) = ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        let ids = ladders[0].effects.iter().map(ToString::to_string);
        ids.filter(|id| id != "scale-factor" && id != "bias").collect::<Vec<_>>()
    };
    for seed in 1..=4 {
        assert_eq!(found(&[], seed), Vec::<String>::new(), "seed {seed}");
        assert_eq!(found(&["scale-asymmetry:a=0.004"], seed), ["scale-asymmetry"], "seed {seed}");
    }
}

/// A gyro's errors go with the rate that it felt, the ringing of its mount in it.
#[test]
fn an_error_of_the_rate_is_that_of_the_rate_that_was_felt_on_a_mount() {
    let hidden = ["mount-resonance:f=9.4,zeta=0.08", "quadratic-nonlinearity:k2=-0.0035"];
    let hidden = hidden.iter().map(|text| Hidden::parse(text, Axis::X).unwrap()).collect();
    let record = simulate(&Scenario { rate_hz: 200.0, ..scenario(hidden, 3) }).record;
    let (_, ladders) = ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
    let added = ["scale-factor", "bias", "quadratic-nonlinearity", "mount-resonance"];
    assert_eq!(ladders[0].effects, added, "{}", ladders[0].in_words(Voice::Log));
    let found = ladders[0].parameters.iter().find(|p| p.name == "k2").unwrap();
    let (value, std_error) = (found.value.unwrap(), found.std_error.unwrap());
    assert!((value + 0.0035).abs() < 4.0 * std_error, "{value} ± {std_error}");
}

/// A sine whose peaks are cut off has lines at all its multiples, and the encoder's steps repeat with it: no tone, and no shape of
/// the rate.
#[test]
#[ignore = "long: tests/nightly"]
fn nothing_is_found_beside_a_saturation_of_one_sine() {
    for (seed, limit) in (1..).zip([3.9, 3.95, 4.0, 4.03, 4.06, 4.08]) {
        let hidden = vec![Hidden::parse(&format!("saturation:l={limit}"), Axis::X).unwrap()];
        let motion = Motion::Sine { amplitude: 2.618, frequency: 0.25 };
        let record = simulate(&Scenario { motion, ..scenario(hidden, seed) }).record;
        let (_, ladders) = ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap();
        assert_eq!(ladders[0].effects, ["scale-factor", "bias", "saturation"], "{limit} rad/s, seed {seed}");
    }
}

/// Where the encoder stands inside the play its count is no turning point of the shaft.
#[test]
fn an_encoders_play_is_as_wide_in_the_mean_as_it_was_hidden() {
    let effect = *CATALOGUE.iter().find(|effect| effect.card().id == "encoder-backlash").unwrap();
    let width = Hidden::typical(effect, Axis::X).values[0];
    let off = |seed: u64| {
        let scenario = Scenario { seconds: 60.0, ..scenario(vec![Hidden::typical(effect, Axis::X)], seed) };
        let simulated = simulate(&scenario);
        let fitted = fit(&simulated.record, &simulated.truth, &[Axis::X]).unwrap();
        let term = fitted.axes[0].as_ref().unwrap().term("encoder-backlash").unwrap();
        (term.values[0] - width) / term.std_errors[0]
    };
    let mean = (0..8).map(off).sum::<f64>() / 8.0;
    assert!(mean.abs() < 1.0, "{mean} standard errors");
}
