//! The guard against a reference that was computed from the very gyro it is held against: an autopilot's or a phone's attitude
//! follows that gyro's errors, so that holding the gyro against it shows nothing.

use crate::words::{name, with};
use gyro_model::words::Argument;
use gyro_model::{
    Axis,
    fault::{DataFault, FaultKind},
};
use log_readers::meaning::{Pick, Second};

/// The fault of a log whose reference `by` computed, and that has these other gyros.
#[must_use]
pub fn fault(by: &str, seconds: &[Second], rows: u64) -> DataFault {
    DataFault {
        kind: FaultKind::DependentReference,
        axis: None,
        count: rows,
        first_t: Some(0.0),
        says: format!(
            "{by} computed the reference from this very gyro, so that it has the gyro's errors in it. {}Use \
             an encoder, motion capture, cameras, a second IMU or a simulator's truth, given {} or named {}; \
             {} judges it all the same",
            others(seconds).map_or_else(String::new, |says| says + ". "),
            with(Argument::Reference("FILE")),
            with(Argument::Map(&["ref_q=CHANNEL".into()])),
            name(Argument::Dependent),
        ),
    }
}

/// What the other gyros of a log are good for.
#[must_use]
pub fn others(seconds: &[Second]) -> Option<String> {
    let first = seconds.iter().find(|of| of.serves()).or_else(|| seconds.first())?;
    let picks: Vec<String> = first.picks.iter().map(Pick::to_string).collect();
    let maps = Argument::Map(&picks);
    if first.serves() {
        return Some(format!("{} is another IMU, and a reference of its own {}", first.topic, with(maps)));
    }
    let names = seconds.iter().map(|of| of.topic.as_str()).collect::<Vec<_>>().join(" and ");
    let are = if seconds.len() > 1 { "are other IMUs" } else { "is another IMU" };
    let most = seconds.iter().map(|of| of.rate_hz).fold(f64::NAN, f64::max);
    let (rate, needed) = (if most.is_finite() { most } else { 0.0 }, Second::SLOWEST_HZ);
    Some(format!(
        "{names} {are}, but logged {rate:.1} times a second only, where {needed} are needed: log each IMU at full rate, and the second one is \
         the reference, taken {}",
        with(maps)
    ))
}

/// Whether an axis is judged by such a reference.
#[must_use]
pub fn concerns(fault: &DataFault, axis: Axis) -> bool {
    fault.kind == FaultKind::DependentReference && fault.concerns(axis)
}
