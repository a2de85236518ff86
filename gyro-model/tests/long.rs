//! Logs of half an hour and more, over which the bias of any gyro wanders.

use gyro_model::{
    Axis, Model, Record,
    diagnose::{Options, compare, ladder},
    diagnosis::{AxisResult, LimitedBy, Verdict},
    effects,
    fit::fit,
    simulate::{Hidden, Motion, Scenario, simulate},
    words::Voice,
};

/// Half an hour and more with one hidden effect, or none.
fn recorded(id: Option<&str>, seconds: f64, seed: u64) -> Record {
    let hidden = id.map(|id| Hidden::typical(effects::find(id).unwrap(), Axis::X)).into_iter().collect();
    let motion = Motion::Multisine { travel: 8.0 };
    let scenario = Scenario { motion, seconds, rate_hz: 25.0, seed, hidden, ..Scenario::default() };
    simulate(&scenario).record
}

/// What it tells.
fn climbed(id: Option<&str>, seconds: f64, seed: u64) -> AxisResult {
    let record = recorded(id, seconds, seed);
    ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap().1.remove(0)
}

fn largest(ladder: &AxisResult) -> f64 {
    ladder.steps.last().unwrap().error_over_floor.unwrap()
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_bias_that_wanders_over_a_long_log_is_noise_of_the_gyro() {
    for seed in [5, 6] {
        let clean = climbed(None, 1800.0, seed);
        assert_eq!(clean.verdict, Verdict::Adequate, "{}", clean.in_words(Voice::Log));
        assert!(largest(&clean) < 2.0, "{}", largest(&clean));
        let last = clean.budget.last().unwrap();
        assert!(last.share(LimitedBy::BiasWander) > 0.5, "{last:?}");
    }
}

/// Without a search a slow effect may do the same, and neither is said.
#[test]
fn a_model_held_against_a_long_log_leaves_a_zero_that_drifts_or_a_slow_effect() {
    let record = recorded(None, 1800.0, 5);
    let model = fit(&record, &Model::base_for(&record), &[Axis::X]).unwrap();
    let held =
        compare(&record, &model, &[Axis::X], &Options { own_log: true, ..Options::default() }).unwrap().remove(0);
    assert!(held.error_over_floor.unwrap() > 3.0, "{:?}", held.error_over_floor);
    assert_eq!(held.verdict, Verdict::CannotTell, "{}", held.in_words(Voice::Log));
    assert!(
        held.in_words(Voice::Log).starts_with("what is left may be a wandering bias or a slow effect"),
        "{}",
        held.in_words(Voice::Log)
    );
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_bias_that_steps_soon_after_a_long_log_begins_is_found() {
    let found = climbed(Some("bias-step"), 1800.0, 77);
    assert_eq!(found.effects[2..], ["bias-step"], "{}", found.in_words(Voice::Log));
    let instant = found.parameters.iter().find(|p| p.name == "t0").unwrap();
    assert!((instant.value.unwrap() - 30.0).abs() < 1.0, "{instant:?}");
}

/// What is slow and in the catalogue is named all the same.
#[test]
#[ignore = "long: tests/nightly"]
fn a_wandering_bias_hides_no_warm_up() {
    let found = climbed(Some("warm-up"), 1800.0, 3);
    assert_eq!(found.effects[2..], ["warm-up"], "{}", found.in_words(Voice::Log));
}
