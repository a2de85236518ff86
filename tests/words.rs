//! Raw words of a gyro without a unit and without a reference: what is proposed, and that it can be pasted.

mod common;

use common::Bench;
use std::fmt::Write as _;

/// A log of three axes in words, of these numbers at a time.
fn words(bench: &Bench, name: &str, head: &str, word: impl Fn(f64, usize) -> f64) {
    let mut text = format!("{head}\n");
    let mut noise = 7_u64;
    for k in 0..3000 {
        let t = 0.01 * f64::from(k);
        let _ = write!(text, "{t:.2}");
        for axis in 0..3 {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let _ = write!(text, ",{}", (word(t, axis) + (noise >> 60) as f64 - 7.5).round());
        }
        text.push('\n');
    }
    bench.file(name, text);
}

/// What a refused command proposes: its last line, as words for the program.
fn proposed(said: &str) -> Vec<String> {
    let line = said.lines().last().unwrap_or_default();
    let words = line.strip_prefix("truerate ").unwrap_or_else(|| panic!("no command: {said}"));
    words.split(' ').map(|word| word.trim_matches('\'').to_owned()).collect()
}

#[test]
fn words_at_rest_are_refused_with_a_command_that_reads_them() {
    let bench = Bench::new();
    let zero = |_: f64, axis: usize| [-57.0, 31.0, 104.0][axis];
    for (name, head) in [("plain.csv", "t,gx,gy,gz"), ("named.csv", "t,gyro_x,gyro_y,gyro_z")] {
        words(&bench, name, head, zero);
        for flags in [&[][..], &["--at-rest"]] {
            let said = bench.run(&[&["fit", name], flags].concat());
            assert_eq!(said.code, 1, "{said:?}");
            assert!(said.err.contains("raw words") && said.err.contains("131 steps are one °/s"), "{said:?}");
            let command = proposed(&said.err);
            assert_eq!(command.iter().filter(|word| *word == "--at-rest").count(), 1, "{command:?}");
            let command: Vec<&str> = command.iter().map(String::as_str).collect();
            let out = bench.ok(&[&command[..], &["--axis", "x", "--format", "json"]].concat());
            let json: serde_json::Value = serde_json::from_str(&out).unwrap();
            let bias =
                json["axes"][0]["parameters"].as_array().unwrap().iter().find(|p| p["effect"] == "bias").unwrap();
            // It reads -57 steps of 1/131 °/s.
            let delta = bias["value"].as_f64().unwrap().to_degrees();
            assert!((delta - 57.0 / 131.0).abs() < 0.05, "{name}: {delta} °/s");
        }
    }
}

#[test]
fn words_without_their_sign_get_it_back() {
    let bench = Bench::new();
    words(&bench, "unsigned.csv", "t,gx,gy,gz", |_, axis| [65_000.0, 65_100.0, 104.0][axis]);
    let said = bench.run(&["fit", "unsigned.csv", "--at-rest"]);
    assert!(said.code == 1 && said.err.contains("printed without their sign: 65535 is −1"), "{said:?}");
    let command = proposed(&said.err);
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    let out = bench.ok(&[&command[..], &["--axis", "x", "--format", "json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    let bias = json["axes"][0]["parameters"].as_array().unwrap().iter().find(|p| p["effect"] == "bias").unwrap();
    let delta = bias["value"].as_f64().unwrap().to_degrees();
    assert!((delta - 536.0 / 131.0).abs() < 0.05, "{delta} °/s");
}

#[test]
fn words_that_move_need_a_reference_and_the_command_says_where_it_goes() {
    let bench = Bench::new();
    words(&bench, "move.csv", "t,gx,gy,gz", |t, axis| 131.0 * 80.0 * (1.3 * t + axis as f64).sin());
    let said = bench.run(&["fit", "move.csv"]);
    assert!(said.code == 1 && said.err.contains("it moved: a reference"), "{said:?}");
    assert!(said.err.lines().last().unwrap().contains("--map gyro_x_dps=gx/131"), "{said:?}");
    assert!(said.err.lines().last().unwrap().ends_with("--reference REFERENCE.csv"), "{said:?}");
    // What has a unit, or is no whole number, is not taken for words.
    words(&bench, "dps.csv", "t,gyro_x_dps,gyro_y_dps,gyro_z_dps", |_, axis| [-57.0, 31.0, 104.0][axis]);
    bench.ok(&["fit", "dps.csv", "--at-rest"]);
}
