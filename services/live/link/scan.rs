//! How a row lies in an IIO buffer: elements in the order of their indices, each at a multiple of its size.

/// One element: `le:s16/16>>0` says little-endian, signed, 16 bits of 16, shifted by 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    big_endian: bool,
    signed: bool,
    bits: u32,
    bytes: usize,
    shift: u32,
    scale: f64,
    offset: f64,
}

/// A row's elements.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Where each lies, which of our values it is, whether it is the time.
    elements: Vec<(usize, Option<usize>, bool, Element)>,
    length: usize,
}

/// Values of a row.
pub const VALUES: usize = 7;

impl Element {
    /// Of a type as sysfs has it; `None` where it is none that we know.
    #[must_use]
    pub fn new(text: &str, scale: f64, offset: f64) -> Option<Self> {
        let (endian, rest) = text.split_once(':')?;
        let (sign, rest) = rest.split_at_checked(1)?;
        let (bits, rest) = rest.split_once('/')?;
        // One element several times over is none of ours.
        let (storage, shift) = rest.split_once(">>").unwrap_or((rest, "0"));
        let (bits, storage, shift): (u32, u32, u32) = (bits.parse().ok()?, storage.parse().ok()?, shift.parse().ok()?);
        let good = matches!(storage, 8 | 16 | 32 | 64) && bits > 0 && bits + shift <= storage;
        (good && matches!(endian, "le" | "be") && matches!(sign, "s" | "u")).then_some(Self {
            big_endian: endian == "be",
            signed: sign == "s",
            bits,
            bytes: storage as usize / 8,
            shift,
            scale,
            offset,
        })
    }

    /// The number in these bytes, as many as it has.
    fn raw(&self, bytes: &[u8]) -> i64 {
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        let bytes = &bytes[..self.bytes];
        let word = if self.big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) };
        let left = u64::BITS - self.bits;
        let word = (word >> self.shift) << left;
        if self.signed { word.cast_signed() >> left } else { (word >> left).cast_signed() }
    }
}

impl Scan {
    /// Of elements in the order of their indices.
    #[must_use]
    pub fn new(elements: impl Iterator<Item = (Option<usize>, bool, Element)>) -> Self {
        let (mut at, mut largest, mut placed) = (0_usize, 1, Vec::new());
        for (place, is_time, element) in elements {
            at = at.next_multiple_of(element.bytes);
            placed.push((at, place, is_time, element));
            at += element.bytes;
            largest = largest.max(element.bytes);
        }
        Self { elements: placed, length: at.next_multiple_of(largest).max(1) }
    }

    /// Bytes of a row.
    #[must_use]
    pub fn length(&self) -> usize {
        self.length
    }

    /// Whether a row has this value.
    #[must_use]
    pub fn has(&self, value: usize) -> bool {
        self.elements.iter().any(|element| element.1 == Some(value))
    }

    /// A row's time, ns, and its values; NaN where it has none. `bytes` is a row's length.
    #[must_use]
    pub fn values(&self, bytes: &[u8]) -> (Option<i64>, [f64; VALUES]) {
        let (mut time, mut values) = (None, [f64::NAN; VALUES]);
        for (at, place, is_time, element) in &self.elements {
            let raw = element.raw(&bytes[*at..]);
            if *is_time {
                time = Some(raw);
            } else if let Some(place) = place {
                values[*place] = (raw as f64 + element.offset) * element.scale;
            }
        }
        (time, values)
    }
}

#[cfg(test)]
mod tests {
    use super::{Element, Scan};

    #[test]
    fn elements_are_read_wherever_they_lie_and_however_they_are_packed() {
        let element = |text| Element::new(text, 0.5, 1.0).unwrap();
        let elements = [
            (Some(0), false, element("be:s16/16>>0")),
            (Some(1), false, element("le:s12/32>>8")),
            (None, false, element("le:u8/8>>0")),
            (None, true, element("le:s64/64>>0")),
        ];
        let scan = Scan::new(elements.into_iter());
        assert_eq!(scan.length(), 24);
        let mut bytes = vec![0xff, 0xfe, 0, 0, 0x55, 0xfd, 0xff, 0xa5, 7, 0, 0, 0, 0, 0, 0, 0];
        bytes.extend((-5_i64).to_le_bytes());
        let (time, values) = scan.values(&bytes);
        // −2, and the twelve bits 0xffd = −3 between other bits.
        assert_eq!((time, values[0], values[1]), (Some(-5), -0.5, -1.0));
        assert!(values[2].is_nan() && scan.has(1) && !scan.has(2));
    }

    #[test]
    fn a_type_that_is_none_is_refused() {
        for text in [
            "",
            "le:",
            "le:s16",
            "xe:s16/16>>0",
            "le:s16/12>>0",
            "le:s16/16>>4",
            "le:s0/8>>0",
            "le:s16/16X2>>0",
            "le:f32/32>>0",
        ] {
            assert_eq!(Element::new(text, 1.0, 0.0), None, "{text}");
        }
    }
}
