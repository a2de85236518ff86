//! Clocks that are set while a log is recorded: a gap of days or years in a log of minutes.

use gyro_model::{
    Row,
    fault::{DataFault, FaultKind},
};

/// A log may span this many sample intervals, or ten times its rows, whichever is more: 14 hours at 100 Hz.
const LONGEST: f64 = 5e6;

/// Leaves out the shorter side of every jump that makes a log mostly gap. The remaining times count from the first
/// remaining row; the number returned is what that row's time was.
pub fn cut(rows: &mut Vec<Row>, marked: &mut Vec<bool>, faults: &mut Vec<DataFault>) -> (i64, u64) {
    let (mut origin, mut left_out) = (0, 0);
    while let Some((place, gap)) = jump(rows) {
        let t = (rows[place - 1].t_ns + origin) as f64 / 1e9;
        let (side, count) = if place <= rows.len() - place { ("before", place) } else { ("after", rows.len() - place) };
        if side == "before" {
            rows.drain(..place);
            marked.drain(..place);
            let first = rows[0].t_ns;
            for row in rows.iter_mut() {
                row.t_ns -= first;
            }
            origin += first;
        } else {
            rows.truncate(place);
            marked.truncate(place);
        }
        left_out += count as u64;
        faults.push(DataFault {
            kind: FaultKind::TimeGoingBack,
            axis: None,
            count: count as u64,
            first_t: Some(t),
            says: format!("the clock jumps ahead by {gap:.0} s: the {count} rows {side} that are left out"),
        });
    }
    (origin, left_out)
}

/// The row after the longest gap, and its length in seconds, where the log is mostly gap.
fn jump(rows: &[Row]) -> Option<(usize, f64)> {
    let (place, longest) = rows.windows(2).map(|pair| pair[1].t_ns - pair[0].t_ns).enumerate().max_by_key(|of| of.1)?;
    let span = rows.last()?.t_ns - rows[0].t_ns;
    // A reference may be stamped a moment after each reading.
    let read: Vec<i64> = rows.iter().filter(|row| row.gyro.iter().any(|x| x.is_finite())).map(|row| row.t_ns).collect();
    let mut steps: Vec<i64> = read.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    let usual = (*steps.select_nth_unstable(middle).1).max(1);
    let most = LONGEST.max(10.0 * rows.len() as f64);
    (span as f64 / usual as f64 > most && longest > usual).then_some((place + 1, longest as f64 / 1e9))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings 20 ms apart, each with a reference of its own row 3 µs later.
    fn interleaved(count: i64) -> Vec<Row> {
        let reading = |k: i64| Row { t_ns: k * 20_000_000, gyro: [f64::NAN, f64::NAN, 0.1], ..Row::EMPTY };
        let reference = |k: i64| Row { t_ns: k * 20_000_000 + 3_000, ..Row::EMPTY };
        (0..count).flat_map(|k| [reading(k), reference(k)]).collect()
    }

    #[test]
    fn a_reference_stamped_right_after_each_reading_makes_no_gaps_and_a_clock_that_is_set_does() {
        let mut rows = interleaved(3000);
        let (mut marked, mut faults) = (vec![false; rows.len()], Vec::new());
        assert_eq!((cut(&mut rows, &mut marked, &mut faults), rows.len(), faults.len()), ((0, 0), 6000, 0));
        for row in &mut rows[5000..] {
            row.t_ns += 86_400_000_000_000 * 40;
        }
        assert_eq!((cut(&mut rows, &mut marked, &mut faults), rows.len(), faults.len()), ((0, 1000), 5000, 1));
    }
}
