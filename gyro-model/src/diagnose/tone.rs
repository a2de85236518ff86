//! Where a vibration tone may be: the highest line in the spectrum of the whitened residual; and whether the gyro itself
//! sees it.
//!
//! An encoder's quantisation under a regular motion draws lines too. They are not in the gyro's reading: a tone that is
//! physics stands there with the amplitude that the residual gives it.

use super::refit::Refit;
use realfft::RealFftPlanner;

/// How many separate lines a log has room for.
#[must_use]
pub fn frequencies(t: &[f64]) -> f64 {
    t.len() as f64
}

/// The strongest frequency from 1 Hz up, Hz; `None` where the rows are too few for a spectrum.
#[must_use]
pub fn peak(white: &[Vec<f64>], t: &[f64]) -> Option<f64> {
    let (power, bin, peak) = spectrum(white, t)?;
    let (a, b, c) = (power[peak - 1].sqrt(), power[peak].sqrt(), power[peak + 1].sqrt());
    let bend = 2.0 * b - a - c;
    let shift = if bend > 0.0 { (0.5 * (c - a) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((peak as f64 + shift) * bin)
}

/// What the strongest line of a whitened series would raise ln L by.
#[must_use]
pub fn highest(white: &[Vec<f64>], t: &[f64]) -> Option<f64> {
    spectrum(white, t).map(|(power, _, peak)| power[peak] / t.len() as f64)
}

/// Power of a whitened series, the width of a bin in Hz, and the strongest bin from 1 Hz up.
fn spectrum(white: &[Vec<f64>], t: &[f64]) -> Option<(Vec<f64>, f64, usize)> {
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
    let bin = 1.0 / (length as f64 * dt);
    let first = (1.0 / bin).ceil() as usize;
    let last = (0.49 / dt / bin) as usize;
    let peak = (first + 1..last).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    Some((power, bin, peak))
}

/// Whether the gyro's own spectrum holds the line: at least half of the fitted amplitude, Hann-weighted so that slow
/// motion does not leak in.
#[must_use]
pub fn seen_by_gyro(refit: &Refit) -> bool {
    let series = &refit.study.bench.problem.series[refit.candidate.series];
    let [sine, cosine, frequency] = refit.candidate.term.values[..] else { return false };
    let n = series.t.len();
    let (t0, span) = (series.t[0], series.t[n - 1] - series.t[0]);
    let (mut re, mut im, mut sum) = (0.0, 0.0, 0.0);
    for (t, g) in series.t.iter().zip(&series.gyro) {
        let w = 0.5 - 0.5 * (std::f64::consts::TAU * (t - t0) / span).cos();
        let (s, c) = (std::f64::consts::TAU * frequency * t).sin_cos();
        re += w * g * s;
        im += w * g * c;
        sum += w;
    }
    let alpha = refit.study.model.axes[series.axis.index()].as_ref().map_or(1.0, |m| m.alpha().abs());
    let amplitude = 2.0 * re.hypot(im) / sum * alpha;
    amplitude > 0.5 * sine.hypot(cosine)
}
