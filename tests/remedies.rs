//! A fault that another unit, order, sign or axis takes out is answered with the whole command that does, on the real program.

#![allow(clippy::format_push_string)] // made once, for the test

mod common;

use common::{Bench, log};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::Value;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Time, the rates of three gyros, and the orientation of their body.
fn rows() -> Vec<(f64, Vector3<f64>, UnitQuaternion<f64>)> {
    const STEP: f64 = 0.01;
    let rate = |t: f64| {
        Vector3::new(
            0.9 * (1.9 * t).sin() + 0.5 * (5.2 * t).cos(),
            0.7 * (1.4 * t).cos() + 0.6 * (6.9 * t).sin(),
            (1.1 * t).sin() + 0.4 * (4.4 * t).cos(),
        )
    };
    let mut attitude = UnitQuaternion::identity();
    (0..3000_u32)
        .map(|k| {
            let t = f64::from(k) * STEP;
            let own = attitude;
            attitude *= UnitQuaternion::from_scaled_axis(rate(t + 0.5 * STEP) * STEP);
            let noise = |i: u32| 2e-3 * (f64::from((k * 7919 + i * 104_729 + 13) % 997) / 997.0 - 0.5);
            (t, 1.01 * rate(t) + Vector3::new(noise(0), noise(1), noise(2)), own)
        })
        .collect()
}

/// A log of them: the gyro's columns and those of the reference, as they are given here.
fn written(header: &str, fields: impl Fn(&Vector3<f64>, &UnitQuaternion<f64>) -> Vec<f64>) -> String {
    let mut text = format!("{header}\n");
    for (t, gyro, attitude) in rows() {
        let fields: Vec<String> = fields(&gyro, &attitude).iter().map(|x| format!("{x:.8}")).collect();
        text.push_str(&format!("{t:.2},{}\n", fields.join(",")));
    }
    text
}

/// The command that stands behind `next`, its words.
fn next(report: &str) -> Vec<String> {
    let line =
        report.lines().find_map(|line| line.strip_prefix("next  truerate ")).unwrap_or_else(|| panic!("{report}"));
    line.split_whitespace().map(str::to_owned).collect()
}

/// All three axes are judged, and have the scale factor that was made.
fn is_right(name: &str, found: &Value) {
    let axes = found["axes"].as_array().unwrap();
    assert_eq!(axes.len(), 3, "{name}");
    for axis in axes {
        let scale = axis["parameters"][0]["value"].as_f64().unwrap();
        let right = axis["verdict"] != "bad-data" && (scale - 1.0 / 1.01).abs() < 1e-3;
        assert!(right, "{name}: axis {} is {}, {scale}", axis["axis"], axis["verdict"]);
    }
}

#[test]
fn an_orientation_in_another_order_or_with_its_axes_turned_is_answered_with_the_maps_that_turn_it_back() {
    const GYRO: &str = "t,gyro_x,gyro_y,gyro_z,ref_qw,ref_qx,ref_qy,ref_qz";
    let w = |q: &UnitQuaternion<f64>| vec![q.w, q.i, q.j, q.k];
    let join = |g: [f64; 3], q: Vec<f64>| [g.to_vec(), q].concat();
    let logs = [
        ("swapped.csv", written(GYRO, |g, q| join([g.y, -g.x, g.z], w(q))), "gyro_x=-gyro_y"),
        ("upside-down.csv", written(GYRO, |g, q| join([g.x, -g.y, -g.z], w(q))), "gyro_z=-gyro_z"),
        ("cyclic.csv", written(GYRO, |g, q| join([g.z, g.x, g.y], w(q))), "gyro_x=gyro_y"),
        ("inverse.csv", written(GYRO, |g, q| join([g.x, g.y, g.z], w(&q.inverse()))), "ref_qx=-ref_qx"),
        ("xyzw.csv", written(GYRO, |g, q| join([g.x, g.y, g.z], vec![q.i, q.j, q.k, q.w])), "ref_qw=ref_qz"),
        (
            "swapped-degrees.csv",
            written(
                &GYRO.replace("_x,", "_x_dps,").replace("_y,", "_y_dps,").replace("gyro_z,", "gyro_z_dps,"),
                |g, q| join([g.y.to_degrees(), -g.x.to_degrees(), g.z.to_degrees()], w(q)),
            ),
            "gyro_x_dps=-gyro_y_dps",
        ),
    ];
    let bench = Bench::new();
    for (name, text, map) in logs {
        bench.file(name, text);
        let report = bench.ok(&["compare", name]);
        let command = next(&report);
        assert!(command.contains(&map.to_owned()), "{name}: {command:?}");
        let words: Vec<&str> = command.iter().map(String::as_str).chain(["--format", "json"]).collect();
        let mended = json(&bench.ok(&words));
        is_right(name, &mended);
    }
}

#[test]
fn a_rotation_matrix_is_read_as_an_orientation_whichever_way_its_numbers_are_named() {
    let bench = Bench::new();
    let nine = |q: &UnitQuaternion<f64>, column_by_column: bool| {
        let matrix = q.to_rotation_matrix().into_inner();
        let place = |i: usize| if column_by_column { matrix[(i % 3, i / 3)] } else { matrix[(i / 3, i % 3)] };
        (0..9).map(place).collect::<Vec<f64>>()
    };
    let names = |of: &dyn Fn(usize) -> String| (0..9).map(of).collect::<Vec<_>>().join(",");
    for (name, header, turned) in [
        ("r", names(&|i| format!("r{}{}", i / 3, i % 3)), false),
        ("m", names(&|i| format!("m{}{}", i / 3 + 1, i % 3 + 1)), false),
        ("R_", names(&|i| format!("R_{i}")), false),
        ("columns", names(&|i| format!("R_{i}")), true),
    ] {
        let file = format!("{name}.csv");
        let row = |g: &Vector3<f64>, q: &UnitQuaternion<f64>| [vec![g.x, g.y, g.z], nine(q, turned)].concat();
        bench.file(&file, written(&format!("t,gyro_x,gyro_y,gyro_z,{header}"), row));
        let refusal = bench.refused(&["compare", &file]);
        assert!(refusal.contains("the rotation matrix in"), "{refusal}");
        let command = common::advised(&refusal).unwrap();
        let words: Vec<&str> = command.iter().map(String::as_str).chain(["--format", "json"]).collect();
        let found = json(&bench.ok(&words));
        is_right(name, &found);
    }
    let part = written("t,gyro_x,gyro_y,gyro_z,ref_r00,ref_r01", |g, _| vec![g.x, g.y, g.z, 1.0, 0.0]);
    bench.file("part.csv", part);
    assert!(bench.refused(&["compare", "part.csv"]).contains("needs all nine"));
}

#[test]
fn a_wrong_unit_sign_or_axis_is_answered_with_the_map_that_takes_it_out() {
    const HEADER: &str = "t,gyro_z,ref_angle_z";
    let bench = Bench::new();
    let own = |header: &str, row: &dyn Fn([f64; 3]) -> Vec<f64>| {
        let mut text = format!("{header}\n");
        for line in log(3000).lines().skip(1) {
            let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            let fields: Vec<String> = row([v[0], v[1], v[2]]).iter().map(f64::to_string).collect();
            text.push_str(&format!("{}\n", fields.join(",")));
        }
        text
    };
    for (name, text, maps) in [
        ("us.csv", own(HEADER, &|[t, g, a]| vec![(1e6 * t).round(), g, a]), "--map t_us=t"),
        ("ms.csv", own(HEADER, &|[t, g, a]| vec![(1e3 * t).round(), g, a]), "--map t_ms=t"),
        ("degrees.csv", own(HEADER, &|[t, g, a]| vec![t, g.to_degrees(), a]), "--map gyro_z_dps=gyro_z"),
        (
            "both.csv",
            own(HEADER, &|[t, g, a]| vec![(1e3 * t).round(), g.to_degrees(), a]),
            "--map t_ms=t --map gyro_z_dps=gyro_z",
        ),
        ("angle.csv", own(HEADER, &|[t, g, a]| vec![t, g, a.to_degrees()]), "--map ref_angle_z_deg=ref_angle_z"),
        ("sign.csv", own(HEADER, &|[t, g, a]| vec![t, -g, a]), "--map ref_angle_z=-ref_angle_z"),
        (
            "axis.csv",
            own("t,gyro_x,gyro_z,ref_angle_z", &|[t, g, a]| vec![t, g, 0.01 * (7.3 * t).sin(), a]),
            "--map ref_angle_x=ref_angle_z",
        ),
    ] {
        bench.file(name, text);
        let report = bench.ok(&["diagnose", name]);
        assert!(report.contains(&format!("next  truerate diagnose {name} {maps}\n")), "{name}: {report}");
        let words = next(&report);
        let words: Vec<&str> = words.iter().map(String::as_str).chain(["--format", "json"]).collect();
        assert_ne!(json(&bench.ok(&words))["axes"][0]["verdict"], "bad-data", "{name}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn times_in_a_wrong_unit_cost_no_memory_by_the_years_that_they_seem_to_span() {
    let bench = Bench::new();
    let mut text = String::from("t,gyro_z,ref_angle_z\n");
    for line in log(20_000).lines().skip(1) {
        let (t, rest) = line.split_once(',').unwrap();
        text.push_str(&format!("{:.0},{rest}\n", 1e6 * t.parse::<f64>().unwrap()));
    }
    bench.file("us.csv", text);
    let words = ["compare", "us.csv"].join(" ");
    let program = env!("CARGO_BIN_EXE_truerate");
    // 63 years in pieces of 0.1 s would take 160 GB; 1 GB is what the log needs, many times over.
    let out = std::process::Command::new("sh")
        .args(["-c", &format!("ulimit -v 3000000; exec {program} {words}")])
        .current_dir(bench.path(""))
        .output()
        .unwrap();
    let report = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success() && report.contains("--map t_us=t"), "{out:?}");
}
