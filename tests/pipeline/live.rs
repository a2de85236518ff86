//! The model changed while it runs: by command, refused with a reason, undone, saved.

use crate::harness::{Pipeline, Place, counted, log, parameter, signal, spoilt_log};
use gyro_model::Axis;
use ipc_types::{
    Parameters,
    diagnosis::TrialState,
    port::{Hub, Reader},
    topic,
    wait::Wait,
};
use rustix::process::Signal;
use serde_json::Value;
use std::{io::Write, os::unix::fs::PermissionsExt, path::PathBuf, process::Output};

/// A vehicle at 100 Hz, eight times as fast as real time, with a late gyro.
fn late_vehicle(place: &Place) -> PathBuf {
    let path = place.file("vehicle.toml");
    let text = "speed = 8\nhide = [\"delay:d=0.02\"]\ndashboard = \"off\"\n[simulation]\nrate_hz = 100.0\nseed = 3\n";
    std::fs::write(&path, text).unwrap();
    path
}

struct Model {
    parameters: Reader<Parameters>,
    last: Parameters,
    axis: usize,
    _hub: Hub,
}

impl Model {
    fn watch(pipeline: &mut Pipeline) -> Self {
        let mut joined = None;
        pipeline.until("the topics", |p| {
            joined = Hub::join(&p.domain, "onlooker").ok().and_then(|hub| {
                hub.reader(&topic::PARAMETERS, None, Wait::Event).ok().map(|parameters| (hub, parameters))
            });
            joined.is_some()
        });
        let (hub, parameters) = joined.unwrap();
        let mut model = Self { parameters, last: Parameters::default(), axis: 0, _hub: hub };
        pipeline.until("a first model", |_| {
            model.look();
            model.last.axes.iter().position(|a| a.present == 1).is_some_and(|axis| {
                model.axis = axis;
                true
            })
        });
        model
    }

    fn look(&mut self) {
        if let Some(parameters) = self.parameters.newest().unwrap() {
            self.last = parameters;
        }
    }

    fn effects(&mut self) -> Vec<String> {
        self.look();
        let axis = &self.last.axes[self.axis];
        axis.terms.iter().take(axis.count as usize).map(|t| t.effect.to_string()).collect()
    }

    fn letter(&self) -> &'static str {
        Axis::ALL[self.axis].letter()
    }
}

fn control(place: &Place, args: &[&str]) -> Output {
    let mut all = vec!["control", "--instance", "live"];
    all.extend_from_slice(args);
    place.output(&all)
}

#[test]
fn the_demo_plays_the_whole_loop_and_says_what_was_hidden() {
    let place = Place::new();
    let demo = place.output(&["demo", "--auto", "--seed", "7"]);
    let (said, errors) = (String::from_utf8_lossy(&demo.stdout), String::from_utf8_lossy(&demo.stderr));
    assert!(demo.status.success(), "{said}\n{errors}");
    let end = said.lines().last().unwrap();
    let (hidden, rest) = end.strip_prefix("hidden: ").and_then(|rest| rest.split_once("  named: ")).expect(end);
    let ratios = rest.strip_prefix(hidden).and_then(|rest| rest.strip_prefix("  error/floor: ")).expect(end);
    let (before, after) = ratios.split_once(" -> ").expect(end);
    let (before, after): (f64, f64) = (before.parse().unwrap(), after.parse().unwrap());
    assert!(after < 0.5 * before, "{said}");
    // What adding it has won, and its size as it was hidden and as it was found, in one unit.
    let line = |start: &str| said.lines().find_map(|line| line.strip_prefix(start)).unwrap_or_else(|| panic!("{said}"));
    let added = line("add:      ");
    let title = hidden.replace('-', " ");
    assert!(added.to_lowercase().starts_with(&format!("{title} added: ")) && added.contains(" °/s over "), "{added}");
    assert!(added.contains("; what is left is "), "{added}");
    let (was, found) =
        line("hidden was: ").strip_prefix(hidden).and_then(|rest| rest.split_once("; found: ")).expect(&said);
    let number = |text: &str| text.split_whitespace().find_map(|word| word.replace('−', "-").parse::<f64>().ok());
    let (was, found) = (number(was).expect(was), number(found).expect(found));
    assert!((found - was).abs() < 0.3 * was.abs(), "{said}");
    assert!(place.left("demo").is_empty(), "{:?}", place.left("demo"));
}

#[test]
fn an_effect_is_added_undone_and_saved_while_the_vehicle_drives() {
    let place = Place::new();
    let config = late_vehicle(&place);
    let mut pipeline = place.start("live", &["--config", config.to_str().unwrap()]);
    let mut model = Model::watch(&mut pipeline);
    let letter = model.letter();
    assert_eq!(model.effects(), ["scale-factor", "bias"]);

    let unknown = control(&place, &["add", "nonsense", "--axis", letter]);
    assert_eq!(unknown.status.code(), Some(1));
    let error = String::from_utf8(unknown.stderr).unwrap();
    assert!(error.contains("no effect 'nonsense'"), "{error}");
    assert_eq!(control(&place, &["undo"]).status.code(), Some(1), "nothing was changed");

    let added = control(&place, &["add", "delay", "--axis", letter]);
    assert!(added.status.success(), "{added:?}");
    pipeline.until("the challenger's victory", |_| model.effects().contains(&"delay".to_owned()));
    assert_eq!(control(&place, &["add", "delay", "--axis", letter]).status.code(), Some(1), "it is there already");
    let late = |model: &Model| model.last.axes[model.axis].terms[2].values[0];
    pipeline.until("the delay's value", |_| {
        model.look();
        (late(&model) - 0.02).abs() < 0.004
    });

    // As any file of ours: others may read it, and it stands where its link points.
    let (file, link) = (place.file("saved.toml"), place.file("newest.toml"));
    std::fs::write(&file, "").unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    let mode = || std::fs::metadata(&file).unwrap().permissions().mode();
    let as_any = mode();
    assert!(control(&place, &["save", link.to_str().unwrap()]).status.success());
    assert_eq!(mode(), as_any);
    let saved = workbench::model_file::load(&file, &[]).unwrap();
    assert_eq!(saved.model.axes[model.axis].as_ref().unwrap().effect_ids(), ["scale-factor", "bias", "delay"]);

    // A crash changes nothing.
    let dead = pipeline.pid("compensator").unwrap();
    signal(dead, Signal::KILL);
    pipeline.until("its next life", |p| p.pid("compensator").is_some_and(|pid| pid != dead));
    let epoch = model.last.epoch;
    pipeline.until("its parameters", |_| {
        model.look();
        model.last.epoch >= epoch
    });
    assert!(model.effects().contains(&"delay".to_owned()));

    assert!(control(&place, &["undo"]).status.success());
    pipeline.until("the model before", |_| model.effects() == ["scale-factor", "bias"]);

    for (words, paused) in [("pause", 1), ("resume", 0)] {
        assert!(control(&place, &[words]).status.success());
        pipeline.until(words, |_| {
            model.look();
            model.last.paused == paused
        });
        let is_paused = |status: &Value| status["learning"]["state"] == "paused";
        pipeline.until("the same in the status", |_| {
            place.status("live").is_some_and(|status| is_paused(&status) == (paused == 1))
        });
    }
    assert!(control(&place, &["forget"]).status.success());
    assert!(control(&place, &["hide", "g-sensitivity"]).status.success());
    let wrong = control(&place, &["hide", "delay:q=1"]);
    assert_eq!(wrong.status.code(), Some(1), "{wrong:?}");
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(place.left("live").is_empty(), "{:?}", place.left("live"));
    assert_eq!(control(&place, &["undo"]).status.code(), Some(1), "nothing runs");
}

#[test]
fn status_says_what_learning_waits_for() {
    let place = Place::new();
    let (mut pipeline, mut input) = place.start_fed("waits", &["--speed", "max"]);
    let learning = |says: &str| {
        let status = place.status("waits");
        let learning = status.as_ref().map(|status| &status["learning"]);
        let is_said = learning.and_then(|l| l["says"].as_str()).is_some_and(|text| text.contains(says));
        is_said && learning.is_some_and(|l| l["state"] == "waits")
    };
    // At rest: a scale factor cannot be seen.
    let row = |k: u32| format!("{:.2},{:.5},0.1\n", 0.01 * f64::from(k), 1e-3 * (1e4 * f64::from(k)).sin());
    let rows = |from: u32, until: u32| (from..until).map(row).collect::<String>();
    input.write_all(format!("t,gyro_z,ref_angle_z\n{}", rows(0, 40)).as_bytes()).unwrap();
    pipeline.until("rows", |_| learning("40 of 100 rows are there"));
    input.write_all(rows(40, 1500).as_bytes()).unwrap();
    pipeline.until("motion", |_| learning("scale-factor"));
    drop(input);
    assert_eq!(pipeline.end().code, Some(0));
}

/// Runs a log without learning, and holds what is recorded against what `apply` makes of it; the run's messages.
fn recorded_and_applied(place: &Place, log: &str) -> String {
    let (model, run, apply) = (place.file("m.toml"), place.file("run.csv"), place.file("apply.csv"));
    let model = model.to_str().unwrap();
    let fitted = place.output(&["fit", log, "-o", model]);
    assert!(fitted.status.success(), "{fitted:?}");
    let applied = place.output(&["apply", log, "--model", model, "-o", apply.to_str().unwrap()]);
    assert!(applied.status.success(), "{applied:?}");
    let args = ["--source", log, "--speed", "max", "--model", model, "--freeze", "--record", run.to_str().unwrap()];
    let ended = place.start("record", &args).end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    let (live, offline) = (std::fs::read(&run).unwrap(), std::fs::read(&apply).unwrap());
    assert!(live.len() > 100_000);
    assert!(live == offline, "{} and {} bytes", live.len(), offline.len());
    ended.error
}

#[test]
fn a_recorded_run_is_what_apply_writes() {
    let place = Place::new();
    let path = place.file("log.csv");
    log(&path, 40.0, 9);
    assert!(!recorded_and_applied(&place, path.to_str().unwrap()).contains("faster than read"));
}

#[test]
fn and_so_where_a_recorder_holds_the_encoders_reading() {
    let place = Place::new();
    let path = place.file("held.csv");
    let mut record = spoilt_log(&path, 40.0, 200.0, 9, &[]).record;
    for k in (1..record.len()).filter(|k| k % 5 != 0) {
        record.rows[k].ref_angle = record.rows[k - 1].ref_angle;
    }
    workbench::log::write_record(&path, &record, 0).unwrap();
    let says = recorded_and_applied(&place, path.to_str().unwrap());
    assert!(says.contains("ref_angle_z logged faster than read"), "{says}");
}

#[test]
fn a_compensator_that_is_killed_or_stopped_while_an_effect_is_added_leaves_a_whole_model_and_no_lost_sample() {
    let place = Place::new();
    let config = late_vehicle(&place);
    let mut pipeline = place.start("live", &["--config", config.to_str().unwrap()]);
    let mut model = Model::watch(&mut pipeline);
    let letter = model.letter();
    for blow in [Signal::KILL, Signal::STOP] {
        if model.effects().len() == 3 {
            assert!(control(&place, &["undo"]).status.success());
            pipeline.until("the model before", |_| model.effects() == ["scale-factor", "bias"]);
        }
        let mut asked = place
            .truerate()
            .args(["control", "--instance", "live", "add", "delay", "--axis", letter])
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(150));
        let pid = pipeline.pid("compensator").unwrap();
        signal(pid, blow);
        if blow == Signal::STOP {
            std::thread::sleep(std::time::Duration::from_secs(5));
            signal(pid, Signal::CONT);
        }
        // Done, on trial, or refused because it is there already: answered in every case.
        pipeline.until("an answer", |_| asked.try_wait().unwrap().is_some());
        pipeline.until("a whole model with the effect", |_| {
            let effects = model.effects();
            assert!(effects == ["scale-factor", "bias"] || effects == ["scale-factor", "bias", "delay"], "{effects:?}");
            effects.len() == 3
        });
    }
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert_eq!(counted(&ended.out, "kalman", "lost"), 0, "{}", ended.out);
    assert!(place.left("live").is_empty(), "{:?}", place.left("live"));
}

#[test]
fn an_effect_is_removed_while_the_vehicle_drives() {
    let place = Place::new();
    let config = late_vehicle(&place);
    let mut pipeline = place.start("live", &["--config", config.to_str().unwrap()]);
    let mut model = Model::watch(&mut pipeline);
    let letter = model.letter();
    let refused = |effect: &str, why: &str| {
        let output = control(&place, &["remove", effect, "--axis", letter]);
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(1) && error.contains(why), "{error}");
    };
    refused("delay", "the model has no 'delay'");
    refused("bias", "belongs to the base model");
    assert!(control(&place, &["add", "delay", "--axis", letter]).status.success());
    pipeline.until("the challenger's victory", |_| model.effects().contains(&"delay".to_owned()));
    let said = |order: &[&str]| {
        let output = control(&place, order);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    // Ordered twice it is tried once; what is ordered next ends the trial, for what is on trial has the other effects in it.
    let tried = said(&["add", "supply-voltage", "--axis", letter]);
    assert!(tried.contains("supply-voltage is not better so far"), "{tried}");
    let again = said(&["add", "supply-voltage", "--axis", letter]);
    assert!(again.contains("supply-voltage is on trial already"), "{again}");
    let other = said(&["add", "vibration-tone", "--axis", letter]);
    assert!(other.contains("supply-voltage, which was not better so far, is given up"), "{other}");
    assert!(said(&["undo"]).contains("vibration-tone is not on trial any more"));
    assert_eq!(model.effects(), ["scale-factor", "bias", "delay"]);
    let epoch = model.last.epoch;
    said(&["remove", "delay", "--axis", letter]);
    pipeline.until("the base model", |_| model.effects() == ["scale-factor", "bias"]);
    assert!(model.last.epoch > epoch, "{} after {epoch}", model.last.epoch);
    assert!(control(&place, &["undo"]).status.success());
    pipeline.until("the removed effect", |_| model.effects().contains(&"delay".to_owned()));
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert_eq!(counted(&ended.out, "kalman", "lost"), 0, "{}", ended.out);
}

#[test]
fn a_model_that_cannot_be_kept_does_not_take_over() {
    let place = Place::new();
    let config = late_vehicle(&place);
    let mut pipeline = place.start("live", &["--config", config.to_str().unwrap()]);
    let mut model = Model::watch(&mut pipeline);
    let hub = Hub::join(&pipeline.domain, "onlooker").unwrap();
    let diagnoses = hub.reader(&topic::DIAGNOSIS, None, Wait::Event).unwrap();
    // In the way of the file that every change needs.
    std::fs::create_dir(pipeline.domain.folder().join("parameters-before.toml")).unwrap();
    let added = control(&place, &["add", "delay", "--axis", model.letter()]);
    let error = String::from_utf8(added.stderr).unwrap();
    assert!(added.status.code() == Some(1) && error.contains("parameters-before.toml: cannot be written"), "{error}");
    let mut state = TrialState::None as u32;
    pipeline.until("word of the trial", |_| {
        state = diagnoses.newest().unwrap().map_or(state, |diagnosis| diagnosis.trial.state);
        state > TrialState::OnTrial as u32
    });
    assert_eq!(state, TrialState::GivenUp as u32);
    assert_eq!(model.effects(), ["scale-factor", "bias"]);
    drop((diagnoses, hub));
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(place.left("live").is_empty(), "{:?}", place.left("live"));
}

/// A log with a late gyro, unpaced, to whose model the effect is added on the way, must end in what `truerate add` finds.
fn added_live_and_offline(seconds: f64, rate_hz: f64) {
    let place = Place::new();
    let path = place.file("late.csv");
    let rows = spoilt_log(&path, seconds, rate_hz, 12, &["delay:d=0.012"]).record.len() as u64;
    let (log, base, file) = (path.to_str().unwrap(), place.file("base.toml"), place.file("offline.toml"));
    let base = base.to_str().unwrap();
    let fitted = place.output(&["fit", log, "-o", base]);
    assert!(fitted.status.success(), "{fitted:?}");
    let added = place.output(&["add", log, "delay", "-o", file.to_str().unwrap()]);
    assert!(added.status.success(), "{added:?}");
    let offline = workbench::model_file::load(&file, &[]).unwrap().model;

    let mut pipeline = place.start("live", &["--source", log, "--speed", "max", "--model", base]);
    // The source waits for kalman, so that the command is there before the log is over.
    pipeline.until("kalman", |p| p.pid("kalman").is_some());
    let kalman = pipeline.pid("kalman").unwrap();
    signal(kalman, Signal::STOP);
    pipeline.until("the compensator", |p| p.pid("compensator").is_some());
    // Nor is kalman ended for being silent.
    signal(pipeline.child.id(), Signal::STOP);
    let asked = place
        .truerate()
        .args(["control", "--instance", "live", "add", "delay", "--axis", "z"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_secs(2));
    signal(kalman, Signal::CONT);
    signal(pipeline.child.id(), Signal::CONT);
    let answered = asked.wait_with_output().unwrap();
    assert!(answered.status.success(), "{answered:?}\n{}", pipeline.errors());
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    for process in ["kalman", "compensator"] {
        assert_eq!(counted(&ended.out, process, "in"), rows, "{}", ended.out);
    }
    for term in &offline.axes[2].as_ref().unwrap().terms {
        for (card, value, std_error) in term.parameters(Axis::Z) {
            let name = format!("{}.{}", term.effect.card().id, card.name);
            let (live, _) = parameter(&ended.out, "z", &name);
            assert!((live - value).abs() <= 0.1 * std_error, "{name}: {live} live, {value} ± {std_error} offline");
        }
    }
}

#[test]
fn an_effect_added_live_ends_in_the_parameters_that_add_finds() {
    added_live_and_offline(60.0, 200.0);
}

#[test]
fn and_so_on_a_log_that_is_thinned_while_it_streams() {
    added_live_and_offline(400.0, 100.0);
}

#[test]
#[ignore = "takes four minutes"]
fn and_so_on_half_an_hour_at_1_khz() {
    added_live_and_offline(1800.0, 1000.0);
}
