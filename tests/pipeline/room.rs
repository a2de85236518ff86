//! Too little room: in shared memory, in the run's folder; at the start and later.

use crate::harness::{Pipeline, Place, is_root, signal};
use rustix::process::Signal;
use std::{
    io::Write,
    process::Command,
    thread::sleep,
    time::{Duration, Instant},
};

/// What is run in a mount namespace of its own, in which `what` is `size` large.
fn mounted(size: &str, what: &str) -> Vec<String> {
    let script = format!("mkdir -p {what} && mount -t tmpfs -o size={size},mode=1777 tmpfs {what} && exec \"$@\"");
    ["unshare", "-m", "sh", "-c", &script, "sh"].map(str::to_owned).into()
}

/// Whether mounts can be tried here; else it is said.
fn can_mount() -> bool {
    let made = is_root() && Command::new("unshare").args(["-m", "true"]).status().is_ok_and(|s| s.success());
    if !made {
        eprintln!("skipped: there are no mount namespaces here");
    }
    made
}

/// Writes to this file, in the namespace of a pipeline, until nothing goes in any more.
fn fill(pipeline: &Pipeline, path: &str) -> String {
    let path = format!("/proc/{}/root{path}", pipeline.child.id());
    let mut file = std::fs::File::create(&path).unwrap();
    for size in [1 << 20, 1 << 12] {
        while file.write_all(&vec![1; size]).is_ok() {}
    }
    path
}

/// `truerate status` in the namespace of a pipeline.
fn status(place: &mut Place, pipeline: &Pipeline, instance: &str) -> Option<serde_json::Value> {
    let pid = pipeline.child.id().to_string();
    place.wrapper = ["nsenter", "-t", &pid, "-m"].map(str::to_owned).into();
    place.status(instance)
}

/// The pipeline's kalman and how often it was started again, and how many estimates it gave.
fn kalman(status: &serde_json::Value) -> (u32, u64, u64) {
    let kalman = &status["services"][1];
    let number = |key: &str| kalman[key].as_u64().unwrap();
    (number("pid") as u32, number("restarts"), number("sent"))
}

fn until_on(place: &mut Place, pipeline: &mut Pipeline, instance: &str, from: u64) -> (u32, u64, u64) {
    let start = Instant::now();
    loop {
        let now = status(place, pipeline, instance).map(|status| kalman(&status));
        if let Some(now) = now.filter(|now| now.2 > from) {
            return now;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "no estimates:\n{}", pipeline.errors());
        sleep(Duration::from_millis(50));
    }
}

#[test]
fn too_little_room_at_the_start_is_said_in_one_line_with_what_to_do() {
    if !can_mount() {
        return;
    }
    for (size, what, remedy) in [("256k", "/dev/shm", "size=128M"), ("256k", "", "TRUERATE_RUNTIME_DIR")] {
        let mut place = Place::new();
        let what = if what.is_empty() { place.base.display().to_string() } else { what.to_owned() };
        place.wrapper = mounted(size, &what);
        let ended = place.start("small", &["--source", "sim"]).end();
        assert_eq!(ended.code, Some(1), "{}", ended.error);
        let lines: Vec<&str> = ended.error.lines().filter(|line| line.starts_with("truerate: ")).collect();
        assert!(lines.len() == 1 && lines[0].contains(&what) && lines[0].contains(remedy), "{}", ended.error);
    }
}

#[test]
fn shared_memory_that_others_fill_later_ends_nobody() {
    if !can_mount() {
        return;
    }
    let mut place = Place::new();
    place.wrapper = mounted("128m", "/dev/shm");
    let mut pipeline = place.start("shm", &["--source", "sim"]);
    let first = until_on(&mut place, &mut pipeline, "shm", 500);
    let filler = fill(&pipeline, "/dev/shm/filler");
    sleep(Duration::from_secs(3));
    std::fs::remove_file(filler).unwrap();
    let after = until_on(&mut place, &mut pipeline, "shm", first.2 + 1000);
    assert_eq!((after.0, after.1), (first.0, 0), "{}", pipeline.errors());
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
}

#[test]
fn a_full_folder_is_said_and_stops_neither_filter_nor_learning() {
    if !can_mount() {
        return;
    }
    let mut place = Place::new();
    let base = place.base.display().to_string();
    place.wrapper = mounted("4m", &base);
    let mut pipeline = place.start("full", &["--source", "sim"]);
    let first = until_on(&mut place, &mut pipeline, "full", 500);
    let filler = fill(&pipeline, &format!("{base}/full/filler"));
    pipeline.until("a word of it", |p| p.errors().contains("learning goes on"));
    sleep(Duration::from_secs(2));
    assert!(!pipeline.errors().contains("started again"), "{}", pipeline.errors());
    signal(first.0, Signal::KILL);
    pipeline.until("the reason", |p| p.errors().contains("is full, which kalman may have died of"));
    std::fs::remove_file(filler).unwrap();
    let last = until_on(&mut place, &mut pipeline, "full", first.2 + 1000);
    assert_ne!(last.0, first.0);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert_eq!(ended.error.matches("learning goes on").count(), 1, "said once: {}", ended.error);
}
