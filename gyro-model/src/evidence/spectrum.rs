//! Spectra of real series: squared magnitudes of the fast Fourier transform, and Hann's taper.

use realfft::{RealFftPlanner, num_complex::Complex};
use std::{cell::RefCell, f64::consts::TAU};

thread_local! {
    /// Twiddle factors of the lengths that this thread has transformed.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// |X_k|² of a series at k = 0 … n/2; the series is spoilt. Empty for an empty series.
pub(crate) fn power(series: &mut [f64]) -> Vec<f64> {
    transform(series).iter().map(Complex::norm_sqr).collect()
}

/// X_k of a series at k = 0 … n/2; the series is spoilt. Empty for an empty series.
pub(crate) fn transform(series: &mut [f64]) -> Vec<Complex<f64>> {
    if series.is_empty() {
        return Vec::new();
    }
    let fft = PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(series.len()));
    let mut output = fft.make_output_vec();
    // Only another length than planned is refused.
    if fft.process(series, &mut output).is_err() {
        return Vec::new();
    }
    output
}

/// Hann's weights of n values, ½ − ½ cos(2π(k + ½)/n), the cosines by rotating from one to the next.
pub(crate) fn hann(n: usize) -> Vec<f64> {
    let (turn_sin, turn_cos) = (TAU / n as f64).sin_cos();
    let (mut sin, mut cos) = (0.0, 1.0);
    (0..n)
        .map(|k| {
            // What rounding adds up to stays small.
            if k % RENEWED == 0 {
                (sin, cos) = (TAU * (k as f64 + 0.5) / n as f64).sin_cos();
            }
            let weight = 0.5 - 0.5 * cos;
            (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
            weight
        })
        .collect()
}

/// Rotations until sine and cosine are computed anew.
const RENEWED: usize = 64;

/// The largest length up to `n` without a prime factor above five: its transform is fast.
pub(crate) fn fast_length(n: usize) -> usize {
    let is_smooth = |n: usize| {
        [2, 3, 5].into_iter().fold(n, |mut n, prime| {
            while n.is_multiple_of(prime) {
                n /= prime;
            }
            n
        }) == 1
    };
    (1..=n).rev().find(|&n| is_smooth(n)).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cosine_has_all_its_power_at_its_frequency() {
        let mut cosine: Vec<f64> = (0..120).map(|k| (TAU * 7.0 * f64::from(k) / 120.0).cos()).collect();
        let power = power(&mut cosine);
        assert_eq!(power.len(), 61);
        assert!((power[7] - 3600.0).abs() < 1e-6, "{}", power[7]);
        assert!(power.iter().enumerate().all(|(k, p)| k == 7 || *p < 1e-12));
    }

    #[test]
    fn the_taper_is_that_of_its_equation() {
        for n in [5, 64, 1001] {
            for (k, weight) in hann(n).into_iter().enumerate() {
                let expected = 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / n as f64).cos();
                assert!((weight - expected).abs() < 1e-13, "{n} {k}");
            }
        }
    }

    #[test]
    fn fast_lengths_have_small_factors() {
        assert_eq!([1, 7, 127, 1000, 51_001].map(fast_length), [1, 6, 125, 1000, 50_625]);
    }
}
