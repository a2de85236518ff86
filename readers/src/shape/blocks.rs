//! Blocks of lines that make one reading, as the examples of many drivers print them, as the CSV that they mean.
//!
//! ```text
//! Time: 10 ms                                        Time [ms],Rotation X [rad/s],Rotation Y [rad/s],Rotation Z [rad/s],Angle
//! Rotation X: 0.1, Y: 0.2, Z: 0.3 rad/s        →     10,0.1,0.2,0.3,3.5
//! Angle: 3.5
//! ```
//!
//! Lines are told apart by what stands between their numbers; each of a block's has names of its own. A line that ends in a colon names
//! what follows it. What is no line of a block is given as it is.

use super::{Shape, number_end, write_row};
use crate::{
    text::{is_row, stamp},
    unit::{self, Unit},
};
use std::collections::HashMap;

/// Lines that are looked at for blocks, and how often each line of one has to be there.
const LOOKED_AT: usize = 400;
const OFTEN: usize = 4;
/// Lines of numbers that have to be of blocks, and those of them that may follow one of their own kind.
const SHARE: f64 = 0.8;
const IN_A_ROW: f64 = 0.1;
/// Lines of a block, numbers in it, and bytes of a line at most.
const MOST_LINES: usize = 24;
const MOST_NUMBERS: usize = 64;
const LONGEST: usize = 400;

/// Blocks as lines of a CSV.
pub struct Blocks {
    /// Where the numbers of a kind of line stand in a row.
    kinds: HashMap<String, (usize, usize)>,
    /// The names of a row's fields.
    names: Vec<String>,
    /// The row that is being filled, and which kind of line came last.
    row: Vec<Vec<u8>>,
    filled: Option<usize>,
    is_stamped: bool,
    heading: String,
    headed: bool,
}

/// What is written in a line: its kind, and its numbers with the names before and the units behind them.
struct Cut<'a> {
    kind: String,
    numbers: Vec<&'a str>,
    names: Vec<String>,
}

impl Blocks {
    /// What lines like these are; `None` where they are no blocks.
    #[must_use]
    pub fn of<'a>(lines: impl Iterator<Item = &'a [u8]>) -> Option<Self> {
        let lines: Vec<&str> = lines.take(LOOKED_AT).filter_map(|line| std::str::from_utf8(line).ok()).collect();
        let numbered = || lines.iter().filter(|line| cut(line, "").is_some());
        // Boot text has none.
        let stamps = numbered().filter(|line| stamped(line).is_some()).count();
        let is_stamped = stamps > 0 && stamps as f64 > SHARE * numbered().count() as f64;
        let in_ms = lines.iter().find_map(|line| stamped(line)).is_some_and(|(_, in_ms, _)| in_ms);
        let mut heading = String::new();
        let mut cuts: Vec<Cut> = Vec::new();
        for line in &lines {
            let line = if is_stamped { stamped(line).map_or(*line, |(.., rest)| rest) } else { line };
            match heading_of(line) {
                Some(named) => named.clone_into(&mut heading),
                None => cuts.extend(cut(line, &heading)),
            }
        }
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for cut in &cuts {
            *counts.entry(&cut.kind).or_default() += 1;
        }
        let most = counts.values().copied().max()?;
        let often = |kind: &str| counts.get(kind).is_some_and(|count| *count >= OFTEN && 3 * count >= most);
        let of_blocks: Vec<&Cut> = cuts.iter().filter(|cut| often(&cut.kind)).collect();
        let mut kinds: HashMap<String, (usize, usize)> = HashMap::new();
        let time = if in_ms { "time [ms]" } else { "time" };
        let mut names: Vec<String> = if is_stamped { vec![time.to_owned()] } else { Vec::new() };
        // The order of a whole block: from the second on, for the first may have lost its beginning.
        let first = &of_blocks.first()?.kind;
        let begin = of_blocks.iter().skip(1).position(|cut| cut.kind == *first).map_or(0, |at| at + 1);
        for cut in of_blocks.iter().skip(begin) {
            if kinds.contains_key(&cut.kind) {
                continue;
            }
            // Rows of a table have the same names in each.
            if cut.names.iter().any(|name| name.is_empty() || names.contains(name)) {
                return None;
            }
            kinds.insert(cut.kind.clone(), (names.len(), names.len() + cut.names.len()));
            names.extend(cut.names.iter().cloned());
        }
        let in_a_row = of_blocks.windows(2).filter(|pair| pair[0].kind == pair[1].kind).count();
        let is_block = kinds.len() > 1 && (in_a_row as f64) < IN_A_ROW * of_blocks.len() as f64;
        // Sentences, a row each: where a table does not see the names.
        let rows = || lines.iter().filter(|line| is_row(line.as_bytes())).count();
        let is_sentence = kinds.len() == 1 && names.len() > 1 && (rows() as f64) < (1.0 - SHARE) * lines.len() as f64;
        let is_one = kinds.len() <= MOST_LINES
            && names.len() <= MOST_NUMBERS
            && of_blocks.len() as f64 > SHARE * cuts.len() as f64
            && (is_block || is_sentence);
        let row = vec![Vec::new(); names.len()];
        is_one.then_some(Self { kinds, names, row, filled: None, heading: String::new(), headed: false, is_stamped })
    }
}

impl Shape for Blocks {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let text = String::from_utf8_lossy(line);
        let (time, rest) = match stamped(&text).filter(|_| self.is_stamped) {
            Some((time, _, rest)) => (Some(time), rest),
            None => (None, &*text),
        };
        if let Some(named) = heading_of(rest) {
            named.clone_into(&mut self.heading);
            return;
        }
        let Some(cut) = cut(rest, &self.heading) else {
            // Rulers and blank lines stand between blocks.
            if rest.chars().any(char::is_alphanumeric) {
                self.other(line, out);
            }
            return;
        };
        let Some(&(from, to)) = self.kinds.get(&cut.kind) else { return self.other(line, out) };
        if self.filled.is_some_and(|last| from <= last) {
            self.end(out);
        }
        if let Some(time) = time.filter(|_| self.filled.is_none()) {
            self.row[0] = time.as_bytes().to_vec();
        }
        for (field, number) in self.row[from..to].iter_mut().zip(cut.numbers) {
            *field = number.as_bytes().to_vec();
        }
        self.filled = Some(from);
        if to == self.names.len() {
            self.end(out);
        }
    }

    /// Gives the row that is being filled.
    fn end(&mut self, out: &mut Vec<u8>) {
        if self.filled.take().is_none() {
            return;
        }
        if !std::mem::replace(&mut self.headed, true) {
            write_row(out, &self.names);
        }
        for (k, field) in self.row.iter_mut().enumerate() {
            if k > 0 {
                out.push(b',');
            }
            out.append(field);
        }
        out.push(b'\n');
    }
}

impl Blocks {
    /// What is no line of a block.
    fn other(&mut self, line: &[u8], out: &mut Vec<u8>) {
        self.end(out);
        out.extend_from_slice(line.trim_ascii_end());
        out.push(b'\n');
    }
}

/// The stamp of a line, whether it counts milliseconds, and the line.
fn stamped(line: &str) -> Option<(&str, bool, &str)> {
    let found = stamp(line.as_bytes())?;
    Some((line.get(found.time)?, found.in_ms, line.get(found.end..)?))
}

/// What a line without numbers names that follows it: `Gyroscope:`.
fn heading_of(line: &str) -> Option<&str> {
    let name = line.trim().strip_suffix(':')?.trim();
    let is_plain = !name.is_empty() && !name.contains([',', ';', '=', ':']) && numbers(name).is_empty();
    is_plain.then_some(name)
}

/// The places of the numbers in a line: digits within a word are none.
fn numbers(line: &str) -> Vec<(usize, usize)> {
    let bytes = line.as_bytes();
    let (mut found, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let before = at.checked_sub(1).map(|k| bytes[k]);
        let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b >= 0x80;
        let begins = !before.is_some_and(|b| is_word(b) || matches!(b, b'.' | b'^'));
        let end = if begins { number_end(&line[at..]) } else { None };
        match end.map(|length| at + length) {
            Some(end) if !bytes.get(end).is_some_and(|&b| is_word(b) || b == b'.') => {
                found.push((at, end));
                at = end;
            }
            _ => at += 1,
        }
        while !line.is_char_boundary(at) {
            at += 1;
        }
    }
    found
}

/// Cuts a line at its numbers; `None` where it has none.
fn cut<'a>(line: &'a str, heading: &str) -> Option<Cut<'a>> {
    let line = line.trim();
    let places = if line.len() > LONGEST { Vec::new() } else { numbers(line) };
    if places.is_empty() {
        return None;
    }
    let mut kind = format!("{heading}\n");
    let (mut labels, mut units): (Vec<String>, Vec<Option<Unit>>) = (Vec::new(), Vec::new());
    let mut from = 0;
    for &(begin, end) in &places {
        let between = &line[from..begin];
        kind.extend(between.split_whitespace().chain(["#"]));
        let (unit, label) = unit_and_label(between, labels.is_empty());
        if let Some(last) = units.last_mut() {
            *last = last.or(unit);
        }
        labels.push(label);
        units.push(None);
        from = end;
    }
    kind.extend(line[from..].split_whitespace());
    let (unit, _) = unit_and_label(&line[from..], false);
    if let Some(last) = units.last_mut() {
        *last = last.or(unit);
    }
    let names = named(heading, &labels, &units);
    Some(Cut { kind, numbers: places.iter().map(|&(begin, end)| &line[begin..end]).collect(), names })
}

const SEPARATORS: [char; 7] = [':', '=', ',', ';', '|', '\t', '/'];

/// The unit of the number before a text, and the name of the one behind it.
fn unit_and_label(between: &str, is_first: bool) -> (Option<Unit>, String) {
    let trim = |text: &str| text.trim_matches(|c: char| c.is_whitespace() || SEPARATORS.contains(&c)).to_owned();
    let text = trim(between);
    if is_first || text.is_empty() {
        return (None, text);
    }
    let bare = text.trim_start_matches(['[', '(']);
    let end_from =
        |from: usize| from + bare[from..].find([' ', ',', ';', '|', '\t', ']', ')']).unwrap_or(bare.len() - from);
    let first = end_from(0);
    // `deg C`
    let second = bare[first..].starts_with(' ').then(|| end_from(first + 1));
    let unit = second.into_iter().chain([first]).find_map(|end| {
        // A letter before a colon is a name: `V: 3` is no volt.
        let is_name = bare[end..].trim().is_empty() && between.trim_end().ends_with([':', '=']);
        unit::parse(&bare[..end]).filter(|_| !is_name).map(|unit| (unit, end))
    });
    match unit {
        Some((unit, end)) => (Some(unit), trim(bare[end..].trim_start_matches([']', ')']))),
        None => (None, text),
    }
}

/// The letters of axes, as a label has them.
fn is_axis(label: &str) -> bool {
    matches!(label, "x" | "y" | "z" | "w" | "X" | "Y" | "Z" | "W")
}

/// Where the names of one sensor after the other begin, `Accel X, Y, Z, Gyro X, Y, Z, t`: bare letters belong to the name before them.
fn sensors(labels: &[String]) -> Vec<usize> {
    let is_first_axis = |k: usize| labels[k].rsplit_once(BEFORE_LETTER).is_some_and(|(_, letter)| is_axis(letter));
    let is_bare = |k: usize| labels.get(k).is_some_and(|label| is_axis(label));
    let mut begins = vec![0];
    let mut is_within = is_first_axis(0);
    for k in 1..labels.len() {
        if is_within && is_bare(k) {
            continue;
        }
        let ends = is_within && is_bare(k - 1);
        is_within = is_first_axis(k);
        if ends || is_within && is_bare(k + 1) {
            begins.push(k);
        }
    }
    begins
}

/// What stands between a sensor's name and the letter of its first axis.
const BEFORE_LETTER: [char; 4] = [' ', '.', '_', '\t'];

/// The names of a line's numbers: `Gyro X`, `Y`, `Z` are those of one sensor, and so are three without a name of their own.
fn named(heading: &str, labels: &[String], units: &[Option<Unit>]) -> Vec<String> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let is_letter = |label: &str| label.chars().count() == 1 || label.is_empty();
    let first = labels.first().map_or("", String::as_str);
    let (bare, in_brackets) = unit::split(first);
    let nameless = labels.len() > 1 && labels[1..].iter().all(String::is_empty);
    if nameless && bare.is_empty() && heading.is_empty() {
        // Numbers alone: a table.
        return vec![String::new(); labels.len()];
    }
    // `gyro: 1 2 3 rad/s; encoder 4 rad`: each name is that of the numbers up to the next.
    let begins = if !nameless && labels.iter().skip(1).any(String::is_empty) {
        (0..labels.len()).filter(|&k| k == 0 || !labels[k].is_empty()).collect()
    } else {
        sensors(labels)
    };
    if begins.len() > 1 {
        let ends = begins.iter().skip(1).copied().chain([labels.len()]);
        let parts =
            begins.iter().zip(ends).map(|(&begin, end)| named(heading, &labels[begin..end], &units[begin..end]));
        return parts.flatten().collect();
    }
    // What stands before the letter of the first axis stands for all.
    let stem = match bare.rsplit_once(BEFORE_LETTER) {
        _ if nameless => bare,
        Some((stem, letter)) if is_letter(letter) => stem,
        _ => "",
    };
    // `Orient:\tx`
    let is_tabbed = stem.len() < bare.len() && bare[stem.len()..].starts_with('\t');
    let stem = if is_tabbed { stem.trim_end_matches([':', ' ']) } else { stem };
    // One unit at the end is that of all.
    let last = units.last().copied().flatten().filter(|_| units[..units.len() - 1].iter().all(Option::is_none));
    let name = |k: usize, label: &str| {
        let own = match (nameless, labels.len()) {
            (true, 3) => format!("{stem} {}", AXES[k]),
            (true, _) => format!("{stem} {k}"),
            _ if k == 0 => bare.replace(":\t", " "),
            _ if is_letter(label) && !stem.is_empty() => format!("{stem} {label}"),
            _ => label.to_owned(),
        };
        let unit = units[k].or(if k == 0 || is_letter(label) { in_brackets } else { None }).or(last);
        let whole = format!("{heading} {own}");
        match unit.filter(|unit| !unit.symbol.is_empty()) {
            Some(unit) => format!("{} [{}]", whole.trim(), unit.symbol),
            None => whole.trim().to_owned(),
        }
    };
    labels.iter().enumerate().map(|(k, label)| name(k, label)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::AsCsv;
    use std::io::Read;

    fn csv(text: &str) -> Option<Vec<String>> {
        let mut out = String::new();
        let blocks = Blocks::of(text.lines().map(str::as_bytes))?;
        AsCsv::new(text.as_bytes(), Box::new(blocks)).read_to_string(&mut out).unwrap();
        Some(out.lines().map(str::to_owned).collect())
    }

    fn repeated(block: &str) -> String {
        let mut text = "MPU6050 found!\nRange set to: 500 deg/s\n\n".to_owned();
        for k in 0..20 {
            text += &block.replace('@', &format!("{k}.5"));
        }
        text
    }

    #[test]
    fn the_blocks_of_many_examples_are_rows() {
        for (block, header, row) in [
            (
                "Acceleration X: 0.1, Y: @, Z: 9.8 m/s^2\nRotation X: -0.01, Y: 0.2, Z: @ rad/s\nTemperature: 24.5 degC\n\n",
                "Acceleration X [m/s^2],Acceleration Y [m/s^2],Acceleration Z [m/s^2],Rotation X [rad/s],Rotation Y [rad/s],\
                 Rotation Z [rad/s],Temperature [degC]",
                "0.1,3.5,9.8,-0.01,0.2,3.5,24.5",
            ),
            (
                "Time: @ ms\r\nGyro X: 1 Y: 2 Z: @\r\nAngle: -4\r\n",
                "Time [ms],Gyro X,Gyro Y,Gyro Z,Angle",
                "3.5,1,2,3.5,-4",
            ),
            ("t=@\ngz=1\nenc=2\n---\n", "t,gz,enc", "3.5,1,2"),
            (
                "Gyroscope:\nX: 1\nY: 2\nZ: @\nAccelerometer:\nX: 4\nY: 5\nZ: 6\n====\n",
                "Gyroscope X,Gyroscope Y,Gyroscope Z,Accelerometer X,Accelerometer Y,Accelerometer Z",
                "1,2,3.5,4,5,6",
            ),
            (
                "Temperature @ deg C\tAccel X: 1 \tY: 2 \tZ: 3 m/s^2 \tGyro X: 4 \tY: 5 \tZ: @ radians/s \tEnc: 7\n",
                "Temperature [degC],Accel X [m/s^2],Accel Y [m/s^2],Accel Z [m/s^2],Gyro X [rad/s],Gyro Y [rad/s],\
                 Gyro Z [rad/s],Enc",
                "3.5,1,2,3,4,5,3.5,7",
            ),
            ("Gyro X = 1, Y = 2, Z = @ | Angle = 3 | t = @\n", "Gyro X,Gyro Y,Gyro Z,Angle,t", "1,2,3.5,3,3.5"),
            (
                "Orient:\tx= 1 |\ty= 2 |\tz= @\nGyro:\tx= 4 |\ty= 5 |\tz= 6\n--\n",
                "Orient x,Orient y,Orient z,Gyro x,Gyro y,Gyro z",
                "1,2,3.5,4,5,6",
            ),
            (
                "millis: @\ngyro (deg/s): 1, 2, 3\nencoder [deg]: 7\n",
                "millis,gyro x [deg/s],gyro y [deg/s],gyro z [deg/s],encoder [deg]",
                "3.5,1,2,3,7",
            ),
            (
                "[00:00:01.@] <inf> imu: gyro: 1 2 3 rad/s; encoder 4 deg\n".replace('@', "123").as_str(),
                "time,gyro x [rad/s],gyro y [rad/s],gyro z [rad/s],encoder [deg]",
                "00:00:01.123,1,2,3,4",
            ),
            (
                "12:30:01.@ -> gz: 1\n12:30:01.@ -> angle: 2\n".replace('@', "123").as_str(),
                "time,gz,angle",
                "12:30:01.123,1,2",
            ),
        ] {
            let lines = csv(&if block.contains("01.123") { block.repeat(20) } else { repeated(block) }).expect(block);
            assert_eq!(lines.iter().find(|line| line.contains(',')).unwrap(), header, "{block}");
            assert!(lines.iter().filter(|line| *line == row).count() >= 1, "{row}: {lines:?}");
            let rows = lines.iter().filter(|line| line.matches(',').count() == header.matches(',').count()).count();
            assert!(rows >= 21, "{rows} of 20 and a header: {lines:?}");
        }
    }

    #[test]
    fn a_line_that_is_lost_costs_its_fields_and_no_more() {
        let text = repeated("t: @\ngz: 1\nenc: 2\n") + "t: 90\nenc: 3\ngz: 4\nt: 91\ngz: 5\nenc: 6\n";
        let lines = csv(&text).unwrap();
        assert!(lines.contains(&"90,,3".to_owned()) && lines.contains(&"91,5,6".to_owned()), "{lines:?}");
    }

    #[test]
    fn tables_are_no_blocks() {
        for row in
            ["0.@,1,2\n1.@,1,\n", "t:@ gz:1 enc:2\nt:@ gz:1 enc:\n", "$IMU,@,1\n$IMU,@,2\n", "@ 1 2\n", "gz: @\n", ""]
        {
            let text: String = (0..20).map(|k| row.replace('@', &k.to_string())).collect();
            assert!(Blocks::of(text.lines().map(str::as_bytes)).is_none(), "{row}");
        }
    }
}
