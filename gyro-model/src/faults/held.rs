//! Channels that were logged faster than they are read: each reading stands in several rows, one after the other.
//!
//! The first row is the one nearest to when it was taken; what the others repeat is as late as they are. A quantised
//! reading may repeat too, but not between changes of many of its steps.

use super::{Report, quantum};
use crate::{Axis, Record, Row, fault::FaultKind, measured::and};

/// Leaves of each reading the first row that it stands in.
#[derive(Clone, Debug, Default)]
pub struct Held(Vec<Channel>);

/// One channel whose readings stand in several rows.
#[derive(Clone, Debug)]
struct Channel {
    index: usize,
    /// Rows that a reading usually stands in at most: one that stands longer was read again and is the same.
    usual: usize,
    /// Of an angle or an orientation its step, rad.
    step: Option<f64>,
    last: [f64; 4],
    /// Rows since the last one that was left.
    since: usize,
    /// What the gyro turned since then, rad, up to this time, ns.
    turned: [f64; 3],
    t_ns: i64,
    /// Rows of which a repeat was taken out, and when the first of them was, ns.
    repeats: u64,
    first_t_ns: Option<i64>,
}

/// Rows at the beginning of a log that say enough of it, where it is read but once.
pub const LOOKED_AT: usize = 20_000;

/// Three gyros, three angles, three rates, one orientation.
const CHANNELS: usize = 10;

fn name(channel: usize) -> String {
    let axis = Axis::ALL[channel % 3];
    match channel {
        0..3 => format!("gyro_{axis}"),
        3..6 => format!("ref_angle_{axis}"),
        6..9 => format!("ref_rate_{axis}"),
        _ => "the reference orientation".to_owned(),
    }
}

/// A channel's reading, filled up with zeros; `None` where there is none.
fn reading(row: &Row, channel: usize) -> Option<[f64; 4]> {
    let reading = match channel {
        0..3 => [row.gyro[channel], 0.0, 0.0, 0.0],
        3..6 => [row.ref_angle[channel - 3], 0.0, 0.0, 0.0],
        6..9 => [row.ref_rate[channel - 6], 0.0, 0.0, 0.0],
        _ => row.ref_quaternion,
    };
    reading.iter().all(|x| x.is_finite()).then_some(reading)
}

/// How many numbers a channel's reading is.
fn parts(channel: usize) -> usize {
    if channel < 9 { 1 } else { 4 }
}

fn forget(row: &mut Row, channel: usize) {
    match channel {
        0..3 => row.gyro[channel] = f64::NAN,
        3..6 => row.ref_angle[channel - 3] = f64::NAN,
        6..9 => row.ref_rate[channel - 6] = f64::NAN,
        _ => row.ref_quaternion.fill(f64::NAN),
    }
}

impl Channel {
    /// Adds what the gyro turned since the row before.
    fn turn(&mut self, row: &Row) {
        let dt = (row.t_ns - std::mem::replace(&mut self.t_ns, row.t_ns)) as f64 * 1e-9;
        for (turned, rate) in self.turned.iter_mut().zip(row.gyro).filter(|(_, rate)| rate.is_finite()) {
            *turned += rate * dt.clamp(0.0, LONGEST);
        }
    }

    /// Whether the gyro turned by so much that a reading of now would be another one: what stands on is a reading that was lost.
    fn has_turned(&self) -> bool {
        let turned = match self.index {
            3..6 => self.turned[self.index - 3].abs(),
            _ => self.turned.iter().map(|turned| turned * turned).sum::<f64>().sqrt(),
        };
        self.step.is_some_and(|step| turned > (STEPS * step).max(TURNED))
    }
}

/// Times as long as usual that a reading may stand for others that were lost: a sensor that repeats one for longer is stuck.
const LOST: usize = 4;
/// A bias may make that in a moment, rad; a gap counts for no more than that, s.
const TURNED: f64 = 0.01;
const LONGEST: f64 = 0.1;

impl Held {
    /// What these rows show, which may be the first of more.
    #[must_use]
    pub fn of(rows: &[Row]) -> Self {
        let channel = |index: usize| {
            let readings: Vec<[f64; 4]> = rows.iter().filter_map(|row| reading(row, index)).collect();
            let part = |c: usize| stands_in(&readings.iter().map(|r| r[c]).collect::<Vec<f64>>());
            let usual = (0..parts(index)).filter_map(part).max()?;
            let step = (0..parts(index)).map(|c| quantum(&readings.iter().map(|r| r[c]).collect::<Vec<f64>>()));
            let step = step.reduce(f64::max).filter(|_| matches!(index, 3..6 | 9));
            let (last, turned) = ([f64::NAN; 4], [0.0; 3]);
            Some(Channel { index, usual, step, last, since: 0, turned, t_ns: 0, repeats: 0, first_t_ns: None })
        };
        Self((0..CHANNELS).filter_map(channel).collect())
    }

    /// Takes out of the next row what only repeats the rows before.
    pub fn take(&mut self, row: &mut Row) {
        for channel in &mut self.0 {
            let Some(reading) = reading(row, channel.index) else { continue };
            channel.turn(row);
            let stood = channel.since + 1;
            let is_again = stood >= channel.usual && (stood >= LOST * channel.usual || !channel.has_turned());
            channel.since = if reading != channel.last || is_again { 0 } else { channel.since + 1 };
            channel.last = reading;
            if channel.since == 0 {
                channel.turned = [0.0; 3];
            }
            if channel.since != 0 {
                channel.repeats += 1;
                channel.first_t_ns.get_or_insert(row.t_ns);
                forget(row, channel.index);
            }
        }
    }

    /// What is logged faster than it is read, in words; `None` where nothing is.
    #[must_use]
    pub fn says(&self) -> Option<String> {
        let names: Vec<String> = self.0.iter().map(|channel| name(channel.index)).collect();
        (!names.is_empty()).then(|| {
            format!(
                "{} logged faster than read: of rows that repeat a reading the first one is taken",
                names.join(", ")
            )
        })
    }
}

/// Takes the repeats out of a whole log, and says so.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let mut held = Held::of(&record.rows);
    record.rows.iter_mut().for_each(|row| held.take(row));
    // Channels of one sensor that are held in the same way are one fault.
    for alike in held.0.chunk_by(|a, b| a.index / 3 == b.index / 3 && (a.usual, a.repeats) == (b.usual, b.repeats)) {
        let (usual, repeats) = (alike[0].usual, alike[0].repeats);
        let names: Vec<String> = alike.iter().map(|channel| name(channel.index)).collect();
        let names = and(&names);
        let faster =
            if alike.len() > 1 { "are logged faster than they are read" } else { "is logged faster than it is read" };
        let says = format!(
            "{names} {faster}: each reading is repeated in up to {usual} rows; the first of them is taken and \
             {repeats} repeats are left out. Log each reading once, with its own time"
        );
        let t = alike.iter().filter_map(|channel| channel.first_t_ns).min().map(|t_ns| t_ns as f64 / 1e9);
        match alike {
            [Channel { index: index @ 0..9, .. }] => {
                report.add_on(Axis::ALL[index % 3], FaultKind::HeldSamples, repeats, t, says);
            }
            _ => report.add(FaultKind::HeldSamples, repeats, t, says),
        }
    }
}

/// Rows that a reading usually stands in at most; `None` where each has one of its own.
fn stands_in(values: &[f64]) -> Option<usize> {
    let step = quantum(values);
    let runs: Vec<&[f64]> = values.chunk_by(|a, b| a == b).collect();
    let turns = |w: &&[&[f64]]| {
        let (before, after) = (w[1][0] - w[0][0], w[2][0] - w[1][0]);
        before * after > 0.0 && before.abs().min(after.abs()) > STEPS * step
    };
    let mut lengths: Vec<usize> = runs.windows(3).filter(turns).map(|w| w[1].len()).collect();
    let several = lengths.iter().filter(|&&rows| rows > 1).count();
    if lengths.len() < FEWEST || (several as f64) < OFTEN * lengths.len() as f64 {
        return None;
    }
    // Noise of a few steps makes neighbours alike too, but more of them nearly so.
    let nearly = |w: &&[&[f64]]| {
        let (before, between, after) = (w[1][0] - w[0][0], w[2][0] - w[1][0], w[3][0] - w[2][0]);
        before * after > 0.0 && before.abs().min(after.abs()) > STEPS * step && between.abs() < (ALIKE + 0.5) * step
    };
    if several < runs.windows(4).filter(nearly).count() {
        return None;
    }
    let usual = (USUAL * (lengths.len() - 1) as f64).round() as usize;
    Some(*lengths.select_nth_unstable(usual).1)
}

/// Steps by which a reading has to change on both sides of one that stands for more than it is worth.
const STEPS: f64 = 8.0;
/// Steps that two readings are apart at most that are nearly alike.
const ALIKE: f64 = 2.0;
/// Readings between such changes that are needed to tell.
const FEWEST: usize = 30;
/// Share of the readings that have to stand in more rows than one: a dead zone's are few.
const OFTEN: f64 = 0.2;
/// Share of the readings that stand no longer than what is taken for usual.
const USUAL: f64 = 0.9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_that_stands_on_while_the_gyro_turns_is_not_read_again() {
        // A heading of 20 Hz in rows of 100 Hz, of which each tenth is lost: the one before stands on.
        let rate = |t: f64| 0.5 * (1.1 * t).sin();
        let mut angle = 0.0;
        let mut shown = 0.0;
        let mut kept = Vec::new();
        let rows: Vec<Row> = (0..6000_usize)
            .map(|k| {
                let t = 0.01 * k as f64;
                angle += 0.01 * rate(t);
                if k.is_multiple_of(5) && !(k / 5).is_multiple_of(10) {
                    shown = f64::round(angle * 1e4) * 1e-4;
                    kept.push(k);
                }
                let mut row = Row { t_ns: (t * 1e9) as i64, ..Row::EMPTY };
                (row.gyro[2], row.ref_angle[2]) = (rate(t), shown);
                row
            })
            .collect();
        let mut held = Held::of(&rows);
        let left = |k: &usize| {
            let mut row = rows[*k];
            held.take(&mut row);
            row.ref_angle[2].is_finite()
        };
        let left: Vec<usize> = (0..rows.len()).filter(left).collect();
        // Where the shaft turns slowly a reading may be the same again.
        let wrong = left.iter().filter(|k| !kept.contains(k) && rate(0.01 * **k as f64).abs() > 0.3).count();
        assert!(wrong == 0 && left.len() > 1000, "{wrong} of {}", left.len());
    }
}
