//! What keeps a live source from being of use, in words: lines that are not understood, rows that are too slow, no reference.

use super::{Address, format::Format, kind::Kind, tally::Tally};
use gyro_model::Row;
use gyro_model::words::{Argument, Voice, shell_word};

/// Slower rows miss most of what a hand or a vehicle does between them, Hz.
const SLOWEST_HZ: f64 = 20.0;
/// A rate is taken over so long, s, and so many rows.
const WINDOW_S: f64 = 2.0;
const FEWEST: u32 = 5;
/// A step that long is a hole, not a rate, s.
const HOLE_S: f64 = 5.0;
/// A reference that is slower than the gyro has come by then, s.
const REFERENCE_S: f64 = 3.0;
/// So many lines that are no rows are a source that is not understood, where they are more than the rows.
const MANY: u64 = 50;

/// Watches what comes.
#[derive(Debug, Default)]
pub struct Trouble {
    /// Whether rows hold a reference, or another source has it.
    has_reference: bool,
    /// Whether the rows are a reference themselves.
    is_reference: bool,
    began: Option<i64>,
    /// Where the window began, ns, and the rows since.
    window: Option<(i64, u32)>,
    last: i64,
    /// Rows a second.
    rate_hz: Option<f64>,
    /// The last line that was none.
    example: String,
}

impl Trouble {
    /// Of a source; `has_other` where another one gives the reference.
    pub fn new(is_reference: bool, has_other: bool) -> Self {
        Self { has_reference: has_other, is_reference, ..Self::default() }
    }

    /// Takes a row.
    pub fn row(&mut self, row: &Row) {
        if self.has_reference && self.is_reference {
            return;
        }
        let refs = row.ref_angle.iter().chain(&row.ref_rate).chain(&row.ref_quaternion);
        self.has_reference |= refs.into_iter().any(|x| x.is_finite());
        if !self.is_reference && row.gyro.iter().all(|x| x.is_nan()) {
            return;
        }
        self.began.get_or_insert(row.t_ns);
        let step = seconds(row.t_ns, self.last);
        self.last = row.t_ns;
        match &mut self.window {
            Some((from, rows)) if (0.0..HOLE_S).contains(&step) => {
                *rows += 1;
                let span = seconds(row.t_ns, *from);
                if span >= WINDOW_S && *rows >= FEWEST {
                    self.rate_hz = Some(f64::from(*rows) / span);
                    self.window = Some((row.t_ns, 0));
                }
            }
            _ => self.window = Some((row.t_ns, 0)),
        }
    }

    /// Takes what is said of a line that is no row.
    pub fn line(&mut self, says: &str) {
        says.clone_into(&mut self.example);
    }

    /// The words for it; `None` where all is well.
    pub fn says(&self, address: &Address, format: &dyn Format, tally: &Tally) -> Option<String> {
        let counts = &tally.counts;
        if counts.rows == 0 {
            let what = format.not_understood()?;
            return Some(
                format!("{what}: {}", refusal(address, format).unwrap_or_default()).trim_end_matches(": ").to_owned(),
            );
        }
        let none = counts.garbled + counts.cut;
        if none > MANY && none > counts.rows {
            return Some(format!("not understood: {none} lines beside {} rows ({})", counts.rows, self.example));
        }
        let mut parts = Vec::new();
        if let Some(rate) = self.rate_hz.filter(|rate| *rate < SLOWEST_HZ && !self.is_reference) {
            let ask = if address.format == Kind::Mavlink { MESSAGE_INTERVAL } else { "send 100 or more" };
            parts.push(format!("{rate:.1} rows a second are too few (at least {SLOWEST_HZ:.0} are needed): {ask}"));
        }
        parts.extend(format.unsure().map(str::to_owned));
        let waited = self.began.map_or(0.0, |began| seconds(self.last, began)) > REFERENCE_S;
        if waited && !self.has_reference && !self.is_reference {
            let from = if address.format == Kind::Mavlink { " (ODOMETRY or VISION_POSITION_ESTIMATE)" } else { "" };
            let what = match format.advice().filter(|advice| !advice.flags.is_empty()) {
                Some(advice) => format!("{}\n{}", advice.why, command(address, &advice.flags)),
                None => {
                    "send ref_angle_z or ref_qw … ref_qz with the rows, or give its address with --reference ADDRESS"
                        .to_owned()
                }
            };
            parts.push(format!("no reference comes{from}: without one nothing can be learned of the gyro; {what}"));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// Why what comes makes no rows, and what would: a command where there is one.
pub fn refusal(address: &Address, format: &dyn Format) -> Option<String> {
    let found = format.refusal()?;
    if format.needs_dbc() {
        return Some(format!("{found}\n{}", with_dbc(address)));
    }
    let Some(advice) = format.advice() else { return Some(found) };
    let command = match advice.flags.as_slice() {
        [] => String::new(),
        flags => format!("\n{}", command(address, flags)),
    };
    Some(format!("{found}\n{}{command}", advice.why))
}

/// The command with a DBC file.
fn with_dbc(address: &Address) -> String {
    if address.is_pipe() {
        return "truerate run --source - --dbc FILE.dbc".to_owned();
    }
    let text = address.to_string();
    let mark = if text.contains('?') { '&' } else { '?' };
    format!("truerate run --source {}", shell_word(&format!("{text}{mark}format=candump&dbc=FILE.dbc")))
}

/// The command with these maps.
fn command(address: &Address, maps: &[String]) -> String {
    let source = match &address.dbc {
        Some(dbc) if address.is_pipe() => format!("- --dbc {}", shell_word(&dbc.display().to_string())),
        None if address.is_pipe() => "-".to_owned(),
        _ => shell_word(&address.to_string()),
    };
    format!("truerate run --source {source} {}", Argument::Map(maps).typed(Voice::Log))
}

/// How an autopilot is asked for more.
const MESSAGE_INTERVAL: &str = "ask the autopilot for 100 with MAV_CMD_SET_MESSAGE_INTERVAL (message 27, RAW_IMU, 10000 µs), or set \
                                ArduPilot's SR0_RAW_SENS or SR1_RAW_SENS to 100";

fn seconds(to: i64, from: i64) -> f64 {
    to.saturating_sub(from) as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::format;

    fn says(step_ms: i64, has_reference: bool) -> Option<String> {
        let address: Address = "mavlink:udp:0.0.0.0:14550".parse().unwrap();
        let format = format::of(&address, &workbench::log::Options::default()).unwrap();
        let mut trouble = Trouble::new(false, false);
        let mut tally = Tally::default();
        for k in 0..8000 / step_ms {
            let mut row = Row { t_ns: k * step_ms * 1_000_000, ..Row::EMPTY };
            (row.gyro[2], row.ref_angle[2]) = (0.1, if has_reference { 0.0 } else { f64::NAN });
            trouble.row(&row);
            tally.counts.rows += 1;
        }
        trouble.says(&address, format.as_ref(), &tally)
    }

    #[test]
    fn slow_rows_and_a_missing_reference_are_both_said() {
        let both = says(250, false).unwrap();
        assert!(both.contains("4.0 rows a second are too few") && both.contains("no reference comes"), "{both}");
        assert!(says(10, false).is_some_and(|says| !says.contains("too few")));
        assert!(says(250, true).is_some_and(|says| !says.contains("no reference")));
        assert_eq!(says(10, true), None);
    }
}
