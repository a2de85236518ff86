//! Latencies of one stage, in buckets of a 32nd of an octave.

use crate::Text;
use iceoryx2::prelude::ZeroCopySend;

/// Buckets of an octave, and the octave from which on there are so many: what is shorter has a bucket for each ns.
const STEPS: u64 = 32;
const FIRST: u32 = STEPS.ilog2();
/// Octaves that are told apart: up to 34 s.
const OCTAVES: u32 = 35;
const BUCKETS: usize = (OCTAVES - FIRST + 1) as usize * STEPS as usize;

/// How long a stage took, counted; a quantile is right to half a bucket, 1.6 %.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[type_name("truerate.Histogram.v2")]
pub struct Histogram {
    /// `A-to-B` for a hop, a service's name for its own work.
    pub stage: Text<46>,
    /// Values in all.
    pub count: u64,
    /// The largest, ns.
    pub max_ns: u64,
    /// Bucket n counts n ns below 32; bucket `32 (o - 4) + s` what lies in the `s`th 32nd of `[2^o, 2^(o+1))` ns.
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
        let bucket = match ns.checked_ilog2() {
            Some(octave) if octave >= FIRST => u64::from(octave - FIRST + 1) * STEPS + (ns >> (octave - FIRST)) % STEPS,
            _ => ns,
        };
        let bucket = (bucket as usize).min(BUCKETS - 1);
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
                let (first, width) = edge(bucket);
                return (first + width / 2).min(self.max_ns);
            }
        }
        0
    }

    /// Counts by octave, from the shortest: the lower edge, ns, and how many lie below twice that. What took less than 1 ns is counted
    /// with the first.
    #[must_use]
    pub fn octaves(&self) -> Vec<(u64, u64)> {
        let mut octaves: Vec<(u64, u64)> = (0..OCTAVES).map(|octave| (1 << octave, 0)).collect();
        for (bucket, &n) in self.buckets.iter().enumerate() {
            octaves[edge(bucket).0.max(1).ilog2() as usize].1 += u64::from(n);
        }
        octaves
    }
}

/// The lower edge of a bucket and its width, ns.
fn edge(bucket: usize) -> (u64, u64) {
    let (octave, step) = (bucket as u64 / STEPS, bucket as u64 % STEPS);
    let width = 1 << octave.saturating_sub(1);
    (if octave == 0 { step } else { (STEPS + step) * width }, width)
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
        for q in [0.0001, 0.0003, 0.01, 0.5, 0.99, 0.999, 0.9999] {
            let (got, true_value) = (h.quantile(q) as f64, q * 1e5);
            assert!((got / true_value - 1.0).abs() < 0.017, "{q}: {got} for {true_value}");
        }
        assert_eq!((h.count, h.max_ns), (100_000, 100_000));
        h.record(u64::MAX);
        assert_eq!(h.max_ns, u64::MAX);
        assert_eq!(Histogram::new("").quantile(0.5), 0);
    }

    #[test]
    fn octaves_hold_every_value_where_it_lies() {
        let mut histogram = Histogram::new("kalman");
        let values = [0, 1, 31, 32, 33, 1000, 1024, 1_000_000_000, 30_000_000_000];
        for ns in values {
            histogram.record(ns);
        }
        let octaves = histogram.octaves();
        for (edge, count) in &octaves {
            let own = values.iter().filter(|&&ns| ns.max(1) >= *edge && ns.max(1) < 2 * edge).count();
            assert_eq!(*count, own as u64, "from {edge} ns");
        }
        assert_eq!(octaves.iter().map(|octave| octave.1).sum::<u64>(), histogram.count);
    }
}
