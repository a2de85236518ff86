//! Logs of half an hour and more, over which the bias of any gyro wanders.

use gyro_model::{
    Axis, Model,
    diagnose::{Options, ladder},
    diagnosis::{AxisLadder, Verdict},
    effects,
    simulate::{Hidden, Motion, Scenario, simulate},
};

/// What half an hour and more tells of one hidden effect, or none.
fn climbed(id: Option<&str>, seconds: f64, seed: u64) -> AxisLadder {
    let hidden = id.map(|id| Hidden::typical(effects::find(id).unwrap(), Axis::X)).into_iter().collect();
    let motion = Motion::Multisine { travel: 8.0 };
    let scenario = Scenario { motion, seconds, rate_hz: 25.0, seed, hidden, ..Scenario::default() };
    let record = simulate(&scenario).record;
    ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap().1.remove(0)
}

fn largest(ladder: &AxisLadder) -> f64 {
    ladder.steps.last().unwrap().error_over_floor.unwrap()
}

#[test]
fn a_bias_that_wanders_over_a_long_log_is_noise_of_the_gyro() {
    for seed in [5, 6] {
        let clean = climbed(None, 1800.0, seed);
        assert_eq!(clean.verdict, Verdict::Adequate, "{}", clean.says);
        assert!(largest(&clean) < 2.0, "{}", largest(&clean));
        let last = clean.budget.last().unwrap();
        assert!(last.bias_wander.unwrap() > 0.5 * last.total(), "{last:?}");
    }
}

#[test]
fn a_bias_that_steps_soon_after_a_long_log_begins_is_found() {
    let found = climbed(Some("bias-step"), 1800.0, 77);
    assert_eq!(found.effects[2..], ["bias-step"], "{}", found.says);
    let instant = found.parameters.iter().find(|p| p.name == "t0").unwrap();
    assert!((instant.value.unwrap() - 30.0).abs() < 1.0, "{instant:?}");
}

/// What is slow and in the catalogue is named all the same.
#[test]
fn a_wandering_bias_hides_no_warm_up() {
    let found = climbed(Some("warm-up"), 1800.0, 3);
    assert_eq!(found.effects[2..], ["warm-up"], "{}", found.says);
}
