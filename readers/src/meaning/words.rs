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
        "w" | "0" | "q0" | "qw" | "r" | "real" => Some(0),
        "x" | "1" | "q1" | "qx" | "i" | "qi" => Some(1),
        "y" | "2" | "q2" | "qy" | "j" | "qj" => Some(2),
        "z" | "3" | "q3" | "qz" | "k" | "qk" => Some(3),
        _ => None,
    }
}

/// Understands a name; `unit` is what stands beside it.
#[must_use]
pub fn understand(name: &str, unit: Option<Unit>) -> Option<Meaning> {
    let name = Name::of(name, unit);
    if let Some(time) = name.time() {
        return Some(time);
    }
    if name.words.is_empty() || name.is_no_reading() {
        return None;
    }
    if let Some(place) = name.squeezed() {
        return name.of_squeezed(place);
    }
    name.rate()
        .or_else(|| name.acceleration())
        .or_else(|| name.quaternion())
        .or_else(|| name.angle())
        .or_else(|| name.temperature())
        .or_else(|| name.supply())
}

/// The unit that stands in a name or beside it, whatever it is a name of.
#[must_use]
pub fn unit_said(name: &str, unit: Option<Unit>) -> Option<Unit> {
    Name::of(name, unit).unit
}

/// Cuts the letter of an axis off a word that is written without a sign before it: `gyroz`, `accelx`.
fn unsqueeze(words: &mut Vec<String>) {
    const STEMS: [&str; 10] = [
        "gyro",
        "gyr",
        "gyroscope",
        "acc",
        "accel",
        "accelerometer",
        "acceleration",
        "angvel",
        "omega",
        "angularvelocity",
    ];
    let cut = words.last().and_then(|last| {
        let letter = ["x", "y", "z"].into_iter().find(|letter| last.ends_with(letter))?;
        let stem = last.strip_suffix(letter).filter(|stem| STEMS.contains(stem))?;
        Some((stem.to_owned(), letter.to_owned()))
    });
    if let Some((stem, letter)) = cut {
        words.pop();
        words.extend([stem, letter]);
    }
}

/// The unit that the last words of a name are, a quantity over a time, and how many words that is.
fn quotient(words: &[String]) -> Option<(Unit, usize)> {
    let (over, below) = match words {
        [.., over, per, below] if per == "per" => (over, below),
        [.., over, below] => (over, below),
        _ => return None,
    };
    let count = if words[words.len() - 2] == "per" { 3 } else { 2 };
    let found = unit::parse(&format!("{over}/{below}")).filter(|_| words.len() > count)?;
    matches!(found.quantity, Quantity::Rate | Quantity::Acceleration).then_some((found, count))
}

/// A name on its way to a meaning.
struct Name {
    words: Vec<String>,
    last: String,
    unit: Option<Unit>,
    who: Who,
}

impl Name {
    fn of(name: &str, unit: Option<Unit>) -> Self {
        let (bare, in_name) = unit::split(name);
        let mut words = words(bare);
        let mut unit = unit.or(in_name);
        // A quotient as the last words: gyro_z_rad_s, gyro_z_mrad/s, rate_deg_per_h.
        if unit.is_none()
            && let Some((found, count)) = quotient(&words)
        {
            unit = Some(found);
            words.truncate(words.len() - count);
        }
        // A unit as the last word: gyro_x_dps, timestamp_ns.
        if unit.is_none()
            && words.len() > 1
            && let Some(last) = words.last()
            && (last.len() > 1 || ["s", "h"].contains(&last.as_str()))
            && let Some(found) = unit::parse(last).filter(|unit| unit.quantity != Quantity::Other)
            // `gyro_x_min` is the least of it, `time_min` a time in minutes.
            && (![unit::MINUTES, unit::HOURS].contains(&found) || time_rank(&words[..words.len() - 1]).is_some())
        {
            unit = Some(found);
            words.pop();
        }
        // Before the letter of the axis: gyro_dps.z.
        if unit.is_none()
            && let [.., _, before, last] = words.as_slice()
            && before.len() > 1
            && axis(last).is_some()
            && let Some(found) = unit::parse(before)
                .filter(|unit| matches!(unit.quantity, Quantity::Rate | Quantity::Acceleration | Quantity::Angle))
        {
            words.remove(words.len() - 2);
            // gyro_rad[2] is in rad/s.
            let turns = words.iter().any(|word| word.starts_with("gyr"));
            unit = Some(match (found.quantity, found.suffix) {
                (Quantity::Angle, "") if turns => unit::RADIANS_PER_SECOND,
                (Quantity::Angle, "_deg") if turns => unit::DEGREES_PER_SECOND,
                _ => found,
            });
        }
        unsqueeze(&mut words);
        let last = words.last().cloned().unwrap_or_default();
        let mut name = Self { words, last, unit, who: Who::Unsaid };
        if name.is(REFERENCE) {
            name.who = Who::Reference;
        }
        name
    }

    /// Whether one of its words is one of these.
    fn is(&self, any: &[&str]) -> bool {
        self.words.iter().any(|word| any.contains(&word.as_str()))
    }

    /// Whether its unit is of this quantity, or not said.
    fn may_be(&self, quantity: Quantity) -> bool {
        self.unit.is_none_or(|unit| unit.quantity == quantity)
    }

    fn means(&self, what: What, rank: u8, sensor: String) -> Meaning {
        Meaning { what, who: self.who, unit: self.unit, sensor, rank }
    }

    /// The name but for its last `parts` words.
    fn sensor(&self, parts: usize) -> String {
        self.words[..self.words.len().saturating_sub(parts)].join("_")
    }

    fn time(&self) -> Option<Meaning> {
        let rank = time_rank(&self.words).filter(|_| self.may_be(Quantity::Time))?;
        // `millis` is a time and its unit.
        let only = || unit::parse(&self.words[0]).filter(|u| self.words.len() == 1 && u.quantity == Quantity::Time);
        Some(Meaning { unit: self.unit.or_else(only), ..self.means(What::Time, rank, String::new()) })
    }

    /// What is computed of a reading, or is none.
    fn is_no_reading(&self) -> bool {
        // EuRoC's estimate of a bias: b_w_RS_S_x.
        let is_bias = self.words[0] == "b" && self.words.len() > 3;
        // A reference of an estimate is one; how sure it is of it is none.
        let is_sure_of = self.who != Who::Reference || self.is(&["bias", "std", "cov", "covariance"]);
        is_bias || self.is(NOT_A_READING) && is_sure_of
    }

    /// Quantity and axis in two letters: which of them.
    fn squeezed(&self) -> Option<usize> {
        ["gx", "gy", "gz", "wx", "wy", "wz", "ax", "ay", "az"].iter().position(|two| *two == self.last)
    }

    fn of_squeezed(&self, place: usize) -> Option<Meaning> {
        let (what, quantity) = if place < 6 {
            (What::Rate(place % 3), Quantity::Rate)
        } else {
            (What::Acceleration(place % 3), Quantity::Acceleration)
        };
        self.may_be(quantity).then(|| self.means(what, 1, self.sensor(1) + &self.last[..1]))
    }

    fn rate(&self) -> Option<Meaning> {
        if !self.may_be(Quantity::Rate) {
            return None;
        }
        let turns = self.is(&["gyr", "gyro", "gyroadc", "gyros", "gyroscope", "omega", "angvel", "angularvelocity"])
            || self.is(&["angular", "ang", "rotation", "rot", "turn"])
                && self.is(&["velocity", "vel", "rate", "rates", "speed"])
            || self.words.windows(2).any(|pair| pair == ["w", "rs"] || pair == ["rate", "gyro"])
            || self.is(&["drehrate", "winkelgeschwindigkeit"])
            // Nothing but a rate of turn has such a unit.
            || self.unit.is_some_and(|unit| unit.quantity == Quantity::Rate);
        if let Some(axis) = axis(&self.last).filter(|_| turns) {
            return Some(self.means(What::Rate(axis), 0, self.sensor(1)));
        }
        // `yaw rate`, `yawspeed`: about the axis of an angle.
        rate_of_angle(&self.words).map(|(axis, sensor)| self.means(What::Rate(axis), 1, sensor))
    }

    fn acceleration(&self) -> Option<Meaning> {
        let pushes = self.is(&["acc", "accel", "accelerometer", "acceleration", "accsmooth", "specific"])
            || self.words.windows(2).any(|pair| pair == ["a", "rs"]);
        let axis = axis(&self.last).filter(|_| pushes && self.may_be(Quantity::Acceleration))?;
        Some(self.means(What::Acceleration(axis), u8::from(self.is(&["linear", "free"])), self.sensor(1)))
    }

    fn quaternion(&self) -> Option<Meaning> {
        let is_one = self.is(&["q", "quat", "quaternion", "orientation", "attitude", "rotation", "rotationvector"])
            || ["qw", "qx", "qy", "qz", "q0", "q1", "q2", "q3"].contains(&self.last.as_str());
        let mut part = part(&self.last).filter(|_| is_one && self.may_be(Quantity::Other))?;
        // Android's rotation vector is numbered x, y, z, w.
        if self.is(&["vector", "rotationvector"]) && self.last.bytes().all(|b| b.is_ascii_digit()) {
            part = (part + 1) % 4;
        }
        Some(self.means(What::Quaternion(part), 0, self.sensor(1)))
    }

    fn angle(&self) -> Option<Meaning> {
        let has_unit = self.unit.is_some_and(|unit| unit.quantity == Quantity::Angle);
        let is_called_one = self.is(&["angle", "position", "winkel"]);
        // What an encoder hands out is an angle, though the name does not say in what.
        let is_encoder = self.unit.is_none() && self.is(ENCODER);
        if !(has_unit || is_encoder || self.who == Who::Reference && is_called_one) {
            return None;
        }
        let about = axis(&self.last).or_else(|| self.words.iter().find_map(|word| axis(word)));
        let unsure = if has_unit || is_called_one { 0 } else { UNSURE };
        let sensor = self.sensor(usize::from(about.is_some()));
        Some(self.means(What::Angle(about), unsure + u8::from(about.is_none()), sensor))
    }

    fn temperature(&self) -> Option<Meaning> {
        let is_one = self.is(&["temp", "temperature", "temps"]) && self.may_be(Quantity::Temperature);
        is_one.then(|| self.means(What::Temperature, u8::from(self.words.len() > 2), String::new()))
    }

    fn supply(&self) -> Option<Meaning> {
        let is_one = self.is(&["vbat", "supply", "vbatlatest", "vcc", "vdd"]) && self.may_be(Quantity::Voltage);
        is_one.then(|| self.means(What::Supply, 0, String::new()))
    }
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
    // What a recorder puts around a message: `field.header.stamp`, `msg.header.stamp.sec`.
    const AROUND: [&str; 5] = ["field", "msg", "message", "data", "payload"];
    let is_around = words.len() > 2 && AROUND.contains(&words[0].as_str());
    let words = &words[usize::from(is_around)..];
    let joined = words.join("_");
    Some(match joined.as_str() {
        "t" => 0,
        // The sensor's own stamp, before that of whoever took its message.
        "header_stamp"
        | "header_timestamp"
        | "header_stamp_secs"
        | "header_stamp_sec"
        | "seconds_elapsed"
        | "elapsed"
        | "elapsed_time"
        | "time_elapsed"
        | "time_startup"
        | "sample_time_fine"
        | "relative_time"
        // Of PX4's estimates, beside the time of their publication.
        | "timestamp_sample"
        | "cts" => 1,
        "time" | "x_value" | "zeit" | "uhrzeit" | "zeitstempel" | "temps" | "tiempo" | "tempo" | "timestamp"
        | "timestamps" | "ts" | "time_stamp" | "sample_time" | "sensor_time" | "stamp"
        | "stamp_secs" | "stamp_sec" => 2,
        "datetime" | "date_time" | "sec" | "secs" | "seconds" | "second" | "minutes" | "hours" | "millis" | "micros" | "ms" | "us" | "ns"
        | "s" => 3,
        "time_boot" | "logging_time" | "unix" | "unix_time" | "epoch" | "epoc" | "epoch_time" | "utc_time" | "system_time"
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
            ("unix_ms", What::Time),
            ("GyroX", What::Rate(0)),
            ("gyroz", What::Rate(2)),
            ("ang_vel_y", What::Rate(1)),
            ("imu.gyro_dps.z", What::Rate(2)),
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
            ("quatReal", What::Quaternion(0)),
            ("quatK", What::Quaternion(3)),
            ("time (us)", What::Time),
            ("Time (min)", What::Time),
            ("time_h", What::Time),
            ("timestamp [ns]", What::Time),
            ("msg.header.stamp.sec", What::Time),
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
            "gyro_x_min",
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
    fn a_unit_before_the_axis_is_one() {
        let unit = |name: &str| understand(name, None).and_then(|meaning| meaning.unit).map(|unit| unit.symbol);
        assert_eq!(unit("imu.gyro_dps.z"), Some("deg/s"));
        assert_eq!((unit("gyro.z"), unit("gyro_rad[2]"), unit("accel_mg_x")), (None, Some("rad/s"), Some("mg")));
    }

    #[test]
    fn channels_of_one_sensor_share_the_rest_of_their_names() {
        let sensor = |name: &str| understand(name, None).unwrap().sensor;
        assert_eq!(sensor("imu1_gyro_x"), sensor("imu1_gyro_y"));
        assert_ne!(sensor("imu1_gyro_x"), sensor("imu2_gyro_x"));
        assert_eq!(understand("mocap_qw", None).unwrap().who, Who::Reference);
    }
}
