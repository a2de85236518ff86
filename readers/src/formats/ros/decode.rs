//! One ROS message: its bytes taken step by step.

use super::definition::{Program, Step};
use crate::formats::primitive::Kind;

/// How a message lies in its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wire {
    /// ROS 2: four bytes that say the byte order, then numbers at multiples of their size.
    Cdr,
    /// ROS 1: one after the other.
    Ros1,
}

/// What a message held.
#[derive(Clone, Debug, Default)]
pub struct Message {
    /// Its own time, where it has one that is not zero, ns.
    pub stamp_ns: Option<i64>,
    /// The numbers of the program's fields, then those of named sequences.
    pub values: Vec<f64>,
    /// Names of the latter.
    pub named: Vec<String>,
    /// What tells this part of the topic from others.
    pub key: String,
    names: Vec<String>,
}

/// Elements of a sequence that are named, at most.
const MOST_NAMES: usize = 256;
/// Steps through one message, at most: so many a byte, and so many beside. Elements of a sequence may take no bytes.
const STEPS_A_BYTE: usize = 4;
const STEPS_BESIDE: usize = 4096;

/// The place in a message's bytes.
pub struct Reading<'a> {
    bytes: &'a [u8],
    at: usize,
    wire: Wire,
    big_endian: bool,
    /// Steps that may follow.
    steps: usize,
}

impl<'a> Reading<'a> {
    /// From the message's first byte on; `None` where it is shorter than its head.
    pub fn new(bytes: &'a [u8], wire: Wire) -> Option<Self> {
        let (bytes, big_endian) = match wire {
            Wire::Cdr => (bytes.get(4..)?, bytes[1] & 1 == 0),
            Wire::Ros1 => (bytes, false),
        };
        let steps = STEPS_A_BYTE.saturating_mul(bytes.len()).saturating_add(STEPS_BESIDE);
        Some(Self { bytes, at: 0, wire, big_endian, steps })
    }

    /// Runs a program; `None` where the bytes end before it does.
    pub fn run(&mut self, program: &Program, message: &mut Message) -> Option<()> {
        message.stamp_ns = None;
        message.values.clear();
        message.named.clear();
        message.names.clear();
        message.key.clear();
        self.steps = self.steps.checked_sub(1)?;
        self.all(&program.steps, message)
    }

    fn all(&mut self, steps: &[Step], message: &mut Message) -> Option<()> {
        for step in steps {
            self.steps = self.steps.checked_sub(1)?;
            match step {
                Step::Number(kind) => message.values.push(self.number(*kind)?),
                Step::Pass(kind) => _ = self.number(*kind)?,
                Step::Stamp => {
                    let (seconds, ns) = (self.number(Kind::U32)?, self.number(Kind::U32)?);
                    let stamp = seconds as i64 * 1_000_000_000 + ns as i64;
                    message.stamp_ns = (stamp > 0).then_some(stamp);
                }
                Step::Text => _ = self.text()?,
                Step::Key => {
                    let text = self.text()?;
                    message.key = String::from_utf8_lossy(text).into_owned();
                }
                Step::Names => {
                    for _ in 0..self.count()? {
                        let text = self.text()?;
                        if message.names.len() < MOST_NAMES {
                            message.names.push(String::from_utf8_lossy(text).into_owned());
                        }
                    }
                }
                Step::Named(path, kind) => {
                    for i in 0..self.count()? {
                        let value = self.number(*kind)?;
                        if let Some(name) = message.names.get(i as usize) {
                            message.values.push(value);
                            message.named.push(format!("{path}.{name}"));
                        }
                    }
                }
                Step::Repeat(count, steps) => self.repeat(*count, steps, message)?,
            }
        }
        Some(())
    }

    fn repeat(&mut self, count: Option<usize>, steps: &[Step], message: &mut Message) -> Option<()> {
        let count = match count {
            Some(count) => count,
            None => self.count()? as usize,
        };
        // Pictures and scans are passed by at once.
        if let [Step::Pass(kind)] = steps {
            if count > 0 {
                self.align(kind.size());
                self.skip(count.checked_mul(kind.size())?)?;
            }
            return Some(());
        }
        if steps.is_empty() {
            return Some(());
        }
        for _ in 0..count {
            self.all(steps, message)?;
        }
        Some(())
    }

    /// The count of a sequence.
    pub fn count(&mut self) -> Option<u32> {
        self.number(Kind::U32).map(|count| count as u32)
    }

    fn number(&mut self, kind: Kind) -> Option<f64> {
        self.align(kind.size());
        let at = self.at;
        self.skip(kind.size())?;
        Some(kind.read(self.bytes, at, self.big_endian))
    }

    fn text(&mut self) -> Option<&'a [u8]> {
        let length = self.count()? as usize;
        let from = self.at;
        self.skip(length)?;
        let text = &self.bytes[from..self.at];
        Some(text.strip_suffix(b"\0").unwrap_or(text))
    }

    fn align(&mut self, size: usize) {
        if self.wire == Wire::Cdr {
            self.at = self.at.next_multiple_of(size);
        }
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.at = self.at.checked_add(count).filter(|end| *end <= self.bytes.len())?;
        Some(())
    }
}
