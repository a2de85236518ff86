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
use crate::{Record, fault::FaultKind};

/// Takes spikes of gyro, reference and temperature out, and reports them.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for channel in Channel::all() {
        let readings = Readings::of(record, channel);
        let Some(mut neighbours) = Neighbours::new(&readings) else { continue };
        let found = neighbours.apart(RECURRING);
        if found.len() as f64 > MOST_SPIKES * readings.values.len() as f64 {
            continue;
        }
        let (noise, step) = (neighbours.noise, super::quantum(&readings.values));
        let torn = matches!(channel, Channel::Gyro(_)).then(|| torn::recurring(&found, noise, step)).flatten();
        let mut others = found;
        if let Some(size) = torn {
            // Of a size that is known, smaller signs will do.
            others.extend(neighbours.apart(KNOWN_SIZE));
            others.sort_by_key(|apart| apart.index);
            let of_one_size: Vec<Apart>;
            (of_one_size, others) = others.into_iter().partition(|apart| torn::is_of(apart.size, size, noise));
            take_out(
                record,
                report,
                channel,
                &readings,
                &of_one_size,
                FaultKind::TornReadings,
                &torn::says(channel, size, step),
            );
        }
        let spikes: Vec<Apart> = others.into_iter().filter(|apart| apart.times > SPIKE).collect();
        let largest = spikes.iter().map(|apart| apart.size.abs()).fold(0.0, f64::max);
        let says = format!(
            "far from those around them, by up to {}, where noise makes {}: left out. Look for a loose wire or errors on the bus",
            channel.says(largest),
            channel.says(noise)
        );
        take_out(record, report, channel, &readings, &spikes, FaultKind::Outliers, &says);
    }
}

/// Makes readings "no value", and says so.
fn take_out(
    record: &mut Record,
    report: &mut Report,
    channel: Channel,
    readings: &Readings,
    found: &[Apart],
    fault: FaultKind,
    says: &str,
) {
    let Some(first) = found.first() else { return };
    for apart in found {
        let row = readings.rows[apart.index];
        *channel.place(&mut record.rows[row]) = f64::NAN;
        report.mark(row);
    }
    let says = format!("{}: {} {says}", channel.name(), counted(found.len(), "single reading"));
    report.add_for(channel.axis(), fault, found.len() as u64, Some(readings.t[first.index]), says);
}
