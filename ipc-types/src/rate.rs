//! kalman → the vehicle: the rate, as `docs/feed.md` lays it out for programs that know nothing of this one.
//!
//! The layout is a promise: what changes it changes [`VERSION`].

/// Version of rows and ring.
pub const VERSION: u16 = 1;
/// Bytes of a row.
pub const ROW: usize = 136;
/// What a row begins with.
pub const ROW_MAGIC: [u8; 4] = *b"TRTR";

/// [`RateRow::flags`]: the parameters are old, because the compensator is silent.
pub const STALE: u16 = 1;
/// [`RateRow::flags`]: the source has ended; there is no rate in this row.
pub const END: u16 = 1 << 1;

/// [`RateRow::axis_flags`]: this axis has a rate.
pub const PRESENT: u32 = 1;
/// [`RateRow::axis_flags`]: there was no reading; the rate is held.
pub const HELD: u32 = 1 << 1;
/// [`RateRow::axis_flags`]: the reading said nothing (dead zone, saturation); the filter did without it.
pub const LOST: u32 = 1 << 2;
/// [`RateRow::axis_flags`]: the reading lay too far off and was left out.
pub const OUTLIER: u32 = 1 << 3;
/// [`RateRow::axis_flags`]: the filter started again from this reading.
pub const RESTARTED: u32 = 1 << 4;
/// [`RateRow::axis_flags`]: a reference contradicts what was known of bias and scale error; both are found again.
pub const CHANGED: u32 = 1 << 5;

/// What a ring begins with.
pub const RING_MAGIC: [u8; 8] = *b"truerate";
/// Bytes before a ring's first slot.
pub const RING_HEAD: usize = 128;
/// Slots of a ring: rows of an eighth of a second at 8 kHz.
pub const RING_SLOTS: usize = 1024;
/// Bytes of a slot: its row's number, and the row.
pub const RING_SLOT: usize = 8 + ROW;
/// Bytes of a ring.
pub const RING: usize = RING_HEAD + RING_SLOTS * RING_SLOT;
/// Where a ring's words lie.
pub mod ring_at {
    /// Magic, 8 bytes.
    pub const MAGIC: usize = 0;
    /// Version, u32.
    pub const VERSION: usize = 8;
    /// Bytes of a row, u32.
    pub const ROW: usize = 12;
    /// Slots, u32.
    pub const SLOTS: usize = 16;
    /// Bytes before the first slot, u32.
    pub const HEAD: usize = 20;
    /// The run, u64.
    pub const RUN: usize = 24;
    /// 1 while the pipeline runs, 2 when it has ended, u32.
    pub const STATE: usize = 32;
    /// Changes with every row, u32: a futex.
    pub const WAKE: usize = 36;
    /// Rows written, u64.
    pub const WRITTEN: usize = 40;
}

/// The rate at one instant. Values of an axis that is not present are 0; nothing is ever infinite or NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateRow {
    /// [`STALE`], [`END`].
    pub flags: u16,
    /// The sample's number.
    pub sequence: u64,
    /// When the rate held, ns from the source's first row.
    pub valid_ns: i64,
    /// The same on `CLOCK_MONOTONIC` of this machine, as far as the arrivals of the last seconds tell, ns; the time that a row waited
    /// in a queue is not added.
    pub valid_clock_ns: u64,
    /// When this row was given, ns of `CLOCK_MONOTONIC`.
    pub given_ns: u64,
    /// Epoch of the parameters.
    pub epoch: u64,
    /// Compensated and filtered, rad/s.
    pub rate: [f64; 3],
    /// Its standard deviation, rad/s.
    pub rate_std: [f64; 3],
    /// Compensated only, rad/s.
    pub rate_compensated: [f64; 3],
    /// [`PRESENT`] and the others, axis by axis.
    pub axis_flags: [u32; 3],
}

impl RateRow {
    /// As bytes, little-endian.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; ROW] {
        let mut bytes = [0; ROW];
        let mut at = 0;
        let mut put = |part: &[u8]| {
            bytes[at..at + part.len()].copy_from_slice(part);
            at += part.len();
        };
        put(&ROW_MAGIC);
        put(&VERSION.to_le_bytes());
        put(&self.flags.to_le_bytes());
        put(&self.sequence.to_le_bytes());
        put(&self.valid_ns.to_le_bytes());
        put(&self.valid_clock_ns.to_le_bytes());
        put(&self.given_ns.to_le_bytes());
        put(&self.epoch.to_le_bytes());
        for value in self.rate.iter().chain(&self.rate_std).chain(&self.rate_compensated) {
            put(&value.to_le_bytes());
        }
        for flags in self.axis_flags {
            put(&flags.to_le_bytes());
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::{ROW, RateRow};

    #[test]
    fn a_row_has_its_values_where_the_documents_say() {
        let row = RateRow {
            flags: 1,
            sequence: 2,
            valid_ns: -3,
            valid_clock_ns: 4,
            given_ns: 5,
            epoch: 6,
            rate: [1.0, 2.0, 3.0],
            rate_std: [4.0, 5.0, 6.0],
            rate_compensated: [7.0, 8.0, 9.0],
            axis_flags: [1, 2, 3],
        };
        let bytes = row.to_bytes();
        assert_eq!((&bytes[..8], bytes.len()), (&b"TRTR\x01\0\x01\0"[..], ROW));
        assert_eq!(bytes[16..24], (-3_i64).to_le_bytes());
        assert_eq!(bytes[48..56], 1.0_f64.to_le_bytes());
        assert_eq!(bytes[112..120], 9.0_f64.to_le_bytes());
        assert_eq!(bytes[120..132], [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
    }
}
