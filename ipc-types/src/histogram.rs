//! Latencies of one stage, in buckets of an eighth of an octave.

use crate::Text;
use iceoryx2::prelude::ZeroCopySend;

const STEPS: u32 = 8;
const BUCKETS: usize = 35 * STEPS as usize;

/// How long a stage took, counted; a quantile is right to half a bucket, 6.25 %.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Histogram.v1")]
pub struct Histogram {
    /// `A-to-B` for a hop, a service's name for its own work.
    pub stage: Text<46>,
    /// Values in all.
    pub count: u64,
    /// The largest, ns.
    pub max_ns: u64,
    /// Bucket `8 o + s` counts what lies in the `s`th eighth of `[2^o, 2^(o+1))` ns.
    pub buckets: [u32; BUCKETS],
}

impl Histogram {
    /// Nothing counted yet.
    #[must_use]
    pub fn new(stage: &str) -> Self {
        Self { stage: Text::new(stage), count: 0, max_ns: 0, buckets: [0; BUCKETS] }
    }

    /// Counts one value.
    pub fn record(&mut self, ns: u64) {
        let value = ns.max(1);
        let octave = value.ilog2();
        let step = if octave < 3 { 0 } else { (value >> (octave - 3)) as u32 & (STEPS - 1) };
        let bucket = ((octave * STEPS + step) as usize).min(BUCKETS - 1);
        self.buckets[bucket] = self.buckets[bucket].saturating_add(1);
        self.count += 1;
        self.max_ns = self.max_ns.max(ns);
    }

    /// Adds what another one of the same stage counted.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.max_ns = self.max_ns.max(other.max_ns);
        for (a, b) in self.buckets.iter_mut().zip(&other.buckets) {
            *a = a.saturating_add(*b);
        }
    }

    /// The value below which the share `q` lies, ns; 0 where nothing was counted.
    #[must_use]
    pub fn quantile(&self, q: f64) -> u64 {
        let wanted = (q * self.count as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        for (bucket, &n) in self.buckets.iter().enumerate() {
            seen += u64::from(n);
            if seen >= wanted {
                let (octave, step) = (bucket as u32 / STEPS, f64::from(bucket as u32 % STEPS));
                let middle = f64::from(octave).exp2() * (1.0 + (step + 0.5) / f64::from(STEPS));
                return (middle as u64).min(self.max_ns);
            }
        }
        0
    }
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new("")
    }
}

#[cfg(test)]
mod tests {
    use super::Histogram;

    #[test]
    fn quantiles_are_right_to_a_bucket() {
        let mut h = Histogram::new("kalman");
        (1..=100_000).for_each(|ns| h.record(ns));
        for q in [0.01, 0.5, 0.99, 0.999] {
            let (got, true_value) = (h.quantile(q) as f64, q * 1e5);
            assert!((got / true_value - 1.0).abs() < 0.08, "{q}: {got} for {true_value}");
        }
        assert_eq!((h.count, h.max_ns), (100_000, 100_000));
        h.record(u64::MAX);
        assert_eq!(h.max_ns, u64::MAX);
        assert_eq!(Histogram::new("").quantile(0.5), 0);
    }
}
