//! Stamps in bursts: readings taken evenly, and stamped where they arrive, several at once.

use super::{
    Report, counted, quantile,
    thresholds::{BURST, BURST_SHARE, PAUSE},
};
use crate::fault::FaultKind;

/// Of large bursts: how far readings are apart within one, over how far they would be apart evenly, 1. A log with pauses, taken
/// evenly between them, has more.
const DENSE: f64 = 0.1;

/// Stamps that come in bursts.
pub(super) struct Bursts {
    /// From the begin of one to that of the next, s.
    pub(super) period: f64,
    /// Readings in each.
    size: usize,
    /// Readings in all bursts of more than one.
    count: usize,
    /// Index of the first burst's first reading.
    pub(super) first: usize,
    /// How far readings are apart within one, s.
    within: f64,
}

impl Bursts {
    /// What intervals between one reading and the next show, s; `None` where they are no bursts.
    pub(super) fn of(dt: &[f64]) -> Option<Self> {
        // Of large bursts the pauses are few.
        Self::with_pauses(dt, 0.95).or_else(|| Self::with_pauses(dt, 0.99).filter(|of| of.within < DENSE * of.even()))
    }

    /// How far readings are apart that are taken evenly, s.
    fn even(&self) -> f64 {
        self.period / self.size as f64
    }

    /// Of intervals of which those far longer than this quantile are pauses of the logger, no part of a mean rate.
    fn with_pauses(dt: &[f64], usual: f64) -> Option<Self> {
        let longest = 20.0 * quantile(dt.to_vec(), usual)?;
        let usual: Vec<f64> = dt.iter().copied().filter(|&x| x < longest).collect();
        let mean = usual.iter().sum::<f64>() / usual.len() as f64;
        let short: Vec<f64> = dt.iter().copied().filter(|&x| x < BURST * mean).collect();
        let begins: Vec<usize> = (0..dt.len()).filter(|&k| dt[k] > PAUSE * mean).map(|k| k + 1).collect();
        if (short.len() as f64) < BURST_SHARE * dt.len() as f64 || begins.len() < 10 {
            return None;
        }
        let sizes: Vec<usize> = begins.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = |values: Vec<f64>| quantile(values, 0.5);
        let size = middle(sizes.iter().map(|&size| size as f64).collect())?;
        let sums = begins.windows(2).map(|pair| dt[pair[0]..pair[1]].iter().sum::<f64>());
        let period = middle(sums.filter(|&sum| sum < longest).collect())?;
        let first = *begins.iter().zip(&sizes).find(|(_, size)| **size > 1)?.0;
        let count = sizes.iter().filter(|&&size| size > 1).sum();
        (size >= 2.0).then(|| Self { period, size: size as usize, count, first, within: middle(short).unwrap_or(0.0) })
    }

    /// Reports them.
    pub(super) fn report(&self, report: &mut Report, t: f64) {
        let &Self { period, size, count, within, .. } = self;
        let even = 1e3 * self.even();
        let says = format!(
            "the stamps come in bursts: {size} readings within {:.2} ms every {:.1} ms ({}). They are of when readings arrived, not \
             of when they were taken: about {even:.2} ms apart, and nobody knows which rate belongs to which time. Use the sensor's \
             own clock or its data-ready signal, or count the samples ({even:.2} ms each) where none is lost",
            1e3 * within * (size - 1) as f64,
            1e3 * period,
            counted(count, "reading")
        );
        report.add(FaultKind::BurstTimestamps, count as u64, Some(t), says);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_at_once_are_a_burst_and_so_are_two() {
        let eight: Vec<f64> =
            (0..4000).map(|k| if k % 8 == 7 { 0.039 + 1e-3 * f64::from(k % 3) } else { 1.2e-4 }).collect();
        let bursts = Bursts::of(&eight).unwrap();
        assert!(bursts.size == 8 && (bursts.period - 0.0408).abs() < 2e-3, "{}", bursts.period);
        let two: Vec<f64> = (0..4000).map(|k| if k % 2 == 1 { 0.018 } else { 0.002 }).collect();
        assert_eq!(Bursts::of(&two).map(|bursts| bursts.size), Some(2));
        let many: Vec<f64> = (0..9000).map(|k| if k % 32 == 31 { 0.0317 } else { 1e-5 }).collect();
        assert_eq!(Bursts::of(&many).map(|bursts| bursts.size), Some(32));
    }

    #[test]
    fn jitter_gaps_and_random_arrivals_are_none() {
        let jitter = |k: u32| 0.01 * (0.5 + f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 16.8e6);
        assert!(Bursts::of(&(0..4000).map(jitter).collect::<Vec<f64>>()).is_none());
        let gaps = (0..4000).map(|k| if k % 50 == 7 { 0.2 } else { 0.01 });
        assert!(Bursts::of(&gaps.collect::<Vec<f64>>()).is_none());
        let parts = (0..4000).map(|k| if k % 50 == 49 { 1.0 } else { 0.01 });
        assert!(Bursts::of(&parts.collect::<Vec<f64>>()).is_none());
        let random = |k: u32| -0.01 * (f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 16.8e6).max(1e-6).ln();
        assert!(Bursts::of(&(0..4000).map(random).collect::<Vec<f64>>()).is_none());
    }
}
