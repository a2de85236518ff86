//! The budget in words: what limits a log most, by how much, and what to do about it.

use super::{
    Part,
    folded_lines::Motion,
    random::{Cause, Found, Random, SLOWLY},
    reference_bandwidth::missing_at,
    seen::Seen,
};
use crate::{
    diagnosis::{BudgetPoint, Limit, LimitedBy, PARTS, RandomCause},
    fit::judged::finite,
    units::two,
};

/// The averaging times over which a log's limit is told: from four samples to a thirtieth of the log.
fn middle(points: &[BudgetPoint], dt: f64) -> impl Iterator<Item = &BudgetPoint> {
    // A curve goes to a tenth of the log.
    let last = points.last().map_or(0.0, |point| point.tau_s / 3.0).max(8.0 * dt);
    points.iter().filter(move |point| point.tau_s >= 3.9 * dt && point.tau_s <= last)
}

/// The largest part over the middle of the curve, each averaging time counting alike, and the share that none takes.
pub(crate) fn largest(points: &[BudgetPoint], dt: f64) -> (LimitedBy, f64) {
    let mut shares = [0.0; PARTS];
    let mut count = 0.0;
    for point in middle(points, dt) {
        let all = point.total();
        if all > 0.0 {
            shares.iter_mut().zip(point.parts).for_each(|(sum, part)| *sum += part / all);
            count += 1.0;
        }
    }
    let most = (0..shares.len()).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(PARTS - 1);
    (LimitedBy::ALL[most], if count > 0.0 { shares[PARTS - 1] / count } else { 1.0 })
}

/// What limits a log, with its number, and the remedy.
pub(crate) fn limit(
    by: LimitedBy,
    points: &[BudgetPoint],
    seen: &Seen,
    numbers: &dyn Fn(Part) -> Option<[f64; 3]>,
    random: &Random,
) -> Limit {
    let share = |point: &BudgetPoint| point.share(by);
    let Some(at) = middle(points, seen.dt).max_by(|a, b| share(a).total_cmp(&share(b))) else {
        return Limit { what: "the log is too short to divide its error".into(), ..Limit::default() };
    };
    let share = format!("{:.0} % of the error² at {}", 100.0 * share(at), seconds(at.tau_s));
    let of = |part: Part| numbers(part).unwrap_or_default();
    let (what, remedy) = match by {
        LimitedBy::GyroNoise => (
            format!("the gyro's own white noise, {} °/√s", two(seen.walks.0.to_degrees())),
            "Use a quieter gyro, or average over longer times.",
        ),
        LimitedBy::BiasWander => {
            let [walk, size, time] = of(Part::BiasWander);
            let how = if size > 0.0 && size * size > walk * walk * time {
                format!("{} °/s within some {}", two(size.to_degrees()), seconds(time))
            } else {
                format!("{} °/s in a minute", two((walk * 60_f64.sqrt()).to_degrees()))
            };
            let remedy = "No parameter removes that: estimate the bias live with a reference, or keep the sensor at one temperature.";
            (format!("the gyro's bias wanders by {how}"), remedy)
        }
        LimitedBy::ReferenceNoise => reference_noise(of(Part::ReferenceNoise), seen.walks),
        LimitedBy::ReferenceBandwidth => {
            let [size, knots, _] = of(Part::ReferenceBandwidth);
            if knots > 0.0 {
                let what = format!(
                    "the reference has a new value only every {}, with straight lines between, and follows nothing faster than {:.1} Hz",
                    seconds(size),
                    0.5 / size
                );
                (what, "Log it at its own rate with its own time stamps, or record a faster one.")
            } else {
                let what = format!(
                    "the reference is smoothed over {} and follows nothing faster than {:.1} Hz",
                    seconds(size),
                    missing_at(0.5, size)
                );
                (what, "Switch its filter off, or record a faster one.")
            }
        }
        LimitedBy::Timing => (
            format!(
                "the time stamps of gyro and reference scatter by {} against each other",
                seconds(of(Part::Timing)[0])
            ),
            "Stamp in hardware, or log both with one clock.",
        ),
        LimitedBy::FoldedMotion => {
            let strong = || {
                let density = two(of(Part::FoldedMotion)[0].to_degrees());
                format!(
                    "the motion is still strong at half the sampling rate ({density} °/s/√Hz), and faster motion is aliased"
                )
            };
            let what = Motion::behind(&seen.folded, seen.dt).map_or_else(strong, |motion| motion.says());
            (what, "Sample faster, or filter both before sampling.")
        }
        LimitedBy::RandomScale
        | LimitedBy::RateNoise
        | LimitedBy::ReversalSteps
        | LimitedBy::StartStopSteps
        | LimitedBy::LostMotion => match random.found.iter().find(|found| found.cause.limit() == by) {
            Some(found) => (what(found), remedy(found)),
            None => return Limit::default(),
        },
        LimitedBy::MissingEffect => ("an effect that the model lacks".to_owned(), "Add it and look again."),
        LimitedBy::Unattributed => (
            "an error that no noise of gyro, reference or clock explains".to_owned(),
            "Either the model lacks an effect, or the reference or its mounting is wrong: see where it fails.",
        ),
    };
    Limit { what, share, remedy: remedy.to_owned() }
}

/// Noise of the reference, by its size (rad) in all or between two frequencies (Hz) or, of a rate, by the walks of gyro and reference.
fn reference_noise([sigma, low, high]: [f64; 3], (gyro, reference): (f64, f64)) -> (String, &'static str) {
    let size = two(sigma.to_degrees());
    if low > 0.0 && reference == 0.0 {
        let what = format!(
            "noise of the reference, {size}° in all, between {low:.0} and {high:.0} Hz more than the gyro's whole signal"
        );
        (what, "The gyro is not the cause: record a steadier reference, or judge over longer times.")
    } else if reference > gyro {
        let (reference, gyro) = (two(reference.to_degrees()), two(gyro.to_degrees()));
        let what = format!("noise of the reference, {reference} °/√s, more than the gyro's own {gyro} °/√s");
        (what, "The gyro is not the cause: record a quieter reference.")
    } else {
        let what = format!("noise of the reference, {size}° a reading");
        (what, "The gyro is not the cause: record a finer reference, or judge over longer times.")
    }
}

/// The random causes that were found, as reported.
pub(crate) fn reported(random: &Random) -> Vec<RandomCause> {
    let of = |found: &Found| RandomCause {
        cause: found.cause.limit(),
        size: finite(found.size.value),
        std_error: finite(found.size.std_error),
        unit: found.cause.unit().to_owned(),
        count: found.count,
        aliases: found.aliases.iter().map(|cause| cause.limit()).collect(),
        says: sentence(found),
    };
    random.found.iter().map(of).collect()
}

/// A random cause in a sentence, and what to do about it.
fn sentence(found: &Found) -> String {
    let says = what(found);
    let first = says.chars().next().map_or_else(String::new, |first| first.to_uppercase().to_string());
    format!("{first}{}. {}", says.get(first.len()..).unwrap_or_default(), remedy(found))
}

/// What it is, with its size.
fn what(found: &Found) -> String {
    let size = |factor: f64, unit: &str| {
        let (value, error) = (factor * found.size.value, factor * found.size.std_error);
        let decimals =
            if error > 0.0 && error.is_finite() { (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize } else { 3 };
        format!("{value:.decimals$} ± {error:.decimals$}{unit}")
    };
    let degrees = 1_f64.to_degrees();
    let events = found.count.unwrap_or(0);
    let says = match found.cause {
        Cause::RandomScale => {
            let how_long =
                if found.is_slow { format!("over {SLOWLY} s and longer") } else { "within seconds".to_owned() };
            format!("the scale factor between gyro and reference wanders by {} {how_long}", size(100.0, " %"))
        }
        Cause::RateNoise => {
            format!(
                "noise that grows with the rate, {} after one turn",
                size(degrees * std::f64::consts::TAU.sqrt(), "°")
            )
        }
        Cause::ReversalSteps => {
            format!(
                "each of the {events} reversals adds a step of random size and sign, {} (standard deviation)",
                size(degrees, "°")
            )
        }
        Cause::StartStopSteps => format!(
            "each of the {events} starts and stops adds a step of random size and sign, {} (standard deviation)",
            size(degrees, "°")
        ),
        Cause::LostMotion => format!("motion is lost in {events} holes of the log, {} in each", size(degrees, "°")),
    };
    let others: Vec<&str> = found.aliases.iter().map(|cause| cause.limit().words()).collect();
    if others.is_empty() { says } else { format!("{says} (or {}, which fits nearly as well)", others.join(" or ")) }
}

const fn remedy(found: &Found) -> &'static str {
    match found.cause {
        Cause::RandomScale if found.is_slow => {
            "Log the sensor's temperature and supply: its scale factor may follow one of them. Or the reference's does: record a better one."
        }
        Cause::RandomScale => {
            "Mount sensor and reference more stiffly, supply the sensor from a steadier voltage, or record a finer reference."
        }
        Cause::RateNoise => {
            "Look for cogging or vibration of the drive, and for a sensor whose noise grows with the rate."
        }
        Cause::ReversalSteps => {
            "Take the play out of gear, belt or coupling (preload), damp the drive, or log faster: it may ring after each reversal."
        }
        Cause::StartStopSteps => "Look for play, slip or ringing when the axis starts and stops.",
        Cause::LostMotion => {
            "Record without holes: read the sensor's FIFO, or let the sensor integrate the rate itself."
        }
    }
}

/// A time, to two figures, in ms where it is short.
fn seconds(value: f64) -> String {
    if value < 0.0995 { format!("{} ms", two(1e3 * value)) } else { format!("{} s", two(value)) }
}
