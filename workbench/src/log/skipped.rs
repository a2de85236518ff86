//! Lines that are no rows, as faults.

use gyro_model::fault::{DataFault, FaultKind};
use log_readers::text::{Skip, Skipped};

/// When the first line of each kind was met: the time of the row before it, s.
#[derive(Default)]
pub struct Times(Vec<(Skip, f64)>);

impl Times {
    /// Takes note of kinds that were not there before.
    pub fn look(&mut self, skipped: &Skipped, last: f64) {
        if skipped.kinds() > self.0.len() {
            let new = skipped.iter().map(|(kind, ..)| kind).find(|kind| self.0.iter().all(|(known, _)| known != kind));
            self.0.extend(new.map(|kind| (kind, last)));
        }
    }

    fn of(&self, kind: Skip) -> f64 {
        self.0.iter().find(|(known, _)| *known == kind).map_or(0.0, |(_, t)| *t)
    }
}

/// One fault a kind, counted and located.
pub fn faults(skipped: &Skipped, times: &Times) -> impl Iterator<Item = DataFault> {
    skipped.iter().map(|(kind, count, line)| {
        let lines = if count == 1 { "1 line".to_owned() } else { format!("{count} lines") };
        let what = match kind {
            Skip::Above => format!("text above the header in {lines}: passed by"),
            Skip::Units => "a row of units below the header: read as such".to_owned(),
            Skip::HeaderAgain => {
                format!("the header again in {lines}: passed by; what follows is read as the same columns")
            }
            Skip::Remark => format!("a remark in {lines} among the rows: passed by"),
            Skip::Text => format!("text instead of a row in {lines}: passed by"),
            Skip::Torn => "the last row breaks off: left out".to_owned(),
        };
        DataFault {
            kind: FaultKind::SkippedLines,
            axis: None,
            count,
            first_t: Some(times.of(kind)),
            says: format!("{what} (first at line {line})"),
        }
    })
}
