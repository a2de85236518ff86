//! The pipeline as a service of the machine: what the service manager hears, and the unit file.

use crate::harness::{Pipeline, Place, signal};
use rustix::process::Signal;
use std::{
    os::unix::net::UnixDatagram,
    process::Command,
    time::{Duration, Instant},
};

const UNIT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/deploy/truerate.service");
/// How long the manager of these tests waits for a beat.
const LONGEST: Duration = Duration::from_secs(2);

/// A service manager that started the pipelines of a place.
struct Manager(UnixDatagram);

impl Manager {
    fn of(place: &mut Place) -> Self {
        let path = place.file("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        place.environment.push(("NOTIFY_SOCKET", path.display().to_string()));
        place.environment.push(("WATCHDOG_USEC", LONGEST.as_micros().to_string()));
        Self(socket)
    }

    /// The next word, if one comes within `patience`.
    fn hear(&self, patience: Duration) -> Option<String> {
        self.0.set_read_timeout(Some(patience)).unwrap();
        let mut bytes = [0; 512];
        let length = self.0.recv(&mut bytes).ok()?;
        Some(String::from_utf8_lossy(&bytes[..length]).trim_end().to_owned())
    }

    /// All that is said until this is; says what was.
    fn until(&self, word: &str) -> Vec<String> {
        let (mut heard, start) = (Vec::new(), Instant::now());
        while heard.last().is_none_or(|last| last != word) {
            assert!(start.elapsed() < Duration::from_secs(60), "no {word}: {heard:?}");
            heard.extend(self.hear(Duration::from_millis(100)));
        }
        heard
    }
}

const SERVICES: [&str; 3] = ["acquisition", "kalman", "compensator"];

fn environment(pipeline: &Pipeline, service: &str) -> String {
    let pid = pipeline.pid(service).unwrap();
    String::from_utf8_lossy(&std::fs::read(format!("/proc/{pid}/environ")).unwrap()).into_owned()
}

#[test]
fn the_manager_hears_that_all_are_there_though_the_sensor_is_not() {
    let mut place = Place::new();
    let manager = Manager::of(&mut place);
    let source = format!("serial:{}", place.file("no-sensor").display());
    let mut pipeline = place.start("boot", &["--source", &source]);
    manager.until("READY=1");
    let status = place.status("boot").unwrap();
    for (service, name) in status["services"].as_array().unwrap().iter().zip(SERVICES) {
        assert!(service["name"] == name && service["pid"] == pipeline.pid(name).unwrap(), "{status}");
        assert!(!environment(&pipeline, name).contains("NOTIFY_SOCKET"), "{name} could speak for its supervisor");
    }
    manager.until("STATUS=source: waiting");
    assert!(pipeline.child.try_wait().unwrap().is_none());
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let last = manager.until("STOPPING=1");
    assert!(!last.contains(&"READY=1".to_owned()), "said twice: {last:?}");
    assert!(place.left("boot").is_empty(), "{:?}", place.left("boot"));
}

#[test]
fn the_beat_for_the_manager_is_the_supervisors_own() {
    let mut place = Place::new();
    let manager = Manager::of(&mut place);
    let mut pipeline = place.start("beat", &["--source", "sim"]);
    manager.until("READY=1");
    for _ in 0..4 {
        let start = Instant::now();
        manager.until("WATCHDOG=1");
        assert!(start.elapsed() < LONGEST, "{:?} without a beat", start.elapsed());
    }
    let supervisor = pipeline.child.id();
    signal(supervisor, Signal::STOP);
    while manager.hear(Duration::from_millis(200)).is_some() {}
    assert_eq!(manager.hear(LONGEST), None, "a supervisor that hangs beats");
    let before = SERVICES.map(|service| pipeline.pid(service));
    signal(supervisor, Signal::CONT);
    manager.until("WATCHDOG=1");
    // Its own pause tells it nothing of the others.
    assert_eq!(SERVICES.map(|service| pipeline.pid(service)), before, "{}", pipeline.errors());
    pipeline.until("all processes", |p| SERVICES.iter().all(|service| p.pid(service).is_some()));
    assert_eq!(pipeline.interrupt().code, Some(0));
}

/// Runs `systemd-analyze`; `None`, said, where there is none.
fn analyze(words: &[&str]) -> Option<(bool, String)> {
    match Command::new("systemd-analyze").args(words).output() {
        Ok(output) => {
            let text = [output.stdout, output.stderr].concat();
            Some((output.status.success(), String::from_utf8_lossy(&text).into_owned()))
        }
        Err(error) => {
            eprintln!("skipped: there is no systemd-analyze here ({error})");
            None
        }
    }
}

#[test]
fn the_unit_file_is_one_that_systemd_takes() {
    if let Some((taken, text)) = analyze(&["verify", UNIT]) {
        assert!(taken, "{text}");
    }
}

#[test]
fn the_unit_leaves_little_open() {
    let Some((_, text)) = analyze(&["security", "--no-pager", "--offline=yes", UNIT]) else { return };
    let exposure = text.lines().find_map(|line| line.split_once("Overall exposure level for truerate.service: "));
    let Some((_, exposure)) = exposure else {
        eprintln!("skipped: this systemd-analyze cannot judge a file: {text}");
        return;
    };
    let level: f64 = exposure.split(' ').next().unwrap().parse().unwrap();
    assert!(level < 3.0, "{text}");
}
