//! Every case of the interface's table of bad input, on the real program: one line that says what, where and what to do,
//! exit code 1, never a panic; what can be used is used, and its faults counted and located.

#![allow(clippy::format_push_string, clippy::format_collect)] // made once, for the test

mod common;

use common::{Bench, advised, gzip, log, only_file, with_field};

/// Refused logs: (name of the file, its bytes, what the one line has to say).
fn refused() -> Vec<(&'static str, Vec<u8>, Vec<&'static str>)> {
    let whole = log(300);
    let text = |t: String| t.into_bytes();
    let header = |h: &str| whole.replacen("t,gyro_z,ref_angle_z", h, 1).into_bytes();
    let packed = gzip(whole.as_bytes());
    let mut corrupt = packed.clone();
    let middle = corrupt.len() / 2;
    corrupt[middle..middle + 40].iter_mut().for_each(|b| *b ^= 0x55);
    let mut no_magic = packed.clone();
    no_magic[0] = 0;
    let mut trailing = packed.clone();
    trailing.extend(b"something else");
    let mut bad_rows = whole.clone();
    for line in (10..300).step_by(8) {
        bad_rows = with_field(&bad_rows, line, 2, "inf");
    }
    let wide: String = (0..100_000).map(|i| format!("c{i},")).collect();
    vec![
        ("empty.csv", vec![], vec!["empty.csv", "is empty", "header"]),
        ("empty.csv.gz", gzip(b""), vec!["is empty"]),
        ("blank.csv", b"\n\n\n".to_vec(), vec!["is empty"]),
        (
            "no-header.csv",
            text(whole.lines().skip(1).collect::<Vec<_>>().join("\n")),
            vec!["line 1", "no header", "--map t=1 --map gyro_z=2 --map ref_angle_z=3"],
        ),
        (
            "no-t.csv",
            header("when,gyro_z,ref_angle_z"),
            vec!["line 1", "no column `t`", "'when'", "truerate fit no-t.csv --map t=when"],
        ),
        ("no-gyro.csv", header("t,gyro_q,ref_angle_z"), vec!["line 1", "gyro_x, gyro_y or gyro_z", "'gyro_q'"]),
        (
            "no-reference.csv",
            header("t,gyro_z,angle"),
            vec!["line 1", "no axis has both", "truerate fit no-reference.csv --map ref_angle_z=angle"],
        ),
        ("slip.csv", header("t,gyro_z,ref_agnle_z"), vec!["no axis has both", "--map ref_angle_z=ref_agnle_z"]),
        (
            "likely.csv",
            header("time,gz [deg/s],yaw [deg]"),
            vec!["no axis has both", "--map 'ref_angle_z_deg=yaw [deg]'"],
        ),
        ("decimal.csv", text(whole.replace('.', ",")), vec!["line 2", "6 fields", "decimal commas", "semicolons"]),
        ("digits.csv", text(rough_times(&whole)), vec!["too few digits", "changes by 1 s", "%.6f"]),
        ("other-axis.csv", header("t,gyro_z,ref_angle_x"), vec!["no axis has both", "a reference on axis x"]),
        ("twice.csv", header("t,gyro_z,gyro_z"), vec!["line 1", "column 3", "gyro_z", "named twice"]),
        ("twice-unit.csv", header("t,gyro_z,gyro_z_dps"), vec!["column 3", "`gyro_z`", "`gyro_z_dps`", "named twice"]),
        (
            "twice-free.csv",
            header("t,gyro_z,a").into_iter().collect(),
            vec!["no axis has both", "truerate fit twice-free.csv --map ref_angle_z=a"],
        ),
        (
            "unit.csv",
            header("t,gyro_z_g,ref_angle_z"),
            vec!["column 2", "gyro_z_g", "_g is not a unit of a rate", "gyro_z_dps"],
        ),
        ("part-of-quaternion.csv", header("t,gyro_z,ref_qw"), vec!["ref_qx", "is missing", "all of"]),
        ("few.csv", text(log(80)), vec!["only 80 usable rows", "100"]),
        ("header-only.csv", b"t,gyro_z,ref_angle_z\n".to_vec(), vec!["only 0 usable rows"]),
        (
            "text.csv",
            text(with_field(&whole, 57, 2, "abc")),
            vec!["text.csv", "line 57", "column 2", "gyro_z", "'abc' is not a number"],
        ),
        ("text-t.csv", text(with_field(&whole, 12, 1, "12:30")), vec!["line 12", "column 1", "(t)", "'12:30'"]),
        ("text-ref.csv", text(with_field(&whole, 301, 3, "lost")), vec!["line 301", "ref_angle_z", "'lost'"]),
        ("binary.csv", text(with_field(&whole, 57, 2, "\u{1}\u{2}\u{7f}")), vec!["line 57", "not a number"]),
        (
            "short-row.csv",
            text(whole.replacen("\n0.50,", "\n0.50\n0.505,", 1)),
            vec!["line 52", "1 fields where the header has 3"],
        ),
        ("long-row.csv", text(with_field(&whole, 20, 3, "1,2")), vec!["line 20", "4 fields", "3"]),
        ("truncated.csv.gz", packed[..packed.len() * 2 / 3].to_vec(), vec!["line", "truncated or corrupt gzip"]),
        ("no-trailer.csv.gz", packed[..packed.len() - 8].to_vec(), vec!["truncated or corrupt gzip"]),
        ("corrupt.csv.gz", corrupt, vec!["corrupt.csv.gz"]),
        ("not-gzip.csv.gz", no_magic, vec!["named .gz but is not gzip"]),
        ("trailing.csv.gz", trailing, vec!["truncated or corrupt gzip"]),
        ("faulty.csv", text(bad_rows), vec!["37 of 300 rows are faulty", "more than 10 %", "gyro_z"]),
        (
            "again.csv",
            text(whole.clone() + &log(299).lines().skip(1).collect::<Vec<_>>().join("\n")),
            vec!["starts again at line 302", "two recordings"],
        ),
        ("far.csv", text(with_field(&whole, 40, 1, "1e25")), vec!["line 40", "292 years", "t_ns"]),
        ("wide.csv", text(format!("{wide}t\n")), vec!["gyro_x, gyro_y or gyro_z", "100001 columns"]),
        ("long-line.csv", text(with_field(&whole, 30, 2, &"1".repeat(10_000_000))), vec!["line 30", "longer than"]),
        ("long-header.csv", text("x".repeat(10_000_000)), vec!["line 1", "longer than"]),
        ("quote.csv", text(with_field(&whole, 30, 2, "\"0.1") + &whole.repeat(600)), vec!["line 30", "longer than"]),
    ]
}

/// The rows with times in whole seconds.
fn rough_times(text: &str) -> String {
    let rough = |line: &str| match line.split_once(',') {
        Some((t, rest)) if t != "t" => format!("{:.0},{rest}\n", t.parse::<f64>().unwrap().floor()),
        _ => format!("{line}\n"),
    };
    text.lines().map(rough).collect()
}

#[test]
fn a_log_that_cannot_be_used_is_refused_in_one_line_with_place_and_remedy() {
    let bench = Bench::new();
    let mut short = Vec::new();
    for (name, bytes, wanted) in refused() {
        bench.file(name, bytes);
        let line = bench.refused(&["fit", name]);
        assert!(line.contains(name), "{line}");
        short.extend(
            wanted
                .iter()
                .filter(|says| !line.contains(**says))
                .map(|says| format!("{name}: '{says}' is missing in: {line}")),
        );
        assert!(line.contains(": ") && line.len() > 40, "{name}: no remedy in: {line}");
        // A whole command that is printed does what it is printed for.
        if let Some(command) = advised(&line) {
            bench.ok(&command.iter().map(String::as_str).collect::<Vec<_>>());
        }
        std::fs::remove_file(bench.path(name)).unwrap();
    }
    assert!(short.is_empty(), "{}", short.join("\n"));
}

#[test]
fn every_command_refuses_a_bad_log_in_the_same_way() {
    let bench = Bench::new();
    bench.file("bad.csv", with_field(&log(300), 57, 2, "abc"));
    bench.file("good.csv", log(300));
    bench.ok(&["fit", "good.csv", "-o", "m.toml"]);
    for words in [
        &["fit", "bad.csv", "-o", "new.toml"][..],
        &["compare", "bad.csv"],
        &["diagnose", "bad.csv", "--format", "json"],
        &["add", "bad.csv", "delay", "-o", "new.toml"],
        &["remove", "bad.csv", "bias", "-o", "new.toml"],
        &["ladder", "bad.csv", "--report", "new.html"],
        &["apply", "bad.csv", "--model", "m.toml", "-o", "new.csv"],
    ] {
        let line = bench.refused(words);
        assert!(line.contains("bad.csv line 57 column 2 (gyro_z)"), "{line}");
    }
    for product in ["new.toml", "new.html", "new.csv"] {
        assert!(!bench.path(product).exists(), "{product} was written from a refused log");
    }
}

#[test]
fn a_log_that_is_not_there_or_not_readable_is_named() {
    let bench = Bench::new();
    assert!(bench.refused(&["fit", "nowhere.csv"]).contains("nowhere.csv: cannot be opened"));
    assert!(bench.refused(&["fit", "."]).contains("is a folder"));
    assert!(bench.refused(&["fit", "nowhere/x.csv"]).contains("nowhere/x.csv"));
    bench.file("log.csv", log(300));
    assert!(bench.refused(&["fit", "log.csv/x.csv"]).contains("cannot be opened"));
    assert!(bench.refused(&["fit", "log.csv", "--columns", "map.toml"]).contains("map.toml"));
    assert!(bench.refused(&["compare", "log.csv", "--model", "m.toml"]).contains("m.toml: cannot be read"));
    assert!(
        bench.refused(&["fit", "log.csv", "--axis", "x"]).contains("axis x has no gyro or no reference: choose from z")
    );
}

#[test]
fn standard_input_is_named_in_the_same_way() {
    let bench = Bench::new();
    let outcome = bench.run_with(&["fit", "-"], with_field(&log(300), 57, 2, "abc").as_bytes());
    assert!(outcome.refusal("stdin").contains("standard input line 57 column 2 (gyro_z)"));
    let outcome = bench.run_with(&["fit", "-"], b"");
    assert!(outcome.refusal("stdin").contains("standard input: is empty"));
    let outcome = bench.run_with(&["fit", "-"], log(300).as_bytes());
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let outcome = bench.run_with(&["fit", "-"], &gzip(log(300).as_bytes()));
    assert_eq!(outcome.code, 0, "{outcome:?}");
}

/// Logs that are used, and the fault that has to be reported: (name, text, fault, count, part of what it says).
fn faulty() -> Vec<(&'static str, String, &'static str, u64, &'static str)> {
    let whole = log(3000);
    let mut nan = whole.clone();
    let mut infinite = whole.clone();
    let mut spikes = whole.clone();
    for line in [500, 1000, 1500] {
        nan = with_field(&nan, line, 2, "nan");
        infinite = with_field(&infinite, line, 2, "-inf");
        spikes = with_field(&spikes, line, 2, "35.0");
    }
    let lines: Vec<&str> = whole.lines().collect();
    let mut gap = lines.clone();
    gap.drain(1000..1100);
    let mut back = lines.clone();
    back.swap(700, 701);
    let mut repeated_time = lines.clone();
    repeated_time.insert(900, lines[899]);
    let (mut again, mut stray) = (lines.clone(), lines.clone());
    again.insert(1200, lines[0]);
    stray.insert(800, "Logger paused");
    let map = |of: &dyn Fn(&[f64]) -> [f64; 3]| {
        let rows = lines[1..].iter().map(|l| {
            let v: Vec<f64> = l.split(',').map(|x| x.parse().unwrap()).collect();
            let [a, b, c] = of(&v);
            format!("{a},{b},{c}\n")
        });
        std::iter::once("t,gyro_z,ref_angle_z\n".to_owned()).chain(rows).collect::<String>()
    };
    let join = |lines: Vec<&str>| lines.join("\n") + "\n";
    vec![
        ("nan.csv", nan, "non-finite", 3, "gyro_z"),
        ("infinite.csv", infinite, "non-finite", 3, "first at line 500"),
        ("spikes.csv", spikes, "outliers", 3, "gyro_z"),
        ("gap.csv", join(gap), "dropouts", 1, "100 samples missing"),
        ("back.csv", join(back), "time-going-back", 1, "line 702"),
        (
            "cut.csv",
            whole[..whole.len() - 12].to_owned(),
            "skipped-lines",
            1,
            "the last row breaks off: left out (first at line 3001)",
        ),
        ("again.csv", join(again), "skipped-lines", 1, "the header again in 1 line: passed by"),
        (
            "stray.csv",
            join(stray),
            "skipped-lines",
            1,
            "text instead of a row in 1 line: passed by (first at line 801)",
        ),
        ("repeated-time.csv", join(repeated_time), "time-going-back", 1, "line 901"),
        (
            "stuck.csv",
            map(&|v| [v[0], if v[0] > 10.0 && v[0] < 14.0 { 1.5 } else { v[1] }, v[2]]),
            "stuck-channel",
            399,
            "gyro_z",
        ),
        (
            "encoder.csv",
            map(&|v| [v[0], v[1], if v[0] > 10.0 && v[0] < 14.0 { 0.5 } else { v[2] }]),
            "stuck-channel",
            399,
            "ref_angle_z",
        ),
        ("degrees.csv", map(&|v| [v[0], v[1].to_degrees(), v[2]]), "wrong-unit", 3000, "gyro_z_dps"),
        ("ms.csv", map(&|v| [1e3 * v[0], v[1], v[2]]), "wrong-unit", 3000, "name it t_ms"),
        ("us.csv", map(&|v| [1e6 * v[0], v[1], v[2]]), "wrong-unit", 3000, "name it t_us"),
        ("sign.csv", map(&|v| [v[0], -v[1], v[2]]), "wrong-sign", 3000, "negate"),
        ("still.csv", map(&|v| [v[0], 0.01 + 1e-3 * (v[1] * 1e4).fract(), 0.3]), "not-excited", 3000, "turn it"),
    ]
}

#[test]
fn a_log_with_faults_is_used_and_each_fault_is_counted_and_located() {
    let bench = Bench::new();
    for (name, text, fault, count, says) in faulty() {
        bench.file(name, text);
        let out = bench.ok(&["compare", name, "--format", "json"]);
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        let faults = json["axes"][0]["data_faults"].as_array().unwrap();
        let found = faults.iter().find(|f| f["fault"] == fault && f["says"].as_str().unwrap().contains(says));
        let found = found.unwrap_or_else(|| panic!("{name}: no {fault} that says '{says}' in {faults:?}"));
        assert_eq!(found["count"], count, "{name}: {found}");
        assert!(found["first_t"].is_number() || fault == "not-excited", "{name}: {found}");
    }
}

#[test]
fn a_fault_of_one_axis_is_not_held_against_another() {
    let bench = Bench::new();
    let mut text = String::from("t,gyro_x,ref_angle_x,gyro_z,ref_angle_z\n");
    for line in log(3000).lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        text.push_str(&format!("{},{},{},{},{}\n", v[0], v[1], v[2], -v[1], v[2]));
    }
    bench.file("pair.csv", text);
    for command in ["compare", "diagnose"] {
        let json: serde_json::Value =
            serde_json::from_str(&bench.ok(&[command, "pair.csv", "--format", "json"])).unwrap();
        let (x, z) = (&json["axes"][0], &json["axes"][1]);
        assert_eq!((&x["axis"], &z["axis"]), (&"x".into(), &"z".into()));
        assert!(x["verdict"] != "bad-data" && z["verdict"] == "bad-data", "{} and {}", x["verdict"], z["verdict"]);
        assert!(z["says"].as_str().unwrap().contains("gyro_z turns against ref_angle_z"), "{}", z["says"]);
        assert_eq!(z["data_faults"][0]["axis"], "z");
    }
}

#[test]
fn two_axes_swapped_are_seen_where_both_have_a_gyro() {
    let bench = Bench::new();
    let mut text = String::from("t,gyro_x,gyro_z,ref_angle_z\n");
    for line in log(1000).lines().skip(1) {
        let v: Vec<&str> = line.split(',').collect();
        text.push_str(&format!("{},{},0.0{},{}\n", v[0], v[1], &v[1][v[1].len() - 3..], v[2]));
    }
    bench.file("swapped.csv", text);
    let out = bench.ok(&["compare", "swapped.csv", "--format", "json"]);
    assert!(out.contains("swapped-axes") && out.contains("ref_angle_z follows gyro_x"), "{out}");
}

/// A turning axis for a minute; `spoil` makes the lines of each row, time, rate and angle.
fn turning(spoil: impl Fn(usize, f64, f64, f64) -> String) -> String {
    let mut text = String::from("t,gyro_z,ref_angle_z\n");
    for k in 0..6000_u32 {
        let t = f64::from(k) * 0.01;
        let noise = 1e-3 * white(u64::from(k));
        let (rate, angle) =
            (1.5 * (1.3 * t).cos() + 0.8 * (2.9 * t).cos(), 1.5 / 1.3 * (1.3 * t).sin() + 0.8 / 2.9 * (2.9 * t).sin());
        text.push_str(&spoil(k as usize, t, rate + noise, angle));
    }
    text
}

/// Between −1 and 1, any two as good as independent (SplitMix64).
fn white(k: u64) -> f64 {
    let z = (k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn verdict(bench: &Bench, name: &str) -> serde_json::Value {
    let report: serde_json::Value = serde_json::from_str(&bench.ok(&["diagnose", name, "--format", "json"])).unwrap();
    report["axes"][0].clone()
}

#[test]
fn a_clock_that_is_set_back_joins_nothing_that_was_apart() {
    let bench = Bench::new();
    let set_back = |k: usize, t: f64| if k < 3000 { t } else { t - 4.0 };
    bench.file("back.csv", turning(|k, t, rate, angle| format!("{},{rate},{angle}\n", set_back(k, t))));
    let axis = verdict(&bench, "back.csv");
    let alpha = axis["parameters"][0]["value"].as_f64().unwrap();
    assert!((alpha - 1.0).abs() < 1e-3, "{axis}");
    assert!(axis["data_faults"].to_string().contains("the clock stood or was set back"), "{axis}");
}

#[test]
fn a_gyro_and_a_reference_in_rows_of_their_own_are_held_together() {
    let bench = Bench::new();
    let later = |t: f64, rate: f64, angle: f64| (t + 0.004, angle + 0.004 * rate);
    bench.file(
        "apart.csv",
        turning(|_, t, rate, angle| {
            let (t2, angle2) = later(t, rate, angle);
            format!("{t},{rate},\n{t2},,{angle2}\n")
        }),
    );
    let axis = verdict(&bench, "apart.csv");
    assert!((axis["parameters"][0]["value"].as_f64().unwrap() - 1.0).abs() < 2e-3, "{axis}");
    assert!(axis["verdict"] != "cannot-tell" && axis["verdict"] != "bad-data", "{axis}");
}

#[test]
fn a_gyro_and_a_reference_both_in_degrees_are_bad_data() {
    let bench = Bench::new();
    let degrees = |x: f64| x.to_degrees();
    bench.file("degrees.csv", turning(|_, t, rate, angle| format!("{t},{},{}\n", degrees(rate), degrees(angle))));
    let axis = verdict(&bench, "degrees.csv");
    assert!(axis["verdict"] == "bad-data" && axis["says"].as_str().unwrap().contains("name it gyro_z_dps"), "{axis}");
}

#[test]
fn a_sensor_at_rest_keeps_its_scale_and_shows_its_bias() {
    let bench = Bench::new();
    bench.file(
        "still.csv",
        turning(|k, t, rate, _| format!("{t},{},0.5\n", 0.015 + 1e-3 * (rate * 1e4 + k as f64).sin())),
    );
    let axis = verdict(&bench, "still.csv");
    assert_eq!((&axis["verdict"], &axis["parameters"][0]["value"]), (&"cannot-tell".into(), &1.0.into()), "{axis}");
    assert!((axis["parameters"][1]["value"].as_f64().unwrap() + 0.015).abs() < 1e-3, "{axis}");
}

#[test]
fn nothing_is_written_over_what_is_needed() {
    let bench = Bench::new();
    let whole = log(300);
    bench.file("log.csv", &whole);
    bench.ok(&["fit", "log.csv", "-o", "m.toml"]);
    for words in [
        &["apply", "log.csv", "--model", "m.toml", "-o", "log.csv"][..],
        &["apply", "log.csv", "--model", "m.toml", "-o", "./m.toml"],
        &["fit", "log.csv", "-o", "log.csv"],
        &["add", "log.csv", "delay", "-o", "page.html", "--report", "page.html"],
    ] {
        let line = bench.refused(words);
        assert!(line.contains("would be written over"), "{line}");
    }
    assert_eq!(bench.text("log.csv"), whole);
    bench.ok(&["add", "log.csv", "delay", "--model", "m.toml", "-o", "m.toml"]);
}

#[test]
fn what_a_model_or_a_log_cannot_do_without_is_said() {
    let bench = Bench::new();
    bench.file("log.csv", log(300));
    assert!(bench.refused(&["remove", "log.csv", "scale-factor", "bias"]).contains("belongs to the base model"));
    let line = bench.refused(&["add", "log.csv", "temperature-bias"]);
    assert!(line.contains("'temperature-bias' needs a temperature that changes"), "{line}");
    // A model that goes by what a log has not got would stand still, unsaid.
    let warms =
        |(k, line): (usize, &str)| if k == 0 { format!("{line},temp\n") } else { format!("{line},{}\n", 20 + k % 150) };
    bench.file("warms.csv", log(300).lines().enumerate().map(warms).collect::<String>());
    bench.ok(&["add", "warms.csv", "temperature-bias", "-o", "warm.toml"]);
    for command in ["apply", "compare", "diagnose", "fit", "ladder"] {
        let line = bench.refused(&[command, "log.csv", "--model", "warm.toml"]);
        assert!(line.contains("'temperature-bias' of axis z needs a temperature that changes"), "{line}");
    }
    bench.ok(&["remove", "log.csv", "temperature-bias", "--model", "warm.toml"]);
    let hotter = |(k, line): (usize, &str)| if k == 0 { format!("{line},temp\n") } else { format!("{line},400\n") };
    bench.file("hotter.csv", log(300).lines().enumerate().map(hotter).collect::<String>());
    let said = bench.ok(&["apply", "hotter.csv", "--model", "warm.toml", "-o", "out.csv"]);
    assert!(said.contains("fitted at 20.0 to 169.0 °C; here it is 400.0 to 400.0 °C"), "{said}");
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_hundred_thousand_columns_are_read() {
    let bench = Bench::new();
    let names: String = (0..100_000).map(|i| format!(",c{i}")).collect();
    let fields = ",1".repeat(100_000);
    let mut text = String::new();
    for (i, line) in log(100).lines().enumerate() {
        text.push_str(line);
        text.push_str(if i == 0 { &names } else { &fields });
        text.push('\n');
    }
    bench.file("wide.csv", text);
    let out = bench.ok(&["compare", "wide.csv", "--format", "json"]);
    assert!(out.contains("99992 free channels are not read, from 'c8' on"), "{out}");
}

#[test]
fn what_cannot_be_written_is_said_before_the_work_and_what_stood_there_stays() {
    let bench = Bench::new();
    bench.file("log.csv", log(300));
    bench.ok(&["fit", "log.csv", "-o", "m.toml"]);
    for words in [
        &["fit", "log.csv", "-o", "nowhere/m.toml"][..],
        &["fit", "log.csv", "-o", "log.csv/m.toml"],
        &["fit", "log.csv", "-o", "/proc/m.toml"],
        &["fit", "log.csv", "-o", "."],
        &["fit", "log.csv", "--report", "/proc/report.html"],
        &["add", "log.csv", "delay", "-o", "/proc/m.toml"],
        &["ladder", "log.csv", "-o", "/proc/m.toml"],
        &["simulate", "-o", "/proc/log.csv"],
        &["apply", "log.csv", "--model", "m.toml", "-o", "/proc/out.csv"],
    ] {
        let line = bench.refused(words);
        assert!(line.contains("cannot be written: check that the folder exists"), "{line}");
    }
    assert!(bench.refused(&["fit", "log.csv", "--report", "report.pdf"]).contains("use .txt, .json or .html"));
}

#[test]
fn a_full_disk_is_an_error_on_every_output() {
    let bench = Bench::new();
    bench.file("log.csv", log(300));
    bench.ok(&["fit", "log.csv", "-o", "m.toml"]);
    for words in [
        &["fit", "log.csv", "-o", "/dev/full"][..],
        &["simulate", "--seconds", "5", "-o", "/dev/full"],
        &["apply", "log.csv", "--model", "m.toml", "-o", "/dev/full"],
    ] {
        let line = bench.refused(words);
        assert!(line.contains("/dev/full") && line.contains("No space left"), "{line}");
    }
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = bench.command(&["effects"]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output cannot be written"));
}

#[test]
fn a_disk_that_fills_up_leaves_what_stood_there() {
    let bench = Bench::new();
    bench.file("log.csv", log(300));
    std::fs::create_dir(bench.path("small")).unwrap();
    let program = env!("CARGO_BIN_EXE_truerate");
    let script = format!(
        "mount -t tmpfs -o size=64k tmpfs small || exit 77; echo old > small/log.csv; \
         {program} simulate --seconds 60 -o small/log.csv; code=$?; cat small/log.csv; ls -A small; exit $code"
    );
    let words = ["--user", "--map-root-user", "--mount", "sh", "-c", &script];
    let output = std::process::Command::new("unshare").args(words).current_dir(bench.path("")).output();
    let Some(output) =
        output.ok().filter(|o| ![Some(77), Some(127)].contains(&o.status.code()) && !o.stdout.is_empty())
    else {
        eprintln!("skipped: a small disk cannot be mounted here");
        return;
    };
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{out}{err}");
    assert_eq!(out, "old\nlog.csv\n", "{err}");
    assert!(err.lines().count() == 1 && err.contains("No space left"), "{err}");
}

#[test]
fn a_refused_model_file_is_shown_with_line_and_caret() {
    let bench = Bench::new();
    bench.file("log.csv", log(300));
    bench.ok(&["fit", "log.csv", "-o", "m.toml"]);
    let model = bench.text("m.toml");
    for (from, to, line, says) in [
        ("truerate.model/1", "truerate.model/2", 1, "newer than this program knows"),
        ("\"bias\"]", "\"biass\"]", 0, "did you mean 'bias'"),
        ("noise =", "noises =", 0, "noises"),
        ("value =", "valeu =", 0, "valeu"),
        ("epoch = 1", "epoch = one", 2, ""),
        ("alpha = { value = ", "alpha = { value = -", 0, "alpha of scale-factor lies between 0.01 and 100"),
    ] {
        assert!(model.contains(from), "{from}: {model}");
        bench.file("bad.toml", model.replacen(from, to, 1));
        let outcome = bench.run(&["compare", "log.csv", "--model", "bad.toml"]);
        assert_eq!(outcome.code, 1, "{outcome:?}");
        let first = outcome.err.lines().next().unwrap();
        assert!(first.contains("bad.toml line ") && first.contains(says), "{outcome:?}");
        assert!(line == 0 || first.contains(&format!("line {line} ")), "{outcome:?}");
        assert_eq!(outcome.err.lines().count(), 3, "{outcome:?}");
        assert!(outcome.err.contains('^') && !outcome.err.contains("panicked"), "{outcome:?}");
    }
}

#[test]
fn nothing_is_left_behind_by_a_command_that_failed() {
    let bench = Bench::new();
    bench.file("bad.csv", with_field(&log(300), 57, 2, "abc"));
    bench.refused(&["fit", "bad.csv", "-o", "m.toml"]);
    assert!(only_file(&bench.path(""), "bad.csv"));
}

#[test]
fn wrong_usage_exits_with_two() {
    let bench = Bench::new();
    for words in [
        &["fitt", "log.csv"][..],
        &["fit"],
        &["fit", "log.csv", "--axis", "w"],
        &["fit", "log.csv", "--format", "xml"],
        &["simulate", "--rate", "0", "-o", "log.csv"],
        &["simulate", "--motion", "jump", "-o", "log.csv"],
        &["diagnose", "log.csv", "--fail-on", "fine"],
        &["diagnose", "log.csv", "--fail-on", "adequate,fine"],
        &["add", "log.csv"],
        &[],
    ] {
        let outcome = bench.run(words);
        assert_eq!(outcome.code, 2, "{words:?}: {outcome:?}");
        assert!(!outcome.err.contains("panicked"), "{outcome:?}");
    }
}

#[test]
fn a_reader_of_our_output_that_leaves_early_ends_the_program_quietly() {
    let bench = Bench::new();
    bench.file("log.csv", log(30_000));
    bench.file("short.csv", log(300));
    bench.ok(&["fit", "short.csv", "-o", "m.toml"]);
    let mut child = bench
        .command(&["apply", "log.csv", "--model", "m.toml"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        (output.status.code(), output.stderr.len()),
        (Some(0), 0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
