//! Motion faster than half the sampling rate, which comes back folded: torque ripple of a stepper, say.
//!
//! A line of the error that is there only while the shaft turns evenly, and that gyro and reference both show, but not in the
//! proportion of a motion of that frequency: f = |m·rate/step − k·f_s|, an angle A shows as a rate of 2πA(k f_s ± f), not
//! 2πAf.

use super::{Claim, seen::Seen, spectra::Band};
use crate::{
    evidence::spectrum::{fast_length, hann, power, transform},
    order::median,
};
use realfft::num_complex::Complex;

/// Rows of a stretch of even rate, from one to the next, and the length that their spectra are taken at.
const ROWS: usize = 32;
const APART: usize = 8;
const PADDED: usize = 256;
/// Share by which the rate of a stretch's halves may differ from its mean, and that of stretches which are one group.
const EVEN: f64 = 0.15;
const ONE_RATE: f64 = 0.07;
/// Stretches that show a line at least, and rates that are looked at.
const STRETCHES: usize = 20;
const RATES: usize = 6;
/// Times the middle power of the error that a line has, and the coherence of gyro and reference in it.
const LINE: f64 = 6.0;
const COHERENT: f64 = 0.5;
/// A proportion of gyro to reference that no response of either makes: larger than this, or so far turned.
const LARGER: f64 = 1.3;
const TURNED: f64 = 0.2;
/// Share of the fastest rate below which a stretch is one of rest.
const RESTS: f64 = 0.05;

/// Share of half the sampling rate from which on the spectrum says how strong the motion is beyond it.
const NEAR: f64 = 0.8;
/// Times the gyro's and the reference's own noise that both show there.
const STRONG: (f64, f64) = (10.0, 4.0);

/// What it makes of the error that is `left`, band by band.
pub fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    let lines = &seen.folded;
    let beyond = beyond(seen);
    if lines.is_empty() && beyond.is_none() {
        return None;
    }
    let width = 1.0 / (ROWS as f64 * seen.dt);
    let part = |k: usize| {
        let band = &seen.bands[k];
        let inside = lines.iter().any(|line| band.high > line.frequency - width && band.low < line.frequency + width);
        let (own, error) = band.of_gyro();
        let is_own = own > 2.0 * error;
        match beyond {
            _ if inside => band.error,
            Some(level) if is_own => own.min((1.0 + super::CHANCE / band.count.sqrt()) * level),
            _ => 0.0,
        }
    };
    let numbers = match fundamental(lines, 1.0 / seen.dt) {
        Some(line) => [line.frequency, line.truly, line.rate],
        None => [0.0, beyond.unwrap_or(0.0).sqrt(), 0.0],
    };
    Some(Claim::exactly(left, part).saying(numbers))
}

/// Density of the motion just below half the sampling rate, (rad/s)²/Hz, where gyro and reference both show it: beyond, it goes on,
/// and comes back folded.
fn beyond(seen: &Seen) -> Option<f64> {
    let from = 0.5 * NEAR / seen.dt;
    let near: Vec<&Band> = seen.bands.iter().filter(|band| band.low > from).collect();
    let mean = |of: &dyn Fn(&Band) -> f64| near.iter().map(|band| of(band)).sum::<f64>() / near.len().max(1) as f64;
    let gyro = mean(&|band| band.gyro - band.of_gyro().0.max(0.0));
    let reference = mean(&|band| band.reference - band.of_reference().0.max(0.0));
    let noise = mean(&|band| seen.white_of_reference(band));
    (gyro.min(reference) > STRONG.0 * seen.white() && reference > STRONG.1 * noise).then(|| mean(&|band| band.gyro))
}

/// The line that tells most of the motion: of the strongest at one rate, that whose multiples, folded, are the others too, at
/// the lowest frequency that does. The proportion of gyro to reference alone does not say where a line came from, for the
/// gyro shows less of what is fast.
fn fundamental(lines: &[Line], sampling: f64) -> Option<Line> {
    let strongest = lines.iter().max_by(|a, b| a.power.total_cmp(&b.power))?;
    let own: Vec<&Line> = lines.iter().filter(|line| (line.rate / strongest.rate - 1.0).abs() < ONE_RATE).collect();
    let explained = |truly: f64| -> f64 {
        let shows = |line: &&&Line| {
            (1..=MULTIPLES).any(|m| (folded(f64::from(m) * truly, sampling) - line.frequency).abs() < SAME)
        };
        own.iter().filter(shows).map(|line| line.power).sum()
    };
    let tried = own.iter().flat_map(|line| {
        let from = [sampling - line.frequency, sampling + line.frequency, 2.0 * sampling - line.frequency];
        from.map(|truly| Line { truly, ..**line })
    });
    tried.max_by(|a, b| explained(a.truly).total_cmp(&explained(b.truly)).then(b.truly.total_cmp(&a.truly)))
}

/// Where a frequency shows that is sampled so often, Hz.
fn folded(frequency: f64, sampling: f64) -> f64 {
    let rest = frequency.rem_euclid(sampling);
    rest.min(sampling - rest)
}

/// Multiples of a line that are looked at, and how near one has to lie, Hz.
const MULTIPLES: u32 = 4;
const SAME: f64 = 0.8;

/// Share of the power of an error's steps that stands within a line's width of these lines.
pub fn share(lines: &[Line], error: &[f64], dt: f64) -> f64 {
    let mut own = error.to_vec();
    own.truncate(fast_length(own.len()));
    let width = 1.0 / (ROWS as f64 * dt);
    let bin = 1.0 / (own.len() as f64 * dt);
    let power = power(&mut own);
    let inside = |k: &usize| lines.iter().any(|line| (*k as f64 * bin - line.frequency).abs() < width);
    let within: f64 = (0..power.len()).filter(inside).map(|k| power[k]).sum();
    within / power.iter().sum::<f64>().max(1e-300)
}

/// A line of folded motion.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Where it shows, Hz.
    frequency: f64,
    /// Where it is, Hz, as near as the proportion of the two says.
    truly: f64,
    /// The rate at which it shows, rad/s.
    rate: f64,
    /// Power in the error.
    power: f64,
}

/// One stretch of even rate.
struct Stretch {
    /// Its rate's size, rad a row.
    rate: f64,
    /// Its first row.
    first: usize,
}

/// The lines of the steps of an error, of a gyro and of a reference, so far apart, s.
pub fn lines([error, gyro, reference]: [&[f64]; 3], dt: f64) -> Vec<Line> {
    let n = error.len();
    let mean = |first: usize, rows: usize| reference[first..first + rows].iter().sum::<f64>() / rows as f64;
    let fastest = gyro.iter().fold(0.0_f64, |most, step| most.max(step.abs()));
    let even = |first: usize| {
        let [whole, one, other] = [mean(first, ROWS), mean(first, ROWS / 2), mean(first + ROWS / 2, ROWS / 2)];
        let is_even = (one - whole).abs().max((other - whole).abs()) < EVEN * whole.abs();
        (is_even && whole.abs() > RESTS * fastest).then_some(Stretch { rate: whole.abs(), first })
    };
    let mut left: Vec<Stretch> = (0..n.saturating_sub(ROWS)).step_by(APART).filter_map(even).collect();
    let mut lines = Vec::new();
    for _ in 0..RATES {
        let Some(rate) = median(left.iter().map(|s| s.rate).collect()) else { break };
        let is_one = |s: &Stretch| (s.rate / rate - 1.0).abs() < ONE_RATE;
        let group: Vec<usize> = left.iter().filter(|s| is_one(s)).map(|s| s.first).collect();
        if group.len() >= STRETCHES {
            lines.extend(of_group([error, gyro, reference], &group, rate / dt, dt));
        }
        left.retain(|s| !is_one(s));
    }
    lines
}

/// The lines that stretches of one rate show.
fn of_group(series: [&[f64]; 3], group: &[usize], rate: f64, dt: f64) -> Vec<Line> {
    let taper = hann(ROWS);
    let spectrum = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / ROWS as f64;
        let mut own: Vec<f64> = values.iter().zip(&taper).map(|(v, w)| (v - mean) * w).collect();
        own.resize(PADDED, 0.0);
        transform(&mut own)
    };
    let many = PADDED / 2 + 1;
    let (mut error, mut gyro, mut reference) = (vec![0.0; many], vec![0.0; many], vec![0.0; many]);
    let mut cross = vec![Complex::new(0.0, 0.0); many];
    for &first in group {
        let [e, g, r] = series.map(|series| spectrum(&series[first..first + ROWS]));
        for k in 0..many {
            error[k] += e[k].norm_sqr();
            gyro[k] += g[k].norm_sqr();
            reference[k] += r[k].norm_sqr();
            cross[k] += r[k].conj() * g[k];
        }
    }
    // Below, a stretch holds too little of a period.
    let lowest = 2 * PADDED / ROWS;
    let Some(usual) = median(error[lowest..].to_vec()) else { return Vec::new() };
    let is_top = |k: usize| {
        let near = k.saturating_sub(PADDED / ROWS / 2)..(k + PADDED / ROWS / 2 + 1).min(many);
        error[k] > LINE * usual && error[near].iter().all(|other| *other <= error[k])
    };
    let sampling = 1.0 / dt;
    let line = |k: usize| {
        let proportion = cross[k] / reference[k].max(1e-300);
        let coherence = cross[k].norm_sqr() / (gyro[k] * reference[k]).max(1e-300);
        let is_folded = coherence > COHERENT && (proportion.norm() > LARGER || proportion.re < TURNED);
        let frequency = k as f64 / (PADDED as f64 * dt);
        let wanted = proportion.norm() * frequency;
        let truly = [sampling - frequency, sampling + frequency]
            .into_iter()
            .min_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs()))?;
        is_folded.then_some(Line { frequency, truly, rate, power: error[k] })
    };
    (lowest..many).filter(|&k| is_top(k)).filter_map(line).collect()
}
