use super::*;
use crate::{Row, faults::check};

fn swinging(spoil: impl Fn(u16, &mut Row)) -> Record {
    let row = |k: u16| {
        let t = f64::from(k) * 0.01;
        let mut row = Row { t_ns: i64::from(k) * 10_000_000, ..Row::EMPTY };
        row.gyro[2] = 2.6 * (1.3 * t).cos() + 1e-3 * (f64::from(k) * 1.7).sin();
        row.ref_angle[2] = ((2.0 * (1.3 * t).sin()) / 0.0015).round() * 0.0015;
        spoil(k, &mut row);
        row
    };
    Record { rows: (0..6000).map(row).collect(), ..Record::default() }
}

#[test]
fn an_encoder_that_slips_is_set_back_and_told() {
    let whole = swinging(|_, _| ());
    let mut slipped = swinging(|k, row| row.ref_angle[2] += if k >= 3000 { 0.35 } else { 0.0 });
    let report = check(&mut slipped, &[]);
    let found = report.faults.iter().find(|fault| fault.says.contains("does not feel")).expect("a slip");
    assert!((found.first_t.unwrap() - 30.0).abs() < 1e-9 && found.count == 1, "{found:?}");
    for (a, b) in slipped.rows.iter().zip(&whole.rows) {
        assert!((a.ref_angle[2] - b.ref_angle[2]).abs() < 0.01);
    }
}

#[test]
fn a_shaft_that_is_jerked_has_not_slipped() {
    // Turned on by 0.4 rad within a row, which the gyro reads a row later.
    let mut jerked = swinging(|k, row| {
        row.ref_angle[2] += if k >= 3000 { 0.4 } else { 0.0 };
        row.gyro[2] += if (3001..3004).contains(&k) { 13.3 } else { 0.0 };
    });
    let report = check(&mut jerked, &[]);
    assert!(report.faults.iter().all(|fault| !fault.says.contains("does not feel")), "{:?}", report.faults);
}

#[test]
fn small_steps_that_stay_are_set_back_and_those_of_a_clock_or_of_reversals_are_not() {
    let faults = |record: &mut Record| check(record, &[]).faults;
    let of_steps = |record: &mut Record| -> Option<u64> {
        faults(record).iter().find(|fault| fault.says.contains("does not feel")).map(|fault| fault.count)
    };
    let whole = swinging(|_, _| ());
    let by = |k: u16| f64::from(u8::from(k >= 1500)) * 0.02 - f64::from(u8::from(k >= 4200)) * 0.013;
    let mut slipped = swinging(|k, row| row.ref_angle[2] += by(k));
    assert_eq!(of_steps(&mut slipped), Some(2));
    for (a, b) in slipped.rows.iter().zip(&whole.rows) {
        assert!((a.ref_angle[2] - b.ref_angle[2]).abs() < 0.005);
    }
    // Away for 40 ms: what lies between says nothing.
    let mut back = swinging(|k, row| row.ref_angle[2] += if (3000..3004).contains(&k) { 0.03 } else { 0.0 });
    assert_eq!(of_steps(&mut back), Some(2));
    assert!((3000..3004).all(|k| back.rows[k].ref_angle[2].is_nan()) && back.rows[3004].ref_angle[2].is_finite());
    // 10 ms later from 30 s on: a step of the rate times so much, and more of it wherever it turns.
    let mut later = swinging(|k, row| {
        let t = f64::from(k) * 0.01 - if k >= 3000 { 0.01 } else { 0.0 };
        row.ref_angle[2] = ((2.0 * (1.3 * t).sin()) / 0.0015).round() * 0.0015;
    });
    assert_eq!(of_steps(&mut later), None);
    // A step at each reversal is a random cause.
    let mut reversing = swinging(|k, row| {
        let half_turns = ((1.3 * f64::from(k) * 0.01 - std::f64::consts::FRAC_PI_2) / std::f64::consts::PI).floor();
        row.ref_angle[2] += 0.01 * (half_turns * 1.7).sin();
    });
    assert_eq!(of_steps(&mut reversing), None);
}
