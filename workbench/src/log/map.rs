//! `--map NAME=CHANNEL`: channels under the names of the log format, chosen on the command line.

use super::error::Problem;
use log_readers::meaning::{AXES, PARTS, Pick};

/// What stands before a name that is meant for the second file.
const SECOND: &str = "ref:";

/// The row's number as a time's channel, from 0: `t=0.01*row`.
pub const ROW_NUMBER: &str = "row";

/// The channel of which a time is the sum, row by row: `t_us=sum(dt_us)`.
pub fn summed(channel: &str) -> Option<&str> {
    channel.strip_prefix("sum(")?.strip_suffix(')').map(str::trim)
}

/// The two channels of which one is the difference: `ref_angle_z=0.001*diff(right,left)`.
pub fn difference(channel: &str) -> Option<(&str, &str)> {
    let (first, second) = channel.strip_prefix("diff(")?.strip_suffix(')')?.split_once(',')?;
    Some((first.trim(), second.trim()))
}

/// What one `--map` says: a name, and what is written for the channel.
#[derive(Clone, Debug, PartialEq)]
pub struct MapFlag {
    /// The flag's value as it was given.
    pub text: String,
    name: String,
    channel: String,
    /// Whether it is meant for the second file: `ref:NAME=CHANNEL`.
    second: bool,
}

impl MapFlag {
    /// Reads `NAME=CHANNEL`.
    ///
    /// # Errors
    /// No `=`, or nothing on one side of it.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let (name, channel) = text.split_once('=').ok_or_else(|| Problem::MapFlag(text.to_owned()))?;
        let (name, channel) = (name.trim(), channel.trim());
        let (name, second) = name.strip_prefix(SECOND).map_or((name, false), |name| (name.trim(), true));
        if name.is_empty() || channel.is_empty() {
            return Err(Problem::MapFlag(text.to_owned()));
        }
        Ok(Self { text: text.to_owned(), name: name.to_owned(), channel: channel.to_owned(), second })
    }

    /// Whether it says outright that it is meant for the second file.
    pub fn is_of_second(&self) -> bool {
        self.second
    }

    /// Whether it is about the reference, which a second file has where there is one.
    pub fn is_of_reference(&self) -> bool {
        self.second || self.name.starts_with("ref_")
    }

    /// The name that it gives.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it names all parts of an orientation at once.
    pub fn is_of_orientation(&self) -> bool {
        ["ref_q", "ref_r"].contains(&self.name.as_str()) || self.name.starts_with("ref_rpy")
    }

    /// Whether it names the time.
    pub fn is_of_time(&self) -> bool {
        self.name == "t" || self.name.starts_with("t_")
    }

    /// Whether the channel is meant by its name, not by its number.
    pub fn is_named(&self) -> bool {
        self.channel
            .trim_end_matches(')')
            .split([',', '('])
            .flat_map(readings)
            .all(|(_, channel, _)| channel.parse::<usize>().is_err())
    }

    /// The channels meant, of those that there are. `ref_q` stands for the four parts of an orientation, `ref_rpy` for its roll, pitch
    /// and yaw, `ref_r` for its rotation matrix.
    ///
    /// # Errors
    /// There is no such channel.
    pub fn picks(&self, channels: &[String]) -> Result<Vec<Pick>, Problem> {
        let unknown =
            |likely: Vec<String>| Problem::NoChannel { flag: self.text.clone(), likely, channels: channels.to_vec() };
        if self.name == "ref_q" {
            let parts = parts_of(&self.channel, channels).ok_or_else(|| unknown(likely(&self.channel, channels)))?;
            let name = |part: &str| format!("ref_q{part}");
            return Ok(PARTS.iter().zip(parts).map(|(part, channel)| Pick::new(&name(part), &channel, None)).collect());
        }
        if self.name == "ref_r" {
            let parts = matrix_of(&self.channel, channels);
            let picks = parts.iter().enumerate().map(|(i, part)| {
                let name = format!("ref_r{}{}", i / 3, i % 3);
                Self { name, channel: part.clone(), ..self.clone() }.picks(channels)
            });
            let picks = picks.collect::<Result<Vec<_>, _>>()?.concat();
            return if parts.len() == 9 { Ok(picks) } else { Err(Problem::MapOfMatrix(self.text.clone())) };
        }
        if let Some(suffix) = self.name.strip_prefix("ref_rpy").filter(|suffix| ["", "_deg"].contains(suffix)) {
            let parts: Vec<&str> = self.channel.split(',').collect();
            let picks = parts.iter().zip(AXES).map(|(part, axis)| {
                let one =
                    Self { name: format!("ref_rpy_{axis}{suffix}"), channel: part.trim().to_owned(), ..self.clone() };
                one.picks(channels)
            });
            let picks = picks.collect::<Result<Vec<_>, _>>()?.concat();
            return if parts.len() == 3 { Ok(picks) } else { Err(Problem::MapOfAngles(self.text.clone())) };
        }
        for (factor, channel, offset) in readings(&self.channel) {
            let made = || self.made_time(&channel, channels).or_else(|| made_difference(&channel, channels));
            if let Some(found) = resolve(&channel, channels).or_else(made) {
                return Ok(vec![Pick { name: self.name.clone(), channel: found, factor, offset, is_unit_said: true }]);
            }
        }
        Err(unknown(likely(&self.channel, channels)))
    }

    /// A time that no channel holds as such.
    fn made_time(&self, channel: &str, channels: &[String]) -> Option<String> {
        if !self.is_of_time() {
            return None;
        }
        let sum = || Some(format!("sum({})", resolve(summed(channel)?, channels)?));
        if channel == ROW_NUMBER { Some(ROW_NUMBER.to_owned()) } else { sum() }
    }
}

/// The difference of two channels that there are.
fn made_difference(channel: &str, channels: &[String]) -> Option<String> {
    let (first, second) = difference(channel)?;
    Some(format!("diff({},{})", resolve(first, channels)?, resolve(second, channels)?))
}

/// What a channel with its factor and offset, `[a*]CHANNEL[/b][+c]` with a sign, may be meant as, the plainest first: a name may hold
/// any sign.
fn readings(text: &str) -> Vec<(f64, String, f64)> {
    let mut found = vec![(1.0, text.to_owned(), 0.0)];
    let mut with_offset = vec![(text, 0.0)];
    for (at, sign) in text.char_indices().filter(|(_, c)| matches!(c, '+' | '-')) {
        if let Some(offset) = number(&text[at + 1..]) {
            with_offset.push((text[..at].trim(), if sign == '-' { -offset } else { offset }));
        }
    }
    // `2+gz`, too.
    for (at, sign) in text.char_indices().filter(|(_, c)| matches!(c, '+' | '-')).filter(|(at, _)| *at > 0) {
        if let (Some(offset), rest) = (number(&text[..at]), text[at + 1..].trim()) {
            found.extend(
                scaled(rest)
                    .into_iter()
                    .map(|(factor, channel)| (if sign == '-' { -factor } else { factor }, channel.to_owned(), offset)),
            );
        }
    }
    for (rest, offset) in with_offset {
        found.extend(scaled(rest).into_iter().map(|(factor, channel)| (factor, channel.to_owned(), offset)));
    }
    found
}

/// What a channel with a factor, or over a divisor, may be meant as.
fn scaled(text: &str) -> Vec<(f64, &str)> {
    let mut found = vec![(1.0, text)];
    for (at, sign) in text.char_indices().filter(|(_, c)| matches!(c, '*' | '/')) {
        let (left, right) = (text[..at].trim(), text[at + 1..].trim());
        // `0.1*gx`, `1/131*gx`; and `3*0.1`: the third column times 0.1.
        if let (Some(factor), '*') = (number(left), sign) {
            found.extend(scaled(right).into_iter().map(|(inner, channel)| (factor * inner, channel)));
        }
        if let Some(factor) = number(right).filter(|x| sign == '*' || *x != 0.0) {
            let factor = if sign == '*' { factor } else { factor.recip() };
            found.extend(scaled(left).into_iter().map(|(inner, channel)| (factor * inner, channel)));
        }
    }
    if let Some(channel) = text.strip_prefix('-') {
        found.extend(scaled(channel.trim()).into_iter().map(|(factor, channel)| (-factor, channel)));
    }
    found
}

/// A number, or a fraction: `0.1`, `1/131`.
fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let finite = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    match text.split_once('/') {
        Some((above, below)) => Some(finite(above)? / finite(below).filter(|x| *x != 0.0)?),
        None => finite(text),
    }
}

/// A channel by its name, whatever the case of its letters where only one fits, or by its number.
fn resolve(text: &str, channels: &[String]) -> Option<String> {
    if channels.iter().any(|channel| channel == text) {
        return Some(text.to_owned());
    }
    let mut alike = channels.iter().filter(|channel| channel.eq_ignore_ascii_case(text));
    if let (Some(one), None) = (alike.next(), alike.next()) {
        return Some(one.clone());
    }
    let number: usize = text.parse().ok()?;
    channels.get(number.checked_sub(1)?).cloned()
}

/// The four parts of an orientation that begin with this name.
fn parts_of(prefix: &str, channels: &[String]) -> Option<[String; 4]> {
    let numbered = ["[0]", "[1]", "[2]", "[3]"];
    let endings: [[String; 4]; 6] = [
        PARTS.map(|part| format!(".{part}")),
        PARTS.map(str::to_owned),
        PARTS.map(|part| format!("_{part}")),
        PARTS.map(|part| format!(" {part}")),
        numbered.map(str::to_owned),
        ["0", "1", "2", "3"].map(str::to_owned),
    ];
    endings.iter().find_map(|endings| {
        let named = |ending: &String| {
            let name = format!("{prefix}{ending}");
            let alike = |channel: &&String| channel.eq_ignore_ascii_case(&name);
            channels.iter().find(|channel| **channel == name).or_else(|| channels.iter().find(alike)).cloned()
        };
        let found: Vec<String> = endings.iter().map_while(named).collect();
        found.try_into().ok()
    })
}

/// The nine numbers of a rotation matrix, row by row: those that are listed, or those that begin with this name.
fn matrix_of(text: &str, channels: &[String]) -> Vec<String> {
    let digits = |first: usize| (0..9).map(move |i| format!("{}{}", first + i / 3, first + i % 3));
    let counted = |begin: &str, end: &str| (0..9).map(|i| format!("{begin}{i}{end}")).collect::<Vec<_>>();
    let endings: [Vec<String>; 6] = [
        digits(0).collect(),
        digits(1).collect(),
        counted("", ""),
        counted("_", ""),
        counted("[", "]"),
        counted(".", ""),
    ];
    let whole = endings.iter().find_map(|endings| {
        let names: Vec<String> = endings.iter().map(|ending| format!("{text}{ending}")).collect();
        names.iter().all(|name| channels.contains(name)).then_some(names)
    });
    whole.unwrap_or_else(|| text.split(',').map(|part| part.trim().to_owned()).collect())
}

/// Channels that may have been meant.
fn likely(text: &str, channels: &[String]) -> Vec<String> {
    let lower = text.to_lowercase();
    let mut near: Vec<(usize, &String)> = (channels.iter())
        .map(|channel| (strsim::levenshtein(&lower, &channel.to_lowercase()), channel))
        .filter(|(distance, channel)| *distance <= 1 + text.len() / 4 || channel.to_lowercase().contains(&lower))
        .collect();
    near.sort_by_key(|(distance, _)| *distance);
    near.into_iter().take(3).map(|(_, channel)| channel.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(text: &str, channels: &[&str]) -> Pick {
        let channels: Vec<String> = channels.iter().map(|&c| c.to_owned()).collect();
        MapFlag::parse(text).unwrap().picks(&channels).unwrap().remove(0)
    }

    #[test]
    fn a_factor_and_an_offset_stand_on_either_side() {
        let pick = |factor, channel: &str, offset| Pick {
            name: "gyro_z".into(),
            channel: channel.into(),
            factor,
            offset,
            is_unit_said: true,
        };
        for (text, wanted) in [
            ("gyro_z=gz", pick(1.0, "gz", 0.0)),
            ("gyro_z=0.1*gz+2", pick(0.1, "gz", 2.0)),
            ("gyro_z = gz*0.1 - 2", pick(0.1, "gz", -2.0)),
            ("gyro_z=-gz", pick(-1.0, "gz", 0.0)),
            ("gyro_z=gz/4", pick(0.25, "gz", 0.0)),
            ("gyro_z=1/4*gz", pick(0.25, "gz", 0.0)),
            ("gyro_z=-gz/4+2", pick(-0.25, "gz", 2.0)),
            ("gyro_z=-0.5*gz/2-1", pick(-0.25, "gz", -1.0)),
            ("gyro_z=2-gz", pick(-1.0, "gz", 2.0)),
            ("gyro_z = gz * 3 / 4", pick(0.75, "gz", 0.0)),
            ("gyro_z=m/s", pick(1.0, "m/s", 0.0)),
            ("gyro_z=m/s/4", pick(0.25, "m/s", 0.0)),
            ("gyro_z=3*0.1", pick(0.1, "a+1", 0.0)),
            ("gyro_z=a+1", pick(1.0, "a+1", 0.0)),
            ("gyro_z=2", pick(1.0, "t", 0.0)),
            ("gyro_z=GZ", pick(1.0, "gz", 0.0)),
        ] {
            assert_eq!(one(text, &["gz", "t", "a+1", "m/s"]), wanted, "{text}");
        }
    }

    #[test]
    fn an_orientation_is_four_channels() {
        let channels = [
            "p.w",
            "p.x",
            "p.y",
            "p.z",
            "q[0]",
            "q[1]",
            "q[2]",
            "q[3]",
            "b Rotation X",
            "b Rotation Y",
            "b Rotation Z",
            "b Rotation W",
        ];
        let channels = channels.map(str::to_owned);
        for (text, last) in [("ref_q=p", "p.z"), ("ref_q=q", "q[3]"), ("ref_q=b Rotation", "b Rotation Z")] {
            let picks = MapFlag::parse(text).unwrap().picks(&channels).unwrap();
            assert_eq!((picks.len(), picks[0].name.as_str(), picks[3].channel.as_str()), (4, "ref_qw", last));
        }
        assert!(MapFlag::parse("ref_q=r").unwrap().picks(&channels).is_err());
    }

    #[test]
    fn an_orientation_is_three_angles_too() {
        let channels = ["roll", "pitch", "yaw"].map(str::to_owned);
        let picks = MapFlag::parse("ref_rpy_deg=roll, -pitch, yaw").unwrap().picks(&channels).unwrap();
        let shown: Vec<String> = picks.iter().map(ToString::to_string).collect();
        assert_eq!(shown, ["ref_rpy_x_deg=roll", "ref_rpy_y_deg=-pitch", "ref_rpy_z_deg=yaw"]);
        let refused = |text: &str| MapFlag::parse(text).unwrap().picks(&channels).is_err();
        assert!(refused("ref_rpy=roll,pitch") && refused("ref_rpy=roll,pitch,heading"));
    }

    #[test]
    fn an_orientation_is_nine_numbers_too() {
        for (text, names, last) in [
            ("ref_r=r", ["r00", "r01", "r02", "r10", "r11", "r12", "r20", "r21", "r22"], "r22"),
            ("ref_r=m", ["m11", "m12", "m13", "m21", "m22", "m23", "m31", "m32", "m33"], "m33"),
            ("ref_r=R", ["R_0", "R_1", "R_2", "R_3", "R_4", "R_5", "R_6", "R_7", "R_8"], "R_8"),
            ("ref_r=a,b,c,d,e,f,g,h,i", ["a", "b", "c", "d", "e", "f", "g", "h", "i"], "i"),
        ] {
            let channels = names.map(str::to_owned);
            let picks = MapFlag::parse(text).unwrap().picks(&channels).unwrap();
            assert_eq!((picks.len(), picks[8].name.as_str(), picks[8].channel.as_str()), (9, "ref_r22", last));
            assert!(MapFlag::parse("ref_r=x").unwrap().picks(&channels).is_err());
        }
        let channels = ["a", "b"].map(str::to_owned);
        assert!(matches!(MapFlag::parse("ref_r=a,b").unwrap().picks(&channels), Err(Problem::MapOfMatrix(_))));
    }

    #[test]
    fn a_time_is_made_of_the_rows_or_of_steps() {
        let headers = ["dt_us", "gz"];
        assert_eq!(one("t=0.01*row", &headers).channel, "row");
        assert_eq!(one("t_us=sum(dt_us)", &headers).channel, "sum(dt_us)");
        assert_eq!(one("ref_angle_z=0.1*diff(GZ, 1)", &headers).channel, "diff(gz,dt_us)");
        let channels = headers.map(str::to_owned);
        let refused = |text: &str| MapFlag::parse(text).unwrap().picks(&channels).is_err();
        assert!(refused("gyro_z=row") && refused("t=sum(dt)") && refused("ref_angle_z=diff(gz,left)"));
    }

    #[test]
    fn a_channel_that_is_not_there_is_refused_with_those_that_may_be_meant() {
        let channels = ["gyro_x".to_owned(), "gyro_y".to_owned()];
        let error = MapFlag::parse("gyro_z=gyr_x").unwrap().picks(&channels).unwrap_err().to_string();
        assert!(error.contains("gyro_x"), "{error}");
        assert!(MapFlag::parse("gyro_z").is_err() && MapFlag::parse("=x").is_err());
        let second = |text: &str| MapFlag::parse(text).unwrap().is_of_second();
        assert!(second("ref:t_ns=time") && !second("t_ns=time"));
    }
}
