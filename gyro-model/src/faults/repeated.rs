//! Samples that were logged again in place of new ones.

use super::{
    Report,
    channel::{Channel, Readings},
    counted,
    neighbours::Neighbours,
    quantum, seconds,
};
use crate::{Axis, Record, Row, fault::FaultKind};

/// Where more of the rows repeat than this, the log was polled faster than the sensor samples: said, but left as it is.
const MARKED_UP_TO: f64 = 0.1;
/// Rows of one reading that may be one that was logged again; a channel that stands longer is stuck, or rests.
const LONGEST: usize = 6;
/// Steps, and standard deviations of a difference, that readings change by about one that is sure to be a repeated one.
const CHANGES: (f64, f64) = (8.0, 3.0);
/// Steps that a small change is of at most.
const SMALL: f64 = 3.0;

/// Takes repeated samples out, and reports them: of gyro and accelerometer together, else of the gyro alone, whose register a logger may
/// read before the next sample is in it.
///
/// A quantised reading repeats by itself now and then, so a sample counts as repeated only where all these channels repeat
/// together much more often than they would independently; with few channels, where a
/// reading stands still between large changes far more often than it changes by one step. Where the changes are small nobody
/// knows which readings were logged again; their delay matters as little. Those that are equal by chance must not be
/// taken out there: while the rate rises they are the ones that noise made too small.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let is_there = |of: &Reading| record.rows.iter().any(|r| of(r).is_finite());
    let gyros: Vec<Reading> = GYROS.into_iter().filter(is_there).collect();
    let accels: Vec<Reading> = ACCELS.into_iter().filter(is_there).collect();
    let together = [&gyros[..], &accels[..]].concat();
    let rows = |channels: &[Reading]| -> Vec<usize> {
        (0..record.len()).filter(|&k| channels.iter().all(|of| of(&record.rows[k]).is_finite())).collect()
    };
    let mut each = vec![together];
    if !accels.is_empty() {
        each.push(gyros);
    }
    let mut searched = each.iter().map(|channels| {
        let rows = rows(channels);
        let found = found(record, channels, &rows);
        (rows, found)
    });
    let Some((rows, found)) = searched.find(|(_, found)| !found.is_empty()) else { return };
    let first = rows[found[0]];
    let mark = found.len() as f64 <= MARKED_UP_TO * (rows.len() as f64 - 1.0);
    let found: Vec<(usize, usize)> = found.into_iter().map(|k| (rows[k - 1], rows[k])).collect();
    let with_it = if mark { references(record, &found) } else { String::new() };
    for &(_, row) in found.iter().filter(|_| mark) {
        record.rows[row].gyro = [f64::NAN; 3];
        report.mark(row);
    }
    let t = seconds(record, first);
    let then = if mark { "left out" } else { "they are kept, and look like a delay: log at the sensor's own rate" };
    report.add(
        FaultKind::RepeatedSamples,
        found.len() as u64,
        Some(t),
        format!("{} logged again in place of a new one{with_it}; {then}", counted(found.len(), "sample")),
    );
}

type Reading = fn(&Row) -> f64;
const GYROS: [Reading; 3] = [|r| r.gyro[0], |r| r.gyro[1], |r| r.gyro[2]];
const ACCELS: [Reading; 3] = [|r| r.accel[0], |r| r.accel[1], |r| r.accel[2]];
/// Fewer rows tell nothing.
const FEWEST: usize = 100;

/// Which of these rows repeat the one before in these channels, by their place among the rows.
fn found(record: &Record, channels: &[Reading], rows: &[usize]) -> Vec<usize> {
    if channels.is_empty() || rows.len() < FEWEST {
        return Vec::new();
    }
    let pairs = rows.len() as f64 - 1.0;
    let repeats = |of: &Reading, k: usize| of(&record.rows[rows[k]]) == of(&record.rows[rows[k - 1]]);
    let by_chance: f64 =
        channels.iter().map(|of| (1..rows.len()).filter(|&k| repeats(of, k)).count() as f64 / pairs).product();
    let found: Vec<usize> = (1..rows.len()).filter(|&k| channels.iter().all(|of| repeats(of, k))).collect();
    if channels.len() < 4 {
        let values: Vec<f64> = rows.iter().map(|&k| channels[0](&record.rows[k])).collect();
        among_changes(&values, noise(record), &found)
    } else if (found.len() as f64) < 3.0 + 20.0 * by_chance * pairs {
        Vec::new()
    } else {
        found
    }
}

/// The noise of the first gyro, rad/s.
fn noise(record: &Record) -> f64 {
    let axis = Axis::ALL.into_iter().find(|&axis| record.has_gyro(axis));
    let noise = |axis| Neighbours::new(&Readings::of(record, Channel::Gyro(axis))).map(|all| all.noise);
    axis.and_then(noise).unwrap_or(0.0)
}

/// Of the readings that repeat the one before, those that stand between large changes in one direction, off the range's ends; none
/// where that is no more often than chance makes it.
fn among_changes(values: &[f64], noise: f64, repeat: &[usize]) -> Vec<usize> {
    let ends = values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let large = |k: usize| {
        let q = quantum(&values[k.saturating_sub(200)..(k + 200).min(values.len())]);
        (CHANGES.0 * q).max(CHANGES.1 * std::f64::consts::SQRT_2 * noise)
    };
    let stands = |run: &&[usize]| {
        let (Some(&start), Some(&last)) = (run.first(), run.last()) else { return false };
        if start < 2 || last + 1 >= values.len() || run.len() >= LONGEST || values[last].abs() >= 0.97 * ends {
            return false;
        }
        let (before, after) = (values[start - 1] - values[start - 2], values[last + 1] - values[last]);
        before * after > 0.0 && before.abs().min(after.abs()) > large(start)
    };
    let runs: Vec<&[usize]> = repeat.chunk_by(|a, b| b - a == 1).filter(stands).collect();
    if is_excess(values, large(values.len() / 2), runs.len()) { runs.concat() } else { Vec::new() }
}

/// Among readings between large changes in one direction, exact repetition is as likely as a change by one small step, one way or
/// the other; whether it is far more frequent.
fn is_excess(values: &[f64], large: f64, still: usize) -> bool {
    let q = quantum(values);
    let is_small = |four: &&[f64]| {
        let (before, here, after) = (four[1] - four[0], four[2] - four[1], four[3] - four[2]);
        before * after > 0.0 && before.abs().min(after.abs()) > large && here != 0.0 && here.abs() < (SMALL + 0.5) * q
    };
    let by_chance = values.windows(4).filter(is_small).count() as f64 / (2.0 * SMALL);
    still as f64 > 5.0 + (3.0 * by_chance).max(by_chance + 6.0 * by_chance.sqrt())
}

/// Takes the references out that were logged again together with the gyro, in the second row of each pair; the words for it.
fn references(record: &mut Record, found: &[(usize, usize)]) -> String {
    type Reference = (fn(&Row) -> [f64; 4], fn(&mut Row));
    let kinds: [Reference; 7] = [
        (|r| [r.ref_angle[0], 0.0, 0.0, 0.0], |r| r.ref_angle[0] = f64::NAN),
        (|r| [r.ref_angle[1], 0.0, 0.0, 0.0], |r| r.ref_angle[1] = f64::NAN),
        (|r| [r.ref_angle[2], 0.0, 0.0, 0.0], |r| r.ref_angle[2] = f64::NAN),
        (|r| [r.ref_rate[0], 0.0, 0.0, 0.0], |r| r.ref_rate[0] = f64::NAN),
        (|r| [r.ref_rate[1], 0.0, 0.0, 0.0], |r| r.ref_rate[1] = f64::NAN),
        (|r| [r.ref_rate[2], 0.0, 0.0, 0.0], |r| r.ref_rate[2] = f64::NAN),
        (|r| r.ref_quaternion, |r| r.ref_quaternion.fill(f64::NAN)),
    ];
    let mut says = String::new();
    for (of, forget) in kinds {
        let is_again = |before: usize, row: usize| {
            let (a, b) = (of(&record.rows[before]), of(&record.rows[row]));
            a.iter().all(|x| x.is_finite()) && a == b
        };
        let again: Vec<usize> =
            found.iter().filter(|(before, row)| is_again(*before, *row)).map(|pair| pair.1).collect();
        let usual = (1..record.len()).filter(|&k| is_again(k - 1, k)).count() - again.len();
        // One that changes seldom repeats by itself.
        let usual = usual as f64 / (record.len() - found.len()).max(1) as f64;
        if again.len() as f64 > (0.5_f64).max(2.0 * usual + 0.1) * found.len() as f64 {
            for row in again {
                forget(&mut record.rows[row]);
            }
            " together with the reference".clone_into(&mut says);
        }
    }
    says
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine in steps of 1 with noise of three of them, hundreds of steps an extreme row.
    fn turning(n: u32) -> Vec<f64> {
        let noise = |k: u32| {
            let one = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 1.68e7 - 0.5;
            3.0 * (12.0_f64 / 4.0).sqrt() * (0..4).map(|i| one(4 * k + i)).sum::<f64>()
        };
        (0..n).map(|k| (15_000.0 * (f64::from(k) * 0.013).sin() + noise(k)).round()).collect()
    }

    fn found(values: &[f64]) -> Vec<usize> {
        let repeat: Vec<usize> = (1..values.len()).filter(|&k| values[k] == values[k - 1]).collect();
        among_changes(values, 3.0, &repeat)
    }

    #[test]
    fn a_few_in_a_hundred_are_found_alone_and_in_runs_and_chance_is_left() {
        let mut values = turning(6000);
        assert_eq!(found(&values), [0_usize; 0]);
        let again: Vec<usize> = (0..6000_usize).filter(|k| k % 37 == 5 || k % 370 == 6 || k % 740 == 7).collect();
        for &k in &again {
            values[k] = values[k - 1];
        }
        let found = found(&values);
        assert!(found.iter().all(|k| again.contains(k)));
        // Those near the turning points are left: they are late by little.
        assert!(found.len() as f64 > 0.8 * again.len() as f64, "{} of {}", found.len(), again.len());
    }
}
