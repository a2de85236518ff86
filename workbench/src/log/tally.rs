//! Faults counted and located while rows are read.

use gyro_model::{
    Axis,
    fault::{DataFault, FaultKind},
};
use std::collections::BTreeMap;

/// Faults that one row shows by itself or against the row before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowFault {
    /// A row without a time.
    NoTime,
    /// Time repeated or going back.
    TimeGoingBack,
    /// Where time has caught up that stood or was set back.
    SetBack,
    /// A single time far ahead of those around it.
    TimeAhead,
    /// An infinite value.
    Infinite,
    /// A value that nothing physical reaches.
    Impossible,
    /// A quaternion that is not a rotation.
    NotARotation,
    /// A free channel of text.
    TextColumn,
    /// The first time after an overflow of the counter that times are counted with.
    TimerOverflow,
}

impl RowFault {
    /// Whether the row lacks something for it.
    #[must_use]
    pub fn costs(self) -> bool {
        !matches!(self, Self::TextColumn | Self::TimerOverflow)
    }
}

#[derive(Clone, Copy, Debug)]
struct Count {
    rows: u64,
    first_line: u64,
    first_t: Option<f64>,
}

/// The counts so far, by fault and column.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    counts: BTreeMap<(RowFault, usize), Count>,
    /// Whether places are messages, not lines.
    of_messages: bool,
}

impl Tally {
    /// Of messages, which have no lines.
    pub fn of_messages() -> Self {
        Self { of_messages: true, ..Self::default() }
    }

    /// One more; `t` in seconds from the first row, where it is known.
    pub fn add(&mut self, fault: RowFault, column: usize, line: u64, t: Option<f64>) {
        self.counts.entry((fault, column)).or_insert(Count { rows: 0, first_line: line, first_t: t }).rows += 1;
    }

    /// Rows of this fault so far.
    pub fn rows(&self, fault: RowFault) -> u64 {
        self.counts.iter().filter(|((found, _), _)| *found == fault).map(|(_, count)| count.rows).sum()
    }

    /// As reported, `of` giving a column's name and the axis that it is of.
    pub fn report(&self, of: impl Fn(usize) -> (String, Option<Axis>)) -> Vec<DataFault> {
        let place = if self.of_messages { "message" } else { "line" };
        self.counts
            .iter()
            .map(|(&(found, column), count)| {
                let (n, line, (name, axis)) = (count.rows, count.first_line, of(column));
                let rows = if n == 1 { "1 row".to_owned() } else { format!("{n} rows") };
                let (kind, what) = match found {
                    RowFault::NoTime => (FaultKind::NonFinite, format!("no time in {rows}: left out")),
                    RowFault::TimeGoingBack => {
                        (FaultKind::TimeGoingBack, format!("the time repeats or goes back in {rows}: left out"))
                    }
                    RowFault::SetBack => (
                        FaultKind::TimeGoingBack,
                        "the clock stood or was set back: what follows is kept apart from what came before".to_owned(),
                    ),
                    RowFault::TimeAhead => (
                        FaultKind::TimeGoingBack,
                        format!("the time jumps ahead, and back after it, in {rows}: left out"),
                    ),
                    RowFault::Infinite => {
                        (FaultKind::NonFinite, format!("{name} is infinite in {rows}: no value there"))
                    }
                    RowFault::Impossible => {
                        (FaultKind::Outliers, format!("{name} is beyond anything physical in {rows}: no value there"))
                    }
                    RowFault::NotARotation => (
                        FaultKind::Outliers,
                        format!("the reference quaternion is not of length 1 in {rows}: no value there"),
                    ),
                    RowFault::TimerOverflow => {
                        let times = if n == 1 { "once".to_owned() } else { format!("{n} times") };
                        (
                            FaultKind::TimerOverflow,
                            format!("the counter of {name} overflows {times}: its times go on from there"),
                        )
                    }
                    RowFault::TextColumn => {
                        (FaultKind::UnusedColumns, format!("{name} holds text in {rows}: no value there"))
                    }
                };
                // What concerns a row's time concerns every axis.
                let of_column = matches!(found, RowFault::Infinite | RowFault::Impossible);
                DataFault {
                    kind,
                    axis: axis.filter(|_| of_column),
                    count: n,
                    first_t: count.first_t,
                    says: format!("{what} (first at {place} {line})"),
                }
            })
            .collect()
    }
}
