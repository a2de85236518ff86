//! Lines of one wording, a reading each: what changes from line to line is a value, everything else is text.
//!
//! ```text
//! 00> [  3.540000] gyro: -1.5 deg/s enc: 3            time,gyro [deg/s],enc
//! <sample t="0.01" gz="1.5" enc="3"/>            →    t,gz,enc
//! ts=2026-05-02T09:14:00.1Z level=info gz=1.5         ts,gz
//! #000381 T00003.810 G-0051.282                       column_1,T,G
//! ```
//!
//! Numbers may stand in words (`T12.5`, `1.5deg/s`), and times anywhere. The name of a value is the word before it.

use super::{Shape, number_end, write_row};
use crate::{
    meaning::{What, understand},
    text::{form, is_row},
    unit::{self, Quantity, Unit},
};
use std::{collections::HashMap, ops::Range};

/// Lines that have to be of the wording, at least, and their share of those that hold numbers.
const FEWEST: usize = 8;
const SHARE: f64 = 0.8;
/// Values in a line, and bytes of it, at most.
const MOST: usize = 64;
const LONGEST: usize = 1000;
/// Words of a name.
const WORDS: usize = 2;
/// Signs between a name and its value, and those that begin something new.
const SIGNS: [char; 2] = [':', '='];
const BORDERS: &[char] = &[',', ';', '"', '\'', '<', '>', '{', '}', '|', '&', ':', '=', '#', '\t'];

/// Lines of one wording as lines of a CSV.
pub struct Sentence {
    wording: String,
    /// Which of a line's numbers are values.
    kept: Vec<usize>,
    names: Vec<String>,
    is_headed: bool,
}

impl Sentence {
    /// What lines like these are; `None` where they have no wording in common.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let rows = lines.iter().filter(|line| is_row(line)).count();
        ((rows as f64) < (1.0 - SHARE) * lines.len() as f64).then(|| Self::of_one_wording(lines)).flatten()
    }

    /// The same of records whose strings hold sentences, as a system's journal has them: `{"MESSAGE": "gz=1.5 enc=3"}`.
    pub fn in_records(lines: &[&[u8]]) -> Option<Self> {
        let filled = lines.iter().filter(|line| !line.is_empty()).count();
        let told = lines.iter().filter(|line| tells_in_strings(line)).count();
        (told as f64 > SHARE * filled as f64).then(|| Self::of_one_wording(lines)).flatten()
    }

    fn of_one_wording(lines: &[&[u8]]) -> Option<Self> {
        let lines: Vec<&str> = lines.iter().filter_map(|line| std::str::from_utf8(line).ok()).collect();
        let cut: Vec<(&str, Vec<Range<usize>>, String)> = (lines.iter().map(|line| line.trim()))
            .map(|line| (line, numbers(line)))
            .filter(|(_, places)| !places.is_empty())
            .map(|(line, places)| (line, places.clone(), wording(line, &places)))
            .collect();
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for (.., wording) in &cut {
            *counts.entry(wording).or_default() += 1;
        }
        let (wording, count) = counts.into_iter().max_by_key(|(_, count)| *count)?;
        if count < FEWEST || count as f64 <= SHARE * cut.len() as f64 {
            return None;
        }
        let of: Vec<(&str, &[Range<usize>])> = (cut.iter())
            .filter(|(.., other)| other == wording)
            .map(|(line, places, _)| (*line, places.as_slice()))
            .collect();
        let &(line, places) = of.first()?;
        let written = |k: usize| of.iter().map(move |(line, places)| &line[places[k].clone()]);
        let changes = |k: usize| written(k).any(|number| number != &line[places[k].clone()]);
        // A number that never changes is a value only where it has a name and stands apart from it: `gyro1`, `00>` are text.
        let is_apart = |k: usize| {
            let before = line[..places[k].start].trim_end_matches(['"', '\'', ' ', '[', '(']);
            before.ends_with(SIGNS)
        };
        let kept: Vec<usize> = (0..places.len()).filter(|&k| changes(k) || is_apart(k)).collect();
        if kept.len() < 2 || kept.len() > MOST || kept.iter().filter(|&&k| changes(k)).count() < 2 {
            return None;
        }
        let kept_places: Vec<Range<usize>> = kept.iter().map(|&k| places[k].clone()).collect();
        let is_time = |k: usize| {
            let values: Vec<Option<f64>> = written(kept[k]).map(|number| number.parse().ok()).collect();
            let steps = || values.windows(2).filter_map(|pair| Some(pair[1]? - pair[0]?));
            // What grows by 1 counts lines.
            form(line[kept_places[k].clone()].as_bytes()).is_some()
                || values.iter().all(Option::is_some)
                    && steps().all(|step| step > 0.0)
                    && !steps().all(|step| step == 1.0)
        };
        let names = named(line, &kept_places, &is_time)?;
        Some(Self { wording: wording.to_owned(), kept, names, is_headed: false })
    }
}

impl Shape for Sentence {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let text = String::from_utf8_lossy(line);
        let text = text.trim();
        let places = numbers(text);
        if places.is_empty() || wording(text, &places) != self.wording {
            if text.chars().any(char::is_alphanumeric) {
                out.extend_from_slice(text.as_bytes());
                out.push(b'\n');
            }
            return;
        }
        if !std::mem::replace(&mut self.is_headed, true) {
            write_row(out, &self.names);
        }
        write_row(out, self.kept.iter().map(|&place| &text[places[place].clone()]));
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

/// Whether a string within a line of JSON holds a value with a name: `"MESSAGE": "gz=1.5"`.
#[must_use]
pub fn tells_in_strings(line: &[u8]) -> bool {
    let Ok(line) = std::str::from_utf8(line) else { return false };
    // Strings stand at every other place between quotation marks.
    line.split('"').skip(1).step_by(2).any(|text| {
        let signs = text.match_indices(SIGNS);
        signs.into_iter().any(|(at, _)| {
            let is_named = text[..at].trim_end().ends_with(|c: char| c.is_alphabetic() || c == '_');
            is_named && number_end(text[at + 1..].trim_start()).is_some()
        })
    })
}

/// What a line says, with a sign in place of each number.
fn wording(line: &str, places: &[Range<usize>]) -> String {
    let mut wording = String::with_capacity(line.len());
    let mut from = 0;
    for place in places {
        let between = line[from..place.start].split_whitespace();
        between.for_each(|word| wording.push_str(word));
        wording.push('\0');
        from = place.end;
    }
    line[from..].split_whitespace().for_each(|word| wording.push_str(word));
    wording
}

/// The places of the numbers and times in a line.
fn numbers(line: &str) -> Vec<Range<usize>> {
    let (bytes, mut found, mut at) = (line.as_bytes(), Vec::new(), 0);
    while at < bytes.len() && line.len() <= LONGEST {
        if !line.is_char_boundary(at) {
            at += 1;
            continue;
        }
        let before = at.checked_sub(1).map(|k| bytes[k]);
        let is_apart = !before.is_some_and(|b| b.is_ascii_alphanumeric() || b == b'_');
        if let Some(end) = moment_end(&line[at..]).filter(|_| is_apart) {
            found.push(at..at + end);
            at += end;
            continue;
        }
        // A sign belongs to a number; between two it parts them.
        let follows = before.is_some_and(|b| b.is_ascii_digit() || matches!(b, b'.' | b'^'));
        match number_end(&line[at..]).filter(|_| !follows) {
            Some(length) => {
                if ends(&line[at + length..]) {
                    found.push(at..at + length);
                }
                at += length;
            }
            None => at += 1,
        }
    }
    found
}

/// How long the time is that a text begins with: a date with a time of day, or a time of day.
fn moment_end(text: &str) -> Option<usize> {
    if !text.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let word = |from: usize| {
        let is_end = |c: char| c.is_whitespace() || matches!(c, '"' | '\'' | ']' | '}' | ')' | '<' | ';' | '|');
        text[from..].find(is_end).map_or(text.len(), |length| from + length)
    };
    let first = word(0);
    let trimmed = |end: usize| text[..end].trim_end_matches([',', ':', '.']).len();
    let both = text[first..].starts_with(' ').then(|| trimmed(word(first + 1)));
    both.into_iter().chain([trimmed(first)]).find(|&end| end > 4 && form(&text.as_bytes()[..end]).is_some())
}

/// Whether what follows a number ends it: a sign, a blank, or a unit.
fn ends(rest: &str) -> bool {
    match rest.chars().next() {
        Some('.') => !rest[1..].starts_with(|c: char| c.is_ascii_digit()),
        Some(c) if c.is_alphanumeric() || matches!(c, '_' | '°' | '%') => unit_in(rest).is_some(),
        _ => true,
    }
}

/// The unit that a text begins with, and where it ends.
fn unit_in(text: &str) -> Option<(Unit, usize)> {
    let is_end = |c: char| c.is_whitespace() || matches!(c, ']' | ')' | '(') || BORDERS.contains(&c);
    let end_from = |from: usize| from + text[from..].find(is_end).unwrap_or(text.len() - from);
    let first = end_from(0);
    // `deg C`
    let second = text[first..].starts_with(' ').then(|| end_from(first + 1));
    second.into_iter().chain([first]).find_map(|end| {
        let unit =
            unit::parse(&text[..end]).filter(|unit| unit.quantity != Quantity::Other || text.starts_with('%'))?;
        // A letter before a colon is a name: `V: 3` is no volt.
        (!text[end..].trim_start().starts_with(SIGNS)).then_some((unit, end))
    })
}

/// What stands before a value: its name, the unit in the name, and the last word that is no name.
struct Before {
    name: String,
    unit: Option<Unit>,
    heading: Option<String>,
}

impl Before {
    fn of(between: &str) -> Self {
        let bare = between.trim_end_matches(['"', '\'', ' ', '\t']);
        let opened = bare.trim_end_matches(['[', '(', '{', '"', '\'', ' ']);
        let text = if opened.ends_with(SIGNS) { opened } else { bare };
        let sign = text.chars().next_back().filter(|c| SIGNS.contains(c));
        let text = text.strip_suffix(SIGNS).unwrap_or(text).trim_end_matches(['"', '\'', ' ']);
        // `gyro [deg/s]`
        let (text, unit) = unit::split(text);
        let part = text.rfind(BORDERS).map_or(text, |at| &text[at + 1..]);
        let part = part.rfind(['[', ']', '(', ')']).filter(|_| !part.ends_with(']')).map_or(part, |at| &part[at + 1..]);
        let words: Vec<&str> = part.split_whitespace().collect();
        let most = match sign {
            Some(':') => WORDS,
            // `gz=1.5`, `G-12.5`, `gyro 1.5`
            _ => 1,
        };
        let name = &words[words.len().saturating_sub(most)..];
        let is_name = name.iter().all(|word| word.starts_with(|c: char| c.is_alphabetic() || c == '_'));
        let (name, others) =
            if is_name { (name.join(" "), words.len() - name.len()) } else { (String::new(), words.len()) };
        let is_word = |word: &&&str| word.chars().all(char::is_alphabetic);
        let heading = words[..others].iter().rev().find(is_word).map(|word| (*word).to_owned());
        Self { name, unit, heading }
    }
}

/// The names of the values at these places; `None` where none has one.
fn named(line: &str, places: &[Range<usize>], is_time: &dyn Fn(usize) -> bool) -> Option<Vec<String>> {
    let mut from = 0;
    let mut before: Vec<Before> = Vec::new();
    let mut units: Vec<Option<Unit>> = Vec::new();
    for place in places {
        let mut between = &line[from..place.start];
        if let Some(last) = units.last_mut() {
            let text = between.trim_start_matches([' ', '[', '(']);
            // What stands right before a number is its name: `G-12.5`.
            if let Some((unit, end)) = unit_in(text).filter(|(_, end)| *end < text.len()) {
                *last = Some(unit);
                between = &text[end..];
            }
        }
        before.push(Before::of(between));
        units.push(before[before.len() - 1].unit);
        from = place.end;
    }
    if let (Some(last), Some((unit, _))) = (units.last_mut(), unit_in(line[from..].trim_start_matches([' ', '[', '('])))
    {
        *last = Some(unit);
    }
    if before.iter().all(|of| of.name.is_empty()) {
        return None;
    }
    let mut names: Vec<String> = before.iter().map(|of| of.name.clone()).collect();
    let tells_time = |name: &String| understand(name, None).is_some_and(|meaning| meaning.what == What::Time);
    let has_time = names.iter().any(tells_time);
    // `gyro: [1, 2, 3]` are the axes of one sensor.
    let mut first = 0;
    while first < names.len() {
        let end = (first + 1..names.len()).find(|&k| !names[k].is_empty()).unwrap_or(names.len());
        let stem = names[first].clone();
        for k in first..end {
            names[k] = match (stem.is_empty(), end - first) {
                (true, _) if k == 0 && !has_time && is_time(k) => "time".to_owned(),
                (true, _) => format!("column_{}", k + 1),
                (false, 1) => stem.clone(),
                (false, 3) => format!("{stem} {}", ["x", "y", "z"][k - first]),
                (false, _) => format!("{stem} {}", k - first),
            };
        }
        first = end;
    }
    // `gyro x=1 y=2 acc x=3 y=4`: the word above tells them apart.
    let is_twice = (0..names.len()).any(|k| names[..k].contains(&names[k]));
    if is_twice {
        let mut heading = String::new();
        for (name, of) in names.iter_mut().zip(&before) {
            if let Some(own) = &of.heading {
                heading.clone_from(own);
            }
            format!("{heading} {name}").trim().clone_into(name);
        }
    }
    let with_unit = |(name, unit): (String, Option<Unit>)| match unit.filter(|unit| !unit.symbol.is_empty()) {
        Some(unit) => format!("{name} [{}]", unit.symbol),
        None => name,
    };
    Some(names.into_iter().zip(units).map(with_unit).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Header and first row of lines like this one, in which `@` grows and `~` is what a sensor reads.
    fn csv(line: &str) -> Option<Vec<String>> {
        let written = |k: i32| {
            line.replace("@@", &format!("{:02}", 3 * k % 60))
                .replace('@', &(10 * k + 5).to_string())
                .replace('~', &format!("{}.5", k * k % 7 - 3))
        };
        let lines: Vec<String> = (0..15).map(written).collect();
        let refs: Vec<&[u8]> = lines.iter().map(String::as_bytes).collect();
        let mut of = Sentence::of(&refs).or_else(|| Sentence::in_records(&refs))?;
        let mut out = Vec::new();
        of.line(b"boot 1.2", &mut out);
        of.line(refs[1], &mut out);
        Some(String::from_utf8(out).unwrap().lines().map(str::to_owned).collect())
    }

    #[test]
    fn what_changes_has_the_name_before_it() {
        for (line, header, row) in [
            ("00> [  @.250] gyro: ~ deg/s enc: ~", "time,gyro [deg/s],enc", "15.250,-2.5,-2.5"),
            ("  <sample t=\"@.25\" gz=\"~\" enc=\"~\"/>", "t,gz,enc", "15.25,-2.5,-2.5"),
            ("ts=2026-05-02T09:14:@@.1Z level=info msg=\"a reading\" gz=~", "ts,gz", "2026-05-02T09:14:03.1Z,-2.5"),
            ("T000@.25 G~ E~deg", "T,G,E [deg]", "00015.25,-2.5,-2.5"),
            (
                "2026-05-02T09:14:@@Z stdout F imu1 gz=~deg/s gyro2=~",
                "time,gz [deg/s],gyro2",
                "2026-05-02T09:14:03Z,-2.5,-2.5",
            ),
            ("@,imu,\"{\"\"gz\"\": ~, \"\"enc\"\": ~}\"", "time,gz,enc", "15,-2.5,-2.5"),
            ("{\"at\": \"@\", \"MESSAGE\": \"gz=~ enc=~\"}", "at,gz,enc", "15,-2.5,-2.5"),
        ] {
            assert_eq!(csv(line).expect(line), ["boot 1.2", header, row], "{line}");
        }
        assert_eq!(csv("t=@ w=[~, ~, ~] e=~").unwrap()[1], "t,w x,w y,w z,e");
        assert_eq!(csv("gyro x=~ y=~ acc x=~ y=~ t=@").unwrap()[1], "gyro x,gyro y,acc x,acc y,acc t");
    }

    #[test]
    fn tables_and_tales_are_none() {
        for line in ["@,~,~", "@ ~ ~", "t:@ gz:~", "{\"t\": @, \"gz\": ~}", "nothing is read", "only @"] {
            assert_eq!(csv(line), None, "{line}");
        }
    }
}
