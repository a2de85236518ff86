//! Definitions of ROS messages, turned into the steps that read one.

use super::known;
use crate::formats::primitive::Kind;
use std::collections::HashMap;

/// One step through the bytes of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// A number that is a channel.
    Number(Kind),
    /// A number that is none.
    Pass(Kind),
    /// Seconds and nanoseconds: the message's own time.
    Stamp,
    /// Text that is no channel.
    Text,
    /// Text that tells one part of a topic from another.
    Key,
    /// A sequence of texts, which name the numbers of the sequences after it.
    Names,
    /// A sequence of numbers, one for each name.
    Named(String, Kind),
    /// So many times these steps; `None`: the count stands before them.
    Repeat(Option<usize>, Vec<Step>),
}

/// How to read a kind of message.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// The steps, in order.
    pub steps: Vec<Step>,
    /// The names of the numbers, in order; those of named sequences come after them.
    pub fields: Vec<String>,
}

/// Messages within messages, steps of one, numbers of an array that are channels, at most.
const DEEPEST: usize = 16;
const MOST_STEPS: usize = 10_000;
const LONGEST_ARRAY: usize = 64;

/// The steps for `of`, where the text is the definition of `kind` with those of its parts below it.
#[must_use]
pub fn program(kind: &str, text: &str, of: &str) -> Option<Program> {
    let mut definitions = HashMap::new();
    let mut name = bare(kind);
    for part in text.split("\n====") {
        let part = part.trim_start_matches('=').trim_start();
        let body = match part.strip_prefix("MSG:") {
            Some(rest) => {
                let (first, body) = rest.split_once('\n').unwrap_or((rest, ""));
                name = bare(first.trim());
                body
            }
            None => part,
        };
        if !body.trim().is_empty() {
            definitions.entry(name.clone()).or_insert(body);
        }
    }
    let mut compiler = Compiler { definitions, program: Program::default(), named: false, steps: 0 };
    let steps = compiler.message(&bare(of), "", 0, true)?;
    compiler.program.steps = steps;
    Some(compiler.program)
}

/// ROS 2 says `sensor_msgs/msg/Imu` for what was `sensor_msgs/Imu`.
fn bare(kind: &str) -> String {
    kind.replacen("/msg/", "/", 1)
}

struct Compiler<'a> {
    definitions: HashMap<String, &'a str>,
    program: Program,
    /// Whether a sequence of names was met.
    named: bool,
    steps: usize,
}

impl Compiler<'_> {
    /// The steps of a message at a path; `exposed` where its numbers are channels.
    fn message(&mut self, kind: &str, path: &str, depth: usize, exposed: bool) -> Option<Vec<Step>> {
        if depth > DEEPEST {
            return None;
        }
        let text =
            self.definitions.get(kind).map_or_else(|| known::definition(kind), |text| Some((*text).to_owned()))?;
        let package = kind.rsplit_once('/').map_or("", |(package, _)| package);
        let mut steps = Vec::new();
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            let mut words = line.split_whitespace();
            let (Some(kind), Some(name)) = (words.next(), words.next()) else { continue };
            // A constant is no field. `string<=10` is a bound.
            if name.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
                continue;
            }
            let path = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
            steps.extend(self.field(kind, package, &path, depth, exposed)?);
        }
        Some(steps)
    }

    fn field(&mut self, kind: &str, package: &str, path: &str, depth: usize, exposed: bool) -> Option<Vec<Step>> {
        self.steps += 1;
        if self.steps > MOST_STEPS {
            return None;
        }
        let (kind, count) = match kind.rsplit_once('[') {
            Some((kind, count)) => (kind, Some(count.strip_suffix(']')?)),
            None => (kind, None),
        };
        let kind = kind.split("<=").next().unwrap_or(kind);
        let Some(count) = count else {
            return self.one(kind, package, path, depth, exposed).map(|step| step.into_iter().collect());
        };
        let fixed = if count.is_empty() || count.starts_with("<=") { None } else { Some(count.parse::<usize>().ok()?) };
        if let (Some(count), Some(number)) = (fixed, number(kind))
            && exposed
            && count <= LONGEST_ARRAY
            && !path.contains("covariance")
        {
            self.program.fields.extend((0..count).map(|i| format!("{path}[{i}]")));
            return Some(vec![Step::Number(number); count]);
        }
        if fixed.is_none() && depth == 0 && exposed {
            match (kind, number(kind)) {
                ("string", _) if path == "name" => {
                    self.named = true;
                    return Some(vec![Step::Names]);
                }
                (_, Some(number)) if self.named => return Some(vec![Step::Named(path.to_owned(), number)]),
                _ => {}
            }
        }
        let inner = self.one(kind, package, path, depth, false)?;
        Some(vec![Step::Repeat(fixed, inner)])
    }

    fn one(&mut self, kind: &str, package: &str, path: &str, depth: usize, exposed: bool) -> Option<Vec<Step>> {
        if let Some(number) = number(kind) {
            if !exposed {
                return Some(vec![Step::Pass(number)]);
            }
            self.program.fields.push(path.to_owned());
            return Some(vec![Step::Number(number)]);
        }
        let is_stamp = exposed && path == "header.stamp";
        match kind {
            "string" if path.ends_with("child_frame_id") => return Some(vec![Step::Key]),
            "string" => return Some(vec![Step::Text]),
            "time" | "duration" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time" if is_stamp => {
                return Some(vec![Step::Stamp]);
            }
            "time" | "duration" => return Some(vec![Step::Pass(Kind::U32), Step::Pass(Kind::U32)]),
            // Of a size that nobody knows.
            "wstring" => return None,
            _ => {}
        }
        let kind = bare(kind);
        let within = format!("{package}/{kind}");
        let full = if kind.contains('/') {
            kind
        } else if self.definitions.contains_key(&within) {
            within
        } else if kind == "Header" {
            "std_msgs/Header".to_owned()
        } else {
            // Old definitions leave the package out.
            let ending = format!("/{kind}");
            self.definitions.keys().find(|name| name.ends_with(&ending)).cloned().unwrap_or(within)
        };
        self.message(&full, path, depth + 1, exposed)
    }
}

fn number(kind: &str) -> Option<Kind> {
    Some(match kind {
        "bool" | "uint8" | "byte" | "char" | "octet" => Kind::U8,
        "int8" => Kind::I8,
        "int16" => Kind::I16,
        "uint16" => Kind::U16,
        "int32" => Kind::I32,
        "uint32" => Kind::U32,
        "int64" => Kind::I64,
        "uint64" => Kind::U64,
        "float32" => Kind::F32,
        "float64" => Kind::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMU: &str = "std_msgs/Header header\n\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance # row major\n\
        uint8 KIND=1\nfloat64[3] raw\nstring[<=4] notes\n================================================================================\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 w 1\n";

    fn steps_of(kind: &str, text: &str) -> Option<Program> {
        program(kind, text, kind)
    }

    #[test]
    fn numbers_become_channels_and_the_rest_is_passed_by() {
        let program = steps_of("sensor_msgs/msg/Imu", IMU).unwrap();
        assert_eq!(program.fields, ["orientation.x", "orientation.w", "raw[0]", "raw[1]", "raw[2]"]);
        assert_eq!(program.steps[..2], [Step::Stamp, Step::Text]);
        assert_eq!(program.steps[4], Step::Repeat(Some(9), vec![Step::Pass(Kind::F64)]));
        assert_eq!(program.steps.last(), Some(&Step::Repeat(None, vec![Step::Text])));
    }

    #[test]
    fn a_definition_without_end_or_with_a_part_missing_is_none() {
        assert_eq!(steps_of("a/A", "a/A again"), None);
        assert_eq!(steps_of("a/A", "a/B other"), None);
        assert_eq!(steps_of("a/A", "float64[99999999999999999999] x"), None);
        let wide = "b/B[100] x\n".repeat(2000);
        assert!(steps_of("a/A", &format!("{wide}\n====\nMSG: b/B\n{}", "float64 y\n".repeat(100))).is_none());
    }

    #[test]
    fn names_of_joints_name_the_sequences_after_them() {
        let program = steps_of("sensor_msgs/JointState", "string[] name\nfloat64[] position\n").unwrap();
        assert_eq!(program.steps, [Step::Names, Step::Named("position".to_owned(), Kind::F64)]);
    }
}
