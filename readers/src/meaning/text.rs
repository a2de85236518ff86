//! A map for a table of text.

use super::{AXES, Dependent, Meaning, PARTS, Pick, Proposal, What, Who, understand, words::UNSURE};
use crate::{
    text::{self, Head, TimeField},
    unit::{self, Quantity, STANDARD_GRAVITY, Unit},
};

/// What the names of a text say. `taken` tells the names of our logs that it has already: they need no map.
#[must_use]
pub fn of_text(head: &Head, taken: &dyn Fn(&str) -> bool) -> Proposal {
    let meanings: Vec<(usize, Meaning)> = (head.names.iter().zip(&head.units).enumerate())
        .filter_map(|(i, (name, unit))| understand(name, *unit).map(|meaning| (i, meaning)))
        .collect();
    let mut of = Of { head, meanings, taken, found: Proposal::default() };
    of.found.dependent = dependent(&head.names);
    of.time();
    let has_gyro = of.gyro() || AXES.iter().any(|axis| taken(&format!("gyro_{axis}")));
    of.one_sensor("accel", |what| if let What::Acceleration(axis) = what { Some(axis) } else { None });
    of.single("temp", What::Temperature);
    of.single("supply", What::Supply);
    of.orientation(has_gyro);
    of.angles();
    of.letters(has_gyro);
    of.over_three(has_gyro);
    of.found
}

/// What names alone say, of channels whose times are known.
#[must_use]
pub fn of_names(channels: &[(String, Option<Unit>)], taken: &dyn Fn(&str) -> bool) -> Proposal {
    let names: Vec<&[u8]> = channels.iter().map(|(name, _)| name.as_bytes()).collect();
    let mut head = Head::of_names(&names);
    head.units = channels.iter().map(|(_, unit)| *unit).collect();
    of_text(&head, &|name| name == "t" || taken(name))
}

struct Of<'a> {
    head: &'a Head,
    meanings: Vec<(usize, Meaning)>,
    taken: &'a dyn Fn(&str) -> bool,
    found: Proposal,
}

impl Of<'_> {
    fn pick(&self, name: &str, column: usize, unit: Option<Unit>) -> Pick {
        Pick { is_unit_said: unit.is_some(), ..Pick::new(name, &self.head.names[column], unit) }
    }

    fn has(&self, name: &str) -> bool {
        let named = |pick: &Pick| pick.name == name || pick.name.starts_with(&format!("{name}_"));
        (self.taken)(name) || self.found.chosen.iter().any(named)
    }

    fn time(&mut self) {
        // A key above the header says how many seconds one of its numbers is.
        let scale = self.head.key(&["tscale", "timescale"]).and_then(number).filter(|scale| *scale > 0.0);
        if (self.taken)("t") {
            let own = self.head.names.iter().position(|name| name == "t");
            if let (Some(scale), Some(column)) = (scale, own) {
                self.found.chosen.push(Pick { factor: scale, ..self.pick("t", column, None) });
            }
            return;
        }
        let times = self.meanings.iter().filter(|(_, meaning)| meaning.what == What::Time);
        // One that stands still or goes back in the first rows is another sensor's, or none, where there is a better one. A stamp of seconds
        // and a rest is the sensor's own.
        let order = |(column, meaning): &&(usize, Meaning)| {
            let is_whole = self.head.finer(*column).is_none();
            (is_whole && is_stopped(self.head, *column), is_whole, meaning.rank, *column)
        };
        let Some(&(column, ref meaning)) = times.min_by_key(order) else {
            // Whatever its name is: nothing but a time is written so.
            let written = |field: &Vec<u8>| text::form(field).is_some();
            // A row may be longer than its header.
            let named = |row: &Vec<Vec<u8>>| row.iter().take(self.head.names.len()).position(written);
            if let Some(column) = self.head.samples.first().and_then(named) {
                self.found.chosen.push(self.pick("t", column, None));
            } else if let Some((column, rate)) = counter(self.head) {
                self.found.chosen.push(Pick { factor: rate.recip(), ..self.pick("t", column, None) });
            }
            return;
        };
        let unit = meaning.unit.or_else(|| time_unit(self.head, column));
        // The Xsens clock ticks ten thousand times a second, but that of a DOT a million times.
        let ticks =
            self.head.names[column].trim() == "SampleTimeFine" && step(self.head, column).is_none_or(|step| step < 2e3);
        let unit = if ticks { Some(Unit { factor: 100.0, ..unit::MICROSECONDS }) } else { unit };
        let unit = scale.map(|factor| Unit { factor, ..unit::SECONDS }).or(unit);
        self.found.chosen.push(self.pick("t", column, unit));
    }

    /// Whether there is a gyro to choose. A second one is offered as a reference.
    fn gyro(&mut self) -> bool {
        let degrees = self.head.names.iter().any(|name| name.trim() == "loopIteration");
        let unsaid =
            if degrees { Some(unit::DEGREES_PER_SECOND) } else { scale(self.head, "g", unit::RADIANS_PER_SECOND) };
        let rates: Vec<(usize, usize, Meaning)> = (self.meanings.iter())
            .filter_map(|(i, m)| if let What::Rate(axis) = m.what { Some((*i, axis, m.clone())) } else { None })
            .collect();
        let mut sensors: Vec<&str> = Vec::new();
        for (column, axis, meaning) in &rates {
            let own = rates.iter().filter(|(.., other)| other.sensor == meaning.sensor);
            let of_sensor = || one_unit(own.map(|(.., other)| other.unit));
            let unit = meaning.unit.or_else(|| defined(self.head, *column)).or_else(of_sensor).or(unsaid);
            if meaning.who == Who::Reference {
                let name = format!("ref_rate_{}", AXES[*axis]);
                if !self.has(&name) {
                    self.found.chosen.push(self.pick(&name, *column, unit));
                }
                continue;
            }
            if !sensors.contains(&meaning.sensor.as_str()) {
                sensors.push(&meaning.sensor);
            }
            let first = sensors[0] == meaning.sensor;
            let name = format!("{}_{}", if first { "gyro" } else { "ref_rate" }, AXES[*axis]);
            if self.has(&name) {
                continue;
            }
            let pick = self.pick(&name, *column, unit);
            if first { &mut self.found.chosen } else { &mut self.found.offered }.push(pick);
        }
        !sensors.is_empty()
    }

    /// One name, with its unit, over three columns of which the others have none: their order is not said.
    fn over_three(&mut self, has_gyro: bool) {
        if has_gyro {
            return;
        }
        let is_rate = |name: &str| unit::split(name).1.is_some_and(|unit| unit.quantity == Quantity::Rate);
        let nameless = |name: &String, k: usize| {
            let bare = name.trim();
            bare == k.to_string() || bare.is_empty() || bare.starts_with("column_") || bare.starts_with("Unnamed")
        };
        let names = &self.head.names;
        let first = (0..names.len().saturating_sub(2))
            .find(|&i| is_rate(&names[i]) && nameless(&names[i + 1], 1) && nameless(&names[i + 2], 2));
        let Some(first) = first else { return };
        let unit = unit::split(&names[first]).1;
        // A GoPro gives z, x and y.
        let order = if names.iter().any(|name| name.trim() == "cts") { [2, 0, 1] } else { [0, 1, 2] };
        let mut picks: Vec<(usize, Pick)> = (order.into_iter().enumerate())
            .map(|(k, axis)| (axis, self.pick(&format!("gyro_{}", AXES[axis]), first + k, unit)))
            .collect();
        picks.sort_by_key(|(axis, _)| *axis);
        self.found.offered.extend(picks.into_iter().map(|(_, pick)| pick));
    }

    /// Bare letters say nothing surely: p, q, r are rates of turn in flight, x, y, z may be anything.
    fn letters(&mut self, has_gyro: bool) {
        if has_gyro {
            return;
        }
        for letters in [["p", "q", "r"], AXES] {
            let place =
                |letter: &str| self.head.names.iter().position(|name| unit::split(name).0.eq_ignore_ascii_case(letter));
            if let [Some(x), Some(y), Some(z)] = letters.map(place) {
                for (axis, column) in AXES.iter().zip([x, y, z]) {
                    let unit = self.head.units[column].or_else(|| unit::split(&self.head.names[column]).1);
                    let pick = self.pick(&format!("gyro_{axis}"), column, unit);
                    self.found.offered.push(pick);
                }
                return;
            }
        }
    }

    /// The axes of the first sensor that has them.
    fn one_sensor(&mut self, base: &str, axis: impl Fn(What) -> Option<usize>) {
        let of: Vec<(usize, usize, Meaning)> =
            self.meanings.iter().filter_map(|(i, m)| axis(m.what).map(|axis| (*i, axis, m.clone()))).collect();
        let Some(first) = of.iter().min_by_key(|(i, _, m)| (m.rank, *i)).map(|(_, _, m)| m.sensor.clone()) else {
            return;
        };
        let said =
            scale(self.head, "a", unit::METRES_PER_SECOND_SQUARED.times(STANDARD_GRAVITY)).filter(|_| base == "accel");
        let own = || of.iter().filter(|(_, _, meaning)| meaning.sensor == first);
        let said = one_unit(own().map(|(.., meaning)| meaning.unit)).or(said);
        for (column, axis, meaning) in own() {
            let name = format!("{base}_{}", AXES[*axis]);
            if !self.has(&name) {
                self.found.chosen.push(self.pick(&name, *column, meaning.unit.or(said)));
            }
        }
    }

    fn single(&mut self, name: &str, what: What) {
        let of = self.meanings.iter().filter(|(_, meaning)| meaning.what == what);
        if let Some((column, unit)) = of.min_by_key(|(i, m)| (m.rank, *i)).map(|(i, m)| (*i, m.unit))
            && !self.has(name)
        {
            self.found.chosen.push(self.pick(name, column, unit));
        }
    }

    /// A whole orientation: a reference where the name says so, or where the file has no gyro that it might come from.
    fn orientation(&mut self, has_gyro: bool) {
        let parts: Vec<(usize, usize, Meaning)> = (self.meanings.iter())
            .filter_map(|(i, m)| if let What::Quaternion(part) = m.what { Some((*i, part, m.clone())) } else { None })
            .collect();
        let mut sensors: Vec<(&str, Who)> = parts.iter().map(|(_, _, m)| (m.sensor.as_str(), m.who)).collect();
        sensors.dedup();
        let whole = |sensor: &str| {
            let column = |part| parts.iter().find(|(_, p, m)| *p == part && m.sensor == sensor).map(|(i, ..)| *i);
            Some([column(0)?, column(1)?, column(2)?, column(3)?])
        };
        let named = sensors.iter().find(|(s, who)| *who == Who::Reference && whole(s).is_some());
        let Some(&(sensor, who)) = named.or_else(|| sensors.iter().find(|(s, _)| whole(s).is_some())) else { return };
        if self.has("ref_qw") {
            return;
        }
        let picks = whole(sensor)
            .into_iter()
            .flatten()
            .zip(PARTS)
            .map(|(column, part)| self.pick(&format!("ref_q{part}"), column, None));
        let picks: Vec<Pick> = picks.collect();
        let clear = who == Who::Reference || !has_gyro;
        if clear { &mut self.found.chosen } else { &mut self.found.offered }.extend(picks);
    }

    /// Angles: chosen where the name says that they are a reference, and whose.
    fn angles(&mut self) {
        let angles: Vec<(usize, Option<usize>, Meaning)> = (self.meanings.iter())
            .filter_map(|(i, m)| if let What::Angle(axis) = m.what { Some((*i, axis, m.clone())) } else { None })
            .collect();
        let gyros: Vec<usize> = (0..3).filter(|axis| self.has(&format!("gyro_{}", AXES[*axis]))).collect();
        let only = if gyros.len() == 1 { gyros.first().copied() } else { None };
        for (column, axis, meaning) in angles {
            let axis_or_only = axis.or(only);
            let name = format!("ref_angle_{}", AXES[axis_or_only.unwrap_or(2)]);
            if self.has(&name) {
                continue;
            }
            let clear = meaning.who == Who::Reference && meaning.rank < UNSURE && axis_or_only.is_some();
            let pick = self.pick(&name, column, meaning.unit);
            if clear { &mut self.found.chosen } else { &mut self.found.offered }.push(pick);
        }
    }
}

/// The unit that some columns of a sensor say, which is that of the others: `gyro X, gyro Y, gyro Z (deg/s)`; `None` where they say several.
fn one_unit(mut units: impl Iterator<Item = Option<Unit>>) -> Option<Unit> {
    let first = units.by_ref().flatten().next()?;
    units.flatten().all(|unit| unit == first).then_some(first)
}

/// The unit of a field that MAVLink defines, where its numbers are whole: `zgyro` is in mrad/s, `hdg` in hundredths of a degree.
#[must_use]
pub fn defined(head: &Head, column: usize) -> Option<Unit> {
    let bare = |name: &str| unit::split(name).0.rsplit(['.', '/']).next().unwrap_or_default().to_ascii_lowercase();
    let is_message = || {
        let fields = ["time_boot_ms", "time_usec", "xgyro", "ygyro", "zgyro"];
        head.names.iter().any(|name| fields.contains(&bare(name).as_str()))
    };
    let unit = match bare(head.names.get(column)?).as_str() {
        "xgyro" | "ygyro" | "zgyro" => unit::RADIANS_PER_SECOND.times(1e-3),
        "hdg" if is_message() => unit::DEGREES.times(1e-2),
        _ => return None,
    };
    let is_written_whole =
        |row: &Vec<Vec<u8>>| row.get(column).is_some_and(|field| !field.iter().any(|b| b".,".contains(b)));
    let values = numbers(head, column);
    (!values.is_empty() && values.iter().all(|x| x.fract() == 0.0) && head.samples.iter().all(is_written_whole))
        .then_some(unit)
}

/// What a key above the header says one step of a sensor's numbers is: gyroflow's `gscale` in rad/s, `ascale` in g.
fn scale(head: &Head, sensor: &str, unit: Unit) -> Option<Unit> {
    let keys: &[&str] = if sensor == "g" { &["gscale"] } else { &["ascale"] };
    head.key(keys).and_then(number).filter(|scale| *scale > 0.0 && *scale != 1.0).map(|scale| unit.times(scale))
}

/// The number that a value begins with.
fn number(value: &str) -> Option<f64> {
    let end = value.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(value.len());
    value[..end].trim_end_matches(['e', 'E']).parse().ok().filter(|x: &f64| x.is_finite())
}

/// Rows a second, where a key above the header says it.
#[must_use]
pub fn stated_rate(head: &Head) -> Option<f64> {
    const KEYS: [&str; 14] = [
        "datarate",
        "samplerate",
        "samplingrate",
        "outputrate",
        "updaterate",
        "outputdatarate",
        "odr",
        "fs",
        "rate",
        "frequency",
        "samplefrequency",
        "samplingfrequency",
        "gyrorate",
        "imurate",
    ];
    let of_rate = head.key(&KEYS).and_then(|value| {
        let factor = if value.to_ascii_lowercase().contains("khz") { 1e3 } else { 1.0 };
        Some(factor * number(value.trim())?)
    });
    of_rate.or_else(|| Some(stated_step(head)?.recip())).filter(|rate| (1.0..1e5).contains(rate))
}

/// From row to row, s, where a key above the header says it: `Delta_X`, `SampleTime[ms]`.
fn stated_step(head: &Head) -> Option<f64> {
    const KEYS: [&str; 16] = [
        "deltax",
        "deltat",
        "dt",
        "increment",
        "xincrement",
        "xincr",
        "sampleinterval",
        "samplinginterval",
        "sampletime",
        "samplingtime",
        "sampleperiod",
        "samplingperiod",
        "timestep",
        "timeincrement",
        "timeinterval",
        "tinc",
    ];
    let plain = |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
    head.keys.iter().find_map(|(key, value)| {
        let (name, unit) = unit::split(key);
        let end = value.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(value.len());
        let unit = unit.or_else(|| unit::parse(&value[end..])).filter(|unit| unit.quantity == Quantity::Time);
        let seconds = match unit {
            Some(unit) if unit.suffix == "_ms" => 1e-3,
            Some(unit) if unit.suffix == "_us" => 1e-6,
            Some(unit) if unit.suffix == "_ns" => 1e-9,
            _ => 1.0,
        };
        KEYS.contains(&plain(name).as_str())
            .then(|| number(value).map(|step| step * seconds))
            .flatten()
            .filter(|step| *step > 0.0)
    })
}

/// The column that counts rows, and how many of them come a second, as a key above the header says.
fn counter(head: &Head) -> Option<(usize, f64)> {
    let rate = stated_rate(head)?;
    (0..head.names.len()).find(|&column| counts_rows(head, column)).map(|column| (column, rate))
}

/// Whether the first rows are numbered in this column.
#[must_use]
pub fn counts_rows(head: &Head, column: usize) -> bool {
    let values = numbers(head, column);
    values.len() > 1 && values.windows(2).all(|pair| pair[1] - pair[0] == 1.0) && values[0].fract() == 0.0
}

/// The first rows' numbers in a column.
fn numbers(head: &Head, column: usize) -> Vec<f64> {
    let point = head.dialect.point;
    let numbers = head.samples.iter().filter_map(|row| match text::time(row.get(column)?, point, 9) {
        TimeField::Nanoseconds(parts) => Some(parts as f64 / 1e9),
        _ => None,
    });
    numbers.collect()
}

/// Whether a number is the same in all of the first rows, or smaller in a later one.
fn is_stopped(head: &Head, column: usize) -> bool {
    let values = numbers(head, column);
    let goes_back = values.windows(2).any(|pair| pair[1] < pair[0]);
    values.len() > 1 && (goes_back || values.windows(2).all(|pair| pair[0] == pair[1]))
}

/// From row to row, as the first rows show.
fn step(head: &Head, column: usize) -> Option<f64> {
    numbers(head, column).windows(2).map(|pair| pair[1] - pair[0]).find(|step| *step > 0.0)
}

/// The unit of a time that the name does not say: an epoch's by its size, any other by the time from row to row, which lies
/// between 0.1 ms and 0.1 s in every log of a gyro. Of 0.1 s in one unit, which are 0.1 ms in the next finer one, the coarser is meant.
#[must_use]
pub fn time_unit(head: &Head, column: usize) -> Option<Unit> {
    let first = *numbers(head, column).first()?;
    let step = step(head, column);
    // A counter that is as large as an epoch in a coarser unit takes steps that no log of a gyro has.
    let of_seconds = if first < FIRST_GYROS { COARSEST } else { 100.0 };
    let longest = |unit: &Unit| if *unit == unit::SECONDS { of_seconds } else { 1e5 };
    let likely = |unit: &Unit| step.is_none_or(|step| step < longest(unit));
    if let Some(unit) = epoch_unit(first).filter(likely) {
        return Some(unit);
    }
    let step = step?;
    // Days since 1900, as a sheet counts them, or since the year 0, as MATLAB does.
    if step < 1e-5 && ((3e4..8e4).contains(&first) || (6.9e5..8e5).contains(&first)) {
        return Some(unit::DAYS);
    }
    Some(match step {
        ..LONGEST => unit::SECONDS,
        ..1e3 if step < 1e3 * LONGEST => unit::MILLISECONDS,
        ..1e5 => unit::MICROSECONDS,
        _ => unit::NANOSECONDS,
    })
}

/// From row to row at 10 Hz, some scatter included, s: 8 kHz, of which a microsecond's counter makes 125, stays far from it.
const LONGEST: f64 = 0.11;

/// Steps of an epoch's time in whole seconds before [`FIRST_GYROS`], s. A counter of milliseconds that has run for days is as large, and
/// takes larger ones.
const COARSEST: f64 = 2.0;

/// The end of 2004, s since 1970: no such gyro was recorded before.
const FIRST_GYROS: f64 = 1.1e9;

/// The unit of a time since 1970, by its size, where it is later than 1973.
#[must_use]
pub fn epoch_unit(time: f64) -> Option<Unit> {
    match time {
        1e17..1e19 => Some(unit::NANOSECONDS),
        1e14..1e17 => Some(unit::MICROSECONDS),
        1e11..1e14 => Some(unit::MILLISECONDS),
        1e8..1e11 => Some(unit::SECONDS),
        _ => None,
    }
}

/// Orientations that the tool which wrote these names computes from the gyro beside them.
fn dependent(names: &[String]) -> Vec<Dependent> {
    let has = |name: &str| names.iter().any(|n| unit::split(n).0.eq_ignore_ascii_case(name));
    let by = |prefix: &str, by| vec![Dependent { channel: prefix.to_owned(), by }];
    if has("PacketCounter") && has("Quat_q0") {
        return by("Quat_q", "the filter of the Xsens sensor");
    }
    if names.iter().any(|name| name.starts_with("b_w_RS")) {
        return by("q_RS", "an estimator that used this gyro (it also logs a bias)");
    }
    if has("seconds_elapsed") && has("qw") && has("roll") && has("yaw") {
        return by("q", "the phone's own filter");
    }
    if has("Quaternion W") && has("Gyroscope X") {
        return by("Quaternion", "the sensor's own filter");
    }
    if has("Quat W") || has("QuatW") || has("Quat.w") {
        return by("Quat", "the sensor's own filter");
    }
    names.iter().filter_map(|name| Some(Dependent { channel: name.clone(), by: filter(name)? })).collect()
}

/// The filter that a name says, as the usual libraries beside such a gyro call what they make of it. A pose of cameras may have gone through
/// a Kalman filter too: that word counts alone, or before an angle.
fn filter(name: &str) -> Option<&'static str> {
    let name: String = unit::split(name).0.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let is_angle_of = |filter: &str| ["ang", "roll", "pitch"].iter().any(|of| name.contains(&format!("{filter}{of}")));
    match name.as_str() {
        _ if name == "kalman" || is_angle_of("kal") || is_angle_of("kalman") => Some("a Kalman filter, by its name,"),
        _ if name == "complementary"
            || name.contains("complementaryfilter")
            || is_angle_of("comp")
            || is_angle_of("complementary") =>
        {
            Some("a complementary filter, by its name,")
        }
        _ if name.contains("madgwick") || name.contains("mahony") => Some("a filter, by its name,"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::filter;

    #[test]
    fn an_angle_named_after_a_filter_of_inertial_sensors_is_known_and_a_pose_of_cameras_is_not() {
        for own in [
            "kalAngleX",
            "kalAngY",
            "Kalman (deg)",
            "kalman_pitch",
            "KalmanAngleY",
            "compAngleX",
            "complementary filter",
            "madgwick.roll",
            "q_mahony",
        ] {
            assert!(filter(own).is_some(), "{own}");
        }
        for other in
            ["pose_kalman.q", "kalman_position", "compass_angle", "company_x", "components", "angle", "total_angle"]
        {
            assert!(filter(other).is_none(), "{other}");
        }
    }
}
