//! Noise known before any model is judged: from the gyro's own fastest differences and the encoder's step.
//!
//! Physics that the model lacks must not hide in the yardstick it is measured with, so nothing here looks at the
//! residual of a model. The sixth difference of the reading removes smooth motion; its variance over white noise's (the
//! sum of the squared binomials, 924) is the noise of one sample. Where motion is so jerky that it reaches even there, the
//! quietest stretches of the log speak alone. What stands in single lines of the differences' spectrum is a vibration, not
//! noise. A reference that comes seldom holds motion in its own differences; there what the gyro knows of it is taken out.

use super::{
    encoder::{Encoder, quantum},
    incoherent::incoherent,
    integrate::{integral, smooth},
    line::{Line, crest},
    problem::Problem,
    rounding::Rounding,
    series::{Series, usual},
    spectrum::{self, hann},
};
use crate::{
    effects::{SIXTH, sixth_differences},
    nls::dot,
    order::median,
    record::Walk,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::{borrow::Cow, f64::consts::TAU};

/// What the sensors' own signals say about their noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// N of the gyro's reading, rad/√s.
    pub reading: f64,
    /// The reading's rounding, where its noise does not even it out.
    pub rounding: Option<Rounding>,
    /// Whether that is a data sheet's, the motion hiding the sensor's own.
    pub assumed: bool,
    /// N of the compensated rate less the reference's, rad/√s: α times the reading's, and what the noise of a reference
    /// that is a rate adds.
    pub angle_random_walk: f64,
    /// Standard deviation of one reference reading, rad.
    pub encoder: f64,
    /// Where the two come from, for the report.
    pub source: String,
}

const ORDER: usize = 6;
/// The same as an exponent.
const POWER: i32 = 6;
/// N of a poor MEMS gyro, rad/√s (one-sided density 0.03 °/s/√Hz): taken where motion hides the noise everywhere.
const POOR: f64 = 4e-4;
const WINDOW: usize = 18;
/// What share of their mean the variances of the quietest fiftieth of such stretches lie at, for white noise.
const QUIET: f64 = 0.25;

/// Variance of white noise in each stretch of the signal, by its sixth differences.
fn stretches(values: &[f64]) -> Vec<f64> {
    stretches_of(&sixth_differences(values))
}

/// The same from those; stretches in which some are not finite are left out.
fn stretches_of(differences: &[f64]) -> Vec<f64> {
    windows(differences).filter(|v| v.is_finite()).collect()
}

/// The same of every stretch.
fn windows(differences: &[f64]) -> impl Iterator<Item = f64> {
    let square = |d: &[f64]| d.iter().map(|x| x * x).sum::<f64>() / d.len() as f64 / SIXTH;
    differences.chunks_exact(WINDOW).map(square)
}

/// What stands out of the spectrum (Hann taper) of sixth differences, those that are not finite taken for zero.
struct Lines {
    /// Bins that do, and their power beyond what is usual about them, strongest first.
    over: Vec<(usize, f64)>,
    power: Vec<f64>,
}

impl Lines {
    /// `None` where there are too few differences to tell.
    fn of(differences: &[f64]) -> Option<Self> {
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
    fn share(&self) -> f64 {
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
fn without_tones(t: &[f64], values: &[f64]) -> Vec<f64> {
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
fn median_apart(t: &[f64]) -> f64 {
    median(t.windows(2).map(|pair| pair[1] - pair[0]).collect()).unwrap_or(1.0)
}

/// Values that are `apart` from one another, what is missing between them no numbers: a vibration goes on meanwhile. What comes
/// early or late is taken along the way that the values about it go. As they are where they come too unevenly for that.
fn evenly(t: &[f64], values: &[f64], apart: f64) -> Vec<f64> {
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
fn blank(differences: &mut [f64], skip: impl Fn(usize) -> bool) {
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
struct Spread {
    mean: f64,
    quiet: f64,
    smooth: f64,
}

impl Spread {
    fn of(mut variances: Vec<f64>) -> Self {
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
    fn less(self, share: f64) -> Self {
        let less = |variance: f64| variance * (1.0 - share);
        Self { mean: less(self.mean), quiet: less(self.quiet), smooth: less(self.smooth) }
    }

    fn uneven(self) -> bool {
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

/// The prior noise of each axis.
#[must_use]
pub fn priors(problem: &Problem) -> Vec<Prior> {
    let of = |s: &Series| match problem.attitude() {
        None => prior(s, &s.reference_angle),
        Some(attitude) => prior(s, &attitude.turned_about(s.axis.index())),
    };
    problem.series.iter().map(of).collect()
}

/// The prior noise of one axis; `reference` is its reference angle, or for a quaternion the sum of the attitude's
/// increments about it.
fn prior(series: &Series, reference: &[f64]) -> Prior {
    // A reading between two others is no measurement.
    let own: Vec<usize> = (0..series.t.len()).filter(|&k| series.read[k]).collect();
    let at: Vec<f64> = own.iter().map(|&k| series.t[k]).collect();
    let dt = median_apart(&at);
    let known: Vec<f64> = own.iter().map(|&k| if series.missing[k] { f64::NAN } else { series.gyro[k] }).collect();
    let gyro = evenly(&at, &known, dt);
    let quiet = evenly(&at, &without_tones(&at, &known), dt);
    let flat = |k: usize| k > 1 && gyro[k] == gyro[k - 1] && gyro[k] == gyro[k - 2];
    let lsb = quantum(own.iter().map(|&k| series.gyro[k]));
    let mut differences = sixth_differences(&quiet);
    let share = Lines::of(&differences).map_or(0.0, |lines| lines.share());
    blank(&mut differences, flat);
    let gyro = Spread::of(stretches_of(&differences)).less(share);
    let angle = Spread::of(stretches(reference));
    let step = counts(series);
    let known = if step > 0.0 { step } else { angle.quiet };
    // Jerky motion shows in the reference too; noise that grows with rate does not.
    let poor = POOR.powi(2) / dt;
    let reference_is_jerky = angle.mean > 3.0 * known;
    let jerky = reference_is_jerky && (gyro.uneven() || gyro.mean > poor);
    let was_found = series.walk.gyro > 0.0;
    let assumed = if was_found { series.walk.assumed } else { jerky && gyro.quiet > poor };
    let (variance, gyro_says) = if assumed {
        (poor, "the data sheet of a poor MEMS sensor (0.03 °/s/√Hz), because the motion is always jerky")
    } else if was_found {
        (series.walk.gyro.powi(2) / dt, "the readings, measured before they were averaged")
    } else if jerky {
        (gyro.quiet, "the quietest stretches, because the motion is jerky")
    } else if reference_is_jerky {
        (gyro.smooth, "the reading, measured on this log where the motion is smooth")
    } else {
        (gyro.mean, "the reading, measured on this log")
    };
    let variance = variance.max(lsb * lsb / 12.0);
    let rounding = Rounding::of(series, lsb);
    let rounded = rounding.as_ref().map_or_else(String::new, |rounding| {
        format!(", too small to average out the reading's steps of {:.3} °/s", rounding.step.to_degrees())
    });
    let (encoder, from) = if step > 0.0 {
        let more = if series.encoder.noise > 0.0 { " and its noise beyond that step" } else { "" };
        (step.sqrt(), format!("its step of {:.3}°{more}", series.encoder.step.to_degrees()))
    } else {
        let beside = beside_gyro(series, reference, variance * dt);
        let (least, of) = if beside.mean < angle.mean {
            (beside, "the difference of reference and gyro")
        } else {
            (angle, "its own readings")
        };
        let variance = if least.uneven() { least.quiet } else { least.mean };
        (variance.sqrt().max(1e-9), format!("{of}, measured on this log"))
    };
    let walk = (variance * dt).sqrt().max(1e-9);
    Prior {
        reading: walk,
        rounding,
        assumed,
        angle_random_walk: (gain(&series.reference_t, &read_angle(series), reference) * walk)
            .hypot(reference_walk(series)),
        encoder,
        source: format!("gyro noise from {gyro_says}{rounded}; reference noise from {from}"),
    }
}

/// What the sixth differences of the reference's angle less what the gyro's make say: where a reference comes so seldom that they
/// hold its motion, the gyro knows of that ([`incoherent`]). The gyro's walk of N² = `walk` is in them too.
fn beside_gyro(series: &Series, reference: &[f64], walk: f64) -> Spread {
    let alpha = gain(&series.reference_t, &read_angle(series), reference);
    let less = incoherent((&series.t, &series.gyro), &turned(series), &series.reference_rows, reference);
    let (step, apart) = (median_apart(&series.t), median_apart(&series.reference_t));
    // What means have turned by is the sum of all readings.
    let step = if series.turned.is_empty() { step } else { apart / MANY as f64 };
    let walked = alpha * alpha * walk * step * walked(apart / step);
    let variances = stretches_of(&less);
    Spread::of(variances.into_iter().map(|v| (v - walked).max(AT_LEAST * v)).collect())
}

/// What the noise of readings makes of the sixth differences of their integral, taken every so many readings: over their own
/// variance times Δt², as if those differences were of white noise.
///
/// ```text
/// Σ ((1 − zᵐ)⁵ (1 + z + … + zᵐ⁻¹) (−1 + 13z + 13z² − z³)/24)² / 924
/// ```
fn walked(readings: f64) -> f64 {
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
const MANY: usize = 64;
/// Share of a variance that is left of it at least where another is taken off.
const AT_LEAST: f64 = 0.1;

/// The angle that the readings add up to.
fn turned(series: &Series) -> Cow<'_, [f64]> {
    if series.turned.is_empty() { integral(&series.t, &series.gyro).into() } else { (&series.turned).into() }
}

/// The same at the reference's rows.
pub(crate) fn read_angle(series: &Series) -> Vec<f64> {
    let own = turned(series);
    series.reference_rows.iter().map(|&k| own[k]).collect()
}

/// |α|, about: the angle that the reference turns over the one that the readings do, both less their mean rates; 1 where
/// they do not go together.
pub(crate) fn gain(t: &[f64], read: &[f64], reference: &[f64]) -> f64 {
    let (x, y) = (untrended(t, read), untrended(t, reference));
    let [xx, xy, yy] = [(&x, &x), (&x, &y), (&y, &y)].map(|(a, b)| dot(a, b));
    let found = xy.abs() / xx;
    if xy * xy > TOGETHER * xx * yy && found.is_finite() { found } else { 1.0 }
}

/// Least squared correlation of two angles that are one.
const TOGETHER: f64 = 0.9;

/// The values less the straight line through them.
pub(crate) fn untrended(t: &[f64], values: &[f64]) -> Vec<f64> {
    let n = t.len() as f64;
    let (at, level) = (t.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
    let along = |of: &dyn Fn(usize) -> f64| -> f64 { (0..t.len()).map(|k| (t[k] - at) * of(k)).sum() };
    let slope = along(&|k| values[k] - level) / along(&|k| t[k] - at);
    t.iter().zip(values).map(|(t, value)| value - level - slope * (t - at)).collect()
}

/// N of the angle that a rate with noise integrates to, rad/√s; 0 for other references.
fn reference_walk(series: &Series) -> f64 {
    if series.walk.reference > 0.0 {
        return series.walk.reference;
    }
    let t = &series.reference_t;
    if series.reference_rate.is_empty() {
        return 0.0;
    }
    let noise = Spread::of(stretches(&evenly(t, &series.reference_rate, median_apart(t))));
    let variance = if noise.uneven() { noise.quiet } else { noise.mean };
    (variance * usual(series.reference_t.windows(2).map(|pair| pair[1] - pair[0]).collect())).max(0.0).sqrt()
}

/// The same of what a problem's axes were found to have, to be carried beside means of its rows.
#[must_use]
pub fn walks(problem: &Problem) -> Vec<Walk> {
    let each = problem.series.iter().zip(priors(problem));
    each.map(|(series, prior)| Walk { gyro: prior.reading, assumed: prior.assumed, reference: reference_walk(series) })
        .collect()
}

/// Standard deviation of the angle that an encoder counts about the shaft's, rad, where the shaft turns by a count a row or more:
/// such that the sixth differences of what the gyro, vibrations taken out, does not know of its angle are those of the
/// errors that its steps make of so noisy an angle, and of the noise of the readings. 0 where it is too little to tell. `shaft`
/// and `gyro` are times and values, `rows` where in these the former stand.
#[must_use]
pub fn encoder_noise(encoder: &Encoder, shaft: (&[f64], &[f64]), gyro: (&[f64], &[f64]), rows: &[usize]) -> f64 {
    let ((t, angle), step) = (shaft, encoder.step);
    if step <= 0.0 || encoder.distinct(angle).1 > RETURNS {
        return 0.0;
    }
    let readings = without_tones(gyro.0, gyro.1);
    let whole = integral(gyro.0, &readings);
    let turned: Vec<f64> = rows.iter().map(|&k| whole[k]).collect();
    let alpha = gain(t, &turned, angle);
    let less: Vec<f64> = angle.iter().zip(&turned).map(|(r, own)| r - alpha * own).collect();
    let seen: Vec<f64> = windows(&incoherent((gyro.0, &readings), &whole, rows, angle)).collect();
    // Where the shaft was: under a motion that repeats itself it matters where an encoder counts from.
    let shaft: Vec<f64> =
        turned.iter().zip(smooth(t, &less, LEVEL)).map(|(turned, level)| alpha * turned + level).collect();
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let normal: Vec<f64> = turned.iter().map(|_| StandardNormal.sample(&mut random)).collect();
    let made_from = |zero: u32, noise: f64| -> Vec<f64> {
        let from = step * f64::from(zero) / f64::from(ALL_ZEROS);
        let along = |i: usize| shaft[i] + from;
        let error = |i: usize| encoder.noisy_error(&along, shaft.len(), i, noise * normal[i]);
        windows(&sixth_differences(&(0..shaft.len()).map(error).collect::<Vec<_>>())).collect()
    };
    let exact: Vec<Vec<f64>> = (0..ALL_ZEROS).map(|zero| made_from(zero, 0.0)).collect();
    let usual = encoder.step.powi(2) / 12.0 / encoder.readings as f64;
    let moves =
        |window: usize| exact.iter().map(|made| made[window]).sum::<f64>() / f64::from(ALL_ZEROS) > MOVES * usual;
    let moving =
        |of: &[f64]| -> Vec<f64> { (0..of.len()).filter(|&window| moves(window)).map(|window| of[window]).collect() };
    let mean_of = |made: &[f64]| Spread::of(moving(made)).mean;
    let mut seen = moving(&seen);
    if seen.len() < ENOUGH {
        return 0.0;
    }
    seen.sort_by(f64::total_cmp);
    let quiet = seen[seen.len() / 10] / TENTH;
    let count = seen.len() as f64;
    let mean = seen.iter().sum::<f64>() / count;
    let error = (seen.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count / count).sqrt();
    let own = Spread::of(seen);
    // What is here and not there is no noise: jerks that gyro and encoder see each in its own way.
    if own.mean > EVEN * quiet {
        return 0.0;
    }
    let apart = median_apart(gyro.0);
    let read = Spread::of(stretches(&evenly(gyro.0, &readings, apart)));
    // Where the motion never rests the two see it at other times, and no noise of either is known.
    if read.quiet > POOR.powi(2) / apart {
        return 0.0;
    }
    let read = if read.uneven() { read.quiet } else { read.mean };
    let wanted = own.mean - (alpha * apart).powi(2) * read * walked(median_apart(t) / apart);
    let exact: Vec<f64> = exact.iter().map(|made| mean_of(made)).collect();
    // Where a motion repeats itself one zero makes much more of the same errors than another.
    if wanted < exact.iter().copied().fold(0.0, f64::max) + TELLING * error {
        return 0.0;
    }
    let mean_made =
        |noise: f64| (0..ZEROS).map(|zero| mean_of(&made_from(zero, noise))).sum::<f64>() / f64::from(ZEROS);
    let mut before = (0.0, exact.iter().sum::<f64>() / f64::from(ZEROS));
    for noise in TRIED.map(|counts| counts * step) {
        let next = (noise, mean_made(noise));
        if next.1 > wanted {
            // Between two of them the variance goes about evenly with that of the angle.
            let share = ((wanted - before.1) / (next.1 - before.1)).clamp(0.0, 1.0);
            return (before.0 * before.0 + share * (noise * noise - before.0 * before.0)).sqrt();
        }
        before = next;
    }
    (before.0 * before.0 + wanted - before.1).max(0.0).sqrt()
}

/// Times more counts than it is seen at that a motion would have come to which did not repeat itself exactly: noise would have
/// brought this one to others.
const RETURNS: f64 = 6.0;
/// Half width of the window over which the gyro's angle is held to the encoder's, s: it walks by less than a count meanwhile.
const LEVEL: f64 = 2.0;
/// Share of the variance that an encoder's steps make that is moved through.
const MOVES: f64 = 0.5;
/// What share of their mean the variances of the quietest tenth of such stretches lie at, for white noise.
const TENTH: f64 = 0.386;
/// Times what the quietest stretches say that noise which is everywhere the same may be in the mean.
const EVEN: f64 = 1.5;
/// Stretches of the log that the noise of an encoder is told from, and the standard errors of their mean that it has to show by.
const ENOUGH: usize = 40;
const TELLING: f64 = 4.0;
/// Noises that are tried, counts; of more, steps only add their own.
const TRIED: [f64; 5] = [0.1, 0.2, 0.3, 0.5, 1.0];

/// Variance of what the encoder's steps make it err by, its zero anywhere, along the motion as it shows it, and of its noise,
/// rad².
fn counts(series: &Series) -> f64 {
    let (encoder, angle) = (series.encoder, &series.reference_angle);
    if encoder.step <= 0.0 || encoder.readings == 1 {
        return encoder.step.powi(2) / 12.0 + encoder.noise.powi(2);
    }
    let zeros = (0..ZEROS).map(|k| encoder.step * f64::from(k) / f64::from(ZEROS));
    let square = |zero: f64| -> f64 {
        (0..angle.len()).map(|i| encoder.error(&|i| angle[i] + zero, angle.len(), i).powi(2)).sum()
    };
    zeros.map(square).sum::<f64>() / f64::from(ZEROS) / angle.len() as f64 + encoder.noise.powi(2)
}

/// Places of an encoder's zero that its errors are the mean of, and those that it may stand at.
const ZEROS: u32 = 4;
const ALL_ZEROS: u32 = 16;

/// F(τ) of white gyro noise and reference noise alone, rad/s: F² = N²/τ + 2σ²/τ².
#[must_use]
pub fn weights(prior: &Prior, tau: &[f64]) -> Vec<f64> {
    tau.iter().map(|t| (prior.angle_random_walk.powi(2) / t + 2.0 * (prior.encoder / t).powi(2)).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Axis, Model,
        simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
    };

    fn noise_found(motion: Motion, hidden: &[&str]) -> f64 {
        let hidden = hidden.iter().map(|h| Hidden::parse(h, Axis::X).expect("an effect")).collect();
        let scenario = Scenario { motion, seed: 3, hidden, sensor: SensorSpec::default(), ..Scenario::default() };
        let record = simulate(&scenario).record;
        let series = Series::new(&record, Axis::X, &Model::base_for(&record)).expect("a series");
        prior(&series, &series.reference_angle).reading * 2_f64.sqrt() / scenario.sensor.noise_density
    }

    #[test]
    fn a_vibration_is_no_noise() {
        for motion in [Motion::Multisine { travel: 6.0 }, Motion::Drive { rate: 1.2, hold: 2.0 }] {
            let quiet = noise_found(motion, &[]);
            assert!((quiet - 1.0).abs() < 0.15, "{quiet} on {motion:?}");
            let shaken = noise_found(motion, &["vibration-tone:a_sin=0.06,a_cos=0.02,f=31.7"]);
            assert!((shaken / quiet - 1.0).abs() < 0.1, "{shaken} with a tone, {quiet} without on {motion:?}");
        }
    }

    #[test]
    fn what_is_missing_is_no_noise_of_an_encoder_that_is_read_seldom() {
        let motions = [Motion::Multisine { travel: 6.0 }, Motion::Drive { rate: 1.2, hold: 2.0 }];
        let effects = ["delay:d=0.03", "encoder-backlash", "scale-asymmetry:a=0.02", "lag:tau=0.02"];
        for (motion, hidden, every) in itertools::iproduct!(motions, effects, [2, 5, 10]) {
            let step = TAU / 4096.0;
            let reference = crate::simulate::Reference::Encoder(4096);
            let sensor = SensorSpec { reference, reference_every: every, ..SensorSpec::default() };
            let hidden = vec![Hidden::parse(hidden, Axis::X).expect("an effect")];
            let record = simulate(&Scenario { motion, seed: 3, hidden, sensor, ..Scenario::default() }).record;
            let series = Series::new(&record, Axis::X, &Model::base_for(&record)).expect("a series");
            let found = prior(&series, &series.reference_angle).encoder * 12_f64.sqrt() / step;
            assert!((found - 1.0).abs() < 0.15, "{found} on {motion:?} every {every}");
        }
    }

    #[test]
    fn the_noise_of_the_angle_that_an_encoder_counts_is_found() {
        let motions = [
            Motion::Multisine { travel: 6.0 },
            Motion::Drive { rate: 1.2, hold: 2.0 },
            Motion::Sine { amplitude: 2.618, frequency: 0.25 },
        ];
        for (motion, counts) in motions.into_iter().flat_map(|motion| [0.0, 0.15, 0.3, 0.8].map(|n| (motion, n))) {
            let step = TAU / 2048.0;
            let sensor = SensorSpec {
                reference: crate::simulate::Reference::Encoder(2048),
                reference_noise: counts * step,
                ..SensorSpec::default()
            };
            let scenario = Scenario { motion, seed: 5, rate_hz: 200.0, sensor, ..Scenario::default() };
            let record = simulate(&scenario).record;
            let series = Series::new(&record, Axis::X, &Model::base_for(&record)).expect("a series");
            let found = series.encoder.noise / step;
            // So little beside the steps a drive of a minute does not tell.
            if counts < 0.2 && found == 0.0 && !matches!(motion, Motion::Multisine { .. }) {
                continue;
            }
            assert!((found - counts).abs() < 0.03 + 0.1 * counts, "{found} for {counts} counts on {motion:?}");
        }
    }
}
