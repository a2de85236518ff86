//! The tests of a suspect in words.

use super::{ExplainedView, TestView};
use gyro_model::diagnosis::{Explained, Relation, SuspectStage, TestCondition, TestName, TestOutcome};

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
    ExplainedView {
        effect: explained.effect.clone(),
        says: says(explained),
        outcome,
        tests: explained.tests.iter().map(test).collect(),
    }
}

/// An effect that would remove less of the error is told apart from those that compete.
const NEXT_TO_NOTHING: f64 = 0.02;

/// Why, in a sentence.
fn says(explained: &Explained) -> String {
    let share = explained.promises.map(|share| share.clamp(0.0, 1.0));
    let whole = |share: f64| format!("{:.0} %", 100.0 * share);
    match explained.stage {
        // What it removes, refitted, is in the list of suspects: one number for one thing.
        SuspectStage::Admitted => "can be it: nothing speaks against it".to_owned(),
        SuspectStage::Refit => {
            let failed = |name: &TestName| explained.tests.iter().any(|test| test.test == *name && !test.passed);
            let reason = REASONS.iter().find(|(name, _)| failed(name)).map(|(_, reason)| (*reason).to_owned());
            let other = || {
                explained.tests.iter().find(|test| !test.passed).map(|test| format!("it fails the test {}", test.test))
            };
            format!(
                "not named: {}",
                reason.or_else(other).unwrap_or_else(|| "another effect explains the error better".to_owned())
            )
        }
        SuspectStage::Scan => match share {
            Some(share) if share > NEXT_TO_NOTHING => {
                format!(
                    "not named: it would remove {} of the error, and fits less well than the best above",
                    whole(share)
                )
            }
            _ => "not named: it would remove next to nothing of the error".to_owned(),
        },
    }
}

/// What a test that failed means, the plainest first.
const REASONS: &[(TestName, &str)] = &[
    (TestName::Rows, "it would leave hardly a row to judge by"),
    (TestName::Bounds, "it would need a value that no sensor has"),
    (TestName::Size, "it would have to be far larger than such sensors have it"),
    (TestName::Line, "the gyro's own readings have no such line"),
    (TestName::Motion, "the reference has the same line, so it is motion"),
    (TestName::Error, "the error gets no smaller with it"),
    (TestName::Significance, "noise alone could look like it"),
    (TestName::Share, "it removes too little of the error"),
    (TestName::HeldOut, "it does not hold on parts of the log that it was not fitted to"),
    (TestName::EveryAveragingTime, "it makes the error larger over some averaging times"),
    (TestName::Mean, "the error is no more than noise, which it would only average away"),
    (TestName::ShownOnce, "it shows only once in the log, and a wandering bias can look like it"),
    (TestName::Known, "the log does not show how large it is"),
];

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
    fn each_suspect_has_a_sentence_by_how_far_it_came() {
        let explained = |stage, promises, tests| Explained {
            effect: "delay".into(),
            stage,
            score: Some(40.0),
            promises: Some(promises),
            tests,
        };
        let failed = |test| TestOutcome { test, ..outcome(false, Vec::new()) };
        let of = |stage, promises, tests| says(&explained(stage, promises, tests));
        assert!(
            of(SuspectStage::Admitted, 0.956, vec![outcome(true, Vec::new())]).contains("nothing speaks against it")
        );
        assert!(of(SuspectStage::Scan, 0.001, Vec::new()).contains("next to nothing"));
        assert!(of(SuspectStage::Scan, 0.44, Vec::new()).contains("44 %"));
        // The plainest reason of several.
        let two = vec![failed(TestName::HeldOut), failed(TestName::Bounds)];
        assert_eq!(of(SuspectStage::Refit, 0.5, two), "not named: it would need a value that no sensor has");
        // A test that has no words of its own is still named.
        assert!(of(SuspectStage::Refit, 0.5, vec![failed(TestName::Channel)]).contains("channel"));
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
