//! What a live source gives that is no good row: counted, told once, and the stream goes on.

use crate::harness::{Pipeline, Place, counted, log, signal};
use ipc_types::{port::Hub, topic, wait::Wait};
use rustix::process::Signal;
use serde_json::Value;
use std::{
    io::Write,
    path::Path,
    thread::sleep,
    time::{Duration, Instant},
};

/// The lines of a log, its header first.
fn lines(path: &Path) -> Vec<String> {
    std::fs::read_to_string(path).unwrap().lines().map(str::to_owned).collect()
}

/// The source, as `status` shows it, as soon as `fits` holds of it.
fn source(place: &Place, pipeline: &mut Pipeline, instance: &str, fits: impl Fn(&Value) -> bool) -> Value {
    let mut seen = Value::Null;
    pipeline.until("the source's counts", |_| {
        seen = place.status(instance).map_or(Value::Null, |status| status["source"].clone());
        fits(&seen)
    });
    seen
}

#[test]
fn no_bad_row_on_standard_input_ends_the_run_and_each_kind_is_counted_and_told_once() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 30.0, 6);
    let lines = lines(&path);
    let (pipeline, mut input) = place.start_fed("spoilt", &["--speed", "max"]);
    let mut pipeline = pipeline;
    writeln!(input, "ets Jul 29 2019 12:21:46\r\n\r\nrst:0x1 (POWERON_RESET)").unwrap();
    let (mut cut, mut garbled, mut values) = (0, 0, 0);
    for (k, line) in lines.iter().enumerate() {
        match k % 50 {
            10 => {
                writeln!(input, "{}", &line[..line.len() / 3]).unwrap();
                cut += 1;
            }
            20 => {
                input.write_all(&line.bytes().map(|b| if b == b'.' { 0xff } else { b }).collect::<Vec<_>>()).unwrap();
                writeln!(input).unwrap();
                garbled += 1;
            }
            30 => {
                let fields: Vec<&str> = line.split(',').collect();
                writeln!(input, "{},inf,{}", fields[0], fields[2..].join(",")).unwrap();
                values += 1;
            }
            40 => writeln!(input, "W (1234) wifi: lost the beacon\n{line}").unwrap(),
            _ => writeln!(input, "{line}").unwrap(),
        }
    }
    let good = lines.len() as u64 - 1 - cut - garbled;
    let seen = source(&place, &mut pipeline, "spoilt", |s| s["rows"] == good);
    assert_eq!(
        (&seen["cut"], &seen["garbled"], &seen["values"]),
        (&cut.into(), &garbled.into(), &values.into()),
        "{seen}"
    );
    assert_eq!(seen["remarks"].as_u64().unwrap(), 2 + lines.len() as u64 / 50, "{seen}");
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), good, "{}", ended.out);
    assert_eq!(counted(&ended.out, "kalman", "lost"), 0, "{}", ended.out);
    assert!(ended.out.contains("garbled"), "{}", ended.out);
    for told in ["a garbled row", "a row of another length", "text between the rows", "nothing physical"] {
        assert_eq!(ended.error.matches(told).count(), 1, "{told}:\n{}", ended.error);
    }
    assert!(place.left("spoilt").is_empty(), "{:?}", place.left("spoilt"));
}

#[test]
fn a_reading_that_stands_for_none_is_left_out_and_counted() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 30.0, 6);
    let lines = lines(&path);
    let (mut pipeline, mut input) = place.start_fed("marked", &["--speed", "max"]);
    let mut marked = 0_u64;
    for (k, line) in lines.iter().enumerate() {
        if k % 40 == 20 {
            let fields: Vec<&str> = line.split(',').collect();
            writeln!(input, "{},-34.9,{}", fields[0], fields[2..].join(",")).unwrap();
            marked += 1;
        } else {
            writeln!(input, "{line}").unwrap();
        }
    }
    let rows = lines.len() as u64 - 1;
    let seen = source(&place, &mut pipeline, "marked", |s| s["rows"] == rows);
    assert_eq!(seen["left_out"], marked, "{seen}");
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert!(ended.out.contains(&format!("{marked} readings left out")), "{}", ended.out);
    assert_eq!(ended.error.matches("is not a reading and is left out").count(), 1, "{}", ended.error);
}

#[test]
fn lines_that_make_one_reading_are_a_row() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 20.0, 6);
    let lines = lines(&path);
    let names: Vec<&str> = lines[0].split(',').collect();
    let (mut pipeline, mut input) = place.start_fed("blocks", &["--speed", "max"]);
    writeln!(input, "MPU6050 Found!\nGyro range set to: +- 500 deg/s\n").unwrap();
    for line in &lines[1..] {
        for (name, field) in names.iter().zip(line.split(',')).filter(|(_, field)| !field.is_empty()) {
            writeln!(input, "{name}: {field}").unwrap();
        }
        writeln!(input).unwrap();
    }
    let rows = lines.len() as u64 - 1;
    source(&place, &mut pipeline, "blocks", |s| s["rows"].as_u64() >= Some(rows - 1));
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), rows, "{}", ended.out);
}

#[test]
fn a_board_that_begins_again_makes_a_segment_whether_it_says_its_header_or_not() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 20.0, 6);
    let lines = lines(&path);
    let (header, rows) = lines.split_first().unwrap();
    let (pipeline, mut input) = place.start_fed("reboot", &["--speed", "max"]);
    let mut pipeline = pipeline;
    writeln!(input, "{header}\n{}", rows[..1500].join("\n")).unwrap();
    writeln!(input, "boot\n{header}\n{}", rows[..500].join("\n")).unwrap();
    writeln!(input, "{}", rows[..500].join("\n")).unwrap();
    // Without a header it takes five rows to believe it.
    let seen = source(&place, &mut pipeline, "reboot", |s| s["rows"] == 1500 + 500 + 496);
    assert_eq!((&seen["segments"], &seen["times"]), (&2.into(), &4.into()), "{seen}");
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), 2496, "{}", ended.out);
    assert_eq!(counted(&ended.out, "kalman", "rejected"), 0, "{}", ended.out);
}

#[test]
fn a_stream_without_a_header_is_refused_at_its_end_with_its_reason() {
    let place = Place::new();
    let (pipeline, mut input) = place.start_fed("headless", &["--speed", "max"]);
    for k in 0..200 {
        writeln!(input, "{k},0.1,0.2").unwrap();
    }
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(1), "{}", ended.error);
    assert!(ended.error.contains("standard input: no header"), "{}", ended.error);
}

#[test]
fn a_row_is_given_when_it_comes() {
    const PERIOD: Duration = Duration::from_millis(50);
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 2.0, 6);
    let (pipeline, mut input) = place.start_fed("paced", &["--speed", "max"]);
    let start = Instant::now();
    for (k, line) in lines(&path).iter().enumerate() {
        sleep((start + PERIOD * u32::try_from(k).unwrap()).saturating_duration_since(Instant::now()));
        writeln!(input, "{line}").unwrap();
    }
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    // Not once the next one has come.
    let line = ended.out.lines().find(|line| line.starts_with("sample-to-estimate ")).unwrap();
    let median: f64 = line.split_whitespace().nth(2).unwrap().parse().unwrap();
    assert!(median < 0.5 * PERIOD.as_micros() as f64, "{}", ended.out);
}

#[test]
fn a_compensator_that_hangs_keeps_no_rate_from_a_pipes_reader() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 100.0, 6);
    let lines = lines(&path);
    let (pipeline, mut input) = place.start_fed("kept", &["--speed", "max"]);
    let mut pipeline = pipeline;
    writeln!(input, "{}", lines[..1000].join("\n")).unwrap();
    source(&place, &mut pipeline, "kept", |s| s["rows"] == 999);
    // Nobody replaces it.
    let (supervisor, compensator) = (pipeline.child.id(), pipeline.pid("compensator").unwrap());
    signal(supervisor, Signal::STOP);
    signal(compensator, Signal::STOP);
    let hub = Hub::join(&pipeline.domain, "onlooker").unwrap();
    let estimates = hub.reader(&topic::ESTIMATE, None, Wait::Event).unwrap();
    // More than may be under way.
    writeln!(input, "{}", lines[1000..9000].join("\n")).unwrap();
    pipeline.until("the last estimate", |_| estimates.newest().unwrap().is_some_and(|e| e.sequence == 8999));
    signal(compensator, Signal::CONT);
    signal(supervisor, Signal::CONT);
    drop((estimates, hub, input));
    let ended = pipeline.end();
    assert_eq!(counted(&ended.out, "kalman", "in"), 8999, "{}", ended.out);
    assert_eq!(counted(&ended.out, "kalman", "lost"), 0, "{}", ended.out);
}
