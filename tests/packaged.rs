//! What people install: the manual, the completions, and the Debian package, tried in a root of its own.

mod common;

use clap::CommandFactory;
use common::{Bench, Outcome};
use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};
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

/// `deploy/release` with a folder of its own.
fn release(folder: &Path, parts: &[&str], architectures: &str) -> Outcome {
    let mut command = Command::new("deploy/release");
    command.args(parts).current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    Outcome::of(&command.env("EDITION", folder).env("ARCHITECTURES", architectures).output().unwrap())
}

#[test]
fn an_edition_has_its_own_lines_of_the_changelog_and_names_what_was_not_made() {
    let folder = tempfile::tempdir().unwrap();
    let made = release(folder.path(), &["notes"], "x86_64");
    assert_eq!(made.code, 0, "{made:?}");
    let version = env!("CARGO_PKG_VERSION");
    let notes = fs::read_to_string(folder.path().join(format!("CHANGES-{version}.md"))).unwrap();
    let heads: Vec<&str> = notes.lines().filter(|line| line.starts_with("## ")).collect();
    assert!(heads.len() == 1 && heads[0].starts_with(&format!("## {version} (")), "{heads:?}");
    let whole = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("CHANGELOG.md")).unwrap();
    assert!(whole.contains(notes.trim_end()), "not the changelog's own lines");
    let checked =
        Command::new("sha256sum").args(["--check", "--strict", "SHA256SUMS"]).current_dir(folder.path()).output();
    assert!(checked.unwrap().status.success());
    // What has no program gets no package; what can be made is made.
    let unmade = release(folder.path(), &["deb", "notes"], "no-machine");
    assert!(unmade.code == 1 && unmade.out.contains("Debian package no-machine: "), "{unmade:?}");
    assert!(unmade.out.contains("not made here:") && unmade.out.contains("CHANGES-"), "{unmade:?}");
    assert_eq!(release(folder.path(), &["everything"], "x86_64").code, 2);
}

#[test]
fn the_image_is_made_twice_with_the_same_bytes_and_holds_the_program() {
    let works = Command::new("umoci").arg("--version").stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    if !works {
        eprintln!("skipped: no umoci here (apt-get install umoci); the image is not tried");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = b"\x7fELF and no more";
    fs::write(folder.path().join(".truerate-x86_64"), program).unwrap();
    let name = format!("truerate-{}-amd64.oci.tar", env!("CARGO_PKG_VERSION"));
    let make = || {
        let made = release(folder.path(), &["image"], "x86_64");
        assert_eq!(made.code, 0, "{made:?}");
        fs::read(folder.path().join(&name)).unwrap()
    };
    let first = make();
    assert!(first == make(), "two images differ");
    let inside = |command: &mut Command| assert!(command.current_dir(folder.path()).status().unwrap().success());
    fs::create_dir(folder.path().join("layout")).unwrap();
    inside(Command::new("tar").args(["-xf", &name, "-C", "layout"]));
    let image = format!("layout:{}", env!("CARGO_PKG_VERSION"));
    inside(Command::new("umoci").args(["unpack", "--rootless", "--image", &image, "bundle"]));
    assert_eq!(fs::read(folder.path().join("bundle/rootfs/usr/bin/truerate")).unwrap(), program);
    let runs: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("bundle/config.json")).unwrap()).unwrap();
    assert_eq!((&runs["process"]["args"][0], &runs["process"]["cwd"]), (&"/usr/bin/truerate".into(), &"/logs".into()));
}
