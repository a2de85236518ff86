//! What is shown of a guided recording.

use super::{Goal, Manoeuvre, temperature::Course};
use crate::Axis;
use serde::{Serialize, Serializer, ser::SerializeMap};
use std::fmt;

/// Fewer rows a second show no hand's motion.
pub(super) const FEWEST_ROWS: f64 = 20.0;
/// A turn that both gyro and reference have to show, rad.
pub(super) const FAR: f64 = 0.35;

/// Where a recording stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Rows are recorded, an order stands.
    Recording,
    /// All goals are reached: the rows so far are searched for what is missing.
    Searching,
    /// Nothing more is to be done.
    Over,
}

/// An order that stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Order {
    pub manoeuvre: Manoeuvre,
    /// Since when, s.
    pub since: f64,
    /// For how long it was followed, s.
    pub followed: f64,
}

/// What is wrong with what a hand does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Correction {
    /// It moves and is to be still.
    Still,
    /// It does not move.
    Move,
    /// It turns about another axis.
    OtherAxis,
    /// It is too slow.
    Faster,
    /// It is too fast.
    Slower,
    /// It turns through too small an angle.
    Further,
}

/// Whether the hand makes what was ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Followed {
    /// It is too early to say.
    TooEarly,
    /// It does.
    Well,
    /// It does not.
    Not {
        /// What is wrong.
        correction: Correction,
        /// Rate reached about the axis that is meant, rad/s.
        reached: f64,
        /// The other axis that turns most.
        other: Option<Axis>,
    },
}

/// What keeps a recording from telling anything, whatever the hand does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trouble {
    /// So few rows a second.
    SlowRows(f64),
    /// The gyro turns, its reference does not.
    ReferenceStands(Axis),
    /// The reference turns, its gyro does not.
    GyroStands(Axis),
    /// Readings stand at the end of the range, rad/s.
    Saturates(Axis, f64),
}

/// How a recording stands.
#[derive(Clone, Debug)]
pub struct State {
    /// What is done now.
    pub stage: Stage,
    /// Length so far, s.
    pub seconds: f64,
    /// Rows so far.
    pub rows: u64,
    /// What to do now.
    pub order: Option<Manoeuvre>,
    /// For how long it was done, s.
    pub followed: f64,
    /// Whether it is done.
    pub hand: Followed,
    /// What is wrong.
    pub troubles: Vec<Trouble>,
    /// What is wanted.
    pub goals: Vec<Goal>,
    /// How a course of temperatures stands, where there is one.
    pub temperature: Option<Course>,
}

impl State {
    /// What to do now, or what is waited for.
    #[must_use]
    pub fn says(&self) -> String {
        match (self.stage, &self.order) {
            (Stage::Recording, Some(order)) => match self.temperature.filter(|course| !course.is_over()) {
                Some(course) => format!("{}; meanwhile {order}", course.says()),
                None => order.to_string(),
            },
            (Stage::Recording, None) => "wait: no row has come yet".to_owned(),
            (Stage::Searching, _) => "hold it still: the recording is searched for missing effects".to_owned(),
            (Stage::Over, _) => "put it down: the recording is complete".to_owned(),
        }
    }

    /// What is wrong with what the hand does, in words.
    #[must_use]
    pub fn correction(&self) -> Option<String> {
        let Followed::Not { correction, reached, other } = self.hand else { return None };
        let order = self.order?;
        let (axis, reached, wanted) = (order.axis, reached.to_degrees(), order.rate.to_degrees());
        Some(match correction {
            Correction::Still => "keep still: it moves".to_owned(),
            Correction::Move => format!("it does not move: turn it about {axis}"),
            Correction::OtherAxis => {
                format!("about {axis}, not about {}", other.map_or("another axis", Axis::letter))
            }
            Correction::Faster => format!("faster: {reached:.0} °/s reached, {wanted:.0} wanted"),
            Correction::Slower => format!("slower: {reached:.0} °/s, {wanted:.0} wanted"),
            Correction::Further => format!("further: through {:.0}°", order.travel().to_degrees()),
        })
    }
}

impl Trouble {
    /// Its name, for programs.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::SlowRows(_) => "slow-rows",
            Self::ReferenceStands(_) => "reference-stands",
            Self::GyroStands(_) => "gyro-stands",
            Self::Saturates(..) => "saturates",
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::SlowRows(rows) => write!(
                f,
                "only {rows:.0} rows come a second, and a hand's motion needs 50 or more: raise the sensor's output rate or the baud rate"
            ),
            Self::ReferenceStands(axis) => write!(
                f,
                "the gyro about {axis} turns and its reference stands still: check the encoder's cable and coupling, and that the \
                 reference is of this axis"
            ),
            Self::GyroStands(axis) => write!(
                f,
                "the reference about {axis} turns and the gyro reads nothing: check that gyro_{axis} is the axis that is turned"
            ),
            Self::Saturates(axis, rail) => write!(
                f,
                "the gyro about {axis} reads no more than {:.0} °/s: set a larger range in its driver, or turn more slowly",
                rail.to_degrees()
            ),
        }
    }
}

impl Serialize for Trouble {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("trouble", self.name())?;
        map.serialize_entry("says", &self.to_string())?;
        map.end()
    }
}

impl Serialize for State {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("stage", &self.stage)?;
        map.serialize_entry("seconds", &self.seconds)?;
        map.serialize_entry("rows", &self.rows)?;
        map.serialize_entry("says", &self.says())?;
        map.serialize_entry("order", &self.order)?;
        map.serialize_entry("followed", &self.followed)?;
        let correction = match self.hand {
            Followed::Not { correction, .. } => Some(correction),
            _ => None,
        };
        map.serialize_entry("correction", &correction)?;
        map.serialize_entry("correction_says", &self.correction())?;
        map.serialize_entry("troubles", &self.troubles)?;
        map.serialize_entry("parameters", &self.goals)?;
        if let Some(course) = &self.temperature {
            map.serialize_entry("temperature", course)?;
        }
        map.end()
    }
}
