//! Evidence files: what logs say, without the logs.
//!
//! ```text
//! {"schema":"truerate.evidence/1","logs":[
//! {…},                                      one log a line, in the order of the logs' SHA-256
//! {…}
//! ],"sha256":"…"}                           of the lines between
//! ```
//!
//! Numbers are written so that they are read back to the last bit. Files are merged by putting their lines in order: whatever was merged
//! with what before, the same logs give the same bytes.

use crate::{
    log::dependent,
    several::{self, Looked},
    subject::{Start, Subject},
    words::{Task, call},
};
use anyhow::{Context, Result, anyhow, bail, ensure};
use gyro_model::{
    Axis, diagnose,
    diagnosis::{BudgetPoint, LimitedBy, Verdict},
    pooled::Piece,
};
use jiff::{Timestamp, civil::Date, tz::TimeZone};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::{collections::BTreeMap, fs, path::Path};

mod merge;

use merge::Written;
pub use merge::{Merged, each, merge};

/// What is said of another file.
fn not_evidence(name: &str) -> String {
    format!("{name}: not an evidence file: {} makes one", call(Task::Evidence, "LOG -o E"))
}

/// What stands at the head of a file.
const SCHEMA: &str = "truerate.evidence/1";
/// What every such schema begins with.
const FAMILY: &str = "truerate.evidence/";

/// What one log says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogEvidence {
    /// SHA-256 of the log's bytes as stored.
    pub sha256: String,
    /// Its name, without its folder.
    pub log: String,
    /// The part that was recorded: one sensor.
    pub part: String,
    /// The type of that part, with its driver and range where they matter.
    #[serde(rename = "type")]
    pub kind: String,
    /// Whatever else was said of it, by its maker or by the log itself (serial number, board, versions).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub meta: BTreeMap<String, String>,
    /// The day on which it was recorded, where the log or its metadata say it.
    pub day: Option<Date>,
    /// Its length, s.
    pub seconds: f64,
    /// Rows in use.
    pub samples: u64,
    /// Lowest and highest temperature, °C.
    pub temperature: Option<(f64, f64)>,
    /// What it alone comes to, axis by axis.
    pub axes: Vec<AxisEvidence>,
    /// Its normal equations.
    pub pieces: Vec<Piece>,
    /// The program that made it.
    pub by: String,
}

/// What one log alone comes to on one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisEvidence {
    /// The axis.
    pub axis: Axis,
    /// The verdict.
    pub verdict: Verdict,
    /// Effects of the model at which it was linearised.
    pub effects: Vec<String>,
    /// The largest error over floor before effects were named.
    pub error_over_floor: Option<f64>,
    /// The largest part of the error.
    pub limited_by: Option<LimitedBy>,
    /// What the error is made of, at 0.1, 1 and 10 s.
    pub budget: Vec<BudgetPoint>,
    /// Faults of the data: kind and count.
    pub faults: BTreeMap<String, u64>,
    /// Why nothing of this axis stands in the equations; empty where it does.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub left_out: String,
}

/// What the maker of a log says of it.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    /// The part; the log's name where none is given.
    pub part: Option<String>,
    /// Its type.
    pub kind: Option<String>,
    /// Whatever else.
    pub meta: BTreeMap<String, String>,
}

/// The type of a part of which none is said.
const UNNAMED: &str = "unnamed";
/// Averaging times of which the budget is kept, s.
const KEPT: [f64; 3] = [0.1, 1.0, 10.0];
/// Clocks that count from when they were switched on say no date: s since 1970, the beginning of 2000.
const FIRST_DATE: i64 = 946_684_800;

impl LogEvidence {
    /// Of one log, from the model that it starts with.
    ///
    /// # Errors
    /// A log that cannot be judged, a day that is none.
    pub fn of(subject: &Subject, start: &Start, labels: &Labels, options: &diagnose::Options) -> Result<Self> {
        let looked = several::look(subject, start, options)?;
        let day = match labels.meta.get("day") {
            Some(day) => {
                Some(day.parse::<Date>().map_err(|_| anyhow!("--meta day={day}: a day is written 2026-05-31"))?)
            }
            None => Timestamp::from_nanosecond(subject.provenance.start_ns)
                .ok()
                .filter(|start| start.as_second() > FIRST_DATE)
                .map(|start| start.to_zoned(TimeZone::UTC).date()),
        };
        let stem = || Path::new(&subject.provenance.log).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let stem = || stem().map(|stem| stem.trim_end_matches(".csv").to_owned());
        Ok(Self {
            sha256: subject.provenance.sha256.clone(),
            log: subject.provenance.log.clone(),
            part: labels.part.clone().or_else(stem).unwrap_or_else(|| UNNAMED.to_owned()),
            kind: labels.kind.clone().unwrap_or_else(|| UNNAMED.to_owned()),
            // What its maker says goes before what the log says.
            meta: subject.provenance.said.clone().into_iter().chain(labels.meta.clone()).collect(),
            day,
            seconds: subject.record.duration(),
            samples: subject.provenance.samples,
            temperature: subject.provenance.temperature,
            axes: axes(subject, &looked),
            pieces: looked.pieces,
            by: format!("truerate {}", env!("CARGO_PKG_VERSION")),
        })
    }

    /// Why nothing of it is used, where nothing is.
    #[must_use]
    pub fn left_out(&self) -> Option<String> {
        if !self.pieces.is_empty() {
            return None;
        }
        let why: Vec<&str> =
            self.axes.iter().map(|axis| axis.left_out.as_str()).filter(|why| !why.is_empty()).collect();
        Some(if why.is_empty() { "no axis could be reduced to equations".to_owned() } else { why.join("; ") })
    }
}

fn axes(subject: &Subject, looked: &Looked) -> Vec<AxisEvidence> {
    let of = |axis: &gyro_model::diagnosis::AxisResult| {
        let kept = KEPT.iter().filter_map(|tau| {
            let apart = |point: &&BudgetPoint| (point.tau_s / tau).ln().abs();
            axis.budget.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).copied()
        });
        let mut budget: Vec<BudgetPoint> = Vec::new();
        for point in kept {
            if budget.iter().all(|own| own.tau_s != point.tau_s) {
                budget.push(point);
            }
        }
        let mut faults = BTreeMap::new();
        for fault in axis.data_faults.iter().filter(|fault| fault.axis.is_none_or(|own| own == axis.axis)) {
            *faults.entry(fault.kind.to_string()).or_insert(0) += fault.count;
        }
        let is_used = looked.pieces.iter().any(|piece| piece.axes.contains(&axis.axis));
        let overruled = subject.faults.iter().any(|fault| dependent::concerns(fault, axis.axis));
        let left_out = match axis.verdict {
            _ if is_used => String::new(),
            Verdict::BadData => format!("axis {}: the data are faulty{}", axis.axis, named(&faults)),
            _ if overruled => format!("axis {}: its reference was computed from this gyro", axis.axis),
            _ => format!("axis {}: its equations are not finite", axis.axis),
        };
        let model = looked.point.axes[axis.axis.index()].as_ref();
        AxisEvidence {
            axis: axis.axis,
            verdict: axis.verdict,
            effects: model.map_or_else(Vec::new, |own| own.effect_ids().into_iter().map(str::to_owned).collect()),
            error_over_floor: axis.error_over_floor,
            limited_by: axis.limited_by,
            budget,
            faults,
            left_out,
        }
    };
    looked.diagnosis.axes.iter().map(of).collect()
}

/// ` (wrong-unit, outliers)`.
fn named(faults: &BTreeMap<String, u64>) -> String {
    let names: Vec<&str> = faults.keys().map(String::as_str).collect();
    if names.is_empty() { String::new() } else { format!(" ({})", names.join(", ")) }
}

/// What some logs say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// One entry a log, in the order of their hashes.
    pub logs: Vec<LogEvidence>,
}

#[derive(Deserialize)]
struct Head {
    schema: String,
}

#[derive(Deserialize)]
struct Whole {
    logs: Vec<LogEvidence>,
    sha256: String,
}

impl Evidence {
    /// Of these logs. One that comes twice is kept once.
    ///
    /// # Errors
    /// Two that are of one log and say different things.
    pub fn new(logs: impl IntoIterator<Item = LogEvidence>) -> Result<Self> {
        Self::of(logs.into_iter().map(|log| (log, "")))
    }

    /// The same of logs with the name of the file that each stands in.
    fn of<'n>(logs: impl IntoIterator<Item = (LogEvidence, &'n str)>) -> Result<Self> {
        let mut all: BTreeMap<String, (LogEvidence, &str)> = BTreeMap::new();
        for (log, file) in logs {
            match all.get(&log.sha256) {
                Some((known, _)) if *known == log => {}
                Some((known, first)) => bail!(differ((known, first), (&log, file))),
                None => {
                    all.insert(log.sha256.clone(), (log, file));
                }
            }
        }
        Ok(Self { logs: all.into_values().map(|(log, _)| log).collect() })
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// A number that JSON cannot hold.
    pub fn render(&self) -> Result<String> {
        let lines = self.logs.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
        Ok(format!("{}\n{}\n{}\n", head(), lines.join(",\n"), tail(&sum(&lines))))
    }

    /// Understands a file's text; `name` is only named in errors.
    ///
    /// # Errors
    /// It is no such file, one of a newer version, cut off, changed, or holds numbers that no log makes.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let remedy = format!("make it again with {}", call(Task::Evidence, ""));
        ensure!(!text.trim().is_empty(), "{name}: is empty: {remedy}");
        let head = text.lines().next().unwrap_or_default();
        let head = serde_json::from_str::<Head>(text).ok().map(|head| head.schema).or_else(|| {
            let start = head.find("\"schema\":\"")? + "\"schema\":\"".len();
            Some(head[start..].split('"').next()?.to_owned())
        });
        match head.as_deref() {
            Some(SCHEMA) => {}
            Some(other) if other.starts_with(FAMILY) => bail!(
                "{name}: has the schema {other}, and this program knows {SCHEMA}: a newer truerate made it; update this one"
            ),
            Some(other) => bail!("{name}: has the schema {other}: evidence is made with {}", call(Task::Evidence, "")),
            None => bail!("{}", not_evidence(name)),
        }
        // As this program writes it, or with numbers that are written in another way: the checksum is of the very lines.
        let mut logs = Vec::new();
        let unsound_in =
            |log: &str, why: &str| anyhow!("{name}: {log} has numbers that no log makes ({why}): {remedy}");
        match merge::lines(text.as_bytes(), |line| logs.push(line.log)) {
            Written::Whole => return Self::new(logs).with_context(|| name.to_owned()),
            Written::Unsound(log, why) => bail!(unsound_in(&log, &why)),
            Written::Otherwise => {}
        }
        let whole: Whole = serde_json::from_str(text).map_err(|error| {
            if error.is_eof() {
                anyhow!("{name}: ends in the middle: copy it again, or {remedy}")
            } else {
                anyhow!("{name}: is damaged ({error}): copy it again, or {remedy}")
            }
        })?;
        ensure!(!whole.logs.is_empty(), "{name}: holds no log: {remedy}");
        let lines = whole.logs.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
        ensure!(
            several::hexadecimal(&sum(&lines)) == whole.sha256,
            "{name}: was changed after it was written (its checksum differs): copy it again, or {remedy}"
        );
        for log in &whole.logs {
            if let Some(why) = unsound(log) {
                bail!(unsound_in(&log.log, &why));
            }
        }
        Self::new(whole.logs).with_context(|| name.to_owned())
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`Self::parse`], and a file that cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let bytes = fs::read(path).with_context(|| format!("{name}: cannot be read: check the path"))?;
        let text = String::from_utf8(bytes).map_err(|_| anyhow!(not_evidence(&name)))?;
        Self::parse(&name, &text)
    }

    /// Several together, and how many logs came more than once.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn merge(all: impl IntoIterator<Item = Self>) -> Result<(Self, usize)> {
        Self::merge_named(all.into_iter().map(|own| (own, "")))
    }

    /// The same of evidence with names, which errors tell: of files, or of places in a list.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn merge_named<'n>(all: impl IntoIterator<Item = (Self, &'n str)>) -> Result<(Self, usize)> {
        let named = |(own, name): (Self, &'n str)| own.logs.into_iter().map(move |log| (log, name));
        let logs: Vec<(LogEvidence, &str)> = all.into_iter().flat_map(named).collect();
        let many = logs.len();
        let merged = Self::of(logs)?;
        let twice = many - merged.logs.len();
        Ok((merged, twice))
    }
}

/// The first line of a file.
fn head() -> String {
    format!("{{\"schema\":\"{SCHEMA}\",\"logs\":[")
}

/// The last one.
fn tail(sum: &[u8]) -> String {
    format!("],\"sha256\":\"{}\"}}", several::hexadecimal(sum))
}

/// Of the lines between.
fn sum(lines: &[String]) -> Vec<u8> {
    Sha256::digest(lines.join("\n").as_bytes()).to_vec()
}

/// What it holds that no log makes, in words.
fn unsound(log: &LogEvidence) -> Option<String> {
    if log.sha256.len() != HASH || !log.sha256.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Some(format!("its `sha256` is {:?}, and that has {HASH} hexadecimal digits", log.sha256));
    }
    if !(log.seconds >= 0.0 && log.seconds.is_finite()) {
        return Some(format!("its length is {} s", log.seconds));
    }
    log.pieces.iter().find_map(Piece::fault)
}

/// Digits of a SHA-256.
const HASH: usize = 64;

/// What is said of two pieces of one log that differ: each with the file that it stands in, where that is known.
fn differ(one: (&LogEvidence, &str), other: (&LogEvidence, &str)) -> String {
    let name = |(own, file): (&LogEvidence, &str)| {
        let file = if file.is_empty() { String::new() } else { format!(" in {file}") };
        format!("{} (part {}, type {}, {}){file}", own.log, own.part, own.kind, own.by)
    };
    format!(
        "two pieces of evidence are of the same log and differ: {} and {}: leave one of them out",
        name(one),
        name(other)
    )
}

#[cfg(test)]
mod tests;
