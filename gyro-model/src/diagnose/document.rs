//! The tables of `docs/method.md`, printed from the tests themselves.

use super::{
    admission::{ADMISSION, ELIMINATION},
    contrast::ALIKE,
    decision::{Condition, Test},
    verdicts::VERDICTS,
};
use crate::thresholds::{self, Origin, Threshold};
use std::{fmt::Write as _, fs, path::Path};

fn condition<S>(condition: &Condition<S>) -> String {
    let limit = |threshold: &Threshold| match threshold.unit {
        "1" => format!("{}", threshold.value),
        unit => format!("{} {unit}", threshold.value),
    };
    match condition {
        Condition::Above(measure, threshold) => format!("{} > {}", measure.name, limit(threshold)),
        Condition::Below(measure, threshold) => format!("{} < {}", measure.name, limit(threshold)),
        Condition::Is(fact) => fact.says.to_owned(),
        Condition::Not(fact) => format!("not {}", fact.says),
    }
}

fn all<S>(conditions: &[Condition<S>]) -> String {
    conditions.iter().map(condition).collect::<Vec<_>>().join("; ")
}

fn tests<S>(tests: &[Test<S>]) -> String {
    let mut table = String::from("| test | asks that | is passed by |\n| --- | --- | --- |\n");
    for test in tests {
        let ways: Vec<String> = test.ways.iter().map(|way| all(way)).collect();
        let _ = writeln!(table, "| {} | {} | {} |", test.name, test.asks, ways.join(" **or** "));
    }
    table
}

fn verdicts() -> String {
    let mut table = String::from("| finding | where |\n| --- | --- |\n");
    for rule in VERDICTS {
        let when = if rule.when.is_empty() { "otherwise".to_owned() } else { all(rule.when) };
        let _ = writeln!(table, "| {} | {when} |", rule.name);
    }
    table
}

fn thresholds() -> String {
    let mut table =
        String::from("| threshold | value | unit | what it is | origin |\n| --- | --: | --- | --- | --- |\n");
    for Threshold { name, value, unit, says, origin } in thresholds::ALL {
        let name = name.to_lowercase().replace('_', "-");
        let origin = match origin {
            Origin::Derived(how) => format!("derived: {how}"),
            Origin::Literature(what) => (*what).to_owned(),
            Origin::Calibrated(how) => format!("calibrated: {how}"),
            Origin::ByHand => "by hand".to_owned(),
        };
        let _ = writeln!(table, "| {name} | {value} | {unit} | {} | {origin} |", says.trim());
    }
    table
}

/// With `UPDATE_DOCS=1` in the environment the tables are written anew.
#[test]
fn the_method_shows_the_tests_as_they_are() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/method.md");
    let old = fs::read_to_string(&path).unwrap().replace('\u{a0}', " ");
    let tables = [
        ("admission", tests(ADMISSION)),
        ("elimination", tests(ELIMINATION)),
        ("alike", tests(ALIKE)),
        ("verdicts", verdicts()),
        ("thresholds", thresholds()),
    ];
    let mut new = old.clone();
    for (name, table) in tables {
        let (open, close) = (format!("<!-- {name} -->\n"), format!("<!-- /{name} -->"));
        let start = new.find(&open).expect(name) + open.len();
        let end = start + new[start..].find(&close).expect(name);
        new.replace_range(start..end, &table);
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, &new).unwrap();
    } else {
        assert!(old == new, "docs/method.md shows other tests: run `UPDATE_DOCS=1 cargo test -p gyro-model document`");
    }
}
