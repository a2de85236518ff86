//! The offline commands on the real program: what one writes the next one reads.

#![allow(clippy::format_push_string)] // made once, for the test

mod common;

use common::{Bench, log};
use serde_json::Value;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// (value, standard error) of a parameter on the first axis of a diagnosis.
fn parameter(diagnosis: &Value, effect: &str, name: &str) -> (f64, f64) {
    let parameters = diagnosis["axes"][0]["parameters"].as_array().unwrap();
    let found = parameters.iter().find(|p| p["effect"] == effect && p["name"] == name);
    let found = found.unwrap_or_else(|| panic!("no {effect}.{name} in {diagnosis}"));
    (found["value"].as_f64().unwrap(), found["std_error"].as_f64().unwrap())
}

#[test]
fn a_simulated_log_is_made_again_from_its_seed_and_fit_finds_its_truth() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "60", "--seed", "5", "-o", "a.csv.gz"]);
    bench.ok(&["simulate", "--seconds", "60", "--seed", "5", "-o", "b.csv.gz"]);
    assert!(std::fs::read(bench.path("a.csv.gz")).unwrap() == std::fs::read(bench.path("b.csv.gz")).unwrap());
    let truth =
        json(&bench.ok(&["compare", "a.csv.gz", "--model", "a.csv.gz.truth.toml", "--axis", "x", "--format", "json"]));
    let fitted = json(&bench.ok(&["fit", "a.csv.gz", "--axis", "x", "--format", "json", "-o", "m.toml"]));
    for (effect, name) in [("scale-factor", "alpha"), ("bias", "delta")] {
        let ((wanted, _), (found, error)) = (parameter(&truth, effect, name), parameter(&fitted, effect, name));
        assert!((found - wanted).abs() < 5.0 * error, "{effect}.{name}: {found} ± {error}, true {wanted}");
    }
    let model = bench.text("m.toml");
    assert!(model.contains("log = \"a.csv.gz\"") && model.contains("samples = 6000"), "{model}");
}

#[test]
fn the_truth_beside_a_log_holds_what_was_hidden() {
    let bench = Bench::new();
    let out = bench.ok(&["simulate", "--seconds", "20", "--hide", "delay:d=0.012", "lag", "-o", "late.csv"]);
    assert!(out.contains("hidden: delay, lag"), "{out}");
    let truth = bench.text("late.csv.truth.toml");
    assert!(truth.contains("delay.d = { value = 0.012"), "{truth}");
    assert!(truth.contains("effects = [\"scale-factor\", \"bias\", \"delay\", \"lag\"]"), "{truth}");
    let twice = bench.run(&["simulate", "--hide", "dely", "-o", "x.csv"]);
    assert!(twice.refusal("dely").contains("no effect 'dely'"));
    assert!(bench.refused(&["simulate", "--hide", "delay:d=99", "-o", "x.csv"]).contains("d = 99 lies outside"));
}

#[test]
fn a_missing_delay_is_named_added_and_taken_out_again() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "60", "--rate", "100", "--hide", "delay:d=0.02", "-o", "log.csv.gz"]);
    let found = bench.run(&[
        "diagnose",
        "log.csv.gz",
        "--axis",
        "x",
        "--format",
        "json",
        "--fail-on",
        "ambiguous,missing-effect",
        "--fail-on",
        "bad-data",
    ]);
    assert_eq!(found.code, 3, "{found:?}");
    assert_eq!(json(&found.out)["axes"][0]["suspects"][0]["effect"], "delay", "{}", found.out);
    bench.ok(&["add", "log.csv.gz", "delay", "--axis", "x", "-o", "m.toml"]);
    let model = bench.text("m.toml");
    assert!(model.contains("effects = [\"scale-factor\", \"bias\", \"delay\"]"), "{model}");
    let needless = bench.ok(&["add", "log.csv.gz", "clock-skew", "--axis", "x", "--model", "m.toml"]);
    let words = needless.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("clock-skew is less than 2 standard errors from zero"), "{needless}");
    assert!(!needless.contains("delay and"), "{needless}");
    let again = bench.refused(&["add", "log.csv.gz", "delay", "--axis", "x", "--model", "m.toml"]);
    assert!(again.contains("has 'delay' already"), "{again}");
    bench.ok(&["remove", "log.csv.gz", "delay", "--axis", "x", "--model", "m.toml", "-o", "without.toml"]);
    assert!(!bench.text("without.toml").contains("delay"));
    assert!(bench.text("without.toml").contains("epoch = 2"), "{}", bench.text("without.toml"));
    let ladder = json(&bench.ok(&["ladder", "log.csv.gz", "--axis", "x", "--format", "json", "-o", "top.toml"]));
    let again = bench.run(&["fit", "log.csv.gz", "--axis", "x", "--model", "top.toml", "-o", "top.toml"]);
    assert!(again.err.contains("top.toml: replaced an existing file"), "{again:?}");
    let enough = &["diagnose", "log.csv.gz", "--axis", "x", "--model", "top.toml", "--fail-on", "adequate"];
    assert_eq!(bench.run(enough).code, 3);
    assert_eq!(ladder["schema"], "truerate.ladder/1");
    assert_eq!(ladder["axes"][0]["steps"][1]["added"], "delay", "{ladder}");
    assert!(bench.text("top.toml").contains("delay.d"));
}

#[test]
fn a_report_is_written_in_the_form_of_its_ending_whatever_is_printed() {
    let bench = Bench::new();
    bench.file("log.csv", log(1000));
    for (report, begins) in [("r.html", "<!doctype html>"), ("r.json", "{"), ("r.txt", "")] {
        let out = bench.ok(&["compare", "log.csv", "--report", report]);
        let text = bench.text(report);
        assert!(text.to_lowercase().trim_start().starts_with(begins), "{report}: {text:.80}");
        assert!(!out.trim_start().starts_with(['<', '{']) && out.contains("axis z"), "{out}");
    }
    assert_eq!(json(&bench.text("r.json"))["schema"], "truerate.diagnosis/1");
}

#[test]
fn two_models_of_three_axes_stand_in_one_table_and_what_the_axes_share_is_said_once() {
    let bench = Bench::new();
    let made = |seed: &str, name: &str| {
        let words = ["--reference", "orientation", "--seconds", "30", "--seed", seed, "-o", name];
        bench.ok(&[&["simulate", "--hide", "delay:d=0.02"], &words[..]].concat());
    };
    made("5", "log.csv");
    made("6", "other.csv");
    bench.ok(&["fit", "log.csv", "-o", "base.toml"]);
    bench.ok(&["add", "log.csv", "delay", "-o", "new.toml"]);
    let compare = |model: &str, against: &str, form: &str| {
        bench.ok(&["compare", "other.csv", "--model", model, "--against", against, "--format", form])
    };
    let text = compare("new.toml", "base.toml", "text");
    assert_eq!(text.matches("ms late, on all three axes").count(), 1, "{text}");
    let rows: Vec<&str> =
        text.lines().skip_while(|line| !line.starts_with("axis  this model is")).skip(1).take(3).collect();
    for (row, axis) in rows.iter().zip(["x", "y", "z"]) {
        let cells: Vec<&str> = row.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect();
        assert_eq!(cells[..2], [axis, "better"], "{text}");
        assert!(cells[2].contains(" → ") && cells[2].ends_with("noise") && cells[3].ends_with(" °/s"), "{row}");
    }
    assert_eq!(rows.len(), 3, "{text}");
    assert!(text.contains("With new.toml in place of base.toml the error over"), "{text}");
    let both = json(&compare("base.toml", "new.toml", "json"));
    let standings: Vec<&str> =
        both["beside"].as_array().unwrap().iter().map(|b| b["standing"].as_str().unwrap()).collect();
    assert_eq!(standings, ["worse"; 3]);
    for beside in both["beside"].as_array().unwrap() {
        assert!(beside["error"].as_f64() > beside["other_error"].as_f64(), "{beside}");
    }
    assert_eq!(both["shared"][0]["effect"], "delay");
    let same = json(&compare("new.toml", "new.toml", "json"));
    assert!(same["beside"].as_array().unwrap().iter().all(|b| b["standing"] == "same"), "{}", same["beside"]);
    assert_eq!(same["shared"].as_array().map(Vec::len), Some(0));
    assert!(compare("new.toml", "base.toml", "html").contains("this model is"));
}

#[test]
fn compare_holds_two_models_against_the_same_samples() {
    let bench = Bench::new();
    bench.file("log.csv", log(2000));
    bench.ok(&["fit", "log.csv", "-o", "a.toml"]);
    bench.ok(&["add", "log.csv", "delay", "--model", "a.toml", "-o", "b.toml"]);
    let compare = ["compare", "log.csv", "--model", "a.toml", "--against", "b.toml"];
    let with = |more: &[&str]| bench.ok(&[&compare, more].concat());
    let out = with(&[]);
    assert!(out.contains("a.toml") && out.contains("b.toml"), "{out}");
    let both = json(&with(&["--format", "json"]));
    let at = |axes: &Value| axes[0]["error_curve"][0]["tau_s"].as_f64().unwrap();
    assert_eq!(at(&both["axes"]), at(&both["against"]["axes"]), "the same samples");
    assert_eq!(both["against"]["model"], "b.toml");
    let effects = |axes: &Value| axes[0]["effects"].as_array().unwrap().len();
    assert_eq!(effects(&both["axes"]) + 1, effects(&both["against"]["axes"]));
    let page = with(&["--format", "html"]);
    assert!(page.contains("a.toml") && page.contains("b.toml") && !page.contains("{{"), "{page:.300}");
}

#[test]
fn apply_undoes_scale_and_bias_and_keeps_the_logs_own_clock() {
    let bench = Bench::new();
    // Twice the rate and a bias of a quarter: ω = 0.5 · reading − 0.125, on an epoch clock in nanoseconds.
    let mut text = String::from("t_ns,gyro_y\n");
    for k in 0..200_i64 {
        text.push_str(&format!("{},{}\n", 1_763_700_000_123_456_789 + k * 10_000_000, 2.0 * (k as f64) + 0.25));
    }
    bench.file("log.csv", text);
    bench.file(
        "m.toml",
        "schema = \"truerate.model/1\"\n[axis.y]\neffects = [\"scale-factor\", \"bias\"]\n[axis.y.parameters]\n\
         scale-factor.alpha = { value = 0.5, unit = \"1\" }\nbias.delta = { value = -0.125, unit = \"rad/s\" }\n",
    );
    let out = bench.ok(&["apply", "log.csv", "--model", "m.toml"]);
    let mut lines = out.lines();
    assert_eq!(lines.next(), Some("t,rate_y,rate_filtered_y,rate_std_y,angle_y,angle_fused_y"));
    for (k, line) in (0_i64..).zip(lines) {
        let fields: Vec<&str> = line.split(',').collect();
        let nanoseconds = 123_456_789 + k * 10_000_000;
        let wanted = format!("{}.{:09}", 1_763_700_000 + nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        assert_eq!(fields[0], wanted.trim_end_matches('0'));
        let rate: f64 = fields[1].parse().unwrap();
        assert!((rate - k as f64).abs() < 1e-12, "{line}");
    }
    bench.ok(&["apply", "log.csv", "--model", "m.toml", "-o", "out.csv"]);
    assert_eq!(bench.text("out.csv"), out);
    let refused = bench.refused(&["apply", "log.csv", "--model", "m.toml", "--axis", "x"]);
    assert!(refused.contains("the log has gyro y, the model y"), "{refused}");
}

#[test]
fn a_row_without_a_reading_has_no_rate_and_every_row_that_is_left_out_is_told() {
    let bench = Bench::new();
    let mut rows: Vec<String> = log(600).lines().map(str::to_owned).collect();
    for row in &mut rows[201..231] {
        let fields: Vec<&str> = row.split(',').collect();
        *row = format!("{},,{}", fields[0], fields[2]);
    }
    rows.insert(402, rows[401].clone());
    bench.file("log.csv", rows.join("\n") + "\n");
    bench.file(
        "m.toml",
        "schema = \"truerate.model/1\"\n[axis.z]\neffects = [\"scale-factor\", \"bias\"]\n[axis.z.parameters]\n\
         scale-factor.alpha = { value = 1.0, unit = \"1\" }\nbias.delta = { value = 0.0, unit = \"rad/s\" }\n",
    );
    for place in ["-", "out.csv"] {
        let outcome = bench.run(&["apply", "log.csv", "--model", "m.toml", "-o", place]);
        let text = if place == "-" { outcome.out.clone() } else { bench.text(place) };
        let rates: Vec<bool> = text.lines().skip(1).map(|line| !line.split(',').nth(1).unwrap().is_empty()).collect();
        assert_eq!(rates.len(), 600, "{outcome:?}");
        assert!((0..600).all(|k| rates[k] != (200..230).contains(&k)), "{text}");
        assert!(text.lines().skip(1).all(|line| !line.split(',').nth(2).unwrap().is_empty()), "the filter predicts");
        for told in [
            "log.csv: 30 rows have no reading of gyro_z (first at 2.00 s): their rate_z is empty",
            "log.csv: data fault time-going-back (first at 4.00 s): the time repeats or goes back in 1 row: left out (first at line 403)",
        ] {
            assert!(outcome.err.contains(told), "{told}: {outcome:?}");
        }
    }
}

#[test]
fn foreign_headers_and_units_are_renamed_by_a_column_map() {
    let bench = Bench::new();
    bench.file("log.csv", log(300));
    let mut foreign = String::from("\"time, s\",IMU gz (°/s),enc\n");
    for line in log(300).lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        foreign.push_str(&format!("{},{},{}\n", v[0], v[1].to_degrees(), v[2].to_degrees()));
    }
    bench.file("foreign.csv", foreign);
    let map = "\"time, s\" = \"t\"\n\"IMU gz (°/s)\" = \"gyro_z_dps\"\nref_angle_z_deg = \"enc\"\n";
    bench.file("map.toml", map);
    let ours = json(&bench.ok(&["fit", "log.csv", "--format", "json"]));
    let theirs = json(&bench.ok(&["fit", "foreign.csv", "--columns", "map.toml", "--format", "json"]));
    let ((a, _), (b, _)) = (parameter(&ours, "scale-factor", "alpha"), parameter(&theirs, "scale-factor", "alpha"));
    assert!((a - b).abs() < 1e-6, "{a} {b}");
    bench.file("wrong.toml", map.replace("IMU gz", "IMU gy"));
    let outcome = bench.run(&["fit", "foreign.csv", "--columns", "wrong.toml"]);
    assert_eq!(outcome.code, 1);
    assert!(outcome.err.contains("wrong.toml line 2 column 1") && outcome.err.contains('^'), "{outcome:?}");
}

#[test]
fn an_adequate_model_whose_bias_has_moved_is_not_applied_as_it_was() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "60", "--seed", "5", "-o", "log.csv"]);
    bench.ok(&["fit", "log.csv", "--axis", "x", "-o", "m.toml"]);
    let shifted = |line: &str| {
        let (t, rest) = line.split_once(',').unwrap();
        let (gyro, rest) = rest.split_once(',').unwrap();
        gyro.parse::<f64>().map_or_else(|_| format!("{line}\n"), |gyro| format!("{t},{},{rest}\n", gyro + 0.02))
    };
    let moved: String = bench.text("log.csv").lines().map(shifted).collect();
    bench.file("moved.csv", moved);
    let says = bench.ok(&["diagnose", "moved.csv", "--axis", "x", "--model", "m.toml"]);
    assert!(says.contains("`bias.delta` is not what the model file says"), "{says}");
    assert!(says.contains("next  truerate fit moved.csv --model m.toml --axis x -o model.toml"), "{says}");
    let same = bench.ok(&["diagnose", "log.csv", "--axis", "x", "--model", "m.toml"]);
    assert!(!same.contains("is not what the model file says"), "{same}");
}

#[test]
fn a_users_own_effect_is_added_like_any_other() {
    let bench = Bench::new();
    let mut text = String::from("t,gyro_z,ref_angle_z,load\n");
    for (k, line) in log(3000).lines().skip(1).enumerate() {
        let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let load = (0.4 * v[0]).sin() + 0.3 * (k as f64 * 0.002).cos();
        text.push_str(&format!("{},{},{},{load}\n", v[0], v[1] + 0.05 * load, v[2]));
    }
    bench.file("log.csv", text);
    bench.ok(&["fit", "log.csv", "-o", "base.toml"]);
    let own =
        "\n[effect.load-bias]\nregressor = \"k * load\"\nparameters = { k = { unit = \"rad/s\", typical = 0.01 } }\n";
    bench.file("own.toml", bench.text("base.toml") + own);
    bench.ok(&["add", "log.csv", "load-bias", "--model", "own.toml", "-o", "new.toml"]);
    let fitted = json(&bench.ok(&["compare", "log.csv", "--model", "new.toml", "--format", "json"]));
    let (k, _) = parameter(&fitted, "load-bias", "k");
    assert!((k - 0.05).abs() < 0.005, "{k}");
    let diagnosis = json(&bench.ok(&["diagnose", "log.csv", "--model", "own.toml", "--format", "json"]));
    assert_eq!(diagnosis["axes"][0]["suspects"][0]["effect"], "load-bias", "{diagnosis}");
    for (regressor, says) in
        [("k / (0 * load)", "no finite value"), ("k * 1", "is the same as what the model has already")]
    {
        bench.file(
            "vain.toml",
            bench.text("new.toml") + &own.replace("k * load", regressor).replace("load-bias", "vain"),
        );
        let diagnosis = json(&bench.ok(&["diagnose", "log.csv", "--model", "vain.toml", "--format", "json"]));
        let told = diagnosis["axes"][0]["says"].as_str().unwrap();
        assert!(told.contains("Your `vain`") && told.contains(says), "{told}");
    }
    let outcome = bench.run(&["apply", "log.csv", "--model", "new.toml", "-o", "out.csv"]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    bench.file("no-load.csv", log(300));
    let outcome = bench.run(&["apply", "no-load.csv", "--model", "new.toml"]);
    assert!(outcome.code == 1 && outcome.err.contains("load") && outcome.err.contains('^'), "{outcome:?}");
}

#[test]
fn every_effect_has_a_card() {
    let bench = Bench::new();
    let list = bench.ok(&["effects"]);
    for effect in gyro_model::effects::CATALOGUE {
        let id = effect.card().id;
        assert!(list.contains(id), "{id} is not listed");
        assert!(bench.ok(&["effects", id]).contains(effect.card().equation), "{id}");
    }
    assert!(bench.refused(&["effects", "dely"]).contains("did you mean 'delay'"));
}

#[test]
fn a_limit_that_is_added_is_read_off_the_readings() {
    let bench = Bench::new();
    for (id, hidden, value) in [("dead-zone", "dead-zone:w=0.05", 0.05), ("saturation", "saturation:l=0.9", 0.9)] {
        bench.ok(&["simulate", "--motion", "drive", "--seconds", "60", "--hide", hidden, "-o", "log.csv.gz"]);
        bench.ok(&["add", "log.csv.gz", id, "--axis", "x", "-o", "m.toml"]);
        let model: toml::Table = bench.text("m.toml").parse().unwrap();
        let parameters = model["axis"]["x"]["parameters"].as_table().unwrap();
        let name = if id == "dead-zone" { "w" } else { "l" };
        let found = parameters[id][name]["value"].as_float().unwrap();
        assert!((found - value).abs() < 0.02 * value, "{id}: {found}, hidden {value}");
    }
}

#[test]
fn the_shape_of_an_effect_that_is_added_is_found_in_the_log_or_it_is_refused() {
    let bench = Bench::new();
    let hidden = "mount-resonance:f=9";
    bench.ok(&["simulate", "--motion", "drive", "--seconds", "60", "--hide", hidden, "-o", "log.csv.gz"]);
    bench.ok(&["add", "log.csv.gz", "mount-resonance", "--axis", "x", "-o", "m.toml"]);
    let model: toml::Table = bench.text("m.toml").parse().unwrap();
    let found = model["axis"]["x"]["parameters"]["mount-resonance"]["f"]["value"].as_float().unwrap();
    assert!((found - 9.0).abs() < 0.5, "{found}");
    bench.ok(&["compare", "log.csv.gz", "--model", "m.toml"]);
    let refused = bench.refused(&["add", "log.csv.gz", "saturation", "--axis", "x", "-o", "s.toml"]);
    assert!(refused.contains("saturation") && refused.contains("nothing"), "{refused}");
    assert!(!bench.path("s.toml").exists());
}

#[test]
fn each_suspect_is_explained_test_by_test() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "60", "--rate", "100", "--hide", "delay:d=0.02", "-o", "log.csv.gz"]);
    let diagnose = ["diagnose", "log.csv.gz", "--axis", "x", "--explain"];
    let found = json(&bench.ok(&[&diagnose[..], &["--format", "json"]].concat()));
    let explained = found["axes"][0]["explained"].as_array().unwrap();
    let delay = explained.iter().find(|one| one["effect"] == "delay").unwrap();
    assert_eq!(delay["stage"], "admitted", "{delay}");
    let refused: Vec<&Value> = explained.iter().filter(|one| one["stage"] == "refit").collect();
    let fails = |one: &&Value| one["tests"].as_array().unwrap().iter().any(|test| test["passed"] == false);
    assert!(refused.iter().all(fails), "what is refused fails a test: {refused:?}");
    let condition = &delay["tests"][1]["ways"][0][0];
    assert!(condition["value"].as_f64().unwrap() < condition["threshold"].as_f64().unwrap(), "{condition}");
    assert!(explained.iter().any(|one| one["stage"] == "scan"), "what was not refitted is told too");
    let full = bench.ok(&["diagnose", "log.csv.gz", "--axis", "x", "--explain", "full"]);
    assert!(full.contains("why each effect is named") && full.contains("passes every test"), "{full}");
    assert!(full.contains("asked above"), "the numbers: {full}");
}

#[test]
fn each_suspect_has_one_plain_sentence() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "60", "--rate", "100", "--hide", "delay:d=0.02", "-o", "log.csv.gz"]);
    // The flag before the log: what follows it is the log.
    let text = bench.ok(&["diagnose", "--explain", "log.csv.gz", "--axis", "x"]);
    let (_, explained) = text.split_once("why each effect is named, or is not\n").unwrap();
    let (explained, _) = explained.split_once("\n\n").unwrap();
    let sentence = |effect: &str| {
        let from = explained.find(effect).unwrap_or_else(|| panic!("{effect}: {explained}"));
        explained[from..].trim().to_owned()
    };
    assert!(sentence("delay").contains("can be it"), "{explained}");
    // Those of which the same is to be said are told together.
    assert!(sentence("others").contains("not named:") && sentence("others").contains("supply-voltage"), "{explained}");
    assert!(!explained.contains("asked above") && !explained.contains("ln L"), "no numbers of tests: {explained}");
}

#[test]
fn a_report_is_shown_in_a_browser_or_it_is_said_where_it_is() {
    let bench = Bench::new();
    bench.file("log.csv", log(4000));
    bench.file("browser.sh", "#!/bin/sh\ncp \"$1\" shown.html\n");
    let with = |browser: &str, words: &[&str]| {
        let mut command = bench.command(words);
        command
            .env("BROWSER", browser)
            .env("TMPDIR", bench.path("."))
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY");
        common::Outcome::of(&command.output().unwrap())
    };
    let shown = with("sh browser.sh %s", &["diagnose", "log.csv", "--open"]);
    assert_eq!(shown.code, 0, "{shown:?}");
    assert!(shown.out.contains("Which physics is missing") && shown.err.contains("in the browser: "), "{shown:?}");
    assert!(bench.text("shown.html").contains("<html"), "the page itself is shown");
    for words in [&["ladder", "log.csv"][..], &["compare", "log.csv"]] {
        let none = with("no-such-browser", &[words, &["--open", "--report", "own.html"]].concat());
        assert_eq!(none.code, 0, "{none:?}");
        assert!(none.err.contains("no browser was found here: open own.html"), "{none:?}");
    }
    let text = bench.ok(&["diagnose", "log.csv"]);
    assert!(text.contains("truerate diagnose log.csv --open"), "how to see it: {text}");
}

#[test]
fn a_search_whose_budget_is_spent_gives_the_best_so_far_and_says_so() {
    let bench = Bench::new();
    let hidden = ["--hide", "delay:d=0.02", "--hide", "scale-asymmetry:a=0.01"];
    let simulate = ["simulate", "--seconds", "60", "--rate", "100", "-o", "log.csv.gz"];
    bench.ok(&[&simulate[..], &hidden[..]].concat());
    let ladder = ["ladder", "log.csv.gz", "--axis", "x", "--budget", "0.001"];
    let stopped = json(&bench.ok(&[&ladder[..], &["--format", "json"]].concat()));
    assert_eq!(stopped["axes"][0]["unfinished"], true, "{stopped}");
    assert_eq!(stopped["axes"][0]["verdict"], "cannot-tell", "{stopped}");
    let text = bench.ok(&ladder);
    assert!(text.contains("stopped before its end") && text.contains("looks to the end"), "{text}");
    let whole = json(&bench.ok(&["ladder", "log.csv.gz", "--axis", "x", "--format", "json"]));
    assert!(whole["axes"][0].get("unfinished").is_none(), "{whole}");
    assert!(bench.refused(&["ladder", "log.csv.gz", "--budget", "0"]).contains("--budget"));
}

#[test]
fn two_effects_that_are_missing_are_named_together() {
    let bench = Bench::new();
    let hidden = ["--hide", "delay:d=0.01", "--hide", "temperature-bias"];
    let simulate =
        ["simulate", "--motion", "drive", "--seconds", "120", "--rate", "100", "--seed", "7", "-o", "log.csv.gz"];
    bench.ok(&[&simulate[..], &hidden[..]].concat());
    let found = json(&bench.ok(&["diagnose", "log.csv.gz", "--axis", "x", "--format", "json"]));
    let mut missing: Vec<&str> =
        found["axes"][0]["missing"].as_array().unwrap().iter().map(|id| id.as_str().unwrap()).collect();
    missing.sort_unstable();
    assert_eq!(missing, ["delay", "temperature-bias"], "{found}");
    let text = bench.ok(&["diagnose", "log.csv.gz", "--axis", "x"]);
    assert!(text.contains("truerate add log.csv.gz") && text.contains("temperature-bias"), "{text}");
}
