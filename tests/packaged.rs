//! What people install: the manual, the completions, and the Debian package, tried in a root of its own.

mod common;

use clap::CommandFactory;
use common::{Bench, Outcome};
use std::process::{Command, Stdio};
use truerate::cli::Cli;

#[test]
fn every_command_has_a_page_whose_examples_stand_line_by_line() {
    let bench = Bench::new();
    bench.ok(&["man", "new/man1"]);
    for command in Cli::command().get_subcommands() {
        let page = bench.text(&format!("new/man1/truerate-{}.1", command.get_name()));
        let text = page.replace("\\-", "-").replace("\\*(Aq", "'").replace("\\\\", "\\");
        let help = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
        for line in help.lines().filter(|line| line.starts_with("  truerate")) {
            assert!(text.lines().any(|own| own == line), "{}: no {line:?} in\n{text}", command.get_name());
        }
    }
    assert!(bench.text("new/man1/truerate.1").contains("truerate\\-diagnose(1)"));
    bench.file("taken", "");
    assert!(bench.refused(&["man", "taken"]).contains("taken: the manual cannot be written"));
}

#[test]
fn a_shell_completes_commands_and_flags() {
    let bench = Bench::new();
    for (shell, word) in [("bash", "complete -F _truerate"), ("zsh", "#compdef truerate"), ("fish", "-c truerate")] {
        let script = bench.ok(&["completions", shell]);
        assert!(script.contains(word) && script.contains("diagnose"), "{shell}: {script}");
    }
    // What bash itself offers: COMP_WORDS as it lays them before a function of completion is called.
    bench.file("complete.bash", bench.ok(&["completions", "bash"]));
    let ask = |words: &str, last: &str| {
        let script = format!(
            ". ./complete.bash; COMP_WORDS=({words} {last}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             _truerate truerate '{last}' ''; echo \"${{COMPREPLY[@]}}\""
        );
        let output = Command::new("bash").args(["-c", &script]).current_dir(bench.path(".")).output().unwrap();
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    };
    assert_eq!(ask("truerate", "diag"), "diagnose");
    assert_eq!(ask("truerate diagnose", "--fail"), "--fail-on");
}

/// What the package's test cannot do without, and this machine lacks.
fn lacking() -> Option<String> {
    let works = |words: &[&str]| {
        let tried = Command::new(words[0]).args(&words[1..]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        tried.is_ok_and(|status| status.success())
    };
    let needs: [(&[&str], &str); 3] = [
        (&["cargo-deb", "--version"], "cargo-deb (cargo install cargo-deb --locked)"),
        (&["dpkg", "--version"], "dpkg"),
        (&["unshare", "--mount", "mount", "-t", "tmpfs", "tmpfs", "/mnt"], "right to mount"),
    ];
    needs.iter().find(|(words, _)| !works(words)).map(|(_, name)| (*name).to_owned())
}

#[test]
fn the_debian_package_is_installed_runs_and_leaves_nothing() {
    if let Some(what) = lacking() {
        eprintln!("skipped: no {what} here; the Debian package is not tried");
        return;
    }
    let here = env!("CARGO_MANIFEST_DIR");
    let built = Command::new("deploy/package")
        .args(["deb", "--fast"])
        .current_dir(here)
        .env("PROGRAM", env!("CARGO_BIN_EXE_truerate"))
        .output()
        .unwrap();
    let built = Outcome::of(&built);
    assert_eq!(built.code, 0, "{built:?}");
    let package = format!("{here}/{}", built.out.lines().last().unwrap());
    let root = tempfile::tempdir().unwrap();
    let tried = Command::new("unshare")
        .args(["--mount", "tests/packaged.sh", &package])
        .arg(root.path())
        .current_dir(here)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let tried = Outcome::of(&tried);
    assert!(tried.code == 0 && tried.out.ends_with("all of it is gone\n"), "{tried:?}");
    assert!(tried.out.contains("late"), "the delay is not told: {tried:?}");
}
