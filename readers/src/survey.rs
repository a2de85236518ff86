//! What a file holds, channel by channel, without keeping its messages.

use crate::format::{Note, Sink, Topic};
use std::collections::BTreeMap;

/// Steps from message to message that are looked at for the usual one.
const STEPS: usize = 1001;
/// A gap is longer than so many usual steps.
const GAP: i64 = 3;
/// What a log says of its device is kept up to so many bytes each, and so many of them.
const LONGEST_SAID: usize = 100;
const MOST_SAID: usize = 20;

/// Takes everything and keeps what counts.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// The topics, in order.
    pub topics: Vec<Surveyed>,
    /// What the reader noted.
    pub notes: Vec<Note>,
    /// What the log says of the vehicle, the board or the sensor.
    pub said: BTreeMap<String, String>,
}

/// One topic.
#[derive(Clone, Debug)]
pub struct Surveyed {
    /// Its name and fields.
    pub topic: Topic,
    /// Its messages.
    pub messages: u64,
    /// Time of the first, and of the latest, ns.
    pub first_ns: i64,
    /// Latest time, ns.
    pub last_ns: i64,
    /// Times that go back or repeat.
    pub back: u64,
    /// What each field holds.
    pub fields: Vec<Range>,
    steps: Vec<i64>,
    usual: Option<i64>,
    gaps: (u64, i64),
}

/// The values of one field.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// Values that are numbers.
    pub values: u64,
    /// The smallest; infinite where there is none.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Surveyed {
    /// Messages a second, in the mean.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        let span = self.last_ns.saturating_sub(self.first_ns) as f64 / 1e9;
        (self.messages > 1 && span > 0.0).then(|| (self.messages - 1) as f64 / span)
    }

    /// Values of a field a second, in the mean.
    #[must_use]
    pub fn rate_of(&self, field: &Range) -> Option<f64> {
        Some(self.rate_hz()? * field.values as f64 / self.messages as f64)
    }

    /// Gaps of more than three usual steps: how many, and the longest, ns.
    #[must_use]
    pub fn gaps(&self) -> (u64, i64) {
        if self.usual.is_some() {
            return self.gaps;
        }
        let usual = usual(&self.steps);
        self.steps.iter().fold((0, 0), |gaps, step| counted(gaps, *step, usual))
    }

    fn step(&mut self, step: i64) {
        if let Some(usual) = self.usual {
            self.gaps = counted(self.gaps, step, usual);
            return;
        }
        self.steps.push(step);
        if self.steps.len() == STEPS {
            let usual = usual(&self.steps);
            self.gaps = self.steps.iter().fold((0, 0), |gaps, step| counted(gaps, *step, usual));
            self.usual = Some(usual);
            self.steps = Vec::new();
        }
    }
}

fn usual(steps: &[i64]) -> i64 {
    let mut steps = steps.to_vec();
    let middle = steps.len() / 2;
    if steps.is_empty() { i64::MAX } else { *steps.select_nth_unstable(middle).1 }
}

fn counted((count, longest): (u64, i64), step: i64, usual: i64) -> (u64, i64) {
    if step > usual.max(1).saturating_mul(GAP) { (count + 1, longest.max(step)) } else { (count, longest) }
}

impl Sink for Survey {
    fn topic(&mut self, topic: &Topic) -> bool {
        let none = Range { values: 0, low: f64::INFINITY, high: f64::NEG_INFINITY };
        self.topics.push(Surveyed {
            topic: topic.clone(),
            messages: 0,
            first_ns: 0,
            last_ns: 0,
            back: 0,
            fields: vec![none; topic.fields.len()],
            steps: Vec::new(),
            usual: None,
            gaps: (0, 0),
        });
        true
    }

    fn message(&mut self, topic: usize, time_ns: i64, values: &[f64]) {
        let Some(of) = self.topics.get_mut(topic) else { return };
        if of.messages == 0 {
            (of.first_ns, of.last_ns) = (time_ns, time_ns);
        } else if time_ns > of.last_ns {
            of.step(time_ns.saturating_sub(of.last_ns));
            of.last_ns = time_ns;
        } else {
            of.back += 1;
        }
        of.messages += 1;
        for (range, &value) in of.fields.iter_mut().zip(values) {
            if value.is_finite() {
                range.values += 1;
                range.low = range.low.min(value);
                range.high = range.high.max(value);
            }
        }
    }

    fn note(&mut self, note: Note) {
        self.notes.push(note);
    }

    fn said(&mut self, key: &str, value: &str) {
        if !value.is_empty() && value.len() <= LONGEST_SAID && self.said.len() < MOST_SAID {
            self.said.entry(key.to_owned()).or_insert_with(|| value.to_owned());
        }
    }
}
