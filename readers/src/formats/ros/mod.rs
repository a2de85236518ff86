//! Messages of ROS, of whichever file: definitions, decoding, and topics that several senders share.

mod decode;
mod definition;
mod known;

pub use decode::Wire;
pub use known::definition;

use crate::{
    bytes::LONGEST,
    format::{Field, Note, Sink, Topic},
    packed,
};
use decode::{Message, Reading};
use definition::{Program, Step};
use std::{
    collections::{BTreeMap, HashMap},
    io::Read,
    rc::Rc,
};

/// The connections of a file: what each sends, and where it goes.
pub struct Connections<'a> {
    sink: &'a mut dyn Sink,
    topics: usize,
    by_id: BTreeMap<u32, Connection>,
    message: Message,
    /// Of a message that was packed.
    unpacked: Vec<u8>,
}

struct Connection {
    topic: String,
    kind: String,
    wire: Wire,
    program: Rc<Program>,
    /// Whether a message is a sequence of such.
    transforms: bool,
    /// Where its messages go, by what tells one part of the topic from another.
    parts: HashMap<Part, Destination>,
    stamps: Stamps,
    damaged: bool,
}

/// What tells one part of a topic from another: a frame's name, the joints of a message.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
struct Part {
    key: String,
    named: Vec<String>,
}

#[derive(Clone, Copy)]
struct Destination {
    topic: usize,
    wanted: bool,
}

/// Parts of a topic, at most.
const MOST_PARTS: usize = 256;

/// How far the log's time lies after the messages' own.
#[derive(Clone, Copy, Debug, Default)]
struct Stamps {
    count: u64,
    mean: f64,
    squares: f64,
    absent: u64,
}

impl Stamps {
    fn add(&mut self, difference_ns: i64) {
        let difference = difference_ns as f64;
        self.count += 1;
        let step = difference - self.mean;
        self.mean += step / self.count as f64;
        self.squares += step * (difference - self.mean);
    }
}

impl<'a> Connections<'a> {
    /// Of a file whose messages go there.
    pub fn new(sink: &'a mut dyn Sink) -> Self {
        Self { sink, topics: 0, by_id: BTreeMap::new(), message: Message::default(), unpacked: Vec::new() }
    }

    /// Something to be known of the file.
    pub fn note(&mut self, note: Note) {
        self.sink.note(note);
    }

    /// Tells what the log says of the vehicle, the board or the sensor.
    pub fn said(&mut self, key: &str, value: &str) {
        self.sink.said(key, value);
    }

    /// Takes up a connection; one that is there already stays.
    pub fn connect(&mut self, id: u32, topic: &str, kind: &str, wire: Wire, definition: &str) {
        if self.by_id.contains_key(&id) {
            return;
        }
        let Some(mut program) = definition::program(kind, definition, kind) else {
            self.not_read(topic, "it has no definition, or one of an unknown kind");
            return;
        };
        let transforms = matches!(program.steps.as_slice(), [Step::Repeat(None, _)]) && kind.ends_with("/TFMessage");
        if let Some(one) =
            definition::program(kind, definition, "geometry_msgs/TransformStamped").filter(|_| transforms)
        {
            program = one;
        }
        let program = Rc::new(program);
        let connection = Connection {
            topic: topic.to_owned(),
            kind: kind.to_owned(),
            wire,
            program,
            transforms,
            parts: HashMap::new(),
            stamps: Stamps::default(),
            damaged: false,
        };
        self.by_id.insert(id, connection);
    }

    /// Says that messages are not read.
    pub fn not_read(&mut self, topic: &str, why: &'static str) {
        self.sink.note(Note::NotRead { topic: topic.to_owned(), why });
    }

    /// Whether messages of a connection are read.
    #[must_use]
    pub fn knows(&self, id: u32) -> bool {
        self.by_id.contains_key(&id)
    }

    /// One message, with the log's time of it.
    pub fn message(&mut self, id: u32, log_ns: i64, bytes: &[u8]) {
        let Some(of) = self.by_id.get_mut(&id) else { return };
        // ROS 2 packs messages one by one where it is told to.
        if of.wire == Wire::Cdr && bytes.starts_with(&packed::ZSTD) {
            let mut unpacked = std::mem::take(&mut self.unpacked);
            unpacked.clear();
            let whole = packed::zstd(bytes).and_then(|of| of.take(LONGEST as u64).read_to_end(&mut unpacked)).is_ok();
            if whole && !unpacked.starts_with(&packed::ZSTD) {
                self.message(id, log_ns, &unpacked);
            }
            self.unpacked = unpacked;
            return;
        }
        // Where no part is wanted and there is but one, nothing need be read.
        if of.parts.len() == 1
            && !of.transforms
            && !of.program.steps.iter().any(tells_parts)
            && of.parts.values().all(|to| !to.wanted)
        {
            return;
        }
        let program = Rc::clone(&of.program);
        let whole = Reading::new(bytes, of.wire).and_then(|mut reading| {
            let count = if of.transforms { reading.count()? } else { 1 };
            for _ in 0..count {
                reading.run(&program, &mut self.message)?;
                give(of, &program, &self.message, log_ns, &mut self.topics, self.sink);
            }
            Some(())
        });
        if whole.is_none() && !std::mem::replace(&mut of.damaged, true) {
            self.sink
                .note(Note::NotRead { topic: of.topic.clone(), why: "some are shorter than their definition says" });
        }
    }

    /// Says at the end how the messages' own times lie to the log's.
    pub fn finish(self) {
        for of in self.by_id.values().filter(|of| of.stamps.count > 1 && of.parts.values().any(|to| to.wanted)) {
            let scatter = (of.stamps.squares / of.stamps.count as f64).sqrt();
            self.sink.note(Note::Stamps {
                topic: of.topic.clone(),
                later_ms: of.stamps.mean / 1e6,
                scatter_ms: scatter / 1e6,
                absent: of.stamps.absent,
            });
        }
    }
}

fn tells_parts(step: &Step) -> bool {
    matches!(step, Step::Key | Step::Names | Step::Repeat(None, _))
}

/// Sends a message to its part of the topic.
fn give(
    of: &mut Connection,
    program: &Program,
    message: &Message,
    log_ns: i64,
    topics: &mut usize,
    sink: &mut dyn Sink,
) {
    let part = Part { key: message.key.clone(), named: message.named.clone() };
    let to = match of.parts.get(&part) {
        Some(to) => *to,
        None if of.parts.len() >= MOST_PARTS => return,
        None => {
            let fields = program.fields.iter().chain(&message.named).map(Field::new).collect();
            let name = if message.key.is_empty() { of.topic.clone() } else { format!("{}.{}", of.topic, message.key) };
            let wanted = sink.topic(&Topic { name, kind: of.kind.clone(), fields });
            let to = Destination { topic: *topics, wanted };
            *topics += 1;
            of.parts.insert(part, to);
            to
        }
    };
    match message.stamp_ns {
        Some(stamp) => of.stamps.add(log_ns.saturating_sub(stamp)),
        None => of.stamps.absent += 1,
    }
    if to.wanted {
        sink.message(to.topic, message.stamp_ns.unwrap_or(log_ns), &message.values);
    }
}
