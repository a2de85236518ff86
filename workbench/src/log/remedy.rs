//! Maps that put right what makes a log worthless: another unit, order, sign or axis. Each was tried on the log.

use super::{
    Options, Reader,
    header::Column,
    map::MapFlag,
    unit::{self, Channel, Name},
    whole,
};
use gyro_model::{
    Axis, Record,
    fault::{DataFault, FaultKind},
    faults::{self, Meant},
};
use log_readers::meaning::{PARTS, Pick};
use std::path::Path;

/// So many faults are put right one after the other.
const MOST: usize = 6;

/// The maps with which a log has none of the faults that make it worthless; `None` where it has none, or none were found.
#[must_use]
pub fn remedy(path: &Path, options: &Options, record: &Record, faults: &[DataFault]) -> Option<Vec<String>> {
    if path == Path::new("-") || options.columns.is_some() || fatal(record, faults).is_empty() {
        return None;
    }
    let mut options = Options { advises: false, needs_reference: false, ..options.clone() };
    let (mut record, mut faults) = (record.clone(), faults.to_vec());
    for _ in 0..MOST {
        let left = fatal(&record, &faults);
        let Some(fault) = left.first() else { return Some(options.map) };
        let reader = Reader::open(path, &options).ok()?;
        let mut tried = candidates(fault, &record, &reader.layout().columns).into_iter().filter_map(|picks| {
            let options = Options { map: with(&options.map, &picks), ..options.clone() };
            let (record, faults, _) = whole::read(path, &options).ok()?;
            (fatal(&record, &faults).len() < left.len()).then_some((options, record, faults))
        });
        (options, record, faults) = tried.next()?;
    }
    fatal(&record, &faults).is_empty().then_some(options.map)
}

fn fatal<'a>(record: &Record, faults: &'a [DataFault]) -> Vec<&'a DataFault> {
    faults.iter().filter(|fault| fault.is_fatal(record.len())).collect()
}

/// These maps with others in place of those of the same channels.
fn with(maps: &[String], picks: &[Pick]) -> Vec<String> {
    let channel = |name: &str| if let Name::Known(channel, _) = unit::name(name) { Some(channel) } else { None };
    let named: Vec<Option<Channel>> = picks.iter().map(|pick| channel(&pick.name)).collect();
    let is_kept = |text: &&String| {
        MapFlag::parse(text).is_ok_and(|flag| {
            let is_orientation = flag.is_of_orientation() && named.contains(&Some(Channel::Quaternion(0)));
            !is_orientation && !named.contains(&channel(flag.name()))
        })
    };
    maps.iter().filter(is_kept).cloned().chain(picks.iter().map(ToString::to_string)).collect()
}

/// Maps that may put a fault right, the likeliest first.
fn candidates(fault: &DataFault, record: &Record, columns: &[Column]) -> Vec<Vec<Pick>> {
    let of = |is: &dyn Fn(Channel) -> bool| columns.iter().filter(|column| is(column.channel)).collect::<Vec<_>>();
    let gyros = || of(&|channel| matches!(channel, Channel::Gyro(_)));
    let in_unit = |columns: &[&Column], suffix: &str| -> Vec<Pick> {
        columns.iter().filter_map(|column| named(column, &format!("{}{suffix}", base(column.channel)?))).collect()
    };
    let all = match (fault.kind, fault.axis) {
        (FaultKind::WrongUnit, Some(axis)) => {
            let (angles, rates) = (of(&|c| c == Channel::RefAngle(axis)), of(&|c| c == Channel::RefRate(axis)));
            let gyro = in_unit(&gyros(), "_dps");
            let reference = [in_unit(&angles, "_deg"), in_unit(&rates, "_dps")].concat();
            vec![gyro.clone(), reference.clone(), [gyro, reference].concat()]
        }
        (FaultKind::WrongUnit, None) => {
            let of_all = |is: fn(Channel) -> bool, suffixes: &[&str]| -> Vec<Vec<Pick>> {
                suffixes.iter().map(|suffix| in_unit(&of(&is), suffix)).collect()
            };
            [
                of_all(|c| c == Channel::Time, &["_ms", "_us", "_ns", ""]),
                of_all(|c| matches!(c, Channel::Accel(_)), &["_g", "_mg"]),
                of_all(|c| c == Channel::Temperature, &["_k"]),
                of_all(|c| c == Channel::Supply, &["_mv"]),
            ]
            .concat()
        }
        (FaultKind::WrongSign, Some(axis)) => {
            let reference = of(&|c| matches!(c, Channel::RefAngle(a) | Channel::RefRate(a) if a == axis));
            vec![reference.iter().filter_map(|column| signed(column, &base(column.channel)?, -1.0)).collect()]
        }
        (FaultKind::SwappedAxes, Some(axis)) => {
            let Some((other, slope)) = faults::followed(record, axis) else { return Vec::new() };
            let reference = of(&|c| matches!(c, Channel::RefAngle(a) | Channel::RefRate(a) if a == axis));
            let renamed = |column: &&Column| {
                let channel = match column.channel {
                    Channel::RefRate(_) => Channel::RefRate(other),
                    _ => Channel::RefAngle(other),
                };
                signed(column, &base(channel)?, slope.signum())
            };
            vec![reference.iter().filter_map(renamed).collect()]
        }
        (FaultKind::SwappedAxes, None) => {
            vec![faults::meant(record).map_or_else(Vec::new, |meant| turned(meant, columns))]
        }
        _ => Vec::new(),
    };
    all.into_iter().filter(|picks| !picks.is_empty()).collect()
}

/// The columns of an orientation, or of the sensor's own axes, as they are meant.
fn turned(meant: Meant, columns: &[Column]) -> Vec<Pick> {
    let column = |channel: Channel| columns.iter().find(|column| column.channel == channel);
    match meant {
        Meant::Parts(parts) => (parts.iter().zip(PARTS))
            .filter_map(|((part, sign), name)| {
                signed(column(Channel::Quaternion(*part))?, &format!("ref_q{name}"), *sign)
            })
            .collect(),
        // What the chip has beside the gyro is turned with it.
        Meant::Axes(axes) => [Channel::Gyro as fn(Axis) -> Channel, Channel::Accel]
            .into_iter()
            .filter(|of| Axis::ALL.iter().all(|&axis| column(of(axis)).is_some()))
            .flat_map(|of| {
                (Axis::ALL.into_iter().zip(axes)).map(move |(axis, (from, sign))| (of(axis), of(Axis::ALL[from]), sign))
            })
            .filter_map(|(to, from, sign)| signed(column(from)?, &base(to)?, sign))
            .collect(),
    }
}

/// The name of a channel, without a unit.
fn base(channel: Channel) -> Option<String> {
    Some(match channel {
        Channel::Time => "t".to_owned(),
        Channel::Gyro(axis) => format!("gyro_{axis}"),
        Channel::RefAngle(axis) => format!("ref_angle_{axis}"),
        Channel::RefRate(axis) => format!("ref_rate_{axis}"),
        Channel::Quaternion(part) => format!("ref_q{}", PARTS.get(part)?),
        Channel::Accel(axis) => format!("accel_{axis}"),
        Channel::Temperature => "temp".to_owned(),
        Channel::Supply => "supply".to_owned(),
        Channel::Euler(_) | Channel::Matrix(_) | Channel::Free(_) | Channel::Unused => return None,
    })
}

/// What a column holds, under a name that says another unit for its numbers as they stand in the file.
fn named(column: &Column, name: &str) -> Option<Pick> {
    (column.name != name).then(|| Pick { name: name.to_owned(), offset: 0.0, ..column.pick.clone() })
}

/// What a column holds in its own unit, under another name and with this sign.
fn signed(column: &Column, base: &str, sign: f64) -> Option<Pick> {
    let Name::Known(own, conversion) = unit::name(&column.name) else { return None };
    let suffix = column.name.strip_prefix(self::base(own)?.as_str())?;
    // A unit that stands beside the name, or was found, is none of its suffix.
    let beside = column.conversion.scale / (conversion.scale * column.pick.factor);
    let beside = if (beside - 1.0).abs() < 1e-12 { 1.0 } else { beside };
    let Pick { factor, offset, .. } = column.pick;
    let (factor, offset) = (sign * beside * factor, sign * beside * offset);
    Some(Pick { name: format!("{base}{suffix}"), factor, offset, ..column.pick.clone() })
}
