//! Dead zone and saturation, as the readings themselves show them.
//!
//! Both leave marks that no motion makes: a reading that is reached again and again and never passed, or a hole about
//! zero that the readings jump over.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Both limits of one axis' readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Limits {
    rail: Option<f64>,
    hole: Option<f64>,
}

impl Limits {
    /// Those that the finite ones of these readings show.
    #[must_use]
    pub(crate) fn of(readings: impl Iterator<Item = f64>) -> Self {
        let readings: Vec<f64> = readings.filter(|g| g.is_finite()).collect();
        Self { rail: rail(&readings), hole: hole(&readings) }
    }

    /// What a reading beyond a limit reads; `None` for one between them.
    #[must_use]
    pub(crate) fn stands_at(&self, reading: f64) -> Option<f64> {
        let at_rail = self.rail.filter(|rail| reading.abs() > rail * (1.0 - 1e-6));
        at_rail.map(|rail| rail.copysign(reading)).or_else(|| self.hole.filter(|_| reading == 0.0).map(|_| 0.0))
    }
}

/// The largest |reading|, where it is reached far more often than the values just below it, or held longer than a motion
/// can hold its turning point.
pub(crate) fn rail(readings: &[f64]) -> Option<f64> {
    let top = ceiling(readings)?;
    let mut size: Vec<f64> = readings.iter().map(|g| g.abs().min(top)).collect();
    let near = 1e-6 * top;
    let at = size.iter().filter(|&&g| g > top - near).count();
    if at < FEWEST_HELD {
        return None;
    }
    first_sorted(&mut size, 2 * at, |a, b| b.total_cmp(a));
    // As many readings again: over how many steps are they spread?
    let spread = top - size.last()?;
    let step =
        step(readings.iter().copied().filter(|g| g.abs() <= top - near), |a, b| b.abs().total_cmp(&a.abs()), near);
    let levels = 1.0 + spread / step;
    // What is read more often than it is measured stands there several times.
    let repeats = repeats(readings, top - near);
    let often = is_more_than_peaks(at / repeats, size.len() / repeats, levels);
    (often || is_flat_topped(readings, top - near, step)).then_some(top)
}

/// Whether more of the `n` readings that are nearest to the top stand there than smooth peaks bring, these readings being spread over
/// so many steps.
///
/// A peak falls with the square of the time: of n readings within L steps of it, n/√L lie within the first, be it one peak or many
/// of the same height. Noise leaves fewer there.
fn is_more_than_peaks(at: usize, n: usize, levels: f64) -> bool {
    if at < FEWEST_HELD {
        return false;
    }
    let share = 1.0 / levels.sqrt();
    // One is at the top because the top is where it is.
    let law = Binomial::new(share, n as u64 - 1);
    at as f64 > RATIO * share * n as f64 && law.is_ok_and(|law| law.sf(at as u64 - 2) < CHANCE)
}

/// How many times as many readings stand at a rail as smooth peaks bring, and the chance that these bring them.
const RATIO: f64 = 1.5;
const CHANCE: f64 = 1e-3;

/// The largest |reading|, or the lesser of the largest on either side where these are one step apart: two's complement
/// reaches one step farther below zero than above.
fn ceiling(readings: &[f64]) -> Option<f64> {
    let largest = |sign: f64| readings.iter().map(|g| sign * g).reduce(f64::max);
    let (above, below) = (largest(1.0)?, largest(-1.0)?);
    let (less, more) = (above.min(below), above.max(below));
    if less < (1.0 - UNEQUAL) * more {
        return Some(more);
    }
    let mut near: Vec<f64> = readings.iter().map(|g| g.abs()).filter(|&g| g > (1.0 - 10.0 * UNEQUAL) * more).collect();
    near.sort_by(|a, b| b.total_cmp(a));
    near.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * more);
    let step = smallest_gap(&near, 0.0);
    Some(if more - less < 1.5 * step { less } else { more })
}

/// Share by which the limits of a coarse sensor differ at most, its ends being one step apart.
const UNEQUAL: f64 = 0.01;

/// Whether readings stand still at this rail as nowhere else, at rest included: elsewhere noise moves them, whatever rate is held.
pub(crate) fn stands_alone(readings: &[f64], rail: f64) -> bool {
    let edge = rail * (1.0 - 1e-6);
    let (mut here, mut elsewhere) = (0, 0);
    for run in readings.chunk_by(|a, b| a == b) {
        let longest = if run[0].abs() > edge { &mut here } else { &mut elsewhere };
        *longest = run.len().max(*longest);
    }
    elsewhere <= MOVED && here >= ALONE * elsewhere
}

/// Readings after which noise has moved one, and times as many that stand still at the rail.
const MOVED: usize = 10;
const ALONE: usize = 4;

/// How often a reading below `edge` stands there one time after the other: the median.
fn repeats(readings: &[f64], edge: f64) -> usize {
    let below = readings.chunk_by(|a, b| a == b).filter(|run| run[0].abs() <= edge);
    let mut lengths: Vec<usize> = below.map(<[f64]>::len).collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() { 1 } else { *lengths.select_nth_unstable(middle).1 }
}

/// Whether some turning point beyond `edge` is flat although the readings beside it have fallen away by many steps, and
/// nothing else in the log stands still like that (as it does where readings are repeated).
///
/// A smooth peak falls with the square of the time: where the neighbours of m equal readings lie d lower in the mean, the first and the
/// last of these lie d ((m − 1)/(m + 1))² below their middle.
fn is_flat_topped(readings: &[f64], edge: f64, step: f64) -> bool {
    let mut held = Vec::new();
    let mut elsewhere = 0;
    let mut first = 0;
    for run in readings.chunk_by(|a, b| a == b) {
        let (last, m) = (first + run.len(), run.len());
        if first > 0 && last < readings.len() {
            let value = readings[first];
            let falls = |neighbour: f64| (value - neighbour).abs();
            let fall = 0.5 * (falls(readings[first - 1]) + falls(readings[last]));
            let inside = fall * ((m as f64 - 1.0) / (m as f64 + 1.0)).powi(2);
            if value.abs() > edge && m >= FEWEST_HELD && inside > STEPS * step {
                held.push(m);
            } else if value.abs() <= edge && value != 0.0 && fall > STEPS * step {
                elsewhere = elsewhere.max(m);
            }
        }
        first = last;
    }
    held.iter().any(|&m| m >= 2 * elsewhere)
}

/// Readings that a rail has to hold one after the other.
const FEWEST_HELD: usize = 4;
/// Steps by which a smooth peak would fall within them.
const STEPS: f64 = 6.0;

/// Half width of the hole about zero: readings of exactly zero, and none up to the smallest other one.
pub(crate) fn hole(readings: &[f64]) -> Option<f64> {
    let zeros = readings.iter().filter(|g| **g == 0.0).count();
    if zeros < PASSAGES {
        return None;
    }
    let others = || readings.iter().copied().filter(|&g| g != 0.0);
    let edge = others().map(f64::abs).reduce(f64::min)?;
    let beyond = others().filter(|g| g.abs() < 2.0 * edge).count();
    let step = step(others(), |a, b| a.abs().total_cmp(&b.abs()), 1e-9 * edge);
    let often = zeros >= 20 && zeros > beyond / 3;
    (beyond >= BESIDE && edge > 3.5 * step && (often || passed_through(readings) >= PASSAGES)).then_some(edge)
}

/// Readings of zero that stand between readings of opposite signs: a sensor that rests beside the hole shows it only on
/// the way through. Without one, a reading on that way is as often at any other of the steps near zero.
fn passed_through(readings: &[f64]) -> usize {
    let runs: Vec<&[f64]> = readings.chunk_by(|a, b| (*a == 0.0) == (*b == 0.0)).collect();
    let between = |w: &&[&[f64]]| {
        let (before, after) = (w[0].last(), w[2].first());
        w[1][0] == 0.0 && before.zip(after).is_some_and(|(b, a)| b * a < 0.0)
    };
    runs.windows(3).filter(between).map(|w| w[1].len()).sum()
}

/// Readings from the edge to twice as far: were there no hole, the nearest to zero would lie about as far from it as they lie
/// apart.
const BESIDE: usize = 8;

/// Readings of zero on the way through that are not there by chance.
const PASSAGES: usize = 8;

/// Values beside a limit that its step is read from.
const LOOKED_AT: usize = 2000;

/// The step between the values that come first in this order. A positive and a negative one of about the same size may be off
/// by less, where a scale goes with the sign.
fn step(values: impl Iterator<Item = f64>, order: impl Fn(&f64, &f64) -> std::cmp::Ordering, rounding: f64) -> f64 {
    let mut first: Vec<f64> = values.collect();
    first_sorted(&mut first, LOOKED_AT, order);
    first.sort_by(f64::total_cmp);
    smallest_gap(&first, rounding)
}

/// Keeps the first `count` values in this order, sorted.
fn first_sorted(values: &mut Vec<f64>, count: usize, order: impl Fn(&f64, &f64) -> std::cmp::Ordering) {
    if count < values.len() {
        values.select_nth_unstable_by(count, &order);
        values.truncate(count);
    }
    values.sort_by(order);
}

/// The smallest difference between successive sorted values that is no rounding.
fn smallest_gap(sorted: &[f64], rounding: f64) -> f64 {
    let mut gaps: Vec<f64> = sorted.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|&d| d > rounding).collect();
    gaps.sort_by(f64::total_cmp);
    gaps.get(gaps.len() / 10).copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantised_sine() -> Vec<f64> {
        (0..15_000)
            .map(|k| {
                ((3.5 * (f64::from(k) * 0.0157).sin() + 4e-4 * f64::from(k * 7919 % 11 - 5)) / 1e-3).round() * 1e-3
            })
            .collect()
    }

    #[test]
    fn a_clipped_sine_shows_its_rail_and_a_whole_one_none() {
        let whole = quantised_sine();
        assert_eq!(rail(&whole), None);
        let clipped: Vec<f64> = whole.iter().map(|g| g.clamp(-3.0, 3.0)).collect();
        assert_eq!(rail(&clipped), Some(3.0));
    }

    #[test]
    fn one_smooth_peak_of_many_readings_shows_no_rail() {
        let noise = |k: i32| 5e-4 * f64::from(k * 7919 % 5 - 2);
        let peak = |k: i32, swing: f64| 3.645 * (swing * f64::from(k - 600)).cos() + noise(k);
        for swing in [1e-3, 2e-3, 2.4e-3, 3e-3, 3.5e-3] {
            let smooth: Vec<f64> = (0..1200).map(|k| (peak(k, swing) / 1e-3).round() * 1e-3).collect();
            assert_eq!(rail(&smooth), None, "{swing}");
            let clipped: Vec<f64> = smooth.iter().map(|g| g.min(3.4)).collect();
            assert_eq!(rail(&clipped), Some(3.4), "{swing}");
        }
    }

    #[test]
    fn readings_stand_alone_at_a_rail_where_noise_moves_them_elsewhere_and_not_where_steps_are_coarse() {
        // A rate table that is held at some rates, the highest of which is cut off.
        let held = |k: i32| [0.0, 1.0, -0.5, 2.0][(k / 500 % 4) as usize] + 1e-3 * f64::from(k * 7919 % 11 - 5);
        let read =
            |step: f64| (0..8000).map(move |k| ((held(k) / step).round() * step).min(1.98)).collect::<Vec<f64>>();
        let (fine, coarse) = (read(1e-3), read(0.02));
        assert_eq!(rail(&fine), Some(1.98));
        assert!(stands_alone(&fine, 1.98));
        assert!(!stands_alone(&coarse, 1.98));
    }

    #[test]
    fn a_rail_of_two_s_complement_is_one_step_farther_below_zero() {
        let noise = |k: u32| 2e-3 * f64::from(k * 7919 % 11) - 0.01;
        let swing = |k: u32| (0.003 * f64::from(k)).sin() + 0.4 * (0.017 * f64::from(k)).sin();
        let sine = |size: f64| (0..20_000).map(move |k| ((size * swing(k) + noise(k)) / 3e-5).round());
        let read = |least: f64, most: f64| sine(0.9).map(|g| 3e-5 * g.clamp(least, most)).collect::<Vec<f64>>();
        assert_eq!(rail(&read(-50_000.0, 50_000.0)), None);
        assert_eq!(rail(&read(-20_000.0, 19_999.0)), Some(3e-5 * 19_999.0));
    }

    #[test]
    fn a_rail_shows_that_is_reached_only_once_and_repeated_readings_show_none() {
        let burst = |k: f64| 4.0 * (0.1 * k).sin() * (-((k - 1000.0) / 200.0).powi(2)).exp();
        let whole: Vec<f64> = (0..2_000).map(|k| (burst(f64::from(k)) / 1e-3).round() * 1e-3).collect();
        let top = whole.iter().map(|g| g.abs()).fold(0.0, f64::max);
        assert_eq!(rail(&whole), None);
        let limit = 0.985 * top;
        let clipped: Vec<f64> = whole.iter().map(|g| g.clamp(-limit, limit)).collect();
        assert_eq!(clipped.iter().filter(|g| g.abs() >= limit).count(), 7);
        assert_eq!(rail(&clipped), Some(limit));
        let repeated: Vec<f64> = whole.iter().step_by(8).flat_map(|&g| [g; 8]).collect();
        assert_eq!(rail(&repeated), None);
    }

    #[test]
    fn a_dead_zone_shows_its_width_and_quantised_rest_does_not() {
        let whole = quantised_sine();
        assert_eq!(hole(&whole), None);
        let dead: Vec<f64> = whole.iter().map(|&g| if g.abs() < 0.05 { 0.0 } else { g }).collect();
        assert!((hole(&dead).expect("a hole") - 0.05).abs() < 2e-3);
        let rest: Vec<f64> = (0..5000).map(|k| f64::from(k % 3 - 1) * 1e-3).collect();
        assert_eq!(hole(&rest), None);
    }

    #[test]
    fn steps_of_another_size_below_zero_than_above_show_neither_limit() {
        let uneven: Vec<f64> = quantised_sine().iter().map(|g| g * (1.0 + 2e-3 * g.signum())).collect();
        assert_eq!((rail(&uneven), hole(&uneven)), (None, None));
        let rest: Vec<f64> = (0..5000).map(|k| f64::from(k % 7 - 3) * 1e-3).collect();
        let uneven: Vec<f64> = rest.iter().map(|g| g * (1.0 + 2e-3 * g.signum())).collect();
        assert_eq!((rail(&uneven), hole(&uneven)), (None, None));
    }

    #[test]
    fn a_dead_zone_shows_that_is_only_passed_through_and_readings_that_dropped_to_zero_show_none() {
        // Rests at 0.06 just outside of the hole, and swings through it some times.
        let swing = |k: i32| if k % 400 < 300 { 0.0 } else { (f64::from(k % 400 - 300) * 0.0628).sin() };
        let noise = |k: i32| 1e-3 * f64::from(k * 7919 % 5 - 2);
        let whole: Vec<f64> = (0..8000).map(|k| ((0.06 - swing(k) + noise(k)) / 5e-4).round() * 5e-4).collect();
        assert_eq!(hole(&whole), None);
        let dead: Vec<f64> = whole.iter().map(|&g| if g.abs() < 0.055 { 0.0 } else { g }).collect();
        assert!(dead.iter().filter(|g| **g == 0.0).count() < 200);
        assert!((hole(&dead).expect("a hole") - 0.055).abs() < 4e-3);
        let dropped: Vec<f64> = (0..8000).map(|k| if k % 40 == 0 { 0.0 } else { 0.3 + noise(k) }).collect();
        assert_eq!(hole(&dropped), None);
    }

    #[test]
    fn a_dead_zone_shows_beside_few_readings_and_a_quick_start_from_rest_shows_none() {
        // Long rests about 0.02, and turns that take five readings to be fast.
        let noise = |k: i32| 3e-4 * f64::from(k * 7919 % 5 - 2);
        let rate = |k: i32| if k % 500 < 400 { 0.02 } else { 0.02 + (0.1 * f64::from(k % 500 - 400)).min(1.0) };
        let whole: Vec<f64> = (0..4500).map(|k| ((rate(k) + noise(k)) / 3e-4).round() * 3e-4).collect();
        let dead: Vec<f64> = whole.iter().map(|&g| if g.abs() < 0.115 { 0.0 } else { g }).collect();
        let edge = hole(&dead).expect("a hole");
        assert!((0.115..0.125).contains(&edge), "{edge}");
        assert!(dead.iter().filter(|g| **g > 0.0 && **g < 2.0 * edge).count() < 20);
        // At rest this one reads zero; its turns begin anywhere between two readings.
        let start = |k: i32| 0.05 * f64::from(k / 500 * 7 % 12) / 12.0;
        let quick = |k: i32| if k % 500 < 400 { 0.0 } else { (start(k) + 0.05 * f64::from(k % 500 - 400)).min(1.0) };
        let still: Vec<f64> = (0..6000).map(|k| (quick(k) / 3e-4).round() * 3e-4).collect();
        assert_eq!(hole(&still), None);
    }
}
