//! The tests of a suspect in words.

use super::{ExplainedView, TestView};
use gyro_model::diagnosis::{Explained, Relation, SuspectStage, TestCondition, TestOutcome};

/// One effect.
pub(super) fn view(explained: &Explained) -> ExplainedView {
    let failed: Vec<&str> = explained.tests.iter().filter(|test| !test.passed).map(|test| test.test.name()).collect();
    let outcome = match explained.stage {
        SuspectStage::Admitted => "passes every test".to_owned(),
        SuspectStage::Scan => format!(
            "not refitted: by the score test it removes {} of the error and gains {} in ln L",
            percent(explained.promises.map(|share| share.max(0.0))),
            number(explained.score)
        ),
        SuspectStage::Refit => format!("refused by: {}", failed.join(", ")),
    };
    ExplainedView { effect: explained.effect.clone(), outcome, tests: explained.tests.iter().map(test).collect() }
}

fn test(test: &TestOutcome) -> TestView {
    TestView {
        mark: match (test.applies, test.passed) {
            (false, _) => "–",
            (true, true) => "pass",
            (true, false) => "fail",
        },
        name: test.test.to_string(),
        asks: test.asks.clone(),
        numbers: if test.applies { numbers(test) } else { "does not apply".to_owned() },
    }
}

/// The way that passed, or the conditions that failed of the way that came nearest.
fn numbers(test: &TestOutcome) -> String {
    let nearest = test.ways.iter().max_by_key(|way| {
        let failed = way.iter().filter(|condition| !condition.holds).count();
        // Of several ways that came as near, the first.
        std::cmp::Reverse(failed)
    });
    let first_nearest = nearest.and_then(|nearest| {
        let failed = |way: &[TestCondition]| way.iter().filter(|condition| !condition.holds).count();
        test.ways.iter().find(|way| failed(way) == failed(nearest))
    });
    let Some(way) = first_nearest else { return String::new() };
    let shown = way.iter().filter(|condition| condition.holds == test.passed);
    let all: Vec<String> = shown.map(condition).collect();
    let ways = match test.ways.len() {
        0 | 1 => String::new(),
        n if test.passed => format!(" (one of {n} ways)"),
        n => format!(" (the nearest of {n} ways)"),
    };
    format!("{}{ways}", all.join("; "))
}

fn condition(condition: &TestCondition) -> String {
    let TestCondition { measure, relation, value, threshold, unit, holds } = condition;
    let unit = if unit == "1" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    match threshold {
        Some(threshold) => {
            format!("{measure} {}{unit}, asked {relation} {}{unit}", number(*value), number(Some(*threshold)))
        }
        None if *holds == (*relation == Relation::Is) => measure.clone(),
        None => format!("not {measure}"),
    }
}

/// Three figures; a dash where there is none.
fn number(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(v) if v != 0.0 && !(1e-3..1e5).contains(&v.abs()) => format!("{v:.1e}").replace('-', "−"),
        Some(v) => {
            let decimals = if v == 0.0 { 0 } else { (2.0 - v.abs().log10().floor()).clamp(0.0, 4.0) as usize };
            let text = format!("{v:.decimals$}").replace('-', "−");
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
    }
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "–".to_owned(), |share| format!("{} %", number(Some(100.0 * share))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::diagnosis::TestName;

    fn outcome(passed: bool, ways: Vec<Vec<TestCondition>>) -> TestOutcome {
        TestOutcome { test: TestName::HeldOut, asks: String::new(), applies: true, passed, ways }
    }

    fn above(value: f64, threshold: f64) -> TestCondition {
        TestCondition {
            measure: "held-out gain in ln L".into(),
            relation: Relation::Above,
            value: Some(value),
            threshold: Some(threshold),
            unit: "standard errors".into(),
            holds: value > threshold,
        }
    }

    #[test]
    fn a_test_that_failed_tells_what_was_missing_on_the_nearest_way() {
        let two = vec![vec![above(0.4, 1.2), above(0.1, 4.0)], vec![above(9.0, 2.0), above(0.9, 1.2)]];
        let says = "held-out gain in ln L 0.9 standard errors, asked above 1.2 standard errors (the nearest of 2 ways)";
        assert_eq!(numbers(&outcome(false, two)), says);
    }

    #[test]
    fn a_test_that_passed_tells_by_which_numbers() {
        let ways = vec![vec![above(1234.5, 1.2)]];
        assert_eq!(
            numbers(&outcome(true, ways)),
            "held-out gain in ln L 1234 standard errors, asked above 1.2 standard errors"
        );
    }

    #[test]
    fn numbers_have_three_figures() {
        let shown = [0.0, 1.0, 0.25, 12.345, -3.456, 4.2e-9, 123_456.0].map(|v| number(Some(v)));
        assert_eq!(shown, ["0", "1", "0.25", "12.3", "−3.46", "4.2e−9", "1.2e5"]);
    }
}
