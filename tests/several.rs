//! Several logs on the real program: of one sensor, and of a fleet.

mod common;

use common::Bench;
use serde_json::Value;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn simulated(bench: &Bench, name: &str, seed: u64, more: &[&str]) {
    let seed = seed.to_string();
    let words = ["simulate", "--seconds", "60", "--axis", "x", "--seed", &seed, "-o", name];
    bench.ok(&[&words, more].concat());
}

fn parameter<'v>(list: &'v Value, effect: &str) -> Option<&'v Value> {
    list.as_array()?.iter().find(|p| p["effect"] == effect)
}

#[test]
fn logs_with_names_of_their_own_are_each_read_by_theirs_and_a_map_that_fits_one_is_told() {
    let bench = Bench::new();
    for (name, header, seed) in [("a.csv", "t,gx,enc", 1), ("b.csv", "time,gyro_x,ref_angle_x", 2)] {
        simulated(&bench, "own.csv", seed, &[]);
        let text = bench.text("own.csv");
        let column = |line: &str, k: usize| line.split(',').nth(k).unwrap().to_owned();
        let head = text.lines().next().unwrap();
        let place = |of: &str| head.split(',').position(|name| name == of).unwrap();
        let places = [place("t"), place("gyro_x"), place("ref_angle_x")];
        let row = |line: &str| places.map(|k| column(line, k)).join(",");
        let rows: Vec<String> = text.lines().skip(1).map(row).collect();
        bench.file(name, format!("{header}\n{}\n", rows.join("\n")));
    }
    let maps = ["--map", "gyro_x=gx", "--map", "ref_angle_x=enc"];
    let outcome = bench.run(&[&["fit", "a.csv", "b.csv", "-o", "m.toml"], &maps[..]].concat());
    assert_eq!(outcome.code, 0, "{outcome:?}");
    for map in ["gyro_x=gx", "ref_angle_x=enc"] {
        assert!(
            outcome.err.contains(&format!("b.csv: read without --map {map}: it has no such channel")),
            "{outcome:?}"
        );
    }
    assert!(!outcome.err.contains("a.csv: read without"), "{outcome:?}");
    let refused = bench.refused(&["fit", "a.csv", "b.csv", "--map", "gyro_x=wx"]);
    assert!(refused.contains("a.csv line 1: --map 'gyro_x=wx': there is no such channel"), "{refused}");
    let refused = bench.refused(&["fit", "b.csv", "a.csv"]);
    assert!(refused.starts_with("truerate: a.csv line 1"), "{refused}");
    // Two sensors beside each other, too.
    let beside = bench.run(&[&["compare", "a.csv", "b.csv", "--side-by-side"], &maps[..]].concat());
    assert!(beside.code == 0 && beside.err.contains("b.csv: read without --map gyro_x=gx"), "{beside:?}");
}

#[test]
fn what_is_read_of_many_logs_is_told_once() {
    let bench = Bench::new();
    let names: Vec<String> = (0..5).map(|k| format!("{k}.csv")).collect();
    for (k, name) in names.iter().enumerate() {
        simulated(&bench, "own.csv", k as u64, &[]);
        bench.file(name, bench.text("own.csv").replacen("t,", "time,", 1));
    }
    let mut words = vec!["evidence"];
    words.extend(names.iter().map(String::as_str));
    let outcome = bench.run(&[words, vec!["-o", "e"]].concat());
    assert_eq!(outcome.code, 0, "{outcome:?}");
    assert_eq!(outcome.err, "0.csv, 1.csv and 3 more: read as --map t=time\n");
}

#[test]
fn what_repeats_is_the_sensors_and_what_does_not_is_the_set_ups() {
    let bench = Bench::new();
    // A delay in all three; the zero of one log steps.
    simulated(&bench, "a.csv", 1, &["--hide", "delay:d=0.012"]);
    simulated(&bench, "b.csv", 2, &["--hide", "delay:d=0.012"]);
    simulated(&bench, "c.csv", 3, &["--hide", "delay:d=0.012", "bias-step:j=0.02,t0=31"]);
    let found = json(&bench.ok(&["diagnose", "a.csv", "b.csv", "c.csv", "--format", "json"]));
    assert_eq!(found["schema"], "truerate.diagnosis/1");
    assert_eq!(found["logs"].as_array().map(Vec::len), Some(3), "{found}");
    let axis = &found["axes"][0];
    assert_eq!(axis["verdict"], "missing-effect", "{}", axis["headline"]);
    assert_eq!(axis["suspects"][0]["effect"], "delay");
    assert!(
        axis["says"].as_str().is_some_and(|says| !says.contains("bias-step")) && axis["missing"].is_null(),
        "{axis}"
    );
    let delay = &axis["suspects"][0]["parameters"][0];
    let (value, error) = (delay["value"].as_f64().unwrap(), delay["std_error"].as_f64().unwrap());
    assert!((value - 0.012).abs() < 4.0 * error && error < 5e-5, "{value} ± {error}");
    let said = axis["headline"].as_str().unwrap();
    assert!(said.contains("It is so in all three logs."), "{said}");
    assert!(said.contains("Only in c.csv") && said.contains("not of the sensor"), "{said}");
    let repeats = found["repeats"].as_array().unwrap();
    let of = |effect: &str| &repeats.iter().find(|r| r["effect"] == effect).unwrap()["of"];
    assert_eq!((of("delay"), of("bias-step")), (&Value::from("sensor"), &Value::from("set-up")), "{repeats:?}");
    // Each log's own zero, and its own budget.
    let biases: Vec<f64> = found["each"]
        .as_array()
        .unwrap()
        .iter()
        .map(|own| parameter(&own["axes"][0]["parameters"], "bias").unwrap()["value"].as_f64().unwrap())
        .collect();
    assert!(biases.len() == 3 && biases.windows(2).all(|pair| pair[0] != pair[1]), "{biases:?}");
    assert!(found["each"][1]["axes"][0]["budget"].as_array().is_some_and(|budget| !budget.is_empty()));
}

/// A delay that is another in each log belongs to what was changed between them: each has its own, and nothing is named in its stead.
#[test]
fn an_effect_of_another_size_in_each_log_has_its_own_size_in_each() {
    let bench = Bench::new();
    simulated(&bench, "a.csv", 5, &["--hide", "delay:d=0.010"]);
    simulated(&bench, "c.csv", 6, &["--hide", "delay:d=0.020"]);
    let found = json(&bench.ok(&["diagnose", "a.csv", "c.csv", "--format", "json"]));
    let axis = &found["axes"][0];
    assert_eq!(axis["verdict"], "missing-effect", "{}", axis["headline"]);
    assert_eq!(axis["suspects"].as_array().map(Vec::len), Some(1), "{}", axis["headline"]);
    assert_eq!(axis["suspects"][0]["effect"], "delay");
    let says = found["repeats"][0]["says"].as_str().unwrap_or_default();
    assert!(says.contains("in a.csv and") && says.contains("in c.csv"), "{says}");
    for (k, truth) in [(0, 0.010), (1, 0.020)] {
        let own = parameter(&found["each"][k]["axes"][0]["alone"], "delay").unwrap_or_else(|| panic!("{found}"));
        let (value, error) = (own["value"].as_f64().unwrap(), own["std_error"].as_f64().unwrap());
        assert!((value - truth).abs() < 5.0 * error && error < 1e-4, "{value} ± {error}");
    }
}

/// The answer says nothing twice, and gives no log the value of another.
#[test]
fn an_effect_that_only_single_logs_have_is_said_with_the_logs_that_have_it() {
    let bench = Bench::new();
    simulated(&bench, "a.csv", 17, &["--hide", "scale-asymmetry:a=0.01"]);
    simulated(&bench, "b.csv", 21, &["--hide", "scale-asymmetry:a=-0.01"]);
    simulated(&bench, "c.csv", 13, &["--hide", "delay:d=0.015"]);
    let headline = |logs: [&str; 2]| {
        let found = json(&bench.ok(&["diagnose", logs[0], logs[1], "--format", "json"]));
        found["axes"][0]["headline"].as_str().unwrap().to_owned()
    };
    let opposite = headline(["a.csv", "b.csv"]);
    assert!(opposite.contains("By log: ") && opposite.contains("in a.csv and −"), "{opposite}");
    assert!(opposite.contains("of those set-ups, not of the sensor"), "{opposite}");
    let each = headline(["a.csv", "c.csv"]);
    let [first, other] = if each.contains("It is so only in a.csv") { ["a.csv", "c.csv"] } else { ["c.csv", "a.csv"] };
    assert!(
        each.contains(&format!("It is so only in {first}")) && each.contains(&format!("Only in {other}: ")),
        "{each}"
    );
    let once = |text: &str| each.matches(text).count() == 1;
    assert!(once("in the positive direction") && once("ms late"), "{each}");
}

/// A log with its gyro multiplied.
fn multiplied(bench: &Bench, from: &str, to: &str, factor: f64) {
    let text = std::fs::read_to_string(bench.path(from)).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let column = header.split(',').position(|name| name == "gyro_x").unwrap();
    let row = |line: &str| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        fields[column] = fields[column].parse::<f64>().map_or(String::new(), |x| format!("{:.7}", factor * x));
        fields.join(",")
    };
    let rows: Vec<String> = std::iter::once(header.to_owned()).chain(lines.map(row)).collect();
    std::fs::write(bench.path(to), rows.join("\n") + "\n").unwrap();
}

fn headline_of(bench: &Bench, logs: &[&str]) -> (Value, String) {
    let words = [&["diagnose"], logs, &["--format", "json"]].concat();
    let found = json(&bench.ok(&words));
    let axis = found["axes"].as_array().unwrap().iter().find(|axis| axis["axis"] == "x").unwrap().clone();
    let says = axis["headline"].as_str().unwrap().to_owned();
    (axis, says)
}

/// Two sensors, or another ratio of the reference: it is said, and no effect is named in its stead.
#[test]
#[ignore = "long: tests/nightly"]
fn scale_factors_that_differ_are_said_and_nothing_is_named_for_them() {
    let bench = Bench::new();
    simulated(&bench, "a.csv", 31, &[]);
    simulated(&bench, "b.csv", 32, &[]);
    multiplied(&bench, "b.csv", "c.csv", 1.01);
    let (axis, says) = headline_of(&bench, &["a.csv", "c.csv"]);
    assert_eq!(axis["verdict"], "adequate", "{says}");
    assert!(says.contains("The scale factor is not the same in each"), "{says}");
    let (axis, says) = headline_of(&bench, &["a.csv", "b.csv"]);
    assert!(axis["verdict"] == "adequate" && !says.contains("The scale factor"), "{says}");
    // What one log has besides makes its scale factor no other one.
    simulated(&bench, "d.csv", 38, &["--hide", "cubic-nonlinearity"]);
    let (axis, says) = headline_of(&bench, &["a.csv", "d.csv"]);
    assert!(axis["suspects"][0]["effect"] == "cubic-nonlinearity" && !says.contains("The scale factor"), "{says}");
}

#[test]
fn a_log_whose_data_are_at_fault_is_left_out_and_the_others_are_judged() {
    let bench = Bench::new();
    simulated(&bench, "a.csv", 33, &["--hide", "delay:d=0.009"]);
    simulated(&bench, "b.csv", 34, &["--hide", "delay:d=0.009"]);
    multiplied(&bench, "a.csv", "turned.csv", -1.0);
    let (axis, says) = headline_of(&bench, &["a.csv", "b.csv", "turned.csv"]);
    assert!(says.contains("turned.csv is left out: ") && says.contains("It is so in both logs."), "{says}");
    let delay = axis["suspects"][0]["parameters"][0]["value"].as_f64().unwrap();
    assert!(axis["suspects"][0]["effect"] == "delay" && (delay - 0.009).abs() < 1e-4, "{says}");
    let faults = axis["data_faults"].as_array().unwrap();
    assert!(faults.iter().any(|fault| fault["says"].as_str().is_some_and(|says| says.starts_with("turned.csv: "))));
}

#[test]
fn what_the_logs_of_one_axis_share_is_told_beside_a_log_of_another_axis() {
    let bench = Bench::new();
    let hidden = ["--hide", "delay:d=0.009"];
    simulated(&bench, "a.csv", 35, &hidden);
    simulated(&bench, "b.csv", 36, &hidden);
    bench.ok(&[&["simulate", "--seconds", "60", "--axis", "z", "--seed", "37", "-o", "z.csv"][..], &hidden].concat());
    let (_, says) = headline_of(&bench, &["a.csv", "b.csv", "z.csv"]);
    assert!(says.contains("It is so in both logs that have the axis.") && !says.contains("does not repeat"), "{says}");
}

#[test]
fn one_model_is_fitted_to_all_and_its_error_is_smaller_than_that_of_one_log() {
    let bench = Bench::new();
    for (name, seed) in [("a.csv", 11), ("b.csv", 12), ("c.csv", 13), ("d.csv", 14)] {
        simulated(&bench, name, seed, &[]);
    }
    let truth = bench.text("a.csv.truth.toml");
    let alpha = |text: &str| -> (f64, f64) {
        let line = text.lines().find(|line| line.starts_with("scale-factor.alpha")).unwrap();
        let number = |key: &str| {
            let rest = line.split_once(&format!("{key} = ")).map_or("nan", |(_, rest)| rest);
            rest.split([',', ' ', '}']).next().unwrap().parse::<f64>().unwrap()
        };
        (number("value"), number("std_error"))
    };
    bench.ok(&["fit", "a.csv", "-o", "one.toml"]);
    bench.ok(&["fit", "a.csv", "b.csv", "c.csv", "d.csv", "-o", "all.toml"]);
    let (one, all) = (alpha(&bench.text("one.toml")), alpha(&bench.text("all.toml")));
    let wanted = alpha(&truth).0;
    assert!((all.0 - wanted).abs() < 4.0 * all.1, "{all:?} {wanted}");
    assert!(all.1 < 0.7 * one.1, "{all:?} {one:?}");
    let model = bench.text("all.toml");
    assert!(model.contains("log = \"a.csv + 3 more\"") && model.contains("samples = 24000"), "{model}");
    let compared = json(&bench.ok(&["compare", "a.csv", "b.csv", "--model", "all.toml", "--format", "json"]));
    assert_eq!(compared["logs"].as_array().map(Vec::len), Some(2));
    assert!(compared["axes"][0]["error_over_floor"].as_f64().unwrap() < 1.5, "{}", compared["axes"][0]["headline"]);
}

#[test]
fn a_ladder_over_several_logs_adds_what_all_show() {
    let bench = Bench::new();
    for (name, seed) in [("a.csv", 21), ("b.csv", 22), ("c.csv", 23)] {
        simulated(&bench, name, seed, &["--hide", "delay:d=0.02"]);
    }
    let ladder = json(&bench.ok(&["ladder", "a.csv", "b.csv", "c.csv", "--format", "json", "-o", "m.toml"]));
    assert_eq!(ladder["schema"], "truerate.ladder/1");
    let axis = &ladder["axes"][0];
    assert_eq!(axis["steps"][1]["added"], "delay", "{ladder}");
    assert_eq!(axis["verdict"], "adequate", "{}", axis["headline"]);
    assert!(bench.text("m.toml").contains("delay.d = { value = 0.0"), "{}", bench.text("m.toml"));
    let text = bench.ok(&["ladder", "a.csv", "b.csv", "c.csv"]);
    assert!(text.contains("3 logs of one sensor"), "{text}");
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_small_asymmetry_that_single_logs_call_adequate_is_found_by_several() {
    let bench = Bench::new();
    let names: Vec<String> = (0..12).map(|k| format!("{k}.csv")).collect();
    for (name, seed) in names.iter().zip(100..) {
        simulated(&bench, name, seed, &["--hide", "scale-asymmetry:a=0.00005"]);
    }
    let adequate = names
        .iter()
        .filter(|name| json(&bench.ok(&["diagnose", name, "--format", "json"]))["axes"][0]["verdict"] == "adequate");
    assert!(adequate.count() >= 8);
    let words: Vec<&str> =
        std::iter::once("diagnose").chain(names.iter().map(String::as_str)).chain(["--format", "json"]).collect();
    let axis = json(&bench.ok(&words))["axes"][0].clone();
    assert_eq!(axis["suspects"][0]["effect"], "scale-asymmetry", "{}", axis["headline"]);
    let a = &axis["suspects"][0]["parameters"][0];
    let (value, error) = (a["value"].as_f64().unwrap(), a["std_error"].as_f64().unwrap());
    assert!((value - 5e-5).abs() < 4.0 * error && error < 1.5e-5, "{value} ± {error}");
}

#[test]
fn a_log_that_is_given_twice_and_standard_input_among_several_are_refused() {
    let bench = Bench::new();
    simulated(&bench, "a.csv", 1, &[]);
    std::fs::copy(bench.path("a.csv"), bench.path("b.csv")).unwrap();
    let twice = bench.refused(&["fit", "a.csv", "b.csv"]);
    assert!(twice.contains("is the same log as a.csv"), "{twice}");
    assert!(bench.refused(&["fit", "a.csv", "-"]).contains("standard input is one log"));
    assert!(bench.refused(&["fit", "a.csv", "c.csv"]).contains("c.csv"));
}
