//! One row of fields: numbers in SI units, and what is faulty in them.

use super::{
    error::Problem,
    header::{Column, Layout},
    tally::RowFault,
    timer::Timer,
    unit::{Channel, Conversion},
};
use gyro_model::Row;
use log_readers::text::{self, Dialect, Field, Form, TextRow, TimeField};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Readings beyond this are no sensor's: rad/s, rad, m/s², °C, V alike.
pub(super) const IMPOSSIBLE: f64 = 1e9;

/// Bytes of a field that are shown in a message.
const SHOWN: usize = 400;

/// Powers of ten by which a time in a unit of its own is read finer than in nanoseconds: a day has 10¹⁴ of them.
const FINE: i32 = 6;

/// A day, ns.
const DAY: i128 = 86_400_000_000_000;

/// Turns fields into rows. It remembers which free channels hold numbers and which hold text, and what day it is.
pub struct RowParser {
    free: Vec<FreeKind>,
    dialect: Dialect,
    /// The last time of day, and the midnights passed since the first, ns.
    clock: Option<i128>,
    midnights: i128,
    /// Of a time that is counted.
    timer: Timer,
    /// The sum of a time's steps, ns, and the rows so far.
    sum: i128,
    count: u64,
    /// The finest power of ten of a second that a time was written to.
    finest: i32,
    /// Whether a row was read.
    begun: bool,
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
    pub fn new(layout: &Layout, dialect: Dialect) -> Self {
        let free = vec![FreeKind::Unknown; layout.columns.len()];
        Self {
            free,
            dialect,
            clock: None,
            midnights: 0,
            timer: Timer::default(),
            sum: 0,
            count: 0,
            finest: i32::MAX,
            begun: false,
        }
    }

    /// What the last digit of a time is worth, the finest of all so far, s.
    #[must_use]
    pub fn finest_time(&self) -> f64 {
        10_f64.powi(self.finest)
    }

    /// Reads one row.
    ///
    /// # Errors
    /// Text where a number should be, a time out of range, a row of another length; with the column's place.
    pub fn parse(&mut self, fields: TextRow, layout: &Layout) -> Result<Parsed, (Option<usize>, Problem)> {
        let (found, wanted) = (fields.fields().len(), layout.columns.len());
        let first = !std::mem::replace(&mut self.begun, true);
        if found != wanted {
            let commas = self.dialect == text::CSV;
            let twice = first && found > wanted && found <= 2 * wanted && commas;
            let problem = if twice {
                Problem::DecimalCommas { found, wanted }
            } else {
                Problem::Length { found, wanted, commas }
            };
            return Err((None, problem));
        }
        let (mut row, mut faults, mut matrix) = (Row::EMPTY, Vec::new(), [f64::NAN; 9]);
        let mut time = layout.row_step.map(|step| (self.count as f64 * step * 1e9).round() as i128);
        self.count += 1;
        for (i, (field, column)) in fields.fields().zip(&layout.columns).enumerate() {
            match column.channel {
                Channel::Unused => {}
                Channel::Time => match self.time(field, column, fields) {
                    TimeField::Nanoseconds(ns) => {
                        let overflows;
                        (time, overflows) = self.uninterrupted(ns, column);
                        faults.extend(overflows.then_some((RowFault::TimerOverflow, i)));
                    }
                    TimeField::NoTime => faults.push((RowFault::NoTime, i)),
                    TimeField::OutOfRange => return Err((Some(i), Problem::TimeRange(shown(field)))),
                    TimeField::Text => return Err((Some(i), Problem::Text(shown(field)))),
                },
                channel => {
                    if let Some(value) = self.value(field, i, channel, &mut faults)?
                        && let Some(value) = self.less(value, column, fields)
                        && let Some(place) = place(&mut row, &mut matrix, channel)
                    {
                        let value = if column.is_word && value >= 32_768.0 { value - 65_536.0 } else { value };
                        *place = value * column.conversion.scale + column.conversion.offset;
                    }
                }
            }
        }
        if let Some(ns) = time.filter(|ns| ns.unsigned_abs() > LATEST) {
            return Err((None, Problem::TimeRange(ns.to_string())));
        }
        if layout.is_by_angles() {
            row.ref_quaternion = of_angles(row.ref_quaternion);
        } else if layout.is_by_matrix() {
            row.ref_quaternion = of_matrix(matrix);
        }
        if let Some(fault) = check_quaternion(&mut row.ref_quaternion) {
            faults.push((fault, 0));
        }
        Ok(Parsed { row, time, faults })
    }

    /// A row's time, however it is written.
    fn time(&mut self, field: &[u8], column: &Column, fields: TextRow) -> TimeField {
        let point = self.dialect.point;
        let other = |place: usize| fields.field(place).unwrap_or_default();
        let whole = |read: Option<i128>, field: &[u8]| match read {
            Some(ns) => TimeField::Nanoseconds(ns),
            None if field.trim_ascii().is_empty() => TimeField::NoTime,
            None => TimeField::Text,
        };
        match column.form {
            Form::Number(exponent) => {
                if let Some(last) = text::last_digit(field, point) {
                    self.finest = self.finest.min(last + exponent - 9);
                }
                text::time(field, point, exponent + if column.is_scaled_time() { FINE } else { 0 })
            }
            Form::DateTime | Form::DayFirst => {
                self.finest = self.finest.min(text::last_digit_of_clock(field));
                whole(text::date_time(field), field)
            }
            Form::Clock => {
                self.finest = self.finest.min(text::last_digit_of_clock(field));
                whole(text::clock(field).map(|clock| self.with_midnights(clock)), field)
            }
            Form::Digits => {
                self.finest = self.finest.min(text::last_digit_of_clock(field));
                whole(text::digits(field).map(|clock| self.with_midnights(clock)), field)
            }
            Form::Parts(place, exponent) => {
                match (text::time(field, point, 9), text::time(other(place), point, exponent)) {
                    (TimeField::Nanoseconds(seconds), TimeField::Nanoseconds(ns)) => {
                        TimeField::Nanoseconds(seconds + ns)
                    }
                    (TimeField::Nanoseconds(_), bad) | (bad, _) => bad,
                }
            }
            Form::DateAndClock(place) => {
                let (date, clock) =
                    if text::date(field).is_some() { (field, other(place)) } else { (other(place), field) };
                self.finest = self.finest.min(text::last_digit_of_clock(clock));
                let sum = text::date(date).zip(text::clock(clock)).map(|((day, _), clock)| day * DAY + clock);
                whole(sum, field)
            }
        }
    }

    /// A time past the overflows of its counter, in the unit that a map gives it; whether one lies right before it.
    fn uninterrupted(&mut self, ns: i128, column: &Column) -> (Option<i128>, bool) {
        let Form::Number(exponent) = column.form else { return (Some(ns), false) };
        let (finer, is_seconds) = if column.is_scaled_time() { (FINE, false) } else { (0, exponent == 9) };
        let (ns, overflows) =
            if column.is_step { (ns, false) } else { self.timer.follow(ns, exponent + finer, is_seconds) };
        let ns = if column.is_scaled_time() { scaled(ns, column.conversion) } else { ns };
        if !column.is_step {
            return (Some(ns), overflows);
        }
        self.sum = self.sum.saturating_add(ns);
        (Some(self.sum), false)
    }

    /// A time of day goes on past midnight.
    fn with_midnights(&mut self, clock: i128) -> i128 {
        if self.clock.is_some_and(|before| before - clock > DAY / 2) {
            self.midnights += DAY;
        }
        self.clock = Some(clock);
        clock + self.midnights
    }

    /// A value less that of the column that is taken away from it; `None` where that has none.
    fn less(&self, value: f64, column: &Column, fields: TextRow) -> Option<f64> {
        let Some(other) = column.less else { return Some(value) };
        match self.dialect.value(fields.field(other).unwrap_or_default()) {
            Field::Number(less) => Some(value - less),
            _ => None,
        }
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
        match self.dialect.value(field) {
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

/// No time lies further from zero, ns.
const LATEST: u128 = 1 << 90;

/// A time that was read [`FINE`] powers of ten too large, as a map scales it, ns.
fn scaled(fine: i128, Conversion { scale, offset, .. }: Conversion) -> i128 {
    let scaled = if scale.fract() == 0.0 && scale.abs() < 1e9 {
        fine.saturating_mul(scale as i128) / 10_i128.pow(FINE.unsigned_abs())
    } else {
        (fine as f64 * scale / 10_f64.powi(FINE)) as i128
    };
    scaled.saturating_add((offset * 1e9) as i128)
}

/// A field for a message.
fn shown(field: &[u8]) -> String {
    String::from_utf8_lossy(&field[..field.len().min(SHOWN)]).into_owned()
}

/// Where a channel's value goes: into the row, or the rotation matrix of its orientation.
pub(super) fn place<'a>(row: &'a mut Row, matrix: &'a mut [f64; 9], channel: Channel) -> Option<&'a mut f64> {
    Some(match channel {
        Channel::Gyro(axis) => &mut row.gyro[axis.index()],
        Channel::RefAngle(axis) => &mut row.ref_angle[axis.index()],
        Channel::RefRate(axis) => &mut row.ref_rate[axis.index()],
        Channel::Quaternion(i) => &mut row.ref_quaternion[i],
        // Until the row is whole: `of_angles` makes the quaternion.
        Channel::Euler(i) => &mut row.ref_quaternion[i + 1],
        Channel::Matrix(i) => &mut matrix[i],
        Channel::Accel(axis) => &mut row.accel[axis.index()],
        Channel::Temperature => &mut row.temperature,
        Channel::Supply => &mut row.supply,
        Channel::Free(i) => &mut row.free[i],
        Channel::Time | Channel::Unused => return None,
    })
}

/// The orientation of roll, pitch and yaw, which stand in the last three places: turned about z, then the new y, then the new x (ISO 8855,
/// aviation's order).
pub(super) fn of_angles([_, roll, pitch, yaw]: [f64; 4]) -> [f64; 4] {
    let ((sr, cr), (sp, cp), (sy, cy)) = ((roll / 2.0).sin_cos(), (pitch / 2.0).sin_cos(), (yaw / 2.0).sin_cos());
    [cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]
}

/// The orientation of a rotation matrix, row by row; no rotation where its columns are not of length 1 and at right angles.
pub(super) fn of_matrix(numbers: [f64; 9]) -> [f64; 4] {
    const OFF: f64 = 0.1;
    if numbers.iter().any(|x| !x.is_finite()) {
        return [f64::NAN; 4];
    }
    let matrix = Matrix3::from_row_slice(&numbers);
    let is_rotation =
        (matrix.transpose() * matrix - Matrix3::identity()).abs().max() < OFF && matrix.determinant() > 0.0;
    if !is_rotation {
        return [0.0; 4];
    }
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    [q.w, q.i, q.j, q.k]
}

/// Scales a quaternion to length 1; one that is far from it, or has only a part, is no value.
pub(super) fn check_quaternion(q: &mut [f64; 4]) -> Option<RowFault> {
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
