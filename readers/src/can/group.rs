//! The parts of an identifier as SAE J1939-21 has them: 29 bits that hold a priority, the group of parameters that the data are
//! (PGN), and who sends them (source address).
//!
//! | bits | what |
//! | --- | --- |
//! | 26–28 | priority |
//! | 16–25 | data pages and PDU format: the group's number |
//! | 8–15 | from PDU format 240 on the rest of the group's number; below it, to whom the frame is sent |
//! | 0–7 | source address |

use super::EXTENDED;

/// The source address of whoever has none: DBC files write it where any sender is meant.
pub const ANY_SOURCE: u8 = 0xfe;
/// From this PDU format on a frame is sent to all, and bits 8–15 belong to the group's number.
const TO_ALL: u32 = 240;

/// The number of the group of parameters; `None` of an identifier of 11 bits.
#[must_use]
pub fn number(id: u32) -> Option<u32> {
    let to_all = id >> 16 & 0xff >= TO_ALL;
    (id & EXTENDED != 0).then_some(id >> 8 & if to_all { 0x3_ffff } else { 0x3_ff00 })
}

/// Who sends it.
#[must_use]
pub fn source(id: u32) -> u8 {
    id as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_the_same_whoever_sends_it_and_to_whom_and_how_urgently() {
        let group = |id: u32| number(id | EXTENDED);
        assert_eq!((group(0x0cf0_0400), group(0x18f0_0421)), (Some(61444), Some(61444)), "EEC1");
        assert_eq!((group(0x0c00_0003), group(0x0c00_2103)), (Some(0), Some(0)), "TSC1, to whomever");
        assert_ne!(group(0x18fe_f1d5), group(0x18fe_f2d5));
        assert_eq!((number(0x123), source(0x18fe_f1d5)), (None, 0xd5));
    }
}
