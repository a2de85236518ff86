//! Single readings far from those on both sides.

use super::{Report, counted, quantile, seconds};
use crate::{Axis, Record, Row};
use std::f64::consts::TAU;

/// The way to a spike and back is this many times longer than the other steps around.
const FACTOR: f64 = 8.0;

/// It is at least this share of the range in which nearly all readings lie.
const OF_RANGE: f64 = 0.1;

/// Steps on each side that a spike is compared with.
const REACH: usize = 5;

/// Longest spike, readings.
const LONGEST: usize = 2;

/// Takes spikes of gyro and reference out, and reports them.
pub(super) fn check(record: &mut Record, already: &mut [bool], report: &mut Report) {
    for axis in Axis::ALL {
        let i = axis.index();
        channel(record, already, report, Some(axis), &format!("gyro_{axis}"), |row| &mut row.gyro[i], false);
        channel(record, already, report, Some(axis), &format!("ref_angle_{axis}"), |row| &mut row.ref_angle[i], true);
        channel(record, already, report, Some(axis), &format!("ref_rate_{axis}"), |row| &mut row.ref_rate[i], false);
    }
    channel(record, already, report, None, "temp", |row| &mut row.temperature, false);
}

fn channel(
    record: &mut Record,
    already: &mut [bool],
    report: &mut Report,
    axis: Option<Axis>,
    name: &str,
    place: impl Fn(&mut Row) -> &mut f64,
    wraps: bool,
) {
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for (k, row) in record.rows.iter_mut().enumerate() {
        let value = *place(row);
        if value.is_finite() {
            rows.push(k);
            values.push(value);
        }
    }
    if wraps {
        unwrap(&mut values, TAU);
    }
    let found = spikes(&values);
    let Some(&first) = found.first() else { return };
    for &k in &found {
        *place(&mut record.rows[rows[k]]) = f64::NAN;
        report.mark(already, rows[k]);
    }
    let t = seconds(record, rows[first]);
    let readings = counted(found.len(), "single reading");
    let says = format!("{name}: {readings} far from those around; left out");
    let count = found.len() as u64;
    match axis {
        Some(axis) => report.add_on(axis, "outliers", count, Some(t), says),
        None => report.add("outliers", count, Some(t), says),
    }
}

/// Makes an angle continuous that wraps after a `whole` turn.
pub(super) fn unwrap(angles: &mut [f64], whole: f64) {
    let mut turns = 0.0;
    for k in 1..angles.len() {
        let step = angles[k] + turns - angles[k - 1];
        turns -= whole * (step / whole).round();
        angles[k] += turns;
    }
}

/// Places of single and double spikes: a large step away and one back, among small ones. A turning point, a jerk or a step
/// of the motion has no such pair.
fn spikes(values: &[f64]) -> Vec<usize> {
    let n = values.len();
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let sizes: Vec<f64> = steps.iter().map(|step| step.abs()).collect();
    let (Some(usual), Some(low), Some(high)) =
        (quantile(sizes, 0.9), quantile(values.to_vec(), 0.005), quantile(values.to_vec(), 0.995))
    else {
        return Vec::new();
    };
    let least = (FACTOR * usual).max(OF_RANGE * (high - low));
    let mut found = Vec::new();
    let mut k = REACH;
    while k + REACH + LONGEST < n {
        // Step `k` goes from reading k to k + 1.
        let back = (1..=LONGEST).map(|width| k + width).find(|&back| {
            steps[k].abs().min(steps[back].abs()) > least && steps[k] * steps[back] < 0.0 && {
                let mut others: Vec<f64> = (k - REACH..k)
                    .chain(back + 1..=back + REACH)
                    .filter_map(|i| steps.get(i))
                    .map(|x| x.abs())
                    .collect();
                others.sort_unstable_by(f64::total_cmp);
                // The third largest: another spike may stand near.
                let other = others[others.len() - 3];
                let out_and_back = (values[back + 1] - values[k]).abs();
                let (out, home) = (steps[k].abs(), steps[back].abs());
                out.min(home) > FACTOR * other.max(usual) && out_and_back < 0.5 * out.min(home)
            }
        });
        match back {
            Some(back) => {
                found.extend(k + 1..=back);
                k = back + 1;
            }
            None => k += 1,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(n: usize) -> Vec<f64> {
        (0..n).map(|k| (k as f64 * 0.3).sin() * 3.0 + 1e-3 * f64::from((k * 7919 % 13) as u32)).collect()
    }

    #[test]
    fn a_spike_on_a_fast_sine_is_found_and_the_sine_is_left_alone() {
        let mut values = sine(2000);
        assert!(spikes(&values).is_empty());
        values[700] += 30.0;
        values[1200] -= 25.0;
        assert_eq!(spikes(&values), [700, 1200]);
    }

    #[test]
    fn a_step_is_motion_and_not_a_spike() {
        let mut values = sine(2000);
        values[1000..].iter_mut().for_each(|x| *x += 50.0);
        assert!(spikes(&values).is_empty());
    }

    #[test]
    fn an_angle_that_wraps_becomes_continuous() {
        let mut angles: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.05) % TAU).collect();
        unwrap(&mut angles, TAU);
        assert!(angles.windows(2).all(|pair| (pair[1] - pair[0] - 0.05).abs() < 1e-9));
    }
}
