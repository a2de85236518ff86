//! The header: which column holds what, in which unit.

use super::{
    column_map::{ColumnMap, listed},
    error::Problem,
    number,
    unit::{self, Channel, Conversion, Name},
};
use gyro_model::{Axis, record::FREE_CHANNELS};
use std::collections::HashMap;

/// One column.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name, after renaming.
    pub name: String,
    /// What it holds.
    pub channel: Channel,
    /// To SI.
    pub conversion: Conversion,
}

/// What a log's columns hold.
#[derive(Clone, Debug)]
pub struct Layout {
    /// In the order of the file.
    pub(super) columns: Vec<Column>,
    /// Names of the free channels that are carried, at most [`FREE_CHANNELS`].
    pub free_names: Vec<String>,
    /// Free channels past those: they are not read.
    pub unused_names: Vec<String>,
}

/// A refused header: the column where one is at fault.
pub type Refusal = (Option<(usize, String)>, Problem);

impl Layout {
    /// Understands a header row.
    ///
    /// # Errors
    /// A header that is none, names a quantity twice or in a unit of another, or lacks what every log needs.
    pub fn new(fields: &[&[u8]], map: Option<&ColumnMap>) -> Result<Self, Refusal> {
        let headers: Vec<String> =
            fields.iter().map(|f| String::from_utf8_lossy(f.trim_ascii()).into_owned()).collect();
        if fields.iter().all(|f| matches!(number::value(f), number::Field::Number(_) | number::Field::Nan)) {
            return Err((None, Problem::NoHeader));
        }
        let renamed = match map {
            Some(map) => map.rename(&headers).map_err(|p| (None, p))?,
            None => headers.clone(),
        };
        if let ([only], None) = (headers.as_slice(), map) {
            for (separator, word) in [(';', "semicolons"), ('\t', "tabs"), ('|', "bars"), (' ', "blanks")] {
                if only.contains(separator) {
                    return Err((None, Problem::Separator(word)));
                }
            }
        }
        let mut layout = Self { columns: Vec::with_capacity(fields.len()), free_names: vec![], unused_names: vec![] };
        let mut seen: HashMap<Key, usize> = HashMap::new();
        for (i, name) in renamed.into_iter().enumerate() {
            let name = if name.is_empty() { format!("column_{}", i + 1) } else { name };
            let (channel, conversion) = match unit::name(&name) {
                Name::Known(channel, conversion) => (channel, conversion),
                Name::WrongUnit { suffix, quantity, fitting } => {
                    return Err((Some((i + 1, name)), Problem::Unit { suffix, quantity, fitting }));
                }
                Name::Free => (layout.free(&name), Conversion::NONE),
            };
            let key = if matches!(channel, Channel::Free(_) | Channel::Unused) {
                Key::Free(name.clone())
            } else {
                Key::Known(format!("{channel:?}"))
            };
            if let Some(first) = seen.insert(key, i) {
                let problem = Problem::Twice {
                    first: format!("column {} `{}`", first + 1, layout.columns[first].name),
                    second: format!("column {} `{name}`", i + 1),
                };
                return Err((Some((i + 1, name)), problem));
            }
            layout.columns.push(Column { name, channel, conversion });
        }
        layout.complete(&headers)
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

    /// Refuses a header without time, without gyro, or with part of a quaternion.
    fn complete(self, headers: &[String]) -> Result<Self, Refusal> {
        let missing = |wanted, likely: &[&str]| {
            let lower: Vec<String> = headers.iter().map(|h| h.to_lowercase()).collect();
            // A name of the format in other letters, or one that sounds like it.
            let fits = |name: &str| match unit::name(name) {
                Name::Known(Channel::Time, _) => wanted == "t",
                Name::Known(Channel::Gyro(_), _) => wanted != "t",
                _ => false,
            };
            let same = lower.iter().position(|h| fits(h)).map(|i| (&headers[i], lower[i].as_str()));
            let sounds = |h: &String| likely.iter().any(|l| h.contains(l));
            // The clock of a ROS bag's CSV counts nanoseconds.
            let example = |name: &str| if name == "%time" { "t_ns" } else { wanted_example(wanted) };
            let like = lower.iter().position(sounds).map(|i| (&headers[i], example(&lower[i])));
            let hint = same.or(like).map_or_else(String::new, |(h, name)| format!(", such as {h:?} = \"{name}\""));
            (None, Problem::Missing { wanted, has: listed(headers), hint })
        };
        if !self.has(Channel::Time) {
            let ends = |endings: &[&str]| {
                headers.iter().find(|h| endings.iter().any(|ending| h.to_lowercase().ends_with(ending)))
            };
            if let (Some(fine), Some(coarse)) = (
                ends(&["nsec", "nsecs", "nanosec", "nanosecs"]),
                ends(&[".sec", ".secs", "_sec", "_secs", "/sec", "/secs"]),
            ) {
                let hint =
                    format!(" after joining {coarse:?} and {fine:?} into one, seconds and 1e-9 times nanoseconds");
                return Err((None, Problem::Missing { wanted: "t", has: listed(headers), hint }));
            }
            return Err(missing("t", &["time", "stamp", "sec"]));
        }
        if self.gyros().is_empty() {
            return Err(missing("gyro_x, gyro_y or gyro_z", &["gyr", "omega", "angvel", "angular", "gx", "gy", "gz"]));
        }
        let parts: Vec<usize> = (0..4).filter(|&i| self.has(Channel::Quaternion(i))).collect();
        if !parts.is_empty() && parts.len() < 4 {
            let absent = (0..4).find(|i| !parts.contains(i)).unwrap_or_default();
            let name = ["ref_qw", "ref_qx", "ref_qy", "ref_qz"][absent];
            return Err((Some((0, name.to_owned())), Problem::PartOfQuaternion));
        }
        Ok(self)
    }

    fn has(&self, channel: Channel) -> bool {
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

    /// Whether some axis has both a gyro and a reference column.
    #[must_use]
    pub fn has_reference(&self) -> bool {
        self.has(Channel::Quaternion(0)) || !self.referenced().is_empty()
    }
}

#[derive(PartialEq, Eq, Hash)]
enum Key {
    Known(String),
    Free(String),
}

fn wanted_example(wanted: &str) -> &str {
    if wanted == "t" { "t" } else { "gyro_z_dps" }
}
