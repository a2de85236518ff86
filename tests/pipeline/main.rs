//! The pipeline as a whole, on the real program: every test in a domain of its own, with a deadline.

mod bad_rows;
mod changed;
mod crashes;
mod dashboard;
mod deployed;
mod dialects;
mod harness;
mod live;
mod profile;
mod rate_out;
mod realtime;
mod recording;
mod refused;
mod room;
mod soak;
mod sources;
mod table;
mod trust;

use gyro_model::{Axis, Model, fit::fit};
use harness::{Place, counted, log, parameter, spoilt_log};
use std::{
    io::Write,
    thread::sleep,
    time::{Duration, Instant},
};
use workbench::log::{Options, read};

/// What the environment says of a measurement, or the default.
fn setting(name: &str, default: &str) -> String {
    std::env::var(name).unwrap_or_else(|_| default.to_owned())
}

#[test]
fn a_log_goes_through_without_loss_and_ends_in_the_parameters_of_fit() {
    let place = Place::new();
    let path = place.file("log.csv");
    let simulated = log(&path, 60.0, 11);
    let ended = place.start("whole", &["--source", path.to_str().unwrap(), "--speed", "max"]).end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    let rows = simulated.record.len() as u64;
    for process in ["kalman", "compensator"] {
        assert_eq!(counted(&ended.out, process, "in"), rows, "{}", ended.out);
        assert_eq!(counted(&ended.out, process, "lost"), 0, "{}", ended.out);
    }
    let (record, ..) = read(&path, &Options::default()).unwrap();
    let offline = fit(&record, &Model::base_for(&record), &[Axis::Z]).unwrap();
    for term in &offline.axes[2].as_ref().unwrap().terms {
        for (card, value, std_error) in term.parameters(Axis::Z) {
            let name = format!("{}.{}", term.effect.card().id, card.name);
            let (live, live_error) = parameter(&ended.out, "z", &name);
            assert!((live - value).abs() <= 0.1 * std_error, "{name}: {live} live, {value} ± {std_error} offline");
            assert!((live_error / std_error - 1.0).abs() < 0.1, "{name}: ± {live_error} live, ± {std_error} offline");
        }
    }
    assert!(place.left("whole").is_empty(), "{:?}", place.left("whole"));
}

#[test]
fn a_new_part_starts_from_its_type_live_too_and_what_is_not_of_the_type_is_noticed() {
    let place = Place::new();
    let (kind, path) = (place.file("type.toml"), place.file("log.csv"));
    let known = |value: f64| {
        let own = |name: &str, mean: f64, spread: f64| {
            format!(
                "{name} = {{ mean = {mean}, std_error = {}, spread = {spread}, parts = 30, unit = \"1\" }}\n",
                0.1 * spread
            )
        };
        let effects = own("scale-factor.alpha", 0.985, 2e-3) + &own("scale-asymmetry.a", value, 2e-5);
        std::fs::write(&kind, format!("schema = \"truerate.type/1\"\n[type.T.axis.z]\n{effects}")).unwrap();
    };
    spoilt_log(&path, 10.0, 100.0, 5, &["scale-asymmetry:a=0.0004"]);
    let args = ["--source", path.to_str().unwrap(), "--speed", "max", "--prior", kind.to_str().unwrap()];
    known(4e-4);
    let ended = place.start("new", &args).end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    let (value, error) = parameter(&ended.out, "z", "scale-asymmetry.a");
    assert!((value - 4e-4).abs() < 6e-5 && error < 2.1e-5, "{value} ± {error}");
    assert!(!ended.error.contains("not of its type"), "{}", ended.error);
    // A log that tells it otherwise.
    known(3e-3);
    spoilt_log(&place.file("log.csv"), 60.0, 100.0, 5, &["scale-asymmetry:a=0.0004"]);
    let ended = place.start("new", &args).end();
    assert!(ended.error.contains("not of its type in scale-asymmetry"), "{}", ended.error);
    let (value, error) = parameter(&ended.out, "z", "scale-asymmetry.a");
    assert!((value - 4e-4).abs() < 4.0 * error, "{value} ± {error}");
}

#[test]
fn two_instances_run_side_by_side_and_do_not_meet() {
    let place = Place::new();
    let (a, b) = (place.file("a.csv"), place.file("b.csv"));
    let (one, two) = (log(&a, 20.0, 1), log(&b, 30.0, 2));
    let first = place.start("left", &["--source", a.to_str().unwrap(), "--speed", "max"]);
    let second = place.start("right", &["--source", b.to_str().unwrap(), "--speed", "max"]);
    for (ended, rows) in [(first.end(), one.record.len()), (second.end(), two.record.len())] {
        assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
        assert_eq!(counted(&ended.out, "kalman", "in"), rows as u64);
    }
    assert!(place.left("left").is_empty() && place.left("right").is_empty());
}

#[test]
fn the_same_instance_twice_is_refused_in_one_line() {
    let place = Place::new();
    let mut first = place.start("only", &["--source", "sim"]);
    first.until("all processes", |p| p.pid("kalman").is_some());
    let second = place.output(&["run", "--source", "sim", "--dashboard", "off", "--instance", "only"]);
    assert_eq!(second.status.code(), Some(1));
    let error = String::from_utf8(second.stderr).unwrap();
    assert!(error.starts_with("truerate: pipeline 'only' already runs"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    first.interrupt();
}

#[test]
fn status_tells_what_runs_in_the_form_of_the_interface() {
    let place = Place::new();
    let mut pipeline = place.start("look", &["--source", "sim"]);
    let mut status = None;
    pipeline.until("estimates", |_| {
        status = place.status("look").filter(|s| s["stages"].as_array().is_some_and(|a| a.len() >= 5));
        status.is_some()
    });
    let status = status.unwrap();
    assert_eq!(status["schema"], "truerate.status/1");
    let names: Vec<&str> = status["services"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["acquisition", "kalman", "compensator"]);
    for service in status["services"].as_array().unwrap() {
        assert_eq!(service["state"], "running", "{service}");
        for key in ["pid", "restarts", "received", "sent", "lost", "rejected", "epoch"] {
            assert!(service[key].is_u64(), "{key} of {service}");
        }
    }
    assert!(status["verdict"]["axes"].is_array(), "{status}");
    let text = String::from_utf8(place.output(&["status", "--instance", "look"]).stdout).unwrap();
    let place_of = |word: &str| text.find(word).unwrap_or_else(|| panic!("{word}: {text}"));
    // On a busy machine the first diagnosis may be there.
    let found = text.find("axis x  ").unwrap_or_else(|| place_of("no diagnosis yet"));
    assert!(found < place_of("learning ") && place_of("learning ") < place_of("process "), "{text}");
    let stages: Vec<&str> = status["stages"].as_array().unwrap().iter().map(|s| s["stage"].as_str().unwrap()).collect();
    for stage in ["acquisition-to-kalman", "kalman", "sample-to-estimate", "acquisition-to-compensator"] {
        assert!(stages.contains(&stage), "{stages:?}");
    }
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(place.left("look").is_empty(), "{:?}", place.left("look"));
    let gone = place.output(&["status", "--instance", "look"]);
    assert_eq!(gone.status.code(), Some(1));
}

#[test]
fn a_log_that_cannot_be_read_ends_the_run_with_its_reason() {
    let place = Place::new();
    let path = place.file("bad.csv");
    std::fs::write(&path, "t,gyro_z\n0,0.1\n0.01,zero\n").unwrap();
    let ended = place.start("bad", &["--source", path.to_str().unwrap(), "--speed", "max"]).end();
    assert_eq!(ended.code, Some(1));
    let lines: Vec<&str> = ended.error.lines().filter(|line| line.starts_with("truerate: ")).collect();
    assert_eq!(lines.len(), 1, "{}", ended.error);
    assert!(lines[0].contains("bad.csv") && lines[0].contains("zero"), "{}", lines[0]);
    assert!(place.left("bad").is_empty());
}

#[test]
fn a_log_from_standard_input_goes_through_without_loss() {
    let place = Place::new();
    let path = place.file("log.csv");
    let rows = log(&path, 30.0, 6).record.len() as u64;
    let output = place
        .truerate()
        .args(["run", "--source", "-", "--speed", "max", "--dashboard", "off", "--instance", "input"])
        .stdin(std::fs::File::open(&path).unwrap())
        .output()
        .unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}{error}");
    assert_eq!(counted(&out, "kalman", "in"), rows);
    assert_eq!(counted(&out, "kalman", "lost"), 0);
}

/// Longer than a process may be silent.
const PAUSE: Duration = Duration::from_secs(14);

#[test]
fn standard_input_may_pause_for_as_long_as_it_likes() {
    let place = Place::new();
    let path = place.file("log.csv");
    let rows = log(&path, 30.0, 6).record.len() as u64;
    let text = std::fs::read_to_string(&path).unwrap();
    let middle = text.match_indices('\n').nth(rows as usize / 2).unwrap().0 + 1;
    let (pipeline, mut input) = place.start_fed("pause", &["--speed", "max"]);
    for part in [&text[..middle], &text[middle..]] {
        sleep(PAUSE);
        input.write_all(part.as_bytes()).unwrap();
    }
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    for process in ["kalman", "compensator"] {
        assert_eq!(counted(&ended.out, process, "in"), rows, "{}", ended.out);
        assert_eq!(counted(&ended.out, process, "lost"), 0, "{}", ended.out);
    }
    assert!(place.left("pause").is_empty(), "{:?}", place.left("pause"));
}

#[test]
fn a_source_that_says_nothing_is_left_at_once_when_asked() {
    let place = Place::new();
    let pipe = place.file("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let (silent, _input) = place.start_fed("silent", &[]);
    let nobody = place.start("nobody", &["--source", pipe.to_str().unwrap()]);
    for mut pipeline in [silent, nobody] {
        pipeline.until("acquisition", |p| p.pid("acquisition").is_some());
        let asked = Instant::now();
        let ended = pipeline.interrupt();
        assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
        assert!(!ended.error.contains("does not end"), "{}", ended.error);
        assert!(asked.elapsed() < Duration::from_secs(3), "{:?}", asked.elapsed());
    }
    for instance in ["silent", "nobody"] {
        assert!(place.left(instance).is_empty(), "{:?}", place.left(instance));
    }
}

#[test]
fn an_effect_hidden_in_a_replayed_log_spoils_what_kalman_gets() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 60.0, 8);
    let args = |hide: &'static str| vec!["--source", path.to_str().unwrap(), "--speed", "max", "--hide", hide];
    let spoilt = place.start("spoilt", &args("bias:delta=0.1")).end();
    let plain = place.start("plain", &["--source", path.to_str().unwrap(), "--speed", "max"]).end();
    assert_eq!((spoilt.code, plain.code), (Some(0), Some(0)), "{}", spoilt.error);
    let delta = |out: &str| parameter(out, "z", "bias.delta");
    let ((spoilt, _), (plain, std_error)) = (delta(&spoilt.out), delta(&plain.out));
    assert!((spoilt - plain - 0.1).abs() < 0.002 + 5.0 * std_error, "{spoilt} and {plain}");
}
