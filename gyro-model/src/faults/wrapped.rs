//! Readings that ran over the range and stand with the other sign.
//!
//! A reading beyond the range R that is stored in too short a word comes out 2R lower (or higher, on the other side): it
//! jumps by nearly 2R, goes on from there as before, and jumps back. Each jump tells 2R; the reference, where there is one,
//! tells that the shaft did not turn round.

use super::{
    Report,
    channel::{Channel, Readings},
    thresholds::{BESIDE_WRAP, ONE_RANGE, WRAP},
    witness::Witness,
};
use crate::{Axis, Record, order::median};
use std::ops::Range;

/// Jumps that are needed without a reference.
const ALONE: usize = 4;

/// Puts readings that wrapped back to where they belong, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        let channel = Channel::Gyro(axis);
        let readings = Readings::of(record, channel);
        let Some(Wraps { twice, jumps }) = wraps(&readings.values) else { continue };
        let Some(unwrapped) = unwrapped(&readings.values, twice, &jumps) else { continue };
        let over = stretches(&readings.values, &unwrapped);
        let shown = Witness::of(record, axis).and_then(|witness| witness.shows(&readings, &unwrapped, &over));
        if shown.unwrap_or(jumps.len() < ALONE) {
            continue;
        }
        let rows: Vec<usize> = over.iter().cloned().flatten().collect();
        for &k in &rows {
            *channel.place(&mut record.rows[readings.rows[k]]) = unwrapped[k];
        }
        let says = format!(
            "gyro_{axis} runs over its range of ±{:.0} °/s {} ({}) and comes out with the other sign: put back. Set a larger \
             range, or store what is beyond as the range's end",
            (0.5 * twice).to_degrees(),
            if over.len() == 1 { "once".to_owned() } else { format!("{} times", over.len()) },
            super::counted(rows.len(), "row")
        );
        report.add_on(axis, "wrapped", rows.len() as u64, Some(readings.t[rows[0]]), says);
    }
}

/// The jumps of readings that wrap.
struct Wraps {
    /// From one end of the range to the other, rad/s.
    twice: f64,
    /// Readings that a jump leads to, and whether down.
    jumps: Vec<(usize, bool)>,
}

fn wraps(values: &[f64]) -> Option<Wraps> {
    let most = values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let is_jump = |k: usize| steps[k].abs() > WRAP * most;
    let jumps: Vec<usize> = (1..steps.len().saturating_sub(1)).filter(|&k| is_jump(k)).collect();
    let ranges: Vec<f64> = jumps
        .iter()
        .filter_map(|&k| {
            let beside: Vec<f64> = [k - 1, k + 1].into_iter().filter(|&j| !is_jump(j)).map(|j| steps[j]).collect();
            let even = beside.iter().all(|step| step.abs() < BESIDE_WRAP * steps[k].abs());
            let mean = beside.iter().sum::<f64>() / beside.len().max(1) as f64;
            even.then(|| (steps[k] - mean).abs())
        })
        .collect();
    let middle = median(ranges.clone())?;
    let of_one: Vec<f64> = ranges.iter().copied().filter(|x| (x / middle - 1.0).abs() < ONE_RANGE).collect();
    let twice = of_one.iter().sum::<f64>() / of_one.len() as f64;
    let is_range = jumps.len() >= 2 && of_one.len() == jumps.len() && (0.97..1.2).contains(&(0.5 * twice / most));
    is_range.then(|| Wraps { twice, jumps: jumps.iter().map(|&k| (k + 1, steps[k] < 0.0)).collect() })
}

/// The readings put back; `None` where they would not come back into the range.
fn unwrapped(values: &[f64], twice: f64, jumps: &[(usize, bool)]) -> Option<Vec<f64>> {
    let (mut out, mut times, mut next) = (values.to_vec(), 0_i32, jumps.iter().peekable());
    for (k, value) in out.iter_mut().enumerate() {
        if let Some((_, down)) = next.next_if(|jump| jump.0 == k) {
            times += if *down { 1 } else { -1 };
        }
        if times.abs() > 1 {
            return None;
        }
        *value += f64::from(times) * twice;
    }
    Some(out)
}

/// Where two differ.
fn stretches(a: &[f64], b: &[f64]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for k in (0..a.len()).filter(|&k| a[k] != b[k]) {
        match found.last_mut() {
            Some(last) if last.end == k => last.end += 1,
            _ => found.push(k..k + 1),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up to 1.3 times a range of 5.
    fn turning() -> Vec<f64> {
        (0..3000_u32).map(|k| 6.5 * (f64::from(k) * 0.02).sin() + 1e-3 * f64::from(k * 7919 % 13)).collect()
    }

    #[test]
    fn what_ran_over_the_range_is_put_back() {
        let wrapped: Vec<f64> = turning().iter().map(|x| (x + 5.0).rem_euclid(10.0) - 5.0).collect();
        let Wraps { twice, jumps } = wraps(&wrapped).unwrap();
        assert!((twice - 10.0).abs() < 0.01, "{twice}");
        let back = unwrapped(&wrapped, twice, &jumps).unwrap();
        assert!(back.iter().zip(turning()).all(|(a, b)| (a - b).abs() < 0.02));
    }

    #[test]
    fn a_range_that_ends_and_a_drive_that_turns_round_do_not_wrap() {
        assert!(wraps(&turning().iter().map(|x| x.clamp(-5.0, 5.0)).collect::<Vec<f64>>()).is_none());
        assert!(wraps(&turning()).is_none());
    }
}
