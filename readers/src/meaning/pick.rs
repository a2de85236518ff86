//! One channel taken under a name of our logs.

use crate::unit::Unit;
use std::fmt;

/// `NAME=FACTOR*CHANNEL+OFFSET`
#[derive(Clone, Debug, PartialEq)]
pub struct Pick {
    /// The name of our logs, its unit as a suffix.
    pub name: String,
    /// The channel as its file names it.
    pub channel: String,
    /// Times this.
    pub factor: f64,
    /// Plus this.
    pub offset: f64,
    /// Whether its unit is known, not only thought to be SI because nobody says another.
    pub is_unit_said: bool,
}

impl Pick {
    /// A channel under a name without suffix, in this unit.
    #[must_use]
    pub fn new(name: &str, channel: &str, unit: Option<Unit>) -> Self {
        let (suffix, factor) = unit.map_or(("", 1.0), |unit| (unit.suffix, unit.factor));
        Self { name: format!("{name}{suffix}"), channel: channel.to_owned(), factor, offset: 0.0, is_unit_said: true }
    }
}

/// A factor without what the last bit of a quotient adds: 0.225, not 0.22499999999999998.
fn as_written(factor: f64) -> f64 {
    format!("{factor:.13e}").parse().unwrap_or(factor)
}

impl fmt::Display for Pick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}=", self.name)?;
        // Counts for a unit are said as their sheets do: gz/131, not 0.007633587786259542*gz.
        let divisor = (self.factor.abs().recip() * 1e6).round() * 1e-6;
        let divides = self.factor.to_string().len() > 8
            && (divisor.recip() - self.factor.abs()).abs() < 1e-12 * self.factor.abs();
        match as_written(self.factor) {
            1.0 => f.write_str(&self.channel)?,
            -1.0 => write!(f, "-{}", self.channel)?,
            factor if divides => write!(f, "{}{}/{divisor}", if factor < 0.0 { "-" } else { "" }, self.channel)?,
            factor => write!(f, "{factor}*{}", self.channel)?,
        }
        match self.offset {
            0.0 => Ok(()),
            offset => write!(f, "{offset:+}"),
        }
    }
}

/// A channel that was computed from the gyro of its own file.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependent {
    /// The channel, or what its name begins with.
    pub channel: String,
    /// What computed it.
    pub by: &'static str,
}

/// Another gyro of the same file, which is a reference of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Second {
    /// Its topic.
    pub topic: String,
    /// Readings a second; not a number where the file does not tell.
    pub rate_hz: f64,
    /// Its axes as a reference.
    pub picks: Vec<Pick>,
}

impl Second {
    /// Slower readings than this miss most of what a hand or a vehicle does between them.
    pub const SLOWEST_HZ: f64 = 20.0;

    /// Whether it came often enough.
    #[must_use]
    pub fn serves(&self) -> bool {
        self.rate_hz >= Self::SLOWEST_HZ
    }
}

/// What a file's names say of its channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Proposal {
    /// Clear: taken without asking.
    pub chosen: Vec<Pick>,
    /// Likely: for the user to choose.
    pub offered: Vec<Pick>,
    /// No reference for this gyro.
    pub dependent: Vec<Dependent>,
    /// Other gyros, where nothing better is the reference.
    pub seconds: Vec<Second>,
}

impl Proposal {
    /// Why this channel is no reference for the gyro of its file.
    #[must_use]
    pub fn dependence(&self, channel: &str) -> Option<&'static str> {
        self.dependent.iter().find(|d| channel.starts_with(&d.channel)).map(|d| d.by)
    }
}
