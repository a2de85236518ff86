//! Numbers of fixed size, as all binary formats have them.

/// The kinds of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Signed, 1 byte.
    I8,
    /// Unsigned, 1 byte.
    U8,
    /// Signed, 2 bytes.
    I16,
    /// Unsigned, 2 bytes.
    U16,
    /// Signed, 4 bytes.
    I32,
    /// Unsigned, 4 bytes.
    U32,
    /// Signed, 8 bytes.
    I64,
    /// Unsigned, 8 bytes.
    U64,
    /// Floating, 4 bytes.
    F32,
    /// Floating, 8 bytes.
    F64,
}

impl Kind {
    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number that begins at a place, little-endian unless told; NaN where the bytes end before it does.
    pub fn read(self, bytes: &[u8], at: usize, big_endian: bool) -> f64 {
        let Some(found) = at.checked_add(self.size()).and_then(|end| bytes.get(at..end)) else { return f64::NAN };
        let mut raw = [0; 8];
        raw[..found.len()].copy_from_slice(found);
        if big_endian {
            raw[..found.len()].reverse();
        }
        let [a, b, c, d, ..] = raw;
        match self {
            Self::I8 => f64::from(a.cast_signed()),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::I64 => i64::from_le_bytes(raw) as f64,
            Self::U64 => u64::from_le_bytes(raw) as f64,
            Self::F64 => f64::from_le_bytes(raw),
        }
    }
}

/// A number of a message: where it stands, and what it is multiplied by.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// Bytes from the message's beginning.
    pub at: usize,
    /// What it is.
    pub kind: Kind,
    /// Times this.
    pub scale: f64,
}

/// Reads all numbers of a message.
pub fn read_all(numbers: &[Number], bytes: &[u8], values: &mut Vec<f64>) {
    values.clear();
    values.extend(numbers.iter().map(|n| n.kind.read(bytes, n.at, false) * n.scale));
}
