//! The trace of `run --profile`: every sample at every stage, in the form that Perfetto reads.

use crate::harness::{Place, counted, log};
use serde_json::Value;
use std::collections::BTreeSet;

#[test]
fn a_trace_holds_every_sample_at_every_stage() {
    let place = Place::new();
    let (path, trace) = (place.file("log.csv"), place.file("trace.json"));
    let rows = log(&path, 20.0, 3).record.len() as u64;
    let words = ["--source", path.to_str().unwrap(), "--speed", "10", "--profile", trace.to_str().unwrap()];
    let ended = place.start("trace", &words).end();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), rows);
    let events: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(&trace).unwrap()).unwrap();
    let of = |name: &'static str, kind: &'static str| {
        events.iter().filter(move |event| event["name"] == name && event["ph"] == kind)
    };
    for (stage, track) in [("acquisition", 1), ("kalman", 2)] {
        let samples: BTreeSet<u64> = of(stage, "X").map(|event| event["args"]["sample"].as_u64().unwrap()).collect();
        assert_eq!(samples, (1..=rows).collect(), "{stage}");
        let mut end = 0.0;
        for event in of(stage, "X") {
            let (from, long) = (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap());
            assert!(
                from >= end - 1e-3 && long >= 0.0 && event["tid"] == track,
                "{event}: the one before ends at {end}"
            );
            end = from + long;
        }
    }
    let arrows = |kind| of("hop", kind).map(|event| event["id"].as_u64().unwrap()).collect::<BTreeSet<u64>>();
    assert_eq!((arrows("s").len() as u64, arrows("s")), (rows, arrows("f")));
    for event in of("sample to estimate (µs)", "C") {
        let part = |name: &str| event["args"][name].as_f64().unwrap();
        assert!(part("all") + 1e-3 >= part("hop") + part("kalman"), "{event}");
    }
    assert!(place.left("trace").is_empty(), "{:?}", place.left("trace"));
}

#[test]
fn a_trace_that_cannot_be_written_is_said_before_anything_starts() {
    let place = Place::new();
    let words = ["run", "--source", "sim", "--dashboard", "off", "--profile", "/nowhere/trace.json"];
    let output = place.output(&words);
    let says = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && says.lines().count() == 1, "{says}");
    assert!(says.starts_with("truerate: /nowhere/trace.json"), "{says}");
    assert!(place.left("default").is_empty(), "{:?}", place.left("default"));
}
