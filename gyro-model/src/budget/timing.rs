//! Stamps that scatter: a reading that is stamped δ too late is off by ωδ, whatever the averaging time.
//!
//! ```text
//! E d_τ² = σ_t² (ω(t)² + ω(t + τ)²)
//! ```
//!
//! Its evidence is that the second differences s of the angle error grow with the square of the rate where they are, and that
//! what grows is white: E sᵢ² = 6 σ_t² ω², E sᵢsᵢ₊₁ = −4 σ_t² ω².

use super::{Claim, seen::Seen};

/// Blocks over which the standard errors are taken.
const BLOCKS: usize = 30;
/// Standard errors that it has to show by.
const PLAIN: f64 = 5.0;
/// Where −E sᵢsᵢ₊₁ / E sᵢ² lies for what is white: 2/3.
const WHITE: (f64, f64) = (0.54, 0.8);
/// Share of the white part that it makes at least.
const SHARE: f64 = 0.2;

/// What it makes of the error that is `left`, band by band.
pub(super) fn claim(seen: &Seen, left: &[f64]) -> Option<Claim> {
    let scatter = Scatter::of(seen)?;
    let sigma = scatter.stamps * scatter.rate;
    // What chance makes more or less of a band is shared alike.
    let part = |k: usize| seen.of_white_angle(&seen.bands[k], sigma);
    Some(Claim::up_to(seen, left, part).saying([scatter.stamps, 0.0, 0.0]))
}

/// The scatter of stamps, s, and the root mean square rate, rad/s.
struct Scatter {
    stamps: f64,
    rate: f64,
}

impl Scatter {
    fn of(seen: &Seen) -> Option<Self> {
        let n = seen.error.len();
        let rate = |k: usize| {
            let around = &seen.gyro[k.saturating_sub(2)..(k + 3).min(n)];
            around.iter().sum::<f64>() / (around.len() as f64 * seen.dt)
        };
        let squares: Vec<f64> = (0..n).map(|k| rate(k).powi(2)).collect();
        let bends: Vec<f64> = seen.error.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // An encoder that stands shows no error of its steps.
        let turns = |k: &usize| squares[*k].sqrt() * seen.dt > seen.count;
        let rows: Vec<usize> = (0..bends.len() - 1).filter(turns).collect();
        if rows.len() < 40 * BLOCKS {
            return None;
        }
        let sums: Vec<[f64; 6]> = rows
            .chunks(rows.len().div_ceil(BLOCKS))
            .map(|block| {
                block.iter().fold([0.0; 6], |mut sum, &k| {
                    let (x, y, z) = (squares[k], bends[k] * bends[k], bends[k] * bends[k + 1]);
                    for (sum, value) in sum.iter_mut().zip([1.0, x, y, x * x, x * y, x * z]) {
                        *sum += value;
                    }
                    sum[5] += 0.0;
                    sum
                })
            })
            .collect();
        let z_mean = rows.iter().map(|&k| bends[k] * bends[k + 1]).sum::<f64>() / rows.len() as f64;
        let total = sums.iter().fold([0.0; 6], |all, one| std::array::from_fn(|i| all[i] + one[i]));
        let slope = |s: &[f64; 6]| (s[4] - s[1] * s[2] / s[0]) / (s[3] - s[1] * s[1] / s[0]);
        let whole = slope(&total);
        let without: Vec<f64> = sums.iter().map(|one| slope(&std::array::from_fn(|i| total[i] - one[i]))).collect();
        let count = without.len() as f64;
        let spread = without.iter().map(|w| (w - whole).powi(2)).sum::<f64>() * (count - 1.0) / count;
        let product = (total[5] - total[1] * z_mean) / (total[3] - total[1] * total[1] / total[0]);
        let white = -product / whole;
        let square = total[1] / total[0];
        let mean_bend = total[2] / total[0];
        let plain = whole > PLAIN * spread.sqrt() && white > WHITE.0 && white < WHITE.1;
        let all = squares.iter().sum::<f64>() / n as f64;
        (plain && whole * square > SHARE * mean_bend).then(|| Self { stamps: (whole / 6.0).sqrt(), rate: all.sqrt() })
    }
}
