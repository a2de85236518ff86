//! Torn readings: the high and the low byte of a converter's word are of two readings.
//!
//! Where the high byte is the one before, the reading is off by the 256 steps that a high byte is worth (or a few times
//! as much), for one sample, wherever the low byte runs over; where it is another's low byte, by up to 255 steps, which are
//! spikes of many sizes. Known of drivers that read the two registers one by one, without the burst read that holds them.

use super::{
    channel::Channel,
    neighbours::Apart,
    thresholds::{BIT_SPREAD, SAME_SIZE, SIZE_SPREAD, SPIKE},
};
use crate::order::median;

/// Times the size that a reading may be off by.
const MULTIPLES: f64 = 4.0;
/// A step that is so many times finer than the noise is no converter's.
const FINE: f64 = 2000.0;
/// Standard deviations of noise by which a size may differ from another.
const NOISE: f64 = 4.0;

/// The size by which readings lie apart again and again, which a word's bit is, or may be; `None` where there is no such size.
///
/// A motion that repeats itself brings deviations of one size too, but smaller ones, and not of a byte.
pub(super) fn recurring(found: &[Apart], noise: f64, step: f64) -> Option<f64> {
    let certain: Vec<Apart> = found.iter().copied().filter(|apart| apart.times > SPIKE).collect();
    let is_known = step > noise / FINE;
    let of_bits = size_of(&certain, noise).filter(|size| !is_known || bit(size / step).is_some());
    of_bits.or_else(|| size_of(found, noise).filter(|size| is_known && bit(size / step) == Some(8)))
}

fn size_of(found: &[Apart], noise: f64) -> Option<f64> {
    let size = median(found.iter().map(|apart| apart.size.abs()).collect())?;
    let sizes: Vec<f64> = found.iter().map(|apart| apart.size.abs()).filter(|&s| is_once(s, size, noise)).collect();
    let size = sizes.iter().sum::<f64>() / sizes.len().max(1) as f64;
    let of_it = found.iter().filter(|apart| is_of(apart.size, size, noise)).count();
    let comes_back = sizes.len() >= SAME_SIZE.0 && of_it as f64 >= SAME_SIZE.1 * found.len() as f64;
    comes_back.then_some(size)
}

/// The bit of the word that so many steps are, from the fourth on; `None` where they are none.
fn bit(steps: f64) -> Option<u32> {
    let bit = steps.log2().round();
    let is_one = (4.0..=15.0).contains(&bit) && (steps / bit.exp2() - 1.0).abs() < BIT_SPREAD;
    is_one.then_some(bit as u32)
}

/// Whether a reading is off by this size, or a few times as much.
pub(super) fn is_of(apart: f64, size: f64, noise: f64) -> bool {
    let times = (apart.abs() / size).round();
    (1.0..=MULTIPLES).contains(&times) && is_once(apart.abs() - (times - 1.0) * size, size, noise)
}

fn is_once(apart: f64, size: f64, noise: f64) -> bool {
    (apart - size).abs() < (SIZE_SPREAD * size).max(NOISE * noise)
}

/// What it is, and what to do.
pub(super) fn says(channel: Channel, size: f64, step: f64) -> String {
    let byte = match bit(size / step) {
        Some(8) => ", what the high byte of the converter's word counts".to_owned(),
        Some(bit) => format!(", bit {bit} of the converter's word"),
        None => String::new(),
    };
    format!(
        "jump by one size, {}{byte}, and back: left out. High and low byte are of two readings: read both registers in one burst",
        channel.says(size)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apart(sizes: &[f64]) -> Vec<Apart> {
        sizes.iter().enumerate().map(|(index, &size)| Apart { index, size, times: 30.0 }).collect()
    }

    #[test]
    fn one_size_that_comes_back_is_known_beside_a_few_others() {
        let found = apart(&[3.9, -3.91, 3.88, 7.8, -3.9, 3.92, -3.9, 1.7]);
        let size = recurring(&found, 0.01, 3.9 / 256.0).unwrap();
        assert!((size - 3.9).abs() < 0.03, "{size}");
        assert!(is_of(-7.8, size, 0.01) && !is_of(1.7, size, 0.01));
    }

    #[test]
    fn spikes_of_many_sizes_are_not_torn() {
        assert_eq!(recurring(&apart(&[3.0, -9.0, 1.1, 25.0, 14.0, -6.2, 0.7, 40.0]), 0.01, 0.01), None);
        assert_eq!(recurring(&apart(&[3.9, 3.9, -3.9]), 0.01, 0.01), None);
        // Of one size that is no bit of the word, and of a byte's, but for a motion's.
        assert_eq!(recurring(&apart(&[3.0; 9]), 0.01, 3.0 / 300.0), None);
    }
}
