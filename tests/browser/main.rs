//! The pages in a real browser: Debian's Chromium, driven by playwright-core. `tests/run` installs both.
//!
//! Where one of them is missing the tests say that they are skipped, unless `TRUERATE_BROWSER=required`.

use ipc_types::domain::Domain;
use std::{
    fs,
    io::{BufRead, BufReader},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

const PROGRAM: &str = env!("CARGO_BIN_EXE_truerate");
/// Nothing here takes longer, however busy the machine is.
const DEADLINE: Duration = Duration::from_secs(600);

/// Runs one script in Node; it fails the test where the script says so.
fn drive(script: &str, arguments: &[&str]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser");
    let output = Command::new("node").arg(script).args(arguments).current_dir(folder).output().unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{script} {arguments:?}:\n{out}{error}");
}

/// Whether there is a browser and its driver; says so where there is none.
fn is_there() -> bool {
    let chromium = std::env::var_os("CHROMIUM").map_or_else(|| PathBuf::from("/usr/bin/chromium"), PathBuf::from);
    let driver = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/node_modules/playwright-core");
    let node = Command::new("node").arg("--version").stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    let missing = match (chromium.exists(), driver.exists(), node) {
        (false, ..) => "chromium",
        (_, _, false) => "node",
        (_, false, _) => "playwright-core (npm ci --prefix tests/browser)",
        _ => return true,
    };
    assert!(std::env::var_os("TRUERATE_BROWSER").is_none(), "the browser tests are required and {missing} is missing");
    eprintln!("skipped: no {missing} here; `tests/run` installs what the browser tests need");
    false
}

/// A pipeline with its dashboard, in a place of its own.
struct Pipeline {
    child: Child,
    base: PathBuf,
}

impl Pipeline {
    fn start(name: &str, arguments: &[&str]) -> Self {
        let base = PathBuf::from(format!("/tmp/trb-{}-{name}", std::process::id()));
        let child = Command::new(PROGRAM)
            .args(["run", "--source", "sim", "--dashboard", "127.0.0.1:0", "--instance", name])
            .args(arguments)
            .env("TRUERATE_RUNTIME_DIR", &base)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self { child, base }
    }

    fn url(&self, name: &str) -> String {
        let domain = Domain::new(&self.base, name).unwrap();
        let start = Instant::now();
        loop {
            if let Ok(url) = fs::read_to_string(domain.folder().join("dashboard.url")) {
                return url;
            }
            assert!(start.elapsed() < DEADLINE, "no dashboard within the deadline");
            sleep(Duration::from_millis(50));
        }
    }
}

impl Pipeline {
    /// The program as the script calls it: in this pipeline's place.
    fn wrapper(&self) -> String {
        let path = self.base.join("truerate.sh");
        let text = format!("#!/bin/sh\nTRUERATE_RUNTIME_DIR='{}' exec '{PROGRAM}' \"$@\"\n", self.base.display());
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path.to_str().unwrap().to_owned()
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // Asked, so that it ends its processes; killed where it does not listen.
        let pid = rustix::process::Pid::from_child(&self.child);
        let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
        let start = Instant::now();
        while self.child.try_wait().is_ok_and(|status| status.is_none()) {
            if start.elapsed() > Duration::from_secs(20) {
                let _ = self.child.kill();
            }
            sleep(Duration::from_millis(20));
        }
        let _ = fs::remove_dir_all(&self.base);
    }
}

#[test]
fn the_live_page_moves_keeps_to_itself_and_survives_its_dashboard() {
    if !is_there() {
        return;
    }
    let pipeline = Pipeline::start("page", &[]);
    drive("live.mjs", &[&pipeline.url("page"), &pipeline.wrapper(), "page"]);
}

#[test]
fn what_is_hidden_is_named_added_and_undone_on_the_page() {
    if !is_there() {
        return;
    }
    let pipeline = Pipeline::start("loop", &["--hide", "delay:d=0.02"]);
    drive("live.mjs", &[&pipeline.url("loop"), &pipeline.wrapper(), "loop", "delay"]);
}

#[test]
fn a_guided_recording_is_led_from_its_page() {
    if !is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let words =
        ["guide", "--source", "sim", "--hide", "lag", "--speed", "4", "--dashboard", "127.0.0.1:0", "-o", "a.csv"];
    let mut child = Command::new(PROGRAM)
        .args(words)
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
    drive("guide.mjs", &[line.trim().trim_start_matches("dashboard: ")]);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn the_page_in_a_browser_names_what_is_hidden_and_says_what_the_program_says() {
    if !is_there() {
        return;
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/truerate.html");
    if !page.exists() {
        eprintln!("skipped: no target/truerate.html here; `deploy/page` makes it");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = Command::new(PROGRAM).args(arguments).current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let hidden = ["simulate", "--hide", "encoder-eccentricity", "--seconds", "60", "--seed", "5", "-o", "log.csv"];
    run(&hidden);
    let said = run(&["diagnose", "log.csv", "--format", "json"]);
    run(&["simulate", "--hide", "encoder-eccentricity", "--seconds", "60", "--seed", "6", "-o", "second.csv"]);
    let together = run(&["diagnose", "log.csv", "second.csv", "--format", "json"]);
    let log = fs::read_to_string(folder.path().join("log.csv")).unwrap();
    let mut lines: Vec<&str> = log.lines().collect();
    let torn = lines[5000].replacen(',', ",x", 1);
    lines[5000] = &torn;
    let place = |name: &str| folder.path().join(name);
    fs::write(place("said.json"), said).unwrap();
    fs::write(place("together.json"), together).unwrap();
    fs::write(place("broken.csv"), lines.join("\n")).unwrap();
    let names = ["log.csv", "said.json", "broken.csv", "second.csv", "together.json"];
    let parquet = Path::new(env!("CARGO_MANIFEST_DIR")).join("readers/tests/seeds/small.parquet");
    let paths: Vec<_> = std::iter::once(page).chain(names.map(place)).chain([parquet]).collect();
    drive("page.mjs", &paths.iter().map(|path| path.to_str().unwrap()).collect::<Vec<_>>());
}

#[test]
fn a_vehicle_drives_in_the_page_and_what_is_hidden_in_it_is_found() {
    if !is_there() {
        return;
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/truerate.html");
    if !page.exists() {
        eprintln!("skipped: no target/truerate.html here; `deploy/page` makes it");
        return;
    }
    drive("drive.mjs", &[page.to_str().unwrap()]);
}

#[test]
fn reports_open_offline_from_disk() {
    if !is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = Command::new(PROGRAM).args(arguments).current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&["simulate", "--hide", "delay:d=0.02", "--seconds", "40", "--rate", "100", "--seed", "5", "-o", "log.csv"]);
    run(&["diagnose", "log.csv", "--report", "report.html"]);
    run(&["ladder", "log.csv", "--report", "ladder.html", "-o", "new.toml"]);
    run(&["fit", "log.csv", "-o", "base.toml"]);
    run(&["compare", "log.csv", "--model", "new.toml", "--against", "base.toml", "--report", "two.html"]);
    run(&[
        "simulate",
        "--hide",
        "delay:d=0.02",
        "--reference",
        "orientation",
        "--seconds",
        "40",
        "--seed",
        "5",
        "-o",
        "three.csv",
    ]);
    run(&["ladder", "three.csv", "--report", "three.html"]);
    for (report, wanted) in
        [("report", &[][..]), ("ladder", &["model"]), ("two", &["two-models"]), ("three", &["model"])]
    {
        let file = folder.path().join(format!("{report}.html"));
        let arguments: Vec<&str> = [file.to_str().unwrap(), report].into_iter().chain(wanted.iter().copied()).collect();
        drive("report.mjs", &arguments);
    }
}
