//! Where an encoder slipped: its angle jumps once, and goes on from there, while the gyro feels nothing of it.

use super::{Report, counted, quantile, reference::wraps_in_degrees, seconds, spikes::unwrap};
use crate::{Axis, Record};
use std::f64::consts::TAU;

/// A slip is so many times longer than nearly all other steps of the angle.
const FACTOR: f64 = 4.0;
/// Share of the steps that are nearly all.
const NEARLY_ALL: f64 = 0.99;
/// And so many times longer than those beside it differ by.
const STANDS_OUT: f64 = 8.0;
/// Steps on each side that it is compared with.
const REACH: usize = 5;
/// Share of a slip that the gyro may have turned by in a step meanwhile.
const FELT: f64 = 0.25;
/// An encoder that slips more often is none.
const MOST: usize = 20;

/// Takes slips out of the shaft's angles, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        let i = axis.index();
        let rows: Vec<usize> = (0..record.len()).filter(|&k| record.rows[k].ref_angle[i].is_finite()).collect();
        let slips = slips(record, i, &rows);
        let Some(&(first, size)) = slips.first().filter(|_| slips.len() <= MOST) else { continue };
        let mut slipped = 0.0;
        let mut next = slips.iter().peekable();
        for (k, &row) in rows.iter().enumerate() {
            slipped += next.next_if(|slip| slip.0 == k).map_or(0.0, |slip| slip.1);
            record.rows[row].ref_angle[i] -= slipped;
        }
        let t = seconds(record, rows[first]);
        let says = format!(
            "ref_angle_{axis}: {} that the gyro does not feel, the first by {:.3}°: taken out, as where an encoder slips or a tracker \
             begins anew; check its coupling",
            counted(slips.len(), "jump"),
            size.to_degrees()
        );
        report.add_on(axis, "outliers", slips.len() as u64, Some(t), says);
    }
}

/// The readings that an angle jumps at, and by how much, rad.
fn slips(record: &Record, i: usize, rows: &[usize]) -> Vec<(usize, f64)> {
    let mut angle: Vec<f64> = rows.iter().map(|&row| record.rows[row].ref_angle[i]).collect();
    let whole = if wraps_in_degrees(&angle) { 360.0 } else { TAU };
    unwrap(&mut angle, whole);
    let steps: Vec<f64> = angle.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual) = quantile(steps.iter().map(|step| step.abs()).collect(), NEARLY_ALL).filter(|usual| *usual > 0.0)
    else {
        return Vec::new();
    };
    let time = |k: usize| record.rows[rows[k]].t_ns as f64 * 1e-9;
    let last = steps.len().saturating_sub(REACH);
    let slip = |k: usize| {
        let around: Vec<f64> = (k - REACH..k).chain(k + 1..=k + REACH).map(|other| steps[other]).collect();
        let middle = quantile(around.clone(), 0.5)?;
        let size = steps[k] - middle;
        let spread = around.iter().map(|step| (step - middle).abs()).fold(0.0, f64::max);
        let turned = |row: usize| record.rows[row].gyro[i].abs() * (time(k + 1) - time(k));
        let felt: Vec<f64> = (rows[k - REACH]..=rows[k + REACH]).map(turned).filter(|x| x.is_finite()).collect();
        let most = felt.iter().copied().fold(0.0, f64::max);
        let stands_out = size.abs() > (FACTOR * usual).max(STANDS_OUT * spread);
        (stands_out && felt.len() >= REACH && most < FELT * size.abs()).then_some((k + 1, size))
    };
    (REACH..last).filter_map(slip).collect()
}

#[cfg(test)]
mod tests {
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
}
