//! Two streams of one rate that were stamped one after the other: gyro and reference of one instant in two rows, some microseconds apart.
//!
//! Such a log has twice as many rows as either sensor has readings, and its median step is the little time between the two stamps. So the
//! two rows become one, at the time of the reference; what the gyro and the accelerometer read is carried there along their own slope.
//!
//! ```text
//! g(t + δ) ≈ g(t) + δ g'(t),   δ less than a twentieth of the time between two readings
//! ```

use crate::{Record, Row, order::median};

/// Share of the time between two readings of the gyro within which two rows are one instant.
const TOGETHER: f64 = 0.05;
/// Share of the gyro's rows that have to have such a neighbour.
const MOST: f64 = 0.8;

/// Makes one row of each two that are one instant; the rows that each new row is made of, or `None` where the log is left as it is.
pub(crate) fn paired(record: &mut Record) -> Option<Vec<usize>> {
    let rows = &record.rows;
    let has_gyro = |row: &Row| row.gyro.iter().any(|g| g.is_finite());
    let gyro: Vec<usize> = (0..rows.len()).filter(|&k| has_gyro(&rows[k])).collect();
    if gyro.len() < 3 || gyro.len() == rows.len() {
        return None;
    }
    let seconds = |a: usize, b: usize| (rows[b].t_ns - rows[a].t_ns) as f64 * 1e-9;
    let usual = median(gyro.windows(2).map(|pair| seconds(pair[0], pair[1])).collect())?;
    let near = |a: usize, b: usize| {
        let apart = seconds(a, b);
        (0.0..TOGETHER * usual).contains(&apart) && is_apart(&rows[a], &rows[b])
    };
    let mut pairs = Vec::new();
    let mut k = 0;
    while k + 1 < rows.len() {
        if has_gyro(&rows[k]) != has_gyro(&rows[k + 1]) && near(k, k + 1) {
            pairs.push(k);
            k += 1;
        }
        k += 1;
    }
    if (pairs.len() as f64) < MOST * gyro.len() as f64 {
        return None;
    }
    let mut is_first = vec![false; rows.len()];
    for &k in &pairs {
        is_first[k] = true;
    }
    let mut joined = Vec::with_capacity(rows.len() - pairs.len());
    let mut of = Vec::with_capacity(rows.len() - pairs.len());
    let mut next = 0;
    while next < rows.len() {
        if is_first[next] {
            let (own, other) = if has_gyro(&rows[next]) { (next, next + 1) } else { (next + 1, next) };
            joined.push(carried(rows, &gyro, own, other));
            next += 1;
        } else {
            joined.push(rows[next]);
        }
        of.push(next);
        next += 1;
    }
    record.rows = joined;
    Some(of)
}

/// Whether no channel has a value in both.
fn is_apart(a: &Row, b: &Row) -> bool {
    let both = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| a.is_finite() && b.is_finite());
    !(both(&a.gyro, &b.gyro)
        || both(&a.ref_angle, &b.ref_angle)
        || both(&a.ref_rate, &b.ref_rate)
        || both(&a.ref_quaternion, &b.ref_quaternion)
        || both(&a.accel, &b.accel))
}

/// The row `other` with what the row `own` of the gyro has besides, carried to its time.
fn carried(rows: &[Row], gyro: &[usize], own: usize, other: usize) -> Row {
    let (from, mut row) = (&rows[own], rows[other]);
    let late = (row.t_ns - from.t_ns) as f64 * 1e-9;
    let place = gyro.partition_point(|&k| k < own);
    let (before, after) = (gyro[place.saturating_sub(1)], gyro[(place + 1).min(gyro.len() - 1)]);
    let span = (rows[after].t_ns - rows[before].t_ns) as f64 * 1e-9;
    let carry = |of: &dyn Fn(&Row) -> f64| {
        let slope = (of(&rows[after]) - of(&rows[before])) / span;
        let moved = of(from) + late * slope;
        if moved.is_finite() { moved } else { of(from) }
    };
    for i in 0..3 {
        row.gyro[i] = carry(&|row| row.gyro[i]);
        if from.accel[i].is_finite() {
            row.accel[i] = carry(&|row| row.accel[i]);
        }
    }
    let other = |own: f64, new: f64| if own.is_finite() { own } else { new };
    row.temperature = other(row.temperature, from.temperature);
    row.supply = other(row.supply, from.supply);
    row.free.iter_mut().zip(from.free).for_each(|(own, new)| *own = other(*own, new));
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Motion, Scenario, simulate};

    /// A log of 50 Hz, its gyro and its reference in rows of their own, `late` ns apart.
    fn apart(late: i64) -> (Record, Record) {
        let motion = Motion::Multisine { travel: 5.0 };
        let whole = simulate(&Scenario { motion, rate_hz: 50.0, seconds: 30.0, ..Scenario::default() }).record;
        let two = whole.rows.iter().flat_map(|row| {
            let gyro = Row { ref_angle: [f64::NAN; 3], ..*row };
            let reference = Row { t_ns: row.t_ns + late, ref_angle: row.ref_angle, ..Row::EMPTY };
            [gyro, reference]
        });
        let rows = two.collect();
        (whole, Record { rows, ..Record::default() })
    }

    #[test]
    fn two_streams_stamped_a_moment_apart_are_one() {
        let (whole, mut record) = apart(40_000);
        assert_eq!(paired(&mut record).map(|of| of.len()), Some(whole.len()));
        assert_eq!(record.len(), whole.len());
        for (k, (own, row)) in whole.rows.iter().zip(&record.rows).enumerate() {
            assert_eq!(row.t_ns, own.t_ns + 40_000);
            assert_eq!(row.ref_angle[0], own.ref_angle[0]);
            // 40 µs of 100 rad/s².
            assert!((row.gyro[0] - own.gyro[0]).abs() < 4e-3, "{k}");
        }
    }

    #[test]
    fn streams_that_alternate_and_logs_of_whole_rows_are_left_as_they_are() {
        let (mut whole, mut record) = apart(8_000_000);
        let before = record.len();
        assert!(paired(&mut record).is_none() && paired(&mut whole).is_none());
        assert_eq!(record.len(), before);
    }
}
