//! Logs of CAN frames: messages of a DBC file as topics, their signals as fields. Without such a file each identifier is a
//! topic, and the length of its data the one field.

use crate::{
    can::{Database, Frame, KIND, Line, Lines, Match, Message, Signal, Writer, database::shown},
    format::{Field, Format, Note, Place, Sink, Topic, Unreadable},
    text::Skip,
    unit::{self, Unit},
};
use std::{
    collections::{BTreeSet, HashMap},
    io::{BufRead, BufReader, Read},
};

/// Their kind where nothing says what the frames mean.
pub const UNNAMED: &str = "CAN identifier";
/// The field of such a topic: bytes of data in a frame.
pub const LENGTH: &str = "length";

/// A log of frames.
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

/// Whether a format has frames, which need a DBC file.
#[must_use]
pub fn has_frames(format: &dyn Format) -> bool {
    [Writer::Candump, Writer::Asc].iter().any(|writer| Can::of(*writer).name() == format.name())
}

/// The channels of each message of a DBC file, as they are called where it is met on one bus.
#[must_use]
pub fn channels(database: &Database) -> Vec<Vec<(String, Option<Unit>)>> {
    let of = |message: &Message| {
        let channel = |signal: &Signal| (format!("{}.{}", message.name, signal.name), unit::parse(&signal.unit));
        message.signals.iter().map(channel).collect()
    };
    database.messages().iter().map(of).collect()
}

/// A longer line is none.
const LONGEST_LINE: u64 = 4096;
/// Buses that are told apart.
const MOST_BUSES: usize = 32;
/// Identifiers that are told apart.
const MOST_IDENTIFIERS: usize = 1 << 16;
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
        let mut topics = Topics::new(self.database);
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
            let Some(meaning) = topics.meaning(frame.id) else {
                if strangers.len() < MOST_IDENTIFIERS {
                    strangers.insert(frame.id);
                }
                continue;
            };
            if !whole && meaning.is_none_or(|of| frame.data().len() < of.message.length) {
                sink.note(Note::BreaksOff { at: Place::Line(at) });
                continue;
            }
            if let Some(topic) = topics.of(&frame, meaning, sink) {
                match meaning {
                    Some(of) => of.message.decode(frame.data(), &mut values),
                    None => values = vec![frame.data().len() as f64],
                }
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

/// The topics met so far: an identifier on a bus each.
struct Topics<'a> {
    database: Option<&'a Database>,
    buses: Vec<Vec<u8>>,
    /// Of bus and identifier: number, where it is wanted.
    met: HashMap<(usize, u32), Option<usize>>,
    /// The bus on which an identifier was met first.
    first: HashMap<u32, usize>,
}

impl<'a> Topics<'a> {
    fn new(database: Option<&'a Database>) -> Self {
        Self { database, buses: Vec::new(), met: HashMap::new(), first: HashMap::new() }
    }

    /// What an identifier means: `None` where the DBC file does not name it, `Some(None)` where there is no such file.
    #[allow(
        clippy::option_option,
        reason = "two questions: whether it is a topic, and whether its bits mean something"
    )]
    fn meaning(&self, id: u32) -> Option<Option<Match<'a>>> {
        match self.database {
            Some(database) => database.find(id).map(Some),
            None => Some(None),
        }
    }

    /// The number of a frame's topic where it is wanted.
    fn of(&mut self, frame: &Frame<'_>, meaning: Option<Match<'a>>, sink: &mut dyn Sink) -> Option<usize> {
        let bus = match self.buses.iter().position(|known| known == frame.bus) {
            Some(bus) => bus,
            None if self.buses.len() < MOST_BUSES => {
                self.buses.push(frame.bus.to_vec());
                self.buses.len() - 1
            }
            None => return None,
        };
        if let Some(topic) = self.met.get(&(bus, frame.id)) {
            return *topic;
        }
        if self.met.len() == MOST_IDENTIFIERS {
            return None;
        }
        let (name, fields) = match meaning {
            Some(of) => {
                let fields = of.message.signals.iter();
                (of.name(), fields.map(|of| Field { name: of.name.clone(), unit: unit::parse(&of.unit) }).collect())
            }
            None => (shown(frame.id), vec![Field::new(LENGTH)]),
        };
        let first = *self.first.entry(frame.id).or_insert(bus);
        let bus_name = String::from_utf8_lossy(&self.buses[bus]);
        let name = if first == bus { name } else { format!("{bus_name}.{name}") };
        let kind = if meaning.is_some() { KIND } else { UNNAMED }.to_owned();
        let number = self.met.len();
        let topic = sink.topic(&Topic { name, kind, fields }).then_some(number);
        self.met.insert((bus, frame.id), topic);
        topic
    }
}
