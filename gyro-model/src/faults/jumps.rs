//! Jumps of a reference that the gyro does not feel: an encoder that slips, markers of a camera system that change places,
//! a pose that is off by half a turn for a while, a tracker that begins anew, and a clock that was set.
//!
//! The reference is held against the gyro's integral, step by step. Where a step of their difference is far beyond the others
//! the reference is cut; of the pieces those count that go on where the gyro says, from the longest one on ([`walk`]). A piece
//! that comes and goes is left out. One that stays, and goes with the gyro again, is set back to where the reference was. So is a small step of
//! a shaft's angle that nothing else makes ([`slips`]).

mod course;
mod slips;
mod walk;

use super::{Report, channel::Channel, counted, seconds, thresholds::CLOCK_SET};
use crate::{Axis, Record, fault::FaultKind, record::ReferenceKind};
use course::Course;
use nalgebra::UnitQuaternion;
use walk::{Moved, Walked};

/// Takes out what jumps, and reports it.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        if record.reference(axis) == Some(ReferenceKind::Angle) {
            angle(record, axis, report);
            slips::check(record, axis, report);
        }
    }
    if Axis::ALL.iter().all(|&axis| record.reference(axis) == Some(ReferenceKind::Quaternion)) {
        orientation(record, report);
    }
}

fn angle(record: &mut Record, axis: Axis, report: &mut Report) -> Option<()> {
    let (course, values) = Course::of_angle(record, axis)?;
    let mut offsets = vec![0.0; values.len()];
    for k in 1..offsets.len() {
        offsets[k] = offsets[k - 1] + course.error[k].z;
    }
    let mut found = walk::walk(&offsets, &course.t, &course.cuts(), |a, b| course.may_differ(a, b))?;
    let set: Vec<Set> = clocks(&course, &mut found, |from, to| to - from);
    let channel = Channel::Angle(axis);
    let sizes = found.sizes(&offsets);
    let (mut back, mut next) = (0.0, found.moved.iter().peekable());
    for (k, &row) in course.rows.iter().enumerate() {
        if let Some(moved) = next.next_if(|moved| moved.index == k) {
            back += moved.after - moved.before;
        }
        *channel.place(&mut record.rows[row]) -= back;
    }
    leave_out(record, &course, &found, |row| *channel.place(row) = f64::NAN);
    say(record, report, Some(axis), &channel.name(), &course, &found, &sizes);
    say_set(record, report, Some(axis), &channel.name(), &course, &set);
    Some(())
}

fn orientation(record: &mut Record, report: &mut Report) -> Option<()> {
    let (course, attitude) = Course::of_orientation(record)?;
    let mut offsets = vec![UnitQuaternion::identity(); attitude.len()];
    for k in 1..offsets.len() {
        // q_k = O_k G_k, and G_k is what the gyro makes of the attitude before.
        let gyro = attitude[k - 1] * UnitQuaternion::from_scaled_axis(course.turned[k]);
        let step = if course.is_hole[k] { UnitQuaternion::identity() } else { attitude[k] * gyro.inverse() };
        offsets[k] = step * offsets[k - 1];
    }
    let mut found = walk::walk(&offsets, &course.t, &course.cuts(), |a, b| course.may_differ(a, b))?;
    let set = clocks(&course, &mut found, |from, to| (to * from.inverse()).angle());
    let sizes = found.sizes(&offsets);
    let (mut back, mut next) = (UnitQuaternion::identity(), found.moved.iter().peekable());
    for (k, &row) in course.rows.iter().enumerate() {
        if let Some(moved) = next.next_if(|moved| moved.index == k) {
            back *= moved.before * moved.after.inverse();
        }
        let q = (back * attitude[k]).into_inner();
        record.rows[row].ref_quaternion = [q.w, q.i, q.j, q.k];
    }
    leave_out(record, &course, &found, |row| row.ref_quaternion.fill(f64::NAN));
    say(record, report, None, "the reference orientation", &course, &found, &sizes);
    say_set(record, report, None, "the reference orientation", &course, &set);
    Some(())
}

/// A reference that comes more seldom makes no row faulty.
fn leave_out<O>(record: &mut Record, course: &Course, found: &Walked<O>, forget: impl Fn(&mut crate::Row)) {
    for &row in found.out.iter().flat_map(|span| &course.rows[span.clone()]) {
        forget(&mut record.rows[row]);
    }
}

fn say<O>(
    record: &Record,
    report: &mut Report,
    axis: Option<Axis>,
    name: &str,
    course: &Course,
    found: &Walked<O>,
    sizes: &[f64],
) {
    let count = found.out.len() + found.moved.len();
    let firsts = found.out.iter().map(|span| span.start).chain(found.moved.iter().map(|moved| moved.index));
    let (Some(first), Some(size)) = (firsts.min(), crate::order::median(sizes.to_vec())) else { return };
    let size = size.to_degrees();
    let digits = if size < 10.0 { 2 } else { 0 };
    let mut says = format!("{name}: {} that the gyro does not feel, of about {size:.digits$}°", counted(count, "jump"));
    if !found.out.is_empty() {
        let rows: usize = found.out.iter().map(std::ops::Range::len).sum();
        let lasts = |span: &std::ops::Range<usize>| course.t[span.end - 1] - course.t[span.start] + course.step;
        let longest = found.out.iter().map(lasts).fold(0.0, f64::max);
        let back = if found.moved.is_empty() {
            "it comes back".to_owned()
        } else {
            format!("from {} it comes back", found.out.len())
        };
        says = format!("{says}; {back} for up to {longest:.2} s, and those {rows} readings are left out");
    }
    if !found.moved.is_empty() {
        says += if found.out.is_empty() { "; it stays, and is set back" } else { "; from the others it is set back" };
    }
    says += match (axis, found.moved.len()) {
        (None, 0) => {
            ". Markers that change places do this, and a pose with two solutions: check the camera system's labels"
        }
        (None, _) => ". A tracker that starts again does this: check the camera system",
        (Some(_), _) => {
            ". An encoder that slips does this, or counts that are missed: check its coupling and its cable"
        }
    };
    let t = seconds(record, course.rows[first]);
    report.add_for(axis, FaultKind::ReferenceJumps, count as u64, Some(t), says);
}

/// A clock that was set: when, by how long the reference is later from then on, and the jump that it makes.
struct Set {
    index: usize,
    later: f64,
    size: f64,
}

/// Takes the jumps that are a clock's out of those that stay: what is later by j jumps by the rate times j, and another delay
/// stands behind it.
fn clocks<O: Copy>(course: &Course, found: &mut Walked<O>, size: impl Fn(O, O) -> f64) -> Vec<Set> {
    let mut set = Vec::new();
    found.moved.retain(|&Moved { index, before, after }| {
        let size = size(before, after);
        let Some(earlier) = course.change_of_delay(index) else { return true };
        let rate = course.rate[index];
        let expected = if course.is_angle { rate.z * earlier } else { (rate * earlier).norm() };
        let is_clock = earlier.abs() > CLOCK_SET.0 && (size - expected).abs() < CLOCK_SET.1 * size.abs();
        if is_clock {
            set.push(Set { index, later: -earlier, size });
        }
        !is_clock
    });
    set
}

fn say_set(record: &Record, report: &mut Report, axis: Option<Axis>, name: &str, course: &Course, set: &[Set]) {
    let Some(first) = set.first() else { return };
    let (ms, way) = (first.later.abs() * 1e3, if first.later > 0.0 { "later" } else { "earlier" });
    let says = format!(
        "a clock was set: {name} jumps by {:.2}°, which is its rate times {ms:.0} ms, and is {ms:.0} ms {way} from then on. Record \
         gyro and reference by one clock that nobody sets (a monotonic one), or cut the log there",
        first.size.to_degrees().abs()
    );
    let t = seconds(record, course.rows[first.index]);
    report.add_for(axis, FaultKind::ReferenceJumps, set.len() as u64, Some(t), says);
}

#[cfg(test)]
mod tests;
