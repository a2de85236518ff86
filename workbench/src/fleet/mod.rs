//! What evidence says of types and parts: the mathematics called, and its answer as text, JSON, page and type file.

mod faults;
mod page;
mod text;
pub mod type_file;

pub use faults::FaultRow;
pub(crate) use text::value;

use crate::{
    evidence::Evidence,
    report::{Format, Terminal},
};
use gyro_model::{
    Axis,
    effects::{find, split_by},
    pooled::{
        fleet::{self, Dated, OfLabel, OfPart, OfType, Switched},
        search::Member,
    },
};
use jiff::{Span, civil::Date};
use serde::Serialize;

/// What many logs say, with the keys of `truerate.fleet/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Fleet {
    /// `"truerate.fleet/1"`.
    pub schema: &'static str,
    /// Logs that count.
    pub logs: usize,
    /// Parts that they are of.
    pub part_count: usize,
    /// Types, effect by effect.
    pub types: Vec<TypeRow>,
    /// Parts, outliers first, then those that changed.
    pub parts: Vec<PartRow>,
    /// What goes by a label of the logs: a driver's version, a lot, a mount.
    pub labels: Vec<LabelRow>,
    /// Faults of the data that are a type's or a part's.
    pub faults: Vec<FaultRow>,
    /// Effects that the logs together cannot tell apart.
    pub ambiguous: Vec<AmbiguousRow>,
    /// Logs that do not count, and why.
    pub left_out: Vec<LeftOut>,
}

/// One parameter of one type.
#[derive(Clone, Debug, Serialize)]
pub struct TypeRow {
    /// The type.
    #[serde(rename = "type")]
    pub kind: String,
    /// The axis.
    pub axis: Axis,
    /// The effect.
    pub effect: String,
    /// Its parameter.
    pub name: String,
    /// The shapes at which it was taken.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shape: Vec<f64>,
    /// Its unit.
    pub unit: String,
    /// Mean over the parts, outliers left out.
    pub mean: f64,
    /// Standard error of that.
    pub std_error: Option<f64>,
    /// Standard deviation between parts; `null` from one part.
    pub spread: Option<f64>,
    /// Standard deviation between the logs of a part, beyond their errors; `null` where no part has two.
    pub spread_of_logs: Option<f64>,
    /// Interval in which the next part lies (95 %).
    pub next: Option<(f64, f64)>,
    /// Chance of such a mean where the type has none, priced for the search.
    pub p_value: f64,
    /// Chance of such a spread between parts where there is none.
    pub p_of_spread: f64,
    /// Whether it raises the error over the floor by a twentieth on the median log.
    pub matters: bool,
    /// Parts that are in the mean.
    pub parts: usize,
    /// Logs that are in it.
    pub logs: usize,
    /// Log by log.
    pub readings: Vec<ReadingRow>,
}

/// What one log says of one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ReadingRow {
    /// The log.
    pub log: String,
    /// Its part.
    pub part: String,
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Whether its part is an outlier.
    pub outlier: bool,
}

/// One parameter of one part.
#[derive(Clone, Debug, Serialize)]
pub struct PartRow {
    /// The type.
    #[serde(rename = "type")]
    pub kind: String,
    /// The part.
    pub part: String,
    /// The axis.
    pub axis: Axis,
    /// The effect.
    pub effect: String,
    /// Its parameter.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The best prediction from its own logs and its type; of an outlier its own mean.
    pub value: f64,
    /// Standard error of that.
    pub std_error: Option<f64>,
    /// Whether it is not of its type.
    pub outlier: bool,
    /// Chance that a part of the type is as far off; `null` where there are too few others.
    pub p_value: Option<f64>,
    /// When it changed.
    pub changed: Vec<ChangedRow>,
    /// Its logs.
    pub logs: Vec<String>,
}

/// A change of a part in time.
#[derive(Clone, Debug, Serialize)]
pub struct ChangedRow {
    /// The day, in the middle of the interval in which it lies.
    pub day: Date,
    /// Half of that interval, days.
    pub days: f64,
    /// By how much.
    pub by: f64,
    /// Standard error of that.
    pub std_error: f64,
    /// Chance of it where nothing changed, priced for all parts.
    pub p_value: f64,
    /// What was said of the logs that changed there too.
    pub with: Vec<SwitchedRow>,
}

/// A label that has one value before a change and another after it.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchedRow {
    /// The label.
    pub label: String,
    /// Its value before.
    pub from: String,
    /// Its value after.
    pub to: String,
}

/// A parameter that goes by a label.
#[derive(Clone, Debug, Serialize)]
pub struct LabelRow {
    /// The type.
    #[serde(rename = "type")]
    pub kind: String,
    /// The axis.
    pub axis: Axis,
    /// The effect.
    pub effect: String,
    /// Its parameter.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The label, and those that part the logs in the same way.
    pub labels: Vec<String>,
    /// Value by value of the first.
    pub values: Vec<ValueRow>,
    /// Chance of such differences where there are none, priced for all labels and parameters.
    pub p_value: f64,
}

/// What the logs with one value of a label have.
#[derive(Clone, Debug, Serialize)]
pub struct ValueRow {
    /// The value.
    pub value: String,
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Parts.
    pub parts: usize,
    /// Logs.
    pub logs: usize,
}

/// Effects that cannot be told apart.
#[derive(Clone, Debug, Serialize)]
pub struct AmbiguousRow {
    /// The type.
    #[serde(rename = "type")]
    pub kind: String,
    /// The axis.
    pub axis: Axis,
    /// The effect that was taken.
    pub effect: String,
    /// What it cannot be told from.
    pub aliases: Vec<String>,
    /// The motion that would.
    pub separate_by: String,
}

/// A log that does not count.
#[derive(Clone, Debug, Serialize)]
pub struct LeftOut {
    /// The log.
    pub log: String,
    /// Why.
    pub why: String,
}

/// The day that others are counted from.
const ORIGIN: Date = jiff::civil::date(2000, 1, 1);

fn days(day: Date) -> f64 {
    (day - ORIGIN).get_days().into()
}

fn day(days: f64) -> Date {
    ORIGIN.checked_add(Span::new().days(days.round() as i64)).unwrap_or(ORIGIN)
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Fleet {
    /// What this evidence says.
    #[must_use]
    pub fn of(evidence: &Evidence) -> Self {
        let mut left_out: Vec<LeftOut> = Vec::new();
        let mut logs = Vec::new();
        for own in &evidence.logs {
            if let Some(why) = own.left_out() {
                left_out.push(LeftOut { log: own.log.clone(), why });
                continue;
            }
            left_out.extend(
                own.axes
                    .iter()
                    .filter(|axis| !axis.left_out.is_empty())
                    .map(|axis| LeftOut { log: own.log.clone(), why: axis.left_out.clone() }),
            );
            logs.push(fleet::FleetLog {
                name: own.log.clone(),
                kind: own.kind.clone(),
                part: own.part.clone(),
                day: own.day.map(days),
                labels: own.meta.clone(),
                member: Member::of(&own.pieces),
            });
        }
        let mut names: Vec<(&str, &str)> = logs.iter().map(|log| (log.kind.as_str(), log.part.as_str())).collect();
        names.sort_unstable();
        names.dedup();
        let (part_count, found) = (names.len(), fleet::fleet(&logs));
        let units: Vec<_> =
            found.types.iter().map(|own| (own.kind.clone(), own.key.clone(), own.unit.clone())).collect();
        let unit = |own: &OfPart| {
            let known = units.iter().find(|(kind, key, _)| *kind == own.kind && *key == own.key);
            known.map_or_else(String::new, |(.., unit)| unit.clone())
        };
        Self {
            schema: "truerate.fleet/1",
            logs: logs.len(),
            part_count,
            types: found.types.iter().map(type_row).collect(),
            parts: found.parts.iter().map(|own| part_row(own, unit(own))).collect(),
            labels: found.labels.into_iter().map(label_row).collect(),
            faults: faults::of(evidence),
            ambiguous: found
                .ambiguous
                .into_iter()
                .map(|own| AmbiguousRow {
                    separate_by: split_by(&own.effect, &own.aliases),
                    kind: own.kind,
                    axis: own.axis,
                    effect: own.effect,
                    aliases: own.aliases,
                })
                .collect(),
            left_out,
        }
    }

    /// In one of the forms of a report; `name` is the file's.
    #[must_use]
    pub fn render(&self, name: &str, format: Format, terminal: Terminal) -> String {
        match format {
            Format::Json => {
                serde_json::to_string(self).unwrap_or_else(|error| format!("{{\"error\":\"{error}\"}}")) + "\n"
            }
            Format::Text => text::render(self, name, terminal),
            Format::Html => page::render(self, name),
        }
    }
}

impl TypeRow {
    /// Whether the effect is one that was looked for: not of the base model.
    #[must_use]
    pub fn is_found(&self) -> bool {
        !fleet::is_base(&self.effect)
    }

    /// `effect.name`, with the shapes where it has any.
    #[must_use]
    pub fn label(&self) -> String {
        label(self.axis, &self.effect, &self.name, &self.shape)
    }
}

fn label(axis: Axis, effect: &str, name: &str, shape: &[f64]) -> String {
    let several = find(effect).is_some_and(|e| e.parameters(axis).len() > 1) || name == "share";
    let name = if several { format!("{effect}.{name}") } else { effect.to_owned() };
    let shape: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let shape = if shape.is_empty() { String::new() } else { format!(" at {}", shape.join(", ")) };
    format!("{axis} {name}{shape}")
}

fn type_row(own: &OfType) -> TypeRow {
    let nested = &own.nested;
    TypeRow {
        kind: own.kind.clone(),
        axis: own.key.axis,
        effect: own.key.effect.clone(),
        name: own.key.name.clone(),
        shape: own.key.shape.clone(),
        unit: own.unit.clone(),
        mean: nested.mean,
        std_error: finite(nested.std_error),
        spread: (nested.parts > 1).then(|| nested.between.sqrt()),
        spread_of_logs: (nested.logs > nested.parts).then(|| nested.within.sqrt()),
        next: nested.next(),
        p_value: own.p_value,
        p_of_spread: nested.p_of_spread(),
        matters: own.matters,
        parts: nested.parts,
        logs: nested.logs,
        readings: own
            .readings
            .iter()
            .map(|(log, part, value, std_error, outlier)| ReadingRow {
                log: log.clone(),
                part: part.clone(),
                value: *value,
                std_error: *std_error,
                outlier: *outlier,
            })
            .collect(),
    }
}

fn label_row(own: OfLabel) -> LabelRow {
    let row = |(value, mean, std_error, parts, logs)| ValueRow { value, mean, std_error, parts, logs };
    LabelRow {
        kind: own.kind,
        axis: own.key.axis,
        effect: own.key.effect,
        name: own.key.name,
        unit: own.unit,
        labels: own.labels,
        values: own.values.into_iter().map(row).collect(),
        p_value: own.p_value,
    }
}

fn part_row(own: &OfPart, unit: String) -> PartRow {
    // Within a day the order of logs is not known.
    let changed = own.changed.iter().filter(|change| change.days > 0.0).map(
        |Dated { day: middle, days, by, std_error, p_value, with }| ChangedRow {
            day: day(*middle),
            days: *days,
            by: *by,
            std_error: *std_error,
            p_value: *p_value,
            with: with
                .iter()
                .map(|Switched { label, from, to }| SwitchedRow {
                    label: label.clone(),
                    from: from.clone(),
                    to: to.clone(),
                })
                .collect(),
        },
    );
    PartRow {
        kind: own.kind.clone(),
        part: own.part.clone(),
        axis: own.key.axis,
        effect: own.key.effect.clone(),
        name: own.key.name.clone(),
        unit,
        value: own.value,
        std_error: finite(own.std_error),
        outlier: own.outlier,
        p_value: own.p_value,
        changed: changed.collect(),
        logs: own.logs.clone(),
    }
}
