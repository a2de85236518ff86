//! Markers: one value that stands for none. What a driver writes where a FIFO was empty or a read failed (the least number
//! of the word, zero, −1, 999), scattered or before the first reading.
//!
//! Such a value comes back exactly, out of the way of the readings on both sides of it, which go on as if it were not there.
//! A range's end comes back exactly too, but readings lead up to it, and the reference shows it.

use super::{
    Report,
    channel::{Channel, Readings},
    neighbours::Neighbours,
    thresholds::{ALIKE, AT_RANGE, BEYOND, LEADING, MARKED, MARKED_SHARE, MARKER_STEPS, SPIKE},
    witness::Witness,
};
use crate::{Record, fault::FaultKind, order::quantile, parallel};
use std::{
    collections::BTreeMap,
    f64::consts::{PI, TAU},
    ops::Range,
};

/// Takes markers out, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let channels: Vec<Channel> = Channel::all().filter(|channel| *channel != Channel::Temperature).collect();
    let found = parallel::map(&channels, |channel| marked(record, *channel));
    for (channel, found) in channels.into_iter().zip(found) {
        let Some((value, marked)) = found else { continue };
        for &row in &marked {
            *channel.place(&mut record.rows[row]) = f64::NAN;
            report.mark(row);
        }
        let (name, rows) = (channel.name(), marked.len());
        let says = format!(
            "{name} reads exactly {} in {}, far from what is around: it is not a reading (a failed read, an empty \
             buffer), and is left out. Write an empty field there",
            channel.says(value),
            super::counted(rows, "row")
        );
        report.add_for(channel.axis(), FaultKind::Markers, rows as u64, Some(super::seconds(record, marked[0])), says);
    }
}

/// The marker of a channel and the rows that it stands in.
fn marked(record: &Record, channel: Channel) -> Option<(f64, Vec<usize>)> {
    let mut readings = Readings::of(record, channel);
    // As they were written: markers don't unwrap.
    readings.values = readings.rows.iter().map(|&k| channel.of(&record.rows[k])).collect();
    let (value, runs) = marker(channel, &readings)?;
    if let Channel::Gyro(axis) = channel
        && let Some(witness) = Witness::of(record, axis)
        && witness.shows(&readings, &bridged(&readings.values, &runs), &runs) == Some(true)
    {
        return None;
    }
    Some((value, runs.into_iter().flatten().map(|k| readings.rows[k]).collect()))
}

/// The marker of a channel and where it stands.
fn marker(channel: Channel, readings: &Readings) -> Option<(f64, Vec<Range<usize>>)> {
    let values = &readings.values;
    let noise = Neighbours::new(readings)?.noise;
    let away = |a: f64, b: f64| match channel {
        Channel::Angle(_) => (a - b).abs().min(((a - b + PI).rem_euclid(TAU) - PI).abs()),
        _ => (a - b).abs(),
    };
    let usual = quantile(values.windows(2).map(|pair| away(pair[0], pair[1])).collect(), 0.9)?;
    let far = (MARKER_STEPS * usual).max(SPIKE * noise);
    let runs = runs(values);
    // Where a dead zone may be, zero stands beside its edge.
    let zone = 2.0 * quantile(values.iter().map(|x| x.abs()).filter(|&x| x > 0.0).collect(), 0.01)?;
    let beyond_zone = |value: f64, other: f64| value != 0.0 || other.abs() > zone;
    // On both sides, in one direction; at the log's ends on the one side that there is.
    let stands_apart = |run: &Range<usize>| {
        let value = values[run.start];
        let before = run.start.checked_sub(1).map(|k| values[k]);
        let after = values.get(run.end).copied();
        let beside = [before, after].into_iter().flatten();
        let all_far = beside.clone().all(|other| away(value, other) > far && beyond_zone(value, other));
        match (before, after) {
            (Some(before), Some(after)) => all_far && (value - before) * (value - after) > 0.0,
            (None, None) => false,
            _ => all_far && run.len() >= LEADING,
        }
    };
    let mut by_value: BTreeMap<u64, Vec<Range<usize>>> = BTreeMap::new();
    let apart: Vec<&Range<usize>> = runs.iter().filter(|run| stands_apart(run)).collect();
    for run in &apart {
        by_value.entry(values[run.start].to_bits()).or_default().push((*run).clone());
    }
    let (bits, mut of_it) = by_value.into_iter().max_by_key(|(_, runs)| runs.iter().map(Range::len).sum::<usize>())?;
    let value = f64::from_bits(bits);
    let others = values.iter().filter(|x| **x != value).map(|x| x.abs()).fold(0.0, f64::max);
    let is_beyond = value.abs() > BEYOND * others;
    let rows: usize = of_it.iter().map(Range::len).sum();
    // A few single ones are spikes, which one level of a wire may make alike.
    let is_few = rows < ALIKE && rows == of_it.len() && !stands_for_none(channel, value);
    let comes_back = of_it.len() >= MARKED && !is_few && of_it.len() as f64 >= MARKED_SHARE * apart.len() as f64;
    // Once is enough for a run of a value that nothing else comes near, or at an end where noise never repeats a reading.
    let repeats = values.windows(2).filter(|pair| pair[0] == pair[1]).count() - (rows - of_it.len());
    let at_an_end = of_it.iter().any(|run| run.start == 0 || run.end == values.len());
    let longest = of_it.iter().map(Range::len).max().unwrap_or(0);
    let once = longest >= LEADING && (is_beyond || at_an_end && (repeats as f64) < SELDOM * values.len() as f64);
    if !comes_back && !once {
        return None;
    }
    // Of a value that is known as a marker, smaller signs will do: out of the way of its neighbours, which agree.
    let is_out = |run: &Range<usize>| {
        let (Some(before), Some(after)) = (run.start.checked_sub(1).map(|k| values[k]), values.get(run.end)) else {
            return false;
        };
        let least = away(value, before).min(away(value, *after));
        let alike = away(before, *after) < least && beyond_zone(value, before) && beyond_zone(value, *after);
        least > SPIKE * noise && alike && (value - before) * (value - after) > 0.0
    };
    let of_value = runs.into_iter().filter(|run| values[run.start] == value);
    of_it = of_value.filter(|run| is_beyond || of_it.contains(run) || is_out(run)).collect();
    Some((value, of_it))
}

/// Whether a value is known for standing for none: zero, one, a row of nines, an end of a word or of a sensor's range.
fn stands_for_none(channel: Channel, value: f64) -> bool {
    let ends_of_words = [7, 8, 12, 15, 16, 31, 32].map(|bits: i32| 2.0_f64.powi(bits));
    let nines = [9.0, 99.0, 999.0, 9999.0, 99999.0];
    let is_written = |x: f64| {
        let size = x.abs();
        let is_round = (size - size.round()).abs() < 1e-9 * size.max(1.0);
        is_round
            && (size <= 1.0
                || nines.contains(&size.round())
                || ends_of_words.iter().any(|e| e - size.round() <= 1.0 && size.round() <= *e))
    };
    let ranges = [75.0, 125.0, 150.0, 200.0, 245.0, 250.0, 300.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0];
    let is_end = |dps: f64| ranges.iter().any(|range| (dps.abs() / range - 1.0).abs() < AT_RANGE);
    match channel {
        Channel::Gyro(_) | Channel::Rate(_) => {
            is_written(value) || is_written(value.to_degrees()) || is_end(value.to_degrees())
        }
        Channel::Angle(_) => is_written(value) || is_written(value.to_degrees()),
        Channel::Temperature => is_written(value),
    }
}

/// Share of readings that repeat the one before by chance, below which three alike at an end are no chance.
const SELDOM: f64 = 0.2;

/// Runs of one value.
fn runs(values: &[f64]) -> Vec<Range<usize>> {
    let mut from = 0;
    let run = |part: &[f64]| {
        let run = from..from + part.len();
        from = run.end;
        run
    };
    values.chunk_by(|a, b| a == b).map(run).collect()
}

/// The readings with straight lines over these runs.
pub(super) fn bridged(values: &[f64], runs: &[Range<usize>]) -> Vec<f64> {
    let mut out = values.to_vec();
    for run in runs {
        let before = run.start.checked_sub(1).map(|k| out[k]);
        let after = values.get(run.end).copied();
        let (from, to) = (before.or(after).unwrap_or(0.0), after.or(before).unwrap_or(0.0));
        for k in run.clone() {
            let share = (k + 1 - run.start) as f64 / (run.len() + 1) as f64;
            out[k] = from + share * (to - from);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;

    fn readings(values: Vec<f64>) -> Readings {
        let n = values.len();
        Readings { rows: (0..n).collect(), t: (0..n).map(|k| k as f64 * 0.01).collect(), values }
    }

    fn turning() -> Vec<f64> {
        (0..3000_u32).map(|k| (f64::from(k) * 0.05).sin() * 2.0 + 1e-3 * f64::from(k * 7919 % 13)).collect()
    }

    fn found(values: Vec<f64>) -> Option<(f64, usize)> {
        marker(Channel::Gyro(Axis::X), &readings(values))
            .map(|(value, runs)| (value, runs.iter().map(Range::len).sum()))
    }

    #[test]
    fn an_extreme_value_is_a_marker_wherever_it_stands() {
        let mut values = turning();
        values[..30].fill(-34.9);
        values[700..720].fill(-34.9);
        values[1500] = -34.9;
        assert_eq!(found(values), Some((-34.9, 51)));
    }

    #[test]
    fn three_spikes_of_one_size_are_no_marker_unless_the_size_is_known_for_it() {
        let with = |value: f64, every: usize| {
            let mut values = turning();
            (100..values.len()).step_by(every).for_each(|k| values[k] = value);
            found(values)
        };
        assert_eq!(with(35.0, 1000), None);
        assert_eq!(with(35.0, 300), Some((35.0, 10)));
        let end = 2000.0_f64.to_radians();
        assert_eq!(with(-end, 1000), Some((-end, 3)));
        assert_eq!(with(999.0, 1000), Some((999.0, 3)));
    }

    #[test]
    fn zeros_amid_a_turn_are_markers_and_a_dead_zone_is_not() {
        let mut values = turning();
        (0..9).for_each(|i| values[31 + 314 * i] = 0.0);
        assert_eq!(found(values), Some((0.0, 9)));
        let dead = turning().into_iter().map(|x| if x.abs() < 0.3 { 0.0 } else { x });
        assert_eq!(found(dead.collect()), None);
    }

    #[test]
    fn noise_at_the_edge_of_a_dead_zone_makes_no_markers() {
        // Held rates, one of them at the edge.
        let rate = |k: u32| [1.5, 0.3, -1.2, 0.0][(k / 100 % 4) as usize];
        let noise = |k: u32| 0.01 * (f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 8.4e6 - 1.0);
        let values = (0..8000).map(|k| rate(k) + noise(k)).map(|x| if x.abs() < 0.3 { 0.0 } else { x });
        assert_eq!(found(values.collect()), None);
    }

    #[test]
    fn the_end_of_a_range_is_no_marker() {
        let clipped = turning().into_iter().map(|x| (1.3 * x).clamp(-1.8, 1.8));
        assert_eq!(found(clipped.collect()), None);
        assert_eq!(found(turning()), None);
    }
}
