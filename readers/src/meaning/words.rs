//! The words of a channel's name, and what they say it holds.

use crate::unit::{self, Quantity, Unit};

/// What a channel holds, as far as its name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// A time.
    Time,
    /// Rate of turn about this axis, 0 to 2.
    Rate(usize),
    /// Angle about this axis, where the name says which.
    Angle(Option<usize>),
    /// Specific force along this axis.
    Acceleration(usize),
    /// Part of an orientation: w, x, y, z.
    Quaternion(usize),
    /// Temperature.
    Temperature,
    /// Supply voltage.
    Supply,
}

/// Who measured it, as far as the name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Who {
    /// The name does not say.
    Unsaid,
    /// Something else than the gyro: an encoder, cameras, a simulator's truth.
    Reference,
}

/// A name, understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Meaning {
    /// What it holds.
    pub what: What,
    /// Who measured it.
    pub who: Who,
    /// Its unit, where the name or the text says it.
    pub unit: Option<Unit>,
    /// The rest of the name, which channels of one sensor share.
    pub sensor: String,
    /// How sure a name is among others of the same meaning: a smaller one is taken before a larger.
    pub rank: u8,
}

const REFERENCE: &[&str] = &[
    "ref",
    "reference",
    "truth",
    "true",
    "gt",
    "groundtruth",
    "ground",
    "encoder",
    "enc",
    "mocap",
    "vicon",
    "optitrack",
    "qualisys",
    "natnet",
    "vrpn",
    "turntable",
    "cameras",
    "opti",
    "qtm",
    "drehgeber",
    "winkelgeber",
    "geber",
    "referenz",
];
const ENCODER: &[&str] = &["encoder", "enc", "drehgeber", "winkelgeber", "geber", "turntable"];
/// Rank of a name that says too little to take it without asking.
pub(super) const UNSURE: u8 = 2;
/// What is computed of a reading, or is none.
const NOT_A_READING: &[&str] = &[
    "bias",
    "offset",
    "offsets",
    "std",
    "cov",
    "covariance",
    "variance",
    "setpoint",
    "sp",
    "cmd",
    "command",
    "desired",
    "target",
    "error",
    "err",
    "unfilt",
    "unfiltered",
    "debug",
    "derivative",
    "dot",
    "delta",
    "increment",
    "integral",
    "clip",
    "clipping",
    "clipcounter",
    "accuracy",
    "uncertainty",
    "status",
    "mag",
    "magnetometer",
    "magnetic",
    "id",
    "count",
    "counter",
    "norm",
    "user",
    "gravity",
    "jerk",
    "noise",
    "max",
    "min",
];

/// The words of a name in small letters: cut at anything but letters and digits, and where a capital begins a word.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![String::new()];
    let letters: Vec<char> = name.chars().collect();
    for (i, &c) in letters.iter().enumerate() {
        if !c.is_alphanumeric() {
            words.push(String::new());
            continue;
        }
        let before = i.checked_sub(1).map(|i| letters[i]);
        let begins = c.is_uppercase()
            && (before.is_some_and(char::is_lowercase)
                || before.is_some_and(char::is_uppercase)
                    && letters.get(i + 1).is_some_and(|next| next.is_lowercase()));
        if begins {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

fn axis(word: &str) -> Option<usize> {
    match word {
        "x" | "0" | "roll" => Some(0),
        "y" | "1" | "pitch" => Some(1),
        "z" | "2" | "yaw" | "heading" => Some(2),
        _ => None,
    }
}

fn part(word: &str) -> Option<usize> {
    match word {
        "w" | "0" | "q0" | "qw" => Some(0),
        "x" | "1" | "q1" | "qx" => Some(1),
        "y" | "2" | "q2" | "qy" => Some(2),
        "z" | "3" | "q3" | "qz" => Some(3),
        _ => None,
    }
}

/// Understands a name; `unit` is what stands beside it.
#[must_use]
pub fn understand(name: &str, unit: Option<Unit>) -> Option<Meaning> {
    let (bare, in_name) = unit::split(name);
    let mut words = words(bare);
    let mut unit = unit.or(in_name);
    // A unit as the last word: gyro_x_dps, timestamp_ns.
    if unit.is_none()
        && words.len() > 1
        && let Some(last) = words.last()
        && (last.len() > 1 || last == "s")
        && let Some(found) = unit::parse(last).filter(|unit| unit.quantity != Quantity::Other)
    {
        unit = Some(found);
        words.pop();
    }
    let is = |any: &[&str]| words.iter().any(|word| any.contains(&word.as_str()));
    let who = if is(REFERENCE) { Who::Reference } else { Who::Unsaid };
    let has = |quantity| unit.is_none_or(|u: Unit| u.quantity == quantity);
    let meaning = |what, rank, sensor: String| Some(Meaning { what, who, unit, sensor, rank });
    if let Some(rank) = time_rank(&words)
        && has(Quantity::Time)
    {
        // `millis` is a time and its unit.
        let unit = unit.or_else(|| unit::parse(&words[0]).filter(|u| words.len() == 1 && u.quantity == Quantity::Time));
        return Some(Meaning { what: What::Time, who, unit, sensor: String::new(), rank });
    }
    let last = words.last()?.clone();
    let sensor = |parts: usize| words[..words.len().saturating_sub(parts)].join("_");
    // EuRoC's estimate of a bias: b_w_RS_S_x.
    if words[0] == "b" && words.len() > 3 {
        return None;
    }
    // A reference of an estimate is one; how sure it is of it is none.
    if is(NOT_A_READING) && (who != Who::Reference || is(&["bias", "std", "cov", "covariance"])) {
        return None;
    }
    let squeezed = ["gx", "gy", "gz", "wx", "wy", "wz", "ax", "ay", "az"].iter().position(|two| *two == last);
    if let Some(place) = squeezed {
        let what = if place < 6 { What::Rate(place % 3) } else { What::Acceleration(place % 3) };
        let fits = has(if place < 6 { Quantity::Rate } else { Quantity::Acceleration });
        return fits.then(|| meaning(what, 1, sensor(1) + &last[..1])).flatten();
    }
    let quaternion = is(&["q", "quat", "quaternion", "orientation", "attitude", "rotation"])
        || words.last().is_some_and(|w| ["qw", "qx", "qy", "qz", "q0", "q1", "q2", "q3"].contains(&w.as_str()));
    let turns = is(&["gyr", "gyro", "gyroadc", "gyros", "gyroscope", "omega", "angvel"])
        || is(&["angular", "rotation", "rot", "turn"]) && is(&["velocity", "vel", "rate", "rates", "speed"])
        || words.windows(2).any(|pair| pair == ["w", "rs"] || pair == ["rate", "gyro"])
        || is(&["drehrate", "winkelgeschwindigkeit"])
        // Nothing but a rate of turn has such a unit.
        || unit.is_some_and(|u| u.quantity == Quantity::Rate);
    if turns
        && has(Quantity::Rate)
        && let Some(axis) = axis(&last)
    {
        return meaning(What::Rate(axis), 0, sensor(1));
    }
    // `yaw rate`, `yawspeed`: about the axis of an angle.
    if has(Quantity::Rate)
        && let Some((axis, sensor)) = rate_of_angle(&words)
    {
        return meaning(What::Rate(axis), 1, sensor);
    }
    let pushes = is(&["acc", "accel", "accelerometer", "acceleration", "accsmooth", "specific"])
        || words.windows(2).any(|pair| pair == ["a", "rs"]);
    if pushes
        && has(Quantity::Acceleration)
        && let Some(axis) = axis(&last)
    {
        return meaning(What::Acceleration(axis), u8::from(is(&["linear", "free"])), sensor(1));
    }
    if quaternion
        && unit.is_none_or(|u| u.quantity == Quantity::Other)
        && let Some(part) = part(&last)
    {
        return meaning(What::Quaternion(part), 0, sensor(1));
    }
    let angle = unit.is_some_and(|u| u.quantity == Quantity::Angle);
    // What an encoder hands out is an angle, though the name does not say in what.
    let encoder = unit.is_none() && is(ENCODER);
    if angle || encoder || who == Who::Reference && is(&["angle", "position", "winkel"]) {
        let about = axis(&last).or_else(|| words.iter().find_map(|word| axis(word)));
        let unsure = if angle || is(&["angle", "position", "winkel"]) { 0 } else { UNSURE };
        return meaning(What::Angle(about), unsure + u8::from(about.is_none()), sensor(usize::from(about.is_some())));
    }
    if is(&["temp", "temperature", "temps"]) && has(Quantity::Temperature) {
        return meaning(What::Temperature, u8::from(words.len() > 2), String::new());
    }
    if is(&["vbat", "supply", "vbatlatest", "vcc", "vdd"]) && has(Quantity::Voltage) {
        return meaning(What::Supply, 0, String::new());
    }
    None
}

/// The axis that a rate of turn is about which is named after an angle, and the rest of the name.
fn rate_of_angle(words: &[String]) -> Option<(usize, String)> {
    const RATES: [&str; 5] = ["rate", "speed", "velocity", "vel", "rates"];
    let angle = |word: &str| if word.len() > 1 { axis(word) } else { None };
    let (place, axis, length) = words.iter().enumerate().find_map(|(i, word)| {
        let squeezed = RATES.iter().find_map(|rate| angle(word.strip_suffix(rate)?));
        let apart = words.get(i + 1).filter(|next| RATES.contains(&next.as_str())).and_then(|_| angle(word));
        squeezed.map(|axis| (i, axis, 1)).or(apart.map(|axis| (i, axis, 2)))
    })?;
    let rest: Vec<&str> = words[..place].iter().chain(&words[place + length..]).map(String::as_str).collect();
    Some((axis, rest.join("_")))
}

/// Whether a name is a time's, and which of several is the better: one that counts from the recording's start before one that
/// counts from an epoch.
fn time_rank(words: &[String]) -> Option<u8> {
    let joined = words.join("_");
    Some(match joined.as_str() {
        "t" => 0,
        "seconds_elapsed" | "elapsed" | "elapsed_time" | "time_elapsed" | "time_startup" | "sample_time_fine"
        | "relative_time" => 1,
        "time"
        | "x_value"
        | "zeit"
        | "uhrzeit"
        | "zeitstempel"
        | "temps"
        | "tiempo"
        | "tempo"
        | "timestamp"
        | "timestamps"
        | "ts"
        | "time_stamp"
        | "sample_time"
        | "sensor_time"
        | "timestamp_sample"
        | "header_stamp"
        | "stamp"
        | "field_header_stamp"
        | "header_timestamp"
        | "stamp_secs"
        | "header_stamp_secs"
        | "stamp_sec"
        | "header_stamp_sec"
        | "field_header_stamp_secs" => 2,
        "datetime" | "date_time" | "sec" | "secs" | "seconds" | "second" | "millis" | "micros" | "ms" | "us" | "ns"
        | "s" => 3,
        "time_boot" | "logging_time" | "unix_time" | "epoch" | "epoch_time" | "utc_time" | "system_time"
        | "host_time" | "device_time" => 4,
        _ if joined.ends_with("_timestamp") || joined.ends_with("_time") && words.len() == 2 => 5,
        _ if words.iter().any(|word| word == "timestamp") => 6,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn what(name: &str) -> Option<What> {
        understand(name, None).map(|meaning| meaning.what)
    }

    #[test]
    fn names_of_many_tools_are_understood() {
        for (name, wanted) in [
            ("Gyr_X", What::Rate(0)),
            ("Gyroscope Z (deg/s)", What::Rate(2)),
            ("gyroADC[1]", What::Rate(1)),
            ("w_RS_S_x [rad s^-1]", What::Rate(0)),
            ("gz", What::Rate(2)),
            ("GyroX", What::Rate(0)),
            ("gyro_rad[2]", What::Rate(2)),
            ("field.angular_velocity.y", What::Rate(1)),
            ("Gyroscope x (rad/s)", What::Rate(0)),
            ("imu2_gyro_x_dps", What::Rate(0)),
            ("a_RS_S_y [m s^-2]", What::Acceleration(1)),
            ("Acc_Z", What::Acceleration(2)),
            ("accSmooth[0]", What::Acceleration(0)),
            ("Quat_q0", What::Quaternion(0)),
            ("q_RS_w []", What::Quaternion(0)),
            ("qz", What::Quaternion(3)),
            ("Quaternion W", What::Quaternion(0)),
            ("time (us)", What::Time),
            ("timestamp [ns]", What::Time),
            ("Time (s)", What::Time),
            ("SampleTimeFine", What::Time),
            ("t", What::Time),
            ("yawspeed", What::Rate(2)),
            ("YawRate[deg/s]", What::Rate(2)),
            ("roll_rate", What::Rate(0)),
            ("Drehrate Z [°/s]", What::Rate(2)),
            ("motionRotationRateX(rad/s)", What::Rate(0)),
            ("motionTimestamp_sinceReboot(s)", What::Time),
            ("time_boot_ms", What::Time),
            ("Zeit [s]", What::Time),
            ("Turntable (deg)", What::Angle(None)),
            ("encoder_z [deg]", What::Angle(Some(2))),
            ("enc", What::Angle(None)),
            ("Winkel Geber", What::Angle(None)),
            ("Temperature", What::Temperature),
            ("temp_c", What::Temperature),
            ("vbatLatest (V)", What::Supply),
        ] {
            assert_eq!(what(name), Some(wanted), "{name}");
        }
    }

    #[test]
    fn what_is_no_reading_is_left_alone() {
        for name in [
            "b_w_RS_S_x [rad s^-1]",
            "gyroUnfilt[0]",
            "setpoint[0]",
            "gyro_x_std",
            "x",
            "y",
            "angle",
            "Mag_X",
            "motor[0]",
            "loopIteration",
            "",
            "w",
            "Gyro_X (m)",
        ] {
            assert_eq!(what(name), None, "{name}");
        }
    }

    #[test]
    fn channels_of_one_sensor_share_the_rest_of_their_names() {
        let sensor = |name: &str| understand(name, None).unwrap().sensor;
        assert_eq!(sensor("imu1_gyro_x"), sensor("imu1_gyro_y"));
        assert_ne!(sensor("imu1_gyro_x"), sensor("imu2_gyro_x"));
        assert_eq!(understand("mocap_qw", None).unwrap().who, Who::Reference);
    }
}
