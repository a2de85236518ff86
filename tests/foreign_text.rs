//! Text as other programs write it: read with the very result of the same log in our own names, or refused with the flag that
//! makes it readable.

#![allow(clippy::format_push_string, clippy::format_collect)] // made once, for the test

mod common;

use common::{Bench, log};
use serde_json::Value;

/// Scale and bias of axis z, as fitted.
fn fitted(bench: &Bench, words: &[&str]) -> (f64, f64) {
    let out = bench.ok(&[&["fit"], words, &["--format", "json"]].concat());
    let json: Value = serde_json::from_str(&out).unwrap();
    let axis = json["axes"].as_array().unwrap().iter().find(|axis| axis["axis"] == "z").unwrap();
    (axis["parameters"][0]["value"].as_f64().unwrap(), axis["parameters"][1]["value"].as_f64().unwrap())
}

/// Rows of time, rate and angle, as numbers.
fn rows() -> Vec<[f64; 3]> {
    let number = |field: &str| field.parse().unwrap();
    log(2000).lines().skip(1).map(|line| line.split(',').map(number).collect::<Vec<_>>().try_into().unwrap()).collect()
}

/// A text of these rows, each written by `row`, under `above`.
fn written(above: &str, row: impl Fn(&[f64; 3]) -> String) -> String {
    above.to_owned() + &rows().iter().map(|values| row(values) + "\n").collect::<String>()
}

#[test]
fn one_log_in_many_shapes_has_one_answer() {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    let clock = |t: f64| {
        let seconds = 86_390.0 + t;
        let whole = seconds as i64 % 86_400;
        format!("{:02}:{:02}:{:02}.{:02.0}", whole / 3600, whole / 60 % 60, whole % 60, seconds.fract() * 100.0)
    };
    let shapes: Vec<(&str, String)> = vec![
        ("semicolons", written("t;gyro_z;ref_angle_z\n", |[t, g, a]| format!("{t};{g};{a}"))),
        ("decimal-commas", written("t;gyro_z;ref_angle_z\n", |[t, g, a]| format!("{t};{g};{a}").replace('.', ","))),
        ("tabs", written("t\tgyro_z\tref_angle_z\n", |[t, g, a]| format!("{t}\t{g}\t{a}"))),
        ("blanks", written("t  gyro_z ref_angle_z\n", |[t, g, a]| format!(" {t}  {g} {a}"))),
        ("quotes", written("\"t\",\"gyro_z\",\"ref_angle_z\"\n", |[t, g, a]| format!("\"{t}\",\"{g}\",{a}"))),
        ("bom-crlf", written("\u{feff}t,gyro_z,ref_angle_z\r\n", |[t, g, a]| format!("{t},{g},{a}\r"))),
        ("numpy", written("# t gyro_z ref_angle_z\n", |[t, g, a]| format!("{t:e} {g:e} {a:e}"))),
        (
            "units",
            written("t,gyro_z,ref_angle_z\ns,deg/s,deg\n", |[t, g, a]| {
                format!("{t},{},{}", g.to_degrees(), a.to_degrees())
            }),
        ),
        ("capitals", written("T,gyro_Z,ref_angle_Z\n", |[t, g, a]| format!("{t},{g},{a}"))),
        ("milliseconds", written("time,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{},{g},{a}", t * 1e3))),
        (
            "microseconds",
            written("timestamp_us,gyr_z,encoder_z [rad]\n", |[t, g, a]| format!("{:.0},{g},{a}", t * 1e6)),
        ),
        (
            "epoch",
            written("t,gyro_z,ref_angle_z\n", |[t, g, a]| {
                format!("{},{g},{a}", 1_763_700_000_000_000_i64 + (t * 1e6).round() as i64)
            }),
        ),
        (
            "parts",
            written("stamp.secs,stamp.nsecs,gyro_z,ref_angle_z\n", |[t, g, a]| {
                format!("{},{},{g},{a}", 1_700_000_000 + *t as i64, (t.fract() * 1e9).round())
            }),
        ),
        ("clock", written("t,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{},{g},{a}", clock(*t)))),
        ("spreadsheet", written("sep=;\nt;gyro_z;ref_angle_z;\n", |[t, g, a]| format!("{t};{g};{a};"))),
    ];
    for (name, text) in shapes {
        let file = format!("{name}.csv");
        bench.file(&file, text);
        let found = fitted(&bench, &[&file]);
        assert!(
            (found.0 - wanted.0).abs() < 1e-6 && (found.1 - wanted.1).abs() < 1e-6,
            "{name}: {found:?}, not {wanted:?}"
        );
    }
}

#[test]
fn a_map_names_channels_with_factor_offset_and_number() {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    bench.file("raw.csv", written("clock,w,enc\n", |[t, g, a]| format!("{t},{},{}", (g - 0.5) * 1000.0, a)));
    let map = ["--map", "t=clock", "--map", "gyro_z=0.001*w+0.5", "--map", "ref_angle_z=enc"];
    let found = fitted(&bench, &[&["raw.csv"], &map[..]].concat());
    assert!((found.0 - wanted.0).abs() < 1e-9 && (found.1 - wanted.1).abs() < 1e-9, "{found:?}");
    bench.file("bare.csv", written("", |[t, g, a]| format!("{t},{g},{a}")));
    let line = bench.refused(&["fit", "bare.csv"]);
    assert!(line.contains("--map t=1 --map gyro_z=2 --map ref_angle_z=3"), "{line}");
    assert_eq!(fitted(&bench, &["bare.csv", "--map", "t=1", "--map", "gyro_z=2", "--map", "ref_angle_z=3"]), wanted);
    let line = bench.refused(&["fit", "raw.csv", "--map", "t=clok"]);
    assert!(line.contains("likely: clock"), "{line}");
    assert!(bench.refused(&["fit", "raw.csv", "--map", "t"]).contains("is no NAME=CHANNEL"));
}

#[test]
fn a_reference_may_come_from_a_second_file_with_a_clock_of_its_own() {
    let bench = Bench::new();
    bench.file("own.csv", log(4000));
    let wanted = fitted(&bench, &["own.csv"]);
    let of = |text: &str, columns: [usize; 2], shift: f64| -> String {
        text.lines()
            .map(|line| {
                let fields: Vec<&str> = line.split(',').collect();
                let t = fields[0].parse::<f64>().map_or("t".to_owned(), |t| format!("{:.2}", t + shift));
                format!("{},{}\n", if columns[0] == 0 { t } else { String::new() }, fields[columns[1]])
            })
            .collect()
    };
    bench.file("gyro.csv", of(&log(4000), [0, 1], 0.0));
    bench.file("angle.csv", of(&log(4000), [0, 2], 0.0));
    let found = fitted(&bench, &["gyro.csv", "--reference", "angle.csv"]);
    assert!((found.0 - wanted.0).abs() < 1e-9, "{found:?} {wanted:?}");
    bench.file("later.csv", of(&log(4000), [0, 2], 5000.0));
    let out = bench.ok(&["compare", "gyro.csv", "--reference", "later.csv", "--format", "json"]);
    assert!(out.contains("other-clock") && out.contains("-5000.0"), "{out}");
    let line = bench.refused(&["fit", "gyro.csv", "--reference", "nowhere.csv"]);
    assert!(line.contains("nowhere.csv: cannot be opened"), "{line}");
}

#[test]
fn channels_lists_what_a_text_holds_and_how_to_map_it() {
    let bench = Bench::new();
    bench.file(
        "log.csv",
        written("time (ms);Gyro Z (deg/s);Angle (deg)\n", |[t, g, a]| {
            format!("{};{};{}", t * 1e3, g.to_degrees(), a.to_degrees())
        }),
    );
    let json: Value = serde_json::from_str(&bench.ok(&["channels", "log.csv", "--format", "json"])).unwrap();
    assert_eq!(json["schema"], "truerate.channels/1");
    let gyro = &json["channels"][1];
    assert_eq!(
        (&gyro["channel"], &gyro["unit"], &gyro["rows"], &gyro["gaps"]),
        (&"Gyro Z (deg/s)".into(), &"deg/s".into(), &2000.into(), &0.into())
    );
    assert!((gyro["rate_hz"].as_f64().unwrap() - 100.0).abs() < 0.1, "{gyro}");
    assert_eq!(json["map"], serde_json::json!(["t_ms=time (ms)", "gyro_z_dps=Gyro Z (deg/s)"]));
    assert_eq!(json["likely"], serde_json::json!(["ref_angle_z_deg=Angle (deg)"]));
    let text = bench.ok(&["channels", "log.csv"]);
    assert!(text.contains("--map 'ref_angle_z_deg=Angle (deg)'"), "{text}");
    // What it says to paste works.
    bench.ok(&["fit", "log.csv", "--map", "ref_angle_z_deg=Angle (deg)"]);
}

#[test]
fn an_orientation_of_the_sensors_own_filter_is_no_reference() {
    let bench = Bench::new();
    let text = written(
        "PacketCounter\tSampleTimeFine\tGyr_X\tGyr_Y\tGyr_Z\tQuat_q0\tQuat_q1\tQuat_q2\tQuat_q3\n",
        |[t, g, a]| {
            format!("{0}\t{0:.0}\t0.001\t0.002\t{g}\t{1}\t0\t0\t{2}", t * 1e4, (a / 2.0).cos(), (a / 2.0).sin())
        },
    );
    bench.file("xsens.txt", text);
    let map = ["--map", "ref_q=Quat_q"];
    let verdict = |words: &[&str]| -> Value {
        let out = bench.ok(&[&["diagnose", "xsens.txt", "--axis", "z", "--format", "json"], &map[..], words].concat());
        serde_json::from_str::<Value>(&out).unwrap()["axes"][0].clone()
    };
    let axis = verdict(&[]);
    assert_eq!(axis["verdict"], "cannot-tell", "{axis}");
    assert!(axis["says"].as_str().unwrap().contains("from this very gyro"), "{axis}");
    assert!(axis["data_faults"].to_string().contains("dependent-reference"), "{axis}");
    assert_ne!(verdict(&["--reference-is-dependent"])["says"], axis["says"]);
}
