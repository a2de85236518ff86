//! Motion faster than half the sampling rate, which comes back folded: torque ripple of a stepper, say.
//!
//! Its lines ([`super::folded_lines`]), and beyond them motion that is still strong at half the sampling rate.

use super::{Claim, folded_lines::WIDTH, seen::Seen, spectra::Band};

/// Share of half the sampling rate from which on the spectrum says how strong the motion is beyond it.
const NEAR: f64 = 0.8;
/// Times the gyro's and the reference's own noise that both show there.
const STRONG: (f64, f64) = (10.0, 4.0);

/// What it makes of the error that is `left`, band by band.
pub(super) fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    let lines = &seen.folded;
    let beyond = beyond(seen);
    if lines.is_empty() && beyond.is_none() {
        return None;
    }
    let width = WIDTH / seen.dt;
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
    Some(Claim::exactly(left, part).saying([beyond.unwrap_or(0.0).sqrt(), 0.0, 0.0]))
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
