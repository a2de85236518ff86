//! How rough a signal is: its noise, by sixth differences, and the vibrations in it.
//!
//! The sixth difference removes smooth motion; its variance over white noise's (the sum of the squared binomials, 924) is the
//! noise of one sample. Where motion is so jerky that it reaches even there, the quietest stretches of the log speak alone. What
//! stands in single lines of the differences' spectrum is a vibration, not noise.

use super::{
    line::{Line, crest},
    spectrum::{self, hann},
};
use crate::{
    effects::{SIXTH, sixth_differences},
    order::median,
};
use std::f64::consts::TAU;

/// N of a poor MEMS gyro, rad/√s (one-sided density 0.03 °/s/√Hz): taken where motion hides the noise everywhere.
pub(super) const POOR: f64 = 4e-4;

const ORDER: usize = 6;
/// The same as an exponent.
const POWER: i32 = 6;

const WINDOW: usize = 18;
/// What share of their mean the variances of the quietest fiftieth of such stretches lie at, for white noise.
const QUIET: f64 = 0.25;

/// Variance of white noise in each stretch of the signal, by its sixth differences.
pub(super) fn stretches(values: &[f64]) -> Vec<f64> {
    stretches_of(&sixth_differences(values))
}

/// The same from those; stretches in which some are not finite are left out.
pub(super) fn stretches_of(differences: &[f64]) -> Vec<f64> {
    windows(differences).filter(|v| v.is_finite()).collect()
}

/// The same of every stretch.
pub(super) fn windows(differences: &[f64]) -> impl Iterator<Item = f64> {
    let square = |d: &[f64]| d.iter().map(|x| x * x).sum::<f64>() / d.len() as f64 / SIXTH;
    differences.chunks_exact(WINDOW).map(square)
}

/// What stands out of the spectrum (Hann taper) of sixth differences, those that are not finite taken for zero.
pub(super) struct Lines {
    /// Bins that do, and their power beyond what is usual about them, strongest first.
    over: Vec<(usize, f64)>,
    power: Vec<f64>,
}

impl Lines {
    /// `None` where there are too few differences to tell.
    pub(super) fn of(differences: &[f64]) -> Option<Self> {
        let n = differences.len();
        let beside = (n / PARTS).clamp(BESIDE.0, BESIDE.1);
        if n < 8 * BESIDE.0 {
            return None;
        }
        let mut tapered = hann(n);
        for (weight, d) in tapered.iter_mut().zip(differences) {
            *weight *= if d.is_finite() { *d } else { 0.0 };
        }
        let power = spectrum::power(&mut tapered);
        // What white noise has there, but for its size.
        let gain = |k: usize| (2.0 * (std::f64::consts::PI * k as f64 / n as f64).sin()).powi(2 * POWER).max(1e-300);
        let mut over = Vec::new();
        for (j, part) in power.chunks(beside).enumerate() {
            let gain = |k: usize| gain(j * beside + k);
            let mut sorted: Vec<f64> = part.iter().enumerate().map(|(k, p)| p / gain(k)).collect();
            sorted.sort_by(f64::total_cmp);
            // The median of an exponential law lies at ln 2 of its mean.
            let white = sorted[sorted.len() / 2] / std::f64::consts::LN_2;
            let each = part.iter().enumerate().map(|(k, p)| (k, p - white * gain(k), white * gain(k)));
            over.extend(each.filter(|(_, o, usual)| *o > LINE * usual).map(|(k, o, _)| (j * beside + k, o)));
        }
        over.sort_by(|a, b| b.1.total_cmp(&a.1));
        Some(Self { over, power })
    }

    /// Share of the power that stands in them.
    pub(super) fn share(&self) -> f64 {
        let all = self.power.iter().sum::<f64>();
        if all > 0.0 { self.over.iter().map(|(_, over)| over).sum::<f64>() / all } else { 0.0 }
    }

    /// Radians from one value to the next of the strongest line.
    fn strongest(&self) -> Option<f64> {
        let &(k, _) = self.over.first()?;
        let before = self.power[k.checked_sub(1)?];
        // Beyond half the sampling rate a spectrum comes back.
        let after = self.power.get(k + 1).copied().unwrap_or(before);
        let top = k as f64 + crest([before, self.power[k], after]);
        Some(std::f64::consts::PI * top / (self.power.len() - 1) as f64)
    }
}

/// Values less their strongest vibrations: a tone is as strong where the sensor rests as where it moves, and would be all that
/// there is there.
pub(super) fn without_tones(t: &[f64], values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    for _ in 0..TONES {
        let rough = Rough::of(t, &values);
        let lines = Lines::of(&rough.differences).filter(|lines| lines.share() > NOTICED);
        let Some(turn) = lines.and_then(|lines| lines.strongest()) else { break };
        let line = rough.line(turn / (TAU * rough.apart));
        values.iter_mut().zip(t).for_each(|(value, t)| *value -= line.value(*t));
    }
    values
}

/// A signal's sixth differences, in which hardly anything is left of a smooth motion, and the times that they are of.
pub(crate) struct Rough {
    times: Vec<f64>,
    differences: Vec<f64>,
    apart: f64,
}

impl Rough {
    /// Those of values at these times.
    pub(crate) fn of(t: &[f64], values: &[f64]) -> Self {
        let apart = median_apart(t);
        let mut times = t.to_vec();
        if let Some(places) = places(t, apart) {
            times = (0..=places[places.len() - 1]).map(|k| t[0] + k as f64 * apart).collect();
            places.iter().zip(t).for_each(|(&place, t)| times[place] = *t);
        }
        let ends = ORDER / 2;
        let times = times.get(ends..times.len().saturating_sub(ends)).unwrap_or_default().to_vec();
        Self { times, differences: sixth_differences(&evenly(t, values, apart)), apart }
    }

    /// The signal's line nearest to a frequency, Hz, that is known to the width of a line: sixth differences of sin ωt are
    /// −(2 sin ½ωΔt)⁶ sin ωt.
    pub(crate) fn line(&self, frequency: f64) -> Line {
        let span = self.apart * self.differences.len() as f64;
        let line = Line::top(frequency, 1.0 / span, &self.times, &self.differences);
        let gain = -(2.0 * (0.5 * TAU * line.frequency * self.apart).sin()).powi(POWER);
        Line { sine: line.sine / gain, cosine: line.cosine / gain, ..line }
    }
}

/// How far apart in time samples mostly are, s; 1 for none.
pub(crate) fn median_apart(t: &[f64]) -> f64 {
    median(t.windows(2).map(|pair| pair[1] - pair[0]).collect()).unwrap_or(1.0)
}

/// Values that are `apart` from one another, what is missing between them no numbers: a vibration goes on meanwhile. What comes
/// early or late is taken along the way that the values about it go. As they are where they come too unevenly for that.
pub(super) fn evenly(t: &[f64], values: &[f64], apart: f64) -> Vec<f64> {
    let Some(places) = places(t, apart) else { return values.to_vec() };
    let mut even = vec![f64::NAN; places[places.len() - 1] + 1];
    for (k, &place) in places.iter().enumerate() {
        let about = k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(t.len());
        let early = t[0] + place as f64 * apart - t[k];
        even[place] = values[k] + early * slope(&t[about.clone()], &values[about]);
    }
    even
}

/// Where each sample would stand if all were so far `apart`; `None` where they come too unevenly for that.
fn places(t: &[f64], apart: f64) -> Option<Vec<usize>> {
    let places: Vec<usize> = t.iter().map(|at| ((at - t[0]) / apart).round() as usize).collect();
    let shared = places.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let is_even = places.last().is_some_and(|last| *last < 2 * t.len()) && shared * 100 < t.len();
    is_even.then_some(places)
}

/// Of the straight line through some values; 0 where some are not finite.
fn slope(t: &[f64], values: &[f64]) -> f64 {
    let n = t.len() as f64;
    let (at, level) = (t.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
    let (mut xx, mut xy) = (0.0, 0.0);
    for (t, value) in t.iter().zip(values) {
        xx += (t - at).powi(2);
        xy += (t - at) * (value - level);
    }
    let slope = xy / xx;
    if slope.is_finite() { slope } else { 0.0 }
}

/// Values on either side that tell how one changes.
const NEIGHBOURS: usize = 3;

/// Makes those differences no numbers that values are in which are to be left out.
pub(super) fn blank(differences: &mut [f64], skip: impl Fn(usize) -> bool) {
    let n = differences.len();
    for k in (0..n + ORDER).filter(|&k| skip(k)) {
        differences[k.saturating_sub(ORDER).min(n)..(k + 1).min(n)].fill(f64::NAN);
    }
}

/// Vibrations that are taken out at most, and the share of the power that they have to have.
const TONES: usize = 8;
const NOTICED: f64 = 0.01;
/// Values of a spectrum that a line is compared with, at least and at most, and the part of all that they are between: rows
/// that are missing here and there make a line as broad as the stretches between them are short.
const BESIDE: (usize, usize) = (64, 512);
const PARTS: usize = 64;
/// Times their mean that it stands out by: of a million values of white noise one does.
const LINE: f64 = 14.0;

/// Mean variance of a signal, what the quietest fiftieth of its stretches says it is, and the mean of those that are as noise alone is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spread {
    pub mean: f64,
    pub quiet: f64,
    pub smooth: f64,
}

impl Spread {
    pub(super) fn of(mut variances: Vec<f64>) -> Self {
        if variances.is_empty() {
            return Self::default();
        }
        variances.sort_by(f64::total_cmp);
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        // The largest hundredth are outliers or jolts.
        let most = &variances[..variances.len() - variances.len() / 100];
        let mean = mean.min(1.1 * most.iter().sum::<f64>() / most.len() as f64);
        let moving: Vec<f64> = variances.iter().copied().filter(|&v| v > 0.0).collect();
        // Of a few, the very quietest is so by chance.
        let quiet = moving.get((moving.len() / 50).max(1)).or(moving.first()).map_or(0.0, |v| v / QUIET);
        Self { mean, quiet, smooth: smooth_mean(&variances).min(mean) }
    }

    /// Without a share of it.
    pub(super) fn less(self, share: f64) -> Self {
        let less = |variance: f64| variance * (1.0 - share);
        Self { mean: less(self.mean), quiet: less(self.quiet), smooth: less(self.smooth) }
    }

    pub(super) fn uneven(self) -> bool {
        self.mean > 4.0 * self.quiet
    }
}

/// Mean of the stretches of a motion that is jerky elsewhere: of those, in order of size, that lie below twice this very mean. For white
/// noise these are [`BELOW_TWICE`] of the mean of all.
fn smooth_mean(sorted: &[f64]) -> f64 {
    let Some(tenth) = sorted.get(sorted.len() / 10) else { return 0.0 };
    let mut mean = tenth / TENTH;
    for _ in 0..ROUNDS {
        let below = &sorted[..sorted.partition_point(|v| *v <= 2.0 * mean)];
        mean = below.iter().sum::<f64>() / below.len().max(1) as f64 / BELOW_TWICE;
    }
    mean
}

/// Of 100 000 stretches of white noise.
const BELOW_TWICE: f64 = 0.902;
/// After so many it does not change any more.
const ROUNDS: usize = 20;

/// What share of their mean the variances of the quietest tenth of such stretches lie at, for white noise.
pub(super) const TENTH: f64 = 0.386;

/// What the noise of readings makes of the sixth differences of their integral, taken every so many readings: over their own
/// variance times Δt², as if those differences were of white noise.
///
/// ```text
/// Σ ((1 − zᵐ)⁵ (1 + z + … + zᵐ⁻¹) (−1 + 13z + 13z² − z³)/24)² / 924
/// ```
pub(super) fn walked(readings: f64) -> f64 {
    let rows = (readings.round() as usize).clamp(1, MANY);
    let mut kernel = vec![0.0; rows + 3];
    for first in 0..rows {
        for (sum, weight) in kernel[first..].iter_mut().zip([-1.0, 13.0, 13.0, -1.0]) {
            *sum += weight / 24.0;
        }
    }
    for _ in 0..ORDER - 1 {
        let before = kernel.clone();
        kernel.resize(before.len() + rows, 0.0);
        kernel[rows..].iter_mut().zip(&before).for_each(|(sum, weight)| *sum -= weight);
    }
    let more = (readings / rows as f64).max(1.0);
    more * kernel.iter().map(|weight| weight * weight).sum::<f64>() / SIXTH
}

/// Readings from one row of a reference to the next beyond which their noise is as good as white.
pub(super) const MANY: usize = 64;
