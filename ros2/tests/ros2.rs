//! Topics of ROS 2 in, the rate out, the other end being programs that know nothing of truerate (`talk.py`).
//!
//! They need `truerate` (`TRUERATE`, else the one built beside this) and a Python with `eclipse-zenoh` and `rosbags`, which is made where pip
//! can be had. What is missing is said, and the test skipped.

use serde_json::Value;
use std::{
    fs::{self, File},
    net::TcpListener,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::OnceLock,
    time::{Duration, Instant},
};

const HERE: &str = env!("CARGO_MANIFEST_DIR");
const BRIDGE: &str = env!("CARGO_BIN_EXE_truerate-ros2");
const DEADLINE: Duration = Duration::from_secs(180);

/// A process that does not outlive its test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    fn start(command: &mut Command) -> Self {
        Self(command.spawn().unwrap_or_else(|error| panic!("{command:?}: {error}")))
    }

    /// Asks it to end, as Ctrl-C does.
    fn interrupt(&mut self) {
        let done = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status().unwrap();
        assert!(done.success() && self.0.wait().unwrap().success());
    }
}

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let last = Instant::now() + DEADLINE;
    while !holds() {
        assert!(Instant::now() < last, "too late: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn truerate() -> Option<PathBuf> {
    let own = std::env::var_os("TRUERATE").map(PathBuf::from);
    let built = ["release", "debug"].map(|profile| Path::new(HERE).join("../target").join(profile).join("truerate"));
    let found = own.into_iter().chain(built).find(|path| path.exists());
    if found.is_none() {
        eprintln!("skipped: there is no truerate: build it first, or say where it is by TRUERATE");
    }
    found
}

fn python() -> Option<&'static PathBuf> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    let made = PYTHON.get_or_init(|| {
        let folder = Path::new(HERE).join("target/python");
        let program = folder.join("bin/python");
        let has = |program: &Path| {
            let import = Command::new(program).args(["-c", "import zenoh, rosbags"]).output();
            import.is_ok_and(|output| output.status.success())
        };
        if !has(&program) {
            let _ = Command::new("python3").arg("-m").arg("venv").arg(&folder).output();
            let _ = Command::new(&program).args(["-m", "pip", "install", "-q", "eclipse-zenoh", "rosbags"]).output();
        }
        has(&program).then_some(program)
    });
    if made.is_none() {
        eprintln!("skipped: no Python with eclipse-zenoh and rosbags can be had here");
    }
    made.as_ref()
}

/// A port that was free a moment ago.
fn endpoint() -> String {
    format!("tcp/{}", TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap())
}

fn talk(python: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(python);
    command.arg(Path::new(HERE).join("tests/talk.py")).args(words);
    command
}

/// A table's rows; an empty cell is no value.
fn rows(path: &Path) -> (Vec<String>, Vec<Vec<Option<f64>>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(','));
    let header = lines.next().unwrap().map(str::to_owned).collect();
    (header, lines.map(|row| row.map(|cell| cell.parse().ok()).collect()).collect())
}

#[test]
fn an_imu_and_a_pose_become_the_log_that_they_were_made_of_to_a_named_effect() {
    let (Some(truerate), Some(python)) = (truerate(), python()) else { return };
    let folder = tempfile::tempdir().unwrap();
    let [log, heard] = ["log.csv", "heard.csv"].map(|name| folder.path().join(name));
    let simulated = Command::new(&truerate)
        .args([
            "simulate",
            "--reference",
            "orientation",
            "--motion",
            "drive",
            "--seconds",
            "60",
            "--hide",
            "delay:d=0.03",
            "-o",
        ])
        .arg(&log)
        .output()
        .unwrap();
    assert!(simulated.status.success(), "{}", String::from_utf8_lossy(&simulated.stderr));
    let endpoint = endpoint();
    let listening = Running::start(
        Command::new(BRIDGE)
            .args(["listen", "--imu", "/imu/data_raw", "--reference", "/vicon/pose", "--connect", &endpoint])
            .stdout(File::create(&heard).unwrap()),
    );
    let sent = talk(python, &["send", log.to_str().unwrap(), &endpoint, "6"]).output().unwrap();
    assert!(sent.status.success(), "{}", String::from_utf8_lossy(&sent.stderr));
    let ((names, original), (columns, _)) = (rows(&log), rows(&heard));
    until("every row", || rows(&heard).1.len() >= original.len());
    drop(listening);
    let taken = rows(&heard).1;
    assert_eq!(taken.len(), original.len());
    for (k, name) in columns.iter().enumerate().skip(1) {
        let own = names.iter().position(|other| other == name).unwrap_or_else(|| panic!("{name}"));
        for (row, (original, taken)) in original.iter().zip(&taken).enumerate() {
            assert_eq!(taken[k], original[own], "{name} of row {row}");
        }
    }
    let told = Command::new(&truerate).arg("diagnose").arg(&heard).args(["--format", "json"]).output().unwrap();
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    let suspects: Vec<&Value> =
        told["axes"].as_array().unwrap().iter().map(|axis| &axis["suspects"][0]["effect"]).collect();
    assert!(suspects.iter().any(|effect| **effect == "delay"), "{suspects:?}");
}

#[test]
fn the_rate_is_a_topic_of_ros() {
    let (Some(truerate), Some(python)) = (truerate(), python()) else { return };
    let folder = tempfile::tempdir().unwrap();
    let (place, socket) = (folder.path().join("run"), folder.path().join("rate"));
    let (endpoint, rate) = (endpoint(), format!("unix:{}", socket.display()));
    let mut pipeline = Running::start(
        Command::new(&truerate)
            .args(["run", "--source", "sim", "--dashboard", "off", "--out", &rate])
            .env("TRUERATE_RUNTIME_DIR", &place)
            .stdout(Stdio::null()),
    );
    let _sending = Running::start(
        Command::new(BRIDGE).args(["publish", "--from", &rate, "--frame", "gyro", "--listen", &endpoint]),
    );
    let taken = talk(python, &["take", &endpoint, "200"]).output().unwrap();
    assert!(taken.status.success(), "{}", String::from_utf8_lossy(&taken.stderr));
    let lines: Vec<Value> =
        String::from_utf8(taken.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (tokens, messages) = lines.split_last().unwrap();
    assert_eq!(messages.len(), 200);
    let (mut stamp, mut number) = (0.0, 0);
    for message in messages {
        let real = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{message}"));
        let (own, next) = (real(&message["stamp"]), message["sequence_number"].as_i64().unwrap());
        assert!(own > stamp && next > number, "{message}");
        assert!((own - real(&message["now"])).abs() < 60.0, "stamped by the clock of ROS: {message}");
        (stamp, number) = (own, next);
        assert_eq!((&message["frame"], real(&message["orientation"])), (&"gyro".into(), -1.0));
        assert!(
            (0..3).all(|k| real(&message["rate"][k]).is_finite() && real(&message["variance"][k]) >= 0.0),
            "{message}"
        );
        assert_eq!(message["source_gid"], messages[0]["source_gid"]);
    }
    assert!(messages.iter().any(|message| message["rate"][2] != 0.0));
    let tokens = tokens.to_string();
    assert!(tokens.contains("/NN/%/%/truerate") && tokens.contains("/MP/%/%/truerate/%imu%compensated/"), "{tokens}");
    pipeline.interrupt();
}
