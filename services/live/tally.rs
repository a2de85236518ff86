//! What a live source gave that was no good: counted by kind, each kind told once.

use ipc_types::health::SourceHealth;

/// Kinds of what is no good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Text where a number should be, a checksum that does not fit.
    Garbled,
    /// Fields or bytes are missing, or too many.
    Cut,
    /// Text between the rows: boot messages, a header again.
    Remark,
    /// A value that is infinite or impossible: no value there.
    Value,
    /// No time, or one that repeats, goes back, or jumps ahead and back.
    Time,
}

/// Counts.
#[derive(Debug, Default)]
pub struct Tally {
    /// As all others see them.
    pub counts: SourceHealth,
    told: [bool; 5],
    told_segment: bool,
    told_mark: bool,
}

impl Tally {
    /// One more of a kind; the first is told with what it was.
    pub fn add(&mut self, fault: Fault, says: &str) {
        let counts = &mut self.counts;
        let (count, what, then) = match fault {
            Fault::Garbled => (&mut counts.garbled, "a garbled row", "left out"),
            Fault::Cut => (&mut counts.cut, "a row of another length", "left out"),
            Fault::Remark => (&mut counts.remarks, "text between the rows", "passed over"),
            Fault::Value => (&mut counts.values, "a value that nothing physical has", "taken as no value"),
            Fault::Time => (&mut counts.times, "a row without a time of its own that is new", "left out"),
        };
        *count += 1;
        if !std::mem::replace(&mut self.told[fault as usize], true) {
            tracing::warn!("the source gives {what}: {then}; more of them are only counted ({says})");
        }
    }

    /// Readings that stand for none, in a row at this time of the source's own clock.
    pub fn mark(&mut self, readings: u32, own_ns: i128) {
        self.counts.left_out += u64::from(readings);
        if !std::mem::replace(&mut self.told_mark, true) {
            let t = own_ns as f64 / 1e9;
            tracing::warn!(
                "the source gives a reading far from those beside it, as where a read failed: it is not a reading and is left out; more of them \
                 are only counted (at {t:.3} s of its clock)"
            );
        }
    }

    /// The source's clock began again or jumped.
    pub fn begin_segment(&mut self, says: &str) {
        self.counts.segments += 1;
        if !std::mem::replace(&mut self.told_segment, true) {
            tracing::warn!("{says}: what follows is kept apart from what came before; further times are only counted");
        }
    }
}
