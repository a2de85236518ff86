//! Binary frames (`docs/feed.md` has the layout): COBS between zeros, a checksum, a number, and a clock.

use super::{Format, Found};
use crate::live::{Content, Fault};
use crc::{CRC_16_IBM_3740, Crc};
use gyro_model::{Axis, Row};

/// CRC-16 with polynomial 0x1021, begun at 0xffff.
const CHECKSUM: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
/// The layout's number.
const VERSION: u8 = 1;
/// Version, flags, number, time, fields.
const HEAD: usize = 1 + 1 + 2 + 8 + 4;
/// A longer frame is none, bytes.
const LONGEST: usize = 254;
/// Flag: the sender has just begun.
const BEGINS: u8 = 1;
/// A larger step of the number is no loss but another beginning.
const MISSABLE: u16 = 1000;

/// Finds rows in frames.
#[derive(Default)]
pub struct Frames {
    coded: Vec<u8>,
    skips: bool,
    /// Whether a zero has been seen: what stands before the first is a part.
    synchronous: bool,
    number: Option<u16>,
    content: Option<Content>,
}

/// Why a frame is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
enum FrameError {
    #[error("{0} bytes are too few")]
    Short(usize),
    #[error("the code is broken")]
    Code,
    #[error("the checksum does not fit")]
    Checksum,
    #[error("version {0}: this program knows {VERSION}")]
    Version(u8),
    #[error("{0} bytes where its fields need {1}")]
    Length(usize, usize),
}

struct Frame {
    flags: u8,
    number: u16,
    time_us: u64,
    fields: u32,
    row: Row,
}

impl Frames {
    fn whole(&mut self, found: &mut dyn FnMut(Found)) {
        let coded = std::mem::take(&mut self.coded);
        let good = !std::mem::take(&mut self.skips) && std::mem::replace(&mut self.synchronous, true);
        if good && !coded.is_empty() {
            match decode(&coded).and_then(|bytes| understand(&bytes)) {
                Ok(frame) => self.give(frame, found),
                Err(error) => {
                    let fault = if matches!(error, FrameError::Length(..)) { Fault::Cut } else { Fault::Garbled };
                    found(Found::Fault(fault, format!("a frame of {} bytes: {error}", coded.len())));
                }
            }
        }
        self.coded = coded;
        self.coded.clear();
    }

    fn give(&mut self, mut frame: Frame, found: &mut dyn FnMut(Found)) {
        if frame.flags & BEGINS != 0 {
            found(Found::Begins);
            self.number = None;
        }
        let missed = self.number.map_or(0, |last| frame.number.wrapping_sub(last).wrapping_sub(1));
        if (1..MISSABLE).contains(&missed) {
            found(Found::Missed(missed.into()));
        }
        self.number = Some(frame.number);
        if check(&mut frame.row) {
            found(Found::Fault(Fault::Value, format!("frame {}", frame.number)));
        }
        self.content.get_or_insert_with(|| content(frame.fields));
        found(Found::Row(frame.row, i128::from(frame.time_us) * 1000));
    }
}

impl Format for Frames {
    fn take(&mut self, bytes: &[u8], found: &mut dyn FnMut(Found)) {
        for piece in bytes.split_inclusive(|&b| b == 0) {
            let (code, ends) = piece.strip_suffix(&[0]).map_or((piece, false), |code| (code, true));
            if self.coded.len() + code.len() > LONGEST && !self.skips {
                self.skips = true;
                if self.synchronous {
                    found(Found::Fault(Fault::Garbled, format!("more than {LONGEST} bytes without a zero")));
                }
            }
            if self.skips {
                self.coded.clear();
            } else {
                self.coded.extend_from_slice(code);
            }
            if ends {
                self.whole(found);
            }
        }
    }

    fn cut(&mut self, found: &mut dyn FnMut(Found)) {
        // A packet may hold a frame without zeros about it.
        self.synchronous = true;
        self.whole(found);
        self.synchronous = false;
    }

    fn content(&self) -> Option<&Content> {
        self.content.as_ref()
    }
}

/// Undoes the code that leaves no zero in a frame.
fn decode(coded: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut bytes = Vec::with_capacity(coded.len());
    let mut rest = coded;
    while let Some((&code, after)) = rest.split_first() {
        let run = usize::from(code).checked_sub(1).filter(|&run| run <= after.len()).ok_or(FrameError::Code)?;
        let (copied, after) = after.split_at(run);
        bytes.extend_from_slice(copied);
        if code < u8::MAX && !after.is_empty() {
            bytes.push(0);
        }
        rest = after;
    }
    Ok(bytes)
}

fn understand(bytes: &[u8]) -> Result<Frame, FrameError> {
    let Some((body, sum)) = bytes.split_last_chunk::<2>().filter(|(body, _)| body.len() >= HEAD) else {
        return Err(FrameError::Short(bytes.len()));
    };
    if CHECKSUM.checksum(body) != u16::from_le_bytes(*sum) {
        return Err(FrameError::Checksum);
    }
    if body[0] != VERSION {
        return Err(FrameError::Version(body[0]));
    }
    let (head, values) = body.split_at(HEAD);
    let fields = u32::from_le_bytes(head[12..16].try_into().unwrap_or_default());
    let wanted = 4 * fields.count_ones() as usize;
    if values.len() != wanted {
        return Err(FrameError::Length(bytes.len(), HEAD + wanted + 2));
    }
    let mut row = Row::EMPTY;
    let (numbers, _) = values.as_chunks::<4>();
    let present = (0..32).filter(|bit| fields >> bit & 1 == 1);
    for (bit, number) in present.zip(numbers) {
        if let Some(place) = place(&mut row, bit) {
            *place = f64::from(f32::from_le_bytes(*number));
        }
    }
    Ok(Frame {
        flags: head[1],
        number: u16::from_le_bytes([head[2], head[3]]),
        time_us: u64::from_le_bytes(head[4..12].try_into().unwrap_or_default()),
        fields,
        row,
    })
}

/// Which value a bit of the fields means.
fn place(row: &mut Row, bit: usize) -> Option<&mut f64> {
    match bit {
        0..3 => row.gyro.get_mut(bit),
        3..6 => row.accel.get_mut(bit - 3),
        6 => Some(&mut row.temperature),
        7 => Some(&mut row.supply),
        8..11 => row.ref_angle.get_mut(bit - 8),
        11..14 => row.ref_rate.get_mut(bit - 11),
        14..18 => row.ref_quaternion.get_mut(bit - 14),
        18..26 => row.free.get_mut(bit - 18),
        _ => None,
    }
}

/// What these fields mean. Free channels are called `free_1` to `free_8`.
fn content(fields: u32) -> Content {
    let has = |bit: usize| fields >> bit & 1 == 1;
    let gyros: Vec<Axis> = Axis::ALL.into_iter().filter(|a| has(a.index())).collect();
    let referenced = gyros.iter().copied().filter(|a| has(8 + a.index()) || has(11 + a.index())).collect();
    let free = (18..26).rposition(has).map_or(0, |last| last + 1);
    Content { gyros, referenced, free_names: (1..=free).map(|k| format!("free_{k}")).collect() }
}

/// Takes away what nothing physical has; whether there was anything. A value that is NaN is none.
pub(super) fn check(row: &mut Row) -> bool {
    const IMPOSSIBLE: f64 = 1e9;
    let mut wrong = false;
    let length = row.ref_quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    if (0.9..=1.1).contains(&length) {
        row.ref_quaternion.iter_mut().for_each(|x| *x /= length);
    } else if !length.is_nan() {
        wrong = true;
        row.ref_quaternion.fill(f64::NAN);
    } else {
        row.ref_quaternion.fill(f64::NAN);
    }
    let values = row.gyro.iter_mut().chain(&mut row.accel).chain(&mut row.ref_angle).chain(&mut row.ref_rate);
    for value in values.chain([&mut row.temperature, &mut row.supply]).chain(&mut row.free) {
        if value.is_infinite() || value.abs() > IMPOSSIBLE {
            *value = f64::NAN;
            wrong = true;
        }
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::{CHECKSUM, Fault, Format, Found, Frames};

    /// As a sender codes it.
    fn coded(body: &[u8]) -> Vec<u8> {
        let mut bytes = body.to_vec();
        bytes.extend(CHECKSUM.checksum(body).to_le_bytes());
        let mut out = vec![0];
        for run in bytes.split(|&b| b == 0) {
            out.push(u8::try_from(run.len() + 1).unwrap());
            out.extend(run);
        }
        out.push(0);
        out
    }

    fn frame(number: u16, time_us: u64, gyro: [f32; 3]) -> Vec<u8> {
        let mut body = vec![1, 0];
        body.extend(number.to_le_bytes());
        body.extend(time_us.to_le_bytes());
        body.extend(7_u32.to_le_bytes());
        for value in gyro {
            body.extend(value.to_le_bytes());
        }
        coded(&body)
    }

    type Rows = Vec<(i128, [f64; 3])>;

    fn read(bytes: &[u8]) -> (Rows, Vec<Fault>, u64) {
        let mut frames = Frames::default();
        let (mut rows, mut faults, mut missed) = (Vec::new(), Vec::new(), 0);
        for piece in bytes.chunks(5) {
            frames.take(piece, &mut |found| match found {
                Found::Row(row, time) => rows.push((time, row.gyro)),
                Found::Fault(fault, _) => faults.push(fault),
                Found::Missed(n) => missed += n,
                Found::Begins => {}
            });
        }
        (rows, faults, missed)
    }

    #[test]
    fn frames_are_read_and_those_that_are_missing_counted() {
        let mut bytes = b"boot text".to_vec();
        for number in [65_534, 65_535, 2, 3] {
            bytes.extend(frame(number, 1000 * u64::from(number), [0.0, -1.5, f32::INFINITY]));
        }
        let (rows, faults, missed) = read(&bytes);
        assert_eq!((rows.len(), missed), (4, 2));
        assert_eq!((rows[0].0, rows[0].1[1]), (65_534_000_000, -1.5));
        assert!(rows.iter().all(|r| r.1[2].is_nan()) && faults.iter().all(|f| *f == Fault::Value));
    }

    #[test]
    fn no_bit_that_is_turned_over_gives_a_row() {
        let good = frame(1, 5, [0.25, 0.5, 1.0]);
        for bit in 8..8 * (good.len() - 1) {
            let mut bytes = good.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            bytes.extend(frame(2, 6, [0.0; 3]));
            let (rows, _, _) = read(&bytes);
            assert!(rows.len() == 1 && rows[0].0 == 6000, "bit {bit}: {rows:?}");
        }
    }
}
