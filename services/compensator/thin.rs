//! Fewer rows that say the same of slow things: means over blocks, of gyro and reference alike, so that no block is late
//! against another and an integral stays what it was.

use gyro_model::{Record, Row};
use std::f64::consts::{PI, TAU};

/// At most `most` rows of this record: means over blocks of rows where every row has its references, the newest rows
/// where references are rarer than rows (a mean would make them late).
#[must_use]
pub fn thinned(record: &Record, most: usize) -> Record {
    let block = record.len().div_ceil(most.max(1));
    let free_names = record.free_names.clone();
    if block <= 1 {
        return record.clone();
    }
    let rows = if has_rare_references(record) {
        record.rows[record.len() - most..].to_vec()
    } else {
        record.rows.chunks_exact(block).map(mean).collect()
    };
    Record { rows, free_names }
}

fn has_rare_references(record: &Record) -> bool {
    let present = |row: &Row| {
        let mut present = [false; 7];
        for i in 0..3 {
            present[i] = row.ref_angle[i].is_finite();
            present[3 + i] = row.ref_rate[i].is_finite();
        }
        present[6] = row.ref_quaternion[0].is_finite();
        present
    };
    record.rows.windows(2).any(|pair| present(&pair[0]) != present(&pair[1]))
}

fn mean(rows: &[Row]) -> Row {
    let first = rows[0];
    let of = |value: &dyn Fn(&Row) -> f64| {
        let (sum, n) = rows.iter().map(value).filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        if n > 0.0 { sum / n } else { f64::NAN }
    };
    let later = rows.iter().map(|row| (row.t_ns - first.t_ns) as f64).sum::<f64>() / rows.len() as f64;
    let mut out = Row { t_ns: first.t_ns + later.round() as i64, ..Row::EMPTY };
    for i in 0..3 {
        out.gyro[i] = of(&|row| row.gyro[i]);
        out.ref_rate[i] = of(&|row| row.ref_rate[i]);
        out.accel[i] = of(&|row| row.accel[i]);
        // An angle that wraps is averaged about the first one.
        let start = first.ref_angle[i];
        out.ref_angle[i] = start + of(&|row| (row.ref_angle[i] - start + PI).rem_euclid(TAU) - PI);
    }
    out.temperature = of(&|row| row.temperature);
    out.supply = of(&|row| row.supply);
    for i in 0..out.free.len() {
        out.free[i] = of(&|row| row.free[i]);
    }
    // Quaternions of one block lie close together: their mean on the same side, made a unit again.
    let q = first.ref_quaternion;
    let side = |row: &Row| if (0..4).map(|i| row.ref_quaternion[i] * q[i]).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let sum: [f64; 4] = std::array::from_fn(|i| rows.iter().map(|row| side(row) * row.ref_quaternion[i]).sum());
    let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
    out.ref_quaternion = sum.map(|v| v / length);
    out
}

#[cfg(test)]
mod tests {
    use super::thinned;
    use gyro_model::{
        Axis, Model,
        fit::fit,
        simulate::{Motion, Scenario, simulate},
    };

    #[test]
    fn a_thinned_log_has_the_same_parameters() {
        let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
        let simulated = simulate(&Scenario { motion, seconds: 60.0, rate_hz: 400.0, ..Scenario::default() });
        let thin = thinned(&simulated.record, 6000);
        assert_eq!(thin.len(), 6000);
        let model = fit(&thin, &Model::base_for(&thin), &[Axis::X]).unwrap();
        let truth = simulated.truth.axes[0].as_ref().unwrap();
        let found = model.axes[0].as_ref().unwrap();
        for (a, b) in found.terms.iter().zip(&truth.terms) {
            let (error, std_error) = (a.values[0] - b.values[0], a.std_errors[0]);
            assert!(error.abs() < 5.0 * std_error, "{}: off by {error}, ± {std_error}", a.effect.card().id);
        }
    }
}
