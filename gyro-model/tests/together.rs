//! Effects that hide one another.

use gyro_model::{
    Axis, Model, Record,
    diagnose::{self, Options},
    diagnosis::{AxisResult, Verdict},
    fault::{DataFault, FaultKind},
    finding::{Excess, Finding, ZeroMoves},
    simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
    words::Voice,
};
use itertools::Itertools;

/// The ladder of a minute.
fn climbed(hidden: &[&str], motion: Motion, rate_hz: f64, seed: u64) -> AxisResult {
    climbed_with(SensorSpec::on(Axis::X), hidden, motion, rate_hz, seed)
}

/// The same of another sensor on another rig.
fn climbed_with(sensor: SensorSpec, hidden: &[&str], motion: Motion, rate_hz: f64, seed: u64) -> AxisResult {
    let axis = sensor.axis;
    let hidden = hidden.iter().map(|text| Hidden::parse(text, axis).unwrap()).collect();
    let scenario = Scenario { motion, seconds: 60.0, rate_hz, sensor, hidden, seed };
    ladder_of(&simulate(&scenario).record, axis)
}

fn ladder_of(record: &Record, axis: Axis) -> AxisResult {
    let (_, ladders) = diagnose::ladder(record, &Model::base_for(record), &[axis], &Options::default()).unwrap();
    ladders.into_iter().next().unwrap()
}

fn added(ladder: &AxisResult) -> Vec<&str> {
    let mut ids: Vec<&str> = ladder.effects.iter().skip(2).map(String::as_str).collect();
    ids.sort_unstable();
    ids
}

/// Undoing a slow resonance makes a fast tone forty times as large: neither can be judged while the other is there.
#[test]
fn a_tone_is_seen_beside_a_resonance_that_hides_it() {
    for seed in [2, 3] {
        let drive = Motion::Drive { rate: 1.2, hold: 2.0 };
        let hidden = ["mount-resonance:f=3.57,zeta=0.095", "vibration-tone:a_sin=0.07,a_cos=-0.028,f=23.585"];
        let ladder = climbed(&hidden, drive, 100.0, seed);
        assert_eq!(
            added(&ladder),
            ["mount-resonance", "vibration-tone"],
            "seed {seed}: {}",
            ladder.in_words(Voice::Log)
        );
        assert_eq!(ladder.verdict, Verdict::Adequate, "seed {seed}: {}", ladder.in_words(Voice::Log));
        assert!(ladder.steps.iter().all(|step| step.aliases.is_empty()), "both are in the model: {:?}", ladder.steps);
    }
}

/// On a drive that turns at one rate either way, the lateness of the gyro and the play of the encoder's gear take from one
/// another what they add to the error: it lies on its floor, and on another motion it would not.
#[test]
#[ignore = "long: tests/nightly"]
fn two_effects_are_found_that_cancel_in_the_error() {
    let drive = Motion::Drive { rate: 1.7, hold: 2.5 };
    let ladder = climbed(&["delay:d=1.8e-4", "encoder-backlash:b=5.77e-4"], drive, 100.0, 3);
    assert!(ladder.steps[0].error_over_floor.unwrap() < 1.4, "{:?}", ladder.steps[0]);
    let ids = added(&ladder);
    let is_late = |id: &&str| ["delay", "lag"].contains(id);
    assert!(ids.len() == 2 && ids.contains(&"encoder-backlash") && ids.iter().any(is_late), "{ids:?}");
}

/// A lag and a delay leave as much while a nonlinearity is missing. Once that stands, no effect lowers what the wrong one leaves.
#[test]
fn what_was_added_first_gives_way_to_its_alias_where_nothing_else_helps() {
    let hidden = ["lag:tau=0.009", "quadratic-nonlinearity:k2=0.005"];
    let ladder = climbed(&hidden, Motion::Multisine { travel: 8.4 }, 100.0, 1);
    assert_eq!(ladder.steps[1].added.as_deref(), Some("delay"), "it has to come first: {:?}", ladder.steps);
    assert_eq!(added(&ladder), ["lag", "quadratic-nonlinearity"], "{}", ladder.in_words(Voice::Log));
}

/// A light damping is hardly told by such a log, and less beside a drift: its fit ends at the least that there is.
#[test]
fn a_resonance_is_found_whose_damping_the_log_does_not_tell() {
    let hidden = ["mount-resonance:f=27.557,zeta=0.0497", "temperature-bias:c1=-0.00021"];
    let ladder = climbed(&hidden, Motion::Multisine { travel: 7.4 }, 100.0, 2);
    assert_eq!(added(&ladder), ["mount-resonance", "temperature-bias"], "{}", ladder.in_words(Voice::Log));
}

/// Gravity that is taken for rotation goes with the motion as a damping does, and presses it to the least that there is.
#[test]
fn a_resonance_is_found_whose_damping_other_missing_physics_presses_to_its_end() {
    let seed = 3_300_205;
    let hidden = [
        "mount-resonance:f=29.2222008,zeta=0.0466505589",
        "g-sensitivity:g_y=-0.00053150596",
        "temperature-bias:c1=-0.00045454262,c2=0",
    ];
    let multisine = Motion::Multisine { travel: 7.002_640_622_767_472 };
    let ladder = climbed_with(SensorSpec::random(seed), &hidden, multisine, 100.0, seed);
    assert_eq!(
        added(&ladder),
        ["g-sensitivity", "mount-resonance", "temperature-bias"],
        "{}",
        ladder.in_words(Voice::Log)
    );
}

/// What a hysteresis leaves at each turn, if its form is not right to a millisecond, looks like a lag that a delay nearly takes
/// back.
#[test]
#[ignore = "long: tests/nightly"]
fn the_difference_of_two_that_look_alike_is_not_added_for_what_a_form_leaves() {
    for seed in [1, 2] {
        let hidden = ["rate-hysteresis:h=0.0278", "delay:d=0.0043"];
        let ladder = climbed(&hidden, Motion::Multisine { travel: 6.0 }, 100.0, seed);
        assert_eq!(added(&ladder), ["delay", "rate-hysteresis"], "seed {seed}: {}", ladder.in_words(Voice::Log));
    }
}

/// Undoing a resonance makes the gyro's noise large from one sample to the next, and reading it between samples, as a delay of
/// some microseconds does, makes it less.
#[test]
fn noise_that_a_resonance_made_large_is_not_taken_for_lateness() {
    let ladder = climbed(&["mount-resonance:f=8.986,zeta=0.0453"], Motion::Multisine { travel: 6.0 }, 500.0, 1);
    assert_eq!(added(&ladder), ["mount-resonance"], "{}", ladder.in_words(Voice::Log));
}

/// On a rate table most readings are taken while the rate is held. It is held where it came to, at the end of the play, and only
/// where that is known do they tell of anything else.
#[test]
#[ignore = "long: tests/nightly"]
fn a_play_does_not_hide_what_readings_at_held_rates_tell() {
    let table = Motion::RateTable { rate: 2.0, hold: 3.0 };
    for (other, both) in [
        ("scale-asymmetry:a=-0.0007", ["rate-hysteresis", "scale-asymmetry"]),
        ("cubic-nonlinearity:k3=0.0001", ["cubic-nonlinearity", "rate-hysteresis"]),
    ] {
        let ladder = climbed(&["rate-hysteresis:h=0.003", other], table, 200.0, 1);
        assert_eq!(added(&ladder), both, "{}", ladder.in_words(Voice::Log));
        assert_ne!(ladder.verdict, Verdict::CannotTell, "{}", ladder.in_words(Voice::Log));
    }
}

/// A slow sensor shows a tone at half its size or less, and not when it was: what it felt is what a model's tone is.
#[test]
fn a_tone_is_found_that_a_slow_sensor_reads() {
    for motion in [Motion::Multisine { travel: 6.0 }, Motion::Drive { rate: 1.2, hold: 2.0 }] {
        let ladder = climbed(&["lag:tau=0.02", "vibration-tone:a_sin=0.03,a_cos=0.01,f=17.3"], motion, 100.0, 1);
        assert_eq!(added(&ladder), ["lag", "vibration-tone"], "{motion:?}: {}", ladder.in_words(Voice::Log));
    }
}

/// The steps of an encoder draw lines where a rate is held, higher than a slow tone, which drowns in the motion of the reading.
#[test]
fn a_slow_tone_is_found_below_the_lines_of_an_encoder_at_held_rates() {
    for seed in [1, 2, 3] {
        let table = Motion::RateTable { rate: 0.5, hold: 3.0 };
        let ladder = climbed(&["vibration-tone:a_sin=0.0015,a_cos=0.0008,f=1.7"], table, 200.0, seed);
        assert_eq!(added(&ladder), ["vibration-tone"], "seed {seed}: {}", ladder.in_words(Voice::Log));
    }
}

/// One frequency does not tell how late a sensor is from how it swings: beside gravity, which goes with the same sine, a
/// resonance leaves as little, and says it with more.
#[test]
fn what_is_late_on_one_sine_is_said_by_the_plainest() {
    let sine = Motion::Sine { amplitude: 1.4652, frequency: 0.46817 };
    for seed in [19_400_008, 3] {
        let sensor = SensorSpec { axis: Axis::X, horizontal: true, ..SensorSpec::random(seed) };
        let hidden = ["delay:d=0.0134", "g-sensitivity:g_x=0,g_y=0,g_z=-0.00104"];
        let ladder = climbed_with(sensor, &hidden, sine, 100.0, seed);
        let ids = added(&ladder);
        let is_late = |id: &&str| ["delay", "lag"].contains(id);
        assert!(
            ids.iter().any(is_late) && !ids.contains(&"mount-resonance"),
            "seed {seed}: {ids:?}, {}",
            ladder.in_words(Voice::Log)
        );
    }
}

/// A bias that drifts makes more error than a tone ever does, and hides it from the error, but not from the spectrum.
#[test]
fn a_felt_tone_is_found_beside_any_wander() {
    for seed in [1, 2, 3] {
        let sensor = SensorSpec { noise_density: 3.3e-4, ..SensorSpec::on(Axis::X) };
        let hidden = ["warm-up:a=-0.00186,tau=41", "vibration-tone:a_sin=0.0019,a_cos=0.0025,f=8.24"];
        let ladder = climbed_with(sensor, &hidden, Motion::Multisine { travel: 6.0 }, 100.0, seed);
        assert!(
            added(&ladder).contains(&"vibration-tone"),
            "seed {seed}: {:?}, {}",
            ladder.effects,
            ladder.in_words(Voice::Log)
        );
    }
}

/// While a warm-up is missing a mounting askew does not show, nor the other way round: `diagnose` names both, as the ladder adds them.
#[test]
fn what_the_ladder_finds_by_looking_ahead_is_said_to_be_missing() {
    let axis = Axis::X;
    let hidden = ["cross-axis", "warm-up:a=0.02,tau=20"].map(|text| Hidden::parse(text, axis).unwrap()).to_vec();
    let motion = Motion::Multisine { travel: 5.0 };
    let scenario = Scenario { motion, seconds: 60.0, rate_hz: 100.0, sensor: SensorSpec::on(axis), hidden, seed: 3 };
    let record = simulate(&scenario).record;
    assert_eq!(added(&ladder_of(&record, axis)), ["cross-axis", "warm-up"]);
    let axes = diagnose::diagnose(&record, &Model::base_for(&record), &[axis], &Options::default()).unwrap();
    let (found, mut named) = (&axes[0], axes[0].suspects.iter().map(|s| s.effect.as_str()).collect::<Vec<_>>());
    named.sort_unstable();
    assert_eq!(
        (found.verdict, named),
        (Verdict::MissingEffect, vec!["cross-axis", "warm-up"]),
        "{}",
        found.in_words(Voice::Log)
    );
}

/// A driver that takes slow turning for rest sets its zero by it, and sets it right at the next rest: two steps that undo one another.
#[test]
fn a_zero_that_leaves_and_comes_back_is_said_with_both_instants() {
    for (seed, size) in [(1, -0.05), (2, 0.02), (3, 0.03)] {
        let scenario =
            Scenario { motion: Motion::Multisine { travel: 3.0 }, seconds: 100.0, seed, ..Scenario::default() };
        let mut record = simulate(&scenario).record;
        let away = 31_000_000_000..58_000_000_000;
        for row in record.rows.iter_mut().filter(|row| away.contains(&row.t_ns)) {
            row.gyro[0] += size;
        }
        let ladder = ladder_of(&record, Axis::X);
        let Finding::Unexplained(Excess::OtherZero { size: found, when, .. }) = ladder.finding else {
            panic!("seed {seed}: {}", ladder.in_words(Voice::Log))
        };
        let ZeroMoves::ForAWhile { between: [from, to] } = when else { panic!("seed {seed}: {when:?}") };
        assert!((found / size - 1.0).abs() < 0.05, "seed {seed}: {found}");
        assert!((from - 31.0).abs() < 1.0 && (to - 58.0).abs() < 1.0, "seed {seed}: {from} to {to} s");
    }
}

/// Gravity on a horizontal shaft, and no accelerometer to say so: its size is found, and it is no bias that wanders within seconds.
#[test]
fn a_zero_that_depends_on_the_shafts_angle_is_no_wandering_bias() {
    let size = 9.81 * 3.6e-4;
    for (seed, motion) in [(1, Motion::RateTable { rate: 1.5, hold: 3.0 }), (2, Motion::Multisine { travel: 3.0 })] {
        let hidden = vec![Hidden::parse("g-sensitivity:g_x=0,g_y=0.0003,g_z=0.0002", Axis::X).unwrap()];
        let scenario = Scenario { motion, seconds: 60.0, hidden, seed, ..Scenario::default() };
        let mut record = simulate(&scenario).record;
        let named = diagnosed(&record).suspects.first().map(|suspect| suspect.effect.clone());
        assert_eq!(named.as_deref(), Some("g-sensitivity"), "seed {seed}");
        record.rows.iter_mut().for_each(|row| row.accel = [f64::NAN; 3]);
        let found = diagnosed(&record);
        let Finding::Unexplained(Excess::OtherZero { size: by, when: ZeroMoves::WithAngle, .. }) = found.finding else {
            panic!("seed {seed}: {}", found.in_words(Voice::Log))
        };
        assert!((by / size - 1.0).abs() < 0.05, "seed {seed}: {by} for {size}");
    }
}

fn diagnosed(record: &Record) -> AxisResult {
    diagnosed_with(record, &Options::default())
}

fn diagnosed_with(record: &Record, options: &Options) -> AxisResult {
    let found = diagnose::diagnose(record, &Model::base_for(record), &[Axis::X], options).unwrap();
    found.into_iter().next().unwrap()
}

/// Clocks that were set to each other by the motion: what is left of their offset is no effect of the gyro, and spoils no other one.
#[test]
fn what_is_left_of_an_offset_between_two_clocks_is_no_delay() {
    let hidden = ["scale-asymmetry:a=0.006", "delay:d=0.005"];
    let hidden = hidden.iter().map(|text| Hidden::parse(text, Axis::X).unwrap()).collect();
    let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
    let scenario = Scenario { motion, seconds: 60.0, hidden, seed: 1, ..Scenario::default() };
    let record = simulate(&scenario).record;
    let named = |found: &AxisResult| -> Vec<String> {
        let (Finding::Missing { effects, .. } | Finding::Ambiguous { effects, .. }) = &found.finding else {
            panic!("{}", found.in_words(Voice::Log))
        };
        effects.iter().map(|named| named.effect.clone()).sorted().collect()
    };
    assert_eq!(named(&diagnosed(&record)), ["delay", "scale-asymmetry"]);
    let faults = [DataFault {
        kind: FaultKind::OtherClock,
        axis: None,
        count: record.rows.len() as u64,
        first_t: None,
        says: String::new(),
    }];
    let found = diagnosed_with(&record, &Options { faults: &faults, ..Options::default() });
    assert_eq!(named(&found), ["scale-asymmetry"]);
    let size = found.suspects[0].parameters.iter().find(|p| p.name == "a").and_then(|p| p.value).unwrap();
    assert!((size - 0.006).abs() < 3e-4, "{size}");
}
