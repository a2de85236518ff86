//! What evidence says of types and parts: the mathematics called, and its answer as text, JSON, page and type file.

mod faults;
mod page;
mod text;
pub mod type_file;

pub use faults::FaultRow;
pub(crate) use text::value;

use crate::{
    evidence::{self, Evidence, LogEvidence},
    report::{Format, Terminal},
};
use anyhow::Result;
use faults::Seen;
use gyro_model::{
    Axis,
    effects::{find, split_by},
    pooled::{
        course::Point,
        fleet::{self, Dated, OfLabel, OfLog, OfPart, OfType, OfValue, Switched},
        mount::{self, Share, Tilt},
        search::Member,
    },
    thresholds::SIGNIFICANCE,
};
use jiff::{Span, civil::Date};
use serde::Serialize;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

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
    /// Misalignments, pair by pair of axes: what of it is the mount's, what the chip's.
    pub misaligned: Vec<MisalignedRow>,
    /// Effects that the logs together cannot tell apart.
    pub ambiguous: Vec<AmbiguousRow>,
    /// Parameters that this program does not know, and in how many logs: a newer one made them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_understood: Vec<UnknownRow>,
    /// Logs that do not count, and why.
    pub left_out: Vec<LeftOut>,
}

/// A parameter of the evidence that this program does not know.
#[derive(Clone, Debug, Serialize)]
pub struct UnknownRow {
    /// The effect.
    pub effect: String,
    /// Its parameter.
    pub name: String,
    /// Logs that have it.
    pub logs: usize,
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
    /// Chance of such a spread between the logs of a part where there is none.
    pub p_of_spread_of_logs: f64,
    /// Whether it raises the error over the floor by a twentieth on the median log.
    pub matters: bool,
    /// Parts that are in the mean.
    pub parts: usize,
    /// Logs that are in it.
    pub logs: usize,
    /// Log by log.
    pub readings: Vec<OfLog>,
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
    /// The best prediction from its own logs and its type; of an outlier its own mean; of a part that changed what it has since then.
    pub value: f64,
    /// Standard error of that.
    pub std_error: Option<f64>,
    /// Whether it is not of its type.
    pub outlier: bool,
    /// Chance that a part of the type is as far off; `null` where there are too few others.
    pub p_value: Option<f64>,
    /// When it changed.
    pub changed: Vec<ChangedRow>,
    /// Its control charts, of four dated logs or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub course: Option<CourseRow>,
    /// Its logs.
    pub logs: Vec<String>,
}

/// A part in time.
#[derive(Clone, Debug, Serialize)]
pub struct CourseRow {
    /// What the charts are held against: before the change, or of all logs.
    pub level: f64,
    /// Log by log.
    pub points: Vec<PointRow>,
}

/// One log of a part on its charts.
#[derive(Clone, Debug, Serialize)]
pub struct PointRow {
    /// The day.
    pub day: Date,
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// The exponentially weighted moving average (EWMA).
    pub average: f64,
    /// How far that may lie from the level.
    pub limit: f64,
    /// The cumulated sum (CUSUM), standard deviations.
    pub sum: f64,
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
    /// What the part had before.
    pub before: f64,
    /// Standard error of that.
    pub before_error: f64,
    /// What it has since then.
    pub after: f64,
    /// Standard error of that.
    pub after_error: f64,
    /// Chance of it where nothing changed, priced for all parts.
    pub p_value: f64,
    /// What was said of the logs that changed there too.
    pub with: Vec<Switched>,
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
    pub values: Vec<OfValue>,
    /// Standard deviation between the values; `null` of two.
    pub spread: Option<f64>,
    /// Chance of such differences where there are none, priced for all labels and parameters.
    pub p_value: f64,
}

/// What two axes of a type feel of each other's rate.
#[derive(Clone, Debug, Serialize)]
pub struct MisalignedRow {
    /// The type.
    #[serde(rename = "type")]
    pub kind: String,
    /// The two axes.
    pub axes: [Axis; 2],
    /// The third one, about which a mount would be turned.
    pub about: Axis,
    /// Whose it is.
    pub of: Whose,
    /// By how much the sensor is turned, rad: what the two feel with opposite signs.
    pub turned: ShareRow,
    /// The share that they feel with one sign: no mount makes that.
    pub alike: ShareRow,
    /// Part by part.
    pub parts: Vec<mount::OfPart>,
}

/// Whose a misalignment is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Whose {
    /// The mount's: the sensor is turned as a whole.
    Mount,
    /// The chip's: its axes are not square to each other.
    Chip,
    /// Something of either.
    Both,
    /// Too little of either to tell.
    Unknown,
}

impl Whose {
    /// In a word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mount => "the mount",
            Self::Chip => "the chip",
            Self::Both => "both",
            Self::Unknown => "not distinguished",
        }
    }
}

/// Mean and spreads of one kind of misalignment.
#[derive(Clone, Debug, Serialize)]
pub struct ShareRow {
    /// The mean over the parts.
    pub mean: f64,
    /// Standard error of that.
    pub std_error: Option<f64>,
    /// Standard deviation between parts; `null` from one part.
    pub spread: Option<f64>,
    /// Standard deviation between the logs of a part; `null` where no part has two.
    pub spread_of_logs: Option<f64>,
    /// Chance of such a mean where there is none.
    pub p_of_mean: f64,
    /// Chance of it where there is nothing, priced for the search.
    pub p_value: f64,
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

/// What counts of each log.
#[derive(Default)]
struct Gathered {
    logs: Vec<fleet::FleetLog>,
    seen: Vec<Seen>,
    unknown: BTreeMap<(String, String), usize>,
    left_out: Vec<LeftOut>,
}

impl Gathered {
    fn add(&mut self, own: &LogEvidence) {
        self.seen.push(Seen::of(own));
        let left_out = |why: &str| LeftOut { log: own.log.clone(), why: why.to_owned() };
        if let Some(why) = own.left_out() {
            self.left_out.push(left_out(&why));
            return;
        }
        let keys = own.pieces.iter().flat_map(|piece| &piece.columns).map(|column| &column.key);
        let unknown: BTreeSet<(String, String)> =
            keys.filter(|key| !key.is_known()).map(|key| (key.effect.clone(), key.name.clone())).collect();
        for name in unknown {
            *self.unknown.entry(name).or_insert(0) += 1;
        }
        let axes = own.axes.iter().filter(|axis| !axis.left_out.is_empty());
        self.left_out.extend(axes.map(|axis| left_out(&axis.left_out)));
        self.logs.push(fleet::FleetLog {
            name: own.log.clone(),
            kind: own.kind.clone(),
            part: own.part.clone(),
            day: own.day.map(days),
            labels: own.meta.clone(),
            member: Member::of(&own.pieces),
        });
    }

    fn fleet(self) -> Fleet {
        let Self { logs, seen, unknown, left_out } = self;
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
        let ambiguous = found.ambiguous.into_iter().map(|own| AmbiguousRow {
            separate_by: split_by(&own.effect, &own.aliases),
            kind: own.kind,
            axis: own.axis,
            effect: own.effect,
            aliases: own.aliases,
        });
        Fleet {
            schema: "truerate.fleet/1",
            logs: logs.len(),
            part_count,
            types: found.types.iter().map(type_row).collect(),
            parts: found.parts.iter().map(|own| part_row(own, unit(own))).collect(),
            labels: found.labels.into_iter().map(label_row).collect(),
            faults: faults::of(&seen),
            misaligned: found.tilts.into_iter().map(misaligned_row).collect(),
            ambiguous: ambiguous.collect(),
            not_understood: unknown
                .into_iter()
                .map(|((effect, name), logs)| UnknownRow { effect, name, logs })
                .collect(),
            left_out,
        }
    }
}

impl Fleet {
    /// What this evidence says.
    #[must_use]
    pub fn of(evidence: &Evidence) -> Self {
        let mut gathered = Gathered::default();
        evidence.logs.iter().for_each(|log| gathered.add(log));
        gathered.fleet()
    }

    /// What an evidence file says: of each log no more is held than counts here.
    ///
    /// # Errors
    /// As [`evidence::each`].
    pub fn read(path: &Path) -> Result<Self> {
        let mut gathered = Gathered::default();
        evidence::each(path, |log| gathered.add(&log))?;
        Ok(gathered.fleet())
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
        spread: nested.spread(),
        spread_of_logs: nested.spread_of_logs(),
        next: nested.next(),
        p_value: own.p_value,
        p_of_spread: nested.p_of_spread(),
        p_of_spread_of_logs: nested.p_of_spread_of_logs(),
        matters: own.matters,
        parts: nested.parts,
        logs: nested.logs,
        readings: own.readings.clone(),
    }
}

fn misaligned_row(own: Tilt) -> MisalignedRow {
    let row = |share: &Share| ShareRow {
        mean: share.nested.mean,
        std_error: finite(share.nested.std_error),
        spread: share.nested.spread(),
        spread_of_logs: share.nested.spread_of_logs(),
        p_of_mean: share.nested.p_of_mean(),
        p_value: share.p_value,
    };
    let shows = |share: &Share| share.p_value < SIGNIFICANCE.value;
    MisalignedRow {
        about: own.about(),
        of: match (shows(&own.turned), shows(&own.alike)) {
            (true, true) => Whose::Both,
            (true, false) => Whose::Mount,
            (false, true) => Whose::Chip,
            (false, false) => Whose::Unknown,
        },
        turned: row(&own.turned),
        alike: row(&own.alike),
        parts: own.parts,
        axes: own.axes,
        kind: own.kind,
    }
}

fn label_row(own: OfLabel) -> LabelRow {
    LabelRow {
        kind: own.kind,
        axis: own.key.axis,
        effect: own.key.effect,
        name: own.key.name,
        unit: own.unit,
        labels: own.labels,
        values: own.values,
        spread: own.spread,
        p_value: own.p_value,
    }
}

fn point_row(point: &Point) -> PointRow {
    let Point { day: on, value, std_error, average, limit, sum } = *point;
    PointRow { day: day(on), value, std_error, average, limit, sum }
}

fn part_row(own: &OfPart, unit: String) -> PartRow {
    // Within a day the order of logs is not known.
    let changed = own.changed.iter().filter(|change| change.days > 0.0).map(
        |Dated { day: middle, days, by, std_error, before, after, p_value, with }| ChangedRow {
            day: day(*middle),
            days: *days,
            by: *by,
            std_error: *std_error,
            before: before.0,
            before_error: before.1,
            after: after.0,
            after_error: after.1,
            p_value: *p_value,
            with: with.clone(),
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
        course: own
            .course
            .as_ref()
            .map(|course| CourseRow { level: course.level, points: course.points.iter().map(point_row).collect() }),
        logs: own.logs.clone(),
    }
}
