//! Every example that a help text prints does what it says: run as a shell runs it, in a folder with logs made for the purpose.

mod common;

use clap::{CommandFactory, Parser};
use common::{Bench, Outcome};
use std::{
    io::Read,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};
use truerate::cli::Cli;

/// No example takes longer, however busy the machine is.
const DEADLINE: Duration = Duration::from_secs(240);

/// The examples of every help text, command by command: what stands behind a gap of two spaces is said of them.
fn examples() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for command in Cli::command().get_subcommands() {
        let text = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
        found.extend(lines_of(&text).map(|line| (command.get_name().to_owned(), line)));
    }
    let text = Cli::command().get_after_long_help().unwrap().to_string();
    found.extend(lines_of(&text).map(|line| ("truerate".to_owned(), line)));
    found
}

fn lines_of(text: &str) -> impl Iterator<Item = String> {
    let own: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("  ")).collect();
    let lines = own.into_iter().filter(|line| line.starts_with("truerate "));
    let lines: Vec<String> = lines.map(|line| line.split("  ").next().unwrap_or(line).trim().to_owned()).collect();
    lines.into_iter()
}

#[test]
fn no_line_of_a_help_text_is_so_long_that_it_is_broken() {
    let root = Cli::command();
    for command in root.get_subcommands().chain([&root]) {
        let text = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
        for line in text.lines() {
            assert!(line.chars().count() <= 100, "{}: {line}", command.get_name());
        }
    }
}

/// The words of a command line without its redirections.
fn words(line: &str) -> Vec<&str> {
    let end = line.find(['<', '>', '#', '|']).unwrap_or(line.len());
    line[..end].split_whitespace().collect()
}

/// A folder with every file that the examples name.
fn folder() -> Bench {
    let bench = Bench::new();
    let make = |name: &str, seed: &str| {
        let line =
            ["simulate", "--hide", "delay:d=0.012", "--seconds", "20", "--axis", "x", "--seed", seed, "-o", name];
        bench.ok(&line);
    };
    for (name, seed) in [("log.csv", "1"), ("log.csv.gz", "1"), ("new.csv.gz", "2"), ("third.csv", "3")] {
        make(name, seed);
    }
    bench.ok(&["add", "log.csv.gz", "delay", "-o", "model.toml"]);
    for name in ["a.toml", "b.toml", "old.toml", "m.toml"] {
        std::fs::copy(bench.path("model.toml"), bench.path(name)).unwrap();
    }
    for (log, name) in [("log.csv", "a.evidence"), ("new.csv.gz", "b.evidence"), ("third.csv", "c.evidence")] {
        bench.ok(&["evidence", log, "-o", name, "--part", "17", "--type", "BMI160"]);
    }
    std::fs::copy(bench.path("a.evidence"), bench.path("fleet.evidence")).unwrap();
    bench.ok(&["fleet", "fleet.evidence", "--export", "type.toml"]);
    bench.file("fleet.toml", "seconds = 20.0\n[type.BMI160]\nparts = 2\n");
    // A format is told by the bytes: what the readers' own tests hold to real ULog files is not asked again here.
    std::fs::copy(bench.path("log.csv"), bench.path("flight.ulg")).unwrap();
    bench.file("car.dbc", "BO_ 256 IMU: 2 X\n SG_ YAW_RATE : 0|16@1- (0.01,0) [0|0] \"deg/s\" X\n");
    bench.file(
        "candump.log",
        (0..20).map(|k| format!("(1.{k:02}0000) can0 100#{k:02X}00\n")).collect::<Vec<_>>().concat(),
    );
    let recorded = run(&bench, "truerate run --source log.csv.gz --speed max --dashboard off --record recording.mcap");
    assert_eq!(recorded.code, 0, "{recorded:?}");
    bench
}

/// The program as `truerate` in a shell, in this folder, in a domain of its own.
fn shell(bench: &Bench, line: &str) -> Command {
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_truerate"));
    let path = std::env::var("PATH").unwrap_or_default();
    let mut command = Command::new("sh");
    command
        .args(["-c", line])
        .current_dir(bench.path("."))
        .env_remove("TRUERATE_LOG")
        .env("TRUERATE_RUNTIME_DIR", bench.path("r"))
        // A browser that shows nothing.
        .env("BROWSER", "true")
        .env("PATH", format!("{}:{path}", program.parent().unwrap().display()))
        .stdin(Stdio::null());
    command
}

fn run(bench: &Bench, line: &str) -> Outcome {
    let mut child = shell(bench, line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (mut out, mut err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let reader = std::thread::spawn(move || {
        let mut text = Vec::new();
        let _ = out.read_to_end(&mut text);
        text
    });
    let mut error = String::new();
    let _ = err.read_to_string(&mut error);
    let status = ended(&mut child, line);
    Outcome { code: status, out: String::from_utf8_lossy(&reader.join().unwrap()).into_owned(), err: error }
}

fn ended(child: &mut Child, line: &str) -> i32 {
    let until = Instant::now() + DEADLINE;
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code().unwrap_or(-1);
        }
        assert!(Instant::now() < until, "`{line}` does not end");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn every_example_of_every_help_text_and_of_the_readme_is_understood() {
    let readme = include_str!("../README.md");
    let shown = readme.lines().filter_map(|line| line.strip_prefix("$ ")).filter(|line| line.starts_with("truerate "));
    let lines: Vec<String> = examples().into_iter().map(|(_, line)| line).chain(shown.map(str::to_owned)).collect();
    assert!(lines.len() > 40, "{lines:?}");
    for line in &lines {
        if let Err(error) = Cli::try_parse_from(words(line)) {
            panic!("`{line}`: {error}");
        }
    }
    // A command that is run by hand shows how.
    for command in Cli::command().get_subcommands().filter(|c| !c.is_hide_set()) {
        let name = command.get_name();
        assert!(["service", "top"].contains(&name) || examples().iter().any(|(own, _)| own == name), "{name}");
    }
}

#[test]
fn every_example_on_a_log_runs() {
    let bench = folder();
    let live = ["demo", "control", "status", "service", "top"];
    let all = examples();
    // What makes a file comes first.
    let (makers, rest): (Vec<_>, Vec<_>) = all.iter().partition(|(_, line)| line.contains("simulate"));
    let mut seen = 0;
    for (name, line) in makers.into_iter().chain(rest) {
        // A live source has no end; a serial port is not there. Both are run by the tests of the pipeline and of `guide`.
        let of_live = live.contains(&name.as_str())
            || name == "run" && !line.contains("--speed max")
            || words(line).get(1) == Some(&"guide") && !line.contains("--source sim")
            || words(line).get(1).is_some_and(|word| live.contains(word));
        if of_live {
            continue;
        }
        let line = if line.starts_with("truerate run") { format!("{line} --dashboard off") } else { line.clone() };
        // Each begins with the same model, whatever the one before wrote.
        std::fs::copy(bench.path("old.toml"), bench.path("model.toml")).unwrap();
        let done = run(&bench, &line);
        let wanted: &[i32] = if line.contains("--fail-on") { &[0, 3] } else { &[0] };
        assert!(wanted.contains(&done.code), "`{line}` of `{name} --help`: {done:?}");
        assert!(!done.out.contains("NaN") && !done.err.contains("panicked"), "`{line}`: {done:?}");
        seen += 1;
    }
    assert!(seen > 30, "only {seen} were run");
}

#[test]
fn every_example_on_a_running_pipeline_runs() {
    let bench = folder();
    let mut running: Vec<Child> = ["default", "left-wheel"]
        .iter()
        .map(|name| {
            let line = format!("exec truerate run --hide delay --dashboard off --instance {name}");
            shell(&bench, &line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        })
        .collect();
    let answered = std::panic::catch_unwind(|| {
        for name in ["default", "left-wheel"] {
            let until = Instant::now() + DEADLINE;
            while run(&bench, &format!("truerate status --instance {name}")).code != 0 {
                assert!(Instant::now() < until, "{name} does not run");
                std::thread::sleep(Duration::from_millis(200));
            }
        }
        for (_, line) in examples().iter().filter(|(name, _)| ["control", "status"].contains(&name.as_str())) {
            let until = Instant::now() + DEADLINE;
            let mut done = run(&bench, line);
            while done.err.contains("nothing is learned yet") && Instant::now() < until {
                std::thread::sleep(Duration::from_millis(500));
                done = run(&bench, line);
            }
            // A model is added on trial: whether it is better is the vehicle's to say; the answer has to be one.
            let is_answer = done.code == 0 || done.err.contains("not better");
            assert!(is_answer && done.code < 2, "`{line}`: {done:?}");
        }
    });
    for child in &mut running {
        let id = rustix::process::Pid::from_child(child);
        let _ = rustix::process::kill_process(id, rustix::process::Signal::INT);
        ended(child, "truerate run");
    }
    if let Err(why) = answered {
        std::panic::resume_unwind(why);
    }
}
