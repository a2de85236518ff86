//! Lines of comma-separated fields below a header, as logs have them. What stands above the header, and every line that
//! is no row, is passed over.

use super::{
    Format, Found,
    cutter::{Cut, Cutter},
};
use crate::{
    live::{Content, Fault},
    log::{Layout, LogError, Maps, Options, Problem, Refusal, RowFault, RowParser},
};
use anyhow::anyhow;
use log_readers::text::{CSV, TextRow};
use std::{ops::Range, path::Path};

/// A longer line is no row, bytes.
const LONGEST: usize = 1 << 16;
/// Of a line, so much is shown.
const SHOWN: usize = 80;

/// Finds rows in lines.
pub struct Lines {
    maps: Maps,
    cutter: Cutter,
    /// Lines that have begun so far.
    number: u64,
    /// The places of a line's fields.
    places: Vec<Range<usize>>,
    columns: Option<Columns>,
    content: Option<Content>,
    refusal: Option<Problem>,
}

/// What the header says.
struct Columns {
    layout: Layout,
    parser: RowParser,
    header: Vec<u8>,
}

impl Columns {
    fn new(layout: Layout, header: &[u8]) -> Self {
        Self { parser: RowParser::new(&layout, CSV), layout, header: header.to_vec() }
    }
}

impl Lines {
    /// A header that is given makes one in the stream needless.
    ///
    /// # Errors
    /// A header or a column map that is none.
    pub fn new(header: Option<&str>, columns: Option<&Path>, is_reference: bool) -> anyhow::Result<Self> {
        let options = Options { columns: columns.map(Path::to_owned), ..Options::default() };
        let maps = Maps::load(&options).map_err(|problem| LogError::new("--columns", None, None, problem))?;
        let maps = if is_reference { maps.for_a_reference() } else { maps };
        let mut lines = Self {
            maps,
            cutter: Cutter::default(),
            number: 0,
            places: Vec::new(),
            columns: None,
            content: None,
            refusal: None,
        };
        if let Some(header) = header {
            match lines.header(header.as_bytes()) {
                Ok(layout) => lines.adopt(layout, header.as_bytes()),
                Err((_, problem)) => return Err(anyhow!("the header {header} of the source: {problem}")),
            }
        }
        Ok(lines)
    }

    fn adopt(&mut self, layout: Layout, header: &[u8]) {
        self.content.get_or_insert_with(|| Content::of(&layout));
        self.columns = Some(Columns::new(layout, header));
    }

    fn take_cut(&mut self, cut: Cut<'_>, found: &mut dyn FnMut(Found)) {
        match cut {
            Cut::Line(line) => {
                self.number += 1;
                if !line.trim_ascii().is_empty() {
                    self.understand(line.trim_ascii(), found);
                }
            }
            Cut::TooLong => {
                let says = format!("line {}: more than {LONGEST} bytes", self.number + 1);
                found(Found::Fault(Fault::Garbled, says));
            }
            Cut::Passed => self.number += 1,
        }
    }

    /// A line understood as a header.
    fn header(&self, line: &[u8]) -> Result<Layout, Refusal> {
        let mut places = Vec::new();
        CSV.split(line, &mut places);
        Layout::of_names(&places.into_iter().map(|place| &line[place]).collect::<Vec<_>>(), &self.maps)
    }

    fn understand(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        let Some(columns) = &mut self.columns else { return self.look_for_header(line, found) };
        CSV.split(line, &mut self.places);
        match columns.parser.parse(TextRow::new(line, &self.places, self.number), &columns.layout) {
            Ok(parsed) => {
                for &(fault, column) in &parsed.faults {
                    let fault = match fault {
                        RowFault::TextColumn | RowFault::TimerOverflow => continue,
                        RowFault::NoTime => Fault::Time,
                        _ => Fault::Value,
                    };
                    found(Found::Fault(fault, format!("line {}, column {}: {}", self.number, column + 1, shown(line))));
                }
                if let Some(time) = parsed.time {
                    found(Found::Row(parsed.row, time));
                }
            }
            Err(_) if line == columns.header => {
                found(Found::Fault(Fault::Remark, format!("line {}: the header again", self.number)));
                found(Found::Begins);
            }
            Err((_, Problem::Length { .. })) => self.other(Fault::Cut, line, found),
            Err(_) => self.other(Fault::Garbled, line, found),
        }
    }

    /// A line that is no row: another header of the same channels, text, or a row that is spoilt.
    fn other(&mut self, fault: Fault, line: &[u8], found: &mut dyn FnMut(Found)) {
        let header = self.header(line).ok();
        let same = |layout: &Layout| self.content.as_ref().is_some_and(|known| Content::of(layout) == *known);
        if let Some(layout) = header.filter(same) {
            found(Found::Fault(Fault::Remark, format!("line {}: another header: {}", self.number, shown(line))));
            found(Found::Begins);
            self.adopt(layout, line);
            return;
        }
        let fault = if looks_like_numbers(line) { fault } else { Fault::Remark };
        found(Found::Fault(fault, format!("line {}: {}", self.number, shown(line))));
    }

    fn look_for_header(&mut self, line: &[u8], found: &mut dyn FnMut(Found)) {
        let refusal = match self.header(line) {
            Ok(layout) => return self.adopt(layout, line),
            Err(refusal) => refusal,
        };
        // NumPy puts `#` before a header.
        if let Some(Ok(layout)) = line.strip_prefix(b"#").map(|bare| self.header(bare)) {
            return self.adopt(layout, line);
        }
        self.refusal.get_or_insert(refusal.1);
        found(Found::Fault(Fault::Remark, format!("line {}, above the header: {}", self.number, shown(line))));
    }
}

impl Format for Lines {
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
        self.content.as_ref()
    }

    fn refusal(&self) -> Option<String> {
        self.refusal.as_ref().filter(|_| self.columns.is_none()).map(ToString::to_string)
    }
}

/// Whether a line consists mostly of what numbers are written with.
fn looks_like_numbers(line: &[u8]) -> bool {
    let numeric = line.iter().filter(|b| b.is_ascii_digit() || b"+-.,eE ".contains(b)).count();
    2 * numeric > line.len()
}

/// A line for a message: what cannot be shown is escaped.
fn shown(line: &[u8]) -> String {
    let more = if line.len() > SHOWN { "…" } else { "" };
    format!("{}{more}", line[..line.len().min(SHOWN)].escape_ascii())
}

#[cfg(test)]
mod tests {
    use super::{
        Fault::{self, Cut, Garbled, Remark, Time, Value},
        Format, Found, Lines,
    };

    /// Rows as (time, gyro z), and faults, of a text that comes in pieces of so many bytes.
    fn read(text: &[u8], piece: usize) -> (Vec<(i128, f64)>, Vec<Fault>) {
        let mut lines = Lines::new(None, None, false).unwrap();
        let (mut rows, mut faults) = (Vec::new(), Vec::new());
        let mut found = |found| match found {
            Found::Row(row, time) => rows.push((time, row.gyro[2])),
            Found::Fault(fault, _) => faults.push(fault),
            _ => {}
        };
        for piece in text.chunks(piece) {
            lines.take(piece, &mut found);
        }
        lines.cut(&mut found);
        (rows, faults)
    }

    #[test]
    fn rows_are_found_among_boot_text_garbage_and_headers_however_the_bytes_come() {
        let text =
            b"rst:0x1 (POWERON)\r\nboot ok\nt,gyro_z,ref_angle_z\n0,0.1,1\r\n\n0.01,0.2,1\n0.02,0.3\n0.03,0.\xff4,1\n\
                     t,gyro_z,ref_angle_z\n0.04,inf,1\n,0.6,1\n0.06,0.7,1\n0.07,0.8,1";
        for piece in [1, 2, 3, 7, 1000] {
            let (rows, faults) = read(text, piece);
            let times: Vec<i128> = rows.iter().map(|r| r.0 / 10_000_000).collect();
            assert_eq!(times, [0, 1, 4, 6, 7]);
            assert!(rows[2].1.is_nan() && rows[4].1 == 0.8);
            assert_eq!(faults, [Remark, Remark, Cut, Garbled, Remark, Value, Time]);
        }
    }

    #[test]
    fn a_line_without_end_costs_itself_alone() {
        let mut text = b"t,gyro_z\n0,1\n".to_vec();
        text.resize(text.len() + 200_000, b'7');
        text.extend(b"\n1,2\n");
        let (rows, faults) = read(&text, 4096);
        assert_eq!((rows.len(), faults), (2, vec![Garbled]));
    }

    #[test]
    fn a_header_in_the_address_serves_where_the_stream_has_none() {
        let mut lines = Lines::new(Some("t_ms,gyro_z_dps"), None, false).unwrap();
        let mut rows = 0;
        lines.take(b"3,4.5\n4,4.5\n", &mut |found| rows += usize::from(matches!(found, Found::Row(..))));
        assert_eq!((rows, lines.content().unwrap().gyros.len()), (2, 1));
        assert!(Lines::new(Some("t_ms,temp"), None, false).is_err());
    }

    #[test]
    fn a_reference_needs_no_gyro() {
        let mut lines = Lines::new(None, None, true).unwrap();
        let mut angles = Vec::new();
        lines.take(b"boot\nt,ref_angle_z\n0,0.5\n1,0.25\n", &mut |found| {
            if let Found::Row(row, _) = found {
                assert!(row.gyro[0].is_nan());
                angles.push(row.ref_angle[2]);
            }
        });
        assert_eq!(angles, [0.5, 0.25]);
    }
}
