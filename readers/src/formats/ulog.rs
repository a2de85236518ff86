//! PX4 ULog: definitions of messages, subscriptions to them, data.
//!
//! A record is its size, two bytes, its type, one byte, and so many bytes. What is not known is passed by; where the sizes no
//! longer fit, the next synchronisation record is looked for.

use super::primitive::{Kind, Number, read_all};
use crate::{
    bytes::{Bytes, Cursor},
    format::{Field, Format, Note, Place, Sink, Topic, Unreadable},
};
use std::{
    collections::{BTreeMap, HashMap},
    io::{self, Read},
};

const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// A synchronisation record, whole.
const SYNC: &[u8] = b"\x08\x00S\x2f\x73\x13\x20\x25\x0c\xbb\x12";
/// Types of records.
const TYPES: &[u8] = b"BFIMPQARDLCSO";
/// Numbers in a message, and messages within messages, at most.
const MOST_FIELDS: usize = 4096;
const DEEPEST: usize = 8;
/// Fields and parts of one message that are looked at, at most: an array of what has no fields takes no bytes.
const MOST_STEPS: usize = 1 << 17;

/// PX4 ULog.
pub struct Ulog;

impl Format for Ulog {
    fn name(&self) -> &'static str {
        "PX4 ULog"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        start.starts_with(MAGIC)
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut bytes = Bytes::new(bytes);
        if bytes.take(16)?.is_none() {
            return Err(Unreadable::Unknown("the file ends in its header"));
        }
        let mut log = Log { formats: HashMap::new(), subscriptions: BTreeMap::new(), topics: 0, sink, lost: (0, 0) };
        while let Some(&[low, high, kind]) = bytes.peek(3)?.first_chunk() {
            let (at, size) = (bytes.position(), usize::from(u16::from_le_bytes([low, high])));
            if !TYPES.contains(&kind) || size == 0 {
                resynchronise(&mut bytes, log.sink)?;
                continue;
            }
            bytes.take(3)?;
            let Some(body) = bytes.take(size)? else {
                log.sink.note(Note::BreaksOff { at: Place::Byte(at) });
                break;
            };
            log.record(kind, body)?;
        }
        if (1..3).contains(&bytes.peek(3)?.len()) {
            log.sink.note(Note::BreaksOff { at: Place::Byte(bytes.position()) });
        }
        if log.lost.1 > 0 {
            log.sink.note(Note::Lost { milliseconds: log.lost.0, count: log.lost.1 });
        }
        Ok(())
    }
}

/// Passes by what is before the next synchronisation record.
fn resynchronise(bytes: &mut Bytes, sink: &mut dyn Sink) -> io::Result<()> {
    let at = bytes.position();
    loop {
        let ahead = bytes.peek(1 << 16)?;
        let found = memchr::memmem::find(ahead, SYNC);
        let whole = ahead.len();
        // What is left may be the beginning of one.
        let pass = found.unwrap_or(if whole < 1 << 16 { whole } else { whole - SYNC.len() });
        bytes.skip(pass as u64)?;
        if found.is_some() || whole < 1 << 16 {
            sink.note(Note::Damaged { at: Place::Byte(at), bytes: bytes.position() - at });
            return Ok(());
        }
    }
}

struct Log<'a> {
    /// The fields of each kind of message, as written.
    formats: HashMap<String, String>,
    subscriptions: BTreeMap<u16, Subscription>,
    topics: usize,
    sink: &'a mut dyn Sink,
    lost: (u64, u64),
}

/// What is told of a board: its name and serial number, its processor, and the version of what ran on it.
const SAID: [&str; 7] = ["sys_name", "sys_uuid", "sys_mcu", "ver_hw", "ver_hw_subtype", "ver_sw", "ver_sw_branch"];

struct Subscription {
    topic: usize,
    wanted: bool,
    time_at: usize,
    numbers: Vec<Number>,
    values: Vec<f64>,
}

impl Log<'_> {
    fn record(&mut self, kind: u8, body: &[u8]) -> Result<(), Unreadable> {
        match kind {
            // The first bit says that data were appended, which are read as they come.
            b'B' if body.get(8).is_some_and(|flags| flags & !1 != 0)
                || body.iter().skip(9).take(7).any(|&b| b != 0) =>
            {
                return Err(Unreadable::Unknown("the log is of a kind that is newer than this program knows"));
            }
            b'F' => {
                let text = String::from_utf8_lossy(body);
                if let Some((name, fields)) = text.split_once(':') {
                    self.formats.insert(name.to_owned(), fields.to_owned());
                }
            }
            b'I' => self.information(body),
            b'A' => self.subscribe(body),
            b'D' => self.data(body),
            b'O' => {
                let lost = Cursor::new(body).u16().map_or(0, u64::from);
                self.lost = (self.lost.0 + lost, self.lost.1 + 1);
            }
            _ => {}
        }
        Ok(())
    }

    /// What the log says of its board: a key with its type, and a text.
    fn information(&mut self, body: &[u8]) {
        let mut cursor = Cursor::new(body);
        let Some(key) = cursor.u8().and_then(|length| cursor.take(usize::from(length))) else { return };
        let key = String::from_utf8_lossy(key);
        if let Some((kind, key)) = key.split_once(' ')
            && kind.starts_with("char[")
            && SAID.contains(&key)
        {
            self.sink.said(key, String::from_utf8_lossy(cursor.rest()).trim_end_matches('\0').trim());
        }
    }

    fn subscribe(&mut self, body: &[u8]) {
        let mut cursor = Cursor::new(body);
        let (Some(instance), Some(id)) = (cursor.u8(), cursor.u16()) else { return };
        let name = String::from_utf8_lossy(cursor.rest()).into_owned();
        let mut layout = Layout { numbers: Vec::new(), fields: Vec::new(), time_at: None, size: 0, steps: 0 };
        let shown = if instance == 0 { name.clone() } else { format!("{name}_{instance}") };
        if layout.add(&self.formats, &name, "", 0).is_none() {
            self.sink.note(Note::NotRead { topic: shown, why: "it has no definition, or a damaged one" });
            return;
        }
        let Some(time_at) = layout.time_at else {
            self.sink.note(Note::NotRead { topic: shown, why: "it has no timestamp" });
            return;
        };
        let wanted = self.sink.topic(&Topic { name: shown, kind: name, fields: layout.fields });
        let subscription =
            Subscription { topic: self.topics, wanted, time_at, numbers: layout.numbers, values: Vec::new() };
        self.subscriptions.insert(id, subscription);
        self.topics += 1;
    }

    fn data(&mut self, body: &[u8]) {
        let mut cursor = Cursor::new(body);
        let Some(of) = cursor.u16().and_then(|id| self.subscriptions.get_mut(&id)).filter(|of| of.wanted) else {
            return;
        };
        let message = cursor.rest();
        let Some(time) = message.get(of.time_at..).and_then(|rest| Cursor::new(rest).u64()) else { return };
        let time_ns = i64::try_from(time).unwrap_or(i64::MAX).saturating_mul(1000);
        read_all(&of.numbers, message, &mut of.values);
        self.sink.message(of.topic, time_ns, &of.values);
    }
}

/// A message's numbers on the way to their places.
struct Layout {
    numbers: Vec<Number>,
    fields: Vec<Field>,
    time_at: Option<usize>,
    size: usize,
    /// Fields and parts that were looked at.
    steps: usize,
}

impl Layout {
    /// Adds the fields of a kind of message; `None` where it is unknown or endless.
    fn add(&mut self, formats: &HashMap<String, String>, name: &str, prefix: &str, depth: usize) -> Option<()> {
        let text = formats.get(name).filter(|_| depth < DEEPEST)?;
        for field in text.split(';').map(str::trim).filter(|field| !field.is_empty()) {
            let (kind, field) = field.split_once(' ')?;
            let (kind, count) = match kind.split_once('[') {
                Some((kind, count)) => (kind, Some(count.strip_suffix(']')?.parse::<usize>().ok()?)),
                None => (kind, None),
            };
            for i in 0..count.unwrap_or(1) {
                self.steps += 1;
                if self.steps > MOST_STEPS {
                    return None;
                }
                let index = count.map_or(String::new(), |_| format!("[{i}]"));
                self.one(formats, kind, &format!("{prefix}{field}{index}"), depth)?;
            }
        }
        Some(())
    }

    fn one(&mut self, formats: &HashMap<String, String>, kind: &str, name: &str, depth: usize) -> Option<()> {
        let number = match kind {
            "int8_t" => Kind::I8,
            "uint8_t" | "bool" | "char" => Kind::U8,
            "int16_t" => Kind::I16,
            "uint16_t" => Kind::U16,
            "int32_t" => Kind::I32,
            "uint32_t" => Kind::U32,
            "int64_t" => Kind::I64,
            "uint64_t" => Kind::U64,
            "float" => Kind::F32,
            "double" => Kind::F64,
            _ => return self.add(formats, kind, &format!("{name}."), depth + 1),
        };
        if name == "timestamp" && number == Kind::U64 {
            self.time_at = Some(self.size);
        } else if kind != "char" && !name.contains("_padding") {
            if self.numbers.len() >= MOST_FIELDS {
                return None;
            }
            self.numbers.push(Number { at: self.size, kind: number, scale: 1.0 });
            self.fields.push(Field::new(name));
        }
        self.size = self.size.checked_add(number.size()).filter(|size| u16::try_from(*size).is_ok())?;
        Some(())
    }
}
