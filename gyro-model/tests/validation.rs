//! A few logs of each study of `examples/validate`, on which nothing may go wrong.

#![allow(dead_code)] // the studies' own printing

#[path = "../examples/make_cases/choice.rs"]
mod choice;
#[path = "../examples/validate/detection.rs"]
mod detection;
#[path = "../examples/validate/false_alarms.rs"]
mod false_alarms;
#[path = "../examples/validate/naming.rs"]
mod naming;
#[path = "../examples/validate/oracle.rs"]
mod oracle;
#[path = "../examples/validate/outcome.rs"]
mod outcome;
#[path = "../examples/validate/pairs.rs"]
mod pairs;
#[path = "../examples/validate/picture.rs"]
mod picture;
#[path = "../examples/validate/probe.rs"]
mod probe;
#[path = "../examples/validate/run.rs"]
mod run;
#[path = "../examples/validate/several.rs"]
mod several;
#[path = "../examples/validate/table.rs"]
mod table;

use false_alarms::Kind;
use gyro_model::simulate::{Hidden, Motion, Scenario, simulate};
use gyro_model::words::Voice;
use naming::{Called, MOTIONS, hidden_log};
use outcome::Outcome;

/// Times the size that is named half of the time.
const TIMES: f64 = 5.0;

fn climbed(scenario: &Scenario) -> Outcome {
    Outcome::of(&simulate(scenario).record, scenario.sensor.axis, false).unwrap()
}

/// Of one log; `validate false-alarms` counts them over many.
fn no_alarm(kind: Kind) {
    let scenario = kind.scenario(choice::seed_of(1, 0), 0, 60.0, 100.0);
    let outcome = climbed(&scenario);
    assert!(!outcome.is_alarm(), "{}: {}", kind.name(), outcome.says());
}

#[test]
fn white_noise_raises_no_alarm() {
    no_alarm(Kind::White);
}

#[test]
fn a_rate_that_is_correlated_over_a_second_raises_no_alarm() {
    no_alarm(Kind::Ar);
}

#[test]
fn an_encoder_under_one_exact_sine_raises_no_alarm() {
    no_alarm(Kind::OneSine);
}

#[test]
fn flicker_noise_raises_no_alarm() {
    no_alarm(Kind::Flicker);
}

#[test]
fn noise_that_grows_with_rate_raises_no_alarm() {
    no_alarm(Kind::RateNoise);
}

#[test]
fn a_coarse_encoder_at_slow_turn_raises_no_alarm() {
    no_alarm(Kind::Quantised);
}

/// Every other effect, from `first` on.
fn all_named(first: usize) {
    let (name, motion) = MOTIONS[first];
    for id in choice::EFFECTS.into_iter().skip(first).step_by(2) {
        let scenario = hidden_log(id, motion, choice::seed_of(1, 0), TIMES).unwrap();
        let outcome = climbed(&scenario);
        assert!(Called::of(id, &outcome).is_right(id, scenario.motion), "{id} on {name}: {}", outcome.says());
    }
}

#[test]
#[ignore = "long: tests/nightly"]
fn effects_of_five_times_the_size_that_is_found_are_named_on_a_multisine() {
    all_named(0);
}

#[test]
#[ignore = "long: tests/nightly"]
fn effects_of_five_times_the_size_that_is_found_are_named_on_a_drive() {
    all_named(1);
}

#[test]
fn several_effects_at_once_are_all_found_and_none_is_invented() {
    all_found(choice::seed_of(1, 0), TIMES);
}

fn all_found(seed: u64, times: f64) {
    let scenario = several::draw(seed, times, true).unwrap();
    let outcome = climbed(&scenario);
    assert!(several::is_right(&scenario, &outcome), "{:?}, found {}", scenario.hidden, outcome.says());
}

/// Under one exact sine whose peaks are cut off an encoder's errors come again and again.
#[test]
fn an_encoder_is_not_blamed_for_steps_that_repeat_beside_a_saturation() {
    for k in [2, 6, 7] {
        let scenario = hidden_log("saturation", MOTIONS[2].1, choice::seed_of(79, k), TIMES).unwrap();
        let outcome = climbed(&scenario);
        assert_eq!(outcome.says(), "saturation", "{k}");
    }
}

/// What a temperature's own noise makes of its slope is an angle that the encoder does not see, and looks like a wander.
#[test]
fn a_heating_rate_is_told_from_a_wander_though_the_temperature_is_noisy() {
    let outcome = climbed(&choice::Case::random(choice::seed_of(211, 29)).scenario);
    assert_eq!(outcome.says(), "temperature-rate");
}

/// A clock's skew drowns a warm-up in what it leaves, and the readings that a dead zone takes out are bridged at a cost.
#[test]
fn two_that_hide_one_another_are_found_beside_a_dead_zone() {
    all_found(choice::seed_of(45, 57), 15.0);
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_log_too_long_to_be_searched_whole_shows_what_is_slow_and_what_is_fast() {
    let axis = gyro_model::Axis::X;
    let hidden = ["temperature-bias", "saturation:l=1.1", "delay:d=0.004"];
    let scenario = Scenario {
        motion: Motion::Drive { rate: 1.2, hold: 2.0 },
        seconds: 260.0,
        rate_hz: 500.0,
        hidden: hidden.iter().map(|h| Hidden::parse(h, axis).unwrap()).collect(),
        ..Scenario::default()
    };
    let record = simulate(&scenario).record;
    assert!(record.len() > gyro_model::fit::LONG);
    let outcome = Outcome::of(&record, axis, false).unwrap();
    let mut found: Vec<&str> = outcome.added.iter().map(|added| added.id.as_str()).collect();
    found.sort_unstable();
    assert_eq!(found, ["delay", "saturation", "temperature-bias"], "{}", outcome.says());
}

/// The ladder names these and nothing else, and what is left is noise.
fn explained(motion: Motion, seconds: f64, rate_hz: f64, hidden: &[&str]) -> Outcome {
    let axis = gyro_model::Axis::X;
    let effects = hidden.iter().map(|h| Hidden::parse(h, axis).unwrap()).collect();
    let outcome = climbed(&Scenario { motion, seconds, rate_hz, hidden: effects, ..Scenario::default() });
    let mut found: Vec<&str> = outcome.added.iter().map(|added| added.id.as_str()).collect();
    found.sort_unstable();
    let mut names: Vec<&str> = hidden.iter().map(|h| h.split(':').next().unwrap()).collect();
    names.sort_unstable();
    assert_eq!(found, names, "{}", outcome.says());
    let over = outcome.ladder.steps.last().unwrap().error_over_floor.unwrap();
    assert!(over < 1.4, "the error is {over} times the floor");
    outcome
}

#[test]
fn clocks_that_run_apart_leave_nothing_at_the_end_of_a_log() {
    explained(Motion::Sine { amplitude: 2.2, frequency: 0.34 }, 90.0, 200.0, &["clock-skew:s=-2e-3"]);
}

#[test]
fn what_is_cut_off_is_lost_where_a_late_reading_is_valid() {
    explained(Motion::Multisine { travel: 8.0 }, 60.0, 200.0, &["delay:d=0.06", "saturation:l=2.2"]);
}

#[test]
#[ignore = "long: tests/nightly"]
fn what_is_cut_off_is_lost_about_it_where_a_resonance_is_undone() {
    let hidden = ["mount-resonance:f=8,zeta=0.1", "saturation:l=2.2"];
    let outcome = explained(Motion::Multisine { travel: 8.0 }, 60.0, 200.0, &hidden);
    let found = outcome.ladder.parameters.iter().find(|p| p.name == "zeta").unwrap();
    let off = (found.value.unwrap() - 0.1) / found.std_error.unwrap();
    assert!(off.abs() < 3.0, "{off} standard errors");
}

#[test]
fn a_log_of_which_most_lies_inside_a_play_is_not_called_adequate() {
    let hidden = vec![Hidden::parse("rate-hysteresis:h=0.02", gyro_model::Axis::X).unwrap()];
    let motion = Motion::Drive { rate: 1.8, hold: 6.0 };
    let outcome = climbed(&Scenario { motion, seconds: 90.0, rate_hz: 100.0, hidden, ..Scenario::default() });
    assert!(outcome.names("rate-hysteresis"), "{}", outcome.says());
    assert_eq!(
        outcome.ladder.verdict,
        gyro_model::diagnosis::Verdict::CannotTell,
        "{}",
        outcome.ladder.in_words(Voice::Log)
    );
    assert!(outcome.ladder.in_words(Voice::Log).contains("inside a play"), "{}", outcome.ladder.in_words(Voice::Log));
}
