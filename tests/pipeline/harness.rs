//! A pipeline of the real program, in a domain of its own, with a deadline.

use gyro_model::{
    Axis,
    simulate::{Hidden, Motion, Scenario, SensorSpec, Simulated, simulate},
};
use ipc_types::domain::Domain;
use serde_json::Value;
use std::{
    fs,
    io::Read,
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, Output, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    time::{Duration, Instant},
};
use workbench::log::write_record;

/// Nothing here takes longer, however busy the machine is.
pub const DEADLINE: Duration = Duration::from_secs(240);

static COUNT: AtomicU32 = AtomicU32::new(0);

/// A place for one instance and for files; everything goes with it.
pub struct Place {
    pub base: PathBuf,
    pub files: tempfile::TempDir,
    /// What every program finds in its environment beside this place.
    pub environment: Vec<(&'static str, String)>,
    /// What every program is run by: as another user, in another mount namespace.
    pub wrapper: Vec<String>,
}

impl Place {
    pub fn new() -> Self {
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let base = PathBuf::from(format!("/tmp/trt-{}-{number}", std::process::id()));
        Self { base, files: tempfile::tempdir().unwrap(), environment: Vec::new(), wrapper: Vec::new() }
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.files.path().join(name)
    }

    pub fn domain(&self, instance: &str) -> Domain {
        Domain::new(&self.base, instance).unwrap()
    }

    pub fn truerate(&self) -> Command {
        let words = [self.wrapper.clone(), vec![env!("CARGO_BIN_EXE_truerate").to_owned()]].concat();
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        command.env("TRUERATE_RUNTIME_DIR", &self.base).env("TRUERATE_LOG", "truerate=info");
        command.envs(self.environment.iter().cloned());
        command
    }

    /// Runs a command to its end.
    pub fn output(&self, args: &[&str]) -> Output {
        self.truerate().args(args).output().unwrap()
    }

    pub fn start(&self, instance: &str, args: &[&str]) -> Pipeline {
        self.start_watched(instance, "off", args)
    }

    /// The same with a dashboard at this address.
    pub fn start_watched(&self, instance: &str, dashboard: &str, args: &[&str]) -> Pipeline {
        self.launch(instance, dashboard, Stdio::null(), args)
    }

    /// The same on standard input, which the test writes.
    pub fn start_fed(&self, instance: &str, args: &[&str]) -> (Pipeline, ChildStdin) {
        let mut pipeline = self.launch(instance, "off", Stdio::piped(), &[&["--source", "-"], args].concat());
        let input = pipeline.child.stdin.take().unwrap();
        (pipeline, input)
    }

    fn launch(&self, instance: &str, dashboard: &str, input: Stdio, args: &[&str]) -> Pipeline {
        let _ = fs::remove_file(self.error(instance));
        Pipeline {
            child: self.supervisor(instance, dashboard, input, args),
            domain: self.domain(instance),
            error: self.error(instance),
            until: Instant::now() + DEADLINE,
        }
    }

    fn error(&self, instance: &str) -> PathBuf {
        self.file(&format!("{instance}.err"))
    }

    /// Another supervisor writes on where the one before it was killed.
    fn supervisor(&self, instance: &str, dashboard: &str, input: Stdio, args: &[&str]) -> Child {
        let errors = fs::OpenOptions::new().create(true).append(true).open(self.error(instance)).unwrap();
        self.truerate()
            .args(["run", "--dashboard", dashboard, "--instance", instance])
            .args(args)
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(errors)
            .spawn()
            .unwrap()
    }

    /// Kills the supervisor, and begins another one.
    pub fn supervise_again(&self, pipeline: &mut Pipeline, args: &[&str]) {
        pipeline.child.kill().unwrap();
        pipeline.child.wait().unwrap();
        pipeline.child = self.supervisor(pipeline.domain.name(), "off", Stdio::null(), args);
    }

    pub fn status(&self, instance: &str) -> Option<Value> {
        let output = self.output(&["status", "--format", "json", "--instance", instance]);
        output.status.success().then(|| serde_json::from_slice(&output.stdout).unwrap())
    }

    /// What is left of an instance: files and shared memory.
    pub fn left(&self, instance: &str) -> Vec<String> {
        let domain = self.domain(instance);
        let mut left = Vec::new();
        if domain.folder().exists() {
            left.push(domain.folder().display().to_string());
        }
        for entry in fs::read_dir("/dev/shm").unwrap().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with(domain.prefix()) {
                left.push(name);
            }
        }
        left
    }
}

/// Ends every process that was started in this place (for this instance), whatever its parent, its namespace and its locks: each
/// carries the place in its environment.
fn end_all(base: &Path, instance: Option<&str>) {
    let place = format!("TRUERATE_RUNTIME_DIR={}", base.display());
    let holds = |process: &Path, file: &str, word: &str| {
        let text = fs::read(process.join(file)).unwrap_or_default();
        text.split(|byte| *byte == 0).any(|part| part == word.as_bytes())
    };
    // Twice in vain: one that was being started as the other looked is there by then.
    let mut quiet = 0;
    while quiet < 2 {
        let mut found = false;
        for entry in fs::read_dir("/proc").into_iter().flatten().flatten() {
            let Ok(pid) = entry.file_name().to_string_lossy().parse::<u32>() else { continue };
            let process = entry.path();
            if pid != std::process::id()
                && holds(&process, "environ", &place)
                && instance.is_none_or(|name| holds(&process, "cmdline", name))
            {
                signal(pid, rustix::process::Signal::KILL);
                found = true;
            }
        }
        quiet = if found { 0 } else { quiet + 1 };
        std::thread::sleep(Duration::from_millis(5));
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        end_all(&self.base, None);
        let _ = fs::remove_dir_all(&self.base);
    }
}

/// A running pipeline; it is killed with its processes when dropped.
pub struct Pipeline {
    pub child: Child,
    pub domain: Domain,
    pub error: PathBuf,
    /// Later than this nothing is waited for.
    pub until: Instant,
}

pub struct Ended {
    pub code: Option<i32>,
    pub out: String,
    pub error: String,
}

impl Pipeline {
    /// The process that holds a service's lock.
    pub fn pid(&self, service: &str) -> Option<u32> {
        truerate::domain::Lock::holder(&self.domain.folder().join(format!("{service}.lock")))
    }

    /// Waits until `condition` holds.
    pub fn until(&mut self, what: &str, mut condition: impl FnMut(&mut Self) -> bool) {
        while !condition(self) {
            self.check(what);
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn check(&mut self, what: &str) {
        if let Ok(Some(status)) = self.child.try_wait() {
            panic!("ended ({status}) while waiting for {what}:\n{}", self.errors());
        }
        assert!(Instant::now() < self.until, "too late: {what}\n{}", self.errors());
    }

    pub fn errors(&self) -> String {
        fs::read_to_string(&self.error).unwrap_or_default()
    }

    /// Waits for its own end.
    pub fn end(mut self) -> Ended {
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < self.until, "it does not end:\n{}", self.errors());
            std::thread::sleep(Duration::from_millis(10));
        };
        let mut out = String::new();
        if let Some(mut stdout) = self.child.stdout.take() {
            stdout.read_to_string(&mut out).unwrap();
        }
        Ended { code: status.code(), out, error: self.errors() }
    }

    /// Waits for its own end while its output is read, however much that is.
    pub fn end_reading(mut self) -> Ended {
        let mut stdout = self.child.stdout.take().unwrap();
        let reader = std::thread::spawn(move || {
            let mut out = String::new();
            stdout.read_to_string(&mut out).unwrap();
            out
        });
        self.child.stdout = None;
        let mut ended = self.end();
        ended.out = reader.join().unwrap();
        ended
    }

    /// Stops it as Ctrl-C does.
    pub fn interrupt(self) -> Ended {
        signal(self.child.id(), rustix::process::Signal::INT);
        self.end()
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(base) = self.domain.folder().parent() {
            end_all(base, Some(self.domain.name()));
        }
        for entry in fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(self.domain.prefix()) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// Whether this is root, who may try other users and mounts; else it is said that the test is skipped.
pub fn is_root() -> bool {
    let root = rustix::process::geteuid().is_root();
    if !root {
        eprintln!("skipped: only root may try other users and mounts");
    }
    root
}

pub fn signal(pid: u32, signal: rustix::process::Signal) {
    if let Some(pid) = i32::try_from(pid).ok().and_then(rustix::process::Pid::from_raw) {
        let _ = rustix::process::kill_process(pid, signal);
    }
}

/// A simulated log on the disk, with its truth.
pub fn log(path: &Path, seconds: f64, seed: u64) -> Simulated {
    spoilt_log(path, seconds, 100.0, seed, &[])
}

/// The same at another rate, with these effects hidden in it.
pub fn spoilt_log(path: &Path, seconds: f64, rate_hz: f64, seed: u64, hidden: &[&str]) -> Simulated {
    let scenario = Scenario {
        motion: Motion::Drive { rate: 1.2, hold: 2.0 },
        seconds,
        rate_hz,
        seed,
        sensor: SensorSpec::on(Axis::Z),
        hidden: hidden.iter().map(|text| Hidden::parse(text, Axis::Z).unwrap()).collect(),
    };
    let simulated = simulate(&scenario);
    write_record(path, &simulated.record, 0).unwrap();
    simulated
}

/// A number of one process in a summary, by the column's name.
pub fn counted(out: &str, process: &str, column: &str) -> u64 {
    let lines: Vec<Vec<&str>> = out.lines().map(|line| line.split_whitespace().collect()).collect();
    let head =
        lines.iter().find(|line| line.first() == Some(&"process")).unwrap_or_else(|| panic!("no counts:\n{out}"));
    let place = head.iter().position(|name| *name == column).unwrap();
    let row =
        lines.iter().find(|line| line.first() == Some(&process)).unwrap_or_else(|| panic!("no {process}:\n{out}"));
    row[place].parse().unwrap()
}

/// (value, standard error) of a parameter in a summary, SI.
pub fn parameter(out: &str, axis: &str, name: &str) -> (f64, f64) {
    let line = out
        .lines()
        .find(|line| line.starts_with(&format!("axis {axis}: {name} ")))
        .unwrap_or_else(|| panic!("no {name} of axis {axis}:\n{out}"));
    let words: Vec<&str> = line.split_whitespace().collect();
    let factor = match words.get(6).copied() {
        None | Some("s") => 1.0,
        Some("°/s") => 1f64.to_radians(),
        Some("ms") => 1e-3,
        Some("ppm") => 1e-6,
        Some(unit) => panic!("{unit} is not read here: {line}"),
    };
    let number = |word: &str| factor * word.replace('−', "-").parse::<f64>().unwrap();
    (number(words[3]), number(words[5]))
}
