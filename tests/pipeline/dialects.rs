//! Text as boards and brokers write it, live by every way on which text comes: rows as from a log, and what is not understood is said
//! at once, with the line and a command that reads it.

use crate::harness::{Pipeline, Place};
use serde_json::Value;
use std::{
    fmt::Write as _,
    io::Write,
    net::{TcpListener, UdpSocket},
    thread::sleep,
    time::Duration,
};

/// Rows of a turning axis: time in ms, rate in °/s, angle in °.
fn rows() -> Vec<[f64; 3]> {
    let row = |k: u32| {
        let t = f64::from(k) * 0.01;
        let (rate, angle) = (60.0 * (1.3 * t).sin(), -60.0 / 1.3 * (1.3 * t).cos());
        [10.0 * f64::from(k), 1.01 * rate + 0.3, angle]
    };
    (0..400).map(row).collect()
}

/// The same in the shapes that people have, with what a board says at its start.
fn shapes() -> Vec<(&'static str, String)> {
    let written = |above: &str, row: &dyn Fn(&[f64; 3]) -> String| {
        let lines: String = rows().iter().map(|values| row(values) + "\r\n").collect();
        format!("rst:0x1 (POWERON)\r\nIMU ready, 100 Hz\r\n{above}{lines}")
    };
    vec![
        ("tabs", written("t_ms\tgyro_z_dps\tref_angle_z_deg\r\n", &|[t, g, a]| format!("{t}\t{g:.3}\t{a:.4}"))),
        (
            "decimal commas",
            written("t_ms;gyro_z_dps;ref_angle_z_deg\r\n", &|[t, g, a]| format!("{t};{g:.3};{a:.4}").replace('.', ",")),
        ),
        ("blanks", written("t_ms gyro_z_dps ref_angle_z_deg\r\n", &|[t, g, a]| format!("{t}  {g:.3} {a:.4}"))),
        ("labels", written("", &|[t, g, a]| format!("t_ms:{t} gyro_z_dps:{g:.3} ref_angle_z_deg:{a:.4}"))),
        (
            "nested JSON",
            written("", &|[t, g, a]| {
                format!("{{\"t_ms\":{t},\"imu\":{{\"gyro_dps\":[0,0,{g:.3}]}},\"encoder\":{{\"z_deg\":{a:.4}}}}}")
            }),
        ),
        (
            "JSON below topics",
            written("", &|[t, g, a]| {
                format!(
                    "a/imu {{\"t_ms\":{t},\"gyro_z_dps\":{g:.3}}}\r\na/enc {{\"t_ms\":{},\"encoder_z_deg\":{a:.4}}}",
                    t + 3.0
                )
            }),
        ),
    ]
}

fn source_of(place: &Place, instance: &str) -> Value {
    place.status(instance).map_or(Value::Null, |status| status["source"].clone())
}

/// Ends a pipeline that was fed, and holds its parameters against those of the rows.
fn check(what: &str, pipeline: Pipeline) {
    let ended = pipeline.end();
    let rows = if what == "JSON below topics" { 800 } else { 400 };
    assert!(ended.out.contains(&format!("source: ended, {rows} rows")), "{what}: {}{}", ended.out, ended.error);
    let (alpha, error) = crate::harness::parameter(&ended.out, "z", "scale-factor.alpha");
    assert!((alpha - 1.0 / 1.01).abs() < 1e-3_f64.max(4.0 * error), "{what}: {alpha} ± {error}\n{}", ended.out);
}

#[test]
fn text_of_any_shape_is_read_from_a_pipe_as_from_a_log() {
    let place = Place::new();
    for (k, (what, text)) in shapes().into_iter().enumerate() {
        let (pipeline, mut input) = place.start_fed(&format!("shape{k}"), &["--speed", "max"]);
        input.write_all(text.as_bytes()).unwrap();
        drop(input);
        check(what, pipeline);
    }
}

#[test]
fn the_same_text_comes_by_tcp_and_udp() {
    let place = Place::new();
    let shapes = shapes();
    let text = |what: &str| &shapes.iter().find(|(name, _)| *name == what).unwrap().1;
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut pipeline = place.start("tcp", &["--source", &format!("tcp:{}", listener.local_addr().unwrap())]);
    let (mut link, _) = listener.accept().unwrap();
    link.write_all(text("tabs").as_bytes()).unwrap();
    pipeline.until("rows with tabs", |_| source_of(&place, "tcp")["rows"] == 400);
    assert_eq!(pipeline.interrupt().code, Some(0));
    let to = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let mut pipeline = place.start("udp", &["--source", &format!("udp:{to}")]);
    let open = |source: &Value| source["link"] == "connected" || source["link"] == "silent";
    pipeline.until("that it is open", |_| open(&source_of(&place, "udp")));
    let from = UdpSocket::bind("127.0.0.1:0").unwrap();
    for line in text("nested JSON").split_inclusive('\n') {
        from.send_to(line.as_bytes(), to).unwrap();
        sleep(Duration::from_millis(1));
    }
    pipeline.until("rows of JSON", |_| source_of(&place, "udp")["rows"].as_u64() > Some(380));
    assert_eq!(pipeline.interrupt().code, Some(0));
}

#[test]
fn what_is_not_understood_is_said_first_with_a_command_that_reads_it() {
    let place = Place::new();
    let text = rows().iter().fold(String::new(), |mut text, [t, g, a]| {
        let _ = writeln!(text, "{t}\t{g:.2}\t{a:.3}");
        text
    });
    let (mut pipeline, mut input) = place.start_fed("bare", &["--speed", "max"]);
    input.write_all(text.as_bytes()).unwrap();
    let mut seen = Value::Null;
    pipeline.until("what is not understood", |_| {
        seen = source_of(&place, "bare");
        seen["trouble"].as_str().is_some_and(|trouble| trouble.contains("--map"))
    });
    let trouble = seen["trouble"].as_str().unwrap();
    assert!(trouble.starts_with("not understood: ") && trouble.contains('⇥'), "{seen}");
    assert!(seen["says"].as_str().unwrap().starts_with("not understood, 0 rows"), "{seen}");
    let maps = ["--map", "t_ms=1", "--map", "gyro_z_dps=2", "--map", "ref_angle_z_deg=3"];
    assert!(trouble.lines().last().unwrap().ends_with(&maps.join(" ")), "{trouble}");
    drop(input);
    assert_eq!(pipeline.end_reading().code, Some(1));
    let (pipeline, mut input) = place.start_fed("mapped", &[&["--speed", "max"], &maps[..]].concat());
    input.write_all(text.as_bytes()).unwrap();
    drop(input);
    check("maps", pipeline);
}
