//! `truerate bench` on the real program: what it prints, and that nothing of it is left. How fast a machine is, is no test's concern.

mod common;

use common::Bench;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::{
    io::Read,
    path::PathBuf,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

/// A folder for the domain: its path has to be short.
fn runtime(name: &str) -> PathBuf {
    PathBuf::from(format!("/tmp/trb-{}-{name}", std::process::id()))
}

/// A measurement; where a test fails it is asked to end, and leaves nothing.
struct Measurement(Child);

impl Drop for Measurement {
    fn drop(&mut self) {
        if let Ok(None) = self.0.try_wait() {
            let _ = kill_process(Pid::from_child(&self.0), Signal::INT);
            let _ = self.0.wait();
        }
    }
}

fn start(name: &str, words: &[&str]) -> Measurement {
    let mut command: Command = Bench::new().command(words);
    command.current_dir("/").env("TRUERATE_RUNTIME_DIR", runtime(name));
    Measurement(command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
}

/// What is left of a measurement: its folder, and shared memory under its names.
fn left(name: &str, pid: u32) -> Vec<String> {
    let domain = ipc_types::domain::Domain::new(&runtime(name), &format!("bench-{pid}")).unwrap();
    let memory = std::fs::read_dir("/dev/shm").unwrap().flatten();
    let mut left: Vec<String> = memory.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    left.retain(|file| file.starts_with(domain.prefix()));
    left.extend(runtime(name).exists().then(|| runtime(name).display().to_string()));
    left
}

#[test]
fn each_way_has_as_many_round_trips_as_asked_and_nothing_is_left() {
    let mut bench = start("count", &["bench", "--count", "301", "--format", "json"]);
    let pid = bench.0.id();
    let (mut out, mut error) = (String::new(), String::new());
    bench.0.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    bench.0.stderr.take().unwrap().read_to_string(&mut error).unwrap();
    assert!(bench.0.wait().unwrap().success(), "{error}");
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["schema"], "truerate.bench/1");
    let ways = json["ways"].as_array().unwrap();
    for load in ["quiet", "busy"] {
        let of_load: Vec<&Value> = ways.iter().filter(|way| way["load"] == load).collect();
        let names: Vec<&str> = of_load.iter().map(|way| way["way"].as_str().unwrap()).collect();
        assert_eq!(names, ["pipe", "socket", "iceoryx2", "event", "spin"], "{load}");
        for way in of_load {
            assert_eq!(way["round_trips"], 301, "{way}");
            let times = ["p50_ns", "p99_ns", "p999_ns", "max_ns"].map(|key| way[key].as_u64().unwrap());
            assert!(times[0] > 0 && times.is_sorted(), "{way}");
            assert!(way["p50_to_pipe"].as_f64().unwrap() > 0.0, "{way}");
        }
    }
    assert_eq!(ways.len(), 10);
    assert!(left("count", pid).is_empty(), "{:?}", left("count", pid));
}

#[test]
fn a_measurement_that_is_interrupted_leaves_nothing_either() {
    // A second of pipe, a second of event, and again.
    let words = ["bench", "--count", "400", "--rate", "100", "--way", "event", "--load", "quiet"];
    let mut bench = start("stop", &words);
    let pid = bench.0.id();
    let until = Instant::now() + Duration::from_secs(60);
    while !left("stop", pid).iter().any(|file| file.contains(".data")) {
        assert!(bench.0.try_wait().unwrap().is_none() && Instant::now() < until, "it does not measure the hop");
        std::thread::sleep(Duration::from_millis(5));
    }
    kill_process(Pid::from_child(&bench.0), Signal::INT).unwrap();
    let status = bench.0.wait().unwrap();
    let mut error = String::new();
    bench.0.stderr.take().unwrap().read_to_string(&mut error).unwrap();
    assert!(error.contains("asked to stop"), "{error}");
    assert_eq!(status.code(), Some(1), "{error}");
    assert!(left("stop", pid).is_empty(), "{:?}", left("stop", pid));
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    for words in [["--count", "0"], ["--rate", "nan"], ["--rate", "0"], ["--way", "pigeon"]] {
        let outcome = Bench::new().run(&["bench", words[0], words[1]]);
        assert_eq!(outcome.code, 2, "{words:?}: {outcome:?}");
    }
}
