//! A reference that is made of the gyro's own readings: a copy, an integral, a filter of them.
//!
//! Of a reference that something else measured, no sum of the gyro's readings makes the rate to better than a share of the
//! gyro's noise: that noise is in the readings and not in the reference. So the reference's increments are fitted by the
//! readings nearby,
//!
//! ```text
//! r_k = c + Σ h_i g_{k+i},  i = −8 … 8
//! ```
//!
//! by least squares, and what is left over is held against the noise of the readings, which their neighbours tell. An integral that was
//! printed with few digits, or is pulled slowly to something else, is off by more than that from row to row: [`walk`] and [`heading`].

mod heading;
mod walk;

use super::{
    Report,
    channel::{Channel, Readings},
    neighbours::Neighbours,
    thresholds::OWN,
};
use crate::{Axis, Record, fault::FaultKind, parallel, record::ReferenceKind, units};
use nalgebra::{DMatrix, DVector};

/// Readings on either side that a filter may reach to.
const REACH: usize = 8;
/// Readings that are enough to tell.
const ENOUGH: usize = 20_000;

/// Reports references that are the gyro's own.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let axes: Vec<Axis> = Axis::ALL.into_iter().filter(|&axis| record.has_gyro(axis)).collect();
    // An orientation is made of all three.
    let is_oriented = |axis: Axis| record.reference(axis) == Some(ReferenceKind::Quaternion);
    let orientation = axes.iter().find_map(|&axis| is_oriented(axis).then(|| computed(record, axis))?);
    let of = |axis| if is_oriented(axis) { orientation.clone() } else { computed(record, axis) };
    for (&axis, found) in axes.iter().zip(parallel::map(&axes, |&axis| of(axis))) {
        let Some((name, rows, how)) = found else { continue };
        let says = format!(
            "{name} is computed from this gyro's own readings (gyro_{axis}): {how}. It has the gyro's errors in it and shows none of them: use an encoder, \
             motion capture, cameras or a second IMU"
        );
        report.add_on(axis, FaultKind::DependentReference, rows as u64, Some(0.0), says);
    }
}

/// The name of this axis' reference, its readings and how it is made of the gyro's readings, if it is.
fn computed(record: &Record, axis: Axis) -> Option<(String, usize, String)> {
    const WALK: &str = "it follows the random walk that the gyro's noise adds up to";
    let kind = record.reference(axis)?;
    let gyro = Readings::of(record, Channel::Gyro(axis));
    let clocks = [walk::even(&gyro), gyro.clone()];
    let channel = match kind {
        ReferenceKind::Angle => Channel::Angle(axis),
        ReferenceKind::Rate => Channel::Rate(axis),
        ReferenceKind::Quaternion => {
            let turned = walk::turned(record, axis)?;
            let how = if clocks.iter().any(|gyro| walk::follows(gyro, &turned)) {
                WALK.to_owned()
            } else if clocks.iter().any(|gyro| walk::is_levelled(record, axis, gyro, &turned)) {
                "it is their integral, pulled to the direction of gravity, as the attitude of a filter is".to_owned()
            } else {
                return None;
            };
            return Some(("the reference orientation".to_owned(), gyro.rows.len(), how));
        }
    };
    let reference = Readings::of(record, channel);
    // One that is the same throughout says that this axis does not turn.
    if reference.values.windows(2).all(|pair| pair[0] == pair[1]) {
        return None;
    }
    let is_angle = matches!(channel, Channel::Angle(_));
    let how = if is_own(channel, &gyro, &reference) {
        format!("what they do not explain of it is less than {OWN} of their noise")
    } else if is_angle && clocks.iter().any(|gyro| walk::follows(gyro, &reference)) {
        WALK.to_owned()
    } else if let Some(time) = is_angle.then(|| heading::pulled(&gyro, &reference)).flatten() {
        format!(
            "it is their integral, pulled to another heading (time constant {}), as the yaw of a filter is",
            units::time(time)
        )
    } else if let Some(to) =
        clocks.iter().find_map(|gyro| is_angle.then(|| walk::pulled_to(record, axis, gyro, &reference))?)
    {
        format!("it is their integral, pulled to {to}, as roll and pitch of a filter are")
    } else {
        return None;
    };
    Some((channel.name(), reference.rows.len(), how))
}

fn is_own(channel: Channel, gyro: &Readings, reference: &Readings) -> bool {
    let n = gyro.values.len().min(ENOUGH);
    // One made of the gyro's readings has the gyro's rows.
    let Some(noise) = Neighbours::new(gyro).map(|all| all.noise).filter(|noise| *noise > 0.0) else { return false };
    if n < 100 + 2 * REACH || gyro.rows[..n] != reference.rows[..n.min(reference.rows.len())] {
        return false;
    }
    let rate = |k: usize| match channel {
        Channel::Angle(_) => {
            (reference.values[k] - reference.values[k - 1]) / (reference.t[k] - reference.t[k - 1]).max(1e-9)
        }
        _ => reference.values[k],
    };
    let columns = 2 * REACH + 2;
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
    let row = |k: usize| {
        let of = |j: usize| if j == 0 { 1.0 } else { gyro.values[k + j - 1 - REACH] };
        DVector::from_fn(columns, |j, _| of(j))
    };
    let all = REACH + 1..n - REACH;
    // What stands still is made of nothing.
    let mean = all.clone().map(rate).sum::<f64>() / all.len() as f64;
    let spread = (all.clone().map(|k| (rate(k) - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt();
    if spread < noise {
        return false;
    }
    for k in all.clone() {
        let row = row(k);
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(rate(k), &row, 1.0);
    }
    let Some(filter) = normal.cholesky().map(|of| of.solve(&right)) else { return false };
    let left: f64 = all.clone().map(|k| (rate(k) - row(k).dot(&filter)).powi(2)).sum();
    (left / all.len() as f64).sqrt() < OWN * noise
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> f64 {
        f64::from((k as u32).wrapping_mul(2_654_435_761) >> 8) / 1.68e7 - 0.5
    }

    #[test]
    fn a_copy_an_integral_and_a_filter_are_the_gyros_own_and_a_quiet_encoder_is_not() {
        let motion = |k: usize| (0.013 * k as f64).sin() + 0.4 * (0.0471 * k as f64).sin();
        let gyro: Vec<f64> = (0..3000).map(|k| motion(k) + 0.002 * noise(k)).collect();
        let sums = |of: &dyn Fn(usize) -> f64| {
            let mut sum = 0.0;
            (0..3000)
                .map(|k| {
                    sum += 0.01 * of(k);
                    sum
                })
                .collect::<Vec<f64>>()
        };
        let of = |channel, values: Vec<f64>| {
            is_own(channel, &Readings::at_100_hz(gyro.clone()), &Readings::at_100_hz(values))
        };
        let (rate, angle) = (Channel::Rate(Axis::Z), Channel::Angle(Axis::Z));
        assert!(of(rate, gyro.iter().map(|x| 1.01 * x - 0.02).collect()));
        let mean = |k: usize| gyro[k.saturating_sub(4)..=k].iter().sum::<f64>() / 5.0;
        assert!(of(rate, (0..3000).map(mean).collect()));
        assert!(of(angle, sums(&|k| gyro[k])));
        assert!(of(angle, sums(&|k| 0.5 * (gyro[k] + gyro[k.saturating_sub(1)]))));
        assert!(!of(angle, sums(&motion)));
        assert!(!of(rate, (0..3000).map(motion).collect()));
        assert!(!of(rate, vec![0.0; 3000]));
    }
}
