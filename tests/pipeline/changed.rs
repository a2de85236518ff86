//! The world changes while the pipeline runs: an effect that begins later, and a demo beside another one.

use crate::harness::{Place, signal};
use gyro_model::Axis;
use ipc_types::{Diagnosis, diagnosis::AxisResult, port::Hub, topic, wait::Wait};
use rustix::process::Signal;
use std::{
    io::{BufRead, BufReader},
    process::{Child, ChildStdout, Stdio},
    time::{Duration, Instant},
};

#[test]
fn an_effect_that_begins_later_is_found_on_the_data_since_then() {
    let place = Place::new();
    let config = place.file("vehicle.toml");
    let text = "speed = 8\nhide = [\"delay:d=0.02\"]\n[simulation]\nrate_hz = 100.0\nseed = 3\n";
    std::fs::write(&config, text).unwrap();
    let mut pipeline = place.start("live", &["--config", config.to_str().unwrap()]);
    let control = |words: &[&str]| place.output(&[&["control", "--instance", "live"], words].concat());
    pipeline.until("the compensator", |p| p.pid("compensator").is_some());
    let hub = Hub::join(&pipeline.domain, "onlooker").unwrap();
    let diagnoses = hub.reader(&topic::DIAGNOSIS, None, Wait::Event).unwrap();
    let mut last = Diagnosis::default();
    let worst = |diagnosis: &Diagnosis| -> (AxisResult, Axis) {
        let of = |axis: Axis| (diagnosis.axes[axis.index()], axis);
        Axis::ALL.map(of).into_iter().find(|(axis, _)| axis.present == 1).unwrap_or(of(Axis::X))
    };
    let first_suspect = |diagnosis: &Diagnosis| worst(diagnosis).0.suspects[0].effect.to_string();

    pipeline.until("the first effect's name", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        first_suspect(&last) == "delay"
    });
    let letter = worst(&last).1.letter();
    let added = control(&["add", "delay", "--axis", letter]);
    assert!(added.status.success(), "{added:?}");
    pipeline.until("an error at its floor", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        worst(&last).0.within_floor == 1
    });
    let good_ns = last.to_ns;
    pipeline.until("a minute of it", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        last.to_ns > good_ns + 60_000_000_000
    });
    assert_eq!(last.changed_ns, 0, "nothing has changed yet");
    let hidden = control(&["hide", "scale-asymmetry"]);
    assert!(hidden.status.success(), "{hidden:?}");
    pipeline.until("the jump", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        last.changed_ns > 0
    });
    assert!(last.changed_ns > good_ns, "{} after {good_ns}", last.changed_ns);
    pipeline.until("the second effect's name, of the data since then alone", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        last.from_ns >= last.changed_ns && first_suspect(&last) == "scale-asymmetry"
    });
    let added = control(&["add", "scale-asymmetry", "--axis", letter]);
    assert!(added.status.success(), "{added:?}");
    pipeline.until("an error at its floor again", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        worst(&last).0.within_floor == 1 && first_suspect(&last).is_empty()
    });
    drop((diagnoses, hub));
    let ended = pipeline.interrupt();
    assert!(ended.code == Some(0) && ended.error.contains("the error jumps at"), "{}", ended.error);
    assert!(place.left("live").is_empty(), "{:?}", place.left("live"));
}

/// A demo that runs until it is told to end.
struct Demo {
    child: Child,
    out: BufReader<ChildStdout>,
    said: String,
}

impl Demo {
    fn start(place: &Place) -> Self {
        let mut child = place
            .truerate()
            .args(["demo", "--seed", "7"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        Self { out: BufReader::new(child.stdout.take().unwrap()), child, said: String::new() }
    }

    /// Once it has said how to undo.
    fn invited(mut self) -> Self {
        while !self.said.contains("control undo") {
            assert!(self.out.read_line(&mut self.said).unwrap() > 0, "{}", self.said);
        }
        self
    }

    fn address(&self) -> &str {
        self.said.split_whitespace().find(|word| word.starts_with("http://")).unwrap()
    }

    /// Ends it; its last line.
    fn end(mut self) -> String {
        signal(self.child.id(), Signal::INT);
        std::io::Read::read_to_string(&mut self.out, &mut self.said).unwrap();
        assert!(self.child.wait().unwrap().success(), "{}", self.said);
        self.said.lines().last().unwrap().to_owned()
    }
}

#[test]
fn demos_that_start_at_one_moment_take_names_and_ports_of_their_own_and_each_ends_with_all_that_was_hidden_in_it() {
    let place = Place::new();
    let [first, second] = [Demo::start(&place), Demo::start(&place)].map(Demo::invited);
    let (first, second) = if first.said.contains("--instance demo-2") { (second, first) } else { (first, second) };
    assert!(
        second.said.contains("--instance demo-2") && !first.said.contains("demo-2"),
        "{} {}",
        first.said,
        second.said
    );
    assert_ne!(first.address(), second.address());
    let told = std::fs::read_to_string(place.domain("demo").folder().join("dashboard.url")).unwrap();
    assert_eq!(told, first.address());
    let until = Instant::now() + Duration::from_secs(60);
    while place.output(&["control", "--instance", "demo", "hide", "lag:tau=0.01"]).status.code() != Some(0) {
        assert!(Instant::now() < until, "nothing can be hidden");
        std::thread::sleep(Duration::from_millis(100));
    }
    let hidden = second.end();
    let hidden = hidden.strip_prefix("hidden: ").expect(&hidden);
    assert_eq!(first.end(), format!("hidden: {hidden}, lag:tau=0.01"));
    assert!(place.left("demo").is_empty() && place.left("demo-2").is_empty());
}

#[test]
fn status_says_at_once_what_a_running_pipeline_has_found_before() {
    let place = Place::new();
    let mut pipeline = place.start("found", &["--source", "sim", "--hide", "delay"]);
    pipeline.until("the compensator", |p| p.pid("compensator").is_some());
    let hub = Hub::join(&pipeline.domain, "onlooker").unwrap();
    let diagnoses = hub.reader(&topic::DIAGNOSIS, None, Wait::Event).unwrap();
    let mut last = Diagnosis::default();
    pipeline.until("a diagnosis of a model that was learned", |_| {
        last = diagnoses.newest().unwrap().unwrap_or(last);
        last.epoch > 0 && last.axes.iter().any(|axis| axis.present == 1)
    });
    for _ in 0..10 {
        let status = place.status("found").unwrap();
        let axes = status["verdict"]["axes"].as_array().unwrap();
        assert!(!axes.is_empty() && axes.iter().all(|axis| axis["headline"].is_string()), "{status}");
        let text = String::from_utf8(place.output(&["status", "--instance", "found"]).stdout).unwrap();
        assert!(text.contains("model of epoch") && !text.contains("no diagnosis yet"), "{text}");
    }
    assert_eq!(pipeline.interrupt().code, Some(0));
}
