//! `truerate paper`, the real program.

use assert_cmd::Command;
use std::fs;

#[test]
fn paper_writes_seven_figures_and_a_page_that_stands_alone() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("paper");
    let run = Command::cargo_bin("truerate").unwrap().args(["paper", "-o"]).arg(&output).assert().success();
    let printed = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    assert!(printed.contains("does not agree"), "{printed}");
    let page = fs::read_to_string(output.join("index.html")).unwrap();
    for number in 4..=10 {
        let figure = fs::read_to_string(output.join(format!("figure-{number}.svg"))).unwrap();
        assert!(figure.starts_with("<svg") && figure.contains(&format!("Figure {number}:")));
        assert!(page.contains(&format!("id=\"figure-{number}\"")));
    }
    for part in ["2.9681", "0.2373", "2.156", "−6.658", "°/s", "does not agree"] {
        assert!(page.contains(part), "{part}");
    }
    let elsewhere = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!elsewhere.contains("http") && !elsewhere.contains("<script"), "the page asks for something elsewhere");
}

#[test]
fn paper_into_a_folder_that_cannot_be_made_fails_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let run = Command::cargo_bin("truerate").unwrap().args(["paper", "-o"]).arg(file.join("paper")).assert().code(1);
    let said = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("-o"), "{said}");
}
