//! Readings that ran over the range and stand with the other sign.
//!
//! A reading beyond the range R that is stored in too short a word comes out 2R lower (or higher, on the other side): it
//! jumps by nearly 2R, goes on from there as before, and jumps back. Each jump tells 2R; the reference, where there is one,
//! tells that the shaft did not turn round. Where all readings are whole steps of a converter's word, 2R is a power of two of
//! those steps, and known exactly.
//!
//! A reading whose sign was lost, stored in a word without one, comes out 2R higher where it is negative: no reading is
//! below zero, and it jumps by 2R wherever it passes zero.

use super::{
    Report,
    channel::{Channel, Readings},
    quantum,
    thresholds::{BESIDE_WRAP, ONE_RANGE, SIGN_LOST, WRAP},
    witness::Witness,
};
use crate::{Axis, Record, fault::FaultKind, order::median};
use std::ops::Range;

/// Steps over which a step is known well enough from two readings that are one apart, 1.
const FEW_STEPS: f64 = 64.0;
/// How much longer the way is over which it is known better.
const LONGER: f64 = 4.0;
/// Share of a step that whole ones may be off by, for rounding in the file.
const WHOLE: f64 = 0.2;
/// Jumps that are needed without a reference.
const ALONE: usize = 4;

/// Puts readings that wrapped back to where they belong, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        let channel = Channel::Gyro(axis);
        let readings = Readings::of(record, channel);
        let of_range = wraps(&readings.values).and_then(|found| {
            let unwrapped = unwrapped(&readings.values, found.twice, &found.jumps)?;
            Some((found, unwrapped, false))
        });
        let Some((Wraps { twice, jumps }, unwrapped, signless)) = of_range.or_else(|| signless(&readings.values))
        else {
            continue;
        };
        let over = stretches(&readings.values, &unwrapped);
        let shown = Witness::of(record, axis).and_then(|witness| witness.shows(&readings, &unwrapped, &over));
        if shown.unwrap_or(jumps.len() < ALONE) {
            continue;
        }
        let rows: Vec<usize> = over.iter().cloned().flatten().collect();
        for &k in &rows {
            *channel.place(&mut record.rows[readings.rows[k]]) = unwrapped[k];
        }
        let rows_of = super::counted(rows.len(), "row");
        let says = if signless {
            format!(
                "gyro_{axis} is stored without its sign: what is negative comes out {:.1} °/s higher ({rows_of}): put back. Read the \
                 sensor's word as a signed one",
                twice.to_degrees()
            )
        } else {
            format!(
                "gyro_{axis} runs over its range of ±{:.0} °/s {} ({rows_of}) and comes out with the other sign: put back. Set a \
                 larger range, or store what is beyond as the range's end",
                (0.5 * twice).to_degrees(),
                if over.len() == 1 { "once".to_owned() } else { format!("{} times", over.len()) },
            )
        };
        report.add_on(axis, FaultKind::Wrapped, rows.len() as u64, Some(readings.t[rows[0]]), says);
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
    let mut found = jumps_of_one_size(values, WRAP * most)?;
    found.twice = word(values, found.twice).unwrap_or(found.twice);
    (0.97..1.2).contains(&(0.5 * found.twice / most)).then_some(found)
}

/// Steps of the word that holds the readings, rad/s in all, near `about`; `None` where they are no whole steps of one.
fn word(values: &[f64], about: f64) -> Option<f64> {
    let first = *values.first()?;
    let mut step = quantum(values);
    // The longer the way, the finer the step is known: each reach is a few times the one before.
    let mut reach = FEW_STEPS;
    let most = values.iter().map(|x| (x - first).abs()).fold(0.0, f64::max);
    loop {
        let (mut along, mut own, mut off) = (0.0, 0.0, 0.0_f64);
        for way in values.iter().map(|x| x - first).filter(|way| way.abs() <= reach * step) {
            let steps = (way / step).round();
            along += way * steps;
            own += steps * steps;
            off = off.max((way / step - steps).abs());
        }
        if !(step > 0.0 && own > 0.0) || off > WHOLE {
            return None;
        }
        let done = reach * step > most;
        step = along / own;
        if done {
            break;
        }
        reach *= LONGER;
    }
    let bits = (about / step).log2().round();
    let exact = step * bits.exp2();
    (exact / about - 1.0).abs().lt(&ONE_RANGE).then_some(exact)
}

/// Readings that lost their sign, and what they are with it: `None` where one is below zero, or none passes it.
fn signless(values: &[f64]) -> Option<(Wraps, Vec<f64>, bool)> {
    let (least, most) = values.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
    if least < 0.0 {
        return None;
    }
    let mut found = jumps_of_one_size(values, SIGN_LOST * most).filter(|found| found.jumps.len() >= ALONE)?;
    found.twice = word(values, found.twice).unwrap_or(found.twice);
    let signed: Vec<f64> = values.iter().map(|x| if *x > 0.5 * found.twice { x - found.twice } else { *x }).collect();
    let (low, high) = signed.iter().fold((0.0_f64, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
    // It has to turn both ways, and no reading may lie beyond the word's range.
    (most <= found.twice && low < 0.0 && high > 0.0).then_some((found, signed, true))
}

/// Jumps of at least this size that are all of one size.
fn jumps_of_one_size(values: &[f64], least: f64) -> Option<Wraps> {
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let is_jump = |k: usize| steps[k].abs() > least;
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
    (jumps.len() >= 2 && of_one.len() == jumps.len())
        .then(|| Wraps { twice, jumps: jumps.iter().map(|&k| (k + 1, steps[k] < 0.0)).collect() })
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
    fn a_sign_that_was_lost_is_found_again() {
        let slow: Vec<f64> = turning().iter().map(|x| 0.3 * x).collect();
        let stored: Vec<f64> = slow.iter().map(|x| x.rem_euclid(10.0)).collect();
        let (found, signed, _) = signless(&stored).unwrap();
        assert!((found.twice - 10.0).abs() < 0.05, "{}", found.twice);
        assert!(signed.iter().zip(&slow).all(|(a, b)| (a - b).abs() < 0.05));
        // In whole steps of a word of 16 bits, 131 a °/s, nothing is left between the two signs.
        let step = 1.0 / 131.0;
        let words: Vec<f64> = slow.iter().map(|x| (100.0 * x / step).round() * step).collect();
        let (found, signed, _) =
            signless(&words.iter().map(|x| x.rem_euclid(65_536.0 * step)).collect::<Vec<_>>()).unwrap();
        assert!((found.twice / (65_536.0 * step) - 1.0).abs() < 1e-9, "{}", found.twice);
        assert!(signed.iter().zip(words).all(|(a, b)| (a - b).abs() < 1e-6));
        let one_way: Vec<f64> = turning().iter().map(|x| x.abs()).collect();
        assert!(signless(&turning()).is_none() && signless(&one_way).is_none());
    }

    #[test]
    fn a_range_that_ends_and_a_drive_that_turns_round_do_not_wrap() {
        assert!(wraps(&turning().iter().map(|x| x.clamp(-5.0, 5.0)).collect::<Vec<f64>>()).is_none());
        assert!(wraps(&turning()).is_none());
    }
}
