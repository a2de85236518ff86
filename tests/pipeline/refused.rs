//! Settings that nothing can be made of: what is said, and that nothing is left behind.

use crate::harness::{Place, is_root};
use serde_json::Value;
use std::net::TcpListener;

/// What a command says that is refused: one line, exit code 1.
fn refusal(place: &Place, args: &[&str]) -> String {
    let output = place.output(args);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{args:?}: {error}");
    let lines: Vec<&str> = error.lines().filter(|line| line.starts_with("truerate: ")).collect();
    assert!(output.stdout.is_empty() && lines.len() == 1, "{args:?}: {error}");
    lines[0].to_owned()
}

#[test]
fn a_source_or_a_place_that_is_none_is_named_with_what_to_do() {
    let place = Place::new();
    for (args, says) in [
        (["--source", "usb:/dev/ttyUSB0"], "no address begins so: serial:…, udp:…"),
        (["--source", "/no/such.csv"], "check the path"),
        (["--out", "udp:no.such.host.invalid:9"], "this host is not found"),
        (["--out", "udp:9"], "a host and a port are needed"),
        (["--record", "/no/such/run.csv"], "no such folder"),
    ] {
        let error = refusal(&place, &[&["run", "--dashboard", "off"], &args[..]].concat());
        assert!(error.contains(says), "{args:?}: {error}");
    }
    assert!(place.left("default").is_empty(), "{:?}", place.left("default"));
}

#[test]
fn a_run_that_is_stopped_before_its_first_row_says_that_none_came() {
    let place = Place::new();
    for (source, why) in [
        ("serial:/dev/null", "it is not a serial line"),
        ("serial:/dev/none", "No such file"),
        ("iio:none", "no sensor"),
    ] {
        let mut pipeline = place.start("absent", &["--source", source]);
        pipeline.until("the reason", |p| p.errors().contains(why));
        let ended = pipeline.interrupt();
        assert_eq!(ended.code, Some(0), "{}", ended.error);
        assert!(ended.out.starts_with("no row came in ") && ended.out.contains("nothing was learned"), "{}", ended.out);
    }
}

#[test]
fn a_file_that_outgrows_its_limit_is_an_error_and_kills_nobody() {
    let mut place = Place::new();
    let small = "ulimit -f 100; exec \"$@\"";
    place.wrapper = ["sh", "-c", small, "sh"].map(str::to_owned).to_vec();
    let log = place.file("log.csv");
    let error = refusal(&place, &["simulate", "--seconds", "60", "-o", log.to_str().unwrap()]);
    assert!(error.contains("File too large") || error.contains("file too large"), "{error}");
    assert!(!log.exists(), "half a log under the name of a whole one");
}

#[test]
fn a_guide_whose_page_has_no_place_leaves_no_log() {
    let place = Place::new();
    let log = place.file("hand.csv");
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let error = refusal(&place, &["guide", "--source", "sim", "--dashboard", &address, "-o", log.to_str().unwrap()]);
    assert!(error.contains(&address), "{error}");
    assert!(!log.exists());
}

#[test]
fn a_vehicle_goes_on_when_its_recording_breaks_off() {
    if !is_root() {
        return;
    }
    let mut place = Place::new();
    let (disk, record) = (place.file("disk"), place.file("disk/run.csv"));
    std::fs::create_dir(&disk).unwrap();
    // A small disk of the pipeline's own mount namespace, which goes with it.
    let small = format!("mount -t tmpfs -o size=64k none {}; exec \"$@\"", disk.display());
    place.wrapper = ["unshare", "-m", "sh", "-c", &small, "sh"].map(str::to_owned).to_vec();
    let mut pipeline = place.start("full", &["--source", "sim", "--record", record.to_str().unwrap()]);
    pipeline.until("the end of the recording", |p| p.errors().contains("the vehicle goes on without"));
    let status = |name: &str| place.status("full").and_then(|s| service(&s, name)["received"].as_u64());
    let before = status("kalman").unwrap_or(0);
    pipeline.until("more samples", |_| status("kalman") > Some(before));
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(1), "{}", ended.error);
    assert!(
        ended.error.contains("No space left") && ended.out.contains("model of epoch"),
        "{}{}",
        ended.out,
        ended.error
    );
}

fn service<'a>(status: &'a Value, name: &str) -> &'a Value {
    status["services"].as_array().unwrap().iter().find(|service| service["name"] == name).unwrap()
}
