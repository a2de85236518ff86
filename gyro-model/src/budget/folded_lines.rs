//! Lines of motion that is too fast for the sampling rate, where they show, and where they come from.
//!
//! A line of the error that is there only while the shaft turns evenly, and that gyro and reference both show, but not in the
//! proportion of a motion of that frequency: of f = k f_s ± f₀ an angle A shows as a rate of 2πAf at f₀, not 2πAf₀. Or one so near
//! to half the sampling rate that readings so far apart do not say what the rate is between them.

use crate::{
    evidence::spectrum::{fast_length, hann, power, transform},
    order::median,
};
use realfft::num_complex::Complex;

/// Rows of a stretch of even rate, from one to the next, and the length that their spectra are taken at.
const ROWS: usize = 32;
const APART: usize = 8;
const PADDED: usize = 256;
/// Half the width of a line, in shares of the sampling rate.
pub(super) const WIDTH: f64 = 1.0 / ROWS as f64;
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
/// Share of half the sampling rate from which on no sum of readings follows the angle: at 0.8 the third-order rule makes 60 % of it.
const NEAR: f64 = 0.8;
/// Share of the fastest rate below which a stretch is one of rest.
const RESTS: f64 = 0.05;

/// A line of motion that is too fast.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Where it shows, Hz.
    pub frequency: f64,
    /// The rate at which it shows, rad/s.
    rate: f64,
    /// Power in the error.
    power: f64,
}

/// The motion behind some lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Where it shows, Hz.
    pub shows: f64,
    /// Where it is, Hz.
    pub truly: f64,
    /// The rate at which it shows, rad/s.
    pub rate: f64,
    /// Whether a multiple of it shows too: one line alone may come from any fold.
    pub is_sure: bool,
}

impl Motion {
    /// The motion that most of the lines at the strongest one's rate are multiples of, folded; the slowest where several are. The
    /// proportion of gyro to reference does not say where a line came from, for the gyro shows less of what is fast.
    #[must_use]
    pub(super) fn behind(lines: &[Line], dt: f64) -> Option<Self> {
        let sampling = 1.0 / dt;
        let strongest = lines.iter().max_by(|a, b| a.power.total_cmp(&b.power))?;
        let own: Vec<&Line> = lines.iter().filter(|line| (line.rate / strongest.rate - 1.0).abs() < ONE_RATE).collect();
        let multiples = |truly: f64| {
            let is_multiple = move |line: &&&Line| {
                (1..=MULTIPLES).any(|m| (folded(f64::from(m) * truly, sampling) - line.frequency).abs() < SAME)
            };
            own.iter().filter(is_multiple)
        };
        let explained = |motion: &Self| multiples(motion.truly).map(|line| line.power).sum::<f64>();
        let tried = own.iter().flat_map(|line| {
            let as_it_shows = is_near(line.frequency, dt).then_some(line.frequency);
            let from = [sampling - line.frequency, sampling + line.frequency, 2.0 * sampling - line.frequency];
            let of = |truly| Self { shows: line.frequency, truly, rate: line.rate, is_sure: false };
            as_it_shows.into_iter().chain(from).map(of)
        });
        let best = tried.max_by(|a, b| explained(a).total_cmp(&explained(b)).then(b.truly.total_cmp(&a.truly)))?;
        Some(Self { is_sure: multiples(best.truly).count() > 1, ..best })
    }

    /// It in words, and where it shows.
    #[must_use]
    pub(super) fn says(&self) -> String {
        let Self { shows, truly, rate, is_sure } = self;
        let about = if *is_sure { "about" } else { "at least" };
        let turns = format!("while the shaft turns with {:.0} °/s", rate.to_degrees());
        if shows == truly {
            return format!(
                "motion of {about} {truly:.1} Hz, hardly slower than half the sampling rate, is there {turns}"
            );
        }
        format!("motion of {about} {truly:.1} Hz, faster than half the sampling rate, shows at {shows:.1} Hz {turns}")
    }
}

/// Whether a line lies so near to half the sampling rate that its readings do not follow it.
fn is_near(frequency: f64, dt: f64) -> bool {
    frequency > 0.5 * NEAR / dt
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
pub(super) fn share(lines: &[Line], error: &[f64], dt: f64) -> f64 {
    let mut own = error.to_vec();
    own.truncate(fast_length(own.len()));
    let width = WIDTH / dt;
    let bin = 1.0 / (own.len() as f64 * dt);
    let power = power(&mut own);
    let inside = |k: &usize| lines.iter().any(|line| (*k as f64 * bin - line.frequency).abs() < width);
    let within: f64 = (0..power.len()).filter(inside).map(|k| power[k]).sum();
    within / power.iter().sum::<f64>().max(1e-300)
}

/// One stretch of even rate.
struct Stretch {
    /// Its rate's size, rad a row.
    rate: f64,
    /// Its first row.
    first: usize,
}

/// The lines of the steps of an error, of a gyro and of a reference, so far apart, s.
pub(super) fn lines([error, gyro, reference]: [&[f64]; 3], dt: f64) -> Vec<Line> {
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
    let line = |k: usize| {
        let proportion = cross[k] / reference[k].max(1e-300);
        let coherence = cross[k].norm_sqr() / (gyro[k] * reference[k]).max(1e-300);
        let frequency = k as f64 / (PADDED as f64 * dt);
        let is_other = proportion.norm() > LARGER || proportion.re < TURNED;
        let is_too_fast = coherence > COHERENT && (is_other || is_near(frequency, dt));
        is_too_fast.then_some(Line { frequency, rate, power: error[k] })
    };
    (lowest..many).filter(|&k| is_top(k)).filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    const RATE: f64 = 5.67;

    fn line(frequency: f64, power: f64) -> Line {
        Line { frequency, rate: RATE, power }
    }

    #[test]
    fn two_lines_are_one_motion_and_its_multiple() {
        // 90.2 Hz at 100 rows a second shows at 9.8 Hz, twice as much at 19.6 Hz.
        let motion = Motion::behind(&[line(9.8, 1.0), line(19.4, 3.0)], 0.01).unwrap();
        assert!((motion.truly - 90.2).abs() < 1e-9 && motion.is_sure, "{motion:?}");
        assert!(motion.says().contains("about 90.2 Hz") && motion.says().contains("at 9.8 Hz"), "{}", motion.says());
    }

    #[test]
    fn one_line_alone_says_the_least_that_it_may_be() {
        let motion = Motion::behind(&[line(30.0, 1.0)], 0.01).unwrap();
        assert!((motion.truly - 70.0).abs() < 1e-9 && !motion.is_sure, "{motion:?}");
        assert!(motion.says().contains("at least 70.0 Hz"), "{}", motion.says());
        assert_eq!(Motion::behind(&[], 0.01), None);
    }

    #[test]
    fn a_line_near_half_the_sampling_rate_is_the_motion_that_its_multiple_folds_from() {
        // 46.9 Hz at 100 rows a second shows as it is, twice as much at 6.2 Hz.
        let motion = Motion::behind(&[line(46.9, 3.0), line(6.3, 1.0)], 0.01).unwrap();
        assert!((motion.truly - 46.9).abs() < 1e-9 && motion.is_sure, "{motion:?}");
        assert!(motion.says().contains("46.9 Hz, hardly slower than half the sampling rate"), "{}", motion.says());
    }

    #[test]
    fn a_line_that_the_gyro_shows_a_part_of_is_too_fast_only_near_half_the_sampling_rate() {
        let dt = 0.01;
        let lines_at = |frequency: f64| {
            let mut random = ChaCha8Rng::seed_from_u64(7);
            let wave = |k: usize| 0.01 * (TAU * frequency * dt * k as f64).sin();
            let reference: Vec<f64> = (0..4000).map(|k| 0.03 + wave(k)).collect();
            let mut noise = || 1e-5 * Distribution::<f64>::sample(&StandardNormal, &mut random);
            let gyro: Vec<f64> = (0..4000).map(|k| 0.03 + 0.4 * wave(k) + noise()).collect();
            let error: Vec<f64> = gyro.iter().zip(&reference).map(|(gyro, reference)| gyro - reference).collect();
            lines([&error, &gyro, &reference], dt)
        };
        let near = lines_at(46.5);
        assert!(near.len() == 1 && (near[0].frequency - 46.5).abs() < 1.0, "{near:?}");
        // A response of the gyro that the catalogue has may make that.
        assert!(lines_at(20.0).is_empty());
    }

    #[test]
    fn the_share_of_a_line_is_that_of_its_power() {
        let wave = |frequency: f64, k: usize| (TAU * frequency * 0.01 * k as f64).sin();
        let steps: Vec<f64> = (0..8000).map(|k| 3.0 * wave(20.0, k) + wave(35.0, k)).collect();
        let share = share(&[line(20.0, 1.0)], &steps, 0.01);
        assert!((share - 0.9).abs() < 0.01, "{share}");
        assert!(super::share(&[], &steps, 0.01) == 0.0);
    }
}
