//! Small steps of a shaft's angle that stay: a coupling that slips by a degree, counts that are missed once.
//!
//! Such a step is far beyond the others from one reading to the next, but so may be what a clock that was set makes, or a late reading. So
//! the reference's way beyond the gyro's, o, is fitted on both sides of it (linear least squares), and the step has to be there beside all
//! that a coarse calibration and another delay would leave:
//!
//! ```text
//! o(t) = a + s·[t ≥ t₀] + b (t − t₀) + (d + e·[t ≥ t₀]) ω(t) + g θ(t)
//! ```
//!
//! with s what the one step was, and beyond what is left of o. Steps at reversals, once there are several, are a random cause
//! (`reversal-steps`) and stay.

use super::course::Course;
use crate::{
    Axis, Record,
    fault::FaultKind,
    faults::{
        Report,
        channel::Channel,
        counted, seconds,
        thresholds::{AT_REVERSALS, FEW_SLIPS, FROM_ONE_STEP, SHOWN_SLIP},
    },
    nls::{self, Normal},
    order::median,
};
use std::ops::Range;

/// How long on either side the reference is looked at, s: where that cannot tell, longer.
const LOOKS: [f64; 2] = [2.0, 8.0];
/// Readings that either side needs.
const FEWEST: usize = 20;
/// Parameters of a fit.
const COLUMNS: usize = 6;
/// Times what a fit leaves that it has to take away with its step.
const THAN_A_DELAY: f64 = 3.0;

/// One step that stays, or several close together.
struct Slip {
    /// From the first reading after the first step to the one after the last.
    rows: Range<usize>,
    /// How many steps.
    count: usize,
    /// By how much the reference is off behind them, rad.
    size: f64,
}

/// Sets back what slipped, leaves out the readings between steps that are close together, and reports it.
pub(super) fn check(record: &mut Record, axis: Axis, report: &mut Report) -> Option<()> {
    let (course, _) = Course::of_angle(record, axis)?;
    let slips = slips(&course);
    let first = slips.first()?.rows.start;
    let channel = Channel::Angle(axis);
    let (mut back, mut next) = (0.0, slips.iter().peekable());
    for (k, &row) in course.rows.iter().enumerate() {
        if let Some(slip) = next.next_if(|slip| slip.rows.end == k) {
            back += slip.size;
        }
        let is_between = next.peek().is_some_and(|slip| slip.rows.contains(&k));
        let place = channel.place(&mut record.rows[row]);
        *place = if is_between { f64::NAN } else { *place - back };
    }
    let count: usize = slips.iter().map(|slip| slip.count).sum();
    let sizes = |slip: &Slip| course.error[slip.rows.start].z.abs();
    let size = median(slips.iter().map(sizes).collect())?.to_degrees();
    let set_back = if count == 1 { "It is set back" } else { "They are set back" };
    let left_out: usize = slips.iter().map(|slip| slip.rows.len()).sum();
    let left_out = match left_out {
        0 => String::new(),
        1 => ", and a reading between two of them is left out".to_owned(),
        n => format!(", and {n} readings between them are left out"),
    };
    let says = format!(
        "{}: {} from one reading to the next that the gyro does not feel, of about {size:.2}°. {set_back}{left_out}. An encoder that slips does \
         this, or counts that are missed: check its coupling and its cable",
        channel.name(),
        counted(count, "step")
    );
    let t = seconds(record, course.rows[first]);
    report.add_for(Some(axis), FaultKind::ReferenceJumps, count as u64, Some(t), says);
    Some(())
}

/// The steps that stay.
fn slips(course: &Course) -> Vec<Slip> {
    let mut offset = vec![0.0; course.error.len()];
    for k in 1..offset.len() {
        offset[k] = offset[k - 1] + course.error[k].z;
    }
    let steps = course.steps();
    if steps.len() > FEW_SLIPS {
        return Vec::new();
    }
    let groups: Vec<&[usize]> = steps.chunk_by(|a, b| b - a < FEWEST).collect();
    let slip = |(place, own): (usize, &&[usize])| {
        let (first, last) = (own[0], own[own.len() - 1]);
        let from = place.checked_sub(1).map_or(0, |before| groups[before][groups[before].len() - 1]);
        let to = groups.get(place + 1).map_or(offset.len(), |after| after[0]);
        let size = offset[last] - offset[first - 1];
        let is_slip = LOOKS.iter().any(|reach| stays(course, &offset, first..last, (from, to), *reach));
        is_slip.then_some(Slip { rows: first..last, count: own.len(), size })
    };
    let slips: Vec<Slip> = groups.iter().enumerate().filter_map(slip).collect();
    let mean_square = course.rate.iter().map(|rate| rate.z * rate.z).sum::<f64>() / course.rate.len().max(1) as f64;
    let turns_round = |slip: &&Slip| course.rate[slip.rows.start].z.abs() < AT_REVERSALS.1 * mean_square.sqrt();
    let many = slips.len() >= AT_REVERSALS.0;
    if many && 2 * slips.iter().filter(turns_round).count() > slips.len() { Vec::new() } else { slips }
}

/// Whether what the reference did in these readings stays, looked at within `bounds` and so many seconds. What comes back after one
/// reading is an outlier, and none of this.
fn stays(course: &Course, offset: &[f64], between: Range<usize>, bounds: (usize, usize), reach: f64) -> bool {
    let t = &course.t;
    let (first, last) = (between.start, between.end);
    let known = |i: &usize| !course.is_hole[*i];
    let before = (bounds.0 + 1..first).rev().take_while(|i| known(i) && t[first] - t[*i] <= reach).count();
    let after = (last + 1..bounds.1).take_while(|i| known(i) && t[*i] - t[last] <= reach).count();
    if before.min(after) < FEWEST || !between.clone().all(|i| known(&i)) {
        return false;
    }
    let size = offset[last] - offset[first - 1];
    let mut turned = 0.0;
    let (mut y, mut columns) = (Vec::new(), vec![Vec::new(); COLUMNS]);
    for i in first - before..last + after {
        turned += course.turned[i].z;
        if between.contains(&i) {
            continue;
        }
        let (later, rate) = (f64::from(i >= last), course.rate[i].z);
        let row = [1.0, later, t[i] - t[first], rate, later * rate, turned];
        columns.iter_mut().zip(row).for_each(|(column, x)| column.push(x));
        y.push(offset[i] - offset[first - 1]);
    }
    let mut normal = Normal::zeros(COLUMNS);
    normal.add(&y, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
    let (inverse, unobservable) = nls::invert_observable(&normal.matrix, 1e-6);
    if unobservable.contains(&1) {
        return false;
    }
    let fitted = |i: usize| (0..COLUMNS).map(|j| inverse[(i, j)] * normal.gradient[j]).filter(|x| x.is_finite()).sum();
    let fitted: Vec<f64> = (0..COLUMNS).map(fitted).collect();
    let left = normal.cost - nls::dot(&fitted, &normal.gradient);
    let noise = (left.max(0.0) / (y.len() - COLUMNS) as f64).sqrt();
    let shown = SHOWN_SLIP * noise * inverse[(1, 1)].sqrt().max(1.0);
    // Where the axis turns evenly, so much later is as far: a change of the delay alone has to leave much more.
    let is_no_delay = fitted[1].powi(2) / inverse[(1, 1)] > THAN_A_DELAY * left;
    let largest = between.clone().chain([last]).map(|i| course.error[i].z.abs()).fold(0.0, f64::max);
    let comes_back = last - first >= 2 && size.abs() < course.least && fitted[1].abs() < FROM_ONE_STEP * largest;
    (fitted[1] - size).abs() < FROM_ONE_STEP * largest
        && largest > shown
        && (size.abs() > shown && is_no_delay || comes_back)
}
