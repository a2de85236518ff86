//! One line of a signal's spectrum, by the times of its samples: by their numbers alone, what comes unevenly or is missing puts
//! a line somewhere beside.

use std::f64::consts::TAU;

/// A line's frequency and size.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Hz.
    pub frequency: f64,
    /// Of sin 2πft.
    pub sine: f64,
    /// Of cos 2πft.
    pub cosine: f64,
}

impl Line {
    /// What of the signal goes like sin 2πft and cos 2πft, by Hann weights, so that slow motion does not leak in; what comes
    /// unevenly lets a little of a large one. Values that are not finite say nothing.
    #[must_use]
    pub fn at(frequency: f64, t: &[f64], values: &[f64]) -> Self {
        let (t0, span) = (t[0], t[t.len() - 1] - t[0]);
        Self::weighted(frequency, t, values, |t| 0.5 - 0.5 * (TAU * (t - t0) / span).cos())
    }

    fn weighted(frequency: f64, t: &[f64], values: &[f64], weight: impl Fn(f64) -> f64) -> Self {
        let (mut s, mut c, mut sum) = (0.0, 0.0, 0.0);
        for (&t, value) in t.iter().zip(values).filter(|(_, value)| value.is_finite()) {
            let w = weight(t);
            let (sin, cos) = (TAU * frequency * t).sin_cos();
            s += w * value * sin;
            c += w * value * cos;
            sum += w;
        }
        Self { frequency, sine: 2.0 * s / sum, cosine: 2.0 * c / sum }
    }

    /// The largest line about a frequency that is known to `near`, Hz.
    #[must_use]
    pub fn top(frequency: f64, near: f64, t: &[f64], values: &[f64]) -> Self {
        Self::largest(frequency, near, |f| Self::at(f, t, values))
    }

    /// The same by equal weights: beside white noise, and nothing else, the likeliest.
    #[must_use]
    pub fn likeliest(frequency: f64, near: f64, t: &[f64], values: &[f64]) -> Self {
        Self::largest(frequency, near, |f| Self::weighted(f, t, values, |_| 1.0))
    }

    fn largest(frequency: f64, near: f64, at: impl Fn(f64) -> Self) -> Self {
        let (mut best, mut step) = (at(frequency), near);
        for _ in 0..HALVINGS {
            let beside = [best.frequency - step, best.frequency + step].map(&at);
            best = beside.into_iter().fold(best, |best, own| if own.size() > best.size() { own } else { best });
            step *= 0.5;
        }
        best
    }

    /// Its amplitude.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.sine.hypot(self.cosine)
    }

    /// Its value at a time.
    #[must_use]
    pub fn value(&self, t: f64) -> f64 {
        let (sin, cos) = (TAU * self.frequency * t).sin_cos();
        self.sine * sin + self.cosine * cos
    }
}

/// Hann's weight of value `k` of `n`.
#[must_use]
pub fn hann(k: usize, n: usize) -> f64 {
    0.5 - 0.5 * (TAU * (k as f64 + 0.5) / n as f64).cos()
}

/// Bins from the middle one of three to the top of the line that their power shows: near it, ln power is a parabola.
#[must_use]
pub fn crest(power: [f64; 3]) -> f64 {
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
}
