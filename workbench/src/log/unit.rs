//! Column names of the log format, and the units that a suffix on them means.

use gyro_model::Axis;
use log_readers::{
    meaning::Pick,
    unit::{STANDARD_GRAVITY, Unit},
};

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// `t`
    Time,
    /// `gyro_x` …
    Gyro(Axis),
    /// `ref_angle_x` …
    RefAngle(Axis),
    /// `ref_rate_x` …
    RefRate(Axis),
    /// `ref_qw`, `ref_qx`, `ref_qy`, `ref_qz`
    Quaternion(usize),
    /// Roll, pitch and yaw of an orientation, which a map of `ref_rpy` names.
    Euler(usize),
    /// `ref_r00` …, an orientation's rotation matrix, row by row.
    Matrix(usize),
    /// `accel_x` …
    Accel(Axis),
    /// `temp`
    Temperature,
    /// `supply`
    Supply,
    /// Any other name: place among the free channels.
    Free(usize),
    /// A free channel past the last that is carried.
    Unused,
}

impl Channel {
    /// Whether it is what a gyro is held against.
    #[must_use]
    pub fn is_reference(&self) -> bool {
        matches!(self, Self::RefAngle(_) | Self::RefRate(_) | Self::Quaternion(_) | Self::Euler(_) | Self::Matrix(_))
    }

    /// The axis whose gyro or reference it is.
    #[must_use]
    pub fn axis(self) -> Option<Axis> {
        match self {
            Self::Gyro(axis) | Self::RefAngle(axis) | Self::RefRate(axis) => Some(axis),
            _ => None,
        }
    }
}

/// From the written number to the SI one: value · scale + offset. Times: nanoseconds are value · 10^exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    /// Factor.
    pub scale: f64,
    /// Added after the factor.
    pub offset: f64,
    /// Times only: power of ten that makes nanoseconds.
    pub exponent: i32,
}

impl Conversion {
    /// SI already.
    pub const NONE: Self = Self { scale: 1.0, offset: 0.0, exponent: 9 };

    const fn scaled(scale: f64) -> Self {
        Self { scale, ..Self::NONE }
    }
}

/// The suffixes of the format.
const SUFFIXES: [&str; 10] = ["dps", "deg", "g", "mg", "k", "f", "ms", "us", "ns", "mv"];

/// A name of the format's table, without suffix.
fn plain(name: &str) -> Option<Channel> {
    let axis = |text: &str| text.parse::<Axis>().ok();
    match name {
        "t" => Some(Channel::Time),
        "temp" => Some(Channel::Temperature),
        "supply" => Some(Channel::Supply),
        "ref_qw" => Some(Channel::Quaternion(0)),
        "ref_qx" => Some(Channel::Quaternion(1)),
        "ref_qy" => Some(Channel::Quaternion(2)),
        "ref_qz" => Some(Channel::Quaternion(3)),
        _ => None
            .or_else(|| name.strip_prefix("gyro_").and_then(axis).map(Channel::Gyro))
            .or_else(|| name.strip_prefix("ref_angle_").and_then(axis).map(Channel::RefAngle))
            .or_else(|| name.strip_prefix("ref_rate_").and_then(axis).map(Channel::RefRate))
            .or_else(|| name.strip_prefix("ref_rpy_").and_then(axis).map(|axis| Channel::Euler(axis.index())))
            .or_else(|| name.strip_prefix("ref_r").and_then(of_matrix).map(Channel::Matrix))
            .or_else(|| name.strip_prefix("accel_").and_then(axis).map(Channel::Accel)),
    }
}

/// The place in a matrix of three rows that two digits from 0 name.
fn of_matrix(digits: &str) -> Option<usize> {
    let [row @ b'0'..=b'2', column @ b'0'..=b'2'] = digits.as_bytes() else { return None };
    Some(usize::from(3 * (row - b'0') + (column - b'0')))
}

/// The suffixes that a channel's quantity has: (suffix, conversion).
fn units(channel: Channel) -> &'static [(&'static str, Conversion)] {
    const DEGREE: f64 = std::f64::consts::PI / 180.0;
    const RATE: &[(&str, Conversion)] = &[("dps", Conversion::scaled(DEGREE))];
    const ANGLE: &[(&str, Conversion)] = &[("deg", Conversion::scaled(DEGREE))];
    const ACCEL: &[(&str, Conversion)] =
        &[("g", Conversion::scaled(STANDARD_GRAVITY)), ("mg", Conversion::scaled(STANDARD_GRAVITY * 1e-3))];
    const TEMPERATURE: &[(&str, Conversion)] = &[
        ("k", Conversion { offset: -273.15, ..Conversion::NONE }),
        ("f", Conversion { scale: 5.0 / 9.0, offset: -160.0 / 9.0, exponent: 9 }),
    ];
    const SUPPLY: &[(&str, Conversion)] = &[("mv", Conversion::scaled(1e-3))];
    const TIME: &[(&str, Conversion)] = &[
        ("ms", Conversion { exponent: 6, ..Conversion::NONE }),
        ("us", Conversion { exponent: 3, ..Conversion::NONE }),
        ("ns", Conversion { exponent: 0, ..Conversion::NONE }),
    ];
    match channel {
        Channel::Time => TIME,
        Channel::Gyro(_) | Channel::RefRate(_) => RATE,
        Channel::RefAngle(_) | Channel::Euler(_) => ANGLE,
        Channel::Accel(_) => ACCEL,
        Channel::Temperature => TEMPERATURE,
        Channel::Supply => SUPPLY,
        Channel::Quaternion(_) | Channel::Matrix(_) | Channel::Free(_) | Channel::Unused => &[],
    }
}

/// A quantity in words.
fn quantity(channel: Channel) -> &'static str {
    match channel {
        Channel::Time => "a time",
        Channel::Gyro(_) | Channel::RefRate(_) => "a rate",
        Channel::RefAngle(_) | Channel::Euler(_) => "an angle",
        Channel::Quaternion(_) => "a quaternion",
        Channel::Matrix(_) => "a rotation matrix",
        Channel::Accel(_) => "an acceleration",
        Channel::Temperature => "a temperature",
        Channel::Supply => "a voltage",
        Channel::Free(_) | Channel::Unused => "a free channel",
    }
}

/// A channel that is taken under a plain name, without a factor: in the unit that its file says.
pub fn with_unit(pick: Pick, unit: Unit) -> Pick {
    let bare = pick.factor == 1.0 && pick.offset == 0.0;
    match plain(&pick.name).and_then(|channel| converted(channel, unit)) {
        Some(_) if bare => Pick::new(&pick.name, &pick.channel, Some(unit)),
        _ => pick,
    }
}

/// A unit as written, for a channel of the format.
pub fn converted(channel: Channel, unit: Unit) -> Option<Conversion> {
    let suffix = unit.suffix.trim_start_matches('_');
    let own = match units(channel).iter().find(|(known, _)| *known == suffix) {
        Some(&(_, conversion)) => conversion,
        None if suffix.is_empty() => Conversion::NONE,
        None => return None,
    };
    Some(Conversion { scale: own.scale * unit.factor, ..own })
}

/// The name of the format that a free channel's name may be a slip of.
pub fn near(written: &str) -> Option<String> {
    const BASES: [&str; 12] = [
        "gyro_x",
        "gyro_y",
        "gyro_z",
        "ref_angle_x",
        "ref_angle_y",
        "ref_angle_z",
        "ref_rate_x",
        "ref_rate_y",
        "ref_rate_z",
        "ref_qw",
        "ref_qx",
        "ref_qy",
    ];
    if !matches!(name(written), Name::Free) {
        return None;
    }
    let lower = written.to_lowercase();
    let (_, suffix) = SUFFIXES.iter().find_map(|s| lower.rsplit_once('_').filter(|(_, end)| end == s)).unzip();
    let ending = suffix.map_or(String::new(), |suffix| format!("_{suffix}"));
    let bare = lower.strip_suffix(&ending).unwrap_or(&lower);
    if let Some(axis) =
        [("ref_roll", "x"), ("ref_pitch", "y"), ("ref_yaw", "z")].iter().find(|(angle, _)| *angle == bare)
    {
        return Some(format!("ref_angle_{}{ending}", axis.1));
    }
    // Short names that others give a gyro.
    let rest = |base: &&str| bare.strip_prefix(*base).map(|rest| rest.trim_start_matches(['_', '.']));
    if let Some(axis) = ["g", "gyr", "w", "omega"].iter().filter_map(rest).find(|rest| matches!(*rest, "x" | "y" | "z"))
    {
        return Some(format!("gyro_{axis}{ending}"));
    }
    if written.len() < 5 {
        return None;
    }
    let near = BASES.iter().filter(|base| bare.chars().last() == base.chars().last());
    let near = near.map(|base| (strsim::damerau_levenshtein(bare, base), base)).filter(|(distance, _)| *distance <= 2);
    near.min().map(|(_, base)| format!("{base}{ending}"))
}

/// What a header's name means.
#[derive(Debug, PartialEq)]
pub enum Name {
    /// A name of the format, and its unit.
    Known(Channel, Conversion),
    /// A name of the format with a unit of something else.
    WrongUnit {
        /// The suffix.
        suffix: &'static str,
        /// The quantity that it does not fit.
        quantity: &'static str,
        /// The names that would do.
        fitting: String,
    },
    /// Anything else.
    Free,
}

/// The channel of a name of the format, in whichever unit.
pub fn channel(name: &str) -> Option<Channel> {
    match self::name(name) {
        Name::Known(channel, _) => Some(channel),
        _ => None,
    }
}

/// What this name means.
pub fn name(name: &str) -> Name {
    if let Some(channel) = plain(name) {
        return Name::Known(channel, Conversion::NONE);
    }
    let Some((base, ending)) = name.rsplit_once('_') else { return Name::Free };
    let (Some(channel), Some(&suffix)) = (plain(base), SUFFIXES.iter().find(|&&s| s == ending)) else {
        return Name::Free;
    };
    if let Some(&(_, conversion)) = units(channel).iter().find(|(s, _)| *s == suffix) {
        return Name::Known(channel, conversion);
    }
    let others = units(channel).iter().map(|(unit, _)| format!("`{base}_{unit}`"));
    let fitting: Vec<String> = std::iter::once(format!("`{base}` (SI)")).chain(others).collect();
    Name::WrongUnit { suffix, quantity: quantity(channel), fitting: fitting.join(" or ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(text: &str) -> (Channel, Conversion) {
        match name(text) {
            Name::Known(channel, conversion) => (channel, conversion),
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn a_suffix_of_the_quantity_converts_to_si() {
        let si = |text, value: f64| {
            let (_, c) = known(text);
            value * c.scale + c.offset
        };
        assert!((si("gyro_x_dps", 180.0) - std::f64::consts::PI).abs() < 1e-15);
        assert!((si("ref_angle_z_deg", -90.0) + std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((si("accel_y_mg", 1000.0) - 9.806_65).abs() < 1e-12);
        assert!((si("temp_f", 212.0) - 100.0).abs() < 1e-12);
        assert!((si("temp_k", 273.15)).abs() < 1e-12);
        assert!((si("supply_mv", 3300.0) - 3.3).abs() < 1e-15);
        assert_eq!(known("t_us").1.exponent, 3);
    }

    #[test]
    fn a_slip_of_the_pen_is_named() {
        assert_eq!(near("ref_agnle_z").as_deref(), Some("ref_angle_z"));
        assert_eq!(near("gyr_x_dps").as_deref(), Some("gyro_x_dps"));
        assert_eq!(near("gz").as_deref(), Some("gyro_z"));
        assert_eq!(near("ref_yaw_deg").as_deref(), Some("ref_angle_z_deg"));
        assert_eq!(near("omega_y_dps").as_deref(), Some("gyro_y_dps"));
        for text in ["gyro_x", "motor_x", "angle", "ref_qw", "load", "gyro_q"] {
            assert_eq!(near(text), None, "{text}");
        }
    }

    #[test]
    fn a_suffix_on_any_other_name_is_part_of_a_free_channel() {
        for text in ["vibration_g", "motor_ms", "gyro_x_mdps", "t_s", "T", "gyro_w", "ref_qw2", "temp2_k", ""] {
            assert_eq!(name(text), Name::Free, "{text}");
        }
    }

    #[test]
    fn a_unit_of_something_else_is_not_taken_for_a_free_channel() {
        for text in ["gyro_x_g", "gyro_x_deg", "accel_x_dps", "t_k", "ref_qw_deg", "temp_mv"] {
            assert!(matches!(name(text), Name::WrongUnit { .. }), "{text}");
        }
    }
}
