//! The whole search on long logs of three axes: how time and memory grow with the log.
//!
//! One run each, of minutes: `cargo bench --bench long_log`.

use gyro_model::{
    Axis, Model, Record,
    diagnose::{self, Options},
    simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
};
use std::time::Instant;

/// Rows of the logs, the first the alternative that the second is held against.
const ROWS: [usize; 2] = [250_000, 1_000_000];
const RATE_HZ: f64 = 500.0;
/// What is hidden on each axis, and how it moves.
const AXES: [(&str, Motion); 3] = [
    ("delay:d=0.008", Motion::Drive { rate: 1.0, hold: 2.0 }),
    ("temperature-bias", Motion::Multisine { travel: 3.0 }),
    ("scale-asymmetry", Motion::Drive { rate: 2.0, hold: 2.0 }),
];

/// Three shafts on one log.
fn log(rows: usize) -> Record {
    let shaft = |(k, (hidden, motion)): (usize, (&str, Motion))| {
        let axis = Axis::ALL[k];
        let hidden = Hidden::parse(hidden, axis).into_iter().collect();
        let sensor = SensorSpec { axis, ..SensorSpec::default() };
        let seconds = rows as f64 / RATE_HZ;
        simulate(&Scenario { motion, seconds, rate_hz: RATE_HZ, hidden, sensor, seed: 5 + k as u64 }).record
    };
    let mut all: Vec<Record> = AXES.into_iter().enumerate().map(shaft).collect();
    let mut whole = all.remove(1);
    for (axis, other) in [Axis::X, Axis::Z].into_iter().zip(all) {
        let k = axis.index();
        for (row, own) in whole.rows.iter_mut().zip(other.rows) {
            (row.gyro[k], row.ref_angle[k]) = (own.gyro[k], own.ref_angle[k]);
        }
    }
    whole
}

/// Seconds that the ladder takes.
fn climb(record: &Record) -> f64 {
    let begun = Instant::now();
    let (_, ladders) = diagnose::ladder(record, &Model::base_for(record), &Axis::ALL, &Options::default())
        .expect("three axes with a reference each");
    let seconds = begun.elapsed().as_secs_f64();
    for ladder in ladders {
        println!("  {}: {:?}", ladder.axis, ladder.effects);
    }
    seconds
}

fn main() {
    // `cargo test --benches` only wants to know that it builds.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let seconds = ROWS.map(|rows| {
        let record = log(rows);
        let seconds = climb(&record);
        println!("{rows} rows × 3 axes: {seconds:.1} s, peak memory {} MB", peak_megabytes());
        seconds
    });
    println!("ratio of {} rows to {}: {:.2} of the time", ROWS[1], ROWS[0], seconds[1] / seconds[0]);
}

/// As the kernel counts it, so far.
fn peak_megabytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).map_or(0, |kilobytes| kilobytes / 1024)
}
