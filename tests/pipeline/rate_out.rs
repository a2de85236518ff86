//! The rate out, taken by programs that know nothing of this one: C and Python, sockets, standard output.

use crate::harness::{Pipeline, Place, counted, log, signal};
use rustix::process::Signal;
use std::{
    collections::HashMap,
    io::{BufRead, BufReader, Read},
    net::UdpSocket,
    os::unix::net::UnixStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread::JoinHandle,
    time::Duration,
};

const CLIENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/clients");
const ROW: usize = 136;

/// Compiles a C client, strictly; `None`, said aloud, where there is no compiler.
pub fn compiled(place: &Place, name: &str) -> Option<PathBuf> {
    let program = place.file(name);
    let source = format!("{CLIENTS}/c/{name}.c");
    let strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2", "-o"];
    match Command::new("cc").args(strict).arg(&program).arg(source).output() {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            Some(program)
        }
        Err(error) => {
            eprintln!("skipped: there is no C compiler here ({error})");
            None
        }
    }
}

/// Whether there is a Python here; said aloud where not.
fn has_python() -> bool {
    let there = Command::new("python3").arg("--version").output().is_ok();
    if !there {
        eprintln!("skipped: there is no python3 here");
    }
    there
}

/// What a control loop wrote, line by line: its time as written, rate, command; and how often it had no rate.
struct Loop {
    child: Child,
    lines: JoinHandle<Vec<(String, f64, f64)>>,
}

impl Loop {
    fn start(mut command: Command, ring: &Path) -> Self {
        let mut child = command.arg(ring).stdout(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let lines = std::thread::spawn(move || {
            let line = |line: String| {
                let mut words = line.split(' ');
                let time = words.next().unwrap().to_owned();
                (time, words.next().unwrap().parse().unwrap(), words.next().unwrap().parse().unwrap())
            };
            out.lines().map(|text| line(text.unwrap())).collect()
        });
        Self { child, lines }
    }

    fn end(mut self) -> Vec<(String, f64, f64)> {
        assert!(self.child.wait().unwrap().success());
        self.lines.join().unwrap()
    }
}

/// Recorded rates about z by their times, as written with nine digits.
fn recorded(path: &Path) -> HashMap<String, f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let at = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let (t, rate) = (at("t"), at("rate_filtered_z"));
    lines.filter_map(|row| Some((format!("{:.9}", row[t].parse::<f64>().ok()?), row[rate].parse().ok()?))).collect()
}

/// A vehicle whose rate two control loops, in C and in Python, read while kalman is killed ten times.
#[test]
fn control_loops_in_c_and_python_get_no_wrong_rate_while_kalman_is_killed_ten_times() {
    let place = Place::new();
    let (ring, record, config) = (place.file("rate"), place.file("record.csv"), place.file("vehicle.toml"));
    std::fs::write(&config, "[simulation]\nrate_hz = 500.0\nreference = \"orientation\"\n").unwrap();
    let out = format!("shm:{}", ring.display());
    let args = ["--config", config.to_str().unwrap(), "--out", &out, "--record", record.to_str().unwrap()];
    let mut pipeline = place.start("loops", &args);
    let mut loops: Vec<Loop> =
        compiled(&place, "control_loop").map(|c| Loop::start(Command::new(c), &ring)).into_iter().collect();
    if has_python() {
        let mut python = Command::new("python3");
        python.arg(format!("{CLIENTS}/python/control_loop.py"));
        loops.push(Loop::start(python, &ring));
    }
    let written =
        |_: &mut Pipeline| std::fs::read(&ring).map_or(0, |b| u64::from_le_bytes(b[40..48].try_into().unwrap()));
    pipeline.until("the first rates", |p| written(p) > 500);
    for _ in 0..10 {
        let before = pipeline.pid("kalman").unwrap();
        signal(before, Signal::KILL);
        pipeline.until("another kalman", |p| p.pid("kalman").is_some_and(|pid| pid != before));
        let had = written(&mut pipeline);
        pipeline.until("rates again", |p| written(p) > had + 200);
        // Not so fast that the supervisor takes the whole domain to be broken.
        std::thread::sleep(Duration::from_secs(2));
    }
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    let recorded = recorded(&record);
    for control in loops {
        let lines = control.end();
        let (mut checked, mut last, mut gap) = (0, f64::NEG_INFINITY, 0.0_f64);
        for (time, rate, command) in &lines {
            assert!(rate.is_finite() && command.is_finite() && command.abs() <= 1.0, "{time} {rate} {command}");
            if time == "none" {
                assert_eq!(*command, 0.0);
                continue;
            }
            let t: f64 = time.parse().unwrap();
            assert!(t > last, "{t} after {last}");
            if last.is_finite() {
                gap = gap.max(t - last);
            }
            last = t;
            // What the recorder missed while it was busy is not wrong.
            if let Some(expected) = recorded.get(time) {
                assert!((rate - expected).abs() < 1e-6, "{time}: {rate} where {expected} was recorded");
                checked += 1;
            }
        }
        assert!(checked > 2000, "{checked} of {} lines", lines.len());
        eprintln!("{} rates, the longest gap {:.0} ms", lines.len(), 1e3 * gap);
    }
    assert!(!ring.exists(), "the shared memory is gone");
    assert!(place.left("loops").is_empty(), "{:?}", place.left("loops"));
}

/// A row's number, time of validity and rate about z, from bytes.
fn row(bytes: &[u8]) -> (u64, i64, f64) {
    assert_eq!(&bytes[..6], b"TRTR\x01\0");
    let eight = |at: usize| bytes[at..at + 8].try_into().unwrap();
    (u64::from_le_bytes(eight(8)), i64::from_le_bytes(eight(16)), f64::from_le_bytes(eight(64)))
}

#[test]
fn a_socket_and_packets_carry_the_same_rows() {
    let place = Place::new();
    let path = place.file("socket");
    let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
    receiver.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let udp = format!("udp:{}", receiver.local_addr().unwrap());
    let unix = format!("unix:{}", path.display());
    let as_text = format!("{unix}.text?format=csv");
    let mut pipeline = place.start("sockets", &["--source", "sim", "--out", &unix, "--out", &udp, "--out", &as_text]);
    let mut stream = None;
    pipeline.until("the socket", |_| {
        stream = UnixStream::connect(&path).ok();
        stream.is_some()
    });
    let mut stream = stream.unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let mut text = None;
    pipeline.until("the other socket", |_| {
        text = UnixStream::connect(format!("{}.text", path.display())).ok();
        text.is_some()
    });
    let mut lines = BufReader::new(text.unwrap()).lines();
    // Whoever does not read is not waited for.
    let silent = UnixStream::connect(&path).unwrap();
    let (mut by_socket, mut by_packet) = (HashMap::new(), HashMap::new());
    for k in 0..3000 {
        let mut bytes = [0; ROW];
        stream.read_exact(&mut bytes).unwrap();
        let (number, time, rate) = row(&bytes);
        assert!(rate.is_finite());
        by_socket.insert(number, (time, rate));
        let mut packet = [0; 2 * ROW];
        assert_eq!(receiver.recv(&mut packet).unwrap(), ROW, "packet {k}");
        let (number, time, rate) = row(&packet[..ROW]);
        by_packet.insert(number, (time, rate));
    }
    let both = by_socket.iter().filter(|(number, value)| by_packet.get(number) == Some(value)).count();
    assert!(both > 1500, "{both} rows came both ways");
    assert_eq!(lines.next().unwrap().unwrap(), "t,rate_x,rate_std_x,rate_y,rate_std_y,rate_z,rate_std_z,flags,epoch");
    assert_eq!(lines.next().unwrap().unwrap().matches(',').count(), 8);
    drop((silent, stream, lines));
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert!(!path.exists());
    assert!(place.left("sockets").is_empty(), "{:?}", place.left("sockets"));
}

#[test]
fn standard_output_has_a_line_for_every_row_of_a_log() {
    let place = Place::new();
    let path = place.file("log.csv");
    let rows = log(&path, 30.0, 6).record.len();
    let args = ["--source", path.to_str().unwrap(), "--speed", "max", "--out", "-"];
    let pipeline = place.start("lines", &args);
    let ended = pipeline.end_reading();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let lines: Vec<&str> = ended.out.lines().collect();
    assert_eq!(lines.len(), rows + 1);
    assert!(lines[0].starts_with("t,rate_x") && lines[1..].iter().all(|line| line.matches(',').count() == 8));
    assert_eq!(counted(&ended.error, "sender", "in"), rows as u64, "the summary goes to the other output");
}

#[test]
fn a_place_that_is_none_is_refused_in_one_line() {
    let place = Place::new();
    for (out, says) in [("file", "unknown place for the rate"), ("unix:/nowhere/rate", "/nowhere/rate")] {
        let output =
            place.output(&["run", "--source", "sim", "--dashboard", "off", "--instance", "wrong", "--out", out]);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        let error = String::from_utf8(output.stderr).unwrap();
        let told: Vec<&str> = error.lines().filter(|line| line.starts_with("truerate: ")).collect();
        assert!(told.len() == 1 && told[0].contains(says), "{error}");
    }
}
