//! One row of fields: numbers in SI units, and what is faulty in them.

use super::{
    error::Problem,
    header::Layout,
    number::{self, Field, TimeField},
    tally::RowFault,
    unit::Channel,
};
use csv::ByteRecord;
use gyro_model::Row;

/// Readings beyond this are no sensor's: rad/s, rad, m/s², °C, V alike.
const IMPOSSIBLE: f64 = 1e9;

/// Bytes of a field that are shown in a message.
const SHOWN: usize = 400;

/// Turns fields into rows. It remembers which free channels hold numbers and which hold text.
pub struct RowParser {
    free: Vec<FreeKind>,
}

#[derive(Clone, Copy, PartialEq)]
enum FreeKind {
    Unknown,
    Numbers,
    Text,
}

/// A row as read.
pub struct Parsed {
    /// Its values; its time counts from nowhere yet.
    pub row: Row,
    /// Its time on the log's own clock, ns.
    pub time: Option<i128>,
    /// Its faults, each with the column's place.
    pub faults: Vec<(RowFault, usize)>,
}

impl RowParser {
    /// For rows of this layout.
    #[must_use]
    pub fn new(layout: &Layout) -> Self {
        Self { free: vec![FreeKind::Unknown; layout.columns.len()] }
    }

    /// Reads one row.
    ///
    /// # Errors
    /// Text where a number should be, a time out of range, a row of another length; with the column's place.
    pub fn parse(&mut self, record: &ByteRecord, layout: &Layout) -> Result<Parsed, (Option<usize>, Problem)> {
        if record.len() != layout.columns.len() {
            return Err((None, Problem::Length { found: record.len(), wanted: layout.columns.len() }));
        }
        let (mut row, mut time, mut faults) = (Row::EMPTY, None, Vec::new());
        for (i, (field, column)) in record.iter().zip(&layout.columns).enumerate() {
            match column.channel {
                Channel::Unused => {}
                Channel::Time => match number::time(field, column.conversion.exponent) {
                    TimeField::Nanoseconds(ns) => time = Some(ns),
                    TimeField::NoTime => faults.push((RowFault::NoTime, i)),
                    TimeField::OutOfRange => return Err((Some(i), Problem::TimeRange(shown(field)))),
                    TimeField::Text => return Err((Some(i), Problem::Text(shown(field)))),
                },
                channel => {
                    if let Some(value) = self.value(field, i, channel, &mut faults)?
                        && let Some(place) = place(&mut row, channel)
                    {
                        *place = value * column.conversion.scale + column.conversion.offset;
                    }
                }
            }
        }
        if let Some(fault) = check_quaternion(&mut row.ref_quaternion) {
            faults.push((fault, 0));
        }
        Ok(Parsed { row, time, faults })
    }

    /// The number in a field, as written; `None` where there is none or it cannot be used.
    fn value(
        &mut self,
        field: &[u8],
        i: usize,
        channel: Channel,
        faults: &mut Vec<(RowFault, usize)>,
    ) -> Result<Option<f64>, (Option<usize>, Problem)> {
        let free = matches!(channel, Channel::Free(_));
        match number::value(field) {
            Field::Number(x) if x.abs() > IMPOSSIBLE && !free => faults.push((RowFault::Impossible, i)),
            Field::Number(x) => {
                if self.free[i] == FreeKind::Unknown {
                    self.free[i] = FreeKind::Numbers;
                }
                return Ok(Some(x));
            }
            Field::Empty | Field::Nan => {}
            Field::Infinite => faults.push((RowFault::Infinite, i)),
            Field::Text if free && self.free[i] != FreeKind::Numbers => {
                self.free[i] = FreeKind::Text;
                faults.push((RowFault::TextColumn, i));
            }
            Field::Text => return Err((Some(i), Problem::Text(shown(field)))),
        }
        Ok(None)
    }
}

/// A field for a message.
fn shown(field: &[u8]) -> String {
    String::from_utf8_lossy(&field[..field.len().min(SHOWN)]).into_owned()
}

/// Where a channel's value goes.
fn place(row: &mut Row, channel: Channel) -> Option<&mut f64> {
    Some(match channel {
        Channel::Gyro(axis) => &mut row.gyro[axis.index()],
        Channel::RefAngle(axis) => &mut row.ref_angle[axis.index()],
        Channel::RefRate(axis) => &mut row.ref_rate[axis.index()],
        Channel::Quaternion(i) => &mut row.ref_quaternion[i],
        Channel::Accel(axis) => &mut row.accel[axis.index()],
        Channel::Temperature => &mut row.temperature,
        Channel::Supply => &mut row.supply,
        Channel::Free(i) => &mut row.free[i],
        Channel::Time | Channel::Unused => return None,
    })
}

/// Scales a quaternion to length 1; one that is far from it, or has only a part, is no value.
fn check_quaternion(q: &mut [f64; 4]) -> Option<RowFault> {
    let present = q.iter().filter(|x| x.is_finite()).count();
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if (0.9..=1.1).contains(&length) {
        for x in q.iter_mut() {
            *x /= length;
        }
        return None;
    }
    *q = [f64::NAN; 4];
    (present > 0).then_some(RowFault::NotARotation)
}
