//! A compensated rate as `sensor_msgs/msg/Imu`, in CDR.

/// Bytes of a row of the rate, as docs/feed.md lays it out.
pub const ROW: usize = 136;

/// Variance of an axis that nobody measures, (rad/s)²: none that a filter would go by.
const NOT_MEASURED: f64 = 1e6;

/// What a row of the rate says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// When it held, ns of `CLOCK_MONOTONIC`.
    pub valid_clock_ns: u64,
    /// rad/s; 0 where the axis is not present.
    pub rate: [f64; 3],
    /// Its standard deviation, rad/s; negative where the axis is not present.
    pub std: [f64; 3],
}

impl Reading {
    /// From a row's bytes; `None` where it is none of this version, or the last one, which has no rate.
    pub fn from_row(row: &[u8; ROW]) -> Option<Self> {
        const END: u16 = 2;
        const PRESENT: u8 = 1;
        let eight = |at: usize| <[u8; 8]>::try_from(&row[at..at + 8]).expect("eight bytes");
        let real = |at: usize| f64::from_le_bytes(eight(at));
        let flags = u16::from_le_bytes([row[6], row[7]]);
        if row[..6] != *b"TRTR\x01\0" || flags & END != 0 {
            return None;
        }
        let present = |axis: usize| row[120 + 4 * axis] & PRESENT != 0;
        Some(Self {
            valid_clock_ns: u64::from_le_bytes(eight(24)),
            rate: std::array::from_fn(|axis| real(48 + 8 * axis)),
            std: std::array::from_fn(|axis| if present(axis) { real(72 + 8 * axis) } else { -1.0 }),
        })
    }

    /// The message, stamped ns since 1970. Its orientation and acceleration are not known: the first element of their covariance is −1, as
    /// ROS has it. So is the angular velocity's, where no axis is present.
    pub fn to_cdr(self, stamp_ns: u64, frame: &str) -> Vec<u8> {
        // Plain CDR, little-endian. Numbers lie at multiples of their size from here.
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(((stamp_ns / 1_000_000_000) as i32).to_le_bytes());
        bytes.extend(((stamp_ns % 1_000_000_000) as u32).to_le_bytes());
        bytes.extend((frame.len() as u32 + 1).to_le_bytes());
        bytes.extend(frame.as_bytes());
        bytes.push(0);
        while (bytes.len() - 4) % 8 != 0 {
            bytes.push(0);
        }
        let unknown = |k: usize| if k == 0 { -1.0 } else { 0.0 };
        let orientation = [0.0, 0.0, 0.0, 1.0];
        let any = self.std.iter().any(|std| *std >= 0.0);
        let variance = |k: usize| match k % 4 {
            _ if !any => unknown(k),
            0 if self.std[k / 4] < 0.0 => NOT_MEASURED,
            0 => self.std[k / 4].powi(2),
            _ => 0.0,
        };
        let numbers = orientation
            .into_iter()
            .chain((0..9).map(unknown))
            .chain(self.rate)
            .chain((0..9).map(variance))
            .chain([0.0; 3])
            .chain((0..9).map(unknown));
        for number in numbers {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_becomes_a_message() {
        let mut row = [0; ROW];
        row[..6].copy_from_slice(b"TRTR\x01\0");
        row[24..32].copy_from_slice(&5_u64.to_le_bytes());
        row[64..72].copy_from_slice(&0.25_f64.to_le_bytes());
        row[88..96].copy_from_slice(&0.5_f64.to_le_bytes());
        row[128] = 1;
        let rate = Reading::from_row(&row).unwrap();
        assert_eq!(rate, Reading { valid_clock_ns: 5, rate: [0.0, 0.0, 0.25], std: [-1.0, -1.0, 0.5] });
        let message = rate.to_cdr(1_500_000_007, "imu");
        // 4 of the encapsulation, 8 of the stamp, 4 + 4 of the frame, 37 numbers.
        assert_eq!(message.len(), 4 + 8 + 8 + 37 * 8);
        let number = |k: usize| f64::from_le_bytes(message[20 + 8 * k..28 + 8 * k].try_into().unwrap());
        assert_eq!((number(4), number(15), number(16), number(24), number(28)), (-1.0, 0.25, NOT_MEASURED, 0.25, -1.0));
        row[6] = 2;
        assert_eq!(Reading::from_row(&row), None);
    }
}
