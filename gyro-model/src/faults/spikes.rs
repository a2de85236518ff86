//! Single readings, or two, far from those on both sides: by far more than the log's noise, whatever the size of its motion.
//! Where they lie apart by one size again and again they are torn ([`super::torn`]).

use super::{
    Report,
    channel::{Channel, Readings},
    counted,
    neighbours::{Apart, Neighbours},
    thresholds::{KNOWN_SIZE, MOST_SPIKES, RECURRING, SPIKE},
    torn,
};
use crate::{Record, fault::FaultKind, parallel};

/// Takes spikes of gyro, reference and temperature out, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let channels: Vec<Channel> = Channel::all().collect();
    let found = parallel::map(&channels, |channel| found(record, *channel));
    for (channel, found) in channels.into_iter().zip(found) {
        for found in found {
            take_out(record, report, channel, &found);
        }
    }
}

/// Readings of one channel that are none for one reason.
struct Found {
    rows: Vec<usize>,
    first_t: Option<f64>,
    fault: FaultKind,
    says: String,
}

impl Found {
    fn new(readings: &Readings, apart: &[Apart], fault: FaultKind, says: String) -> Self {
        let rows = apart.iter().map(|apart| readings.rows[apart.index]).collect();
        Self { rows, first_t: apart.first().map(|first| readings.t[first.index]), fault, says }
    }
}

/// The torn ones of a channel, and the other spikes.
fn found(record: &Record, channel: Channel) -> Vec<Found> {
    let readings = Readings::of(record, channel);
    let Some(mut neighbours) = Neighbours::new(&readings) else { return Vec::new() };
    let mut others = neighbours.apart(RECURRING);
    if others.len() as f64 > MOST_SPIKES * readings.values.len() as f64 {
        return Vec::new();
    }
    let mut found = Vec::new();
    let (noise, step) = (neighbours.noise, super::quantum(&readings.values));
    let torn = matches!(channel, Channel::Gyro(_)).then(|| torn::recurring(&others, noise, step)).flatten();
    if let Some(size) = torn {
        // Of a size that is known, smaller signs will do.
        others.extend(neighbours.apart(KNOWN_SIZE));
        others.sort_by_key(|apart| apart.index);
        let of_one_size: Vec<Apart>;
        (of_one_size, others) = others.into_iter().partition(|apart| torn::is_of(apart.size, size, noise));
        let says = torn::says(channel, size, step);
        found.push(Found::new(&readings, &of_one_size, FaultKind::TornReadings, says));
    }
    let spikes: Vec<Apart> = others.into_iter().filter(|apart| apart.times > SPIKE).collect();
    let largest = spikes.iter().map(|apart| apart.size.abs()).fold(0.0, f64::max);
    let says = format!(
        "far from those around them, by up to {}, where noise makes {}: left out. Look for a loose wire or errors on the bus",
        channel.says(largest),
        channel.says(noise)
    );
    found.push(Found::new(&readings, &spikes, FaultKind::Outliers, says));
    found
}

/// Makes readings "no value", and says so.
fn take_out(record: &mut Record, report: &mut Report, channel: Channel, found: &Found) {
    if found.rows.is_empty() {
        return;
    }
    for &row in &found.rows {
        *channel.place(&mut record.rows[row]) = f64::NAN;
        report.mark(row);
    }
    let says = format!("{}: {} {}", channel.name(), counted(found.rows.len(), "single reading"), found.says);
    report.add_for(channel.axis(), found.fault, found.rows.len() as u64, found.first_t, says);
}
