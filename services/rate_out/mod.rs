//! The rate out: to a socket, to standard output, into shared memory (`docs/feed.md`).
//!
//! Shared memory is written by kalman itself ([`ring`]); the others by a process of their own ([`crate::sender`]), so that no
//! receiver, however slow, is ever waited for by kalman.

pub mod datagrams;
pub mod ring;
pub mod sink;
pub mod socket;
pub mod standard_output;
pub mod target;
pub mod text;

pub use target::{Target, Way};

use gyro_model::estimator::flags;
use ipc_types::{
    Estimate, MARK_DATA, RateRow,
    estimate::FLAG_STALE_PARAMETERS,
    rate::{CHANGED, END, HELD, LOST, OUTLIER, PRESENT, RESTARTED, STALE},
};

/// An estimate as others get it.
#[must_use]
pub fn row_of(estimate: &Estimate) -> RateRow {
    let data = estimate.mark == MARK_DATA;
    let stale = if estimate.flags & FLAG_STALE_PARAMETERS != 0 { STALE } else { 0 };
    let mut row = RateRow {
        flags: stale | if data { 0 } else { END },
        sequence: estimate.sequence,
        valid_ns: estimate.valid_ns,
        valid_clock_ns: estimate.valid_clock_ns,
        given_ns: estimate.kalman_gave_ns,
        epoch: estimate.epoch,
        ..RateRow::default()
    };
    for (i, axis) in estimate.axes.iter().enumerate().filter(|_| data) {
        let values = [axis.rate_filtered, axis.rate_std, axis.rate];
        // An observer has no standard deviation: then there is 0.
        if axis.present == 0 || !axis.rate_filtered.is_finite() {
            continue;
        }
        [row.rate[i], row.rate_std[i], row.rate_compensated[i]] = values.map(|v| if v.is_finite() { v } else { 0.0 });
        let known = [
            (flags::HELD, HELD),
            (flags::LOST, LOST),
            (flags::OUTLIER, OUTLIER),
            (flags::RESTARTED, RESTARTED),
            (flags::CHANGED, CHANGED),
        ];
        row.axis_flags[i] =
            known.iter().filter(|(ours, _)| axis.flags & ours != 0).fold(PRESENT, |sum, (_, theirs)| sum | theirs);
    }
    row
}

#[cfg(test)]
mod tests {
    use super::{Estimate, PRESENT, row_of};

    #[test]
    fn nothing_that_is_not_finite_goes_out() {
        let mut estimate = Estimate { valid_ns: 10, valid_clock_ns: 80, ..Estimate::default() };
        for (axis, rate) in estimate.axes.iter_mut().zip([f64::NAN, 0.5, f64::INFINITY]) {
            (axis.present, axis.rate_filtered, axis.rate_std) = (1, rate, f64::NAN);
        }
        let row = row_of(&estimate);
        assert_eq!((row.rate, row.axis_flags), ([0.0, 0.5, 0.0], [0, PRESENT, 0]));
        assert!(row.rate_std.iter().all(|v| v.is_finite()));
        assert_eq!(row.valid_clock_ns, 80);
    }
}
