//! ROS 1 bags: connections and messages, in chunks.
//!
//! A record is a head and data, each after its length. The head holds `name=value` fields, each after its length.

use super::ros::{Connections, Wire};
use crate::{
    bytes::{Bytes, Cursor, LONGEST},
    format::{Format, Note, Place, Sink, Unreadable},
};
use std::io::{self, Read};

/// ROS 1 bag, version 2.0.
pub struct Bag;

const MAGIC: &[u8] = b"#ROSBAG V";
const VERSION: &[u8] = b"#ROSBAG V2.0\n";

impl Format for Bag {
    fn name(&self) -> &'static str {
        "ROS 1 bag"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        start.starts_with(MAGIC)
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut bytes = Bytes::new(bytes);
        if bytes.take(VERSION.len())? != Some(VERSION) {
            return Err(Unreadable::Unknown("only version 2.0 is read: `rosbag fix` makes one of an older bag"));
        }
        let mut connections = Connections::new(sink);
        if !records(&mut bytes, &mut connections, false)? {
            connections.note(Note::BreaksOff { at: Place::Byte(bytes.position()) });
        }
        connections.finish();
        Ok(())
    }
}

/// The fields of a head.
#[derive(Default)]
struct Head<'a> {
    op: u8,
    connection: Option<u32>,
    time_ns: i64,
    topic: Option<&'a [u8]>,
    compression: &'a [u8],
    kind: Option<&'a [u8]>,
    definition: Option<&'a [u8]>,
}

impl<'a> Head<'a> {
    fn read(bytes: &'a [u8]) -> Self {
        let (mut cursor, mut head) = (Cursor::new(bytes), Self::default());
        while let Some(field) = cursor.prefixed() {
            let Some(at) = memchr::memchr(b'=', field) else { continue };
            let (name, value) = (&field[..at], &field[at + 1..]);
            match name {
                b"op" => head.op = value.first().copied().unwrap_or(0),
                b"conn" => head.connection = Cursor::new(value).u32(),
                b"time" => {
                    let mut cursor = Cursor::new(value);
                    let (seconds, ns) = (cursor.u32().unwrap_or(0), cursor.u32().unwrap_or(0));
                    head.time_ns = i64::from(seconds) * 1_000_000_000 + i64::from(ns);
                }
                b"topic" => head.topic = Some(value),
                b"compression" => head.compression = value,
                b"type" => head.kind = Some(value),
                b"message_definition" => head.definition = Some(value),
                _ => {}
            }
        }
        head
    }
}

/// Reads records to the end; `false` where they break off.
fn records(bytes: &mut Bytes, connections: &mut Connections, within: bool) -> io::Result<bool> {
    loop {
        let at = bytes.position();
        let Some(length) = bytes.array::<4>()?.map(u32::from_le_bytes) else {
            return Ok(bytes.peek(1)?.is_empty());
        };
        let Some(head_bytes) = bytes.take(length as usize)?.map(<[u8]>::to_vec) else { return Ok(false) };
        let Some(length) = bytes.array::<4>()?.map(u32::from_le_bytes) else { return Ok(false) };
        let head = Head::read(&head_bytes);
        let wanted = matches!(head.op, 0x02 | 0x07) || head.op == 0x05 && !within;
        if !wanted || length as usize > LONGEST {
            if !bytes.skip(u64::from(length))? {
                return Ok(false);
            }
            continue;
        }
        let data = bytes.peek(length as usize)?;
        let whole = data.len() == length as usize;
        match head.op {
            // What there is of a chunk that breaks off is read.
            0x05 => chunk(at, head.compression, data, whole, connections),
            _ if !whole => {}
            0x07 => connect(&head, data, connections),
            _ => {
                if let Some(id) = head.connection {
                    connections.message(id, head.time_ns, data);
                }
            }
        }
        if !bytes.skip(u64::from(length))? {
            return Ok(false);
        }
    }
}

fn connect(head: &Head, data: &[u8], connections: &mut Connections) {
    let own = Head::read(data);
    let text = |bytes: Option<&[u8]>| bytes.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    if let (Some(id), Some(topic), Some(kind), Some(definition)) =
        (head.connection, text(head.topic.or(own.topic)), text(own.kind), text(own.definition))
    {
        connections.connect(id, &topic, &kind, Wire::Ros1, &definition);
    }
}

fn chunk(at: u64, compression: &[u8], data: &[u8], whole: bool, connections: &mut Connections) {
    let mut within = |source: &mut dyn Read| records(&mut Bytes::new(source), connections, true);
    let ended = match compression {
        b"none" => within(&mut &data[..]),
        b"lz4" => within(&mut lz4_flex::frame::FrameDecoder::new(data)),
        b"bz2" => within(&mut bzip2::read::BzDecoder::new(data)),
        _ => {
            connections.not_read("a chunk", "it is packed in a way that is not known");
            return;
        }
    };
    if whole && !matches!(ended, Ok(true)) {
        connections.note(Note::Damaged { at: Place::Byte(at), bytes: data.len() as u64 });
    }
}
