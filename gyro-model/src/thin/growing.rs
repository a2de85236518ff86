//! Means of a stream that grows at its end and loses what is old: what was averaged once is not averaged again.

use super::{Manner, besides, means, thinned, walks_of};
use crate::{
    Record,
    evidence::encoder::Encoder,
    record::{Means, Turned, Walk},
};
use std::collections::VecDeque;

/// Rows that are averaged together for good, once they are all there.
const CHUNK: usize = 16_384;
/// Means of the longest stream, about.
const MEANS: usize = 40_000;
/// Blocks that a chunk begins before the end of the one before it: neither has a whole block there.
const OVERLAP: usize = 4;

/// See the module's head.
#[derive(Clone, Debug)]
pub struct Growing {
    /// Rows of a block at least.
    block: usize,
    manner: Option<Manner>,
    chunks: VecDeque<Chunk>,
}

/// Means of one chunk, as far as the next one begins.
#[derive(Clone, Debug)]
struct Chunk {
    /// Where the next one begins, and how far all has turned by then.
    next_ns: i64,
    turned: Turned,
    means: Record,
}

impl Growing {
    /// For a stream of which at most `limit` rows are kept.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self { block: limit.div_ceil(MEANS), manner: None, chunks: VecDeque::new() }
    }

    /// At most about `most` rows, as [`thinned`] has them, of a record that is the one of the last time, or has grown since
    /// or lost its oldest rows.
    #[must_use]
    pub fn thinned(&mut self, record: &Record, most: usize) -> Record {
        if self.block < 2 || record.len() < self.block * most.max(CHUNK / self.block) {
            return thinned(record, most);
        }
        self.follow(record);
        match &self.manner {
            Some(manner) => thinned(&self.joined(record, manner), most),
            None => thinned(record, most),
        }
    }

    /// Averages the chunks that are complete, all of them anew where the log is to be averaged otherwise than so far.
    fn follow(&mut self, record: &Record) {
        let (first, last) = (record.rows[0].t_ns, record.rows[record.len() - 1].t_ns);
        self.chunks.retain(|chunk| chunk.next_ns > first && chunk.next_ns <= last);
        if self.chunks.is_empty() {
            self.manner = None;
        }
        while self.begins(record) + CHUNK <= record.len() {
            let manner = Manner::of(record);
            if manner != self.manner {
                self.chunks.clear();
                self.manner = manner;
            }
            let Some(manner) = &self.manner else { return };
            let begins = self.begins(record);
            let chunk = record.part(begins..begins + CHUNK);
            let besides = besides(&chunk, &manner.axes);
            let mut means = means(&chunk, &besides, self.block, manner);
            means.means.steps = Some(Encoder::steps(&chunk));
            means.means.walk = walks_of(&chunk, &manner.axes);
            let next = CHUNK - self.overlap(record);
            self.chunks.push_back(Chunk { next_ns: chunk.rows[next].t_ns, turned: besides[next].turned, means });
        }
    }

    /// The first row that is in no chunk.
    fn begins(&self, record: &Record) -> usize {
        self.chunks.back().map_or(0, |chunk| record.rows.partition_point(|row| row.t_ns < chunk.next_ns))
    }

    fn overlap(&self, record: &Record) -> usize {
        let references = record.rows.iter().take(CHUNK).filter(|row| super::is_referenced(row)).count().max(1);
        (OVERLAP * self.block.max(CHUNK.div_ceil(references))).min(CHUNK / 2)
    }

    /// The chunks' means and those of what has come since, one after the other.
    fn joined(&self, record: &Record, manner: &Manner) -> Record {
        let rest = record.part(self.begins(record)..record.len());
        let rest = means(&rest, &besides(&rest, &manner.axes), self.block, manner);
        let mut joined = Record { means: self.known(rest.means), ..rest.clone() };
        joined.rows.clear();
        joined.turned.clear();
        let mut offset = Turned::default();
        let chunks = self.chunks.iter().map(|chunk| (&chunk.means, chunk.turned));
        for (means, turned) in chunks.chain(std::iter::once((&rest, Turned::default()))) {
            let after = joined.rows.last().map_or(i64::MIN, |row| row.t_ns);
            let new = means.rows.partition_point(|row| row.t_ns <= after);
            joined.rows.extend_from_slice(&means.rows[new..]);
            joined.turned.extend(means.turned[new..].iter().map(|turned| offset.and(turned)));
            offset = offset.and(&turned);
        }
        joined
    }

    /// What the chunks say of the log at its full rate: the median of the noises; the smallest step, for a chunk in which
    /// the shaft hardly turns may show several of them as one.
    fn known(&self, means: Means) -> Means {
        let each = || self.chunks.iter().map(|chunk| chunk.means.means);
        let median = |of: &dyn Fn(&Means) -> f64| {
            let mut sorted: Vec<f64> = each().map(|means| of(&means)).filter(|value| value.is_finite()).collect();
            sorted.sort_by(f64::total_cmp);
            sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let steps =
            |i: usize| each().filter_map(|means| means.steps).map(move |steps| steps[i]).filter(|step| *step > 0.0);
        Means {
            steps: Some(std::array::from_fn(|i| steps(i).reduce(f64::min).unwrap_or(0.0))),
            walk: std::array::from_fn(|i| Walk {
                gyro: median(&|means| means.walk[i].gyro),
                assumed: 2 * each().filter(|means| means.walk[i].assumed).count() > self.chunks.len(),
                reference: median(&|means| means.walk[i].reference),
            }),
            ..means
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Axis, diagnose,
        simulate::{Motion, Scenario, SensorSpec, simulate},
    };

    /// A stream that is looked at now and then, its oldest rows going, as the whole of it at once.
    #[test]
    fn a_stream_that_grows_is_averaged_as_the_whole_of_it_is() {
        for every in [1, 5] {
            let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
            let sensor = SensorSpec { reference_every: every, ..SensorSpec::default() };
            let scenario = Scenario { motion, seconds: 150.0, rate_hz: 1000.0, sensor, ..Scenario::default() };
            let simulated = simulate(&scenario);
            let mut growing = Growing::new(320_000);
            let mut stream = Record::default();
            for (k, row) in simulated.record.rows.iter().enumerate() {
                stream.rows.push(*row);
                if k % 7_001 == 0 {
                    let _ = growing.thinned(&stream, 2000);
                }
                if k == 60_000 {
                    stream.rows.drain(..20_000);
                }
            }
            let thin = growing.thinned(&stream, 3000);
            assert!(!growing.chunks.is_empty());
            let whole = thinned(&stream, 3000);
            assert!(thin.len().abs_diff(whole.len()) < 300, "{} and {}", thin.len(), whole.len());
            let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
            let [a, b] = [&thin, &whole].map(|record| {
                let judged = diagnose::compare(record, &simulated.truth, &[Axis::X], &options).unwrap();
                judged[0].error_over_floor.unwrap()
            });
            assert!((a / b - 1.0).abs() < 0.15 && a < 1.4, "every {every}: {a} over the floor, {b} of the whole");
            let walks = [&thin, &whole].map(|record| record.means.walk[0].gyro);
            assert!((walks[0] / walks[1] - 1.0).abs() < 0.1, "{walks:?}");
            let steps = [&thin, &whole].map(|record| record.means.steps.unwrap()[0]);
            assert!((steps[0] / steps[1] - 1.0).abs() < 0.01, "{steps:?}");
            // What was averaged before is there still.
            assert!(thin.rows[0].t_ns < stream.rows[0].t_ns + 100_000_000);
        }
    }

    #[test]
    fn what_is_forgotten_is_forgotten() {
        let motion = Motion::Multisine { travel: 6.0 };
        let all = simulate(&Scenario { motion, seconds: 140.0, rate_hz: 1000.0, ..Scenario::default() }).record;
        let mut growing = Growing::new(320_000);
        let _ = growing.thinned(&all.part(0..60_000), 2000);
        assert!(!growing.chunks.is_empty());
        let new = all.part(60_000..all.len());
        let (first, from) = (growing.thinned(&new, 2000).rows[0].t_ns, new.rows[0].t_ns);
        assert!((from..from + 100_000_000).contains(&first), "{first}, from {from}");
        assert!(growing.chunks.iter().all(|chunk| chunk.next_ns > new.rows[0].t_ns));
    }
}
