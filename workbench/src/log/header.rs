//! The header: which column holds what, in which unit.

use super::{
    Maps,
    error::{Known, Problem, listed},
    map::difference,
    names::{Names, time_form},
    unit::{self, Channel, Conversion, Name},
};
use crate::words::typed;
use gyro_model::{Axis, record::FREE_CHANNELS};
use log_readers::{
    meaning::{Pick, Proposal, Second, stated_rate},
    text::{Form, Head},
};
use std::collections::{BTreeMap, HashMap, HashSet};

/// One column.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name, after renaming.
    pub name: String,
    /// What it holds.
    pub channel: Channel,
    /// To SI.
    pub conversion: Conversion,
    /// Of a time: how it is written.
    pub form: Form,
    /// Whether it holds words of 16 bits without their sign.
    pub is_word: bool,
    /// Whether it holds the steps of a time, which is their sum.
    pub is_step: bool,
    /// What of the file it is.
    pub pick: Pick,
    /// The column that is taken away from it.
    pub less: Option<usize>,
}

impl Column {
    /// Whether a map gave the time a factor or an offset.
    pub fn is_scaled_time(&self) -> bool {
        self.conversion.scale != 1.0 || self.conversion.offset != 0.0
    }
}

/// What a log's columns hold.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// In the order of the file.
    pub(super) columns: Vec<Column>,
    /// Names of the free channels that are carried, at most [`FREE_CHANNELS`].
    pub free_names: Vec<String>,
    /// Free channels past those: they are not read.
    pub unused_names: Vec<String>,
    /// Channels that were taken without being named, for their own names are clear.
    pub chosen: Vec<Pick>,
    /// Channels that may be what is missing.
    pub offered: Vec<Pick>,
    /// What computed the reference, where that is a filter of this very gyro.
    pub dependent: Option<String>,
    /// Other gyros of the file, which would be references.
    pub seconds: Vec<Second>,
    /// Rows a second, where a text says it above its header.
    pub stated_rate: Option<f64>,
    /// The time from row to row, s, where a map makes the time of the rows' numbers.
    pub row_step: Option<f64>,
    /// The column that is the time, as the file names it.
    pub time_channel: String,
    /// What is not sure of the counts that were found.
    pub unsure: Option<String>,
    /// Accelerometers that are not read, for nothing tells their unit.
    pub left_out: Vec<String>,
    /// What the log says of the vehicle, the board or the sensor.
    pub said: BTreeMap<String, String>,
}

/// A refused header: the column where one is at fault.
pub type Refusal = (Option<(usize, String)>, Problem);

impl Layout {
    /// Understands a header.
    ///
    /// # Errors
    /// A header that is none, names a quantity twice or in a unit of another, or lacks what every log needs.
    pub fn new(head: &Head, maps: &Maps) -> Result<Self, Refusal> {
        let headers = &head.names;
        if head.line.is_none() && maps.is_empty() {
            return Err((None, Problem::NoHeader { columns: headers.len(), row: shown_row(head) }));
        }
        let mut names = Names::of(headers, maps).map_err(|problem| (None, problem))?;
        let proposal = names.propose(head);
        let mut layout = Self {
            offered: proposal.offered.clone(),
            chosen: names.chosen.clone(),
            stated_rate: stated_rate(head),
            row_step: names.row_step,
            ..Self::default()
        };
        let mut seen: HashMap<Key, usize> = HashMap::new();
        let mut before: HashSet<&str> = HashSet::new();
        for (i, name) in names.renamed.iter().enumerate() {
            // What no map and no name of the format means may stand there twice.
            let again = !before.insert(name) && matches!(unit::name(name), Name::Free);
            let name = match name.as_str() {
                "" => format!("column_{}", i + 1),
                name if again => format!("{name}_{}", i + 1),
                name => name.to_owned(),
            };
            let (channel, conversion) = match unit::name(&name) {
                _ if names.displaced[i] => (Channel::Unused, Conversion::NONE),
                Name::Known(channel, conversion) => (channel, conversion),
                Name::WrongUnit { suffix, quantity, fitting } => {
                    return Err((Some((i + 1, name)), Problem::Unit { suffix, quantity, fitting }));
                }
                Name::Free => (layout.free(&name), Conversion::NONE),
            };
            let conversion = names.conversion(i, channel, conversion, head);
            let key = if matches!(channel, Channel::Free(_) | Channel::Unused) {
                Key::Free(name.clone())
            } else {
                Key::Known(format!("{channel:?}"))
            };
            if let Some(first) = seen.insert(key, i)
                && !names.displaced[i]
            {
                let problem = Problem::Twice {
                    first: format!("column {} `{}`", first + 1, layout.columns[first].name),
                    second: format!("column {} `{name}`", i + 1),
                };
                return Err((Some((i + 1, name)), problem));
            }
            if let Some(by) = proposal.dependence(&headers[i]).filter(|_| channel.is_reference()) {
                layout.dependent = Some(by.to_owned());
            }
            if channel == Channel::Time {
                layout.time_channel.clone_from(&headers[i]);
            }
            let form = if channel == Channel::Time { time_form(head, i, conversion) } else { Form::Number(0) };
            let is_step = channel == Channel::Time && names.summed == Some(i);
            let pick = names.pick(i, &name, is_step);
            layout.columns.push(Column {
                name,
                channel,
                conversion,
                form,
                is_word: false,
                is_step,
                pick,
                less: names.less[i],
            });
        }
        layout.hide_parts_of_time();
        layout.complete(headers, maps)
    }

    /// Understands a line of names between commas, of which nothing else is known.
    ///
    /// # Errors
    /// A name that stands twice, a unit that is not known, or a column that is needed and is not there.
    pub fn of_names(names: &[&[u8]], maps: &Maps) -> Result<Self, Refusal> {
        Self::new(&Head::of_names(names), maps)
    }

    /// The layout of messages: their own time first, then what was picked of them, in its order.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn of_picks(
        picks: &[Pick],
        proposal: &Proposal,
        channels: &[String],
        maps: &Maps,
    ) -> Result<Self, Refusal> {
        let (offered, seconds) = (proposal.offered.clone(), proposal.seconds.clone());
        let mut layout = Self { offered, seconds, ..Self::default() };
        let time = Column {
            name: "t".into(),
            channel: Channel::Time,
            conversion: Conversion::NONE,
            form: Form::Number(0),
            is_word: false,
            is_step: false,
            pick: Pick::new("t", "t", None),
            less: None,
        };
        layout.columns.push(time);
        for pick in picks {
            let (channel, own) = match unit::name(&pick.name) {
                Name::Known(Channel::Time, _) => return Err((None, Problem::TimeOfMessages(pick.to_string()))),
                Name::Known(..) if difference(&pick.channel).is_some() && !channels.contains(&pick.channel) => {
                    return Err((None, Problem::DifferenceOfMessages(pick.to_string())));
                }
                Name::Known(channel, conversion) => (channel, conversion),
                Name::WrongUnit { suffix, quantity, fitting } => {
                    return Err((None, Problem::Unit { suffix, quantity, fitting }));
                }
                Name::Free => (layout.free(&pick.name), Conversion::NONE),
            };
            if layout.has(channel) && channel != Channel::Unused {
                let (first, second) = (format!("`{}`", pick.name), format!("`{pick}`"));
                return Err((None, Problem::Twice { first, second }));
            }
            if let Some(by) = proposal.dependence(&pick.channel).filter(|_| channel.is_reference()) {
                layout.dependent = Some(by.to_owned());
            }
            let conversion =
                Conversion { scale: own.scale * pick.factor, offset: own.offset + own.scale * pick.offset, ..own };
            layout.columns.push(Column {
                name: pick.name.clone(),
                channel,
                conversion,
                form: Form::Number(0),
                is_word: false,
                is_step: false,
                pick: pick.clone(),
                less: None,
            });
        }
        layout.complete(channels, maps)
    }

    fn free(&mut self, name: &str) -> Channel {
        if self.free_names.len() < FREE_CHANNELS {
            self.free_names.push(name.to_owned());
            Channel::Free(self.free_names.len() - 1)
        } else {
            self.unused_names.push(name.to_owned());
            Channel::Unused
        }
    }

    /// The second column of a time that stands in two is no free channel.
    fn hide_parts_of_time(&mut self) {
        let part = self.columns.iter().find_map(|column| match column.form {
            Form::Parts(other, _) | Form::DateAndClock(other) if column.channel == Channel::Time => Some(other),
            _ => None,
        });
        let Some(column) = part.and_then(|part| self.columns.get_mut(part)) else { return };
        if let Channel::Free(place) = column.channel {
            column.channel = Channel::Unused;
            self.free_names.remove(place);
            for column in &mut self.columns {
                if let Channel::Free(other) = &mut column.channel
                    && *other > place
                {
                    *other -= 1;
                }
            }
        }
    }

    /// Refuses a header without time, without gyro, or with part of a quaternion.
    fn complete(self, headers: &[String], maps: &Maps) -> Result<Self, Refusal> {
        let missing = |wanted| {
            let near = if maps.reference { String::new() } else { near_names(headers) };
            let (chosen, likely) = (typed(&self.chosen), typed(&self.offered));
            let known = Box::new(Known { has: listed(headers), chosen, likely, near });
            (None, Problem::Missing { wanted, known })
        };
        if !self.has(Channel::Time) && self.row_step.is_none() {
            return Err(missing("t"));
        }
        if self.gyros().is_empty() && !maps.reference {
            return Err(missing("gyro_x, gyro_y or gyro_z"));
        }
        let parts: Vec<usize> = (0..4).filter(|&i| self.has(Channel::Quaternion(i))).collect();
        if !parts.is_empty() && parts.len() < 4 {
            let absent = (0..4).find(|i| !parts.contains(i)).unwrap_or_default();
            let name = ["ref_qw", "ref_qx", "ref_qy", "ref_qz"][absent];
            return Err((Some((0, name.to_owned())), Problem::PartOfQuaternion));
        }
        let (there, absent): (Vec<usize>, Vec<usize>) = (0..9).partition(|&i| self.has(Channel::Matrix(i)));
        if let (Some(_), Some(i)) = (there.first(), absent.first()) {
            return Err((Some((0, format!("ref_r{}{}", i / 3, i % 3))), Problem::PartOfMatrix));
        }
        Ok(self)
    }

    pub(super) fn has(&self, channel: Channel) -> bool {
        self.columns.iter().any(|c| c.channel == channel)
    }

    /// The axes that have a gyro column.
    #[must_use]
    pub fn gyros(&self) -> Vec<Axis> {
        Axis::ALL.into_iter().filter(|&a| self.has(Channel::Gyro(a))).collect()
    }

    /// The axes that have both a gyro and an angle or rate reference of their own.
    #[must_use]
    pub fn referenced(&self) -> Vec<Axis> {
        let has = |a: &Axis| self.has(Channel::RefAngle(*a)) || self.has(Channel::RefRate(*a));
        self.gyros().into_iter().filter(has).collect()
    }

    /// Takes nothing of a column any more that was taken without being named; what it held.
    pub(super) fn leave_out(&mut self, place: usize) -> Channel {
        let column = &mut self.columns[place];
        if let Some(pick) = self.chosen.iter().position(|pick| pick.name == column.name) {
            self.left_out.push(self.chosen.remove(pick).channel);
        }
        std::mem::replace(&mut column.channel, Channel::Unused)
    }

    /// Whether an accelerometer, or a gyro beside its reference, is in a unit that nobody said.
    #[must_use]
    pub fn has_unsaid_units(&self) -> bool {
        let is_unsaid = |pick: &Pick| {
            let turns = ["gyro_", "ref_angle_", "ref_rate_"].iter().any(|base| pick.name.starts_with(base));
            if pick.name.starts_with("accel_") {
                return !pick.is_unit_said;
            }
            let axis = pick.name.chars().last().and_then(|letter| letter.to_string().parse::<Axis>().ok());
            turns && !pick.is_unit_said && axis.is_some_and(|axis| self.judged(axis))
        };
        self.chosen.iter().any(is_unsaid)
    }

    /// Whether an axis has a gyro and something that it is held against.
    fn judged(&self, axis: Axis) -> bool {
        self.has(Channel::Gyro(axis)) && (self.has_orientation() || self.referenced().contains(&axis))
    }

    /// Whether an orientation is the reference.
    fn has_orientation(&self) -> bool {
        self.has(Channel::Quaternion(0)) || self.is_by_angles() || self.is_by_matrix()
    }

    /// Whether its orientation is given by a rotation matrix.
    pub(super) fn is_by_matrix(&self) -> bool {
        (0..9).all(|i| self.has(Channel::Matrix(i)))
    }

    /// Whether its orientation is given by roll, pitch and yaw.
    pub(super) fn is_by_angles(&self) -> bool {
        (0..3).all(|i| self.has(Channel::Euler(i)))
    }

    /// Whether some axis has both a gyro and a reference column.
    #[must_use]
    pub fn has_reference(&self) -> bool {
        self.has_orientation() || !self.referenced().is_empty()
    }
}

#[derive(PartialEq, Eq, Hash)]
enum Key {
    Known(String),
    Free(String),
}

/// Names that are looked at for slips.
const MOST_NAMES: usize = 200;

/// Headers that sound like a name of the format.
pub(super) fn near_names(headers: &[String]) -> String {
    let near =
        headers.iter().take(MOST_NAMES).filter_map(|name| unit::near(name).map(|ours| format!("{name} ({ours}?)")));
    near.take(3).collect::<Vec<_>>().join(", ")
}

/// The first row, for a message.
fn shown_row(head: &Head) -> String {
    let row = head.samples.first().map_or(&[][..], Vec::as_slice);
    let shown: Vec<_> =
        row.iter().take(12).map(|field| String::from_utf8_lossy(&field[..field.len().min(24)])).collect();
    shown.join(", ") + if row.len() > 12 { ", …" } else { "" }
}
