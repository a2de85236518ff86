//! MCAP: records of messages, in chunks or not. Read as it comes, so that a recording that breaks off gives what is whole.

use super::ros::{Connections, Wire};
use crate::{
    bytes::{Bytes, Cursor, LONGEST},
    format::{Format, Note, Place, Sink, Unreadable},
    packed,
};
use std::{
    collections::HashMap,
    io::{self, Read},
};

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// MCAP, as ROS 2 and others write it.
pub struct Mcap;

impl Format for Mcap {
    fn name(&self) -> &'static str {
        "MCAP"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        start.starts_with(&MAGIC)
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut bytes = Bytes::new(bytes);
        bytes.skip(MAGIC.len() as u64)?;
        let mut file = File { schemas: HashMap::new(), connections: Connections::new(sink) };
        let end = file.records(&mut bytes, false)?;
        if end == End::Broken {
            file.connections.note(Note::BreaksOff { at: Place::Byte(bytes.position()) });
        }
        file.connections.finish();
        Ok(())
    }
}

/// How records ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Whole,
    Broken,
}

struct Schema {
    name: String,
    encoding: String,
    text: String,
}

struct File<'a> {
    schemas: HashMap<u16, Schema>,
    connections: Connections<'a>,
}

impl File<'_> {
    /// Reads records to the end of the data; `within` a chunk that end is that of the bytes.
    fn records(&mut self, bytes: &mut Bytes, within: bool) -> io::Result<End> {
        loop {
            let head = bytes.peek(9)?;
            let (Some(&kind), Some(length)) = (head.first(), head.get(1..9)) else {
                return Ok(if within && head.is_empty() { End::Whole } else { End::Broken });
            };
            let length = u64::from_le_bytes(length.try_into().unwrap_or_default());
            // The data end before the summary, which says the same once more.
            if matches!(kind, 0x0f | 0x02) && !within {
                return Ok(End::Whole);
            }
            bytes.skip(9)?;
            let whole = match kind {
                0x06 if !within => self.chunk(bytes, length)?,
                0x03..=0x05 | 0x0c if length <= LONGEST as u64 => match bytes.take(length as usize)? {
                    Some(body) => {
                        // A record that is damaged in itself is passed by.
                        let _ = self.record(kind, body);
                        true
                    }
                    None => false,
                },
                _ => bytes.skip(length)?,
            };
            if !whole {
                return Ok(End::Broken);
            }
        }
    }

    fn record(&mut self, kind: u8, body: &[u8]) -> Option<()> {
        let mut cursor = Cursor::new(body);
        match kind {
            0x03 => {
                let id = cursor.u16()?;
                let mut text = || Some(String::from_utf8_lossy(cursor.prefixed()?).into_owned());
                let schema = Schema { name: text()?, encoding: text()?, text: text()? };
                self.schemas.insert(id, schema);
            }
            0x04 => {
                let (id, schema) = (cursor.u16()?, cursor.u16()?);
                let mut text = || Some(String::from_utf8_lossy(cursor.prefixed()?).into_owned());
                let (topic, encoding) = (text()?, text()?);
                if self.connections.knows(u32::from(id)) {
                    return Some(());
                }
                let schema = self.schemas.get(&schema);
                match (schema, encoding.as_str()) {
                    (Some(schema), "cdr") if schema.encoding == "ros2msg" => {
                        self.connections.connect(u32::from(id), &topic, &schema.name, Wire::Cdr, &schema.text);
                    }
                    (Some(schema), "ros1") if schema.encoding == "ros1msg" => {
                        self.connections.connect(u32::from(id), &topic, &schema.name, Wire::Ros1, &schema.text);
                    }
                    (_, "protobuf") => {
                        self.connections.not_read(&topic, "they are protobuf: only ROS messages are read");
                    }
                    (_, "json") => self.connections.not_read(&topic, "they are JSON: only ROS messages are read"),
                    _ => self.connections.not_read(&topic, "their encoding is not known: only ROS messages are read"),
                }
            }
            0x0c => {
                let name = String::from_utf8_lossy(cursor.prefixed()?).into_owned();
                let mut pairs = Cursor::new(cursor.prefixed()?);
                while let (Some(key), Some(value)) = (pairs.prefixed(), pairs.prefixed()) {
                    let (key, value) = (String::from_utf8_lossy(key), String::from_utf8_lossy(value));
                    if is_of_device(&key) {
                        self.connections.said(&format!("{name}.{key}"), value.trim());
                    }
                }
            }
            _ => {
                let (id, _, time, _) = (cursor.u16()?, cursor.u32()?, cursor.u64()?, cursor.u64()?);
                self.connections.message(u32::from(id), i64::try_from(time).unwrap_or(i64::MAX), cursor.rest());
            }
        }
        Some(())
    }

    /// Reads the records of a chunk; `false` where it breaks off.
    fn chunk(&mut self, bytes: &mut Bytes, length: u64) -> io::Result<bool> {
        let at = bytes.position();
        let Some(head) = bytes.array::<32>()? else { return Ok(false) };
        let name = u32::from_le_bytes([head[28], head[29], head[30], head[31]]);
        if name > 16 {
            return bytes.skip(length.saturating_sub(32));
        }
        let Some(name) = bytes.take(name as usize)?.map(<[u8]>::to_vec) else { return Ok(false) };
        let Some(stored) = bytes.array::<8>()?.map(u64::from_le_bytes) else { return Ok(false) };
        let left = length.saturating_sub(bytes.position() - at);
        if stored > left || stored > LONGEST as u64 {
            self.connections.note(Note::Damaged { at: Place::Byte(at), bytes: length });
            return bytes.skip(left);
        }
        let stored_bytes = bytes.peek(stored as usize)?;
        let whole = stored_bytes.len() as u64 == stored;
        let ended = match name.as_slice() {
            b"" => self.within(&mut &stored_bytes[..]),
            b"lz4" => self.within(&mut lz4_flex::frame::FrameDecoder::new(stored_bytes)),
            b"zstd" => match packed::zstd(stored_bytes) {
                Ok(mut decoder) => self.within(&mut decoder),
                Err(_) => Ok(End::Broken),
            },
            _ => {
                self.connections.not_read("a chunk", "it is packed in a way that is not known");
                Ok(End::Whole)
            }
        };
        if whole && !matches!(ended, Ok(End::Whole)) {
            self.connections.note(Note::Damaged { at: Place::Byte(at), bytes: length });
        }
        if !bytes.skip(left)? {
            return Ok(false);
        }
        Ok(true)
    }

    fn within(&mut self, source: &mut dyn Read) -> io::Result<End> {
        self.records(&mut Bytes::new(source), true)
    }
}

/// Whether a key of a recording's metadata is of the device that was recorded: its serial number, its board, its driver, their versions.
fn is_of_device(key: &str) -> bool {
    const WORDS: [&str; 12] = [
        "uuid", "serial", "hardware", "board", "driver", "firmware", "version", "sensor", "imu", "model", "device",
        "part",
    ];
    let key = key.to_lowercase();
    key == "hw" || key.starts_with("hw_") || WORDS.iter().any(|word| key.contains(word))
}
