//! Gyro readings that are missing where the rows around have them.

use super::{Report, counted, seconds};
use crate::{Axis, Record, Row, fault::FaultKind};

/// Reports missing gyro readings. A gyro slower than the reference, or in rows of its own, has none missing.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let known = report.already.clone();
    for axis in Axis::ALL {
        let has = |k: usize| record.rows[k].gyro[axis.index()].is_finite();
        let present: Vec<usize> = (0..record.len()).filter(|&k| has(k)).collect();
        if present.is_empty() || in_rows_of_its_own(record, &present) {
            continue;
        }
        let missing: Vec<usize> = (0..record.len()).filter(|&k| !has(k) && !known[k]).collect();
        let Some(&first) = missing.first() else { continue };
        for &k in &missing {
            report.mark(k);
        }
        report.add_on(
            axis,
            FaultKind::NonFinite,
            missing.len() as u64,
            Some(seconds(record, first)),
            format!("gyro_{axis} has no value in {}, where the rows around have one", counted(missing.len(), "row")),
        );
    }
}

/// Whether readings usually don't stand in neighbouring rows, or never in rows of the reference.
fn in_rows_of_its_own(record: &Record, present: &[usize]) -> bool {
    let neighbours = present.windows(2).filter(|pair| pair[1] - pair[0] == 1).count();
    let apart = 2 * neighbours < present.len().saturating_sub(1);
    apart || record.rows.iter().any(has_reference) && !present.iter().any(|&k| has_reference(&record.rows[k]))
}

fn has_reference(row: &Row) -> bool {
    row.ref_angle.iter().chain(&row.ref_rate).chain(&row.ref_quaternion).any(|x| x.is_finite())
}
