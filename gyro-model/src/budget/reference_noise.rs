//! Noise of the reference: white, or coloured as its own spectrum shows it.
//!
//! Where the motion is weak enough, −Re S_er is the reference's own noise, whatever its colour. Below, where the motion hides
//! it, it is taken to go on as the lowest bands show it: σ²(f) of the angle ∝ f⁻ᵖ, 0 ≤ p ≤ 2. What is more than that there
//! is not its, and neither is what goes with the gyro's rate from one end of the log to the other.
//!
//! ```text
//! E² = 2 (R(0) − R(τ)) / τ²
//! ```

use super::{Claim, bias_wander::incoherent, seen::Seen, spectra::Band};
use std::f64::consts::TAU;

/// Standard error, as a share of the error's density, to which a band has to tell the two sides apart.
const TELLS: f64 = 0.25;
/// Bands from which a law is read, the octaves that they lie in, and the steepest law.
const BANDS: usize = 5;
const OCTAVES: f64 = 4.0;
const STEEPEST: f64 = 2.0;

/// What it makes of the error that is `left`, band by band.
pub(super) fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    if seen.rests {
        return None;
    }
    let law = Law::of(seen);
    let level = |k: usize| {
        let band = &seen.bands[k];
        let white = seen.white_of_reference(band);
        let own = if tells(band) { band.of_reference().0 } else { law.map_or(0.0, |law| law.at(band.frequency())) };
        white.max(own)
    };
    let claim = Claim::up_to(seen, &incoherent(seen, left), level);
    let (low, high) = range(seen);
    let rms: f64 =
        seen.bands.iter().map(|band| shown(band) * (band.high - band.low) / (TAU * band.frequency()).powi(2)).sum();
    let coloured = rms.sqrt() > 1.5 * seen.prior.encoder && low > 0.0;
    let sigma = if coloured { rms.sqrt() } else { seen.prior.encoder };
    Some(claim.saying([sigma, if coloured { low } else { 0.0 }, high]))
}

/// Whether a band tells the reference's noise from the gyro's.
pub(super) fn tells(band: &Band) -> bool {
    band.of_reference().1 < TELLS * band.error
}

/// Whether enough bands tell the reference's noise for a floor to be made of it.
pub(super) fn is_told(seen: &Seen) -> bool {
    let told = seen.bands.iter().filter(|band| shown(band) > 0.0).count();
    4 * told > seen.bands.len()
}

/// The reference's own density where it is told and plain.
fn shown(band: &Band) -> f64 {
    let (density, error) = band.of_reference();
    if tells(band) && density > 2.0 * error { density.min(band.error - band.coherent()).max(0.0) } else { 0.0 }
}

/// The range of frequencies, Hz, in which the reference is noisier than the whole of what the gyro shows; nothing: 0, 0.
fn range(seen: &Seen) -> (f64, f64) {
    let noisier = |band: &&Band| shown(band) > band.gyro;
    let power = |band: &Band| shown(band) * (band.high - band.low);
    let all: f64 = seen.bands.iter().filter(noisier).map(power).sum();
    let (mut sum, mut low, mut high) = (0.0, 0.0, 0.0);
    for band in seen.bands.iter().filter(noisier) {
        if sum < 0.05 * all || low == 0.0 {
            low = band.low;
        }
        if sum < 0.95 * all {
            high = band.high;
        }
        sum += power(band);
    }
    (low, high)
}

/// Density of the reference's angle noise where the motion hides it, as those bands show it where that ends.
#[derive(Clone, Copy)]
struct Law {
    from: f64,
    density: f64,
    power: f64,
}

impl Law {
    fn of(seen: &Seen) -> Option<Self> {
        let angle = |band: &Band| shown(band) / (TAU * band.frequency()).powi(2);
        let known: Vec<(f64, f64)> =
            seen.bands.iter().filter(|band| shown(band) > 0.0).map(|band| (band.frequency(), angle(band))).collect();
        // Single bands far below are chance.
        let first = known.iter().position(|(f, _)| {
            let within = seen.bands.iter().filter(|b| b.frequency() >= *f && b.frequency() < 1.5 * f);
            let (told, all) = within.fold((0, 0), |(told, all), b| (told + usize::from(shown(b) > 0.0), all + 1));
            2 * told >= all
        })?;
        let from = known[first].0;
        let law: Vec<(f64, f64)> = known[first..].iter().copied().filter(|(f, _)| *f < OCTAVES * from).collect();
        if law.len() < BANDS {
            return None;
        }
        let n = law.len() as f64;
        let (x, y) = law.iter().fold((0.0, 0.0), |(x, y), (f, a)| (x + f.ln() / n, y + a.ln() / n));
        let (xx, xy) = law
            .iter()
            .fold((0.0, 0.0), |(xx, xy), (f, a)| (xx + (f.ln() - x).powi(2), xy + (f.ln() - x) * (a.ln() - y)));
        let power = (-xy / xx).clamp(0.0, STEEPEST);
        Some(Self { from, density: (y - power * (from.ln() - x)).exp(), power })
    }

    /// Density of the rate, (rad/s)²/Hz.
    fn at(&self, frequency: f64) -> f64 {
        (TAU * frequency).powi(2) * self.density * (frequency / self.from).powf(-self.power)
    }
}
