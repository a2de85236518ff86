//! White noise of the gyro: E² = N²/τ. Known from the reading's own fastest differences; where the spectra tell the two sides
//! apart and only the gyro shows more, up to twice that. Of a sensor at rest all that is fast is noise, whatever its colour.

use super::{Claim, seen::Seen};
use crate::order::median;

/// Times its density by which the gyro's noise may lie above what its fastest differences say.
const MOST: f64 = 4.0;
/// Frequency from which on what a sensor at rest shows is noise and no bias that wanders, Hz.
const SLOW: f64 = 0.1;
/// Bands that show it at least.
const BANDS: usize = 8;

/// What it makes of the error that is `left`, band by band.
pub(super) fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    if seen.rests {
        return Some(Claim::exactly(left, |k| if seen.bands[k].frequency() > SLOW { left[k] } else { seen.white() }));
    }
    let white = seen.white();
    let shown = seen.bands.iter().map(super::spectra::Band::of_gyro).filter(|(_, error)| *error < 0.5 * white);
    let shown: Vec<f64> = shown.map(|(density, _)| density).collect();
    let level = if shown.len() < BANDS { white } else { median(shown)?.clamp(white, MOST * white) };
    Some(Claim::up_to(seen, left, |_| level))
}
