//! Physics is no fault, whatever it does to the readings; a fault is found beside physics.

use super::check;
use crate::{
    Axis, Record, Row,
    effects::CATALOGUE,
    fault::FaultKind,
    simulate::{Hidden, Motion, Reference, Scenario, SensorSpec, simulate},
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

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
        assert_eq!((report.faults[0].kind.name(), report.faults[0].count), ("outliers", 5));
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
    assert_eq!((report.faults[0].kind.name(), report.faults[0].count), ("repeated-samples", 9));
}

#[test]
fn of_readings_that_stand_in_several_rows_the_first_is_left() {
    // Rows in which a new reading comes: at whole and at broken ratios of the rates.
    let is_new = |k: usize, ratio: f64| (k as f64 / ratio) as usize != ((k - 1) as f64 / ratio) as usize;
    for motion in motions() {
        for ratio in [2.0, 3.3, 5.0] {
            let mut record = simulate(&Scenario { motion, rate_hz: 200.0, ..Scenario::default() }).record;
            record.rows.retain(|row| row.ref_angle[0].is_finite());
            let whole = record.clone();
            for k in 1..record.len() {
                if !is_new(k, ratio) {
                    record.rows[k].gyro = record.rows[k - 1].gyro;
                    record.rows[k].ref_angle = record.rows[k - 1].ref_angle;
                }
            }
            let report = check(&mut record, &[]);
            let found: Vec<&str> = report.faults.iter().map(|f| f.kind.name()).collect();
            assert!(found.contains(&"held-samples") && report.rows_marked == 0, "{motion:?}, {ratio}: {found:?}");
            let stale = |k: &usize| {
                let (row, own) = (&record.rows[*k], &whole.rows[*k]);
                let late = |a: f64, b: f64| a.is_finite() && a.to_bits() != b.to_bits();
                late(row.gyro[0], own.gyro[0]) || late(row.ref_angle[0], own.ref_angle[0])
            };
            // Where a reading repeats by itself at a broken ratio, one a row older than the newest may be left.
            assert!(ratio.fract() != 0.0 || (1..record.len()).all(|k| !stale(&k)), "{motion:?}, {ratio}");
            let left = record.rows.iter().filter(|row| row.gyro[0].is_finite()).count() as f64;
            assert!((left * ratio / record.len() as f64 - 1.0).abs() < 0.02, "{motion:?}, {ratio}: {left}");
        }
    }
}

#[test]
fn readings_that_noise_of_a_few_steps_makes_alike_are_not_held() {
    for steps in [1.0, 2.0, 3.0, 4.0] {
        let mut sensor = SensorSpec::default();
        sensor.quantum = sensor.noise_density * (0.5_f64 * 400.0).sqrt() / steps;
        let scenario = Scenario { seconds: 90.0, rate_hz: 400.0, sensor, ..Scenario::default() };
        let faults = check(&mut simulate(&scenario).record, &[]).faults;
        assert!(faults.iter().all(|fault| fault.kind != FaultKind::HeldSamples), "{steps}: {faults:?}");
    }
}

#[test]
fn readings_of_whole_steps_that_the_reference_is_stamped_after_are_not_held() {
    let sensor = SensorSpec { quantum: 1_f64.to_radians(), ..SensorSpec::default() };
    let motion = Motion::Multisine { travel: 5.0 };
    let whole = simulate(&Scenario { motion, rate_hz: 250.0, seconds: 40.0, sensor, ..Scenario::default() }).record;
    let own_rows = whole.rows.iter().flat_map(|row| {
        let gyro = Row { ref_angle: [f64::NAN; 3], ..*row };
        let reference = Row { t_ns: row.t_ns + 40_000, ref_angle: row.ref_angle, ..Row::EMPTY };
        [gyro, reference]
    });
    let mut record = Record { rows: own_rows.collect(), ..Record::default() };
    let faults = check(&mut record, &[]).faults;
    assert!(faults.is_empty(), "{faults:?}");
    assert_eq!(record.len(), whole.len());
}

/// A log of three axes against an orientation, its four numbers changed on the way.
fn oriented(change: impl Fn(Quaternion<f64>) -> [f64; 4]) -> Record {
    let sensor = SensorSpec { reference: Reference::Quaternion, reference_noise: 1e-3, ..SensorSpec::default() };
    let mut record = simulate(&Scenario { seconds: 30.0, sensor, ..Scenario::default() }).record;
    for row in &mut record.rows {
        let [w, i, j, k] = row.ref_quaternion;
        row.ref_quaternion = change(Quaternion::new(w, i, j, k));
    }
    record
}

#[test]
fn an_orientation_that_is_meant_otherwise_is_said_so_and_how() {
    let says = |change: &dyn Fn(Quaternion<f64>) -> [f64; 4]| {
        let faults = check(&mut oriented(change), &[]).faults;
        faults.into_iter().map(|fault| format!("{}: {}", fault.kind, fault.says)).collect::<Vec<String>>()
    };
    let as_is = |q: Quaternion<f64>| [q.w, q.i, q.j, q.k];
    assert!(says(&as_is).is_empty(), "{:?}", says(&as_is));
    let inverse = says(&|q| as_is(q.conjugate()));
    assert!(inverse.len() == 1 && inverse[0].contains("negate ref_qx, ref_qy and ref_qz"), "{inverse:?}");
    let last = says(&|q| [q.i, q.j, q.k, q.w]);
    assert!(last.len() == 1 && last[0].contains("in the order x, y, z, w: the columns"), "{last:?}");
    let both = says(&|q| [-q.i, -q.j, -q.k, q.w]);
    assert!(both.len() == 1 && both[0].contains("in the order x, y, z, w, and as world to body"), "{both:?}");

    // What is said of axes in another order undoes it.
    let swapped = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1.6);
    let turned = says(&|q| as_is(q * swapped.inverse().into_inner()));
    assert!(
        turned.len() == 1 && turned[0].starts_with("swapped-axes: ") && turned[0].contains("turned by 92°"),
        "{turned:?}"
    );
    assert!(said_rotation(&turned[0]).angle_to(&swapped) < 0.02, "{turned:?}");
}

/// The rotation that a fault's words end with.
fn said_rotation(says: &str) -> UnitQuaternion<f64> {
    let numbers = says.split(" z = ").nth(1).unwrap();
    let said: Vec<f64> = numbers.split(", ").map(|word| word.split(' ').next().unwrap().parse().unwrap()).collect();
    UnitQuaternion::from_quaternion(Quaternion::new(said[0], said[1], said[2], said[3]))
}

#[test]
fn the_axes_of_a_reference_that_is_mounted_otherwise_are_turned_back() {
    let mounted = UnitQuaternion::from_euler_angles(0.8, -0.5, 2.4);
    let mut record = oriented(|q| {
        let q = q * mounted.inverse().into_inner();
        [q.w, q.i, q.j, q.k]
    });
    let straight = oriented(|q| [q.w, q.i, q.j, q.k]);
    let faults = check(&mut record, &[]).faults;
    assert!(faults.len() == 1 && faults[0].kind == FaultKind::TurnedReference, "{faults:?}");
    assert!(!faults[0].is_fatal(record.len()) && faults[0].says.contains("are turned back"), "{faults:?}");
    assert!(said_rotation(&faults[0].says).angle_to(&mounted) < 0.02, "{faults:?}");
    let orientation = |row: &Row| {
        let [w, i, j, k] = row.ref_quaternion;
        UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k))
    };
    for (row, straight) in record.rows.iter().zip(&straight.rows) {
        assert!(orientation(row).angle_to(&orientation(straight)) < 0.02, "at {} ns", row.t_ns);
    }

    // Where one gyro does not follow, the rotation is said and nothing is changed.
    for row in &mut record.rows {
        let q = orientation(row) * mounted.inverse();
        row.ref_quaternion = [q.w, q.i, q.j, q.k];
        row.gyro[2] += 0.9 * (row.t_ns as f64 * 2e-9).sin();
    }
    let before = record.rows[100].ref_quaternion;
    let faults = check(&mut record, &[]).faults;
    assert!(faults.iter().all(|fault| fault.kind != FaultKind::TurnedReference), "{faults:?}");
    assert_eq!(record.rows[100].ref_quaternion.map(f64::to_bits), before.map(f64::to_bits));
}

#[test]
fn a_log_of_nothing_is_no_trouble() {
    check(&mut Record::default(), &[]);
    let mut record = simulated(vec![], Motion::default(), 7);
    record.rows.truncate(1);
    assert!(check(&mut record, &[]).rows_marked == 0);
    for row in &mut record.rows {
        *row = Row::EMPTY;
    }
    check(&mut record, &[]);
}

#[test]
fn degrees_that_wrap_are_known_whatever_the_unit_of_the_gyro() {
    for gyro_too in [false, true] {
        let mut record = simulated(Vec::new(), "multisine".parse().unwrap(), 5);
        for row in &mut record.rows {
            row.ref_angle[0] = row.ref_angle[0].to_degrees().rem_euclid(360.0);
            if gyro_too {
                row.gyro[0] = row.gyro[0].to_degrees();
            }
        }
        let report = check(&mut record, &[]);
        let units = || report.faults.iter().filter(|fault| fault.kind == FaultKind::WrongUnit).map(|fault| &fault.says);
        let names = |says: &String| says.contains("ref_angle_x") && says.contains("_deg");
        assert!(units().any(names), "{:?}", units().collect::<Vec<_>>());
    }
}

#[test]
fn rows_faster_than_any_gyro_gives_them_are_a_wrong_unit_of_the_times() {
    let record = simulated(Vec::new(), "drive".parse().unwrap(), 3);
    for (divided, is_fault) in [(1, false), (1000, true)] {
        let mut record = record.clone();
        record.rows.iter_mut().for_each(|row| row.t_ns /= divided);
        let faults = check(&mut record, &[]).faults;
        let told =
            faults.iter().any(|fault| fault.kind == FaultKind::WrongUnit && fault.says.contains("name the times"));
        assert_eq!(told, is_fault, "{divided}: {faults:?}");
    }
}

#[test]
fn a_column_in_no_unit_that_it_can_have_is_not_used_and_one_in_another_unit_is_a_fault() {
    let record = simulated(Vec::new(), "drive".parse().unwrap(), 3);
    for (supply, kind) in [(1641.0, FaultKind::UnusedColumns), (3300.0, FaultKind::WrongUnit)] {
        let mut record = record.clone();
        record.rows.iter_mut().for_each(|row| row.supply = supply);
        let faults = check(&mut record, &[]).faults;
        assert_eq!(faults.iter().map(|fault| fault.kind).collect::<Vec<_>>(), [kind], "{faults:?}");
        assert_eq!(record.rows.iter().all(|row| row.supply.is_nan()), kind == FaultKind::UnusedColumns);
    }
}

#[test]
fn times_in_another_unit_are_one_fault_and_the_rest_is_judged_in_that_unit() {
    let record = simulated(Vec::new(), "drive".parse().unwrap(), 3);
    for (unit, in_a_second) in [("ms", 1_000), ("us", 1_000_000)] {
        let mut record = record.clone();
        record.rows.iter_mut().for_each(|row| row.t_ns *= in_a_second);
        record.rows[700].gyro[0] = f64::NAN;
        let times: Vec<i64> = record.rows.iter().map(|row| row.t_ns).collect();
        let faults = check(&mut record, &[]).faults;
        let kinds: Vec<FaultKind> = faults.iter().map(|fault| fault.kind).collect();
        assert_eq!(kinds, [FaultKind::WrongUnit, FaultKind::NonFinite], "{faults:?}");
        assert!(faults[0].says.ends_with(&format!("name it t_{unit}")), "{faults:?}");
        assert!((faults[1].first_t.unwrap() - 7.0).abs() < 1e-6, "{faults:?}");
        assert!(times.iter().eq(record.rows.iter().map(|row| &row.t_ns)));
    }
}
