//! `truerate export` on the real program: the C header compiled and held against `apply`, the others read by their readers.

#![allow(clippy::format_push_string)] // made once, for the test

mod common;

use common::Bench;
use std::{collections::BTreeMap, process::Command};
use yaml_rust2::{Yaml, YamlLoader};

/// A CSV file's columns.
fn columns(text: &str) -> BTreeMap<String, Vec<f64>> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: BTreeMap<String, Vec<f64>> = names.iter().map(|n| ((*n).to_owned(), Vec::new())).collect();
    for line in lines {
        for (name, field) in names.iter().zip(line.split(',')) {
            columns.get_mut(*name).unwrap().push(field.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

/// Compiles the header with the system's compiler, all warnings errors, and runs a log's readings through it: rates of x, y, z.
fn compensated(bench: &Bench, header: &str, log: &BTreeMap<String, Vec<f64>>, channels: &[&str]) -> Vec<[f64; 3]> {
    compensated_in("double", bench, header, log, channels)
}

/// The same where the header's numbers are of this type.
fn compensated_in(
    real: &str,
    bench: &Bench,
    header: &str,
    log: &BTreeMap<String, Vec<f64>>,
    channels: &[&str],
) -> Vec<[f64; 3]> {
    let text = bench.text(header);
    let mut fields = vec!["gyro_x", "gyro_y", "gyro_z"];
    let mut reads = "&in.gyro[0], &in.gyro[1], &in.gyro[2]".to_owned();
    let mut add = |has: &str, names: &[&'static str], places: &str| {
        if text.contains(&has.replace("double", real)) {
            fields.extend(names);
            reads = format!("{reads}, {places}");
        }
    };
    add("    double accel[3];    /*", &["accel_x", "accel_y", "accel_z"], "&in.accel[0], &in.accel[1], &in.accel[2]");
    add("    double temperature; /*", &["temp"], "&in.temperature");
    add("    double supply;      /*", &["supply"], "&in.supply");
    for (k, name) in channels.iter().enumerate() {
        fields.push(name);
        reads = format!("{reads}, &in.channel[{k}]");
    }
    let program = format!(
        "#include <stdio.h>\n#include \"{header}\"\nint main(void) {{\n    truerate_state state;\n    truerate_begin(&state);\n    \
         truerate_in in;\n    memset(&in, 0, sizeof in);\n    long long t;\n    while (scanf(\"%lld{}\", &t, {reads}) == {}) {{\n        \
         in.t_ns = t;\n        truerate_out out = truerate_step(&state, &in);\n        \
         printf(\"%.17g %.17g %.17g\\n\", (double)out.rate[0], (double)out.rate[1], (double)out.rate[2]);\n    }}\n    return 0;\n}}\n",
        if real == "float" { " %f" } else { " %lf" }.repeat(fields.len()),
        fields.len() + 1
    );
    bench.file("main.c", program);
    let mut flags = vec!["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-o", "compensate", "main.c", "-lm"];
    if real == "float" {
        // Nothing is computed in double precision unseen.
        flags.extend(["-Wdouble-promotion", "-Wfloat-conversion"]);
    }
    let made = Command::new("cc").args(flags).current_dir(bench.path(".")).output().expect("a C compiler is needed");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let mut input = String::new();
    for row in 0..log["t"].len() {
        let t_ns = ((log["t"][row] - log["t"][0]) * 1e9).round() as i64;
        let values: Vec<String> =
            fields.iter().map(|f| format!("{:?}", log.get(*f).map_or(f64::NAN, |c| c[row]))).collect();
        input.push_str(&format!("{t_ns} {}\n", values.join(" ")));
    }
    bench.file("input", input);
    let out = Command::new(bench.path("compensate"))
        .stdin(std::fs::File::open(bench.path("input")).unwrap())
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    let rates = text.lines().map(|line| {
        let rates: Vec<f64> = line.split(' ').map(|rate| rate.parse().unwrap()).collect();
        [rates[0], rates[1], rates[2]]
    });
    rates.collect()
}

/// Largest difference from what `apply` made of the log, rad/s, and how many rates differ in any bit.
fn differs(bench: &Bench, rates: &[[f64; 3]]) -> (f64, usize) {
    let applied = columns(&bench.text("applied.csv"));
    let mut worst = (0.0_f64, 0);
    for (i, axis) in ["x", "y", "z"].iter().enumerate() {
        let Some(wanted) = applied.get(&format!("rate_{axis}")) else { continue };
        assert_eq!(wanted.len(), rates.len());
        for (wanted, got) in wanted.iter().zip(rates) {
            // Where a reading is missing C has no rate, and `apply` holds the last.
            if wanted.is_finite() && !got[i].is_nan() {
                worst =
                    (worst.0.max((wanted - got[i]).abs()), worst.1 + usize::from(wanted.to_bits() != got[i].to_bits()));
            }
        }
    }
    worst
}

#[test]
fn each_effect_in_c_does_what_apply_does() {
    // Those that need more than + - * /: the library's functions may differ in their last bit.
    const BY_FUNCTIONS: [&str; 4] = ["warm-up", "temperature-rate", "vibration-tone", "mount-resonance"];
    let bench = Bench::new();
    for effect in gyro_model::effects::CATALOGUE {
        let id = effect.card().id;
        // `apply` gives all axes at the earliest of their times, C each at its own: the same where this one is not ahead of the others.
        let hide = if id == "clock-skew" { "clock-skew:s=-0.001" } else { id };
        bench.ok(&["simulate", "--seconds", "12", "--rate", "100", "--hide", hide, "-o", "log.csv"]);
        bench.ok(&["apply", "log.csv", "--model", "log.csv.truth.toml", "-o", "applied.csv"]);
        bench.ok(&["export", "log.csv.truth.toml", "--to", "c", "-o", "model.h"]);
        let rates = compensated(&bench, "model.h", &columns(&bench.text("log.csv")), &[]);
        let (largest, bits) = differs(&bench, &rates);
        if BY_FUNCTIONS.contains(&id) {
            assert!(largest < 1e-12, "{id}: {largest} rad/s off");
        } else {
            assert_eq!(bits, 0, "{id}: {bits} rates differ, by at most {largest} rad/s");
        }
    }
}

#[test]
fn the_header_in_single_precision_does_what_apply_does_to_single_precision() {
    let bench = Bench::new();
    // A delay beside a coupling is another matter: `apply` couples the axes at one instant.
    let many = ["lag", "cross-axis", "temperature-bias", "warm-up", "g-sensitivity", "cubic-nonlinearity"];
    for hide in [&["delay:d=0.012", "lag", "cubic-nonlinearity"][..], &many] {
        let words = ["simulate", "--seconds", "30", "--rate", "200", "-o", "log.csv", "--hide"];
        bench.ok(&[&words[..], hide].concat());
        bench.ok(&["apply", "log.csv", "--model", "log.csv.truth.toml", "-o", "applied.csv"]);
        bench.ok(&["export", "log.csv.truth.toml", "--to", "c-float", "-o", "model.h"]);
        let header = bench.text("model.h");
        assert!(header.contains("Clock: t_ns is the gyro's own stamp"), "{header:.2000}");
        assert!(header.contains("Floats throughout") && !header.contains("double gyro"), "{header:.3000}");
        let rates = compensated_in("float", &bench, "model.h", &columns(&bench.text("log.csv")), &[]);
        // A lag is undone by a difference of two readings, divided by the time between them.
        let (largest, bits) = differs(&bench, &rates);
        assert!(largest < 1e-5 && bits > 0, "{hide:?}: {largest} rad/s off");
    }
    assert!(bench.ok(&["export", "log.csv.truth.toml", "--to", "c"]).contains("Clock: t_ns is the gyro's own stamp"));
}

#[test]
fn kalibrs_matrices_undo_the_calibration_in_the_order_that_is_written_beside_them() {
    let bench = Bench::new();
    let words = ["simulate", "--seconds", "12", "--hide", "cross-axis", "--axis", "y", "-o", "log.csv"];
    bench.ok(&words);
    let yaml = |target: &str| {
        let text = bench.ok(&["export", "log.csv.truth.toml", "--to", target, "--rate", "100"]);
        (YamlLoader::load_from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}")).remove(0), text)
    };
    let (kalibr, text) = yaml("kalibr");
    assert_eq!(kalibr["model"].as_str(), Some("scale-misalignment"), "{text}");
    assert!(text.contains("reading = M * (C_gyro_i * rate) + A * acceleration + bias"), "{text}");
    let matrix = |of: &Yaml| -> [[f64; 3]; 3] {
        std::array::from_fn(|row| {
            std::array::from_fn(|column| of[row][column].as_f64().unwrap_or_else(|| panic!("{text}")))
        })
    };
    let product = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| -> [[f64; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
    };
    let (m, c) = (matrix(&kalibr["gyroscopes"]["M"]), matrix(&kalibr["gyroscopes"]["C_gyro_i"]));
    assert!(m[0][1] == 0.0 && m[0][2] == 0.0 && m[1][2] == 0.0, "{text}");
    // What ROS' node does, rate = S (reading - offset), comes after M C: together they are one.
    let (ros, _) = yaml("ros");
    let all = &ros["/**"]["ros__parameters"]["gyro_calibration"]["matrix"];
    let s: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| all[3 * i + j].as_f64().unwrap()));
    let one = product(s, product(m, c));
    for (i, row) in one.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            assert!((value - f64::from(u8::from(i == j))).abs() < 1e-5, "{one:?}");
        }
    }
}

#[test]
fn a_chips_registers_take_the_zero_out_and_a_chip_without_any_is_refused() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "12", "--axis", "z", "-o", "log.csv"]);
    bench.ok(&["fit", "log.csv", "-o", "model.toml"]);
    for (chip, register) in
        [("mpu6050", "0x17"), ("mpu9250", "0x17"), ("icm426xx", "0x7A"), ("bmi160", "0x76"), ("bmi270", "0x76")]
    {
        let text = bench.ok(&["export", "model.toml", "--to", "registers", "--chip", chip]);
        assert!(text.lines().any(|line| line.starts_with(register)), "{chip}: {text}");
        assert!(text.contains("so it is the negative of what is read at rest"), "{text}");
    }
    let refused = bench.refused(&["export", "model.toml", "--to", "registers", "--chip", "lsm6"]);
    assert!(refused.contains("has no register for the zero of its gyro"), "{refused}");
    assert_eq!(bench.run(&["export", "model.toml", "--to", "registers"]).code, 2);
}

#[test]
fn many_effects_at_once_and_a_users_own_do_what_apply_does() {
    let bench = Bench::new();
    let hide = ["dead-zone:w=0.01", "lag", "cross-axis", "temperature-bias", "g-sensitivity", "cubic-nonlinearity"];
    let mut words = vec!["simulate", "--seconds", "20", "--rate", "200", "-o", "log.csv", "--hide"];
    words.extend(hide);
    bench.ok(&words);
    // Some readings are missing, and a column of the user's own stands beside.
    let log: String = bench.text("log.csv").lines().enumerate().fold(String::new(), |text, (k, line)| {
        let mut fields: Vec<&str> = line.split(',').collect();
        let load = format!("{}", (k as f64 * 0.01).sin());
        if k > 0 && k % 97 == 0 {
            fields[1] = "nan";
        }
        fields.push(if k == 0 { "load" } else { &load });
        text + &fields.join(",") + "\n"
    });
    bench.file("log.csv", log);
    let model = bench.text("log.csv.truth.toml").replace("\"lag\",", "\"lag\", \"own\",")
        + "\n[effect.own]\nregressor = \"int * load^3 / (1 + abs(rate)) + for * max(rate_dot, -gyro_y)\"\nparameters = { int = { unit = \
           \"rad/s\", typical = 0.01 }, for = { unit = \"s\", typical = 0.01 } }\n";
    let model = model.replace(
        "lag.tau =",
        "own.int = { value = 0.01, unit = \"rad/s\" }\nown.for = { value = 1e-4, unit = \"s\" }\nlag.tau =",
    );
    bench.file("model.toml", model);
    bench.ok(&["apply", "log.csv", "--model", "model.toml", "-o", "applied.csv"]);
    bench.ok(&["export", "model.toml", "--to", "c", "-o", "model.h"]);
    assert!(bench.text("model.h").contains("channel[0] = load"), "{}", bench.text("model.h"));
    let rates = compensated(&bench, "model.h", &columns(&bench.text("log.csv")), &["load"]);
    let (largest, bits) = differs(&bench, &rates);
    assert_eq!(bits, 0, "{bits} rates differ, by at most {largest} rad/s");
    assert_eq!(rates.iter().filter(|rate| rate[0].is_nan()).count(), 41);
}

#[test]
fn what_a_target_cannot_hold_is_a_warning_and_a_comment() {
    let bench = Bench::new();
    let words = ["simulate", "--seconds", "10", "-o", "log.csv", "--hide", "bias-step:t0=5", "delay", "cross-axis"];
    bench.ok(&words);
    for (target, says) in [
        ("c", "depends on the time since the first row"),
        ("ardupilot", "cannot hold 'delay'"),
        ("px4", "cannot hold 'bias-step'"),
        ("ros", "cannot hold 'delay'"),
    ] {
        let outcome = bench.run(&["export", "log.csv.truth.toml", "--to", target, "--rate", "100"]);
        assert!(outcome.code == 0 && outcome.err.contains(says), "{target}: {outcome:?}");
        let flat = outcome.out.replace("\n *   ", " ");
        assert!(flat.contains(says), "{target}: {}", outcome.out);
    }
    let refused = bench.run(&["export", "log.csv", "--to", "c"]);
    assert!(refused.code == 1 && refused.err.contains("log.csv line 1"), "{refused:?}");
}

#[test]
fn yaml_is_read_back_by_a_parser_and_json_has_the_model_files_keys() {
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "30", "-o", "log.csv"]);
    bench.ok(&["fit", "log.csv", "-o", "m.toml"]);
    let parsed = |text: &str| YamlLoader::load_from_str(text).unwrap_or_else(|e| panic!("{e}: {text}")).remove(0);
    bench.ok(&["export", "m.toml", "--to", "kalibr", "--rate", "100", "--topic", "/imu0", "-o", "imu.yaml"]);
    let imu = parsed(&bench.text("imu.yaml"));
    let model: toml::Table = toml::from_str(&bench.text("m.toml")).unwrap();
    let noise = |axis: &str| model["axis"][axis]["noise"]["angle_random_walk"].as_float().unwrap();
    let largest = noise("x");
    let written = imu["gyroscope_noise_density"].as_f64().unwrap();
    assert!((written / largest - 1.0).abs() < 1e-6, "{written} for {largest}");
    assert_eq!((imu["update_rate"].as_f64(), imu["rostopic"].as_str()), (Some(100.0), Some("/imu0")));
    let ros = parsed(&bench.ok(&["export", "m.toml", "--to", "ros", "--rate", "100"]));
    let covariance = &ros["imu_sensor_broadcaster"]["ros__parameters"]["static_covariance_angular_velocity"];
    let Yaml::Array(values) = covariance else { panic!("{ros:?}") };
    assert_eq!(values.len(), 9);
    assert!((values[0].as_f64().unwrap() / (noise("x") * noise("x") * 100.0) - 1.0).abs() < 1e-5);
    let json: serde_json::Value = serde_json::from_str(&bench.ok(&["export", "m.toml", "--to", "json"])).unwrap();
    assert_eq!(
        json["axis"]["x"]["parameters"]["bias"]["delta"]["value"],
        model["axis"]["x"]["parameters"]["bias"]["delta"]["value"].as_float().unwrap()
    );
}

#[test]
fn autopilots_get_the_reading_at_rest_at_the_temperature_that_they_count_from() {
    let bench = Bench::new();
    let model = "schema = \"truerate.model/1\"\nepoch = 1\n[provenance]\nlog = \"yaw.csv\"\ntemperature = [20.0, 44.0]\n\
                 [axis.z]\neffects = [\"scale-factor\", \"bias\", \"temperature-bias\"]\n[axis.z.parameters]\n\
                 scale-factor.alpha = { value = 0.98, unit = \"1\" }\nbias.delta = { value = 0.02, unit = \"rad/s\" }\n\
                 temperature-bias.c1 = { value = 5e-4, unit = \"rad/s/K\" }\ntemperature-bias.c2 = { value = -1e-5, unit = \"rad/s/K²\" }\n";
    bench.file("m.toml", model);
    let at_rest = |t: f64| (5e-4 * (t - 25.0) - 1e-5 * (t - 25.0) * (t - 25.0) - 0.02) / 0.98;
    let value = |text: &str, name: &str| -> f64 {
        let line = text
            .lines()
            .find(|line| !line.starts_with('#') && line.contains(name))
            .unwrap_or_else(|| panic!("{name}: {text}"));
        let fields: Vec<&str> = line.split([',', '\t']).collect();
        fields[fields.iter().position(|f| *f == name).unwrap() + 1].parse().unwrap()
    };
    let outcome = bench.run(&["export", "m.toml", "--to", "ardupilot", "--sensor", "2"]);
    assert!(outcome.err.contains("no scale factor of a gyro: the rate stays 2.04 % too high"), "{}", outcome.err);
    let get = |name: &str| value(&outcome.out, name);
    assert_eq!((get("INS_GYR_CAL"), get("INS_GYR2_CALTEMP"), get("INS_TCAL2_ENABLE")), (0.0, 32.0, 1.0));
    for t in [20.0, 31.0, 44.0] {
        let polynomial = |t: f64| {
            let d: f64 = t - 35.0;
            1e-6 * (get("INS_TCAL2_GYR1_Z") * d + get("INS_TCAL2_GYR2_Z") * d * d + get("INS_TCAL2_GYR3_Z") * d.powi(3))
        };
        let offset = polynomial(t) - polynomial(get("INS_GYR2_CALTEMP")) + get("INS_GYR2OFFS_Z");
        assert!((offset - at_rest(t)).abs() < 1e-7, "{offset} for {} at {t} °C", at_rest(t));
    }
    let px4 = bench.run(&["export", "m.toml", "--to", "px4"]).out;
    let get = |name: &str| value(&px4, name);
    for t in [20.0, 31.0, 44.0] {
        let d: f64 = t - get("TC_G0_TREF");
        let offset = get("TC_G0_X0_2") + get("TC_G0_X1_2") * d + get("TC_G0_X2_2") * d * d + get("CAL_GYRO0_ZOFF");
        assert!((offset - at_rest(t)).abs() < 1e-7, "{offset} for {} at {t} °C", at_rest(t));
    }
    assert_eq!((get("TC_G0_TMIN"), get("TC_G0_TMAX"), get("TC_G_ENABLE")), (20.0, 44.0, 1.0));
}

#[test]
fn robots_get_offsets_in_their_units_and_a_matrix_in_their_factors() {
    let bench = Bench::new();
    let model = "schema = \"truerate.model/1\"\nepoch = 1\n[provenance]\nlog = \"yaw.csv\"\ntemperature = [20.0, 44.0]\n\
                 [axis.z]\neffects = [\"scale-factor\", \"bias\", \"temperature-bias\"]\n\
                 noise = { angle_random_walk = 7.1e-5, bias_random_walk = 0.0, encoder = 4.5e-4 }\n[axis.z.parameters]\n\
                 scale-factor.alpha = { value = 0.98, unit = \"1\" }\nbias.delta = { value = 0.02, unit = \"rad/s\" }\n\
                 temperature-bias.c1 = { value = 5e-4, unit = \"rad/s/K\" }\ntemperature-bias.c2 = { value = 0.0, unit = \"rad/s/K²\" }\n";
    bench.file("m.toml", model);
    let at_rest = (5e-4 * (32.0 - 25.0) - 0.02) / 0.98;
    let parsed = |text: &str| YamlLoader::load_from_str(text).unwrap_or_else(|e| panic!("{e}: {text}")).remove(0);
    let autoware = bench.run(&["export", "m.toml", "--to", "autoware", "--rate", "100"]);
    assert!(autoware.err.contains("Autoware's imu_corrector has no scale factor"), "{}", autoware.err);
    let parameters = &parsed(&autoware.out)["/**"]["ros__parameters"];
    let get = |name: &str| parameters[name].as_f64().unwrap_or_else(|| panic!("{name}: {parameters:?}"));
    assert!((get("angular_velocity_offset_z") - at_rest).abs() < 1e-7, "{parameters:?}");
    assert!((get("angular_velocity_stddev_zz") - 7.1e-4).abs() < 1e-8, "{parameters:?}");
    assert!(parameters["angular_velocity_offset_x"].is_badvalue(), "the model has no axis x: {parameters:?}");
    let inav = bench.ok(&["export", "m.toml", "--to", "inav"]);
    let counts = (at_rest.to_degrees() * 16.4).round();
    assert!(
        inav.contains(&format!("set gyro_zero_z = {counts}\n")) && inav.contains("set init_gyro_cal = OFF"),
        "{inav}"
    );
    // OpenCV's own first line is no YAML to others.
    let openvins = bench.ok(&["export", "m.toml", "--to", "openvins", "--rate", "200", "--topic", "/imu0"]);
    let (first, rest) = openvins.split_once('\n').unwrap();
    assert_eq!(first, "%YAML:1.0");
    let imu = &parsed(rest)["imu0"];
    assert_eq!((imu["update_rate"].as_f64(), imu["model"].as_str()), (Some(200.0), Some("kalibr")));
    for (name, last) in [("Tw", 1.0 / 0.98), ("R_IMUtoGYRO", 1.0), ("Ta", 1.0), ("Tg", 0.0)] {
        assert!((imu[name][2][2].as_f64().unwrap() - last).abs() < 1e-6, "{name}: {openvins}");
    }
}
