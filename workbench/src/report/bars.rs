//! Bars in the terminal: the error curve against its floor, the ladder falling.

use super::view::{AxisView, Curve, StepView};

/// Averaging times shown: the headline figures of the interface and as many between as a screen takes.
const ROWS: usize = 9;

/// One row of the error curve.
pub(super) struct Row {
    pub tau: f64,
    /// Error of the first curve where there are two.
    pub before: Option<f64>,
    pub error: Option<f64>,
    pub floor: Option<f64>,
    pub floor_99: Option<f64>,
}

/// The rows that fit a screen: about even in log τ, with those nearest 0.1, 1 and 10 s and the worst.
pub(super) fn rows(axis: &AxisView) -> Vec<Row> {
    let Some(judged) = axis.curves.get(axis.judged).filter(|c| !c.tau.is_empty()) else { return Vec::new() };
    let before = axis.curves.first().filter(|_| axis.judged > 0);
    let last = judged.tau.len() - 1;
    let mut picked: Vec<usize> = [0.1f64, 1.0, 10.0]
        .iter()
        .filter(|&&tau| tau >= 0.8 * judged.tau[0] && tau <= 1.25 * judged.tau[last])
        .map(|&tau| nearest(judged, tau))
        .collect();
    picked.extend([0, last]);
    let ratio = |i: usize| judged.error[i].zip(judged.floor[i]).map_or(0.0, |(error, floor)| error / floor);
    // Of the worst it is said how many times its floor it is.
    picked.extend((0..=last).max_by(|&a, &b| ratio(a).total_cmp(&ratio(b))));
    for i in 0..ROWS {
        if picked.len() >= ROWS {
            break;
        }
        let even = i * last / (ROWS - 1);
        if picked.iter().all(|&p| p.abs_diff(even) * ROWS >= last.max(1)) {
            picked.push(even);
        }
    }
    picked.sort_unstable();
    picked.dedup();
    picked
        .into_iter()
        .map(|i| Row {
            tau: judged.tau[i],
            before: before.and_then(|b| b.tau.iter().position(|&t| t == judged.tau[i]).and_then(|k| b.error[k])),
            error: judged.error[i],
            floor: judged.floor[i],
            floor_99: judged.floor_99[i],
        })
        .collect()
}

fn nearest(curve: &Curve, tau: f64) -> usize {
    let far = |i: usize| (curve.tau[i] / tau).ln().abs();
    (0..curve.tau.len()).min_by(|&a, &b| far(a).total_cmp(&far(b))).unwrap_or(0)
}

/// A logarithmic scale from 0 to `width` cells.
pub(super) struct Scale {
    low: f64,
    high: f64,
    width: usize,
}

impl Scale {
    /// Around all of these positive values.
    pub(super) fn around(values: impl Iterator<Item = f64>, width: usize) -> Self {
        let (low, high) = values
            .filter(|v| v.is_finite() && *v > 0.0)
            .fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
        // Half a decade below the smallest, so that the smallest is still a bar.
        Self { low: low / 3.0, high: high.max(low * 3.0), width }
    }

    /// Cells up to this value.
    pub(super) fn cells(&self, value: f64) -> usize {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        if share.is_finite() { (share.clamp(0.0, 1.0) * self.width as f64).round() as usize } else { 0 }
    }
}

/// Parts of one bar: cells within the floor's band, cells above it, cells that were there before.
pub(super) fn parts(row: &Row, scale: &Scale) -> (usize, usize, usize) {
    let error = row.error.map_or(0, |e| scale.cells(e));
    let top = row.floor_99.or(row.floor).map_or(error, |f| scale.cells(f));
    let within =
        if row.error.zip(row.floor_99.or(row.floor)).is_some_and(|(e, f)| e <= f) { error } else { error.min(top) };
    let before = row.before.map_or(0, |b| scale.cells(b)).saturating_sub(error);
    (within, error - within, before)
}

/// The cells of each step of a ladder: logarithmic in error/floor, a bar of a tenth left at the floor.
pub(super) fn step_cells(steps: &[StepView], width: usize) -> Vec<usize> {
    let most = steps.iter().filter_map(|s| s.ratio).fold(2.0, f64::max);
    steps
        .iter()
        .map(|s| {
            let share = s.ratio.map_or(0.0, |r| 0.1 + 0.9 * r.max(1.0).ln() / most.ln());
            (share * width as f64).round() as usize
        })
        .collect()
}
