//! Sensors by their addresses, each end to end to a named effect, unplugged and garbled on the way.

use crate::{
    harness::{Pipeline, Place, counted, spoilt_log},
    rate_out::compiled,
};
use gyro_model::{Row, simulate::Simulated};
use ipc_types::{port::Hub, topic, wait::Wait};
use rustix::{
    fs::{Mode, OFlags},
    pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt},
};
use serde_json::Value;
use std::{
    fmt::Write as _,
    fs::File,
    io::Write,
    net::{TcpListener, UdpSocket},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

/// A device whose other end is ours: a terminal that can be plugged in and out.
struct Plug {
    path: PathBuf,
    end: Option<File>,
}

impl Plug {
    fn new(place: &Place) -> Self {
        Self { path: place.file("tty"), end: None }
    }

    fn plug_in(&mut self) {
        // No other process holds it open.
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&end).unwrap();
        unlockpt(&end).unwrap();
        let name = ptsname(&end, Vec::new()).unwrap();
        // Raw at once, so that nothing is echoed before somebody opens it.
        let flags = OFlags::RDWR | OFlags::NOCTTY;
        let line = rustix::fs::open(name.as_c_str(), flags, Mode::empty()).unwrap();
        let mut settings = rustix::termios::tcgetattr(&line).unwrap();
        settings.make_raw();
        rustix::termios::tcsetattr(&line, rustix::termios::OptionalActions::Now, &settings).unwrap();
        std::os::unix::fs::symlink(name.to_str().unwrap(), &self.path).unwrap();
        self.end = Some(File::from(end));
    }

    fn pull_out(&mut self) {
        std::fs::remove_file(&self.path).unwrap();
        self.end = None;
    }
}

impl Write for Plug {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.end.as_mut().unwrap().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A log with a late gyro, and its rows as lines of `t,gyro_z,ref_angle_z`.
fn late_log(place: &Place, seconds: f64) -> (Simulated, Vec<String>) {
    let simulated = spoilt_log(&place.file("late.csv"), seconds, 100.0, 12, &["delay:d=0.02"]);
    let rows = simulated.record.rows.iter();
    let lines = rows.map(|r| format!("{:.6},{:.9},{:.9}", r.t_ns as f64 * 1e-9, r.gyro[2], r.ref_angle[2])).collect();
    (simulated, lines)
}

fn source(place: &Place, pipeline: &mut Pipeline, what: &str, fits: impl Fn(&Value) -> bool) -> Value {
    let mut seen = Value::Null;
    pipeline.until(what, |_| {
        seen = place.status("sensor").map_or(Value::Null, |status| status["source"].clone());
        fits(&seen)
    });
    seen
}

/// Waits until the pipeline names the delay as what is missing about z.
fn until_delay_is_named(pipeline: &mut Pipeline) {
    let hub = Hub::join(&pipeline.domain, "onlooker").unwrap();
    let diagnoses = hub.reader(&topic::DIAGNOSIS, None, Wait::Event).unwrap();
    pipeline.until("the name of what is missing", |_| {
        diagnoses.newest().unwrap().is_some_and(|diagnosis| {
            let axis = &diagnosis.axes[2];
            let verdict = axis.verdict.as_str();
            (verdict == "missing-effect" || verdict == "ambiguous") && axis.suspects[0].effect.as_str() == "delay"
        })
    });
}

/// Gives lines at about ten times real time, of which every tenth is garbled.
fn garbled(lines: &[String], from: f64, mut give: impl FnMut(&[u8])) -> u64 {
    let start = Instant::now();
    let mut good = 0;
    for (k, line) in lines.iter().enumerate() {
        let (t, rest) = line.split_once(',').unwrap();
        let t = t.parse::<f64>().unwrap() - from;
        let bytes = match k % 10 {
            5 => format!("{t:.6},{}\n", rest.replace('.', "\u{fffd}")),
            _ => format!("{t:.6},{rest}\n"),
        };
        good += u64::from(k % 10 != 5);
        give(bytes.as_bytes());
        sleep((start + Duration::from_millis(k as u64)).saturating_duration_since(Instant::now()));
    }
    good
}

#[test]
fn a_serial_line_garbled_unplugged_and_rebooted_ends_in_a_named_effect() {
    let place = Place::new();
    let (_, lines) = late_log(&place, 90.0);
    let mut plug = Plug::new(&place);
    let address = format!("serial:{}?baud=230400", plug.path.display());
    let mut pipeline = place.start("sensor", &["--source", &address]);
    source(&place, &mut pipeline, "that it waits", |s| s["link"] == "waiting");
    plug.plug_in();
    sleep(Duration::from_secs(1));
    plug.write_all(b"rst:0x1 (POWERON_RESET)\r\nt,gyro_z,ref_angle_z\r\n").unwrap();
    let mut good = garbled(&lines[..3000], 0.0, |bytes| plug.write_all(bytes).unwrap());
    source(&place, &mut pipeline, "the rows before", |s| s["rows"] == good);
    plug.pull_out();
    source(&place, &mut pipeline, "that it is lost", |s| s["link"] == "lost");
    plug.plug_in();
    // What is sent before the line is set again is lost with it.
    source(&place, &mut pipeline, "that it is there again", |s| s["link"] == "connected" || s["link"] == "silent");
    good += garbled(&lines[3100..6000], 0.0, |bytes| plug.write_all(bytes).unwrap());
    // The board begins again.
    plug.write_all(b"rst:0xc (SW_CPU_RESET)\r\nt,gyro_z,ref_angle_z\r\n").unwrap();
    good += garbled(&lines[6100..], 61.0, |bytes| plug.write_all(bytes).unwrap());
    let seen = source(&place, &mut pipeline, "all rows", |s| s["rows"] == good);
    assert_eq!((&seen["segments"], &seen["reconnects"]), (&1.into(), &1.into()), "{seen}");
    assert_eq!((&seen["garbled"], &seen["cut"]), (&880.into(), &0.into()), "{seen}");
    until_delay_is_named(&mut pipeline);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), good, "{}", ended.out);
    assert_eq!(ended.error.matches("a garbled row").count(), 1, "{}", ended.error);
    assert!(place.left("sensor").is_empty(), "{:?}", place.left("sensor"));
}

#[test]
fn a_killed_acquisition_takes_a_sensor_up_again() {
    let place = Place::new();
    let (_, lines) = late_log(&place, 40.0);
    let mut plug = Plug::new(&place);
    plug.plug_in();
    let address = format!("serial:{}?header=t,gyro_z,ref_angle_z", plug.path.display());
    let mut pipeline = place.start("sensor", &["--source", &address]);
    source(&place, &mut pipeline, "that it is open", |s| s["link"] == "connected" || s["link"] == "silent");
    let good = garbled(&lines[..1500], 0.0, |bytes| plug.write_all(bytes).unwrap());
    source(&place, &mut pipeline, "the rows before", |s| s["rows"] == good);
    let before = pipeline.pid("acquisition").unwrap();
    crate::harness::signal(before, rustix::process::Signal::KILL);
    pipeline.until("another acquisition", |p| p.pid("acquisition").is_some_and(|pid| pid != before));
    source(&place, &mut pipeline, "that it is open again", |s| s["rows"] == 0);
    sleep(Duration::from_secs(1));
    garbled(&lines[1600..], 0.0, |bytes| plug.write_all(bytes).unwrap());
    source(&place, &mut pipeline, "rows after", |s| s["rows"].as_u64().is_some_and(|rows| rows > 1500));
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert!(counted(&ended.out, "kalman", "in") > good + 1500, "{}", ended.out);
    assert_eq!(counted(&ended.out, "kalman", "rejected"), 0, "{}", ended.out);
}

#[test]
fn frames_from_a_program_in_c_come_over_a_serial_line() {
    let place = Place::new();
    let Some(sender) = compiled(&place, "send_frames") else { return };
    let (_, lines) = late_log(&place, 60.0);
    let mut plug = Plug::new(&place);
    plug.plug_in();
    let address = format!("serial:{}?format=frames", plug.path.display());
    let mut pipeline = place.start("sensor", &["--source", &address]);
    source(&place, &mut pipeline, "that it is open", |s| s["link"] == "connected" || s["link"] == "silent");
    let mut child = Command::new(sender).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let text = lines.join("\n") + "\n";
    let feeder = std::thread::spawn(move || input.write_all(text.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap();
    // A byte of every tenth frame is turned over; the first zero of each frame is its beginning.
    let (mut bytes, mut frame, mut turned) = (output.stdout, 0, 0);
    for k in 1..bytes.len() {
        if bytes[k - 1] == 0 && bytes[k] != 0 {
            frame += 1;
            if frame % 10 == 0 {
                bytes[k + 5] ^= 0x40;
                turned += 1;
            }
        }
    }
    assert_eq!((frame, turned), (lines.len(), lines.len() / 10));
    for piece in bytes.chunks(2048) {
        plug.write_all(piece).unwrap();
        sleep(Duration::from_millis(20));
    }
    let good = (lines.len() - turned) as u64;
    let seen = source(&place, &mut pipeline, "all frames", |s| s["rows"].as_u64() >= Some(good));
    assert_eq!((&seen["rows"], &seen["segments"]), (&good.into(), &0.into()), "{seen}");
    // The last frame is garbled: nobody knows that it is missing.
    assert_eq!(seen["missed"], turned - usize::from(lines.len() % 10 == 0), "{seen}");
    assert!(seen["garbled"].as_u64() >= Some(turned as u64), "{seen}");
    until_delay_is_named(&mut pipeline);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
}

#[test]
fn lines_come_by_udp_to_a_named_effect() {
    let place = Place::new();
    let (_, lines) = late_log(&place, 60.0);
    let ours = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let mut pipeline = place.start("sensor", &["--source", &format!("udp:{to}?header=t,gyro_z,ref_angle_z")]);
    source(&place, &mut pipeline, "that it is open", |s| s["link"] == "connected" || s["link"] == "silent");
    // Three rows a packet, the last without an end, and one packet that is cut.
    for (k, three) in lines.chunks(3).enumerate() {
        let text = three.join("\n");
        let cut = if k == 500 { text.len() - 25 } else { text.len() };
        ours.send_to(&text.as_bytes()[..cut], to).unwrap();
        sleep(Duration::from_millis(3));
    }
    let seen = source(&place, &mut pipeline, "all rows", |s| s["rows"].as_u64() >= Some(lines.len() as u64 - 1));
    assert_eq!((&seen["rows"], &seen["cut"]), (&(lines.len() - 1).into(), &1.into()), "{seen}");
    until_delay_is_named(&mut pipeline);
    assert_eq!(pipeline.interrupt().code, Some(0));
}

/// Frames of a vehicle as lines of `candump -L`, gyro and encoder beside a message of another device, and the DBC file of them.
fn frames_of_a_vehicle(place: &Place, simulated: &Simulated) -> (Vec<String>, String) {
    let dbc = place.file("car.dbc").display().to_string();
    let text = "BO_ 256 IMU: 3 X\n SG_ YAW_RATE : 0|24@1- (0.001,0) [0|0] \"deg/s\" X\nBO_ 257 ENCODER: 4 X\n \
                SG_ ANGLE : 7|32@0- (0.0001,0) [0|0] \"deg\" X\n";
    std::fs::write(&dbc, text).unwrap();
    let steps = |x: f64, step: f64| (x.to_degrees() / step).round() as i32;
    let of_row = |row: &Row| {
        let stamp = format!("({}.{:06})", 1_700_000_000 + row.t_ns / 1_000_000_000, row.t_ns / 1000 % 1_000_000);
        let [a, b, c, _] = steps(row.gyro[2], 1e-3).to_le_bytes();
        let angle = steps(row.ref_angle[2], 1e-4).cast_unsigned();
        format!("{stamp} can0 100#{a:02X}{b:02X}{c:02X}\n{stamp} can0 101#{angle:08X}\n{stamp} can0 7FF#00\n")
    };
    (simulated.record.rows.iter().map(of_row).collect(), dbc)
}

#[test]
fn frames_of_a_vehicle_garbled_and_unplugged_end_in_a_named_effect() {
    let place = Place::new();
    let (simulated, _) = late_log(&place, 90.0);
    let (frames, dbc) = frames_of_a_vehicle(&place, &simulated);
    let mut plug = Plug::new(&place);
    plug.plug_in();
    let address = format!("serial:{}?format=candump&dbc={dbc}", plug.path.display());
    let mut pipeline = place.start("sensor", &["--source", &address]);
    let mut rows = 0;
    for (part, garbled) in [(&frames[..4000], "100#X"), (&frames[4100..], "101#1")] {
        source(&place, &mut pipeline, "that it is open", |s| s["link"] == "connected" || s["link"] == "silent");
        for (k, three) in part.iter().enumerate() {
            // Of every fifth row one frame of its two is garbled.
            let is_good = k % 5 != 2;
            let text = if is_good { three.clone() } else { three.replace(&garbled[..4], garbled) };
            plug.write_all(text.as_bytes()).unwrap();
            rows += 1 + u64::from(is_good);
            sleep(Duration::from_millis(1));
        }
        source(&place, &mut pipeline, "its rows", |s| s["rows"] == rows);
        if part.len() == 4000 {
            plug.pull_out();
            source(&place, &mut pipeline, "that it is lost", |s| s["link"] == "lost");
            plug.plug_in();
        }
    }
    let seen = source(&place, &mut pipeline, "all rows", |s| s["rows"] == rows);
    assert_eq!((&seen["garbled"], &seen["times"], &seen["reconnects"]), (&1780.into(), &0.into(), &1.into()), "{seen}");
    until_delay_is_named(&mut pipeline);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), rows, "{}", ended.out);
}

#[test]
fn frames_of_a_vehicle_come_on_standard_input_and_those_of_another_are_refused() {
    let place = Place::new();
    let (simulated, _) = late_log(&place, 30.0);
    let (frames, dbc) = frames_of_a_vehicle(&place, &simulated);
    let text = frames.concat();
    let (pipeline, mut input) = place.start_fed("sensor", &["--dbc", &dbc, "--speed", "max"]);
    input.write_all(text.as_bytes()).unwrap();
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), 2 * frames.len() as u64, "{}", ended.out);
    // Another vehicle's file says so.
    let stranger = place.file("stranger.dbc");
    std::fs::write(&stranger, "BO_ 258 IMU: 3 X\n SG_ YAW_RATE : 0|24@1- (1,0) [0|0] \"deg/s\" X\n").unwrap();
    let (pipeline, mut input) = place.start_fed("sensor", &["--dbc", &stranger.display().to_string()]);
    let _ = input.write_all(text.as_bytes());
    drop(input);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(1), "{}{}", ended.out, ended.error);
    assert!(ended.error.contains("none of them one of IMU 0x102"), "{}", ended.error);
}

#[test]
fn lines_come_by_tcp_from_a_server_that_goes_and_comes_again() {
    let place = Place::new();
    let (_, lines) = late_log(&place, 60.0);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = server.local_addr().unwrap();
    let mut pipeline = place.start("sensor", &["--source", &format!("tcp:{at}")]);
    let (mut good, mut held) = (0, None);
    for part in [&lines[..2500], &lines[2500..]] {
        drop(held.take());
        let (mut client, _) = server.accept().unwrap();
        client.write_all(b"t,gyro_z,ref_angle_z\n").unwrap();
        good += garbled(part, 0.0, |bytes| client.write_all(bytes).unwrap());
        source(&place, &mut pipeline, "its rows", |s| s["rows"] == good);
        held = Some(client);
    }
    let seen = source(&place, &mut pipeline, "all rows", |s| s["rows"] == good);
    assert!(seen["segments"] == 0 && seen["reconnects"] == 1, "{seen}");
    until_delay_is_named(&mut pipeline);
    assert_eq!(pipeline.interrupt().code, Some(0));
}

/// A Python that has pymavlink: the one that `TRUERATE_PYMAVLINK` names, or the system's; said aloud where there is none.
fn pymavlink() -> Option<String> {
    let python = std::env::var("TRUERATE_PYMAVLINK").unwrap_or_else(|_| "python3".to_owned());
    let there = Command::new(&python).args(["-c", "import pymavlink"]).output().is_ok_and(|o| o.status.success());
    if !there {
        eprintln!("skipped: {python} has no pymavlink (`pip install pymavlink`, then TRUERATE_PYMAVLINK=PYTHON)");
    }
    there.then_some(python)
}

#[test]
fn mavlink_from_pymavlink_ends_in_a_named_effect() {
    let Some(python) = pymavlink() else { return };
    let place = Place::new();
    let simulated = spoilt_log(&place.file("late.csv"), 60.0, 100.0, 12, &["delay:d=0.02"]);
    let mut text = String::new();
    for r in &simulated.record.rows {
        let half = 0.5 * r.ref_angle[2];
        let (t, gyro, [w, z]) = (r.t_ns / 1000, r.gyro, [half.cos(), half.sin()]);
        let _ = writeln!(text, "{t} {} {} {} {w} {z}", gyro[0], gyro[1], gyro[2]);
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pipeline/send_mavlink.py");
    for version in ["1.0", "2.0"] {
        let to = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let mut pipeline = place.start("sensor", &["--source", &format!("mavlink:udp:{to}")]);
        source(&place, &mut pipeline, "that it is open", |s| s["link"] == "connected" || s["link"] == "silent");
        let mut child =
            Command::new(&python).arg(&script).args([&to.to_string(), version]).stdin(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        assert!(child.wait().unwrap().success());
        let rows = simulated.record.len() as u64;
        let seen = source(&place, &mut pipeline, "its rows", |s| s["rows"].as_u64() >= Some(rows * 9 / 10));
        assert!(seen["garbled"].as_u64() > Some(0) && seen["segments"] == 0, "{seen}");
        if version == "2.0" {
            until_delay_is_named(&mut pipeline);
        }
        assert_eq!(pipeline.interrupt().code, Some(0));
    }
}

/// A gyro and its temperature in a tree like the kernel's, whose buffer is a pipe.
fn sensor_tree(place: &Place) -> (PathBuf, PathBuf) {
    let root = place.file("root");
    let folder = root.join("sys/bus/iio/devices/iio:device3");
    for sub in ["scan_elements", "buffer"] {
        std::fs::create_dir_all(folder.join(sub)).unwrap();
    }
    for (file, text) in [
        ("name", "icm20608"),
        ("in_anglvel_scale", "0.000266316"),
        ("in_temp_scale", "3.0"),
        ("in_temp_offset", "8000"),
        ("buffer/enable", "0"),
        ("buffer/watermark", "64"),
        ("scan_elements/in_anglvel_z_en", "0"),
        ("scan_elements/in_anglvel_z_index", "5"),
        ("scan_elements/in_anglvel_z_type", "be:s16/16>>0"),
        ("scan_elements/in_temp_en", "0"),
        ("scan_elements/in_temp_index", "2"),
        ("scan_elements/in_temp_type", "le:s12/16>>4"),
        ("scan_elements/in_magn_x_en", "0"),
        ("scan_elements/in_timestamp_en", "0"),
        ("scan_elements/in_timestamp_index", "9"),
        ("scan_elements/in_timestamp_type", "le:s64/64>>0"),
    ] {
        std::fs::write(folder.join(file), text).unwrap();
    }
    std::fs::create_dir_all(root.join("dev")).unwrap();
    let node = root.join("dev/iio:device3");
    assert!(Command::new("mkfifo").arg(&node).status().unwrap().success());
    (root, node)
}

#[test]
fn a_gyro_of_linux_iio_is_held_against_an_encoder_that_comes_another_way() {
    let place = Place::new();
    let (simulated, _) = late_log(&place, 60.0);
    let (root, node) = sensor_tree(&place);
    let encoder = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let (source_at, reference_at) =
        (format!("iio:icm20608?root={}", root.display()), format!("udp:{to}?header=t_ms,ref_angle_z"));
    let mut pipeline = place.start("sensor", &["--source", &source_at, "--reference", &reference_at]);
    source(&place, &mut pipeline, "that it is open", |s| s["link"] == "connected" || s["link"] == "silent");
    let mut buffer = std::fs::OpenOptions::new().write(true).open(&node).unwrap();
    assert_eq!(std::fs::read_to_string(root.join("sys/bus/iio/devices/iio:device3/buffer/enable")).unwrap(), "1");
    let start = Instant::now();
    for (k, row) in simulated.record.rows.iter().enumerate() {
        // The encoder has a clock of its own, which is of no use here.
        let text = format!("{},{:.9}\n", 77_000 + 10 * k, row.ref_angle[2]);
        encoder.send_to(text.as_bytes(), to).unwrap();
        sleep((start + Duration::from_millis(2 * k as u64)).saturating_duration_since(Instant::now()));
        let mut scan = Vec::new();
        scan.extend((16 * 333_i16).to_le_bytes());
        scan.extend(((row.gyro[2] / 0.000_266_316).round() as i16).to_be_bytes());
        scan.extend([0; 4]);
        scan.extend((1_700_000_000_000_000_000 + row.t_ns).to_le_bytes());
        buffer.write_all(&scan).unwrap();
    }
    let rows = simulated.record.len() as u64;
    let seen = source(&place, &mut pipeline, "all rows", |s| s["rows"] == rows);
    assert!(seen["garbled"] == 0 && seen["segments"] == 0, "{seen}");
    until_delay_is_named(&mut pipeline);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
}

#[test]
fn a_sensor_without_a_buffer_is_read_again_and_again() {
    let place = Place::new();
    let (root, node) = sensor_tree(&place);
    std::fs::remove_file(node).unwrap();
    let folder = root.join("sys/bus/iio/devices/iio:device3");
    std::fs::write(folder.join("in_anglvel_z_raw"), "-1000\n").unwrap();
    let address = format!("iio:device3?rate=200&root={}", root.display());
    let out = place.file("socket");
    let mut pipeline =
        place.start("sensor", &["--source", &address, "--out", &format!("unix:{}?format=csv", out.display())]);
    source(&place, &mut pipeline, "rows", |s| s["rows"].as_u64() > Some(300));
    let mut stream = None;
    pipeline.until("the socket", |_| {
        stream = std::os::unix::net::UnixStream::connect(&out).ok();
        stream.is_some()
    });
    let lines = std::io::BufRead::lines(std::io::BufReader::new(stream.unwrap()));
    let line = lines.map(Result::unwrap).nth(20).unwrap();
    let rate: f64 = line.split(',').nth(5).unwrap().parse().unwrap();
    assert!((rate + 0.266_316).abs() < 1e-4, "{line}");
    assert_eq!(pipeline.interrupt().code, Some(0));
}
