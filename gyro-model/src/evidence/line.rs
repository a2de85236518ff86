//! One line of a signal's spectrum, by the times of its samples: by their numbers alone, what comes unevenly or is missing puts
//! a line somewhere beside.

use super::spectrum::hann;
use itertools::Itertools;
use std::f64::consts::TAU;

/// A line's frequency and size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Hz.
    pub frequency: f64,
    /// Of sin 2πft.
    pub sine: f64,
    /// Of cos 2πft.
    pub cosine: f64,
}

/// A signal under a taper.
struct Tapered<'a> {
    t: &'a [f64],
    /// Values times weights; what is not finite says nothing.
    weighted: Vec<f64>,
    /// Of the weights.
    sum: f64,
}

impl<'a> Tapered<'a> {
    fn of(t: &'a [f64], values: &[f64], weight: impl Fn(f64) -> f64) -> Self {
        let mut sum = 0.0;
        let weighted = t.iter().zip(values).map(|(&t, value)| {
            let weight = if value.is_finite() { weight(t) } else { return 0.0 };
            sum += weight;
            weight * value
        });
        Self { t, weighted: weighted.collect(), sum }
    }

    /// By Hann's weights, so that slow motion does not leak in.
    fn by_hann(t: &'a [f64], values: &[f64]) -> Self {
        let (t0, span) = (t[0], t[t.len() - 1] - t[0]);
        Self::of(t, values, |t| 0.5 - 0.5 * (TAU * (t - t0) / span).cos())
    }

    fn line(&self, frequency: f64) -> Line {
        let (mut s, mut c) = (0.0, 0.0);
        for (t, value) in self.t.iter().zip(&self.weighted) {
            let (sin, cos) = (TAU * frequency * t).sin_cos();
            s += value * sin;
            c += value * cos;
        }
        Line { frequency, sine: 2.0 * s / self.sum, cosine: 2.0 * c / self.sum }
    }

    /// The largest line about a frequency that is known to `near`, Hz.
    fn largest(&self, frequency: f64, near: f64) -> Line {
        let (mut best, mut step) = (self.line(frequency), near);
        for _ in 0..HALVINGS {
            let beside = [best.frequency - step, best.frequency + step].map(|f| self.line(f));
            best = beside.into_iter().fold(best, |best, own| if own.size() > best.size() { own } else { best });
            step *= 0.5;
        }
        best
    }
}

impl Line {
    /// What of the signal goes like sin 2πft and cos 2πft, by Hann weights; what comes unevenly lets a little of a large one leak in.
    /// Values that are not finite say nothing.
    #[must_use]
    pub(crate) fn at(frequency: f64, t: &[f64], values: &[f64]) -> Self {
        Tapered::by_hann(t, values).line(frequency)
    }

    /// The largest line about a frequency that is known to `near`, Hz.
    #[must_use]
    pub(crate) fn top(frequency: f64, near: f64, t: &[f64], values: &[f64]) -> Self {
        Tapered::by_hann(t, values).largest(frequency, near)
    }

    /// The same by equal weights: beside white noise, and nothing else, the likeliest.
    #[must_use]
    pub(crate) fn likeliest(frequency: f64, near: f64, t: &[f64], values: &[f64]) -> Self {
        Tapered::of(t, values, |_| 1.0).largest(frequency, near)
    }

    /// Its amplitude.
    #[must_use]
    pub(crate) fn size(&self) -> f64 {
        self.sine.hypot(self.cosine)
    }

    /// Its value at a time.
    #[must_use]
    pub(crate) fn value(&self, t: f64) -> f64 {
        let (sin, cos) = (TAU * self.frequency * t).sin_cos();
        self.sine * sin + self.cosine * cos
    }
}

/// The frequency of a signal that is one line about its mean, but for a hundredth of it, Hz.
#[must_use]
pub(crate) fn only(t: &[f64], values: &[f64]) -> Option<f64> {
    if values.len() < FEWEST {
        return None;
    }
    let span = t[t.len() - 1] - t[0];
    let weights = hann(values.len());
    let mean =
        values.iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>() / (0.5 * values.len() as f64);
    let about: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let size = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    // Half of its size counts as another side: beside it, noise crosses the mean more than once.
    let half = 0.5 * size(&about);
    let sides = t.iter().zip(&about).filter(|(_, value)| value.abs() > half);
    let turns: Vec<f64> =
        sides.tuple_windows().filter(|(a, b)| (*a.1 > 0.0) != (*b.1 > 0.0)).map(|(_, b)| *b.0).collect();
    if turns.len() < FEWEST {
        return None;
    }
    let frequency = 0.5 * (turns.len() - 1) as f64 / (turns[turns.len() - 1] - turns[0]);
    let beside = |rows: usize, span: f64| {
        let (t, about) = (&t[..rows], &about[..rows]);
        let line = Line::top(frequency, 0.5 / span, t, about);
        let rest: Vec<f64> = t.iter().zip(about).map(|(&t, value)| value - line.value(t)).collect();
        (line.frequency, size(&rest) / size(about))
    };
    // Some turns show what is far from being a line.
    if let Some(&some) = turns.get(4 * FEWEST)
        && beside(t.partition_point(|&t| t < some), some - t[0]).1 > FAR * PURE
    {
        return None;
    }
    let (frequency, share) = beside(t.len(), span);
    (share < PURE).then_some(frequency)
}

/// Half turns that show a frequency.
const FEWEST: usize = 8;
/// Share of a line that may be beside it.
const PURE: f64 = 0.01;
/// Times that share that may be beside it over a few turns, of which the ends count for more.
const FAR: f64 = 20.0;

/// Bins from the middle one of three to the top of the line that their power shows: near it, ln power is a parabola.
#[must_use]
pub(crate) fn crest(power: [f64; 3]) -> f64 {
    let [before, top, after] = power.map(|power| power.max(1e-300).ln());
    let bend = 2.0 * top - before - after;
    if bend > 0.0 { (0.5 * (after - before) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Halvings until a top is found.
const HALVINGS: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_where_samples_come_unevenly_and_are_missing() {
        let late = |k: u32| 1e-3 * (f64::from(k * 7919 % 13) / 13.0 - 0.5);
        let t: Vec<f64> = (0..6000).filter(|k| k % 97 > 2).map(|k| 0.004 * f64::from(k) + late(k)).collect();
        let values: Vec<f64> =
            t.iter().map(|t| 0.05 * (0.7 * t).sin() + 0.02 * (TAU * 83.21 * t + 0.4).cos()).collect();
        let found = Line::top(83.2, 0.03, &t, &values);
        assert!((found.frequency - 83.21).abs() < 1e-3, "{found:?}");
        assert!((found.size() - 0.02).abs() < 1e-3, "{found:?}");
        let alone: Vec<f64> = t.iter().map(|t| 0.02 * (TAU * 83.21 * t + 0.4).cos()).collect();
        let likeliest = Line::likeliest(83.2, 0.03, &t, &alone);
        assert!((likeliest.frequency - 83.21).abs() < 3e-4 && (likeliest.size() - 0.02).abs() < 1e-4, "{likeliest:?}");
    }

    #[test]
    fn a_sine_is_one_line_and_a_sine_with_a_harmonic_or_a_drive_is_not() {
        let t: Vec<f64> = (0..6000).map(|k| 0.01 * f64::from(k)).collect();
        let step = 1.5e-3;
        let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { t.iter().map(|&t| (f(t) / step).round() * step).collect() };
        let found = only(&t, &of(&|t| 0.4 + 2.6 * (TAU * 0.2713 * t + 0.3).sin())).expect("one line");
        assert!((found - 0.2713).abs() < 1e-4, "{found}");
        assert!(only(&t, &of(&|t| 0.2 * (TAU * 3.1 * t).cos())).is_some());
        assert!(only(&t, &of(&|t| 2.6 * (TAU * 0.25 * t).sin() + 0.05 * (TAU * 0.75 * t).sin())).is_none());
        assert!(only(&t, &of(&|t| (TAU * 0.1 * t).sin() + (TAU * 0.7 * t).sin())).is_none());
        assert!(only(&t, &of(&|t| (0.3 * t).floor())).is_none());
        assert!(only(&t, &vec![0.0; t.len()]).is_none());
    }
}
