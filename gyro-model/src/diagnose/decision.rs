//! A decision as data: named tests over plain numbers, each number held against a threshold.
//!
//! A test passes where every condition of one of its ways holds. All tests that apply have to pass. So a decision is a conjunction
//! of tests, each of them a disjunction of ways, each of them a conjunction of inequalities; nothing else takes part in it.

use crate::{
    diagnosis::{Relation, TestCondition, TestName, TestOutcome},
    thresholds::Threshold,
};

/// One inequality.
#[derive(Clone, Copy)]
pub(super) enum Condition<S: 'static> {
    /// The measure lies above the threshold.
    Above(&'static Measure<S>, &'static Threshold),
    /// The measure lies below the threshold.
    Below(&'static Measure<S>, &'static Threshold),
    /// Something that is so or is not.
    Is(&'static Fact<S>),
    /// The same, denied.
    Not(&'static Fact<S>),
}

/// A number of the subject `S`.
pub(super) struct Measure<S> {
    /// What it is called.
    pub name: &'static str,
    /// Its value.
    pub of: fn(&S) -> f64,
}

/// Something that is so or is not.
pub(super) struct Fact<S> {
    /// What is said where it is so.
    pub says: &'static str,
    /// Whether it is.
    pub of: fn(&S) -> bool,
}

/// A named test.
pub(super) struct Test<S: 'static> {
    /// Its name.
    pub name: TestName,
    /// What it asks, in a sentence.
    pub asks: &'static str,
    /// Whether it is asked of this subject: every condition has to hold.
    pub applies: &'static [Condition<S>],
    /// The ways to pass it.
    pub ways: &'static [&'static [Condition<S>]],
}

impl<S> Condition<S> {
    pub(super) fn holds(&self, subject: &S) -> bool {
        match self {
            Self::Above(measure, threshold) => (measure.of)(subject) > threshold.value,
            Self::Below(measure, threshold) => (measure.of)(subject) < threshold.value,
            Self::Is(fact) => (fact.of)(subject),
            Self::Not(fact) => !(fact.of)(subject),
        }
    }

    fn told(&self, subject: &S) -> TestCondition {
        let number = |measure: &Measure<S>, threshold: &Threshold, relation: Relation| TestCondition {
            measure: measure.name.to_owned(),
            relation,
            value: Some((measure.of)(subject)).filter(|value| value.is_finite()),
            threshold: Some(threshold.value),
            unit: threshold.unit.to_owned(),
            holds: self.holds(subject),
        };
        let fact = |fact: &Fact<S>, relation: Relation| TestCondition {
            measure: fact.says.to_owned(),
            relation,
            value: None,
            threshold: None,
            unit: String::new(),
            holds: self.holds(subject),
        };
        match self {
            Self::Above(measure, threshold) => number(measure, threshold, Relation::Above),
            Self::Below(measure, threshold) => number(measure, threshold, Relation::Below),
            Self::Is(is) => fact(is, Relation::Is),
            Self::Not(is) => fact(is, Relation::IsNot),
        }
    }
}

impl<S> Test<S> {
    fn applies(&self, subject: &S) -> bool {
        self.applies.iter().all(|condition| condition.holds(subject))
    }

    fn passes(&self, subject: &S) -> bool {
        self.ways.iter().any(|way| way.iter().all(|condition| condition.holds(subject)))
    }
}

/// One row of a table of which the first that holds decides.
pub(super) struct Rule<S: 'static, T> {
    /// What it comes to, in a few words: `docs/method.md` prints it.
    #[cfg_attr(not(test), expect(dead_code, reason = "read by the test that holds docs/method.md"))]
    pub name: &'static str,
    /// Every condition has to hold.
    pub when: &'static [Condition<S>],
    /// What is then so.
    pub then: fn(&S) -> T,
}

/// What the first rule that holds says.
pub(super) fn first<S, T>(rules: &[Rule<S, T>], subject: &S) -> Option<T> {
    let holds = |rule: &&Rule<S, T>| rule.when.iter().all(|condition| condition.holds(subject));
    rules.iter().find(holds).map(|rule| (rule.then)(subject))
}

/// Whether every test that applies is passed.
pub(super) fn passes<S>(tests: &[Test<S>], subject: &S) -> bool {
    tests.iter().all(|test| !test.applies(subject) || test.passes(subject))
}

/// Each test with its numbers.
pub(super) fn outcomes<S>(tests: &[Test<S>], subject: &S) -> Vec<TestOutcome> {
    let told = |way: &&[Condition<S>]| way.iter().map(|condition| condition.told(subject)).collect();
    tests
        .iter()
        .map(|test| TestOutcome {
            test: test.name,
            asks: test.asks.to_owned(),
            applies: test.applies(subject),
            passed: !test.applies(subject) || test.passes(subject),
            ways: test.ways.iter().map(told).collect(),
        })
        .collect()
}
