//! Gaps between samples, and uneven ones.

use super::{Report, bursts::Bursts, counted, quantile, seconds};
use crate::{Record, fault::FaultKind};

/// An interval this many times the usual one is a gap.
const GAP: f64 = 1.8;

/// Intervals that spread by more than this share of the usual one are called jitter.
const JITTER: f64 = 0.5;

/// Reports gaps and timestamp jitter of the gyro's samples.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let rows: Vec<usize> = (0..record.len()).filter(|&k| record.rows[k].gyro.iter().any(|x| x.is_finite())).collect();
    let dt: Vec<f64> = rows.windows(2).map(|pair| seconds(record, pair[1]) - seconds(record, pair[0])).collect();
    let Some(usual) = quantile(dt.clone(), 0.5) else { return };
    let bursts = Bursts::of(&dt);
    // Between bursts nothing is missing: gaps are held against the time from one to the next.
    let usual = bursts.as_ref().map_or(usual, |bursts| bursts.period);
    if let Some(bursts) = &bursts {
        bursts.report(report, seconds(record, rows[bursts.first]));
    }
    // Jitter is judged on what is no gap.
    let near: Vec<f64> = dt.iter().copied().filter(|&x| x <= GAP * usual).collect();
    let (low, high) = (quantile(near.clone(), 0.01).unwrap_or(usual), quantile(near, 0.99).unwrap_or(usual));
    let spread = (high - low) / usual;
    // Where stamps jitter much, only an interval well beyond the jitter is a gap.
    let gap = usual * if spread > JITTER && bursts.is_none() { 2.0 * GAP } else { GAP };
    let gaps: Vec<usize> = (0..dt.len()).filter(|&k| dt[k] > gap).collect();
    if let Some(&first) = gaps.first() {
        let missing: f64 = gaps.iter().map(|&k| (dt[k] / usual).round() - 1.0).sum();
        let longest = gaps.iter().map(|&k| dt[k]).fold(0.0, f64::max);
        report.add(
            FaultKind::Dropouts,
            gaps.len() as u64,
            Some(seconds(record, rows[first])),
            format!(
                "{}, about {} missing, the longest {longest:.3} s; nothing is assumed inside",
                counted(gaps.len(), "gap"),
                counted(missing as usize, "sample")
            ),
        );
    }
    if spread > JITTER && bursts.is_none() {
        let off = |k: &usize| (dt[*k] - usual).abs() > 0.25 * usual && dt[*k] <= gap;
        let count = (0..dt.len()).filter(off).count() as u64;
        let first = (0..dt.len()).find(off).map(|k| seconds(record, rows[k]));
        report.add(
            FaultKind::TimestampJitter,
            count,
            first,
            format!(
                "sample intervals spread over {:.2} to {:.2} ms about {:.2} ms: if they are stamped where they arrive, stamp \
                 them where they are taken; if they are taken so unevenly, nothing is wrong",
                low * 1e3,
                high * 1e3,
                usual * 1e3
            ),
        );
    }
}
