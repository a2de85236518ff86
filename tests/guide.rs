//! `truerate guide` as a process, fed by a simulated hand that reads what it says and does that, late, unevenly and not as fast:
//! over a serial line, by UDP and through a pipe. The log that comes of it has to name what was hidden.

mod common;

use common::Bench;
use gyro_model::{
    Axis, Row,
    guide::{Correction, Hand, Kind, Manoeuvre},
    simulate::{Hidden, Reference, Scenario, SensorSpec},
};
use rustix::{
    fs::{Mode, OFlags},
    pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt},
};
use serde_json::Value;
use std::{
    fmt::Write as _,
    fs::File,
    io::{BufRead, BufReader, Read, Write},
    net::UdpSocket,
    process::{Child, ChildStdout, Stdio},
    time::{Duration, Instant},
};

/// No recording takes longer, however busy the machine is.
const DEADLINE: Duration = Duration::from_secs(240);
/// Rows that are sent before the hand reads what is said, s.
const AT_ONCE: f64 = 0.5;

/// What is written at once goes in one packet.
struct Datagrams(UdpSocket);

impl Write for Datagrams {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.send(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A guide that runs, and what it says.
struct Guided {
    child: Child,
    says: BufReader<ChildStdout>,
    events: Vec<Value>,
    until: Instant,
}

/// A sensor that sends rows.
struct Sensor {
    to: Box<dyn Write>,
    header: String,
    reference: Reference,
    axis: Axis,
}

impl Sensor {
    fn new(to: Box<dyn Write>, sensor: &SensorSpec) -> Self {
        let axis = sensor.axis;
        let header = match sensor.reference {
            Reference::Quaternion => {
                "t,gyro_x,gyro_y,gyro_z,ref_qw,ref_qx,ref_qy,ref_qz,accel_x,accel_y,accel_z,temp\n".to_owned()
            }
            _ => format!("t_us,gyro_{axis}_dps,ref_angle_{axis},temp\n"),
        };
        Self { to, header, reference: sensor.reference, axis }
    }

    /// One packet or write of whole lines, so that a datagram cuts none.
    fn send(&mut self, rows: &[Row]) -> std::io::Result<()> {
        let mut text = std::mem::take(&mut self.header);
        let i = self.axis.index();
        for row in rows {
            let t = row.t_ns as f64 * 1e-9;
            if self.reference == Reference::Quaternion {
                let values = row.gyro.iter().chain(&row.ref_quaternion).chain(&row.accel).chain([&row.temperature]);
                let _ = writeln!(text, "{t:.6},{}", values.map(ToString::to_string).collect::<Vec<_>>().join(","));
            } else {
                let (t, rate) = (row.t_ns / 1000, row.gyro[i].to_degrees());
                let _ = writeln!(text, "{t},{rate},{},{}", row.ref_angle[i], row.temperature);
            }
        }
        self.to.write_all(text.as_bytes())?;
        self.to.flush()
    }
}

impl Guided {
    fn start(bench: &Bench, source: &str, words: &[&str], input: Stdio) -> Self {
        let words = [&["guide", "--source", source, "--format", "json"], words].concat();
        let mut child =
            bench.command(&words).stdin(input).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let says = BufReader::new(child.stdout.take().unwrap());
        Self { child, says, events: Vec::new(), until: Instant::now() + DEADLINE }
    }

    /// The next event; `None` once it has ended.
    fn next(&mut self) -> Option<Value> {
        assert!(Instant::now() < self.until, "too late: {:#?}", self.events.last());
        let mut line = String::new();
        if self.says.read_line(&mut line).unwrap() == 0 {
            return None;
        }
        let event: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"));
        assert_eq!(event["schema"], "truerate.guide/1", "{event}");
        self.events.push(event.clone());
        Some(event)
    }

    /// Waits until it listens.
    fn until_open(&mut self) {
        let is_open = |event: Value| {
            event["says"].as_str().is_some_and(|says| says.contains("connected") || says.contains("silent"))
        };
        while !self.next().is_some_and(is_open) {}
    }

    /// Plays until it ends, or so much was sent: what is said of the end, and the exit code.
    fn play(&mut self, mut sensor: Sensor, hand: &mut Hand, listens: bool, most: f64) -> (Value, i32) {
        let rows = (AT_ONCE * 100.0) as usize;
        let (mut sent, mut is_over) = (0.0, false);
        while sent < most && !is_over {
            let piece: Vec<Row> = hand.by_ref().take(rows).collect();
            // Few rows a packet, as a sensor sends.
            is_over = piece.chunks(5).any(|few| sensor.send(few).is_err());
            sent += AT_ONCE;
            while !is_over {
                let Some(event) = self.next() else {
                    is_over = true;
                    break;
                };
                if listens {
                    obey(hand, &event);
                }
                // The first second says what the source has.
                let is_behind = event["seconds"].as_f64().is_some_and(|seconds| seconds < sent - 0.1);
                is_over = event["event"] == "end";
                if !is_behind {
                    break;
                }
            }
        }
        drop(sensor);
        while self.next().is_some() {}
        let mut error = String::new();
        if let Some(mut said) = self.child.stderr.take() {
            said.read_to_string(&mut error).unwrap();
        }
        let code = self.child.wait().unwrap().code().unwrap_or(-1);
        let end = self.events.last().unwrap_or_else(|| panic!("nothing was said: {error}")).clone();
        assert!(end["event"] == "end", "{end}: {error}");
        (end, code)
    }

    /// What was said, without what came again.
    fn orders(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for event in self.events.iter().filter(|event| event["event"] == "state") {
            for says in [&event["says"], &event["correction_says"]].into_iter().filter_map(Value::as_str) {
                if all.last().is_none_or(|last| last != says) {
                    all.push(says.to_owned());
                }
            }
        }
        all
    }
}

impl Drop for Guided {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The hand reads an event as any program would.
fn obey(hand: &mut Hand, event: &Value) {
    let order = &event["order"];
    let kind = Kind::ALL.into_iter().find(|kind| serde_json::to_value(kind).unwrap() == order["manoeuvre"]);
    let axis: Option<Axis> = order["axis"].as_str().and_then(|axis| axis.parse().ok());
    let rate = order["rate"].as_f64();
    hand.hear(kind.zip(axis).zip(rate).map(|((kind, axis), rate)| Manoeuvre { axis, kind, rate }));
    match event["correction"].as_str() {
        Some("faster") => hand.mend(Correction::Faster),
        Some("slower") => hand.mend(Correction::Slower),
        _ => {}
    }
}

fn hand(hidden: &[&str], sensor: &SensorSpec, seed: u64) -> Hand {
    let hidden = hidden.iter().map(|text| Hidden::parse(text, sensor.axis).unwrap()).collect();
    Hand::new(&Scenario { rate_hz: 100.0, seed, hidden, sensor: sensor.clone(), ..Scenario::default() })
}

/// `diagnose` of the log: what it names, first the best and then what looks like it.
fn named(bench: &Bench, log: &str, axis: &str) -> Vec<String> {
    let out = bench.ok(&["diagnose", log, "--axis", axis, "--format", "json"]);
    let told: Value = serde_json::from_str(&out).unwrap();
    let best = &told["axes"][0]["suspects"][0];
    assert!(["missing-effect", "ambiguous"].contains(&told["axes"][0]["verdict"].as_str().unwrap()), "{out}");
    let aliases = best["aliases"].as_array().into_iter().flatten();
    std::iter::once(&best["effect"]).chain(aliases).filter_map(|id| id.as_str().map(str::to_owned)).collect()
}

#[test]
fn a_hand_on_a_serial_line_is_led_to_a_log_that_names_what_is_hidden() {
    let bench = Bench::new();
    let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&end).unwrap();
    unlockpt(&end).unwrap();
    let name = ptsname(&end, Vec::new()).unwrap();
    let line = rustix::fs::open(name.as_c_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
    let mut settings = rustix::termios::tcgetattr(&line).unwrap();
    settings.make_raw();
    rustix::termios::tcsetattr(&line, rustix::termios::OptionalActions::Now, &settings).unwrap();

    let sensor = SensorSpec::on(Axis::Z);
    let source = format!("serial:{}", name.to_str().unwrap());
    let mut guided = Guided::start(&bench, &source, &["-o", "hand.csv"], Stdio::null());
    // What is sent before the line is open is thrown away.
    guided.until_open();
    let mut own = hand(&["lag:tau=0.015"], &sensor, 21);
    let (end, code) = guided.play(Sensor::new(Box::new(File::from(end)), &sensor), &mut own, true, 300.0);
    assert_eq!((code, &end["complete"]), (0, &Value::Bool(true)), "{end:#} {:#?}", guided.orders());
    assert_eq!(end["next"], "truerate ladder hand.csv -o model.toml");
    assert_eq!(named(&bench, "hand.csv", "z"), ["lag"], "{:#?}", guided.orders());
    let headline = end["verdicts"][0]["headline"].as_str().unwrap();
    assert!(headline.contains("slowly, with a time constant of 1"), "{headline}");
}

#[test]
fn two_axes_by_udp_are_each_turned_and_told() {
    let bench = Bench::new();
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let out = UdpSocket::bind("127.0.0.1:0").unwrap();
    let sensor = SensorSpec { reference: Reference::Quaternion, reference_noise: 5e-4, ..SensorSpec::on(Axis::Y) };
    let words = ["--want", "scale-factor,bias,delay", "--axes", "x,y", "-o", "body.csv"];
    let header = "?header=t,gyro_x,gyro_y,gyro_z,ref_qw,ref_qx,ref_qy,ref_qz,accel_x,accel_y,accel_z,temp";
    let mut guided = Guided::start(&bench, &format!("udp:{port}{header}"), &words, Stdio::null());
    guided.until_open();
    out.connect(port).unwrap();
    let mut own = hand(&["delay:d=0.02"], &sensor, 22);
    let mut sends = Sensor::new(Box::new(Datagrams(out)), &sensor);
    sends.header.clear();
    let (end, code) = guided.play(sends, &mut own, true, 300.0);
    assert_eq!((code, &end["complete"]), (0, &Value::Bool(true)), "{end:#} {:#?}", guided.orders());
    for axis in ["x", "y"] {
        let orders = guided.orders();
        assert!(orders.iter().any(|says| says.contains(&format!("about {axis}"))), "{axis}: {orders:#?}");
        let late = |p: &&Value| p["axis"] == axis && p["effect"] == "delay";
        let delay = end["parameters"].as_array().unwrap().iter().find(late).unwrap();
        let (value, error) = (delay["value"].as_f64().unwrap(), delay["std_error"].as_f64().unwrap());
        assert!(error <= delay["wanted"].as_f64().unwrap() * 1.5 && (value - 0.02).abs() < 5.0 * error, "{delay}");
    }
    assert!(named(&bench, "body.csv", "y").contains(&"delay".to_owned()));
}

#[test]
fn a_hand_that_does_not_move_is_told_so_and_it_is_never_done() {
    let bench = Bench::new();
    let sensor = SensorSpec::on(Axis::X);
    let mut guided = Guided::start(&bench, "-", &["-o", "still.csv"], Stdio::piped());
    let input = guided.child.stdin.take().unwrap();
    let (end, code) = guided.play(Sensor::new(Box::new(input), &sensor), &mut hand(&[], &sensor, 23), false, 60.0);
    assert_eq!((code, &end["complete"]), (3, &Value::Bool(false)), "{end:#}");
    assert!(guided.orders().last().unwrap().starts_with("it does not move"), "{:#?}", guided.orders());
    let lacking = end["lacking"].as_array().unwrap();
    assert!(lacking.iter().any(|lack| lack.as_str().unwrap().contains("scale-factor")), "{end:#}");
    assert!(guided.events.iter().all(|event| event["stage"] != "over" && event["stage"] != "searching"));
    // What came is in the log all the same.
    assert_eq!(bench.text("still.csv").lines().count(), 6001);
}

#[test]
fn what_no_hand_can_mend_is_said_with_what_to_do() {
    let bench = Bench::new();
    let rows = |row: &dyn Fn(f64) -> String| (0..1200).map(|k| row(0.01 * f64::from(k))).collect::<String>();
    let turn = |t: f64| (0.0_f64.max(t - 2.0)).sin() * 2.0;
    let noise = |t: f64| 0.002 * (1e4 * t).sin();
    let stuck = rows(&|t| format!("{t:.2},{:.5},1.5\n", turn(t) + noise(t)));
    let slow = (0..200).map(|k| f64::from(k) * 0.1).map(|t| format!("{t:.1},{:.5},0.01\n", noise(t)));
    let slow = slow.collect::<Vec<_>>().concat();
    let rail = rows(&|t| {
        format!("{t:.2},{:.5},{:.5}\n", (turn(t) + noise(t)).clamp(-1.5, 1.5), 2.0 - 2.0 * (0.0_f64.max(t - 2.0)).cos())
    });
    for (name, text, trouble) in [("a", stuck, "reference-stands"), ("b", slow, "slow-rows"), ("c", rail, "saturates")]
    {
        let log = format!("{name}.csv");
        let words = ["guide", "--source", "-", "--format", "json", "-o", &log];
        let done = bench.run_with(&words, format!("t,gyro_z,ref_angle_z\n{text}").as_bytes());
        assert_eq!(done.code, 3, "{name}: {done:?}");
        assert!(done.out.contains(&format!("\"trouble\":\"{trouble}\"")), "{name}: {done:?}");
    }
    // Nothing to hold the gyro against.
    let done = bench.run_with(
        &["guide", "--source", "-", "-o", "d.csv"],
        format!("t,gyro_z\n{}", rows(&|t| format!("{t:.2},{t}\n"))).as_bytes(),
    );
    assert!(done.code == 1 && done.err.contains("--reference ADDRESS") && !bench.path("d.csv").exists(), "{done:?}");
    // A recording is not written over, a log is none to record.
    for (words, says) in [
        (&["guide", "--source", "-", "-o", "a.csv"][..], "is there already"),
        (&["guide", "--source", "a.csv", "-o", "e.csv"], "is a log, and a recording needs a sensor"),
        (&["guide", "--source", "-", "-o", "e.csv", "--want", "saturation"], "no manoeuvre can measure it"),
        (&["guide", "--source", "-", "-o", "e.csv", "--want", "dely"], "did you mean 'delay'"),
        (&["guide", "--source", "-", "-o", "e.csv", "--to", "lag=0.1"], "not among the effects to be shown"),
        (&["guide", "--source", "-", "-o", "e.csv.gz"], "ends in .csv"),
    ] {
        let error = bench.refused(words);
        assert!(error.contains(says), "{words:?}: {error}");
    }
}

#[test]
fn frames_of_a_can_bus_are_recorded_as_the_dbc_file_tells_them() {
    let bench = Bench::new();
    let dbc = "BO_ 256 IMU: 4 X\n SG_ YAW_RATE : 0|32@1- (0.0001,0) [0|0] \"deg/s\" X\nBO_ 257 ENCODER: 4 X\n \
               SG_ ANGLE : 0|32@1- (0.0001,0) [0|0] \"deg\" X\n";
    std::fs::write(bench.path("car.dbc"), dbc).unwrap();
    let bytes = |x: f64| ((x.to_degrees() * 1e4).round() as i32).cast_unsigned().swap_bytes();
    let frames = |row: Row| {
        let stamp = format!("({:.6}) can0", 1_700_000_000.0 + row.t_ns as f64 * 1e-9);
        format!("{stamp} 100#{:08X}\n{stamp} 101#{:08X}\n", bytes(row.gyro[2]), bytes(row.ref_angle[2]))
    };
    let text: String = hand(&[], &SensorSpec::on(Axis::Z), 5).take(500).map(frames).collect();
    let done = bench.run_with(&["guide", "--source", "-", "--dbc", "car.dbc", "-o", "car.csv"], text.as_bytes());
    assert_eq!(done.code, 3, "five seconds tell little: {done:?}");
    let log = bench.text("car.csv");
    assert!(log.starts_with("t,gyro_z,ref_angle_z,") && log.lines().count() > 500, "{}", &log[..200]);
    // What the bus gives is refused where nobody says what it means, and so is a DBC file that tells nothing.
    for (words, says) in [
        (&["--source", "can:can0"][..], "or give it with --dbc"),
        (&["--source", "udp:127.0.0.1:0", "--dbc", "car.dbc"], "udp:127.0.0.1:0 gives none"),
        (&["--source", "can:can0", "--reference", "can:", "--dbc", "car.dbc"], "the interface is missing"),
    ] {
        let error = bench.refused(&[&["guide", "-o", "e.csv"], words].concat());
        assert!(error.contains(says), "{words:?}: {error}");
    }
}

#[test]
fn a_simulated_hand_is_told_in_plain_lines_and_an_interrupted_recording_keeps_its_log() {
    let bench = Bench::new();
    let done = bench.run(&["guide", "--source", "sim", "--hide", "lag", "--speed", "max", "-o", "try.csv"]);
    assert_eq!(done.code, 0, "{done:?}");
    for says in ["NOW: hold it still", "known: axis", "follows the rate slowly", "next: truerate ladder try.csv"] {
        assert!(done.out.contains(says), "{says}: {}", done.out);
    }
    let mut child = bench
        .command(&["guide", "--source", "sim", "-o", "cut.csv"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut says = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    while !line.contains("NOW") {
        line.clear();
        assert!(says.read_line(&mut line).unwrap() > 0);
    }
    let id = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(id, rustix::process::Signal::INT).unwrap();
    let mut rest = String::new();
    says.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(3), "{rest}");
    assert!(rest.contains("not complete") && rest.contains("lacking: axis"), "{rest}");
    assert!(bench.text("cut.csv").lines().count() > 100);
}

/// The news of a page, as a browser gets them: the newest state, until the page is closed.
fn watch(url: &str) -> std::thread::JoinHandle<Vec<Value>> {
    let address = url.trim().strip_prefix("http://").unwrap().trim_end_matches('/').to_owned();
    let mut link = std::net::TcpStream::connect(&address).unwrap();
    write!(link, "GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let lines = BufReader::new(link).lines().map_while(Result::ok);
    let mut data = lines.filter_map(|line| line.strip_prefix("data: ").map(str::to_owned));
    // From here on nothing is missed.
    let first = data.next().unwrap();
    std::thread::spawn(move || {
        let news = std::iter::once(first).chain(data).filter_map(|data| serde_json::from_str::<Value>(&data).ok());
        news.map(|mut state| if state.get("newest").is_some() { state["newest"]["guide"].take() } else { state })
            .collect()
    })
}

#[test]
fn a_page_says_the_same_as_the_terminal_up_to_the_end() {
    let bench = Bench::new();
    let sensor = SensorSpec::on(Axis::Y);
    let words = ["--want", "scale-factor,bias,delay", "--dashboard", "127.0.0.1:0", "-o", "page.csv"];
    let mut guided = Guided::start(&bench, "-", &words, Stdio::piped());
    let mut errors = BufReader::new(guided.child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("dashboard: ") {
        line.clear();
        assert!(errors.read_line(&mut line).unwrap() > 0, "no page");
    }
    let page = watch(line.trim_start_matches("dashboard: "));
    let input = guided.child.stdin.take().unwrap();
    let mut own = hand(&["delay:d=0.02"], &sensor, 24);
    let (end, code) = guided.play(Sensor::new(Box::new(input), &sensor), &mut own, true, 300.0);
    assert_eq!((code, &end["complete"]), (0, &Value::Bool(true)), "{end:#}");
    let news = page.join().unwrap();
    let last = news.last().unwrap();
    assert!(
        last["end"].as_array().unwrap().iter().any(|says| says.as_str().unwrap().starts_with("next: ")),
        "{last:#}"
    );
    assert!(last["goals"].as_array().unwrap().iter().all(|goal| goal["state"] == "enough"), "{last:#}");
    // What is lacking falls while it is recorded, in the units that engineers say.
    let delays: Vec<&Value> = news.iter().flat_map(|state| state["goals"].as_array().into_iter().flatten()).collect();
    let delays: Vec<&&Value> = delays.iter().filter(|goal| goal["name"] == "delay d").collect();
    assert!(delays.iter().any(|goal| goal["share"].as_f64() < Some(1.0)), "{delays:?}");
    assert!(delays.iter().all(|goal| goal["needed"].as_str().unwrap().ends_with(" ms")), "{delays:?}");
    // Each order of the terminal was on the page.
    for says in guided.events.iter().filter(|event| event["event"] == "state").map(|event| &event["says"]) {
        assert!(news.iter().any(|state| state["now"] == *says), "{says} is not on the page");
    }
}
