//! Frames of a CAN bus as lines of `candump`, and a DBC file that says what they mean: a row a frame.

use super::{
    Format, Found,
    cutter::{Cut, Cutter},
    frames::check,
};
use crate::live::{Content, Fault};
use log_readers::can::{Line, Lines, Writer, database};
use std::cell::RefCell;
use workbench::log::{Advice, Frames, Maps, advise_frames};

/// A longer line is no frame, bytes.
const LONGEST: usize = 4096;
/// Bytes of lines that are looked at for a reference.
const LOOKED_AT: usize = 1 << 20;
/// Of a line, so much is shown.
const SHOWN: usize = 80;
/// So many identifiers are named that say nothing.
const NAMED: usize = 4;

/// Finds rows in lines.
pub struct Candump {
    frames: Frames,
    lines: Lines,
    cutter: Cutter,
    /// The time of the row before, ns, as it stands there and as it was given.
    last: Option<(i64, i64)>,
    content: Content,
    /// What came before the first row.
    barren: Barren,
    maps: Maps,
    /// The first lines, to find out what may be the reference where none is named.
    first: Vec<u8>,
    advised: RefCell<Option<(u32, Option<Advice>)>>,
}

/// Frames that gave no row, while there is none.
#[derive(Default)]
struct Barren {
    frames: u64,
    untimed: bool,
    /// The first identifiers.
    strangers: Vec<u32>,
    /// There is a row.
    over: bool,
}

impl Candump {
    /// With these names of channels, and the DBC file among them.
    ///
    /// # Errors
    /// No DBC file, or none of its signals is a gyro's.
    pub fn new(maps: Maps) -> anyhow::Result<Self> {
        let frames = Frames::new(&maps)?;
        let content = Content::of(frames.layout());
        let lines = Lines::new(Writer::Candump);
        Ok(Self {
            frames,
            lines,
            cutter: Cutter::default(),
            last: None,
            content,
            barren: Barren::default(),
            maps,
            first: Vec::new(),
            advised: RefCell::default(),
        })
    }

    fn take_cut(&mut self, cut: Cut<'_>, found: &mut dyn FnMut(Found)) {
        match cut {
            Cut::Line(line) => self.understand(line, found),
            Cut::TooLong(_) => found(Found::Fault(Fault::Garbled, format!("a line of more than {LONGEST} bytes"))),
            Cut::Passed => {}
        }
    }

    fn understand(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        let shown = || String::from_utf8_lossy(&line[..line.len().min(SHOWN)]).trim().to_owned();
        if self.first.len() < LOOKED_AT && !self.frames.layout().has_reference() {
            self.first.extend_from_slice(line);
            self.first.push(b'\n');
        }
        let frame = match self.lines.next(line) {
            Line::Frame(frame) => frame,
            Line::Other => return,
            Line::Broken => {
                let framed = line.iter().any(|b| b"#[".contains(b));
                return found(Found::Fault(if framed { Fault::Garbled } else { Fault::Remark }, shown()));
            }
        };
        let Some((mut row, wrong)) = self.frames.row(&frame) else { return self.barren.add(frame.id) };
        let Some(time) = frame.time_ns else {
            self.barren.untimed = true;
            return found(Found::Fault(Fault::Time, shown()));
        };
        self.barren.over = true;
        if check(&mut row) | wrong {
            found(Found::Fault(Fault::Value, shown()));
        }
        // Stamps are whole microseconds: frames of one of them came one after the other.
        let given = match self.last {
            Some((last, given)) if last == time => given + 1,
            _ => time,
        };
        self.last = Some((time, given));
        found(Found::Row(row, i128::from(given)));
    }
}

impl Barren {
    fn add(&mut self, id: u32) {
        if self.over {
            return;
        }
        self.frames += 1;
        if self.strangers.len() < NAMED && !self.strangers.contains(&id) {
            self.strangers.push(id);
        }
    }
}

impl Format for Candump {
    fn take(&mut self, bytes: &[u8], found: &mut dyn FnMut(Found)) {
        let mut cutter = std::mem::take(&mut self.cutter);
        cutter.take(bytes, LONGEST, |cut| self.take_cut(cut, found));
        self.cutter = cutter;
    }

    fn cut(&mut self, found: &mut dyn FnMut(Found)) {
        let mut cutter = std::mem::take(&mut self.cutter);
        cutter.cut(|cut| self.take_cut(cut, found));
        self.cutter = cutter;
    }

    fn content(&self) -> Option<&Content> {
        Some(&self.content)
    }

    fn advice(&self) -> Option<Advice> {
        // It takes longer than a row: again only where much more has come.
        let much = self.first.len().checked_ilog2().unwrap_or_default();
        let mut advised = self.advised.borrow_mut();
        let (before, advice) = advised.get_or_insert_with(|| (0, None));
        if *before != much {
            (*before, *advice) = (much, advise_frames(&self.first, &self.maps));
        }
        advice.clone()
    }

    fn refusal(&self) -> Option<String> {
        let Barren { frames, untimed, strangers, over } = &self.barren;
        if *over {
            return None;
        }
        if *untimed {
            return Some("its frames have no times: send them with `candump -L`".to_owned());
        }
        let wanted = self.frames.names();
        let came: Vec<String> = strangers.iter().map(|id| database::shown(*id)).collect();
        (*frames > 0)
            .then(|| format!("{frames} frames came, none of them one of {wanted}; the first were {}", came.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use workbench::log::Options;

    const DBC: &str = "BO_ 256 IMU: 3 X\n SG_ YAW_RATE : 0|24@1- (0.001,0) [0|0] \"deg/s\" X\n";
    /// A group of SAE J1939 that any address may send.
    const GROUP: &str = "BO_ 2566844926 IMU: 8 X\n SG_ YAW_RATE : 0|64@1- (1,0) [0|0] \"rad/s\" X\n";

    #[derive(Debug, Default)]
    struct Came {
        rows: Vec<(i128, [f64; 3])>,
        faults: Vec<Fault>,
    }

    fn read(dbc: &str, text: &str) -> (Came, Candump) {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(dbc.as_bytes()).unwrap();
        let options = Options { dbc: Some(file.path().to_owned()), ..Options::default() };
        let mut format = Candump::new(Maps::load(&options).unwrap()).unwrap();
        let mut came = Came::default();
        for piece in text.as_bytes().chunks(7) {
            format.take(piece, &mut |found| match found {
                Found::Row(row, time) => came.rows.push((time, row.gyro)),
                Found::Fault(fault, _) => came.faults.push(fault),
                other => panic!("{other:?}"),
            });
        }
        (came, format)
    }

    #[test]
    fn frames_are_rows_and_what_is_none_is_counted_by_its_kind() {
        let long = format!("(1.0) can0 100#{}\n", "0".repeat(2 * LONGEST));
        let text = "(1.000001) can0 100#E80300\n(1.000001) can0 100#18FCFF\ninterface down\n(1.1) can0 100#E8030\n\
                    (1.2) can0 7FF#00\n(1.3) can0 100#R\n  can0  100   [3]  E8 03 00\n";
        let (came, format) = read(DBC, &(text.to_owned() + &long + "(1.5) can0 100#E80300\n"));
        let times: Vec<i128> = came.rows.iter().map(|row| row.0).collect();
        assert_eq!(times, [1_000_001_000, 1_000_001_001, 1_500_000_000]);
        assert!((came.rows[1].1[2] + 1_f64.to_radians()).abs() < 1e-12 && came.rows[1].1[0].is_nan(), "{came:?}");
        assert_eq!(came.faults, [Fault::Remark, Fault::Garbled, Fault::Time, Fault::Garbled]);
        assert_eq!(format.refusal(), None);
    }

    #[test]
    fn another_sender_or_bus_with_the_same_message_is_another_sensor() {
        let one = |t: u32, bus: &str, id: &str| format!("({t}.0) {bus} {id}#0100000000000000\n");
        let text = [one(1, "can0", "18FEF121"), one(2, "can0", "18FEF122"), one(3, "can1", "18FEF121")].concat();
        let (came, _) = read(GROUP, &(text + &one(4, "can0", "18FEF121")));
        assert_eq!(came.rows.iter().map(|row| row.0).collect::<Vec<_>>(), [1_000_000_000, 4_000_000_000]);
    }

    #[test]
    fn why_no_row_comes_is_said() {
        let says = |text: &str| read(DBC, text).1.refusal().unwrap();
        let strangers = says("(1.0) can0 7FF#00\n(1.1) can0 7FF#00\n(1.2) can0 00000010#\n");
        assert!(strangers.contains("3 frames came") && strangers.contains("IMU 0x100"), "{strangers}");
        assert!(strangers.ends_with("0x7FF, 0x00000010"), "{strangers}");
        assert!(says("  can0  100   [3]  E8 03 00\n").contains("candump -L"));
    }

    #[test]
    fn a_value_that_nothing_physical_has_is_none() {
        let (came, _) = read(GROUP, "(1.0) can0 18FEF121#FFFFFFFFFFFFFF7F\n");
        assert!(came.rows.len() == 1 && came.rows[0].1[2].is_nan() && came.faults == [Fault::Value], "{came:?}");
    }
}
