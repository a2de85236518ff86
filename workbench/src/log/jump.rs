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
    let mut steps: Vec<i64> = rows.windows(2).map(|pair| pair[1].t_ns - pair[0].t_ns).collect();
    let (place, &longest) = steps.iter().enumerate().max_by_key(|(_, step)| **step)?;
    let span = rows.last()?.t_ns - rows[0].t_ns;
    let middle = steps.len() / 2;
    let usual = (*steps.select_nth_unstable(middle).1).max(1);
    let most = LONGEST.max(10.0 * rows.len() as f64);
    (span as f64 / usual as f64 > most && longest > usual).then_some((place + 1, longest as f64 / 1e9))
}
