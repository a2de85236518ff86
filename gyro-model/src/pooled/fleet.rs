//! A fleet: types of sensors, the parts of each, the logs of each part.
//!
//! Type by type and axis by axis, effects join one after the other. A candidate's estimate of each log is made with everything that joined
//! before it free in that log, so that what an alias explains is not counted twice. The estimates of all logs go into the mixed model of
//! [`super::spread`], which is asked four things: has the type a mean of it, do its parts differ in it, has one part alone it, and, of what
//! a single log named, do the logs of a part differ in it. Each answer is priced for the search: four questions, every column, every axis.
//! What single logs named comes first: they know its shape, which no linear equation does.

use super::{
    Key,
    course::{Course, course},
    forward::{Answer, Joined, select},
    labels::by_label,
    mount::{Tilt, tilts},
    search::{Member, base, candidates},
    spread::{Change, Nested, Reading, Scatter, change, discoveries, scatter},
};
use crate::{Axis, effects, thresholds as limit};
use itertools::Itertools;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// One log of a fleet.
#[derive(Clone, Debug)]
pub struct FleetLog {
    /// Its name.
    pub name: String,
    /// The type of its sensor.
    pub kind: String,
    /// Its part, within the type.
    pub part: String,
    /// When it was recorded, days since any origin.
    pub day: Option<f64>,
    /// What else was said of it: a driver's version, a lot, a mount.
    pub labels: BTreeMap<String, String>,
    /// Its equations.
    pub member: Member,
}

/// What a type has.
#[derive(Clone, Debug)]
pub struct OfType {
    /// The type.
    pub kind: String,
    /// The parameter.
    pub key: Key,
    /// Its unit.
    pub unit: String,
    /// Mean and spreads, outliers left out.
    pub nested: Nested,
    /// Chance of it where the type has none of it, priced for the search.
    pub p_value: f64,
    /// Whether it raises the error over the floor by a twentieth.
    pub matters: bool,
    /// Log by log.
    pub readings: Vec<OfLog>,
}

/// What one log says of one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct OfLog {
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

/// What one part has.
#[derive(Clone, Debug)]
pub struct OfPart {
    /// The type.
    pub kind: String,
    /// The part.
    pub part: String,
    /// The parameter.
    pub key: Key,
    /// Best prediction; an outlier's own mean; of a part that changed, what it has since then.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Chance that a part of the type is as far off; `None` where there are too few others.
    pub p_value: Option<f64>,
    /// Whether it is not of its type, at a false discovery rate of 5 %.
    pub outlier: bool,
    /// Its logs.
    pub logs: Vec<String>,
    /// When it changed.
    pub changed: Option<Dated>,
    /// Its charts in time, of four dated logs or more.
    pub course: Option<Course>,
}

/// A change in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Dated {
    /// In the middle of the interval in which it lies, days.
    pub day: f64,
    /// Half of that interval, days.
    pub days: f64,
    /// By how much.
    pub by: f64,
    /// Standard error of that.
    pub std_error: f64,
    /// What the part had before it, with the standard error.
    pub before: (f64, f64),
    /// What it has after it, with the standard error.
    pub after: (f64, f64),
    /// Chance of it, priced for all parts and effects.
    pub p_value: f64,
    /// What was said of the logs that changed there too.
    pub with: Vec<Switched>,
}

/// A label that has one value before a change and another after it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Switched {
    /// The label.
    pub label: String,
    /// Its value before.
    pub from: String,
    /// Its value after.
    pub to: String,
}

/// A parameter that goes by a label.
#[derive(Clone, Debug)]
pub struct OfLabel {
    /// The type.
    pub kind: String,
    /// The parameter.
    pub key: Key,
    /// Its unit.
    pub unit: String,
    /// The label, and those that part the logs in the same way.
    pub labels: Vec<String>,
    /// Value by value of the first.
    pub values: Vec<OfValue>,
    /// Standard deviation between the values, of three or more.
    pub spread: Option<f64>,
    /// Chance of such differences where there are none, priced for all labels and parameters.
    pub p_value: f64,
}

/// What the logs with one value of a label have.
#[derive(Clone, Debug, Serialize)]
pub struct OfValue {
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

/// Effects that a fleet cannot tell apart.
#[derive(Clone, Debug)]
pub struct Alike {
    /// The type.
    pub kind: String,
    /// The axis.
    pub axis: Axis,
    /// The effect that was taken.
    pub effect: String,
    /// What it cannot be told from.
    pub aliases: Vec<String>,
}

/// Everything that a fleet says.
#[derive(Clone, Debug, Default)]
pub struct Fleet {
    /// Of the types, type by type and axis by axis.
    pub types: Vec<OfType>,
    /// Of the parts, outliers first.
    pub parts: Vec<OfPart>,
    /// What goes by a label, the clearest first.
    pub labels: Vec<OfLabel>,
    /// What two axes of a type feel of each other, and whose it is.
    pub tilts: Vec<Tilt>,
    /// What cannot be told apart.
    pub ambiguous: Vec<Alike>,
}

/// False discovery rate of outliers.
const FALSE: f64 = 0.05;
/// Growth of J that counts: a twentieth of the error over the floor.
const MATTERS: f64 = 0.1025;
/// Questions that are asked of each column.
const QUESTIONS: f64 = 4.0;

/// What these logs say.
#[must_use]
pub fn fleet(logs: &[FleetLog]) -> Fleet {
    let mut kinds: BTreeMap<&str, Vec<&FleetLog>> = BTreeMap::new();
    for log in logs {
        kinds.entry(&log.kind).or_default().push(log);
    }
    let mut all = Fleet::default();
    for own in kinds.into_values().map(Kind::new) {
        let axes: BTreeSet<Axis> = own.logs.iter().flat_map(|log| log.member.axes().to_vec()).collect();
        let mut found: Vec<Found> = Vec::new();
        for axis in &axes {
            found.extend(on_axis(&own, *axis, axes.len(), &mut all.ambiguous));
        }
        let members: Vec<(usize, &Member)> =
            own.parts.iter().copied().zip(own.logs.iter().map(|log| &log.member)).collect();
        let chosen: BTreeSet<Key> = found.iter().map(|one| one.key.clone()).collect();
        all.tilts.extend(tilts(own.label(), &own.names, &members, &chosen));
        tell(&own, found, &mut all);
    }
    all.labels.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    all.parts.sort_by(|a, b| {
        let rank = |p: &OfPart| (!p.outlier, p.changed.is_none());
        rank(a).cmp(&rank(b)).then(a.p_value.unwrap_or(1.0).total_cmp(&b.p_value.unwrap_or(1.0)))
    });
    all
}

/// One parameter that stays, with the readings of it.
struct Found {
    key: Key,
    readings: Vec<Reading>,
    /// Which log each reading is of.
    of: Vec<usize>,
    /// What its chance is multiplied by.
    price: f64,
}

/// The logs of one type, of which there is one at least.
struct Kind<'l> {
    logs: Vec<&'l FleetLog>,
    /// The names of the parts, in order.
    names: Vec<String>,
    /// Which of them each log is of.
    parts: Vec<usize>,
}

impl<'l> Kind<'l> {
    fn new(logs: Vec<&'l FleetLog>) -> Self {
        let numbers: BTreeMap<&String, usize> =
            logs.iter().map(|log| &log.part).collect::<BTreeSet<_>>().into_iter().zip(0..).collect();
        let parts = logs.iter().map(|log| numbers[&log.part]).collect();
        let names = numbers.into_keys().cloned().collect();
        Self { logs, names, parts }
    }

    fn label(&self) -> &'l str {
        &self.logs[0].kind
    }

    /// What each log says of a parameter, these others being free in it, and which log that is. The value is that over nothing: of a factor
    /// less one.
    fn readings(&self, key: &Key, beside: &BTreeSet<Key>) -> (Vec<Reading>, Vec<usize>) {
        let neutral = neutral(key);
        let told = self.logs.iter().zip(&self.parts).enumerate().filter_map(|(k, (log, &part))| {
            let (value, variance) = log.member.told(key, beside)?;
            Some((Reading { part, value: value - neutral, variance }, k))
        });
        told.unzip()
    }
}

fn neutral(key: &Key) -> f64 {
    key.card().map_or(0.0, |card| if card.neutral.is_finite() && key.name != "share" { card.neutral } else { 0.0 })
}

/// Asks the questions of a group of parameters.
fn ask(kind: &Kind, keys: &[Key], chosen: &BTreeSet<Key>, price: f64) -> Option<Answer> {
    let mut best: Option<Answer> = None;
    for key in keys {
        let beside: BTreeSet<Key> = chosen.iter().chain(keys).filter(|other| *other != key).cloned().collect();
        let (readings, _) = kind.readings(key, &beside);
        let Some(nested) = Nested::fit(&readings) else { continue };
        let one = outliers(&readings).into_iter().fold(1.0, f64::min) * nested.parts as f64;
        let named = kind.logs.iter().any(|log| log.member.has(key));
        let of_logs = if named { nested.p_of_spread_of_logs() } else { 1.0 };
        let p = nested.p_of_mean().min(nested.p_of_spread()).min(one).min(of_logs);
        let p = p * QUESTIONS * keys.len() as f64 * price;
        let mut by_part: BTreeMap<usize, Vec<Reading>> = BTreeMap::new();
        for own in &readings {
            by_part.entry(own.part).or_default().push(*own);
        }
        let each = by_part.into_iter().map(|(part, own)| (part, nested.gain_of_part(&own)));
        let asked = Answer { p_value: p.min(1.0), gain: nested.gain, each: each.collect(), held_out: f64::INFINITY };
        if best.as_ref().is_none_or(|best| (asked.p_value, -asked.gain) < (best.p_value, -best.gain)) {
            best = Some(asked);
        }
    }
    best
}

/// Chance of each part, the others being the type; 1 where they are too few. The spreads are found anew without it where that matters: of
/// few parts, and of one that lies far off beside them all.
fn outliers(readings: &[Reading]) -> Vec<f64> {
    let mut by_part: BTreeMap<usize, Vec<Reading>> = BTreeMap::new();
    for own in readings {
        by_part.entry(own.part).or_default().push(*own);
    }
    let mut chances = vec![1.0; by_part.last_key_value().map_or(0, |(part, _)| part + 1)];
    let Some(all) = Nested::fit(readings).filter(|all| all.parts > OTHERS) else { return chances };
    for (part, own) in &by_part {
        let beside = all.beside(own);
        let moves = beside.z_of_part(own).powi(4) > MOVES * all.parts as f64;
        let exact = || {
            let others: Vec<Reading> = readings.iter().filter(|r| r.part != *part).copied().collect();
            Nested::fit(&others).map_or(1.0, |others| others.p_of_part(own))
        };
        chances[*part] = if all.parts <= MANY || moves { exact() } else { beside.p_of_part(own) };
    }
    chances
}

/// Other parts that are needed to tell an outlier.
const OTHERS: usize = 3;
/// Parts up to which each of them moves the spreads.
const MANY: usize = 30;
/// A part z standard errors off makes the variance between n parts larger by its share z²/n, and ln of its own chance by z⁴/2n: it is
/// told from the others alone where that is more than a tenth.
const MOVES: f64 = 0.2;

fn on_axis(kind: &Kind, axis: Axis, axes: usize, ambiguous: &mut Vec<Alike>) -> Vec<Found> {
    let left = candidates(kind.logs.iter().map(|log| &log.member), axis);
    let price = (left.len() * axes) as f64;
    let is_named = |key: &Key| kind.logs.iter().any(|log| log.member.has(key));
    let (chosen, joined) = select(left, base(axis), is_named, |keys, chosen| ask(kind, keys, chosen, price));
    let unsplit = joined.into_iter().filter(|joined| !joined.aliases.is_empty());
    ambiguous.extend(unsplit.map(|Joined { keys, aliases }| Alike {
        kind: kind.label().to_owned(),
        axis,
        effect: keys[0].effect.clone(),
        aliases,
    }));
    let own = chosen.iter().map(|key| {
        let beside: BTreeSet<Key> = chosen.iter().filter(|other| *other != key).cloned().collect();
        let (readings, of) = kind.readings(key, &beside);
        let price = if base(axis).contains(key) { 1.0 } else { price };
        Found { key: key.clone(), readings, of, price }
    });
    own.collect()
}

fn tell(kind: &Kind, found: Vec<Found>, all: &mut Fleet) {
    let Kind { logs, names, .. } = kind;
    let chances: Vec<Vec<f64>> = found.iter().map(|own| outliers(&own.readings)).collect();
    let mut refused = discoveries(&chances.concat(), FALSE).into_iter();
    let tested = found.len() * names.len();
    let partings = partings(logs);
    let asked = (partings.len() * found.len()) as f64;
    for (own, chances) in found.into_iter().zip(chances) {
        let is_outlier: Vec<bool> = chances.iter().map(|_| refused.next().unwrap_or(false)).collect();
        let kept: Vec<Reading> = own.readings.iter().filter(|r| !is_outlier[r.part]).copied().collect();
        let Some(nested) = Nested::fit(&kept) else { continue };
        let neutral = neutral(&own.key);
        let shows: Vec<f64> = own.of.iter().filter_map(|&k| logs[k].member.shows(&own.key)).collect();
        let shown = crate::order::median(shows).unwrap_or(0.0);
        let size = nested.mean.powi(2) + nested.between + nested.within;
        let mut by_part: Vec<Vec<usize>> = vec![Vec::new(); names.len()];
        for (k, reading) in own.readings.iter().enumerate() {
            by_part[reading.part].push(k);
        }
        let dated = |part: usize| -> Vec<OnDay> {
            let mut dated: Vec<OnDay> = by_part[part]
                .iter()
                .filter_map(|&k| {
                    let (Reading { value, variance, .. }, log) = (own.readings[k], logs[own.of[k]]);
                    Some(OnDay { day: log.day?, value, variance, labels: &log.labels })
                })
                .collect();
            dated.sort_by(|a, b| a.day.total_cmp(&b.day));
            dated
        };
        let in_order = |part: usize| dated(part).iter().map(|own| (own.value, own.variance)).collect();
        let beyond = scatter(&(0..names.len()).map(in_order).collect::<Vec<_>>());
        for (part, name) in names.iter().enumerate() {
            let mine = &by_part[part];
            if mine.is_empty() {
                continue;
            }
            let readings: Vec<Reading> = mine.iter().map(|&k| own.readings[k]).collect();
            let outlier = is_outlier[part];
            let (value, std_error) = if outlier {
                let (value, variance) = nested.of_part(&readings);
                (value, variance.sqrt())
            } else {
                nested.predicted(&readings)
            };
            let (changed, course) = in_time(&dated(part), beyond, tested);
            let (value, std_error) = changed.as_ref().map_or((value, std_error), |changed| changed.after);
            let changed = changed.map(|changed| changed.above(neutral));
            let course = course.map(|course| course.above(neutral));
            all.parts.push(OfPart {
                kind: kind.label().to_owned(),
                part: name.clone(),
                key: own.key.clone(),
                value: value + neutral,
                std_error,
                p_value: Some(chances[part]).filter(|p| *p < 1.0),
                outlier,
                logs: mine.iter().map(|&k| logs[own.of[k]].name.clone()).collect(),
                changed,
                course,
            });
        }
        let unit = logs.iter().flat_map(|log| log.member.columns()).find(|c| c.key == own.key).map(|c| c.unit.clone());
        let unit = unit.unwrap_or_default();
        for parting in &partings {
            let found = parting.ask(&own, &is_outlier, asked);
            all.labels.extend(found.map(|(values, spread, p_value)| OfLabel {
                spread,
                kind: kind.label().to_owned(),
                key: own.key.clone(),
                unit: unit.clone(),
                labels: parting.labels.clone(),
                values: values.into_iter().map(|own| OfValue { mean: own.mean + neutral, ..own }).collect(),
                p_value,
            }));
        }
        let readings = own.readings.iter().zip(&own.of).map(|(r, &k)| OfLog {
            log: logs[k].name.clone(),
            part: names[r.part].clone(),
            value: r.value + neutral,
            std_error: r.variance.sqrt(),
            outlier: is_outlier[r.part],
        });
        all.types.push(OfType {
            kind: kind.label().to_owned(),
            unit,
            p_value: (nested.p_of_mean() * own.price).min(1.0),
            matters: shown * size > MATTERS,
            readings: readings.collect(),
            nested: Nested { mean: nested.mean + neutral, ..nested },
            key: own.key,
        });
    }
}

/// One way to part a type's logs by what was said of them.
struct Parting {
    /// The labels that part them so.
    labels: Vec<String>,
    /// The first one's values.
    values: Vec<String>,
    /// Which of them each log has; `None` where nothing was said.
    of: Vec<Option<usize>>,
}

/// Values of a label at most: more are names of single logs or parts.
const VALUES: usize = 24;

/// Every way to part these logs by a label of a few values, each of two logs or more.
fn partings(logs: &[&FleetLog]) -> Vec<Parting> {
    let names: BTreeSet<&String> = logs.iter().flat_map(|log| log.labels.keys()).collect();
    let mut all: Vec<Parting> = Vec::new();
    for name in names.into_iter().filter(|name| *name != "day") {
        let mut many: BTreeMap<&String, usize> = BTreeMap::new();
        for value in logs.iter().filter_map(|log| log.labels.get(name)).filter(|value| !value.is_empty()) {
            *many.entry(value).or_insert(0) += 1;
        }
        let values: Vec<&String> = many.iter().filter(|(_, logs)| **logs > 1).map(|(value, _)| *value).collect();
        if !(2..=VALUES).contains(&values.len()) {
            continue;
        }
        let of: Vec<Option<usize>> =
            logs.iter().map(|log| values.iter().position(|value| log.labels.get(name) == Some(*value))).collect();
        match all.iter_mut().find(|own| is_alike(&own.of, &of)) {
            Some(own) => own.labels.push(name.clone()),
            None => all.push(Parting { labels: vec![name.clone()], values: values.into_iter().cloned().collect(), of }),
        }
    }
    all
}

/// Whether two labels part the logs in the same way, whatever their values are called.
fn is_alike(a: &[Option<usize>], b: &[Option<usize>]) -> bool {
    let pairs: BTreeSet<_> = a.iter().zip(b).collect();
    let (first, second): (BTreeSet<_>, BTreeSet<_>) = (a.iter().collect(), b.iter().collect());
    pairs.len() == first.len() && pairs.len() == second.len()
}

impl Parting {
    /// The means by this label, where they differ more than chance makes them; outliers are left out.
    fn ask(&self, own: &Found, is_outlier: &[bool], asked: f64) -> Option<(Vec<OfValue>, Option<f64>, f64)> {
        let told = own.readings.iter().zip(&own.of).filter(|(r, _)| !is_outlier[r.part]);
        let (readings, labels): (Vec<Reading>, Vec<usize>) =
            told.filter_map(|(r, &k)| self.of[k].map(|label| (*r, label))).unzip();
        let found = by_label(&readings, &labels, self.values.len())?;
        let p_value = (found.p_value * asked).min(1.0);
        if p_value >= limit::SIGNIFICANCE.value {
            return None;
        }
        let values = self.values.iter().enumerate().map(|(label, value)| {
            let mine = || readings.iter().zip(&labels).filter(move |(_, own)| **own == label);
            let parts: BTreeSet<usize> = mine().map(|(r, _)| r.part).collect();
            let (mean, std_error) = found.means[label];
            OfValue { value: value.clone(), mean, std_error, parts: parts.len(), logs: mine().count() }
        });
        Some((values.collect(), spread_of(&found.means), p_value))
    }
}

/// Standard deviation between the means of a label's values: a spread of lots, of mounts. Two tell none.
fn spread_of(means: &[(f64, f64)]) -> Option<f64> {
    let each =
        means.iter().enumerate().map(|(part, (value, error))| Reading { part, value: *value, variance: error * error });
    let each: Vec<Reading> = each.collect();
    Nested::fit(&each).filter(|_| means.len() > 2)?.spread()
}

/// What one log says of a parameter, and when.
struct OnDay<'a> {
    day: f64,
    value: f64,
    variance: f64,
    labels: &'a BTreeMap<String, String>,
}

/// Logs of a part below which nothing is said of its course.
const FEWEST: usize = 4;

impl Dated {
    /// The same of values that are counted from elsewhere.
    fn above(self, neutral: f64) -> Self {
        let above = |(value, error): (f64, f64)| (value + neutral, error);
        Self { before: above(self.before), after: above(self.after), ..self }
    }
}

/// The change of one part in time, where there is one, and its charts; `dated` in the order of time. How far its logs scatter beyond their
/// errors is what the parts of the type say together: one part's few logs do not know it.
fn in_time(dated: &[OnDay], beyond: Scatter, tested: usize) -> (Option<Dated>, Option<Course>) {
    if dated.len() < FEWEST {
        return (None, None);
    }
    let readings: Vec<(f64, f64)> = dated.iter().map(|own| (own.value, own.variance + beyond.variance)).collect();
    let is_sure = |found: &Change| found.p_value * (tested as f64) < limit::SIGNIFICANCE.value;
    let found = change(&readings, beyond.freedom).filter(is_sure);
    let on_days: Vec<(f64, f64, f64)> = dated.iter().map(|own| (own.day, own.value, own.variance)).collect();
    let course = course(&on_days, beyond.variance, found.map_or(dated.len(), |found| found.after));
    let changed = found.map(|Change { after, from, to, by, std_error, p_value }| {
        let (first, last) = (dated[from - 1].day, dated[to].day);
        Dated {
            day: 0.5 * (first + last),
            days: 0.5 * (last - first),
            by,
            std_error,
            before: level(&readings[..after]),
            after: level(&readings[after..]),
            p_value: p_value * tested as f64,
            with: switched(dated, after),
        }
    });
    (changed, Some(course))
}

/// The mean of readings with known variances, and its standard error.
fn level(readings: &[(f64, f64)]) -> (f64, f64) {
    let weight: f64 = readings.iter().map(|(_, variance)| 1.0 / variance).sum();
    (readings.iter().map(|(value, variance)| value / variance).sum::<f64>() / weight, weight.powf(-0.5))
}

/// The labels that have one value in all readings before this one, and another in all from it on.
fn switched(dated: &[OnDay], after: usize) -> Vec<Switched> {
    let of = |own: &[OnDay], name: &str| -> Option<String> {
        let values: BTreeSet<Option<&String>> = own.iter().map(|own| own.labels.get(name)).collect();
        values.into_iter().exactly_one().ok().flatten().cloned()
    };
    let names: BTreeSet<&String> = dated.iter().flat_map(|own| own.labels.keys()).collect();
    let told = names.into_iter().filter(|name| *name != "day").filter_map(|name| {
        let (from, to) = (of(&dated[..after], name)?, of(&dated[after..], name)?);
        (from != to).then(|| Switched { label: name.clone(), from, to })
    });
    told.collect()
}

/// Whether an effect of this id belongs to the base model.
#[must_use]
pub fn is_base(id: &str) -> bool {
    effects::find(id).is_some_and(|effect| effect.stage() == effects::Stage::Calibration)
}
