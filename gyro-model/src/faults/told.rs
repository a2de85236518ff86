//! A command that poses as a measurement: what a turntable was told, not what it did.
//!
//! No measured shaft turns evenly, or with one acceleration, to a part in ten thousand of its fastest rate while its rate usually
//! changes by hundreds of such parts: it has noise, or counts. A command of holds and ramps has neither. Nor does a shaft go from one rate to the next at once, while its gyro
//! gets there later and stays: such a reference is what the drive was told.

use super::{
    Report,
    channel::{Channel, Readings},
    quantum,
    reference::regress,
    thresholds::{TOLD, TOLD_SHARE},
};
use crate::{Axis, Record, fault::FaultKind, order::quantile, record::ReferenceKind};
use std::ops::Range;

/// Share of the fastest rate, 1, that a step may be: of coarser ones, counts, many increments are alike.
const COARSE: f64 = 0.02;
/// Share of the fastest rate, 1, from which on a shaft turns.
const TURNS: f64 = 0.1;

/// Share of the rate, 1, root mean square, by which it changes from one of the three instants to the next at which it is looked at:
/// nearer ones show one acceleration whatever the motion is.
const APART: f64 = 0.03;

/// Reports references that were told.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    // Between stamps that are no times of readings every reference turns evenly.
    if report.faults.iter().any(|fault| fault.kind == FaultKind::BurstTimestamps) {
        return;
    }
    for axis in Axis::ALL.into_iter().filter(|&axis| record.has_gyro(axis)) {
        let channel = match record.reference(axis) {
            Some(ReferenceKind::Angle) => Channel::Angle(axis),
            Some(ReferenceKind::Rate) => Channel::Rate(axis),
            Some(ReferenceKind::Quaternion) | None => continue,
        };
        let readings = Readings::of(record, channel);
        let jumps = matches!(channel, Channel::Rate(_)) && jumps(&Readings::of(record, Channel::Gyro(axis)), &readings);
        let how = if jumps {
            "jumps from one rate to another within a row, where the gyro gets there later and stays"
        } else if is_told(channel, &readings) {
            "turns exactly evenly, or with one acceleration, nearly all of the time"
        } else {
            continue;
        };
        let name = channel.name();
        let says = format!(
            "{name} {how}: it looks like a command, not like a measurement. \
             What the drive does not follow is then taken for an error of the gyro: record an encoder at the shaft, and believe of \
             delay, lag and resonance that they are the drive's"
        );
        report.add_on(axis, FaultKind::DependentReference, readings.rows.len() as u64, Some(0.0), says);
    }
}

fn is_told(channel: Channel, readings: &Readings) -> bool {
    // An angle's rate is its increments'; they are taken where rows are as far apart as usual.
    let dt: Vec<f64> = readings.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual) = quantile(dt.clone(), 0.5) else { return false };
    let even = |k: usize| (dt[k] / usual - 1.0).abs() < TOLD;
    let rate: Vec<f64> = match channel {
        Channel::Angle(_) => {
            let increments = readings.values.windows(2).zip(0..);
            increments.map(|(pair, k)| if even(k) { pair[1] - pair[0] } else { f64::NAN }).collect()
        }
        _ => readings.values.clone(),
    };
    let sizes: Vec<f64> = rate.iter().map(|x| x.abs()).filter(|x| x.is_finite()).collect();
    let Some(fastest) = quantile(sizes, 0.99).filter(|x| *x > 0.0) else { return false };
    // Counts make increments alike: any two values are a step apart at least.
    let mut sorted = readings.values.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    if quantum(&sorted) > COARSE * fastest {
        return false;
    }
    // In holds and in ramps alike the second difference is nothing.
    let apart = apart(&rate);
    let turning: Vec<f64> = (apart..rate.len().saturating_sub(apart))
        .filter(|&k| rate[k].abs() > TURNS * fastest)
        .map(|k| (rate[k + apart] - 2.0 * rate[k] + rate[k - apart]).abs())
        .filter(|change| change.is_finite())
        .collect();
    let same = turning.iter().filter(|change| **change < TOLD * fastest).count();
    turning.len() >= 100 && same as f64 > TOLD_SHARE * turning.len() as f64
}

/// Rows, to a power of two, over which a rate usually changes by [`APART`] of its size.
fn apart(rate: &[f64]) -> usize {
    let square = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.filter(|x| x.is_finite()).fold((0.0, 0), |(sum, count), x| (sum + x * x, count + 1));
        sum / f64::from(count)
    };
    let size = square(&mut rate.iter().copied());
    let change = |rows: usize| square(&mut rate[rows..].iter().zip(rate).map(|(later, now)| later - now));
    let spans = std::iter::successors(Some(1), |rows| Some(2 * rows)).take_while(|rows| 4 * rows < rate.len());
    spans.into_iter().find(|&rows| change(rows) > APART * APART * size).unwrap_or(1)
}

/// Whether a rate is held, goes to the next at once, and the gyro settles there later.
fn jumps(gyro: &Readings, rate: &Readings) -> bool {
    if gyro.rows != rate.rows {
        return false;
    }
    let sizes: Vec<f64> = rate.values.iter().map(|x| x.abs()).collect();
    let Some(fastest) = quantile(sizes, 0.99).filter(|x| *x > 0.0) else { return false };
    let mut first = 0;
    let holds: Vec<Range<usize>> = rate
        .values
        .chunk_by(|a, b| a == b)
        .map(|run| {
            first += run.len();
            first - run.len()..first
        })
        .collect();
    let held: usize = holds.iter().filter(|hold| hold.len() >= HOLD).map(ExactSizeIterator::len).sum();
    let change = |k: usize| (rate.values[k] - rate.values[k - 1]).abs();
    let changes: Vec<f64> = holds.iter().skip(1).map(|hold| change(hold.start)).collect();
    let jumped: f64 = changes.iter().filter(|change| **change > JUMP * fastest).sum();
    let at_once = jumped > TOLD_SHARE * changes.iter().sum::<f64>();
    if !at_once || changes.len() < JUMPS || (held as f64) < TOLD_SHARE * rate.values.len() as f64 {
        return false;
    }
    // Where each hold ends the gyro has settled: α and δ from there.
    let long: Vec<&Range<usize>> = holds.iter().filter(|hold| hold.len() >= HOLD).collect();
    let ends = |hold: &Range<usize>| hold.end - hold.len() / 3..hold.end;
    let (x, y): (Vec<f64>, Vec<f64>) =
        long.iter().flat_map(|hold| ends(hold)).map(|k| (gyro.values[k], rate.values[k])).unzip();
    let (slope, _) = regress(&x, &y);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let offset = mean(&y) - slope * mean(&x);
    let off = |k: usize| slope * gyro.values[k] + offset - rate.values[k];
    let squares: Vec<f64> = long.iter().flat_map(|hold| ends(hold)).map(|k| off(k).powi(2)).collect();
    let settled = mean(&squares).sqrt();
    // Just after a jump the gyro is still on its way from the rate before.
    let jumps: Vec<usize> =
        holds.iter().skip(1).map(|hold| hold.start).filter(|&k| change(k) > JUMP * fastest).collect();
    let is_behind = |k: &&usize| off(**k) / (rate.values[**k - 1] - rate.values[**k]) > ON_ITS_WAY;
    let behind = jumps.iter().filter(is_behind).count();
    settled < SETTLES * fastest && behind as f64 > TOLD_SHARE * jumps.len() as f64
}

/// Rows of one rate that make a hold, at least.
const HOLD: usize = 10;
/// Changes of the rate that are needed.
const JUMPS: usize = 4;
/// Share of the fastest rate, 1, from which on a change from one row to the next is a jump.
const JUMP: f64 = 0.05;
/// Share of a jump, 1, that the gyro still lacks just after it.
const ON_ITS_WAY: f64 = 0.3;
/// What the gyro is off by at the end of a hold, over the fastest rate, 1, at most.
const SETTLES: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(step: f64, noise: f64) -> Readings {
        // Holds of 2 s with ramps between them.
        let rate =
            |k: u32| [0.5123, 2.0071, -1.3339, 0.9177][(k / 200 % 4) as usize] * (f64::from(k % 200) / 20.0).min(1.0);
        let mut angle = 0.0;
        let values = (0..6000_u32).map(|k| {
            angle += rate(k) * 0.01;
            let shaken = angle + noise * (f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 1.68e7 - 0.5);
            (shaken / step).round() * step
        });
        Readings {
            rows: (0..6000).collect(),
            t: (0..6000).map(|k| f64::from(k) * 0.01).collect(),
            values: values.collect(),
        }
    }

    #[test]
    fn what_was_told_is_known_from_what_was_counted() {
        let angle = Channel::Angle(Axis::Z);
        assert!(is_told(angle, &readings(1e-8, 0.0)));
        assert!(!is_told(angle, &readings(std::f64::consts::TAU / 4096.0, 0.0)));
        assert!(!is_told(angle, &readings(1e-8, 1e-4)));
    }

    #[test]
    fn a_smooth_motion_is_not_told_however_near_its_rows_are() {
        for (dt, step) in [(1e-2, 1e-12), (1e-3, 1e-12), (1e-3, 1e-9), (2e-4, 1e-12)] {
            let angle = |k: u32| {
                let t = f64::from(k) * dt;
                ((0.9 * t).sin() - 0.4 * (2.3 * t).cos()) * 0.5
            };
            let smooth = Readings {
                rows: (0..60_000).collect(),
                t: (0..60_000).map(|k| f64::from(k) * dt).collect(),
                values: (0..60_000).map(|k| (angle(k) / step).round() * step).collect(),
            };
            assert!(!is_told(Channel::Angle(Axis::Z), &smooth), "{dt} {step}");
        }
    }

    #[test]
    fn a_rate_that_jumps_before_the_gyro_gets_there_was_told() {
        let told = |k: usize| [0.0, 1.5, -0.75, 0.5, -2.0][k / 300 % 5];
        let of = |rate: &dyn Fn(usize) -> f64| Readings {
            rows: (0..6000).collect(),
            t: (0..6000).map(|k| f64::from(k) * 0.01).collect(),
            values: (0..6000).map(rate).collect(),
        };
        let noise = |k: usize| 1e-3 * (f64::from((k as u32).wrapping_mul(2_654_435_761) >> 8) / 1.68e7 - 0.5);
        let mut at = 0.0;
        let real: Vec<f64> = (0..6000)
            .map(|k| {
                at += (told(k) - at) * 0.07;
                at
            })
            .collect();
        let gyro = of(&|k| 0.99 * real[k] + 0.01 + noise(k));
        assert!(jumps(&gyro, &of(&told)));
        // Measured; a slow sensor's, held between its readings; and a gyro that is there at once.
        assert!(!jumps(&gyro, &of(&|k| real[k] + noise(k + 7))));
        let smooth = |k: usize| 2.0 * (0.003 * k as f64).sin();
        assert!(!jumps(&of(&|k| smooth(k) + noise(k)), &of(&|k| smooth(k / 100 * 100))));
        assert!(!jumps(&of(&|k| told(k) + noise(k)), &of(&told)));
    }
}
