//! Spectra and cross-spectra of the error, of the gyro and of the reference, in bands of frequency.
//!
//! Gyro and reference measure one motion ω: after compensation g = ω + n_g and r = ω + n_r, and the error is e = g − r. Then
//!
//! ```text
//! S_ee = Re S_eg − Re S_er        Re S_eg = S_ng        −Re S_er = S_nr
//! ```
//!
//! so the two cross-spectra divide the error, frequency by frequency, into what only the gyro shows and what only the
//! reference shows. Sine tapers (Riedel & Sidorenko 1995), one-sided densities of rates, (rad/s)²/Hz.

use crate::evidence::spectrum::{fast_length, transform};
use realfft::num_complex::Complex;
use std::f64::consts::PI;

/// One band.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    /// Lower edge, Hz.
    pub low: f64,
    /// Upper edge, Hz.
    pub high: f64,
    /// S_ee.
    pub error: f64,
    /// S_gg.
    pub gyro: f64,
    /// S_rr.
    pub reference: f64,
    /// S_eg.
    pub with_gyro: Complex<f64>,
    /// S_er.
    pub with_reference: Complex<f64>,
    /// Independent values that these are means of.
    pub count: f64,
}

impl Band {
    /// Its middle, Hz.
    #[must_use]
    pub(crate) fn frequency(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Density of the error that only the gyro shows, and its standard error.
    #[must_use]
    pub(crate) fn of_gyro(&self) -> (f64, f64) {
        (self.with_gyro.re, (0.5 * self.error * self.gyro / self.count).sqrt())
    }

    /// Density of the error that only the reference shows, and its standard error.
    #[must_use]
    pub(crate) fn of_reference(&self) -> (f64, f64) {
        (-self.with_reference.re, (0.5 * self.error * self.reference / self.count).sqrt())
    }

    /// Density of the error that is coherent with the gyro, less what chance makes of incoherent noise.
    #[must_use]
    pub(crate) fn coherent(&self) -> f64 {
        let seen = self.with_gyro.norm_sqr() / self.gyro.max(1e-300);
        ((seen - self.error / self.count) / (1.0 - 1.0 / self.count)).max(0.0).min(self.error)
    }

    /// What share of it the error is of the gyro's rate, in phase, and its standard error: 1 where the reference does not follow.
    #[must_use]
    pub(crate) fn share_of_gyro(&self) -> (f64, f64) {
        let rest = (self.error - self.with_gyro.norm_sqr() / self.gyro).max(0.0);
        (self.with_gyro.re / self.gyro, (0.5 * rest / self.gyro / self.count).sqrt())
    }

    /// Mean over the band of what a density makes of the mean square rate error over `tau`, times the band's width, Hz: for a
    /// sum of m rate steps Δt apart sin²(πfτ) / (m sin πfΔt)².
    #[must_use]
    pub(crate) fn passes(&self, tau: f64, dt: f64) -> f64 {
        let width = self.high - self.low;
        let swing = |f: f64| (2.0 * PI * f * tau).sin() / (2.0 * PI * tau);
        let mean_square = 0.5 - 0.5 * (swing(self.high) - swing(self.low)) / width;
        let one = (PI * self.frequency() * dt).sin() * (tau / dt).max(1.0);
        width * (mean_square / (one * one)).min(1.0)
    }
}

/// Tapers, and values of a spectrum in a band at least: with so many tapers neighbouring ones are not independent.
const TAPERS: usize = 3;
const FEWEST: usize = 3;
/// Width of a band over its frequency.
const WIDTH: f64 = 0.06;
/// Bands up to half the sampling rate at least.
const NARROWEST: f64 = 1.0 / 160.0;

/// The bands of three series of steps, rad, a row apart each: of the error, of the gyro's angle, of the reference's.
#[must_use]
pub(crate) fn bands(steps: [&[f64]; 3], dt: f64) -> Vec<Band> {
    let n = fast_length(steps[0].len());
    let of = |series: &[f64], taper: usize| {
        let mean = series.iter().sum::<f64>() / series.len() as f64;
        let turn = PI * (taper + 1) as f64 / (n + 1) as f64;
        let size = (2.0 / (n + 1) as f64).sqrt() / dt;
        let mut tapered: Vec<f64> =
            series[..n].iter().enumerate().map(|(k, x)| size * (turn * (k + 1) as f64).sin() * (x - mean)).collect();
        transform(&mut tapered)
    };
    let each: Vec<[Vec<Complex<f64>>; 3]> = (0..TAPERS).map(|taper| steps.map(|s| of(s, taper))).collect();
    let top = n / 2;
    let apart = 1.0 / (n as f64 * dt);
    let mut bands = Vec::new();
    let mut first = 1;
    while first < top {
        let widest = (NARROWEST * n as f64).max(FEWEST as f64);
        let width = ((WIDTH * first as f64).min(widest) as usize).max(FEWEST);
        let after = if top - first < 2 * width { top } else { first + width };
        let values = (after - first) as f64;
        let mean = |i: usize, j: usize| {
            let sum: Complex<f64> = each
                .iter()
                .flat_map(|x| x[i][first..after].iter().zip(&x[j][first..after]))
                .map(|(a, b)| a.conj() * b)
                .sum();
            sum * (2.0 * dt / (values * TAPERS as f64))
        };
        bands.push(Band {
            low: (first as f64 - 0.5) * apart,
            high: (after as f64 - 0.5) * apart,
            error: mean(0, 0).re,
            gyro: mean(1, 1).re,
            reference: mean(2, 2).re,
            with_gyro: mean(0, 1),
            with_reference: mean(0, 2),
            count: values + 2.0,
        });
        first = after;
    }
    bands
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn noise_of_the_reference_is_told_from_noise_of_the_gyro() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let dt = 0.01;
        let (own, of_reference): (Vec<f64>, Vec<f64>) = (0..20_000).map(|_| (1e-5 * normal(), 3e-5 * normal())).unzip();
        let motion: Vec<f64> = (0..20_000).map(|k| 1e-2 * (0.02 * f64::from(k)).sin()).collect();
        let sum =
            |a: &[f64], b: &[f64], sign: f64| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + sign * b).collect() };
        let (gyro, reference) = (sum(&motion, &own, 1.0), sum(&motion, &of_reference, 1.0));
        let bands = bands([&sum(&gyro, &reference, -1.0), &gyro, &reference], dt);
        let density = |sigma: f64| 2.0 * sigma * sigma / dt;
        let high: Vec<&Band> = bands.iter().filter(|band| band.low > 5.0).collect();
        let mean = |of: &dyn Fn(&Band) -> f64| high.iter().map(|band| of(band)).sum::<f64>() / high.len() as f64;
        assert!((mean(&|b| b.of_gyro().0) / density(1e-5) - 1.0).abs() < 0.15);
        assert!((mean(&|b| b.of_reference().0) / density(3e-5) - 1.0).abs() < 0.05);
        // White steps make the mean square of their sums, whatever the averaging time.
        for tau in [0.02, 0.13, 1.0] {
            let made = bands.iter().map(|band| band.passes(tau, dt) * density(1e-5)).sum::<f64>();
            assert!((made / (1e-10 / dt / tau) - 1.0).abs() < 0.1, "{tau}: {made}");
        }
    }
}
