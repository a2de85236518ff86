//! A list of JSON whose records name their sensor, as phones export it. It is read as the text that it means.

use super::delimited;
use crate::{
    format::{AsText, Converted, Format, Sink, Unreadable},
    json::{is_of_sensors, table_of_sensors},
};
use std::io::{Cursor, Read};

/// Records of several sensors.
pub struct Sensors;

impl Format for Sensors {
    fn name(&self) -> &'static str {
        "JSON of several sensors"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        is_of_sensors(start)
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        delimited::read(converted(bytes)?, sink)
    }

    fn as_text(&self) -> Option<AsText> {
        Some(converted)
    }
}

fn converted(source: &mut dyn Read) -> Result<Converted, Unreadable> {
    Ok(Converted { text: Box::new(Cursor::new(table_of_sensors(source)?)), notes: Vec::new() })
}
