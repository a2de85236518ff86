//! A command that poses as a measurement: what a turntable was told, not what it did.
//!
//! No measured shaft turns evenly, or with one acceleration, from row to row to a part in ten thousand of its fastest rate: it has
//! noise, or counts. A command of holds and ramps has neither.

use super::{
    Report,
    channel::{Channel, Readings},
    quantum,
    thresholds::{TOLD, TOLD_SHARE},
};
use crate::{Axis, Record, fault::FaultKind, order::quantile, record::ReferenceKind};

/// Share of the fastest rate, 1, that a step may be: of coarser ones, counts, many increments are alike.
const COARSE: f64 = 0.02;
/// Share of the fastest rate, 1, from which on a shaft turns.
const TURNS: f64 = 0.1;

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
        if !is_told(channel, &readings) {
            continue;
        }
        let name = channel.name();
        let says = format!(
            "{name} turns exactly evenly, or with one acceleration, nearly all of the time: it looks like a command, not like a measurement. \
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
    let turning: Vec<f64> = rate
        .windows(3)
        .filter(|three| three[1].abs() > TURNS * fastest)
        .map(|three| (three[2] - 2.0 * three[1] + three[0]).abs())
        .filter(|change| change.is_finite())
        .collect();
    let same = turning.iter().filter(|change| **change < TOLD * fastest).count();
    turning.len() >= 100 && same as f64 > TOLD_SHARE * turning.len() as f64
}

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
}
