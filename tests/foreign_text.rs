//! Text as other programs write it: read with the very result of the same log in our own names, or refused with the flag that
//! makes it readable.

#![allow(clippy::format_push_string, clippy::format_collect)] // made once, for the test

mod common;

use common::{Bench, advised, log};
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
        ("minutes", written("Time (min),gyro_z,ref_angle_z\n", |[t, g, a]| format!("{:.9},{g},{a}", t / 60.0))),
        ("hours", written("time_h,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{:.11},{g},{a}", t / 3600.0))),
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
        (
            "colons",
            written("time,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{}0,{g},{a}", clock(*t).replace('.', ":"))),
        ),
        (
            "senml",
            written(
                "[{\"bn\":\"urn:dev:ow:10e2073a01080063:\",\"bt\":1763700000,\"n\":\"none\",\"v\":0},\n",
                |[t, g, a]| {
                    format!(
                        "{{\"n\":\"gyro_z\",\"u\":\"rad/s\",\"t\":{t},\"v\":{g}}},{{\"n\":\"ref_angle_z\",\"u\":\"rad\",\"t\":{t},\"v\":{a}}},"
                    )
                },
            ),
        ),
        ("records", written("", |[t, g, a]| format!("{{\"t\": {t}, \"gyro_z\": {g}, \"ref_angle_z\": {a}}}"))),
        (
            "nested",
            written("", |[t, g, a]| {
                format!(
                    "{{\"stamp\": {t}, \"angular_velocity\": [0, 0, {g}], \"shaft\": {{\"ref_angle_z\": \"{a}\"}}}}"
                )
            }),
        ),
        (
            "list",
            format!(
                "[{}]",
                written("", |[t, g, a]| format!(
                    "\n {{\n  \"t\": {t},\n  \"gyro_z\": {g},\n  \"ref_angle_z\": {a}\n }},"
                ))
            ),
        ),
        (
            "labels-with-units",
            written("sensor found\n", |[t, g, a]| {
                format!("t: {t} s  gyro_z: {} deg/s  ref_angle_z: {} deg", g.to_degrees(), a.to_degrees())
            }),
        ),
        (
            "time-then-labels",
            written("", |[t, g, a]| {
                format!("{} ms | gyro z = {} °/s | ref_angle_z = {} deg", t * 1e3, g.to_degrees(), a.to_degrees())
            }),
        ),
        ("sentences", written("kind,t,gyro_z,ref_angle_z\n", |[t, g, a]| format!("$IMU,{t},{g},{a}*5A"))),
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

/// Bytes of a text in an older encoding.
fn encoded(text: &str, as_utf16: bool) -> Vec<u8> {
    if as_utf16 {
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    } else {
        text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect()
    }
}

#[test]
fn what_people_and_their_programs_write_is_understood() {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    let degrees = |g: f64, a: f64| (g.to_degrees(), a.to_degrees());
    let groups = |x: i64| if x < 1000 { x.to_string() } else { format!("{},{:03}", x / 1000, x % 1000) };
    let header = "t,gyro_z,ref_angle_z\n";
    let plain = |[t, g, a]: &[f64; 3]| format!("{t},{g},{a}");
    let instrument = "LabVIEW Measurement\t\nWriter_Version\t2\n***End_of_Header***\t\n\nSamples\t2000\t2000\n\
        Date\t2026/11/25\t2026/11/25\nTime\t12:30:00\t12:30:00\nDelta_X\t0.01\t0.01\nX_Value\tgyro_z\tref_angle_z\tComment\n";
    let shapes: Vec<(&str, Vec<u8>)> = vec![
        (
            "german",
            written("Zeit [s];Drehrate Z [°/s];Drehgeber Z [°]\r\n", |[t, g, a]| {
                let (g, a) = degrees(*g, *a);
                format!("{t};{g};{a}\r").replace('.', ",")
            })
            .into_bytes(),
        ),
        (
            "latin-1",
            encoded(
                &written("time (s),gyro z (°/s),encoder angle (°)\n", |[t, g, a]| {
                    let (g, a) = degrees(*g, *a);
                    format!("{t},{g},{a}")
                }),
                false,
            ),
        ),
        ("utf-16", encoded(&written("t\tgyro_z\tref_angle_z\r\n", |[t, g, a]| format!("{t}\t{g}\t{a}\r")), true)),
        ("index", written(",t,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{:.0},{t},{g},{a}", t * 100.0)).into_bytes()),
        (
            "dates",
            written(",gyro_z,ref_angle_z\n", |[t, g, a]| format!("2026-11-25 12:30:{t:05.2},{g},{a}")).into_bytes(),
        ),
        (
            "durations",
            written("time,gyro_z,ref_angle_z\n", |[t, g, a]| format!("0 days 00:00:{t:09.6},{g},{a}")).into_bytes(),
        ),
        (
            "days",
            written("time,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{:.12},{g},{a}", 45_986.5 + t / 86_400.0))
                .into_bytes(),
        ),
        (
            "serial-monitor",
            written("12:29:59.123 -> gyro_z,ref_angle_z\n", |[t, g, a]| format!("12:30:{t:06.3} -> {g},{a}"))
                .into_bytes(),
        ),
        ("labels", written("", |[t, g, a]| format!("t:{t},gyro_z:{g},ref_angle_z:{a}")).into_bytes()),
        (
            "records",
            written("", |[t, g, a]| format!("{{\"t\": {t}, \"gyro_z\": {g}, \"ref_angle_z\": {a}}}")).into_bytes(),
        ),
        (
            "counter",
            written("micros,gyro_z,ref_angle_z\n", |[t, g, a]| {
                format!("{},{g},{a}", (4_290_000_000 + (t * 1e6).round() as i64) % (1 << 32))
            })
            .into_bytes(),
        ),
        ("no-value", (header.to_owned() + "-1.0,NA,0\n-0.9,null,0\n-0.8,--,0\n" + &written("", plain)).into_bytes()),
        (
            "groups",
            written("t_ms,gyro_z,ref_angle_z\n", |[t, g, a]| {
                format!("\"{}\",{g},{a}", groups((t * 1e3).round() as i64))
            })
            .into_bytes(),
        ),
        ("minus", written(header, |row| plain(row).replace('-', "−")).into_bytes()),
        ("below", (written(header, plain) + "\nTotal rows: 2000\nMean rate,0.03\n").into_bytes()),
        ("instrument", written(instrument, |[t, g, a]| format!("{t}\t{g}\t{a}\t")).into_bytes()),
        ("twice", written("t,flag,gyro_z,flag,ref_angle_z\n", |[t, g, a]| format!("{t},1,{g},2,{a}")).into_bytes()),
        (
            "flight",
            written("time_boot_ms,yawspeed,encoder_z [rad]\n", |[t, g, a]| format!("{:.0},{g},{a}", t * 1e3))
                .into_bytes(),
        ),
    ];
    for (name, text) in shapes {
        let file = format!("{name}.csv");
        bench.file(&file, text);
        let found = fitted(&bench, &[&file]);
        assert!(
            (found.0 - wanted.0).abs() < 5e-6 && (found.1 - wanted.1).abs() < 5e-6,
            "{name}: {found:?}, not {wanted:?}"
        );
    }
}

/// Microseconds of a time.
fn micros(t: f64) -> i64 {
    (t * 1e6).round() as i64
}

/// Its whole seconds, and the rest in microseconds.
fn parts(t: f64) -> (i64, i64) {
    (micros(t) / 1_000_000, micros(t) % 1_000_000)
}

/// As date and time of day.
fn day(t: f64) -> String {
    format!("2026-05-02T09:14:{:09.6}", t % 60.0)
}

fn of_loggers() -> Vec<(&'static str, String)> {
    vec![
        (
            "zephyr",
            written("*** Booting Zephyr OS ***\n", |[t, g, a]| {
                let (s, us) = parts(*t);
                format!("[00:00:{s:02}.{:03},{:03}] <inf> imu: gyro_z={g} ref_angle_z={a}", us / 1000, us % 1000)
            }),
        ),
        (
            "stamps-alone",
            written("", |[t, g, a]| {
                let stamp = format!("12:30:{t:06.3} ->");
                format!("{stamp} gyro_z: {g}, ref_angle_z: {a}\n{stamp}")
            }),
        ),
        (
            "esp-idf",
            written("rst:0x1 (POWERON)\n", |[t, g, a]| {
                format!(
                    "\x1b[0;32mI ({}) imu: gyro: x=0 y=0 z={} dps, encoder_z={} deg\x1b[0m",
                    micros(*t) / 1000,
                    g.to_degrees(),
                    a.to_degrees()
                )
            }),
        ),
        ("ros", written("", |[t, g, a]| format!("[INFO] [{:.6}] [imu]: gyro z: {g} ref angle z: {a}", 1.79e9 + t))),
        (
            "python",
            written("", |[t, g, a]| {
                format!("{} - imu - INFO - gyro_z={g} ref_angle_z={a}", day(*t).replace('T', " ").replace('.', ","))
            }),
        ),
        (
            "systemd",
            written("", |[t, g, a]| {
                format!("May 02 09:14:{:09.6} host imu[8]: gyro_z: {g} ref_angle_z: {a}", t % 60.0)
            }),
        ),
    ]
}

fn of_scripts_and_databases() -> Vec<(&'static str, String)> {
    vec![
        (
            "teleplot",
            written("", |[t, g, a]| {
                let ms = micros(*t) / 1000;
                format!(">gyro_z:{ms}:{}§deg/s\n>ref_angle_z:{ms}:{}§deg", g.to_degrees(), a.to_degrees())
            }),
        ),
        (
            "pairs",
            written("", |[t, g, a]| {
                let ms = micros(*t) / 1000;
                format!(
                    "{0}Z,FE,attitude_t,time_boot_ms,{ms},ref_angle_z,{a},gyro_z,{g},Len,36\n{0}Z,FE,scaled_imu_t,time_boot_ms,{ms},xmag,1,ymag,2",
                    day(*t)
                )
            }),
        ),
        (
            "sensors",
            format!(
                "[{}{}{{\"sensor\": \"End\"}}]",
                written("", |[t, g, _]| {
                    format!(
                        "{{\"sensor\": \"Gyroscope\", \"time\": \"{}000\", \"x\": 0, \"y\": 0, \"z\": {g}}},",
                        micros(*t)
                    )
                }),
                written("", |[t, _, a]| {
                    format!("{{\"sensor\": \"Shaft\", \"time\": \"{}000\", \"ref_angle_z\": {a}}},", micros(*t))
                })
            ),
        ),
        (
            "line-protocol",
            written("", |[t, g, a]| {
                format!(
                    "imu,host=a gyro_z={g} {0}000\nshaft ref_angle_z={a} {0}000",
                    1_790_000_000_000_000 + micros(*t)
                )
            }),
        ),
        (
            "long",
            written("time,measurement,field,value\n", |[t, g, a]| {
                format!("{t},imu,gyro_z,{g}\n{t},shaft,ref_angle_z,{a}")
            }),
        ),
        (
            "annotated",
            format!(
                "#group,false\n#datatype,string\n,table,_time,_value,_field,_measurement\n{}\n#group,false\n,table,_time,_value,_field,_measurement\n{}",
                written("", |[t, g, _]| format!(",0,{}Z,{g},gyro_z,imu", day(*t))),
                written("", |[t, _, a]| format!(",1,{}Z,{a},ref_angle_z,shaft", day(*t)))
            ),
        ),
        (
            "documents",
            written("", |[t, g, a]| {
                let (s, us) = parts(*t);
                format!(
                    "header:\n  stamp:\n    sec: {s}\n    nanosec: {}\n  frame_id: imu\nangular_velocity:\n  x: 0.0\n  y: 0.0\n  z: {g}\nshaft:\n  ref_angle_z: {a}\n---",
                    us * 1000
                )
            }),
        ),
        (
            "dicts",
            written("", |[t, g, a]| format!("{{'t': {t}, 'gyro': (0, 0, {g}), 'ref_angle_z': {a}, 'ok': True}}")),
        ),
        (
            "document",
            format!(
                "{{\"meta\": {{\"fs\": 100}}, \"data\": {{\"t\": [{}], \"gyro\": {{\"z\": [{}]}}, \"ref_angle_z\": [{}]}}}}",
                listed(&|row| row[0]),
                listed(&|row| row[1]),
                listed(&|row| row[2])
            ),
        ),
    ]
}

/// Tables as people and devices write them.
fn of_tables() -> Vec<(&'static str, String)> {
    vec![
        (
            "ruled",
            written("| t | gyro_z | ref_angle_z |\n|---|--------|-------------|\n", |[t, g, a]| {
                format!("| {t} | {g} | {a} |")
            }),
        ),
        ("united", written("Time,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{t} sec,{g},{a}"))),
        (
            "per",
            written("t_s,yaw_gyro_z_deg_per_s,encoder_z_mrad\n", |[t, g, a]| {
                format!("{t},{},{}", g.to_degrees(), a * 1e3)
            }),
        ),
        (
            "columns-of-a-clock",
            written("Hour,Minute,Second,Millisecond,gyro_z,ref_angle_z\n", |[t, g, a]| {
                let ms = micros(*t) / 1000 % 3_600_000;
                format!("9,{},{},{},{g},{a}", ms / 60_000, ms / 1000 % 60, ms % 1000)
            }),
        ),
        (
            "stopped-clock",
            written(
                "headingTimestamp_since1970(s),motionTimestamp_sinceReboot(s),gyro_z,ref_angle_z\n",
                |[t, g, a]| format!("1790000000.1,{},{g},{a}", 41_234.5 + t),
            ),
        ),
    ]
}

#[test]
fn what_loggers_scripts_and_databases_write_is_understood() {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    for (name, text) in of_loggers().into_iter().chain(of_scripts_and_databases()).chain(of_tables()) {
        let file = format!("{name}.txt");
        bench.file(&file, text);
        let found = fitted(&bench, &[&file]);
        assert!(
            (found.0 - wanted.0).abs() < 5e-6 && (found.1 - wanted.1).abs() < 5e-6,
            "{name}: {found:?}, not {wanted:?}"
        );
    }
}

/// One number of each row, as JSON has a list.
fn listed(of: &dyn Fn(&[f64; 3]) -> f64) -> String {
    rows().iter().map(|row| of(row).to_string()).collect::<Vec<_>>().join(", ")
}

/// Runs the command that a refusal ends in, and holds its result against that of the same log in our own names.
fn mended(texts: Vec<(&str, String, Vec<&str>, f64)>) {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    for (name, text, says, within) in texts {
        bench.file(name, text);
        let refusal = bench.refused(&["fit", name]);
        for says in says {
            assert!(refusal.contains(says), "{name}: '{says}' is missing in: {refusal}");
        }
        let command = advised(&refusal).expect(&refusal);
        let found = fitted(&bench, &command[1..].iter().map(String::as_str).collect::<Vec<_>>());
        assert!((found.0 - wanted.0).abs() < within, "{name}: {found:?}, not {wanted:?}");
    }
}

#[test]
fn a_time_is_found_or_made_of_what_is_there() {
    let count = |t: f64| (t * 100.0).round();
    mended(vec![
        (
            "t-ms.csv",
            written("t,gz,angle\n", |[t, g, a]| format!("{:.0},{g},{a}", 2311.0 + t * 1e3)),
            vec!["'t' only grows", "--map t_ms=t"],
            1e-6,
        ),
        (
            "t-us.csv",
            written("t,gyro_z,yaw\n", |[t, g, a]| format!("{:.0},{g},{a}", t * 1e6)),
            vec!["--map t_us=t"],
            1e-6,
        ),
        (
            "ticks.csv",
            written("sensortime,gyro_z,angle\n", |[t, g, a]| format!("{:.0},{g},{a}", 4096.0 + t * 25_600.0)),
            vec!["'sensortime' counts ticks of 39.0625 µs", "--map 't_us=39.0625*sensortime'"],
            1e-6,
        ),
        (
            "short-timer.csv",
            written("fifo_ts,gyro_z,angle\n", |[t, g, a]| format!("{},{g},{a}", micros(*t) % 65_536)),
            vec!["'fifo_ts' only grows", "--map t_us=fifo_ts"],
            1e-6,
        ),
        (
            "counter.csv",
            written("sample,gyro_z,angle\n", |[t, g, a]| format!("{},{g},{a}", count(*t))),
            vec!["'sample' counts rows", "is an example", "t=0.01*sample"],
            1e-6,
        ),
        ("timeless.csv", written("gyro_z,enc\n", |[_, g, a]| format!("{g},{a}")), vec!["t=0.01*row"], 1e-6),
        (
            "steps.csv",
            written("dt_us,gyro_z,angle\n", |[_, g, a]| format!("10000,{g},{a}")),
            vec!["'dt_us' is the time from row to row", "t_us=sum(dt_us)"],
            1e-6,
        ),
        ("seconds.csv", written("dt,gyro_z,angle\n", |[_, g, a]| format!("0.010,{g},{a}")), vec!["t=sum(dt)"], 1e-6),
    ]);
    // Rows that are twice as far apart are as well known.
    let bench = Bench::new();
    bench.file("slow.csv", written("gyro_z,enc\n", |[_, g, a]| format!("{},{a}", 0.5 * g)));
    assert!(bench.refused(&["fit", "slow.csv"]).contains("t=0.02*row"));
    bench.file("coarse.csv", written("time,gyro_z,angle\n", |[t, g, a]| format!("{t:.0},{g},{a}")));
    assert!(bench.refused(&["fit", "coarse.csv"]).contains("too few digits"));
}

#[test]
fn a_reference_is_found_in_units_and_shapes_that_no_name_says() {
    let half = |a: f64| (0.5 * a).sin_cos();
    mended(vec![
        (
            "turns.csv",
            written("t,gyro_z,pos_estimate\n", |[t, g, a]| format!("{t},{g},{}", a / std::f64::consts::TAU)),
            vec!["360*pos_estimate"],
            1e-4,
        ),
        (
            "mavlink.csv",
            written("time_boot_ms,zgyro,hdg\n", |[t, g, a]| {
                format!("{:.0},{:.0},{:.0}", t * 1e3, g * 1e3, (a.to_degrees() * 100.0).rem_euclid(36_000.0))
            }),
            vec!["0.001*zgyro", "0.01*hdg"],
            1e-3,
        ),
        (
            "bridge.jsonl",
            written("", |[t, g, a]| {
                let (s, us) = parts(*t);
                let around = |topic: &str, values: &str| {
                    format!(
                        "{{\"op\": \"publish\", \"topic\": \"{topic}\", \"msg\": {{\"header\": {{\"stamp\": {{\"sec\": {s}, \"nanosec\": {}}}}}, {values}}}}}",
                        us * 1000
                    )
                };
                let gyro = format!("\"angular_velocity\": {{\"x\": 0, \"y\": 0, \"z\": {g}}}");
                let table = format!("\"vector\": {{\"x\": 0, \"y\": 0, \"z\": {a}}}");
                format!("{}\n{}", around("/imu", &gyro), around("/table", &table))
            }),
            vec!["--map ref_angle_z=msg.vector.z"],
            1e-6,
        ),
        (
            "quaternion.csv",
            written("t,wz,q1,q2,q3,q4\n", |[t, g, a]| format!("{t},{g},0,0,{},{}", half(*a).0, half(*a).1)),
            vec!["(x, y, z, w)", "ref_qw=q4"],
            1e-4,
        ),
        (
            "inverse.csv",
            written("t,wz,q1,q2,q3,q4\n", |[t, g, a]| format!("{t},{g},{},0,0,{}", half(*a).1, -half(*a).0)),
            vec!["world to body", "ref_qz=-q4"],
            1e-4,
        ),
        (
            "several.csv",
            written("t,gyro_z,yaw_deg,nothing,gnss_heading_deg\n", |[t, g, a]| {
                format!("{t},{g},{0},0,{0}", a.to_degrees())
            }),
            vec!["'gnss_heading_deg' turns", "so does 'yaw_deg'"],
            1e-6,
        ),
        (
            "words.csv",
            written("ms,AcX,AcY,AcZ,GyX,GyY,GyZ,count\n", |[t, g, a]| {
                let (word, count) = ((g.to_degrees() * 65.5).round(), (a.to_degrees() / 360.0 * 1600.0).floor());
                format!("{:.0},198,-24,8108,3,-4,{word},{count}", t * 1e3)
            }),
            vec!["65.5 steps a °/s", "GyZ/65.5", "0.225*count"],
            5e-3,
        ),
    ]);
}

#[test]
fn what_shows_no_motion_is_no_reference_and_two_wheels_are_one() {
    let heading = |value: &'static str| {
        written("t,gyro_z,motionHeading(°),shaft\n", move |[t, g, a]| format!("{t},{g},{value},{a}"))
    };
    let ticks = written("t,gyro_z,left_ticks,right_ticks\n", |[t, g, a]| {
        let way = 400.0 * (0.3 * t + 0.1 * t.sin());
        format!("{t},{g},{:.0},{:.0}", 20.0 * (way - 1500.0 * a), 20.0 * (way + 1500.0 * a))
    });
    let speeds = written("t,gyro_z,v_l,v_r\n", |[t, g, _]| format!("{t},{g},{},{}", 0.3 - 0.1 * g, 0.3 + 0.1 * g));
    let nanoseconds = written("t,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{:.0},{g},{a}", t * 1e9));
    mended(vec![
        ("unset.csv", heading("-1"), vec!["'motionHeading(°)' shows no motion", "'shaft' turns as gyro_z does"], 1e-6),
        ("zero.csv", heading("0"), vec!["cannot be a reference", "ref_angle_z=shaft"], 1e-6),
        // The way of a wheel in one count is what the gyro itself says.
        ("ticks.csv", ticks, vec!["diff(right_ticks,left_ticks)", "its scale factor cannot be found"], 0.02),
        ("speeds.csv", speeds, vec!["ref_rate_z=", "diff(v_r,v_l)"], 0.02),
        ("nanoseconds.csv", nanoseconds, vec!["292 years", "t_ns=t"], 1e-6),
    ]);
    let bench = Bench::new();
    bench.file("none.csv", written("t,gyro_z,motionHeading(°)\n", |[t, g, _]| format!("{t},{g},-1")));
    let refused = bench.refused(&["diagnose", "none.csv"]);
    assert!(refused.contains("shows no motion") && refused.ends_with("--reference REFERENCE.csv"), "{refused}");
    assert!(!bench.ok(&["channels", "none.csv"]).contains("=motionHeading"));
    bench.file("taken.csv", written("t,gyro_z,encoder_z,shaft\n", |[t, g, a]| format!("{t},{g},7,{a}")));
    let refused = bench.refused(&["diagnose", "taken.csv"]);
    assert!(refused.contains("'encoder_z' shows no motion") && refused.contains("ref_angle_z=shaft"), "{refused}");
}

#[test]
fn a_second_file_without_a_header_is_named_column_by_column() {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    let epoch = 1_700_000_000.0;
    bench.file(
        "gyro.csv",
        written("elapsed (s),epoch (ms),gyro_z\n", |[t, g, _]| format!("{t},{:.0},{g}", (epoch + t) * 1e3)),
    );
    let pose =
        |[t, _, a]: &[f64; 3]| format!("{:.3} 0.1 0.2 0.3 0 0 {} {}", epoch + t, (0.5 * a).sin(), (0.5 * a).cos());
    bench.file("tum.txt", written("", pose));
    let refusal = bench.refused(&["fit", "gyro.csv", "--reference", "tum.txt"]);
    let command = advised(&refusal).expect(&refusal);
    assert!(refusal.contains("--map ref:t=1 --map ref_qw=8"), "{refusal}");
    let found = fitted(&bench, &command[1..].iter().map(String::as_str).collect::<Vec<_>>());
    assert!((found.0 - wanted.0).abs() < 1e-4, "{found:?}, not {wanted:?}");
    // Both have a clock that counts from 1970: nothing is shifted.
    let said = bench.run(&[&["compare"], &command[2..].iter().map(String::as_str).collect::<Vec<_>>()[..]].concat());
    assert!(!said.out.contains("the reference's clock is"), "{said:?}");
    let rates =
        |[t, _, a]: &[f64; 3]| format!("{:.3},{},0,0,{},nan,nan,nan", epoch + t, (0.5 * a).cos(), (0.5 * a).sin());
    let header = "timestamp,q[0],q[1],q[2],q[3],angular_velocity[0],angular_velocity[1],angular_velocity[2]\n";
    bench.file("odometry.csv", written(header, rates));
    let found = fitted(&bench, &["gyro.csv", "--reference", "odometry.csv"]);
    assert!((found.0 - wanted.0).abs() < 1e-4, "{found:?}, not {wanted:?}");
}

#[test]
fn a_refusal_says_what_may_be_the_reference_and_ends_in_a_command_that_reads_the_log() {
    let zeros = ["0.0"; 9].join(",");
    let echoed = written("", |[t, g, a]| {
        let (nanoseconds, [w, z]) = ((t.fract() * 1e9).round(), [(0.5 * a).cos(), (0.5 * a).sin()]);
        format!(
            "{},{nanoseconds},imu,0.0,0.0,{z},{w},{zeros},0.0,0.0,{g},{zeros},0.0,0.0,9.81,{zeros}",
            1_700_000_000 + *t as i64
        )
    });
    let counted = written("t,gyro_z,enc\n", |[t, g, a]| format!("{t},{g},{:.0}", a.to_degrees() / 360.0 * 4096.0));
    let kinds = written("ready\n", |[t, g, a]| format!("GYRO,{t},0,0,{g}\nENC,{t},{a}"));
    let degrees = written("t,gyro_z,angle\n", |[t, g, a]| format!("{t},{},{}", g.to_degrees(), a.to_degrees()));
    let clockwise = written("t,gyro_z,heading_deg\n", |[t, g, a]| format!("{t},{g},{}", -a.to_degrees()));
    let still = written("t,gyro_z\n", |[t, g, _]| format!("{t},{}", 0.01 + 1e-4 * g));
    mended(vec![
        ("echoed.csv", echoed, vec!["orientation.w", "something else than this gyro"], 1e-6),
        ("counted.csv", counted, vec!["counts a turn", "096", "000", "data sheet"], 0.03),
        ("kinds.txt", kinds, vec!["turns as gyro_z does"], 1e-6),
        ("degrees.csv", degrees, vec!["gyro_z_dps=gyro_z", "as its name means"], 1e-6),
        ("clockwise.csv", clockwise, vec!["counted the other way", "=-heading"], 1e-6),
        ("still.csv", still, vec!["as those of a sensor at rest", "--at-rest"], f64::INFINITY),
    ]);
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    bench.file("gyro.csv", written("t,gyro_z\n", |[t, g, _]| format!("{t},{g}")));
    assert!(bench.refused(&["fit", "gyro.csv"]).ends_with("truerate fit gyro.csv --reference REFERENCE.csv"));
    bench.file("angle.csv", written("t,encoder_deg\n", |[t, _, a]| format!("{t},{}", a.to_degrees())));
    let command = advised(&bench.refused(&["fit", "gyro.csv", "--reference", "angle.csv"])).unwrap();
    let found = fitted(&bench, &command[1..].iter().map(String::as_str).collect::<Vec<_>>());
    assert!((found.0 - wanted.0).abs() < 1e-6, "{found:?}, not {wanted:?}");
}

#[test]
fn rows_that_cannot_be_read_come_first_and_hide_no_reference() {
    let bench = Bench::new();
    bench.file("own.csv", log(2000));
    let wanted = fitted(&bench, &["own.csv"]);
    let header = "ms,gz,enc\n";
    let whole = written(header, |[t, g, a]| format!("{:.0},{g},{}", t * 1e3, a.to_degrees()));
    let torn = whole.replacen("\n500,", "\n50", 1).replacen("\n900,", "\n900,1,", 1).replacen("\n1500,", "\n1500,x", 1);
    let bare = torn.strip_prefix(header).unwrap();
    let semicolons = torn.replace(',', ";");
    for (name, text, line) in [("names.csv", &*torn, 52), ("bare.csv", bare, 51), ("semicolons.csv", &semicolons, 52)] {
        bench.file(name, text);
        let refusal = bench.refused(&["fit", name]);
        assert!(refusal.starts_with(&format!("truerate: {name} line {line}: 2 fields")), "{refusal}");
        assert!(refusal.contains(&format!("3 rows cannot be read, the first at line {line}")), "{refusal}");
        let command = refusal.lines().last().unwrap().replace("truerate", env!("CARGO_BIN_EXE_truerate"));
        let shell = std::process::Command::new("sh")
            .args(["-c", &format!("{command} --format json")])
            .current_dir(bench.path(""))
            .output();
        let json: Value = serde_json::from_slice(&shell.unwrap().stdout).expect(&refusal);
        let scale = json["axes"][0]["parameters"][0]["value"].as_f64().unwrap();
        assert!((scale - wanted.0).abs() < 1e-4, "{name}: {scale}, not {wanted:?}");
    }
    // What was recorded before the counter began again is left out.
    let before: String = (0..100).map(|k| format!("{},0.5,0\n", 90_000 + 10 * k)).collect();
    bench.file("again.csv", whole.replacen(header, &format!("{header}{before}"), 1));
    let refusal = bench.refused(&["fit", "again.csv"]);
    assert!(
        refusal.contains("the time starts again at line 102") && refusal.contains("sed '2,101d' again.csv"),
        "{refusal}"
    );
    // One wrong digit of a time is no other unit.
    bench.file("digit.csv", whole.replacen("\n1200,", "\n18800,", 1));
    let refusal = bench.refused(&["fit", "digit.csv"]);
    assert!(refusal.ends_with("--map ref_angle_z_deg=enc"), "{refusal}");
}

#[test]
fn a_motion_capture_systems_rows_of_names_tell_its_columns_apart() {
    let bench = Bench::new();
    bench.file("own.csv", log(4000));
    let wanted = fitted(&bench, &["own.csv"]);
    let rows = |row: &dyn Fn([f64; 3]) -> String| -> String {
        let number = |field: &str| field.parse::<f64>().unwrap();
        let of = log(4000);
        of.lines()
            .skip(1)
            .map(|line| row(line.split(',').map(number).collect::<Vec<_>>().try_into().unwrap()) + "\n")
            .collect()
    };
    bench.file("gyro.csv", "t,gyro_z\n".to_owned() + &rows(&|[t, g, _]| format!("{t},{g}")));
    let names = "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100\n\n,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n\
        ,,body,body,body,body,body\n,,Rotation,Rotation,Rotation,Rotation,Position\nFrame,Time (Seconds),X,Y,Z,W,X\n";
    let turns = |[t, _, a]: [f64; 3]| format!("{:.0},{t},0,0,{},{},0.1", t * 100.0, (a / 2.0).sin(), (a / 2.0).cos());
    bench.file("capture.csv", names.to_owned() + &rows(&turns));
    let found = fitted(&bench, &["gyro.csv", "--reference", "capture.csv"]);
    assert!((found.0 - wanted.0).abs() < 1e-4 && (found.1 - wanted.1).abs() < 1e-4, "{found:?} {wanted:?}");
}

#[test]
fn times_without_digits_are_said_and_a_counter_that_overflows_is_counted() {
    let bench = Bench::new();
    bench.file(
        "whole.csv",
        written("time,gyro_z,ref_angle_z\n", |[t, g, a]| format!("2026-11-25 12:30:{:02.0},{g},{a}", t.floor())),
    );
    let line = bench.refused(&["fit", "whole.csv"]);
    assert!(line.contains("too few digits: it changes by 1 s"), "{line}");
    bench.file(
        "timer.csv",
        written("t_ms,gyro_z,ref_angle_z\n", |[t, g, a]| {
            format!("{},{g},{a}", (60_000 + (t * 1e3).round() as i64) % 65_536)
        }),
    );
    let out = bench.ok(&["compare", "timer.csv", "--format", "json"]);
    assert!(out.contains("timer-overflow") && !out.contains("time-going-back"), "{out}");
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
    assert!(bench.refused(&["fit", "raw.csv", "--map", "t"]).contains("is not NAME=[a*]CHANNEL[/b][+c]"));
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
    assert!(out.contains("other-clock") && out.contains("5000.0000 s ahead of the log"), "not said");
    assert!(out.contains("cannot show a delay between the two"), "{out}");
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
    // Of counts it proposes what makes a log, not the columns as they stand.
    let count = |value: f64, one: f64| (value / one).round();
    bench.file(
        "counts.csv",
        written("t,gz,encoder\n", |[t, g, a]| {
            format!("{t},{},{}", count(g.to_degrees(), 1.0 / 65.5), count(*a, std::f64::consts::TAU / 4096.0))
        }),
    );
    let json: Value = serde_json::from_str(&bench.ok(&["channels", "counts.csv", "--format", "json"])).unwrap();
    let likely: Vec<&str> = json["likely"].as_array().unwrap().iter().map(|map| map.as_str().unwrap()).collect();
    assert!(json["map"].as_array().unwrap().is_empty() && likely.contains(&"gyro_z_dps=gz/65.5"), "{json}");
    let maps: Vec<&str> = likely.iter().flat_map(|map| ["--map", *map]).collect();
    bench.ok(&[&["fit", "counts.csv"], &maps[..]].concat());
    // A refusal repeats the command without the maps that it replaces.
    let line = bench.refused(&["fit", "counts.csv", "--map", "gyro_z=gz"]);
    assert!(line.contains("gyro_z_dps=gz/65.5") && !line.contains("--map gyro_z=gz"), "{line}");
}

#[test]
fn a_time_that_no_clock_shows_is_refused() {
    let bench = Bench::new();
    bench.file("own.csv", written("clock,gyro_z,ref_angle_z\n", |[t, g, a]| format!("{t},{g},{a}")));
    for map in ["t=1e300*row", "t=clock+1e300", "t=1e300*clock"] {
        bench.refused(&["fit", "own.csv", "--map", map]);
    }
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
    // What to do is all that there is to say, and it is said once for all axes.
    let text = bench.ok(&[&["diagnose", "xsens.txt"], &map[..]].concat());
    assert!(text.contains("axes x, y and z\n") && text.matches("This log cannot tell").count() == 1, "{text}");
    assert!(!text.contains("drift over a time") && !text.contains("what limits this log"), "{text}");
    assert!(bench.ok(&[&["fit", "xsens.txt"], &map[..]].concat()).contains("drift over a time"));
}

const DBC: &str = "BO_ 256 IMU: 2 ECU\n SG_ YAW_RATE : 7|16@0- (0.01,0) [0|0] \"deg/s\" ECU\n\nBO_ 2566844885 ENCODER: 4 ECU\n \
    SG_ ANGLE_Z : 0|32@1- (0.001,0) [0|0] \"deg\" ECU\n";

/// Rows as frames, each a line that `line` makes of its time, µs, its identifier and its bytes.
fn frames(line: impl Fn(u64, &str, &[u8]) -> String) -> String {
    let of_row = |row: &[f64; 3]| {
        let (rate, angle) = ((row[1].to_degrees() / 0.01).round() as i16, (row[2].to_degrees() / 0.001).round() as i32);
        let time = (1e6 * row[0]).round() as u64;
        line(time, "100", &rate.to_be_bytes()) + &line(time, "18FEF1D5", &angle.to_le_bytes())
    };
    rows().iter().map(of_row).collect()
}

fn hex(data: &[u8], between: &str) -> String {
    data.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(between)
}

#[test]
fn frames_of_a_vehicle_have_the_answer_of_the_same_numbers_in_a_table() {
    let bench = Bench::new();
    bench.file("car.dbc", DBC);
    let step = |x: f64, step: f64| (x.to_degrees() / step).round() * step;
    let table = written("t,gyro_z_dps,ref_angle_z_deg\n", |[t, rate, angle]| {
        format!("{t},{},{}", step(*rate, 0.01), step(*angle, 0.001))
    });
    bench.file("table.csv", table);
    let wanted = fitted(&bench, &["table.csv"]);
    let stamp = |time: u64| format!("{}.{:06}", 1_700_000_000 + time / 1_000_000, time % 1_000_000);
    let file = frames(|time, id, data| format!("({}) can0 {id}#{}\n", stamp(time), hex(data, "")));
    let screen =
        frames(|time, id, data| format!(" ({})  can0  {id}   [{}]  {}\n", stamp(time), data.len(), hex(data, " ")));
    let vector = frames(|time, id, data| {
        let mark = if id.len() > 3 { "x" } else { "" };
        format!("{} 1  {id}{mark}  Rx   d {} {}\n", stamp(time), data.len(), hex(data, " "))
    });
    for (name, text) in [
        ("file.log", file.clone()),
        ("screen.txt", screen.clone()),
        ("vector.asc", format!("date Tue Nov 14 22:13:20 2023\nbase hex  timestamps absolute\n{vector}")),
    ] {
        bench.file(name, text);
        let found = fitted(&bench, &[name, "--dbc", "car.dbc"]);
        assert!((found.0 - wanted.0).abs() < 1e-9 && (found.1 - wanted.1).abs() < 1e-9, "{name}: {found:?} {wanted:?}");
    }
    let line = bench.refused(&["diagnose", "file.log"]);
    assert!(line.contains("--dbc FILE.dbc") && line.contains("truerate channels FILE"), "{line}");
    let out = bench.ok(&["channels", "file.log"]);
    let words = |id: &str| {
        out.lines().find(|line| line.trim_start().starts_with(id)).unwrap().split_whitespace().collect::<Vec<_>>()
    };
    let count = rows().len().to_string();
    assert_eq!(words("0x100")[..5], ["0x100", "11", &count, "2", "100.0"], "{out}");
    assert_eq!(words("0x18FEF1D5")[..4], ["0x18FEF1D5", "29", &count, "4"], "{out}");
    assert!(out.contains("truerate channels file.log --dbc FILE.dbc"), "{out}");
    let list: Value = serde_json::from_str(&bench.ok(&["channels", "file.log", "--format", "json"])).unwrap();
    let first = &list["identifiers"][0];
    assert_eq!(
        (&first["identifier"], &first["bits"], &first["bytes"]),
        (&"0x100".into(), &11.into(), &serde_json::json!([2.0, 2.0]))
    );
    assert_eq!((first["frames"].as_u64(), &list["channels"]), (Some(rows().len() as u64), &serde_json::json!([])));
    // SAE J1939: another sender of the same group.
    bench.file("other.log", file.replace("18FEF1D5", "0CFEF121"));
    let found = fitted(&bench, &["other.log", "--dbc", "car.dbc"]);
    assert!((found.0 - wanted.0).abs() < 1e-9 && (found.1 - wanted.1).abs() < 1e-9, "{found:?} {wanted:?}");
    let out = bench.ok(&["channels", "other.log", "--dbc", "car.dbc"]);
    assert!(out.contains("ref_angle_z_deg=ENCODER@0x21.ANGLE_Z"), "{out}");
    // The DBC file of another bus.
    bench.file("strange.log", file.replace(" 100#", " 101#").replace("18FEF1D5", "18FF01D5"));
    let line = bench.refused(&["diagnose", "strange.log", "--dbc", "car.dbc"]);
    assert!(line.contains("names none of the frames") && line.contains("0x101"), "{line}");
    let out = bench.ok(&["channels", "strange.log", "--dbc", "car.dbc"]);
    assert!(out.contains("`truerate channels strange.log` lists the identifiers"), "{out}");
    let delta = |id: &str| if id == "100" { "009800" } else { "000200" };
    bench.file("delta.log", frames(|_, id, data| format!("(0.{}) can0 {id}#{}\n", delta(id), hex(data, ""))));
    let line = bench.refused(&["channels", "delta.log", "--dbc", "car.dbc"]);
    assert!(line.contains("candump -l"), "{line}");
    bench.file(
        "none.log",
        screen.lines().map(|line| format!("{}\n", &line[line.find(')').unwrap() + 1..])).collect::<String>(),
    );
    let line = bench.refused(&["channels", "none.log", "--dbc", "car.dbc"]);
    assert!(line.contains("no times") && line.contains("candump -l"), "{line}");
    // Names that say nothing.
    bench.file(
        "short.dbc",
        DBC.replace("YAW_RATE", "YR").replace("IMU:", "S03:").replace("ANGLE_Z", "AZ").replace("ENCODER:", "S04:"),
    );
    let out = bench.ok(&["channels", "file.log", "--dbc", "short.dbc"]);
    assert!(out.contains("likely:\n  --map gyro_z=S03.YR") && out.contains("--map ref_angle_z=CHANNEL"), "{out}");
    let line = bench.refused(&["diagnose", "file.log", "--dbc", "short.dbc"]);
    assert!(line.ends_with("--map gyro_z_dps=S03.YR --map ref_angle_z_deg=S04.AZ"), "{line}");
    let found =
        fitted(&bench, &["file.log", "--dbc", "short.dbc", "--map", "gyro_z=S03.YR", "--map", "ref_angle_z=S04.AZ"]);
    assert!((found.0 - wanted.0).abs() < 1e-9 && (found.1 - wanted.1).abs() < 1e-9, "{found:?} {wanted:?}");
    bench.file("bad.dbc", DBC.replace("7|16@0-", "7|16@3-"));
    let line = bench.refused(&["diagnose", "file.log", "--dbc", "bad.dbc"]);
    assert!(line.contains("--dbc bad.dbc: line 2: a signal is"), "{line}");
}
