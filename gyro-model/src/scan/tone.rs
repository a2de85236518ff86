//! Where a vibration tone may be: the highest line in the spectrum of the whitened residual; and whether the gyro itself
//! sees it.
//!
//! An encoder's quantisation under a regular motion draws lines too. They are not in the gyro's reading: a tone that is
//! physics stands there with the amplitude that the residual gives it.

use crate::{
    Term,
    evidence::{
        line::{Line, crest},
        rough::Rough,
        series::Series,
        spectrum::{self, hann},
        study::Study,
    },
    order::median,
};
use std::{borrow::Cow, cell::LazyCell, ops::RangeInclusive};

/// How many separate lines a log has room for.
#[must_use]
pub(crate) fn frequencies(t: &[f64]) -> f64 {
    t.len() as f64
}

/// The strongest frequencies from 1 Hz up at which the reading has a line too, strongest first, Hz; none where the rows
/// are too few for a spectrum. A reference that is read more seldom than the gyro shows a fast tone at one of its images.
#[must_use]
pub(crate) fn peaks(white: &[Vec<f64>], t: &[f64], series: &Series) -> Vec<f64> {
    let (Some(spectrum), Some(reading)) = (Spectrum::new(white, t), Prominence::new(series)) else { return Vec::new() };
    // Bins of the residual's lines, and the frequencies at which the reading may have them.
    let mut chosen: Vec<(usize, f64)> = Vec::new();
    for k in spectrum.standing_out() {
        // The side lobes of a line are not lines.
        if chosen.iter().all(|(c, _)| c.abs_diff(k) > LOBES) {
            let images = images(k as f64 * spectrum.bin, t, &series.t);
            let seen = images.into_iter().filter(|&f| reading.at(f) > PROMINENT);
            chosen.extend(seen.max_by(|&a, &b| reading.at(a).total_cmp(&reading.at(b))).map(|f| (k, f)));
        }
        if chosen.len() == LINES {
            break;
        }
    }
    let rough = Rough::of(&series.t, &series.gyro);
    let frequency = |&(k, f): &(usize, f64)| {
        // Motion hides slow lines in the reading, and the residual has none of it.
        let is_image = f != k as f64 * spectrum.bin;
        if !is_image && spectrum.power[k] > reading.at(f) * spectrum.around(k) {
            spectrum.likeliest(k, white, t)
        } else {
            rough.line(reading.spectrum.line(reading.next_to(f))).frequency
        }
    };
    chosen.iter().map(frequency).collect()
}

/// What looks like a frequency when seen only at `seldom`, up to what rows at `often` can hold: |f ± k/Δt|, Hz.
fn images(frequency: f64, seldom: &[f64], often: &[f64]) -> Vec<f64> {
    let rate = |t: &[f64]| (t.len() - 1) as f64 / (t[t.len() - 1] - t[0]);
    let (step, highest) = (rate(seldom), HIGHEST * 0.5 * rate(often));
    let turns = (0..).map(|k| f64::from(k) * step).take_while(|turn| *turn <= highest + frequency);
    let both = turns.flat_map(|turn| [turn + frequency, turn - frequency]);
    both.filter(|f| *f > 0.0 && *f <= highest).collect()
}

/// Share of the Nyquist frequency up to which lines are looked for.
const HIGHEST: f64 = 0.98;

/// The strongest frequency, Hz, that stands out of what noise alone (`draws`, whitened) shows anywhere near it, and where the
/// reading's own line would drown in the motion about it. An encoder's steps draw lines where a rate is held, which hide none
/// elsewhere.
#[must_use]
pub(crate) fn beyond_noise(white: &[Vec<f64>], draws: &[Vec<Vec<f64>>], t: &[f64], series: &Series) -> Option<f64> {
    let (spectrum, reading) = (Spectrum::new(white, t)?, Prominence::new(series)?);
    let noise = LazyCell::new(|| draws.iter().filter_map(|draw| Spectrum::new(draw, t)).collect::<Vec<_>>());
    let highest =
        |k: usize| noise.iter().flat_map(|noise| &noise.power[near(k, noise.power.len())]).copied().fold(0.0, f64::max);
    let is_drowned = |k: usize| reading.around(k as f64 * spectrum.bin) > DROWNED * reading.quiet;
    let mut tops = spectrum.tops().into_iter().take(TOPS);
    tops.find(|&k| is_drowned(k) && spectrum.power[k] > BEYOND * highest(k)).map(|k| spectrum.likeliest(k, white, t))
}

/// Tops of a spectrum that are looked at, highest first.
const TOPS: usize = 100;

/// Times the reading's quietest part of the spectrum at which motion hides a line.
const DROWNED: f64 = 100.0;

/// Times the highest line near it of all draws of noise alone.
const BEYOND: f64 = 2.0;

/// Power of the reading about a frequency over the median of its neighbourhood.
struct Prominence {
    spectrum: Spectrum,
    /// Median power of the upper half of the spectrum, where no shaft moves.
    quiet: f64,
}

/// Times the median that noise alone hardly reaches in any of a log's bins.
const PROMINENT: f64 = 25.0;
/// Bins on either side that the median is taken over.
const AROUND: usize = 300;

impl Prominence {
    fn new(series: &Series) -> Option<Self> {
        let n = series.gyro.len();
        let mean = series.gyro.iter().sum::<f64>() / n as f64;
        let tapered = series.gyro.iter().zip(hann(n)).map(|(g, weight)| weight * (g - mean)).collect();
        let spectrum = Spectrum::new(&[tapered], &series.t)?;
        let quiet = median(spectrum.power[spectrum.power.len() / 2..].to_vec()).unwrap_or(0.0);
        Some(Self { spectrum, quiet })
    }

    /// The bin of the reading's line next to a frequency: the reading knows it far better than the residual.
    fn next_to(&self, frequency: f64) -> usize {
        let power = &self.spectrum.power;
        let last = power.len() - 2;
        let k = ((frequency / self.spectrum.bin).round() as usize).clamp(1, last);
        let near = k.saturating_sub(3).max(1)..=(k + 3).min(last);
        near.max_by(|&a, &b| power[a].total_cmp(&power[b])).unwrap_or(k)
    }

    /// Power of the line next to a frequency over what is usual about it.
    fn at(&self, frequency: f64) -> f64 {
        let usual = self.around(frequency);
        if usual > 0.0 { self.spectrum.power[self.next_to(frequency)] / usual } else { 0.0 }
    }

    /// Median power about a frequency.
    fn around(&self, frequency: f64) -> f64 {
        self.spectrum.around(self.next_to(frequency))
    }
}

/// Lines that are looked at, and bins about one that belong to it.
pub(crate) const LINES: usize = 10;
const LOBES: usize = 40;

/// Power of a series (its channels summed), and the width of a bin in Hz.
struct Spectrum {
    power: Vec<f64>,
    /// Median power about every [`APART`]th bin.
    usual: Vec<f64>,
    bin: f64,
}

/// Bins between two that the median is taken about.
const APART: usize = AROUND / 5;

/// The bins about one of `n`.
fn near(k: usize, n: usize) -> RangeInclusive<usize> {
    k.saturating_sub(AROUND)..=(k + AROUND).min(n - 1)
}

impl Spectrum {
    fn new(channels: &[Vec<f64>], t: &[f64]) -> Option<Self> {
        let n = t.len();
        if n < 256 {
            return None;
        }
        let dt = (t[n - 1] - t[0]) / (n - 1) as f64;
        // Twice as long by zeros: a line between two bins of the plain transform still stands out.
        let length = (2 * n).next_power_of_two();
        let mut power = vec![0.0; length / 2 + 1];
        for channel in channels {
            let mut input = channel.clone();
            input.resize(length, 0.0);
            power.iter_mut().zip(spectrum::power(&mut input)).for_each(|(sum, own)| *sum += own);
        }
        let usual =
            (0..power.len()).step_by(APART).map(|k| median(power[near(k, power.len())].to_vec()).unwrap_or(0.0));
        let usual = usual.collect();
        Some(Self { power, usual, bin: 1.0 / (length as f64 * dt) })
    }

    /// Bins of the local maxima from 1 Hz to just below the Nyquist frequency, highest first.
    fn tops(&self) -> Vec<usize> {
        let first = (1.0 / self.bin).ceil() as usize + 1;
        let last = (HIGHEST * (self.power.len() - 1) as f64) as usize;
        let is_top = |k: usize| self.power[k] >= self.power[k - 1] && self.power[k] > self.power[k + 1];
        let mut tops: Vec<usize> = (first..last.max(first)).filter(|&k| is_top(k)).collect();
        tops.sort_by(|&a, &b| self.power[b].total_cmp(&self.power[a]));
        tops
    }

    /// The same, those first that stand highest above what is usual about them: what is missing besides a tone makes more
    /// of one part of the spectrum than of another.
    fn standing_out(&self) -> Vec<usize> {
        let mut tops: Vec<(usize, f64)> =
            self.tops().into_iter().map(|k| (k, self.power[k] / self.around(k).max(f64::MIN_POSITIVE))).collect();
        tops.sort_by(|a, b| b.1.total_cmp(&a.1));
        tops.into_iter().map(|(k, _)| k).collect()
    }

    /// Median power about a bin.
    fn around(&self, k: usize) -> f64 {
        self.usual[((k + APART / 2) / APART).min(self.usual.len() - 1)]
    }

    /// The likeliest frequency about bin `k`, Hz, by that of the channels which has most of it.
    fn likeliest(&self, k: usize, channels: &[Vec<f64>], t: &[f64]) -> f64 {
        let lines = channels.iter().map(|channel| Line::likeliest(self.line(k), self.bin, t, channel));
        lines.max_by(|a, b| a.size().total_cmp(&b.size())).map_or_else(|| self.line(k), |line| line.frequency)
    }

    /// The frequency of the line about bin `k`, Hz.
    fn line(&self, k: usize) -> f64 {
        (k as f64 + crest([k - 1, k, k + 1].map(|k| self.power[k]))) * self.bin
    }
}

/// Whether the gyro's own spectrum holds the line of a fitted tone.
#[must_use]
pub(crate) fn is_read(study: &Study, series: usize, term: &Term) -> bool {
    let [sine, cosine, frequency] = term.values[..] else { return false };
    is_felt(study, series, Line { frequency, sine, cosine })
}

/// Whether the reference shows the line of a fitted tone too: of a tenth of its size as a rate, and well above what stands beside
/// it. An error of the gyro alone is not seen there.
#[must_use]
pub(crate) fn is_in_reference(study: &Study, series: usize, term: &Term) -> bool {
    let [sine, cosine, frequency] = term.values[..] else { return false };
    let problem = &study.bench.problem;
    let own = &problem.series[series];
    let t = &own.reference_t;
    let angle = match problem.attitude() {
        None => Cow::from(&own.reference_angle),
        Some(attitude) => Cow::from(attitude.turned_about(own.axis.index())),
    };
    let span = t[t.len() - 1] - t[0];
    let steps: Vec<f64> = angle.windows(2).zip(t.windows(2)).map(|(a, t)| (a[1] - a[0]) / (t[1] - t[0])).collect();
    let middle: Vec<f64> = t.windows(2).map(|t| 0.5 * (t[0] + t[1])).collect();
    let size = |frequency: f64| Line::at(frequency, &middle, &steps).size();
    let beside = ASIDE.map(|bins| size(frequency + bins / span)).to_vec();
    let own = size(frequency);
    own > SHOWN * sine.hypot(cosine) && own > OUTSTANDING * median(beside).unwrap_or(0.0)
}

/// Whether motion beyond half the reference's sampling rate f_s may be a fitted tone: of the rate of a motion of f_s − f, which shows at f,
/// the angles show f/(f_s − f), enough to be seen.
#[must_use]
pub(crate) fn may_be_aliased(study: &Study, series: usize, term: &Term) -> bool {
    let [.., frequency] = term.values[..] else { return false };
    let t = &study.bench.problem.series[series].reference_t;
    let (Some(first), Some(last)) = (t.first(), t.last()) else { return false };
    let sampled = (t.len() - 1) as f64 / (last - first);
    frequency > SHOWN * (sampled - frequency)
}

/// Share of a tone that the reference has to show, and times what stands beside it that its line has to have.
const SHOWN: f64 = 0.1;
const OUTSTANDING: f64 = 4.0;
/// Bins of the log's own spectrum beside the line that tell what else the reference holds there.
const ASIDE: [f64; 8] = [-15.0, -11.0, -8.0, -5.0, 5.0, 8.0, 11.0, 15.0];

/// Whether the sensor, as a model has it, felt this line to half its size, rad/s.
#[must_use]
pub(crate) fn is_felt(study: &Study, series: usize, line: Line) -> bool {
    let problem = &study.bench.problem;
    let felt = Line::at(line.frequency, &problem.series[series].t, &problem.felt(&study.model, series));
    (felt.sine - line.sine).hypot(felt.cosine - line.cosine) < 0.5 * line.size()
}

#[cfg(test)]
mod tests {
    use super::images;

    #[test]
    fn a_fast_tone_is_looked_for_at_every_frequency_that_looks_like_it() {
        let rows = |dt: f64| -> Vec<f64> { (0..1000).map(|k| f64::from(k) * dt).collect() };
        let seen: Vec<f64> = images(1.8, &rows(0.04), &rows(0.01));
        let expected = [1.8, 26.8, 23.2, 48.2];
        assert_eq!(seen.len(), expected.len(), "{seen:?}");
        assert!(seen.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{seen:?}");
        assert_eq!(images(1.8, &rows(0.01), &rows(0.01)), [1.8]);
    }
}
