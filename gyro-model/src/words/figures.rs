//! Angles and times to two figures.

use crate::units::two;

/// A number of rad that is not negative, in degrees.
pub(super) fn degrees(radians: f64) -> String {
    two(radians.to_degrees())
}

/// A time, s.
pub(super) fn seconds(seconds: f64) -> String {
    let decimals = (1.0 - seconds.max(1e-3).log10().floor()).max(0.0) as usize;
    format!("{seconds:.decimals$} s")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_figures() {
        assert_eq!([0.0, 0.01234, 1.26, 12.6, 126.0].map(two), ["0", "0.012", "1.3", "13", "126"]);
        assert_eq!(degrees(0.1), "5.7");
        assert_eq!([0.126, 6.04, 61.0].map(seconds), ["0.13 s", "6.0 s", "61 s"]);
    }
}
