//! `truerate compare A B --side-by-side` on the real program: two sensors, which is better and by what.

mod common;

use common::Bench;
use serde_json::Value;

#[test]
fn the_better_of_two_sensors_is_named_with_its_ratio_its_band_and_its_sizes() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "150", "--axis", "z", "--seed", "5", "-o", "good.csv"]);
    bench.ok(&[
        "simulate",
        "--seconds",
        "150",
        "--axis",
        "z",
        "--seed",
        "6",
        "--hide",
        "delay:d=0.012",
        "-o",
        "late.csv",
    ]);
    let text = bench.ok(&["compare", "good.csv", "late.csv", "--side-by-side"]);
    assert!(text.contains("axis z  good.csv is better: its error is "), "{text}");
    for row in ["zero", "scale error", "white noise", "error over 0.1 s", "error over 1 s", "error over 10 s"] {
        assert!(text.lines().any(|line| line.trim_start().starts_with(row)), "{row}: {text}");
    }
    assert!(text.contains("next  truerate diagnose late.csv"), "{text}");
    let json: Value = serde_json::from_str(&bench.ok(&[
        "compare",
        "good.csv",
        "late.csv",
        "--side-by-side",
        "--format",
        "json",
        "--report",
        "sides.html",
    ]))
    .unwrap();
    assert_eq!(json["schema"], "truerate.side-by-side/1");
    assert_eq!(json["logs"], serde_json::json!(["good.csv", "late.csv"]));
    let axis = &json["axes"][0];
    assert_eq!((&axis["axis"], &axis["better"]), (&Value::from("z"), &Value::from("first")), "{axis}");
    let at =
        axis["errors"].as_array().unwrap().iter().find(|own| own["tau_s"] == 1.0).unwrap_or_else(|| panic!("{axis}"));
    let number = |key: &str| at[key].as_f64().unwrap();
    assert!(number("low") < number("ratio") && number("ratio") < number("high") && number("high") < 1.0, "{at}");
    // The same two, given the other way round, say the same of each other.
    let turned: Value =
        serde_json::from_str(&bench.ok(&["compare", "late.csv", "good.csv", "--side-by-side", "--format", "json"]))
            .unwrap();
    assert_eq!(turned["axes"][0]["better"], "second");
    let page = bench.text("sides.html");
    assert!(
        page.contains("good.csv is better") && page.contains("late.csv") && page.contains("\"judged\":1"),
        "{page:.300}"
    );
}

#[test]
fn a_model_of_each_may_be_given_and_what_makes_no_pair_is_refused() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "30", "--axis", "z", "--seed", "5", "-o", "a.csv"]);
    bench.ok(&["simulate", "--seconds", "30", "--axis", "z", "--seed", "6", "--hide", "delay:d=0.012", "-o", "b.csv"]);
    bench.ok(&["simulate", "--seconds", "30", "--axis", "x", "--seed", "7", "-o", "c.csv"]);
    // With its delay in the model the late one is no worse than its noise.
    let words = ["compare", "a.csv", "b.csv", "--side-by-side", "--format", "json"];
    let ratio = |words: &[&str]| {
        let json: Value = serde_json::from_str(&bench.ok(words)).unwrap();
        json["axes"][0]["errors"][0]["ratio"].as_f64().unwrap()
    };
    let with = [&words[..], &["--model", "a.csv.truth.toml", "--against", "b.csv.truth.toml"]].concat();
    assert!(ratio(&with) > 5.0 * ratio(&words), "{} and {}", ratio(&with), ratio(&words));
    assert!(bench.refused(&["compare", "a.csv", "--side-by-side"]).contains("takes two logs"));
    assert!(bench.refused(&["compare", "a.csv", "b.csv", "c.csv", "--side-by-side"]).contains("3 given"));
    std::fs::copy(bench.path("a.csv"), bench.path("copy.csv")).unwrap();
    assert!(bench.refused(&["compare", "a.csv", "copy.csv", "--side-by-side"]).contains("are the same log"));
    assert!(bench.refused(&["compare", "a.csv", "c.csv", "--side-by-side"]).contains("no axis in common"));
}
