//! A DBC file: which messages there are, and what their bits mean.
//!
//! Read are `BO_` (messages), `SG_` (signals), `SIG_VALTYPE_` (floating point) and `SG_MUL_VAL_` (signals that are there in some
//! frames only, by ranges). All else (comments, attributes, names of values) says nothing of a signal's value.

use super::{
    EXTENDED, LONGEST_FRAME, group,
    signal::{Coding, Signal},
};
use std::collections::HashMap;

/// Signals of one message; more is no message.
const MOST_SIGNALS: usize = 1024;
/// The identifier of what is no message: signals without one.
const NO_MESSAGE: u32 = 3 << 30;
/// The bits of an identifier that go over the bus, of the longer kind and of the shorter.
const LONG: u32 = (1 << 29) - 1;
const SHORT: u32 = (1 << 11) - 1;
/// Signals that say whether others are there can themselves be there in some frames only: so deep.
const DEEPEST: usize = 8;

/// The messages of a DBC file.
#[derive(Clone, Debug, Default)]
pub struct Database {
    messages: Vec<Message>,
    by_id: HashMap<u32, usize>,
    /// Of each group of J1939 the message that stands for all its senders, where one does.
    by_group: HashMap<u32, usize>,
}

/// The message that an identifier means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match<'a> {
    /// The message.
    pub message: &'a Message,
    /// Who sends the frame, where the DBC file names the message with another sender.
    pub source: Option<u8>,
}

impl Match<'_> {
    /// The message's name, with the sender where that is another: `EEC1@0x21`.
    #[must_use]
    pub fn name(&self) -> String {
        let name = &self.message.name;
        self.source.map_or_else(|| name.clone(), |source| format!("{name}@0x{source:02X}"))
    }
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The identifier, [`EXTENDED`] included.
    pub id: u32,
    /// Its name.
    pub name: String,
    /// Bytes.
    pub length: usize,
    /// Its signals.
    pub signals: Vec<Signal>,
}

/// What is wrong in a DBC file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DbcError {
    /// A line that is not what it begins as.
    #[error("line {line}: {what}")]
    Line {
        /// Which, from 1.
        line: u64,
        /// What it should be.
        what: &'static str,
    },
    /// No message at all.
    #[error("no message (BO_) in it: is it a DBC file?")]
    Empty,
}

impl Database {
    /// Reads a DBC file, in UTF-8 or Latin-1.
    ///
    /// # Errors
    /// A message or signal that is written wrong, or none at all.
    pub fn parse(bytes: &[u8]) -> Result<Self, DbcError> {
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text.trim_start_matches('\u{feff}').to_owned(),
            Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
        };
        let mut of = Parsing::default();
        // Comments may go over several lines, and look like anything.
        let mut in_string = false;
        for (number, line) in (1..).zip(text.lines()) {
            if !in_string {
                of.line(line.trim()).map_err(|what| DbcError::Line { line: number, what })?;
            }
            in_string ^= quotes(line) % 2 == 1;
        }
        if of.database.messages.is_empty() { Err(DbcError::Empty) } else { Ok(of.finished()) }
    }

    /// The messages in the file's order.
    #[must_use]
    pub fn messages(&self) -> &[Message] {
        &self.messages
    }

    /// The message with this identifier, [`EXTENDED`] included; where there is none, that of the same group of J1939 from
    /// another sender, if one message stands for the group.
    #[must_use]
    pub fn find(&self, id: u32) -> Option<Match<'_>> {
        let message = |place: usize| self.messages.get(place);
        if let Some(place) = self.by_id.get(&id) {
            return message(*place).map(|message| Match { message, source: None });
        }
        let place = *self.by_group.get(&group::number(id)?)?;
        message(place).map(|message| Match { message, source: Some(group::source(id)) })
    }

    /// Of the messages of a group that which is meant for any sender, or else the only one.
    fn group(&mut self) {
        let mut groups: HashMap<u32, Vec<usize>> = HashMap::new();
        for (place, message) in self.messages.iter().enumerate() {
            if let Some(number) = group::number(message.id) {
                groups.entry(number).or_default().push(place);
            }
        }
        let is_for_all = |place: &&usize| group::source(self.messages[**place].id) == group::ANY_SOURCE;
        let one = |places: &[usize]| match places.iter().filter(is_for_all).collect::<Vec<_>>()[..] {
            [place] => Some(*place),
            [] if places.len() == 1 => places.first().copied(),
            _ => None,
        };
        self.by_group = groups.iter().filter_map(|(number, places)| Some((*number, one(places)?))).collect();
    }
}

impl Message {
    /// The values of its signals in a frame; NaN of those that are not in it.
    pub fn decode(&self, data: &[u8], values: &mut Vec<f64>) {
        values.clear();
        values.extend(self.signals.iter().map(|signal| {
            let raw = if self.is_there(signal, data, DEEPEST) { signal.raw(data) } else { None };
            raw.map(|raw| signal.value(raw)).filter(|value| value.is_finite()).unwrap_or(f64::NAN)
        }));
    }

    fn is_there(&self, signal: &Signal, data: &[u8], depth: usize) -> bool {
        let Some((switch, ranges)) = &signal.when else { return true };
        let Some(switch) = self.signals.get(*switch).filter(|_| depth > 0) else { return false };
        let chosen = |raw| ranges.iter().any(|&(from, to)| (from..=to).contains(&raw));
        self.is_there(switch, data, depth - 1) && switch.raw(data).is_some_and(chosen)
    }
}

fn quotes(line: &str) -> usize {
    let (mut count, mut escaped) = (0, false);
    for c in line.chars() {
        count += usize::from(c == '"' && !escaped);
        escaped = c == '\\' && !escaped;
    }
    count
}

/// What a signal's line says beside the signal.
#[derive(Clone, Copy, Default)]
struct Multiplexing {
    is_switch: bool,
    at: Option<u64>,
}

/// The file while it is read.
#[derive(Default)]
struct Parsing {
    database: Database,
    /// Of the signals of each message.
    multiplexing: Vec<Vec<Multiplexing>>,
    /// Whether signals belong to the last message.
    within: bool,
}

type Parsed<T> = Result<T, &'static str>;

const BO: &str = "a message is `BO_ 256 NAME: 8 SENDER`";
const SG: &str = "a signal is `SG_ NAME : 0|16@1- (0.01,0) [0|0] \"deg/s\" RECEIVER`";
const VALTYPE: &str = "a signal's type is `SIG_VALTYPE_ 256 NAME : 1;`";
const MUL: &str = "a multiplexed signal is `SG_MUL_VAL_ 256 NAME SWITCH 0-3;`";

impl Parsing {
    fn line(&mut self, line: &str) -> Parsed<()> {
        let (word, rest) = line.split_once(|c: char| c.is_whitespace()).unwrap_or((line, ""));
        match word {
            // A file begins with a list of these words.
            _ if rest.trim().is_empty() => Ok(()),
            "BO_" => self.message(rest),
            "SG_" if self.within => self.signal(rest),
            "SIG_VALTYPE_" => self.coding(rest),
            "SG_MUL_VAL_" => self.ranges(rest),
            _ => Ok(()),
        }
    }

    fn message(&mut self, rest: &str) -> Parsed<()> {
        let (head, tail) = rest.split_once(':').ok_or(BO)?;
        let mut head = head.split_whitespace();
        let id = identifier(head.next()).ok_or(BO)?;
        let name = head.next().ok_or(BO)?.to_owned();
        let length: usize = tail.split_whitespace().next().and_then(|n| n.parse().ok()).ok_or(BO)?;
        self.within = id != NO_MESSAGE;
        if !self.within {
            return Ok(());
        }
        let taken = self.database.by_id.insert(id, self.database.messages.len());
        if taken.is_some() {
            return Err("another message has this identifier already");
        }
        self.database.messages.push(Message { id, name, length: length.min(LONGEST_FRAME), signals: Vec::new() });
        self.multiplexing.push(Vec::new());
        Ok(())
    }

    fn signal(&mut self, rest: &str) -> Parsed<()> {
        let (head, tail) = rest.split_once(':').ok_or(SG)?;
        let mut head = head.split_whitespace();
        let name = head.next().ok_or(SG)?.to_owned();
        let multiplexing = head.next().map_or(Ok(Multiplexing::default()), multiplexing)?;
        let (layout, tail) = tail.split_once('(').ok_or(SG)?;
        let (scaling, tail) = tail.split_once(')').ok_or(SG)?;
        let unit = tail.split('"').nth(1).ok_or(SG)?.trim().to_owned();
        let (start, layout) = layout.trim().split_once('|').ok_or(SG)?;
        let (length, order) = layout.split_once('@').ok_or(SG)?;
        let start =
            start.trim().parse::<u16>().ok().filter(|start| usize::from(*start) < 8 * LONGEST_FRAME).ok_or(SG)?;
        let length = length.trim().parse::<u16>().ok().filter(|length| (1..=64).contains(length));
        let length = length.ok_or("a signal has 1 to 64 bits")?;
        let (big_endian, coding) = match order.trim() {
            "0+" => (true, Coding::Unsigned),
            "0-" => (true, Coding::Signed),
            "1+" => (false, Coding::Unsigned),
            "1-" => (false, Coding::Signed),
            _ => return Err(SG),
        };
        let (factor, offset) = scaling.split_once(',').ok_or(SG)?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let (factor, offset) = number(factor).zip(number(offset)).ok_or(SG)?;
        let (Some(message), Some(of)) = (self.database.messages.last_mut(), self.multiplexing.last_mut()) else {
            return Err("a signal before the first message");
        };
        if message.signals.len() == MOST_SIGNALS {
            return Err("more than 1024 signals in one message");
        }
        message.signals.push(Signal { name, start, length, big_endian, coding, factor, offset, unit, when: None });
        of.push(multiplexing);
        Ok(())
    }

    fn find(&self, id: Option<&str>, name: Option<&str>, wrong: &'static str) -> Parsed<Option<(usize, usize)>> {
        let id = identifier(id).ok_or(wrong)?;
        let name = name.ok_or(wrong)?;
        let Some(&message) = self.database.by_id.get(&id) else { return Ok(None) };
        let signals = &self.database.messages[message].signals;
        Ok(signals.iter().position(|signal| signal.name == name).map(|signal| (message, signal)))
    }

    fn coding(&mut self, rest: &str) -> Parsed<()> {
        let rest = rest.replace([':', ';'], " ");
        let mut words = rest.split_whitespace();
        let Some((message, signal)) = self.find(words.next(), words.next(), VALTYPE)? else { return Ok(()) };
        let signal = &mut self.database.messages[message].signals[signal];
        match (words.next(), signal.length) {
            (Some("1"), 32) => signal.coding = Coding::Single,
            (Some("2"), 64) => signal.coding = Coding::Double,
            (Some("0"), _) => {}
            (Some("1" | "2"), _) => return Err("a floating-point signal has 32 bits (type 1) or 64 (type 2)"),
            _ => return Err(VALTYPE),
        }
        Ok(())
    }

    fn ranges(&mut self, rest: &str) -> Parsed<()> {
        let rest = rest.replace([',', ';'], " ");
        let mut words = rest.split_whitespace();
        let Some((message, signal)) = self.find(words.next(), words.next(), MUL)? else { return Ok(()) };
        let switch = words.next().ok_or(MUL)?;
        let signals = &mut self.database.messages[message].signals;
        let switch = signals.iter().position(|of| of.name == switch).ok_or("the message has no such switch")?;
        let range = |word: &str| {
            let (from, to) = word.split_once('-')?;
            Some((from.parse().ok()?, to.parse().ok()?))
        };
        let ranges: Option<Vec<(u64, u64)>> = words.map(range).collect();
        signals[signal].when = Some((switch, ranges.filter(|ranges| !ranges.is_empty()).ok_or(MUL)?));
        Ok(())
    }

    /// Signals of which no ranges are named go by the message's one switch.
    fn finished(mut self) -> Database {
        for (message, multiplexing) in self.database.messages.iter_mut().zip(&self.multiplexing) {
            let switch = multiplexing.iter().position(|of| of.is_switch && of.at.is_none());
            for (signal, of) in message.signals.iter_mut().zip(multiplexing) {
                if let (None, Some(at), Some(switch)) = (&signal.when, of.at, switch) {
                    signal.when = Some((switch, vec![(at, at)]));
                }
            }
        }
        self.database.group();
        self.database
    }
}

/// An identifier as a DBC file writes it, [`EXTENDED`] set where it has 29 bits. What has more than 11 bits has 29, whether or
/// not the file says so; what some programs note in the bits between is none of it.
fn identifier(word: Option<&str>) -> Option<u32> {
    let id: u32 = word?.parse().ok()?;
    Some(match id {
        NO_MESSAGE | 0..=SHORT => id,
        _ => id & LONG | EXTENDED,
    })
}

/// `M`, `m3` or `m3M`.
fn multiplexing(word: &str) -> Parsed<Multiplexing> {
    let (rest, is_switch) = word.strip_suffix('M').map_or((word, false), |rest| (rest, true));
    if rest.is_empty() {
        return Ok(Multiplexing { is_switch, at: None });
    }
    let at =
        rest.strip_prefix('m').and_then(|at| at.parse().ok()).ok_or("a multiplexed signal has `M`, `m3` or `m3M`")?;
    Ok(Multiplexing { is_switch, at: Some(at) })
}

/// An identifier as it is shown: `0x123`, with eight digits where it has 29 bits.
#[must_use]
pub fn shown(id: u32) -> String {
    if id & EXTENDED == 0 { format!("0x{id:03X}") } else { format!("0x{:08X}", id & !EXTENDED) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "VERSION \"\"\nNS_ :\n\tSIG_VALTYPE_\n\tSG_MUL_VAL_\n\tBO_TX_BU_\nBS_:\nBU_: IMU\nBO_ 256 IMU: 8 IMU\n SG_ MODE M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ A m0 : 8|16@1- (0.5,1) [0|0] \"deg/s\" X\n \
        SG_ B m1M : 8|8@1+ (1,0) [0|0] \"\" X\n SG_ C m2 : 16|32@1- (1,0) [0|0] \"\" X\n\nBO_ 2566844885 FAR: 8 X\n SG_ D : 7|16@0+ (1,0) [0|0] \"\" X\n\
        BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n SG_ E : 0|8@1+ (1,0) [0|0] \"\" X\nCM_ SG_ 256 A \"over\nBO_ several lines \\\" and\nSG_ more\";\n\
        SIG_VALTYPE_ 256 C : 1;\nSG_MUL_VAL_ 256 C B 3-4, 7-7;\n";

    #[test]
    fn messages_signals_switches_and_types_are_read() {
        let database = Database::parse(FILE.as_bytes()).unwrap();
        assert_eq!(database.messages().len(), 2);
        assert_eq!(database.messages()[1].id, 0x18fe_f1d5 | EXTENDED);
        let message = database.find(256).unwrap().message;
        let mut values = Vec::new();
        let mut of = |data: &[u8]| {
            message.decode(data, &mut values);
            values.clone()
        };
        let a = of(&[0, 0xfe, 0xff, 0, 0, 0, 0, 0]);
        assert!(a[0] == 0.0 && a[1] == 0.0 && a[2].is_nan() && a[3].is_nan(), "{a:?}");
        let [w, x, y, z] = 1.5_f32.to_le_bytes();
        let c = of(&[1, 4, w, x, y, z, 0, 0]);
        assert!(c[1].is_nan() && c[2] == 4.0 && c[3] == 1.5, "{c:?}");
        assert!(of(&[1, 5, w, x, y, z, 0, 0])[3].is_nan() && of(&[0, 4, w, x, y, z, 0, 0])[3].is_nan());
        assert!(of(&[1, 4, w, x])[3].is_nan());
    }

    #[test]
    fn bits_that_do_not_go_over_the_bus_are_no_part_of_an_identifier() {
        let of = |id: u32| {
            let text = format!("BO_ {id} A: 8 X\n SG_ B : 0|32@1- (1,0) [0|0] \"\" X\nSIG_VALTYPE_ {id} B : 1;\n");
            Database::parse(text.as_bytes()).map(|of| (of.messages()[0].id, of.messages()[0].signals[0].coding))
        };
        for id in [0x98fe_f1d5, 0xd8fe_f1d5, 0xf8fe_f1d5, 0x18fe_f1d5] {
            assert_eq!(of(id), Ok((0x18fe_f1d5 | EXTENDED, Coding::Single)), "{id:#x}");
        }
        assert_eq!(of(0x7ff), Ok((0x7ff, Coding::Single)));
        assert_eq!(of(0xc000_0000), Err(DbcError::Empty), "VECTOR__INDEPENDENT_SIG_MSG");
    }

    #[test]
    fn a_sender_that_the_file_does_not_name_is_found_by_the_group() {
        let of = |ids: &[u32]| {
            let text = |(k, id): (usize, &u32)| format!("BO_ {} M{k}: 8 X\n", id | EXTENDED);
            Database::parse(ids.iter().enumerate().map(text).collect::<String>().as_bytes()).unwrap()
        };
        let named = |of: &Database, id: u32| of.find(id | EXTENDED).map(|found| found.name());
        let any = of(&[0x18f0_2afe]);
        assert_eq!(named(&any, 0x18f0_2afe).as_deref(), Some("M0"));
        assert_eq!(named(&any, 0x0cf0_2a80).as_deref(), Some("M0@0x80"), "another priority");
        assert_eq!(named(&any, 0x18f0_2b80), None);
        assert_eq!(any.find(0xf02a), None, "11 bits have no group");
        let two = of(&[0x18f0_2a00, 0x18f0_2a27]);
        assert_eq!(named(&two, 0x18f0_2a27).as_deref(), Some("M1"));
        assert_eq!(named(&two, 0x18f0_2a80), None, "two layouts, and none is said to be meant");
        for ids in [[0x18f0_2a00, 0x18f0_2a27, 0x18f0_2afe], [0x18f0_2afe, 0x18f0_2a00, 0x18f0_2a27]] {
            let place = ids.iter().position(|id| id & 0xff == 0xfe).unwrap();
            assert_eq!(named(&of(&ids), 0x18f0_2a80), Some(format!("M{place}@0x80")));
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, says) in [
            ("", "no message"),
            ("t,gyro_z\n0,1\n", "no message"),
            ("\nBO_ x IMU: 8 X", "line 2: a message is"),
            ("BO_ 1 A: 8 X\n SG_ B : 0|65@1+ (1,0) [0|0] \"\" X", "line 2: a signal has 1 to 64 bits"),
            ("BO_ 1 A: 8 X\n SG_ B : 0|8@2+ (1,0) [0|0] \"\" X", "line 2: a signal is"),
            ("BO_ 1 A: 8 X\n SG_ B : 0|8@1+ (nan,0) [0|0] \"\" X", "line 2: a signal is"),
            ("BO_ 1 A: 8 X\nBO_ 1 B: 8 X", "line 2: another message"),
            ("BO_ 1 A: 8 X\n SG_ B : 0|8@1+ (1,0) [0|0] \"\" X\nSIG_VALTYPE_ 1 B : 1;", "line 3: a floating-point"),
        ] {
            let error = Database::parse(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(says), "{text:?}: {error}");
        }
    }
}
