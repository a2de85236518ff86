//! Amplitude spectral densities by Welch's method (Hann windows, half overlap).

use super::{Input, Referenced, Spectrum, short, some};
use crate::evidence::spectrum;
use std::f64::consts::PI;

/// Length of one segment; lines keep their height because no bins are merged.
const SEGMENT: usize = 2048;

/// Spectra of rate error and motion on an even grid at the reference's median interval.
pub(super) fn spectrum(input: &Input, referenced: &Referenced) -> Spectrum {
    let dt = referenced.dt;
    if dt <= 0.0 {
        return Spectrum::default();
    }
    let angle_error = even(&referenced.t, &referenced.error, dt);
    let error: Vec<f64> = angle_error.windows(2).map(|w| (w[1] - w[0]) / dt).collect();
    let finite: Vec<usize> = (0..input.t.len()).filter(|&k| input.rate[k].is_finite()).collect();
    let t: Vec<f64> = finite.iter().map(|&k| input.t[k]).collect();
    let rate: Vec<f64> = finite.iter().map(|&k| input.rate[k]).collect();
    let motion = even(&t, &rate, dt);
    let segment = SEGMENT.min(usize::MAX >> error.len().leading_zeros() >> 1).max(16);
    let (error, motion) = (welch(&error, dt, segment), welch(&motion, dt, segment));
    let n = error.len().min(motion.len());
    let frequency: Vec<f64> = (1..n).map(|i| i as f64 / (segment as f64 * dt)).collect();
    // A difference of white encoder noise has the gain |1 − e^(−iωΔt)|² / Δt².
    let floor = |f: f64| {
        let gain = (2.0 * (PI * f * dt).sin() / dt).powi(2);
        let density = 2.0 * input.noise.angle_random_walk.powi(2) + 2.0 * dt * input.noise.encoder.powi(2) * gain;
        if density > 0.0 { some(density.sqrt()) } else { None }
    };
    Spectrum {
        floor: frequency.iter().map(|&f| floor(f)).collect(),
        error: error[1.min(n)..n].iter().map(|&d| some(d.sqrt())).collect(),
        motion: motion[1.min(n)..n].iter().map(|&d| some(d.sqrt())).collect(),
        frequency: frequency.into_iter().map(short).collect(),
    }
}

/// Linear interpolation on an even grid.
fn even(t: &[f64], y: &[f64], dt: f64) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (t.first(), t.last()) else { return Vec::new() };
    let mut k = 0;
    (0..=((last - first) / dt) as usize)
        .map(|i| {
            let at = first + i as f64 * dt;
            while k + 2 < t.len() && t[k + 1] < at {
                k += 1;
            }
            if t.len() < 2 {
                y[0]
            } else {
                y[k] + (y[k + 1] - y[k]) * ((at - t[k]) / (t[k + 1] - t[k])).clamp(0.0, 1.0)
            }
        })
        .collect()
}

/// One-sided power spectral density, unit²/Hz, at i/(segment·dt); empty where there is less than one segment.
fn welch(y: &[f64], dt: f64, segment: usize) -> Vec<f64> {
    let window = spectrum::hann(segment);
    let power: f64 = window.iter().map(|w| w * w).sum();
    let mut sum = vec![0.0; segment / 2 + 1];
    let mut count = 0.0;
    let mut start = 0;
    while start + segment <= y.len() {
        let piece = &y[start..start + segment];
        let mean = piece.iter().sum::<f64>() / segment as f64;
        let mut buffer: Vec<f64> = piece.iter().zip(&window).map(|(v, w)| (v - mean) * w).collect();
        sum.iter_mut().zip(spectrum::power(&mut buffer)).for_each(|(sum, own)| *sum += own);
        count += 1.0;
        start += segment / 2;
    }
    if count == 0.0 { Vec::new() } else { sum.iter().map(|s| 2.0 * s * dt / (power * count)).collect() }
}
