//! Faults of the data whose owner many logs tell: in most logs of a type they are of its driver, range or register, in all logs of one part and
//! of no other they are that part's.

use crate::evidence::LogEvidence;
use gyro_model::{Axis, fault::FaultKind};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// One kind of fault on one axis of a type.
#[derive(Clone, Debug, Serialize)]
pub struct FaultRow {
    /// The type.
    #[serde(rename = "type")]
    pub kind: String,
    /// The axis.
    pub axis: Axis,
    /// The fault.
    pub fault: String,
    /// The part that alone has it; `null` where it is the type's.
    pub part: Option<String>,
    /// Logs that have it.
    pub logs: usize,
    /// Logs of the type, or of the part.
    pub of_logs: usize,
    /// Parts of the type.
    pub of_parts: usize,
}

/// Logs of a type below which nothing is said of it, of a part, and other parts that have to be without.
const OF_TYPE: usize = 3;
const OF_PART: usize = 2;
const OTHERS: usize = 3;

/// Whether a fault is of the sensor and its driver: not of the motion, the reference, or how the file is written.
fn is_of_the_sensor(name: &str) -> bool {
    let kinds = [
        FaultKind::BurstTimestamps,
        FaultKind::Dropouts,
        FaultKind::HeldSamples,
        FaultKind::Markers,
        FaultKind::NonFinite,
        FaultKind::Outliers,
        FaultKind::RepeatedSamples,
        FaultKind::StuckChannel,
        FaultKind::SwappedAxes,
        FaultKind::TimeGoingBack,
        FaultKind::TimerOverflow,
        FaultKind::TimestampJitter,
        FaultKind::TornReadings,
        FaultKind::Wrapped,
        FaultKind::WrongRatio,
        FaultKind::WrongSign,
        FaultKind::WrongUnit,
    ];
    kinds.iter().any(|kind| kind.name() == name)
}

/// The faults of one log, axis by axis.
pub(super) struct Seen {
    kind: String,
    part: String,
    axes: Vec<(Axis, BTreeSet<String>)>,
}

impl Seen {
    pub(super) fn of(log: &LogEvidence) -> Self {
        let axes = log
            .axes
            .iter()
            .map(|axis| (axis.axis, axis.faults.keys().filter(|name| is_of_the_sensor(name)).cloned().collect()));
        Self { kind: log.kind.clone(), part: log.part.clone(), axes: axes.collect() }
    }
}

/// A log and its faults on one axis.
type OnAxis<'a> = (&'a Seen, &'a BTreeSet<String>);

/// Those of a fleet.
pub(super) fn of(seen: &[Seen]) -> Vec<FaultRow> {
    let mut kinds: BTreeMap<(&str, Axis), Vec<OnAxis>> = BTreeMap::new();
    for log in seen {
        for (axis, own) in &log.axes {
            kinds.entry((&log.kind, *axis)).or_default().push((log, own));
        }
    }
    let mut all = Vec::new();
    for ((kind, axis), logs) in kinds {
        let parts: BTreeSet<&str> = logs.iter().map(|(log, _)| log.part.as_str()).collect();
        let names: BTreeSet<&str> = logs.iter().flat_map(|(_, own)| own.iter().map(String::as_str)).collect();
        for name in names {
            let with: Vec<&str> =
                logs.iter().filter(|(_, own)| own.contains(name)).map(|(log, _)| log.part.as_str()).collect();
            let owners: BTreeSet<&str> = with.iter().copied().collect();
            let row = |part: Option<&str>, of_logs: usize| FaultRow {
                kind: kind.to_owned(),
                axis,
                fault: name.to_owned(),
                part: part.map(str::to_owned),
                logs: with.len(),
                of_logs,
                of_parts: parts.len(),
            };
            let of_part = |part: &str| logs.iter().filter(|(log, _)| log.part == part).count();
            if with.len() >= OF_TYPE && 2 * with.len() > logs.len() && (owners.len() > 1 || parts.len() == 1) {
                all.push(row(None, logs.len()));
            } else if let Some(part) = owners.first().filter(|_| owners.len() == 1)
                && with.len() >= OF_PART
                && with.len() == of_part(part)
                && parts.len() > OTHERS
            {
                all.push(row(Some(part), of_part(part)));
            }
        }
    }
    all
}
