//! What documents show of the program, done as they show it: each `$` line of a page is run, and what stands below it is what comes.

mod common;

use common::Bench;
use std::{path::Path, process::Command};

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
fn what_the_page_on_continuous_integration_shows_is_what_comes() {
    comes(include_str!("../docs/ci.md"), 5);
}

#[test]
fn what_the_page_on_a_robot_shows_is_what_comes() {
    comes(include_str!("../docs/robot.md"), 5);
}
