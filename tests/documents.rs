//! What documents show of the program, done as they show it: each `$` line of a page is run, and what stands below it is what comes.

mod common;

use common::Bench;
use serde_json::Value;
use std::{collections::BTreeSet, path::Path, process::Command};

/// A command, and the lines that it prints.
struct Shown {
    command: String,
    prints: Vec<String>,
}

/// The commands of the blocks ```` ```console ````. A command goes on as long as a quote is open.
fn shown(document: &str) -> Vec<Shown> {
    let mut all: Vec<Shown> = Vec::new();
    let mut is_inside = false;
    for line in document.lines() {
        match line.strip_prefix("$ ") {
            _ if line.starts_with("```") => is_inside = line == "```console",
            _ if !is_inside => {}
            Some(command) => all.push(Shown { command: command.to_owned(), prints: Vec::new() }),
            None => {
                let last = all.last_mut().expect("a block begins with a command");
                if last.command.matches('\'').count() % 2 == 1 {
                    last.command = format!("{}\n{line}", last.command);
                } else {
                    last.prints.push(line.to_owned());
                }
            }
        }
    }
    all
}

/// Runs what a document shows, in a folder and a domain of its own; at least so many commands show what they print.
fn comes(document: &str, least: usize) {
    let bench = Bench::new();
    let program = Path::new(env!("CARGO_BIN_EXE_truerate")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let all = shown(document);
    assert!(all.iter().filter(|shown| !shown.prints.is_empty()).count() >= least, "the page shows little");
    for shown in all {
        let mut command = Command::new("bash");
        command.args(["-c", &shown.command]).current_dir(bench.path("."));
        command.env("PATH", &path).env("TRUERATE_RUNTIME_DIR", bench.path("domain"));
        let ran = command.output().unwrap();
        let (out, error) = (String::from_utf8_lossy(&ran.stdout), String::from_utf8_lossy(&ran.stderr));
        assert!(ran.status.success(), "{}: {error}", shown.command);
        if !shown.prints.is_empty() {
            assert_eq!(out.lines().collect::<Vec<_>>(), shown.prints, "{}: {error}", shown.command);
        }
    }
}

#[test]
fn what_the_page_on_formats_shows_is_what_comes() {
    comes(include_str!("../docs/formats.md"), 1);
}

/// The keys of a value and of what it holds, but of `closed` ones what they hold.
fn keys(value: &Value, closed: &[&str], into: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                into.insert(key.clone());
                if !closed.contains(&key.as_str()) {
                    keys(value, closed, into);
                }
            }
        }
        Value::Array(all) => all.iter().for_each(|value| keys(value, closed, into)),
        _ => {}
    }
}

#[test]
fn the_page_on_formats_has_every_key_of_a_result() {
    let page = include_str!("../docs/formats.md");
    let bench = Bench::new();
    let log = bench.path("log.csv");
    let log = log.to_str().unwrap();
    let simulated = bench.run(&["simulate", "--hide", "delay:d=0.012", "--seconds", "120", "--axis", "z", "-o", log]);
    assert_eq!(simulated.code, 0, "{simulated:?}");
    let mut all = BTreeSet::new();
    for words in [["diagnose", log], ["ladder", log]] {
        let done = bench.run(&[words[0], words[1], "--format", "json"]);
        // What a finding and a picture hold depends on the case.
        keys(&serde_json::from_str(&done.out).unwrap(), &["finding", "detail"], &mut all);
    }
    let lacking: Vec<&String> = all.iter().filter(|key| !page.contains(&format!("`{key}`"))).collect();
    assert!(lacking.is_empty() && all.len() > 60, "docs/formats.md lacks {lacking:?} of {} keys", all.len());
}

#[test]
fn what_the_page_on_continuous_integration_shows_is_what_comes() {
    comes(include_str!("../docs/ci.md"), 5);
}

#[test]
fn what_the_page_on_a_robot_shows_is_what_comes() {
    comes(include_str!("../docs/robot.md"), 5);
}
