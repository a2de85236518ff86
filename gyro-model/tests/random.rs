//! Random causes on whole logs: found with their sizes, and not where there are none.

use gyro_model::{
    Axis, Model, Record,
    diagnose::{Options, compare, ladder},
    diagnosis::{AxisResult, LimitedBy, Verdict},
    simulate::{Hidden, Motion, RandomCauses, Reference, Scenario, SensorSpec, SetUp, Simulator},
};

const MULTISINE: Motion = Motion::Multisine { travel: 8.0 };
const DRIVE: Motion = Motion::Drive { rate: 1.2, hold: 2.0 };

fn record(cause: Option<&str>, motion: Motion, seed: u64, hidden: Vec<Hidden>) -> Record {
    let scenario = Scenario { motion, seed, seconds: 90.0, hidden, ..Scenario::default() };
    let mut random = RandomCauses::default();
    if let Some(text) = cause {
        random.take(text).expect("a random cause").expect("its size");
    }
    let samples: Vec<_> = Simulator::new(&scenario).take(9000).collect();
    let rows = SetUp { random, ..SetUp::default() }.applied(&samples, Axis::X, 100.0, seed);
    Record { rows, ..Record::default() }
}

fn climbed(cause: Option<&str>, motion: Motion, seed: u64, hidden: Vec<Hidden>) -> AxisResult {
    let record = record(cause, motion, seed, hidden);
    let model = Model::base_for(&record);
    ladder(&record, &model, &[Axis::X], &Options::default()).unwrap().1.remove(0)
}

#[test]
fn steps_at_reversals_are_found_with_their_size_and_no_effect_is_named_for_them() {
    for (motion, seed) in [(MULTISINE, 2), (MULTISINE, 3), (MULTISINE, 4)] {
        let ladder = climbed(Some("reversal-steps:size=0.006"), motion, seed, Vec::new());
        let found = ladder.random.iter().find(|found| found.cause == LimitedBy::ReversalSteps);
        let found = found.unwrap_or_else(|| panic!("{seed}: {:?}", ladder.random));
        let (size, error) = (found.size.unwrap(), found.std_error.unwrap());
        assert!((size - 0.006).abs() < 4.0 * error.max(3e-4), "{seed}: {size} ± {error}");
        assert_eq!(ladder.effects, ["scale-factor", "bias"], "{seed}");
        assert_eq!(ladder.verdict, Verdict::Adequate, "{seed}: {}", ladder.says);
        assert_eq!(ladder.limited_by, Some(LimitedBy::ReversalSteps), "{seed}");
    }
}

#[test]
fn a_delay_is_found_beside_steps_at_reversals() {
    let late = Hidden::parse("delay", Axis::X).unwrap();
    let ladder = climbed(Some("reversal-steps"), MULTISINE, 4, vec![late]);
    assert_eq!(ladder.effects, ["scale-factor", "bias", "delay"]);
    assert!(ladder.random.iter().any(|found| found.cause == LimitedBy::ReversalSteps), "{:?}", ladder.random);
}

#[test]
fn a_scale_that_wanders_is_found_with_its_size() {
    let ladder = climbed(Some("random-scale:size=0.006"), MULTISINE, 5, Vec::new());
    let found = ladder.random.iter().find(|found| found.cause == LimitedBy::RandomScale).expect("found");
    let (size, error) = (found.size.unwrap(), found.std_error.unwrap());
    assert!((size - 0.006).abs() < 4.0 * error.max(5e-4), "{size} ± {error}");
}

#[test]
#[ignore = "long: tests/nightly"]
fn on_a_drive_a_random_cause_is_called_by_its_own_name_alone() {
    for (cause, is) in [
        ("random-scale:size=0.005", LimitedBy::RandomScale),
        ("reversal-steps:size=0.005", LimitedBy::ReversalSteps),
        ("start-stop-steps:size=0.005", LimitedBy::StartStopSteps),
    ] {
        for seed in [11, 12, 15] {
            let ladder = climbed(Some(cause), DRIVE, seed, Vec::new());
            let found: Vec<LimitedBy> = ladder.random.iter().map(|found| found.cause).collect();
            assert_eq!(found, [is], "{cause}, seed {seed}");
        }
    }
}

/// The steps move the fitted scale factor; what that makes of the error goes with the rate as a wandering scale would.
#[test]
fn what_a_few_large_steps_make_of_the_fitted_scale_is_no_scale_that_wanders() {
    let mut random = RandomCauses::default();
    random.take("reversal-steps:size=0.02").expect("a random cause").expect("its size");
    for seed in [34, 35, 38] {
        let sensor = SensorSpec { reference: Reference::Rate, reference_every: 1, ..SensorSpec::on(Axis::X) };
        let motion = Motion::RateTable { rate: 2.0, hold: 4.0 };
        let scenario = Scenario { motion, seed, seconds: 60.0, sensor, ..Scenario::default() };
        let samples: Vec<_> = Simulator::new(&scenario).take(6000).collect();
        let rows = SetUp { random, ..SetUp::default() }.applied(&samples, Axis::X, 100.0, seed);
        let record = Record { rows, ..Record::default() };
        let ladder = ladder(&record, &Model::base_for(&record), &[Axis::X], &Options::default()).unwrap().1.remove(0);
        let found: Vec<LimitedBy> = ladder.random.iter().map(|found| found.cause).collect();
        assert_eq!(found, [LimitedBy::ReversalSteps], "seed {seed}");
    }
}

#[test]
fn rows_that_say_nothing_make_no_random_cause() {
    let range = Hidden::parse("saturation:l=2.0", Axis::X).unwrap();
    let ladder = climbed(None, MULTISINE, 13, vec![range]);
    assert_eq!(ladder.effects, ["scale-factor", "bias", "saturation"]);
    assert!(ladder.random.is_empty(), "{:?}", ladder.random);
}

#[test]
fn a_clean_log_has_no_random_cause() {
    for (motion, seed) in [(MULTISINE, 6), (DRIVE, 7), (DRIVE, 8), (MULTISINE, 9)] {
        let ladder = climbed(None, motion, seed, Vec::new());
        assert!(ladder.random.is_empty(), "{seed}: {:?}", ladder.random);
    }
}

#[test]
fn before_anybody_looked_for_effects_what_they_make_is_no_random_cause() {
    // What a delay makes of a drive is largest at starts and reversals.
    for seed in [12, 13, 14] {
        let late = Hidden::parse("delay:d=0.012", Axis::X).unwrap();
        let record = record(None, DRIVE, seed, vec![late]);
        let options = Options { own_log: true, ..Options::default() };
        let judged = compare(&record, &Model::base_for(&record), &[Axis::X], &options).unwrap().remove(0);
        assert!(judged.random.is_empty(), "{seed}: {:?}", judged.random);
        assert_eq!(judged.limited_by, Some(LimitedBy::Unattributed), "{seed}");
    }
}
