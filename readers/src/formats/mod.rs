//! One format a file.

mod ardupilot;
mod bag;
pub mod can;
pub mod columns;
#[cfg(not(target_family = "wasm"))]
mod db3;
mod delimited;
pub mod kinds;
mod mcap;
#[cfg(feature = "parquet")]
mod parquet;
mod primitive;
pub mod ros;
mod sensors;
mod ulog;
mod unread;

pub use unread::{Unread, of_no_text, unread};

use crate::{
    can::Writer,
    format::{Format, START},
};

/// The formats, the surest sign first. Text is what is none of the others.
pub static FORMATS: &[&dyn Format] = &[
    &ulog::Ulog,
    &mcap::Mcap,
    #[cfg(not(target_family = "wasm"))]
    &db3::Db3,
    &bag::Bag,
    #[cfg(feature = "parquet")]
    &parquet::Parquet,
    &ardupilot::ArduPilot,
    &can::Can::of(Writer::Candump),
    &can::Can::of(Writer::Asc),
    &columns::Columns,
    &sensors::Sensors,
    &delimited::Text,
];

/// The format of a file that begins like this, at most [`START`] bytes of it.
#[must_use]
pub fn recognise(start: &[u8]) -> &'static dyn Format {
    let start = &start[..start.len().min(START)];
    FORMATS.iter().copied().find(|format| format.recognises(start)).unwrap_or(&delimited::Text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_read_is_named_with_a_way_out_and_text_is_not_taken_for_it() {
        assert!(unread(b"PAR1....").is_some_and(|unread| unread.remedy.contains("read_parquet")));
        assert_eq!(recognise(b"PAR1....").as_text().is_some(), cfg!(feature = "parquet"));
        assert!(unread(&[0, 1, 2, 3, 4, 200, 201]).is_some());
        assert!(unread(b"VERSION \"\"\n\nNS_ :").is_some_and(|unread| unread.remedy.contains("CAN log")));
        assert!(unread(b"{\"imu\": [{\"t\": 1").is_some() && unread(b"{\"t\": 0.01, \"gz\":").is_none());
        for text in
            [&b"t,gyro_x\r\n0,1\r\n"[..], b"", b"\xef\xbb\xbft,gyro", "Zeit;Drehrate (°/s)\n".as_bytes(), b"0,\xff\xfe"]
        {
            assert_eq!(unread(text), None, "{text:?}");
        }
    }
}
