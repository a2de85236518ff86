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
