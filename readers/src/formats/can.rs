//! Logs of CAN frames: messages of a DBC file as topics, their signals as fields.

use crate::{
    can::{Database, Line, Lines, Writer, database::shown},
    format::{Field, Format, Note, Place, Sink, Topic, Unreadable},
    text::Skip,
    unit,
};
use std::{
    collections::{BTreeSet, HashMap},
    io::{BufRead, BufReader, Read},
};

/// The kind of all topics of such a log.
pub const KIND: &str = "CAN";

/// A log of frames. Without a DBC file nothing of it can be read.
pub struct Can<'a> {
    writer: Writer,
    database: Option<&'a Database>,
}

impl Can<'static> {
    /// As this writer writes it, without knowing what the frames mean.
    #[must_use]
    pub const fn of(writer: Writer) -> Self {
        Self { writer, database: None }
    }
}

/// The reader of a format with what a DBC file says; `None` where the format has no frames.
#[must_use]
pub fn with<'a>(format: &dyn Format, database: &'a Database) -> Option<Can<'a>> {
    let writer = [Writer::Candump, Writer::Asc].into_iter().find(|writer| Can::of(*writer).name() == format.name())?;
    Some(Can { writer, database: Some(database) })
}

/// A longer line is none.
const LONGEST_LINE: u64 = 4096;
/// Buses that are told apart.
const MOST_BUSES: usize = 32;
/// Identifiers without a meaning that are counted.
const MOST_STRANGERS: usize = 1 << 16;
/// Frames after which it is known whether their times only grow.
const LOOK: u64 = 200;

impl Format for Can<'_> {
    fn name(&self) -> &'static str {
        match self.writer {
            Writer::Candump => "CAN log (candump)",
            Writer::Asc => "CAN log (Vector ASC)",
        }
    }

    fn recognises(&self, start: &[u8]) -> bool {
        Writer::of(start) == Some(self.writer)
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let Some(database) = self.database else {
            return Err(Unreadable::Unknown("what its frames mean stands in a DBC file: give it with --dbc FILE.dbc"));
        };
        let mut topics = Topics::new(database);
        let (mut lines, mut source) = (Lines::new(self.writer), BufReader::with_capacity(1 << 18, bytes));
        let (mut line, mut number, mut values) = (Vec::new(), 0, Vec::new());
        let (mut broken, mut strangers) = ((0, 0), BTreeSet::new());
        let (mut frames, mut back, mut last) = (0_u64, 0_u64, i64::MIN);
        loop {
            line.clear();
            if source.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line)? == 0 {
                break;
            }
            let whole = line.ends_with(b"\n") || line.len() as u64 == LONGEST_LINE;
            number += u64::from(line.ends_with(b"\n"));
            let at = number + u64::from(!whole);
            // Those who write ASC end every line, and what stands behind the data is cut unseen.
            if self.writer == Writer::Asc && !whole && !line.trim_ascii().is_empty() {
                sink.note(Note::BreaksOff { at: Place::Line(at) });
                break;
            }
            let frame = match lines.next(&line) {
                Line::Frame(frame) => frame,
                Line::Other => continue,
                Line::Broken if !whole => {
                    sink.note(Note::BreaksOff { at: Place::Line(at) });
                    continue;
                }
                Line::Broken => {
                    broken = (broken.0 + 1, if broken.0 == 0 { at } else { broken.1 });
                    continue;
                }
            };
            let Some(time_ns) = frame.time_ns else {
                return Err(Unreadable::Unknown(
                    "its frames have no times: record with `candump -l`, or `candump -ta`",
                ));
            };
            frames += 1;
            back += u64::from(time_ns < last);
            last = time_ns;
            if frames == LOOK && back > LOOK / 4 {
                return Err(Unreadable::Unknown(
                    "its times are those from frame to frame: record with `candump -l`, or `candump -ta`",
                ));
            }
            let Some(place) = database.find(frame.id) else {
                if strangers.len() < MOST_STRANGERS {
                    strangers.insert(frame.id);
                }
                continue;
            };
            let message = &database.messages()[place];
            if !whole && frame.data().len() < message.length {
                sink.note(Note::BreaksOff { at: Place::Line(at) });
                continue;
            }
            if let Some(topic) = topics.of(frame.bus, place, sink) {
                message.decode(frame.data(), &mut values);
                sink.message(topic, time_ns, &values);
            }
        }
        if broken.0 > 0 {
            sink.note(Note::Skipped { kind: Skip::Text, count: broken.0, line: broken.1 });
        }
        if let Some(first) = strangers.first() {
            let more = strangers.len() - 1;
            let topic =
                if more == 0 { shown(*first) } else { format!("{} and of {more} other identifiers", shown(*first)) };
            sink.note(Note::NotRead { topic, why: "the DBC file does not name them" });
        }
        Ok(())
    }
}

/// The topics met so far: a message on a bus each.
struct Topics<'a> {
    database: &'a Database,
    buses: Vec<Vec<u8>>,
    /// Of bus and message: number, where it is wanted.
    met: HashMap<(usize, usize), Option<usize>>,
    /// The bus on which a message was met first.
    first: HashMap<usize, usize>,
}

impl<'a> Topics<'a> {
    fn new(database: &'a Database) -> Self {
        Self { database, buses: Vec::new(), met: HashMap::new(), first: HashMap::new() }
    }

    /// The number of a message's topic where it is wanted.
    fn of(&mut self, bus: &[u8], place: usize, sink: &mut dyn Sink) -> Option<usize> {
        let bus = match self.buses.iter().position(|known| known == bus) {
            Some(bus) => bus,
            None if self.buses.len() < MOST_BUSES => {
                self.buses.push(bus.to_vec());
                self.buses.len() - 1
            }
            None => return None,
        };
        if let Some(topic) = self.met.get(&(bus, place)) {
            return *topic;
        }
        let message = &self.database.messages()[place];
        let first = *self.first.entry(place).or_insert(bus);
        let name = if first == bus {
            message.name.clone()
        } else {
            format!("{}.{}", String::from_utf8_lossy(&self.buses[bus]), message.name)
        };
        let fields = message.signals.iter();
        let fields = fields.map(|of| Field { name: of.name.clone(), unit: unit::parse(&of.unit) }).collect();
        let number = self.met.len();
        let wanted = sink.topic(&Topic { name, kind: KIND.to_owned(), fields });
        let topic = wanted.then_some(number);
        self.met.insert((bus, place), topic);
        topic
    }
}
