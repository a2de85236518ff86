//! ArduPilot's `.bin`: messages that define messages, then data.
//!
//! A message is two bytes that begin it, its type, one byte, and a body whose length its definition says. Where no message
//! begins, the next beginning is looked for.

use super::primitive::{Kind, Number, read_all};
use crate::{
    bytes::{Bytes, Cursor},
    format::{Field, Format, Note, Place, Sink, Topic, Unreadable},
    unit::{self, Unit},
};
use std::{
    collections::{BTreeMap, HashMap},
    io::Read,
};

const HEAD: [u8; 2] = [0xa3, 0x95];
/// The type of the message that defines messages, and the length of its body.
const DEFINITION: u8 = 128;
const DEFINITION_LENGTH: usize = 86;

/// ArduPilot's `.bin`.
pub struct ArduPilot;

impl Format for ArduPilot {
    fn name(&self) -> &'static str {
        "ArduPilot log"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        start.len() >= 3 && start[..2] == HEAD && start[2] == DEFINITION
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut bytes = Bytes::new(bytes);
        let mut log = Log { definitions: BTreeMap::new(), units: HashMap::new(), topics: 0, sink, values: Vec::new() };
        log.define(DEFINITION, &[]);
        let mut damaged: Option<(u64, u64)> = None;
        while let Some(&[a, b, kind]) = bytes.peek(3)?.first_chunk() {
            let length = if kind == DEFINITION { Some(DEFINITION_LENGTH) } else { log.length(kind) };
            let (true, Some(length)) = ([a, b] == HEAD, length) else {
                damaged = Some(damaged.map_or((bytes.position(), 1), |(at, count)| (at, count + 1)));
                bytes.skip(1)?;
                continue;
            };
            if let Some((at, count)) = damaged.take() {
                log.sink.note(Note::Damaged { at: Place::Byte(at), bytes: count });
            }
            let at = bytes.position();
            bytes.take(3)?;
            let Some(body) = bytes.take(length)? else {
                log.sink.note(Note::BreaksOff { at: Place::Byte(at) });
                return Ok(());
            };
            log.message(kind, body);
        }
        if (1..3).contains(&bytes.peek(3)?.len()) {
            log.sink.note(Note::BreaksOff { at: Place::Byte(bytes.position()) });
        }
        if let Some((at, count)) = damaged {
            log.sink.note(Note::Damaged { at: Place::Byte(at), bytes: count });
        }
        Ok(())
    }
}

struct Log<'a> {
    definitions: BTreeMap<u8, Definition>,
    /// What the letters of units stand for.
    units: HashMap<u8, Unit>,
    topics: usize,
    sink: &'a mut dyn Sink,
    values: Vec<f64>,
}

struct Definition {
    name: String,
    length: usize,
    columns: Vec<Column>,
    /// Those of the columns that are none of text.
    numbers: Vec<Number>,
    /// Where the time stands, and what it is multiplied by to be nanoseconds.
    time: Option<(Number, i64)>,
    instance: Option<usize>,
    /// Topics by instance: number, and whether it is wanted.
    topics: HashMap<u8, (usize, bool)>,
}

struct Column {
    label: String,
    at: usize,
    is_number: bool,
    /// The letter of its unit.
    unit: u8,
}

impl Log<'_> {
    fn length(&self, kind: u8) -> Option<usize> {
        self.definitions.get(&kind).map(|of| of.length)
    }

    fn message(&mut self, kind: u8, body: &[u8]) {
        if kind == DEFINITION {
            let Some((&of, rest)) = body.split_first() else { return };
            self.define(of, rest);
            return;
        }
        let Some(of) = self.definitions.get_mut(&kind) else { return };
        match of.name.as_str() {
            "MSG" => {
                if let Some(words) = of.columns.iter().find(|column| column.label == "Message")
                    && let Some(words) = body.get(words.at..)
                {
                    said(&text(&words[..words.len().min(64)]), self.sink);
                }
            }
            "UNIT" => {
                // Time, letter, name.
                if let (Some(&letter), Some(name)) = (body.get(8), body.get(9..))
                    && let Some(unit) = unit::parse(&text(name))
                {
                    self.units.insert(letter, unit);
                }
                return;
            }
            "FMTU" => {
                // Time, type, a letter a field.
                if let (Some(kind), Some(letters)) = (body.get(8), body.get(9..25))
                    && let Some(of) = self.definitions.get_mut(kind)
                {
                    for (column, letter) in of.columns.iter_mut().zip(letters) {
                        column.unit = *letter;
                    }
                    let marked = of.columns.iter().find(|column| column.unit == b'#' && column.is_number);
                    of.instance = marked.map(|column| column.at).or(of.instance);
                }
                return;
            }
            _ => {}
        }
        let Some((time, unit)) = of.time else { return };
        let instance = of.instance.and_then(|at| body.get(at).copied()).unwrap_or(0);
        let units = &self.units;
        let (topic, wanted) = if let Some(known) = of.topics.get(&instance) {
            *known
        } else {
            let name = if of.instance.is_some() { format!("{}[{instance}]", of.name) } else { of.name.clone() };
            let numbers = of.columns.iter().filter(|column| column.is_number);
            let fields =
                numbers.map(|column| Field { name: column.label.clone(), unit: units.get(&column.unit).copied() });
            let wanted = self.sink.topic(&Topic { name, kind: of.name.clone(), fields: fields.collect() });
            let known = (self.topics, wanted);
            self.topics += 1;
            of.topics.insert(instance, known);
            known
        };
        if wanted {
            let raw = time.kind.read(body, time.at, false);
            if !raw.is_finite() {
                return;
            }
            let time_ns = (raw as i64).saturating_mul(unit);
            read_all(&of.numbers, body, &mut self.values);
            self.sink.message(topic, time_ns, &self.values);
        }
    }

    /// Takes up the definition of a message type.
    fn define(&mut self, kind: u8, body: &[u8]) {
        let mut cursor = Cursor::new(body);
        let (Some(length), Some(name), Some(format), Some(labels)) =
            (cursor.u8(), cursor.take(4), cursor.take(16), cursor.take(64))
        else {
            return;
        };
        if usize::from(length) < 3 || kind == DEFINITION {
            return;
        }
        let labels: Vec<String> = text(labels).split(',').map(str::to_owned).collect();
        let mut of = Definition {
            name: text(name),
            length: usize::from(length) - 3,
            columns: Vec::new(),
            numbers: Vec::new(),
            time: None,
            instance: None,
            topics: HashMap::new(),
        };
        let mut at = 0;
        for (letter, label) in text(format).bytes().zip(labels) {
            let Some((number, size)) = kind_of(letter) else { break };
            let number = number.map(|(kind, scale)| Number { at, kind, scale });
            match (label.as_str(), number) {
                ("TimeUS", Some(number)) => of.time = Some((number, 1000)),
                ("TimeMS", Some(number)) => of.time = Some((number, 1_000_000)),
                ("I", Some(number)) if number.kind == Kind::U8 => of.instance = Some(at),
                _ => {}
            }
            of.columns.push(Column { label, at, is_number: number.is_some(), unit: 0 });
            of.numbers.extend(number);
            at += size;
        }
        self.definitions.insert(kind, of);
    }
}

/// What a message at the start says: `ArduCopter V4.3.1 (a1b2c3d4)`, and `fmuv5 00380035 3035510B 32343536`, a board and its serial number.
fn said(words: &str, sink: &mut dyn Sink) {
    let parts: Vec<&str> = words.split_whitespace().collect();
    let is_serial = |part: &&str| part.len() == 8 && part.bytes().all(|b| b.is_ascii_hexdigit());
    match parts.as_slice() {
        [board @ .., a, b, c] if !board.is_empty() && [a, b, c].into_iter().all(is_serial) => {
            sink.said("board", &board.join(" "));
            sink.said("sys_uuid", &[*a, *b, *c].concat());
        }
        [vehicle, version, ..] if vehicle.starts_with("Ardu") && version.starts_with('V') => {
            sink.said("ver_sw", words);
        }
        _ => {}
    }
}

/// Text that ends with a zero byte.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

/// A number with its scale, or none for text.
type Scaled = Option<(Kind, f64)>;

/// What a letter of a format stands for, and its size.
fn kind_of(letter: u8) -> Option<(Scaled, usize)> {
    let number = |kind: Kind, scale| Some((Some((kind, scale)), kind.size()));
    match letter {
        b'b' => number(Kind::I8, 1.0),
        b'B' | b'M' => number(Kind::U8, 1.0),
        b'h' => number(Kind::I16, 1.0),
        b'H' => number(Kind::U16, 1.0),
        b'i' => number(Kind::I32, 1.0),
        b'I' => number(Kind::U32, 1.0),
        b'q' => number(Kind::I64, 1.0),
        b'Q' => number(Kind::U64, 1.0),
        b'f' => number(Kind::F32, 1.0),
        b'd' => number(Kind::F64, 1.0),
        b'c' => number(Kind::I16, 0.01),
        b'C' => number(Kind::U16, 0.01),
        b'e' => number(Kind::I32, 0.01),
        b'E' => number(Kind::U32, 0.01),
        b'L' => number(Kind::I32, 1e-7),
        b'n' => Some((None, 4)),
        b'N' => Some((None, 16)),
        b'Z' | b'a' => Some((None, 64)),
        b'g' => Some((None, 2)),
        _ => None,
    }
}
