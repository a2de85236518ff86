//! A reference that does not follow: smoothed, or interpolated between readings that come seldom.
//!
//! A smoothed reference shows less and less of what the gyro shows, the faster it goes: (S_gg − Re S_gr) / S_gg = 1 − H, with
//! H = exp(−(2πfw)²/2) of a symmetric smoothing of width w. Interpolated straight between knots h apart it turns evenly
//! between them, and what it makes of the motion beyond a quarter of 1/h is its own.

use super::{Claim, seen::Seen, spectra::Band};
use std::f64::consts::TAU;

/// How a reference fails to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Slow {
    /// Width of its smoothing, s.
    Smoothed(f64),
    /// From one of its knots to the next, s.
    Knots(f64),
}

/// Bands in which the gyro shows more than so many times its noise tell whether the reference follows.
const ABOVE_NOISE: f64 = 6.0;
/// Share of what the gyro shows that is missing in the reference at the fastest of them at least.
const MISSING: f64 = 0.3;
/// By how much χ² falls at least.
const PLAIN: f64 = 40.0;
/// Share of a knot's frequency from which on what a straight line between knots makes is its own.
const OWN: f64 = 0.25;

/// What it makes of the error that is `left`, band by band.
pub(super) fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    let slow = slow(seen)?;
    let part = |k: usize| {
        let band = &seen.bands[k];
        match slow {
            Slow::Smoothed(width) => {
                let (share, error) = band.share_of_gyro();
                if share > 2.0 * error && missing(width, band.frequency()) > 3e-3 { band.coherent() } else { 0.0 }
            }
            Slow::Knots(apart) if band.frequency() > OWN / apart => band.error,
            Slow::Knots(_) => {
                if band.share_of_gyro().0 > 0.0 {
                    band.coherent()
                } else {
                    0.0
                }
            }
        }
    };
    let (size, knots) = match slow {
        Slow::Smoothed(width) => (width, 0.0),
        Slow::Knots(apart) => (apart, 1.0),
    };
    Some(Claim::exactly(left, part).saying([size, knots, 0.0]))
}

/// Whether the reference follows, and how not.
#[must_use]
pub(super) fn slow(seen: &Seen) -> Option<Slow> {
    seen.knots.map(Slow::Knots).or_else(|| smoothed(seen).map(Slow::Smoothed))
}

/// 1 − H.
fn missing(width: f64, frequency: f64) -> f64 {
    -(-0.5 * (TAU * frequency * width).powi(2)).exp_m1()
}

fn smoothed(seen: &Seen) -> Option<f64> {
    let shows = |band: &&Band| band.gyro > ABOVE_NOISE * seen.white() && band.share_of_gyro().1 < 0.2;
    let known: Vec<(f64, f64, f64)> = seen
        .bands
        .iter()
        .filter(shows)
        .map(|band| {
            let (share, error) = band.share_of_gyro();
            (band.frequency(), share, error.hypot(0.03))
        })
        .collect();
    if known.len() < 10 {
        return None;
    }
    let misfit = |width: f64| -> f64 {
        known.iter().map(|(f, share, error)| ((share - missing(width, *f)) / error).clamp(-5.0, 5.0).powi(2)).sum()
    };
    let fastest = known[known.len() - 1].0;
    let width = |k: i32| 0.1 / fastest * 1.1_f64.powi(k);
    let best = (0..60).map(width).min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
    let told = known.iter().filter(|(f, ..)| missing(best, *f) > MISSING);
    let (follow, all) = told
        .fold((0, 0), |(follow, all), (f, share, _)| (follow + usize::from(*share > 0.5 * missing(best, *f)), all + 1));
    let plain = misfit(0.0) - misfit(best) > PLAIN && all >= 3 && 10 * follow >= 7 * all;
    // As well as a law of one parameter can.
    (plain && misfit(best) < 0.5 * misfit(0.0)).then_some(best)
}

/// The frequency, Hz, at which a smoothing of this width leaves a share away.
#[must_use]
pub(super) fn missing_at(share: f64, width: f64) -> f64 {
    (-2.0 * (1.0 - share).ln()).sqrt() / (TAU * width)
}
