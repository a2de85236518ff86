//! The bits of one signal in a frame.

/// How the bits are a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// A whole number from 0 on.
    Unsigned,
    /// Two's complement.
    Signed,
    /// IEEE 754, 32 bits.
    Single,
    /// IEEE 754, 64 bits.
    Double,
}

/// A signal: value = factor × number + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Its name within the message.
    pub name: String,
    /// The bit where it begins: the lowest one of a little-endian signal, the highest one of a big-endian signal. Bit 0 is
    /// the lowest of byte 0, bit 8 the lowest of byte 1.
    pub start: u16,
    /// Bits, 1 to 64.
    pub length: u16,
    /// Whether the bytes of higher weight come first (Motorola).
    pub big_endian: bool,
    /// How the bits are a number.
    pub coding: Coding,
    /// Value of one step.
    pub factor: f64,
    /// Value of the number 0.
    pub offset: f64,
    /// The unit as the file writes it.
    pub unit: String,
    /// Where it is in some of the frames only: which signal of the message says in which, and the numbers at which it is
    /// there, both ends included.
    pub when: Option<(usize, Vec<(u64, u64)>)>,
}

impl Signal {
    /// The number that the bits are, unsigned; `None` where the frame ends before them.
    #[must_use]
    pub fn raw(&self, data: &[u8]) -> Option<u64> {
        let bit = |at: usize| data.get(at / 8).map(|byte| u64::from(byte >> (at % 8) & 1));
        let (start, length) = (usize::from(self.start), usize::from(self.length));
        if self.big_endian {
            // Downwards within a byte, then from the highest bit of the next.
            let first = start / 8 * 8 + 7 - start % 8;
            (first..first + length).try_fold(0, |raw, k| Some(raw << 1 | bit(k / 8 * 8 + 7 - k % 8)?))
        } else {
            (start..start + length).rev().try_fold(0, |raw, at| Some(raw << 1 | bit(at)?))
        }
    }

    /// The value that a number means.
    #[must_use]
    pub fn value(&self, raw: u64) -> f64 {
        let number = match self.coding {
            Coding::Unsigned => raw as f64,
            Coding::Signed => {
                let unused = 64 - u32::from(self.length).clamp(1, 64);
                ((raw << unused).cast_signed() >> unused) as f64
            }
            Coding::Single => f64::from(f32::from_bits(raw as u32)),
            Coding::Double => f64::from_bits(raw),
        };
        self.factor * number + self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(start: u16, length: u16, big_endian: bool, coding: Coding) -> Signal {
        let (name, unit) = (String::new(), String::new());
        Signal { name, start, length, big_endian, coding, factor: 1.0, offset: 0.0, unit, when: None }
    }

    #[test]
    fn bits_of_both_byte_orders_are_found_where_they_are_put() {
        let data = [0x12, 0x34, 0x56, 0x78];
        for (start, length, big_endian, wanted) in [
            (0, 8, false, 0x12),
            (0, 16, false, 0x3412),
            (4, 12, false, 0x341),
            (7, 16, true, 0x1234),
            (3, 12, true, 0x234),
            (7, 32, true, 0x1234_5678),
            (13, 5, true, 0b11_010),
        ] {
            let raw = signal(start, length, big_endian, Coding::Unsigned).raw(&data);
            assert_eq!(raw, Some(wanted), "{start}|{length} {big_endian}");
        }
        assert_eq!(signal(24, 9, false, Coding::Unsigned).raw(&data), None);
        assert_eq!(signal(31, 9, true, Coding::Unsigned).raw(&data), None);
        assert_eq!(signal(0, 64, false, Coding::Signed).value(u64::MAX), -1.0);
    }

    #[test]
    fn numbers_have_signs_and_floating_points() {
        assert_eq!(signal(0, 12, false, Coding::Signed).value(0xfff), -1.0);
        assert_eq!(signal(0, 12, false, Coding::Unsigned).value(0xfff), 4095.0);
        assert_eq!(signal(0, 32, false, Coding::Single).value(u64::from((-2.5_f32).to_bits())), -2.5);
        let scaled = Signal { factor: 0.005, offset: -163.84, ..signal(0, 16, false, Coding::Unsigned) };
        assert!((scaled.value(32768) - 0.0).abs() < 1e-12);
    }
}
