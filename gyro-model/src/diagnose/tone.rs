//! Where a vibration tone may be: the highest line in the spectrum of the whitened residual; and whether the gyro itself
//! sees it.
//!
//! An encoder's quantisation under a regular motion draws lines too. They are not in the gyro's reading: a tone that is
//! physics stands there with the amplitude that the residual gives it.

use super::refit::Refit;
use crate::{AxisModel, evidence::series::Series};
use realfft::RealFftPlanner;

/// How many separate lines a log has room for.
#[must_use]
pub fn frequencies(t: &[f64]) -> f64 {
    t.len() as f64
}

/// The strongest frequencies from 1 Hz up at which the reading has a line too, strongest first, Hz; none where the rows
/// are too few for a spectrum.
#[must_use]
pub fn peaks(white: &[Vec<f64>], t: &[f64], series: &Series) -> Vec<f64> {
    let (Some((power, bin)), Some(reading)) = (spectrum(white, t), Prominence::new(series)) else { return Vec::new() };
    let first = (1.0 / bin).ceil() as usize + 1;
    let last = (0.49 * (power.len() - 1) as f64 / 0.5) as usize;
    let is_top = |k: usize| power[k] >= power[k - 1] && power[k] > power[k + 1];
    let mut tops: Vec<usize> = (first..last.max(first)).filter(|&k| is_top(k)).collect();
    tops.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    let mut chosen: Vec<usize> = Vec::new();
    for k in tops {
        // The side lobes of a line are not lines.
        if chosen.iter().all(|c| c.abs_diff(k) > LOBES) && reading.at(k as f64 * bin) > PROMINENT {
            chosen.push(k);
        }
        if chosen.len() == LINES {
            break;
        }
    }
    chosen.iter().map(|&k| reading.top(k as f64 * bin)).collect()
}

/// Power of the reading about a frequency over the median of its neighbourhood.
struct Prominence {
    power: Vec<f64>,
    bin: f64,
}

/// Times the median that noise alone hardly reaches in any of a log's bins.
const PROMINENT: f64 = 25.0;
/// Bins on either side that the median is taken over.
const AROUND: usize = 300;

impl Prominence {
    fn new(series: &Series) -> Option<Self> {
        let n = series.gyro.len();
        let mean = series.gyro.iter().sum::<f64>() / n as f64;
        let hann = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / n as f64).cos();
        let tapered = series.gyro.iter().enumerate().map(|(k, g)| hann(k) * (g - mean)).collect();
        let (power, bin) = spectrum(&[tapered], &series.t)?;
        Some(Self { power, bin })
    }

    /// The bin of the reading's line next to a frequency.
    fn next_to(&self, frequency: f64) -> usize {
        let last = self.power.len() - 2;
        let k = ((frequency / self.bin).round() as usize).clamp(1, last);
        let near = k.saturating_sub(3).max(1)..=(k + 3).min(last);
        near.max_by(|&a, &b| self.power[a].total_cmp(&self.power[b])).unwrap_or(k)
    }

    /// Its frequency, Hz: the reading knows it far better than the residual. A Hann line is a parabola in ln power.
    fn top(&self, frequency: f64) -> f64 {
        let k = self.next_to(frequency);
        let [a, b, c] = [k - 1, k, k + 1].map(|k| self.power[k].max(1e-300).ln());
        let bend = 2.0 * b - a - c;
        let shift = if bend > 0.0 { (0.5 * (c - a) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        (k as f64 + shift) * self.bin
    }

    fn at(&self, frequency: f64) -> f64 {
        let (k, last) = (self.next_to(frequency), self.power.len() - 1);
        let top = self.power[k];
        let mut around = self.power[k.saturating_sub(AROUND)..=(k + AROUND).min(last)].to_vec();
        let middle = around.len() / 2;
        let (_, median, _) = around.select_nth_unstable_by(middle, f64::total_cmp);
        if *median > 0.0 { top / *median } else { 0.0 }
    }
}

/// Lines that are looked at, and bins about one that belong to it.
const LINES: usize = 10;
const LOBES: usize = 40;

/// Power of a whitened series, and the width of a bin in Hz.
fn spectrum(white: &[Vec<f64>], t: &[f64]) -> Option<(Vec<f64>, f64)> {
    let n = t.len();
    if n < 256 {
        return None;
    }
    let dt = (t[n - 1] - t[0]) / (n - 1) as f64;
    // Twice as long by zeros: a line between two bins of the plain transform still stands out.
    let length = (2 * n).next_power_of_two();
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mut power = vec![0.0; length / 2 + 1];
    for channel in white {
        let mut input = channel.clone();
        input.resize(length, 0.0);
        let mut output = fft.make_output_vec();
        fft.process(&mut input, &mut output).ok()?;
        for (p, z) in power.iter_mut().zip(&output) {
            *p += z.norm_sqr();
        }
    }
    Some((power, 1.0 / (length as f64 * dt)))
}

/// Whether the gyro's own spectrum holds the line of a refitted tone.
#[must_use]
pub fn seen_by_gyro(refit: &Refit) -> bool {
    let series = &refit.study.bench.problem.series[refit.candidate.series];
    let [sine, cosine, frequency] = refit.candidate.term.values[..] else { return false };
    let alpha = refit.study.model.axes[series.axis.index()].as_ref().map_or(1.0, AxisModel::alpha);
    in_reading(series, frequency, sine, cosine, alpha)
}

/// Whether the reading holds `sine` sin 2πft + `cosine` cos 2πft, rad/s, to half its size: amplitude and phase by Hann
/// weights, so that slow motion does not leak in.
#[must_use]
pub fn in_reading(series: &Series, frequency: f64, sine: f64, cosine: f64, alpha: f64) -> bool {
    let n = series.t.len();
    let (t0, span) = (series.t[0], series.t[n - 1] - series.t[0]);
    let (mut s, mut c, mut sum) = (0.0, 0.0, 0.0);
    for (t, g) in series.t.iter().zip(&series.gyro) {
        let w = 0.5 - 0.5 * (std::f64::consts::TAU * (t - t0) / span).cos();
        let (sin, cos) = (std::f64::consts::TAU * frequency * t).sin_cos();
        s += w * g * sin;
        c += w * g * cos;
        sum += w;
    }
    let (s, c) = (2.0 * alpha * s / sum, 2.0 * alpha * c / sum);
    (s - sine).hypot(c - cosine) < 0.5 * sine.hypot(cosine)
}
