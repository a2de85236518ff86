//! Physics is no fault, whatever it does to the readings; a fault is found beside physics.

use super::check;
use crate::{
    Axis, Record,
    effects::CATALOGUE,
    simulate::{Hidden, Motion, Scenario, simulate},
};

fn motions() -> [Motion; 3] {
    ["sine", "multisine", "drive"].map(|name| name.parse().unwrap())
}

fn simulated(hidden: Vec<Hidden>, motion: Motion, seed: u64) -> Record {
    simulate(&Scenario { motion, seconds: 30.0, hidden, seed, ..Scenario::default() }).record
}

#[test]
fn no_effect_of_the_catalogue_is_taken_for_a_fault() {
    for effect in CATALOGUE {
        for motion in motions() {
            let mut record = simulated(vec![Hidden::typical(*effect, Axis::X)], motion, 3);
            let before = record.clone();
            let report = check(&mut record, &[]);
            assert!(report.faults.is_empty(), "{} on {motion:?}: {:?}", effect.card().id, report.faults);
            assert_eq!(report.rows_marked, 0);
            let same = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(record.rows.iter().zip(&before.rows).all(|(a, b)| same(&a.gyro, &b.gyro)));
        }
    }
}

#[test]
fn a_wide_dead_zone_and_a_narrow_range_are_physics() {
    for text in ["dead-zone:w=0.15", "saturation:l=0.8"] {
        for motion in motions() {
            let hidden = vec![Hidden::parse(text, Axis::X).unwrap()];
            let report = check(&mut simulated(hidden, motion, 4), &[]);
            assert!(report.faults.is_empty(), "{text} on {motion:?}: {:?}", report.faults);
        }
    }
}

#[test]
fn spikes_are_taken_out_where_they_are_and_nowhere_else() {
    for motion in motions() {
        let mut record = simulated(vec![], motion, 5);
        let places = [100, 333, 334, 1200, 2500];
        for k in places {
            record.rows[k].gyro[0] += 30.0;
        }
        let report = check(&mut record, &[]);
        assert_eq!(report.faults.len(), 1, "{:?}", report.faults);
        assert_eq!((report.faults[0].fault.as_str(), report.faults[0].count), ("outliers", 5));
        let out: Vec<usize> = (0..record.len()).filter(|&k| record.rows[k].gyro[0].is_nan()).collect();
        assert_eq!(out, places);
    }
}

#[test]
fn a_sample_logged_again_is_found_among_quantised_ones() {
    let mut record = simulated(vec![], Motion::default(), 6);
    for k in [200, 500, 501, 900, 1500, 2000, 2100, 2200, 2800] {
        let before = record.rows[k - 1];
        (record.rows[k].gyro, record.rows[k].accel) = (before.gyro, before.accel);
    }
    let report = check(&mut record, &[]);
    assert_eq!(report.faults.len(), 1, "{:?}", report.faults);
    assert_eq!((report.faults[0].fault.as_str(), report.faults[0].count), ("repeated-samples", 9));
}

#[test]
fn a_log_of_nothing_is_no_trouble() {
    check(&mut Record::default(), &[]);
    let mut record = simulated(vec![], Motion::default(), 7);
    record.rows.truncate(1);
    assert!(check(&mut record, &[]).rows_marked == 0);
    for row in &mut record.rows {
        *row = crate::Row::EMPTY;
    }
    check(&mut record, &[]);
}
