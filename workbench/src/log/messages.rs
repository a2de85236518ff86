//! Logs of messages: looked through once for what they hold, then read for what is meant, a row a message.

use super::{
    Maps,
    error::Problem,
    folder::Continued,
    header::{Column, Layout, Refusal},
    input::Input,
    pending::Pending,
    row::{IMPOSSIBLE, check_quaternion, of_angles, of_matrix, place},
    tally::{RowFault, Tally},
    unit::{self, Name},
};
use gyro_model::{
    Row,
    fault::{DataFault, FaultKind},
};
use log_readers::{
    can::Database,
    format::{Note, Sink, Topic},
    formats::can,
    meaning::{Pick, Proposal, of_topics},
    survey::Survey,
    unit::Unit,
};
use std::{
    io::{Cursor, Read},
    path::{Path, PathBuf},
};

/// What was read.
pub struct Messages {
    /// What the rows hold.
    pub layout: Layout,
    /// The rows, in time.
    pub rows: Vec<Pending>,
    /// Their faults.
    pub tally: Tally,
    /// Of the file as stored.
    pub sha256: String,
    /// What the reader noted.
    pub notes: Vec<DataFault>,
}

/// Reads a file of messages, or several that are one recording; the first is open already.
///
/// # Errors
/// It cannot be read, or lacks what every log needs.
pub fn read(files: &[PathBuf], first: Input, maps: &Maps) -> Result<Messages, Refusal> {
    let database = maps.database.as_ref();
    if database.is_none() && can::has_frames(first.format()) {
        return Err((None, Problem::NoDbc(first.format().name())));
    }
    let mut twice = Twice::of(files, first).map_err(|p| (None, p))?;
    let mut survey = Survey::default();
    twice.read(database, &mut survey).map_err(|p| (None, p))?;
    let fields =
        survey.topics.iter().flat_map(|of| of.topic.fields.iter().map(|field| (of.topic.channel(field), field.unit)));
    let channels: Vec<(String, Option<Unit>)> = fields.collect();
    if let Some(Note::NotRead { topic, .. }) = survey.notes.iter().find(|note| matches!(note, Note::NotRead { .. }))
        && database.is_some()
        && channels.is_empty()
    {
        return Err((None, Problem::OtherFrames(topic.clone())));
    }
    let (picks, layout) = understood(maps, &channels, &|taken, picks| of_topics(&survey.topics, taken, picks))?;
    let layout = Layout { said: survey.said.clone(), ..layout };
    let mut taker = Taker::new(&picks, &layout);
    twice.read(database, &mut taker).map_err(|p| (None, p))?;
    let notes =
        survey.notes.iter().filter(|note| !matches!(note, Note::Stamps { .. } | Note::NotRead { .. })).map(fault);
    let (rows, tally) = taker.rows();
    Ok(Messages { layout, rows, tally, sha256: twice.sha256, notes: notes.collect() })
}

/// Whether a name of the log format is taken already.
pub(super) type Has<'a> = &'a dyn Fn(&str) -> bool;

/// The channels that are meant, of those that there are, and what they hold: those that the maps name, then those that are
/// proposed where they name none.
pub(super) fn understood(
    maps: &Maps,
    channels: &[(String, Option<Unit>)],
    propose: &dyn Fn(Has, &[Pick]) -> Proposal,
) -> Result<(Vec<Pick>, Layout), Refusal> {
    let names: Vec<String> = channels.iter().map(|(name, _)| name.clone()).collect();
    let mut picks = Vec::new();
    for flag in &maps.flags {
        picks.extend(flag.picks(&names).map_err(|p| (None, p))?);
    }
    if let Some(map) = &maps.columns {
        let renamed = map.rename(&names).map_err(|p| (None, p))?;
        let changed = names.iter().zip(renamed).filter(|(channel, name)| *channel != name);
        picks.extend(changed.map(|(channel, name)| Pick::new(&name, channel, None)));
    }
    // A name without a unit takes the one that the file says.
    let unit = |pick: &Pick| channels.iter().find(|(name, _)| *name == pick.channel).and_then(|(_, unit)| *unit);
    let mut picks: Vec<Pick> = picks
        .into_iter()
        .map(|pick| match unit(&pick) {
            Some(unit) => unit::with_unit(pick, unit),
            None => pick,
        })
        .collect();
    let named = |name: &str, pick: &Pick| match (unit::name(name), unit::name(&pick.name)) {
        (Name::Known(a, _), Name::Known(b, _)) => a == b,
        _ => false,
    };
    let proposal = propose(&|name| picks.iter().any(|pick| named(name, pick)), &picks);
    picks.extend(proposal.chosen.iter().cloned());
    let mut layout = Layout::of_picks(&picks, &proposal, &names, maps)?;
    layout.chosen.clone_from(&proposal.chosen);
    Ok((picks, layout))
}

/// A note of a reader as a fault of the data.
fn fault(note: &Note) -> DataFault {
    let (kind, count) = match note {
        Note::BreaksOff { .. } => (FaultKind::SkippedLines, 1),
        Note::Damaged { bytes, .. } => (FaultKind::SkippedLines, *bytes),
        Note::Lost { count, .. } => (FaultKind::Dropouts, *count),
        Note::LeftOut { names } => (FaultKind::UnusedColumns, names.len() as u64),
        Note::NotRead { .. } | Note::Skipped { .. } | Note::Stamps { .. } => (FaultKind::UnusedColumns, 1),
    };
    DataFault { kind, axis: None, count, first_t: None, says: note.to_string() }
}

/// Files that are read twice; what comes only once is kept.
struct Twice {
    files: Vec<PathBuf>,
    first: Option<Input>,
    kept: Option<Vec<u8>>,
    sha256: String,
}

impl Twice {
    fn of(files: &[PathBuf], mut first: Input) -> Result<Self, Problem> {
        if files[0] != Path::new("-") {
            return Ok(Self { files: files.to_vec(), first: Some(first), kept: None, sha256: String::new() });
        }
        let mut kept = Vec::new();
        let packing = first.packing();
        first.read_to_end(&mut kept).map_err(|error| Problem::reading(error, packing))?;
        Ok(Self { files: Vec::new(), sha256: first.sha256(), first: None, kept: Some(kept) })
    }

    fn read(&mut self, database: Option<&Database>, sink: &mut dyn Sink) -> Result<(), Problem> {
        if let Some(kept) = &self.kept {
            let mut input = Input::of(Box::new(Cursor::new(kept.clone())), false)?;
            return input.read_all(database, sink);
        }
        let mut all = Continued::new(sink);
        let mut sums = Vec::new();
        for file in &self.files {
            let mut input = match self.first.take() {
                Some(input) => input,
                None => Input::open(file)?,
            };
            all.next_file();
            input.read_all(database, &mut all)?;
            sums.push(input.sha256());
        }
        self.sha256 = sums.join("+");
        Ok(())
    }
}

/// Puts values into rows, each as its pick says.
pub(super) struct Taken {
    columns: Vec<Column>,
    /// Whether the orientation is given by roll, pitch and yaw, or by its rotation matrix.
    by_angles: bool,
    by_matrix: bool,
}

impl Taken {
    /// Of the layout that came of the picks.
    pub(super) fn new(layout: &Layout) -> Self {
        let columns = layout.columns.get(1..).unwrap_or_default().to_vec();
        Self { columns, by_angles: layout.is_by_angles(), by_matrix: layout.is_by_matrix() }
    }

    /// `wanted` are places of values, each with the number of its pick; `fault` is told what is no value, and its column.
    pub(super) fn put(
        &self,
        row: &mut Row,
        wanted: &[(usize, usize)],
        values: &[f64],
        fault: &mut dyn FnMut(RowFault, usize),
    ) {
        let mut matrix = [f64::NAN; 9];
        for &(field, pick) in wanted {
            let (Some(&value), Some(column)) = (values.get(field), self.columns.get(pick)) else { continue };
            if value.is_infinite() {
                fault(RowFault::Infinite, pick + 1);
            } else if value.abs() > IMPOSSIBLE && !matches!(column.channel, unit::Channel::Free(_)) {
                fault(RowFault::Impossible, pick + 1);
            } else if let Some(place) = place(row, &mut matrix, column.channel).filter(|_| !value.is_nan()) {
                *place = value * column.conversion.scale + column.conversion.offset;
            }
        }
        if self.by_angles {
            row.ref_quaternion = of_angles(row.ref_quaternion);
        } else if self.by_matrix {
            row.ref_quaternion = of_matrix(matrix);
        }
    }
}

/// Takes the messages that are meant.
struct Taker<'a> {
    picks: &'a [Pick],
    taken: Taken,
    /// Of each topic: the places of fields, each with the number of its pick.
    topics: Vec<Vec<(usize, usize)>>,
    rows: Vec<Pending>,
    tally: Tally,
    count: u64,
}

impl<'a> Taker<'a> {
    fn new(picks: &'a [Pick], layout: &Layout) -> Self {
        Self {
            picks,
            taken: Taken::new(layout),
            topics: Vec::new(),
            rows: Vec::new(),
            tally: Tally::of_messages(),
            count: 0,
        }
    }

    /// The rows in time; messages of one instant are one row where they do not hold the same.
    fn rows(mut self) -> (Vec<Pending>, Tally) {
        self.rows.sort_by_key(|row| row.time);
        let mut merged: Vec<Pending> = Vec::with_capacity(self.rows.len());
        for next in self.rows {
            if let Some(last) = merged.last_mut().filter(|last| last.time == next.time)
                && joined(&mut last.row, &next.row)
            {
                last.marked |= next.marked;
                continue;
            }
            merged.push(next);
        }
        (merged, self.tally)
    }
}

/// Adds the values of a row to another that has none of them; `false` where both have one.
pub(super) fn joined(row: &mut Row, other: &Row) -> bool {
    let values = |row: &Row| {
        let of = [row.gyro, row.ref_angle, row.ref_rate, row.accel].concat();
        [of.as_slice(), &row.ref_quaternion, &[row.temperature, row.supply], &row.free].concat()
    };
    if values(row).iter().zip(values(other)).any(|(a, b)| a.is_finite() && b.is_finite()) {
        return false;
    }
    fill(row, other);
    true
}

/// Takes from another row what this one lacks.
pub(super) fn fill(row: &mut Row, other: &Row) {
    let take = |to: &mut [f64], from: &[f64]| {
        for (to, from) in to.iter_mut().zip(from).filter(|(to, from)| !to.is_finite() && from.is_finite()) {
            *to = *from;
        }
    };
    for (to, from) in [
        (&mut row.gyro[..], &other.gyro[..]),
        (&mut row.ref_angle, &other.ref_angle),
        (&mut row.ref_rate, &other.ref_rate),
        (&mut row.accel, &other.accel),
        (&mut row.ref_quaternion, &other.ref_quaternion),
        (&mut row.free, &other.free),
    ] {
        take(to, from);
    }
    take(std::slice::from_mut(&mut row.temperature), &[other.temperature]);
    take(std::slice::from_mut(&mut row.supply), &[other.supply]);
}

impl Sink for Taker<'_> {
    fn topic(&mut self, topic: &Topic) -> bool {
        let wanted = topic.fields.iter().enumerate().flat_map(|(i, field)| {
            let channel = topic.channel(field);
            let picks = self.picks.iter().enumerate().filter(move |(_, pick)| pick.channel == channel);
            picks.map(move |(k, _)| (i, k))
        });
        self.topics.push(wanted.collect());
        self.topics.last().is_some_and(|wanted| !wanted.is_empty())
    }

    fn message(&mut self, topic: usize, time_ns: i64, values: &[f64]) {
        let Some(wanted) = self.topics.get(topic).filter(|wanted| !wanted.is_empty()) else { return };
        self.count += 1;
        let (mut row, mut marked) = (Row::EMPTY, false);
        let mut fault = |fault, column| {
            marked = true;
            self.tally.add(fault, column, self.count, None);
        };
        self.taken.put(&mut row, wanted, values, &mut fault);
        if let Some(found) = check_quaternion(&mut row.ref_quaternion) {
            fault(found, 0);
        }
        self.rows.push(Pending { row, time: i128::from(time_ns), line: self.count, marked });
    }

    fn note(&mut self, _note: Note) {}
}
